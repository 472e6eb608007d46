"""Random mechanisms against an oracle that shares no code with the reference: no wrong number is accepted."""

from __future__ import annotations

import functools
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from nullspace_oracle import NullSpaceOracle
from random_mechanisms import RandomMechanism, draw
from workbench.errors import WorkbenchError
from workbench.reference import MujocoReference

FAST, ALL = 40, 300
AGREE = 1e-8
"""Of the largest torque or force at hand: differences of the oracle's Jacobian leave 1e-10 of the velocities' part."""
SEEN = 1e-5
SAMPLES = 3
REFUSED = 0.1
"""Share of mechanisms that the reference may refuse: poses near singular ones, where branches meet."""


@functools.cache
def mechanisms(count: int) -> tuple[tuple[int, RandomMechanism], ...]:
    found: list[tuple[int, RandomMechanism]] = []
    seed = 0
    while len(found) < count:
        mechanism = draw(seed)
        if mechanism is not None:
            found.append((seed, mechanism))
        seed += 1
    return tuple(found)


def compare(seed: int, mechanism: RandomMechanism, path: Path, spoil: str = "") -> float:
    """Largest difference of torques, as a fraction of the largest; raises what the reference raises."""
    path.write_text(mechanism.text, encoding="utf-8")
    reference = MujocoReference(path)
    oracle = NullSpaceOracle(mechanism.text, mechanism.actuated, mechanism.spins, spoil)
    rng = np.random.default_rng(1000 + seed)
    na = len(mechanism.actuated)
    home = np.array(oracle.model.qpos0)
    q = home[oracle.adrs] + rng.uniform(-0.03, 0.03, (SAMPLES, na))
    qd, qdd = rng.uniform(-1, 1, (SAMPLES, na)), rng.uniform(-3, 3, (SAMPLES, na))
    force = rng.normal(0, 5, 3)
    result = reference.inverse_dynamics(q, qd, qdd, external_force=force)
    worst = 0.0
    for s in range(SAMPLES):
        found = oracle.inverse_dynamics(oracle.close(home, q[s]), qd[s], qdd[s], "platform", force)
        scale = max(float(np.abs(found.tau).max()), float(np.abs(found.qvel).max()) ** 2, 5.0)
        worst = max(worst, float(np.abs(result.tau[s] - found.tau).max()) / scale)
    return worst


def hold(count: range, tmp_path: Path) -> Counter[str]:
    features: Counter[str] = Counter()
    refused = []
    for seed, mechanism in mechanisms(max(count) + 1)[count.start :]:
        try:
            error = compare(seed, mechanism, tmp_path / f"m{seed}.xml")
        except WorkbenchError as why:
            refused.append((seed, str(why)))
            continue
        assert error < AGREE, (seed, error, sorted(mechanism.features))
        features.update(mechanism.features)
    for seed, why in refused:
        assert any(word in why for word in ("singular", "branches", "cannot be closed")), (seed, why)
    assert len(refused) <= REFUSED * len(count), refused
    return features


def test_random_mechanisms_agree_with_dense_null_spaces(tmp_path: Path) -> None:
    features = hold(range(FAST), tmp_path)
    wanted = {"hinge", "slide", "ball", "free", "rod", "damping", "frictionloss", "stiffness", "armature"}
    assert wanted <= set(features), wanted - set(features)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(4))
def test_many_random_mechanisms_agree_with_dense_null_spaces(tmp_path: Path, part: int) -> None:
    size = (ALL - FAST) // 4
    features = hold(range(FAST + part * size, FAST + (part + 1) * size), tmp_path)
    wanted = {"fluid", "gravcomp", "polynomial damping", "polynomial stiffness", "actuator armature", "frame"}
    wanted |= {"connect by bodies", "weld by bodies", "connect by sites", "weld by sites", "torquescale 0"}
    wanted |= {"joint equality", "tendon equality"}
    assert wanted <= set(features), wanted - set(features)


@pytest.mark.parametrize("spoil", ["rate", "friction"])
def test_a_spoiled_oracle_disagrees(tmp_path: Path, spoil: str) -> None:
    worst = []
    for seed, mechanism in mechanisms(12):
        try:
            worst.append(compare(seed, mechanism, tmp_path / f"m{seed}.xml", spoil))
        except WorkbenchError:
            continue
    assert max(worst) > SEEN
