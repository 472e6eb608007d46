"""Torques that were measured or simulated elsewhere: reading them, what their motion is worth, where they differ."""
