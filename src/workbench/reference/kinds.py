"""Kinds of constraint blocks and of joints: the numbers by which kernels tell them apart."""

from __future__ import annotations

CONNECT, WELD, JOINT, SPIN, TENDON = 0, 1, 2, 3, 4
"""SPIN says that a rod between two spherical joints does not turn about its own axis; TENDON couples linear forms of
joint coordinates by a polynomial."""

ROWS = {CONNECT: 3, WELD: 6, JOINT: 1, SPIN: 1, TENDON: 1}

SCALAR, BALL, FREE = 0, 1, 2
"""Kinds of joints; hinges and slides are SCALAR."""
