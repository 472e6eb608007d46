"""The workspace: against forward kinematics of random poses, its own error statement, and on the command line."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import workbench as wb
from workbench.capabilities.robot import Robot
from workbench.cli import _run
from workbench.errors import MotionError, OutputError, ParameterError
from workbench.workspace.grid import Workspace, compute_workspace
from workbench.workspace.store import FACTS, refuse_other

MODELS = ("models/asym_2rss_ppap.xml", "models/planar_4rprp.xml")


@pytest.fixture(params=MODELS, ids=["2RSS+PPaP", "4-RPRP"])
def mechanism(request: pytest.FixtureRequest) -> Robot:
    return wb.load_mechanism(request.param)


def poses(mechanism: Robot, count: int) -> np.ndarray:
    """Platform positions of random poses within the joint limits, by forward kinematics."""
    rng = np.random.default_rng(5)
    low, high = np.array(mechanism.joint_limits).T
    found = []
    while len(found) < count:
        q = rng.uniform(low, high)[None, :]
        try:
            found.append(mechanism.forward_kinematics(q)[0])
        except MotionError:
            continue
    return np.array(found)


def share_inside(workspace: Workspace, points: np.ndarray, border: int) -> float:
    """Share of points in a cell in reach, or within *border* cells of one."""
    grid = np.pad(workspace.mask(), border + 1)
    index = np.floor((points - workspace.low) / workspace.spacing).astype(int) + border + 1
    shifts = np.stack(np.meshgrid(*[np.arange(-border, border + 1)] * 3), axis=-1).reshape(-1, 3)
    return float(np.mean([any(grid[tuple(i + s)] for s in shifts) for i in index]))


def test_a_position_is_in_reach_where_inverse_kinematics_does_not_refuse_it(mechanism: Robot) -> None:
    rng = np.random.default_rng(7)
    low, high = mechanism.reach_box()
    points = rng.uniform(low - 0.3, high + 0.3, (300, 3))
    found = mechanism.reach(points)
    alone = np.full((300, 3), np.nan)
    for i, point in enumerate(points):
        try:
            alone[i] = mechanism.inverse_kinematics(point[None])[0]
        except MotionError:
            continue
    q = np.where(found.reachable[:, None], found.q, np.nan)
    refused = np.isnan(alone).any(axis=1)
    assert 20 < refused.sum() < 280
    assert not (found.reachable & refused).any()
    assert np.array_equal(q[found.reachable], alone[found.reachable])
    assert np.isfinite(found.condition[found.reachable]).all()
    for name, values in mechanism.singularity_measures(q[found.reachable]).items():
        np.testing.assert_allclose(found.measures[name][found.reachable], values, rtol=1e-9)
    if mechanism.name == "planar_4rprp":  # its inverse kinematics knows one assembly; the other's counts hanging rods
        assert np.array_equal(found.reachable, ~refused)
        a, h = mechanism.parameters.a, mechanism.parameters.h  # there the passive limb has no length
        near = 1e-3 * a
        assert mechanism.reach([[a, h, 0.3], [a - near, h, 0.3], [a, h + near, 0.3]]).reachable.tolist() == [
            False, True, True,
        ]  # fmt: skip


def test_the_box_holds_every_pose_and_is_no_larger_than_limbs_are_long(mechanism: Robot) -> None:
    low, high = mechanism.reach_box()
    points = poses(mechanism, 400)
    assert (points >= low).all()
    assert (points <= high).all()
    if mechanism.name == "planar_4rprp":
        longest = max(limit for _, limit in mechanism.joint_limits)
        assert [*low, *high] == [0.0, 0.0, mechanism.parameters.b - longest, longest, longest, longest]


def test_every_pose_lies_in_it(mechanism: Robot) -> None:
    points = poses(mechanism, 400)
    if mechanism.name == "asym_2rss_ppap":
        # arms that point inward reach the same positions with the other elbow; only elbows out are counted
        q = mechanism.inverse_kinematics(points)
        limits = np.array(mechanism.joint_limits)
        hanging = mechanism.reach(points).reachable
        points = points[hanging & np.all((q >= limits[:, 0]) & (q <= limits[:, 1]), axis=1)]
    workspace = compute_workspace(mechanism, 0.02)
    assert len(points) > 200
    assert share_inside(workspace, points, border=1) == 1.0
    # the twin: a workspace of a robot that reaches less far does not hold them
    small = compute_workspace(mechanism, 0.02, {"q1": tuple(np.array(mechanism.joint_limits[0]) * 0.6)})
    assert share_inside(small, points, border=0) < 0.9


def test_cells_in_reach_are_reached(mechanism: Robot) -> None:
    workspace = compute_workspace(mechanism, 0.03)
    np.testing.assert_allclose(mechanism.forward_kinematics(workspace.q), workspace.x, atol=1e-9)
    limits = np.array(workspace.limits)
    assert np.all((workspace.q >= limits[:, 0]) & (workspace.q <= limits[:, 1]))


@pytest.mark.parametrize("spacing", [0.04, 0.02, 0.013])
def test_halving_the_grid_changes_the_volume_by_less_than_the_error_it_states(mechanism: Robot, spacing: float) -> None:
    coarse, fine = compute_workspace(mechanism, spacing), compute_workspace(mechanism, spacing / 2)
    assert abs(coarse.volume - fine.volume) < coarse.volume_error
    assert 0.4 * coarse.volume_error < fine.volume_error < 0.6 * coarse.volume_error
    # the twin: a quarter of the volume would be noticed
    assert abs(coarse.volume - 0.25 * fine.volume) > coarse.volume_error


def test_a_box_by_hand() -> None:
    """With x1 = q1 alone limited, the volume is proportional to q1's range while the rods do not limit it."""
    mechanism = wb.load_mechanism(MODELS[0])
    wide = compute_workspace(mechanism, 0.01, {"q1": (-0.02, 0.02)})
    narrow = compute_workspace(mechanism, 0.01, {"q1": (-0.01, 0.01)})
    assert narrow.volume == pytest.approx(wide.volume / 2, rel=0.01)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"spacing": -1.0}, "spacing -1 m; allowed: > 0"),
        ({"spacing": 1e-5}, "allowed: at most"),
        ({"limits": {"q9": (0.0, 1.0)}}, 'no joint "q9"'),
        ({"limits": {"q1": (1.0, 0.0)}}, "must be below"),
        ({"limits": {"q1": (5.0, 6.0)}}, "no position in reach"),
    ],
)
def test_bad_requests(arguments: dict, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        compute_workspace(wb.load_mechanism(MODELS[0]), **arguments)


def test_the_command_writes_cells_facts_and_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "ws"
    arguments = [
        "workspace",
        MODELS[0],
        "--grid",
        "0.04",
        "--out",
        str(out),
        "--campaign",
        "campaigns/almeida_2010.toml",
    ]
    assert _run(arguments) == 0
    facts = json.loads((out / "workspace.json").read_text())
    cells = pd.read_parquet(out / "workspace.parquet")
    assert len(cells) == facts["cells"]
    assert facts["volume_m3"] == pytest.approx(len(cells) * 0.04**3)
    assert f"{facts['volume_m3']:.5f} m^3" in capsys.readouterr().out
    assert {path.name for path in (out / "figures").iterdir()} == {
        f"workspace_{view}.{suffix}" for view in ("sections", "space") for suffix in ("svg", "png")
    }


@pytest.mark.parametrize("option", ["q1", "q1=1", "q1=a:b", "=1:2", "q1=0:1 --limit q1=0:1"])
def test_malformed_limits_are_one_line(option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _run(["workspace", MODELS[0], "--out", str(tmp_path / "ws"), "--limit", *option.split(" ")]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
    assert not (tmp_path / "ws").exists()


def test_another_workspace_takes_its_place_only_when_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "ws"
    once = ["workspace", MODELS[0], "--grid", "0.08", "--out", str(out)]
    assert _run(once) == 0
    before = (out / "workspace.json").read_bytes()
    assert _run(once) == 0  # the same again
    capsys.readouterr()
    others = {
        "parameters": [*once, "--set", "a2=0.31"],
        "a robot, parameters": ["workspace", MODELS[1], *once[2:]],
        "ranges of joints": [*once, "--limit", "q1=-0.05:0.05"],
        "a grid": [*once, "--grid", "0.09"],
    }
    for what, other in others.items():
        assert _run(other) == 2
        said = capsys.readouterr().err.strip().splitlines()[-1]
        assert f"ws: holds an earlier workspace with {what} unlike this one's; --replace puts" in said
        assert (out / "workspace.json").read_bytes() == before
    assert _run([*others["a grid"], "--replace"]) == 0
    assert json.loads((out / "workspace.json").read_text())["spacing_m"] == 0.09


@pytest.mark.parametrize(
    ("before", "now", "lost"),
    [(["a", "b"], ["b", "a"], False), (["a"], ["a", "b"], False), ([], ["a"], False), (["a", "b"], ["a"], True),
     (["a"], [], True), ("nonsense", [], False)],
)  # fmt: skip
def test_marked_cases_are_lost_only_when_asked(tmp_path: Path, before: object, now: list[str], lost: bool) -> None:
    known = {"mechanism": "delta", "parameters": {"a": 1.0}}
    (tmp_path / FACTS).write_text(json.dumps(known | {"marked": before}))
    if lost:
        with pytest.raises(OutputError, match="an earlier workspace with marked cases unlike this one's; --replace"):
            refuse_other(tmp_path, known | {"marked": now})
    else:
        refuse_other(tmp_path, known | {"marked": now})
    with pytest.raises(OutputError, match="with a robot, parameters unlike"):
        refuse_other(tmp_path, {"mechanism": "other", "parameters": {"a": 2.0}})
    (tmp_path / FACTS).write_text(json.dumps(known))  # as earlier versions wrote it
    refuse_other(tmp_path, known | {"marked": now})
