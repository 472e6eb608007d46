"""Mobility of the 2RSS+PPaP robot, by count and by rank; and a count that is spoiled."""

import numpy as np
import pytest

import workbench as wb
from workbench.robots import screws
from workbench.robots.asym_2rss_ppap import mobility as count

MODEL = "models/asym_2rss_ppap.xml"


@pytest.mark.parametrize("changes", [{}, {"a2_left": 0.33, "L_right": 0.22, "a6": 0.07}])
def test_count_and_rank_agree(changes: dict[str, float]) -> None:
    counted = wb.load_mechanism(MODEL, **changes).mobility_count()
    ranked = wb.MujocoReference(MODEL, **changes).mobility()
    assert counted == {
        "joint freedoms": 20,
        "lost joint parameters r": 15,
        "freedoms with idle spins": 5,
        "idle spins of rods": 2,
        "mobility M": 3,
    }
    assert counted["mobility M"] == ranked.mobility
    assert counted["idle spins of rods"] == ranked.idle_freedoms
    # the model cuts two spherical joints and a hinge: 20 freedoms become 13
    assert counted["joint freedoms"] - 7 == ranked.joint_freedoms


def test_a_parallelogram_that_is_none_locks_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = wb.load_mechanism(MODEL)
    q = np.array(count.POSE)
    x = robot.forward_kinematics(q[None, :])[0]
    right = count.gogu_mobility(robot.parameters, x, q)
    tilted = np.array([np.cos(0.2), np.sin(0.2), 0.0])
    honest = screws.line
    calls = iter(range(100))

    def line(axis: np.ndarray, point: np.ndarray) -> np.ndarray:
        # the last hinge of the parallelogram; each limb has asked for seven lines before
        return honest(tilted if next(calls) == 17 else axis, point)

    monkeypatch.setattr(screws, "line", line)
    assert count.gogu_mobility(robot.parameters, x, q)["mobility M"] < right["mobility M"]
