"""Campaigns: a TOML file says which robot, motions and candidates; running it leaves a run directory."""
