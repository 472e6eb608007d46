"""How large a number may be."""

from __future__ import annotations

LARGEST_NUMBER = 1e10
"""MuJoCo's own bound on positions and velocities; beyond it a simulation counts as diverged. Below it products of
parameters stay far from the end of floating point."""

MOST_FREEDOMS = 300
"""Of a mechanism, all joints counted: closing its loops takes time with the third power of them (24 s to look at a file
of 300), and the reference keeps their square for every sample."""
