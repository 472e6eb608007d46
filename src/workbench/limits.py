"""How large a number may be."""

from __future__ import annotations

LARGEST_NUMBER = 1e10
"""MuJoCo's own bound on positions and velocities; beyond it a simulation counts as diverged. Below it products of
parameters stay far from the end of floating point."""
