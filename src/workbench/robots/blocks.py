"""Samples in blocks of columns: what turns a loop over samples into vector code.

A batch has its samples in rows of three. A block holds `BLOCK` of them as columns that fit the first-level cache, one
column a quantity, so that neighbouring samples lie side by side.
"""

from __future__ import annotations

import math

from workbench.compiled import inlined

BLOCK = 128
"""Samples at a time: 15 kB, which leaves room in the first-level cache for the rows that come and go. With more, the
processor stops fetching rows ahead while it computes, and a batch that is larger than the caches costs 1.4 times as
much a sample."""

INPUTS = 12
"""columns: q, qd, qdd, force; three each"""

COLUMNS = INPUTS + 3


@inlined
def load(block, q, qd, qdd, force, first, count):  # type: ignore[no-untyped-def]
    """Copy samples ``first`` to ``first + count`` of four arrays ``(n, 3)`` into columns; force may be ``(1, 3)``."""
    still = force.shape[0] == 1
    for i in range(count):
        s = first + i
        f = 0 if still else s
        for k in range(3):
            block[k * BLOCK + i] = q[s, k]
            block[(3 + k) * BLOCK + i] = qd[s, k]
            block[(6 + k) * BLOCK + i] = qdd[s, k]
            block[(9 + k) * BLOCK + i] = force[f, k]


@inlined
def store(block, tau, first, count):  # type: ignore[no-untyped-def]
    """Copy the last three columns to rows of tau ``(n, 3)``; returns how many samples are not finite."""
    bad = 0
    for i in range(count):
        t1, t2, t3 = block[INPUTS * BLOCK + i], block[(INPUTS + 1) * BLOCK + i], block[(INPUTS + 2) * BLOCK + i]
        # a difference with itself is zero for finite numbers only
        bad += 0 if (t1 - t1) + (t2 - t2) + (t3 - t3) == 0.0 else 1
        tau[first + i, 0], tau[first + i, 1], tau[first + i, 2] = t1, t2, t3
    return bad


@inlined
def finite(one, two, three):  # type: ignore[no-untyped-def]
    """Whether three numbers are all finite."""
    return math.isfinite(one) and math.isfinite(two) and math.isfinite(three)
