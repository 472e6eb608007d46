"""Orientation seen from a base that stands turned, against rotations of SciPy."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from workbench.reference.task_rows import relative


def test_orientation_seen_from_a_base_that_is_turned_any_way() -> None:
    random = np.random.default_rng(0)
    for _ in range(20):
        base, seen = (Rotation.from_quat(random.normal(size=4)) for _ in range(2))
        found = np.empty(4)
        relative.py_func(base.as_quat(scalar_first=True), seen.as_quat(scalar_first=True), found)
        expected = (base.inv() * seen).as_quat(scalar_first=True)
        assert min(np.abs(found - expected).max(), np.abs(found + expected).max()) < 1e-14
