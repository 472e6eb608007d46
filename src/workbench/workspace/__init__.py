"""Reachable workspaces: computed by discretisation, stored as a table of cells."""
