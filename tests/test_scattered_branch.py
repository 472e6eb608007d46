"""Scattered samples over the whole workspace reach the closed forms' branch, which no step of the reference knows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import workbench as wb

MODELS = Path(__file__).resolve().parents[1] / "models"
SAMPLES = 10_000
AWAY = 0.05
"""of a determinant's scale: nearer to singular poses, branches come near each other"""
MOST_LOST = 0.1
"""straight lines from neighbours may lead out of reach; such samples are marked, and no result"""


@pytest.mark.slow
@pytest.mark.parametrize("name", ["asym_2rss_ppap", "planar_4rprp"])
def test_ten_thousand_scattered_samples_are_on_the_branch_of_the_closed_form(name: str) -> None:
    mech, reference = wb.load_mechanism(MODELS / f"{name}.xml"), wb.MujocoReference(MODELS / f"{name}.xml")
    low, high = mech.reach_box()
    places = mech.reach(np.random.default_rng(18).uniform(low, high, (6 * SAMPLES, 3)))
    inside = places.q[places.reachable]
    near = np.min([np.abs(values) for values in mech.singularity_measures(inside).values()], axis=0)
    q = inside[near > AWAY][:SAMPLES]
    found, reached = reference._closer.mark(q)
    assert reached.mean() > 1.0 - MOST_LOST
    q = q[reached]
    still = np.zeros_like(q)
    seen = reference.inverse_dynamics(q, still, still, near=found.qpos[reached]).x
    assert np.abs(seen - mech.forward_kinematics(q)).max() <= 1e-10
    apart = np.abs(mech.assembly_solutions(q) - seen[:, None, :]).max(axis=2)
    assert np.nanmin(apart, axis=1).max() <= 1e-10
    if apart.shape[1] > 1:  # all assemblies in closed form: another one was there to land on, far from this one
        assert np.nanmax(apart, axis=1).min() > 1e-2
