"""Fifty random robots, their limbs different, moving at random under a random force: every closed form against MuJoCo.

The two sides share the MJCF and nothing else. A twin with one parameter of the closed form moved must not agree.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import workbench as wb
from robots import MODEL, Motion, motion_inside, peak_error, random_changes
from workbench.capabilities.robot import Robot

BOUND = 1e-10  # peak-normalised, per joint: rounding with a wide margin, below any modelling error
TIME = np.linspace(0.0, 1.0, 60)
ROBOTS = 50
MASS_MODELS = ("distributed", "lumped")


@cache
def robot(seed: int) -> tuple[dict[str, float], Robot, Motion, np.ndarray, int]:
    """Parameters, closed form, motion, force, and how many robots and motions had no place in the workspace."""
    rng = np.random.default_rng(seed)
    refused = 0
    while True:
        changes = random_changes(rng)
        mech = wb.load_mechanism(MODEL, **changes)
        motion, tries = motion_inside(mech, rng, TIME)
        refused += tries
        if motion is not None:
            return changes, mech, motion, rng.uniform(-20.0, 20.0, (len(TIME), 3)), refused


@cache
def reference(seed: int, mass_model: str) -> np.ndarray:
    changes, _, motion, force, _ = robot(seed)
    result = wb.MujocoReference(MODEL, **changes).inverse_dynamics(*motion, mass_model, force)
    assert result.closure_residual.max() <= 1e-13
    return result.tau


@pytest.mark.parametrize("seed", range(ROBOTS))
def test_closed_forms_equal_mujoco(seed: int) -> None:
    _, mech, motion, force, _ = robot(seed)
    seen = set()
    for candidate in mech.candidates.values():
        tau = candidate.function(mech, *motion, force)
        assert peak_error(tau, reference(seed, candidate.mass_model)) <= BOUND, candidate.name
        seen.add(candidate.mass_model)
    assert seen == set(MASS_MODELS)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(
    "name", ["L_left", "l_right", "a1_left", "a2_right", "a5", "m1_right", "m2_left", "m3", "m4", "m5", "m6", "I1_left",
             "I2_right", "I5", "k1_right", "k2_left", "k5", "g"],
)  # fmt: skip
def test_one_parameter_moved_by_a_thousandth_is_noticed(seed: int, name: str) -> None:
    _, mech, motion, force, _ = robot(seed)
    value = getattr(mech.parameters, name)
    inertia = {n: getattr(mech.parameters, n) for n in ("I1_left", "I1_right", "I2_left", "I2_right", "I5")}
    fractions = {f"k{n[1:]}": getattr(mech.parameters, f"k{n[1:]}") for n in inertia}
    spoiled = mech.with_parameters(**{**inertia, **fractions, name: value * 1.001})
    tau = spoiled.inverse_dynamics(*motion, "distributed", force)
    assert peak_error(tau, reference(seed, "distributed")) > 1e3 * BOUND


@pytest.mark.parametrize("seed", range(8))
def test_the_other_mass_model_and_a_missing_force_are_noticed(seed: int) -> None:
    _, mech, motion, force, _ = robot(seed)
    assert peak_error(mech.inverse_dynamics(*motion, "lumped", force), reference(seed, "distributed")) > 1e-5
    assert peak_error(mech.inverse_dynamics(*motion, "distributed"), reference(seed, "distributed")) > 1e-3


@pytest.mark.parametrize("seed", range(8))
def test_swapped_limbs_are_noticed(seed: int) -> None:
    _, mech, motion, force, _ = robot(seed)
    tau = mech.inverse_dynamics(*motion, "distributed", force)
    assert peak_error(tau[:, [0, 2, 1]], reference(seed, "distributed")) > 1e-2


def test_the_robots_are_as_various_as_promised() -> None:
    drawn = [robot(seed)[0] for seed in range(ROBOTS)]
    for name, low, high in (("a2_left", 0.7 * 0.3, 1.3 * 0.3), ("m2_right", 0.3 * 0.3, 3 * 0.3), ("payload", 0.0, 2.0)):
        values = np.array([d[name] for d in drawn])
        assert low <= values.min() < low + 0.25 * (high - low)
        assert high >= values.max() > high - 0.25 * (high - low)
    assert all(d["a1_left"] != d["a1_right"] and d["k2_left"] != d["k2_right"] for d in drawn)
    # motions that leave the workspace were drawn again, which shows that the pose range goes up to the boundary
    refused = sum(robot(seed)[4] for seed in range(ROBOTS))
    assert 50 <= refused <= 600
