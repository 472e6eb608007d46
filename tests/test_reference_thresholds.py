"""Thresholds of the reference from both sides: what is just within them passes, what is just beyond is refused.

A threshold of which only far-away values are tried may be a hundred times as large, and no other test would notice.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from own_mechanisms import FOURBAR
from test_mjcf_setup import robot
from workbench.errors import ModelError, MotionError, ParameterError
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference, crossings
from workbench.reference.freedoms import NEARBY, _loose, check_freedoms
from workbench.reference.left_out import Touch
from workbench.reference.pinocchio_reference import PinocchioReference
from workbench.reference.platform_closure import PlatformCloser
from workbench.reference.redundant import excess_actuators, left_null_space
from workbench.reference.replay import motion_through

WITHIN, BEYOND = 0.3, 3.0

LIMITED = robot(crank=' range="-0.05 1.5"', sections='<actuator><motor joint="crank"/></actuator>')


@pytest.mark.parametrize(("part", "passed"), [(WITHIN, True), (BEYOND, False)])
@pytest.mark.parametrize("end", [-0.05, 1.5])
def test_a_limit_is_passed_by_no_more_than_rounding(tmp_path: Path, end: float, part: float, passed: bool) -> None:
    path = tmp_path / "model.xml"
    path.write_text(LIMITED)
    reference = MujocoReference(path, setup=Setup(("crank",), "pin"))
    q = np.array([[0.3], [end + np.copysign(part * 1e-9, end)]])
    found = crossings.look(reference, reference.inverse_dynamics(q, 0 * q, 0 * q)).crossings
    assert (found == ()) == passed
    assert passed or (found[0].what, found[0].sample) == ("limits", 1)


@pytest.mark.parametrize(("part", "touches"), [(WITHIN, False), (BEYOND, True)])
def test_geoms_touch_when_they_overlap_by_more_than_rounding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, part: float, touches: bool
) -> None:
    path = tmp_path / "model.xml"
    path.write_text(LIMITED)
    reference = MujocoReference(path, setup=Setup(("crank",), "pin"))
    overlap = Touch("#0", "#1", 1, part * 1e-9, False)
    for home, new in ((True, False), (False, touches)):  # what touches at home already is not new
        monkeypatch.setattr(
            crossings, "touches", lambda model, qpos, home=home: [overlap] if home or len(qpos) > 1 else []
        )
        q = np.array([[0.3], [0.4]])
        found = crossings.look(reference, reference.inverse_dynamics(q, 0 * q, 0 * q))
        assert [one.what for one in found.crossings] == ["contacts"] * new
        assert any("in the home pose these touch already" in note for note in found.notes) == (home and touches)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(("part", "excess"), [(WITHIN, 0), (BEYOND, 1)])
def test_an_actuator_in_excess_strains_the_loops_whatever_their_unit(scale: float, part: float, excess: int) -> None:
    jacobian = scale * np.array([[1.0, 0.4], [0.0, part * 1e-9]])
    assert excess_actuators(jacobian, np.array([0]), np.array([1])) == excess
    assert excess_actuators(np.zeros((0, 2)), np.array([0]), np.array([1])) == 0


@pytest.mark.parametrize(("part", "size"), [(WITHIN, 2), (BEYOND, 1)])
def test_rows_depend_on_each_other_to_rounding(part: float, size: int) -> None:
    matrix = np.array([[1.0, 0.0], [0.0, part * 1e-10], [0.0, 0.0]])
    basis = left_null_space(7.0 * matrix)
    assert basis.shape == (3, size)
    assert np.abs(basis.T @ basis - np.eye(size)).max() < 1e-14


@pytest.mark.parametrize("which", [0, 1, 2])
@pytest.mark.parametrize(("part", "passed"), [(0.01, True), (30.0, False)])
def test_excess_actuators_fit_to_rounding(tmp_path: Path, which: int, part: float, passed: bool) -> None:
    """The tolerance is one of the leading joint's, which either may be: so two digits from it on both sides."""
    path = tmp_path / "model.xml"
    path.write_text(FOURBAR)
    guess = (("crank", 1.0), ("elbow", -0.5), ("wrist", -1.5))
    one = MujocoReference(path, setup=Setup(("crank",), "coupler", initial=guess))
    two = MujocoReference(path, setup=Setup(("crank", "wrist"), "coupler", initial=guess))
    found = one.inverse_dynamics([[1.1]], [[2.0]], [[-3.0]])
    motion = [array[:, [0, 2]] for array in (found.qpos, found.qvel, found.qacc)]
    speed = 1.0 + np.abs(motion[1]).max()
    scale = (1.0, speed, speed**2 + np.abs(motion[2]).max())[which]
    motion[which] = motion[which] + [0.0, part * 1e-9 * scale]
    if passed:
        assert np.isfinite(two.inverse_dynamics(*motion).tau).all()
        return
    with pytest.raises(MotionError, match="more actuators than freedoms"):
        two.inverse_dynamics(*motion)


@pytest.mark.parametrize("speed", [0.0, 1.0, 50.0])
def test_the_second_engine_follows_rates_that_fit_to_rounding(speed: float) -> None:
    engine: Any = SimpleNamespace(_loops=SimpleNamespace(passive=[0, 1]), joint_names=("crank",))
    qd, scale = np.array([-speed]), max(speed, 1.0)

    def judge(rank: int, residual: float) -> None:
        PinocchioReference._refuse_singular(engine, 4, np.array([0.5]), qd, rank, residual)

    judge(2, WITHIN * 1e-9 * scale)
    for rank, residual in ((2, BEYOND * 1e-9 * scale), (1, 0.0), (2, np.nan)):
        with pytest.raises(MotionError, match=r"sample 4: singular pose at crank = 0\.5; "):
            judge(rank, residual)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_where_branches_meet_a_pose_on_either_side_tells(side: float) -> None:
    """The freedom is loose at home and on one side of it: which of the two says that only this pose is to blame."""
    structure: Any = SimpleNamespace(
        passive=np.array([0, 1]), dof_names=["elbow", "wrist"], joint_names=["crank"], file="model.xml"
    )
    home, held = np.array([[1.0, 0.0], [0.0, 0.0]]), np.eye(2)
    ways = []

    def reclose(way: np.ndarray) -> np.ndarray:
        ways.append(way)
        return held if side * way[1] > 0.0 else home

    with pytest.raises(ModelError, match="two assembly branches meet in the pose"):
        check_freedoms(structure, home, reclose, 1e-9)
    assert [np.linalg.norm(way) for way in ways] == pytest.approx([NEARBY] * len(ways))
    with pytest.raises(ModelError, match=r"1 freedom\(s\) that no actuator holds.*joint \"wrist\" by 1 can still move"):
        check_freedoms(structure, home, lambda way: home, 1e-9)
    check_freedoms(structure, held, reclose, 1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_coordinates_that_fail_at_home_alone_are_told_by_a_pose_on_either_side(side: float) -> None:
    def closer(determined: bool) -> Any:
        def rank(loops: Any, qpos: np.ndarray) -> int:
            return int(determined and side * qpos[0] > 0.0)

        return SimpleNamespace(
            task=SimpleNamespace(names=("rx",), turn_columns=np.array([0])),
            leading=np.array([0]),
            structure=SimpleNamespace(file="model.xml", actuated_qpos=np.array([0])),
            home=np.zeros(1),
            _rank=rank,
            _has=lambda loops: ["x", "rx"],
        )

    def close(target: np.ndarray) -> Any:
        if side * target[0, 0] < 0.0:
            raise MotionError("the loops cannot be closed there")
        return SimpleNamespace(qpos=target)

    loops: Any = SimpleNamespace(close=close)
    with pytest.raises(ModelError, match="the home pose is a singular one: there rx do not determine the joints"):
        PlatformCloser._refuse_dependent(closer(True), loops, np.zeros((1, 1)))
    with pytest.raises(ParameterError, match="of task coordinates rx only 0 can be chosen"):
        PlatformCloser._refuse_dependent(closer(False), loops, np.zeros((1, 1)))


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_what_is_loose_by_rounding_is_loose(size: float) -> None:
    """Rows that depend on each other to rounding, not exactly, leave a freedom."""
    rng = np.random.default_rng(5)
    rows = size * rng.normal(size=(4, 3)) @ rng.normal(size=(3, 5))
    structure: Any = SimpleNamespace(passive=np.arange(5))
    freedoms, way = _loose(structure, rows, 1e-9)
    assert freedoms == 2
    assert np.abs(rows @ way).max() < 1e-12 * size
    assert np.linalg.svd(rows, compute_uv=False)[3] > 0.0  # by rounding
    structure = SimpleNamespace(passive=np.arange(3))
    assert _loose(structure, rows, 1e-9)[0] == 0


@pytest.mark.parametrize("length", [0.01, 1.0, 1000.0])
def test_a_motion_is_asked_for_within_its_times_but_for_rounding(length: float) -> None:
    t = np.linspace(3.0, 3.0 + length, 5)
    still = np.zeros((5, 1))
    motion = motion_through(t, still + 1.0, still, still)
    for outside in (-1.0, 1.0):
        end = t[0] if outside < 0 else t[-1]
        q, _, _ = motion(np.array([end + outside * 0.3e-9 * length]))
        assert q[0, 0] == pytest.approx(1.0)
        with pytest.raises(MotionError, match="allowed: 3 to"):
            motion(np.array([end + outside * 3e-9 * length]))
