"""Motions of the platform in named task coordinates: cycles with rotation, sines, and campaigns that ask for them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

import cusp_robot as cusp
from workbench.campaign.cases import course_of, resolve_cases
from workbench.campaign.compare import compute_case
from workbench.campaign.evidence import Effort
from workbench.campaign.spec import load_campaign
from workbench.errors import MotionError, ParameterError, SpecError
from workbench.motion import (
    PickAndPlace,
    PlatformMotion,
    pick_and_place,
    platform_multi_sine,
    platform_sine,
    sine,
    time_grid,
    time_law,
)
from workbench.sweep.vary import FASTER

PLANAR = ("x", "z", "ry")
CYCLE = PickAndPlace(
    pick=(0.1, 0.3, -0.4), place=(0.3, 0.28, 0.8), lift=0.05, up=(0.0, 2.0), lift_time=0.2, traverse_time=0.5,
    lower_time=0.3, overlap=0.3, back=True, coordinates=PLANAR,
)  # fmt: skip


# --- the motion -------------------------------------------------------------------------------------------------------


def test_coordinates_have_names_and_units() -> None:
    one = np.zeros((1, 3))
    assert PlatformMotion([0.0], one, one, one).coordinates == ("x", "y", "z")
    planar = PlatformMotion([0.0], one, one, one, PLANAR)
    assert planar.units == ("m", "m", "rad")
    six = np.zeros((2, 6))
    assert PlatformMotion([0.0, 1.0], six, six, six, ("x", "y", "z", "rx", "ry", "rz")).units[3:] == ("rad",) * 3
    with pytest.raises(MotionError, match=r"^x: expected shape \(1, 2\), got \(1, 3\)$"):
        PlatformMotion([0.0], one, one, one, ("x", "rz"))
    with pytest.raises(MotionError, match=r'^task coordinate "phi"; valid: rx, ry, rz, x, y, z$'):
        PlatformMotion([0.0], one, one, one, ("x", "z", "phi"))
    with pytest.raises(MotionError, match=r"^task coordinates x, z, x; allowed: one or more, each once$"):
        PlatformMotion([0.0], one, one, one, ("x", "z", "x"))


def test_rotation_runs_with_the_traverse_by_its_law() -> None:
    t = time_grid(0.0, CYCLE.duration, samples=2001)
    found = CYCLE.sample(t)
    lift, traverse, lower = CYCLE.moves[:3]
    share = time_law("quintic", (t - traverse.start) / traverse.duration)[0]
    before = t <= lower.start
    np.testing.assert_allclose(found.x[before, 2], (-0.4 + 1.2 * share)[before], atol=1e-15)
    assert lift.displacement == (0.0, 0.05, 0.0)
    # at the place, then back at the pick, both to rounding
    place = int(np.argmin(np.abs(t - lower.stop)))
    np.testing.assert_allclose(CYCLE.sample([lower.stop]).x[0], CYCLE.place, atol=1e-15)
    np.testing.assert_allclose(found.x[-1], CYCLE.pick, atol=1e-15)
    assert np.abs(found.xd[place]).max() < 0.01
    # a twin that turns at another time is far off
    late = time_law("quintic", (t - lower.start) / traverse.duration)[0]
    assert np.abs(found.x[before, 2] - (-0.4 + 1.2 * late)[before]).max() > 0.5


def test_a_cycle_with_rotation_integrates_back() -> None:
    t = time_grid(0.0, CYCLE.duration, samples=20001)
    found = CYCLE.sample(t)
    for rate, value in ((found.xd, found.x), (found.xdd, found.xd)):
        back = value[0] + cumulative_simpson(rate, x=t, axis=0, initial=0)
        assert np.abs(back - value).max() < 1e-5
        assert np.abs(value[0] + cumulative_simpson(1.01 * rate, x=t, axis=0, initial=0) - value).max() > 1e-3


def test_today_s_three_vectors_are_as_they_were() -> None:
    old = pick_and_place(
        (0, 0, 0.3), (0.1, 0, 0.3), lift=0.05, up=(0, 0, -1), lift_time=0.2, traverse_time=0.4, rate=100
    )
    named = pick_and_place(
        (0, 0, 0.3), (0.1, 0, 0.3), lift=(0, 0, -0.05), lift_time=0.2, traverse_time=0.4, rate=100,
        coordinates=("x", "y", "z"),
    )  # fmt: skip
    for name in ("t", "x", "xd", "xdd"):
        np.testing.assert_array_equal(getattr(old, name), getattr(named, name))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pick": (0.1, 0.3)}, "pick has 2 entries; allowed: 3, the task coordinates x, z, ry"),
        ({"lift": (0, 0.1), "up": None}, "lift has 2 entries; allowed: 3, the task coordinates x, z, ry"),
        ({"lift": 0.1, "up": (1.0,)}, "up has 1 entries; allowed: 2, the positions x, z"),
        ({"lift": 0.1, "up": (0, 1, 0.5)}, "up turns ry; allowed: a direction of positions, 0 for rotations"),
        ({"lift": 0.1, "up": (1.0, 0, 0), "coordinates": ("rx", "ry", "rz")}, "hold no position to lift along"),
        ({"coordinates": ("x", "z", "q")}, 'task coordinate "q"'),
    ],
)
def test_cycles_in_other_coordinates_are_refused_by_name(changes: dict, message: str) -> None:
    start = {"lift": 0.05, "up": (0.0, 2.0)} | changes
    with pytest.raises(MotionError) as caught:
        dataclasses.replace(CYCLE, **start)
    assert message in str(caught.value)


def test_platform_sines_are_the_joints_in_other_coordinates() -> None:
    t = time_grid(0, 1, samples=50)
    numbers = [0.1, 0.2, 0.3], [0.01, 0.02, 0.5], [1.0, 2.0, 3.0], [0.0, 1.0, 2.0]
    plain, found = sine(t, *numbers), platform_sine(t, *numbers, coordinates=PLANAR)
    assert found.coordinates == PLANAR
    for mine, theirs in (("x", "q"), ("xd", "qd"), ("xdd", "qdd")):
        np.testing.assert_array_equal(getattr(found, mine), getattr(plain, theirs))
    terms = [[list(term)] for term in zip(*numbers[1:], strict=True)]
    np.testing.assert_array_equal(platform_multi_sine(t, numbers[0], terms, PLANAR).xdd, found.xdd)
    with pytest.raises(MotionError, match="offset has 3 entries; allowed: 2, the task coordinates x, ry"):
        platform_sine(t, *numbers, coordinates=("x", "ry"))


# --- campaigns --------------------------------------------------------------------------------------------------------

HEAD = """
name = "platform"
title = "Motions of the platform"
model = "models/asym_2rss_ppap.xml"
[[candidate]]
name = "distributed"
reference = "distributed"
bound = 1e-10
"""
SINE = """kind = "platform_sine"
offset = [0.0, 0.02, 0.34]
amplitude = [0.03, 0.02, 0.03]
frequency = [3.0, 4.0, 5.0]
phase = [0.0, 1.0, 2.0]
stop = 1.0
samples = 101
"""
MULTI = """kind = "platform_multi_sine"
offset = [0.0, 0.02, 0.34]
terms = [[[0.03, 3.0]], [[0.02, 4.0, 1.0]], [[0.03, 5.0, 2.0]]]
stop = 1.0
samples = 101
"""


def campaign(tmp_path: Path, *motions: str) -> Path:
    path = tmp_path / "c.toml"
    path.write_text(
        HEAD + "".join(f'[[case]]\nname = "m{k}"\n[case.motion]\n{motion}\n' for k, motion in enumerate(motions))
    )
    return path


def test_a_campaign_drives_the_platform_by_sines_and_tables(tmp_path: Path) -> None:
    exact = platform_sine(time_grid(0, 1, samples=101), [0, 0.02, 0.34], [0.03, 0.02, 0.03], [3, 4, 5], [0, 1, 2])
    names = [f"{axis}{order}" for order in ("", "_d", "_dd") for axis in "xyz"]
    rows = np.column_stack([exact.t, exact.x, exact.xd, exact.xdd]).tolist()
    (tmp_path / "p.csv").write_text(
        ";".join(["time", *names]) + "\n" + "".join(";".join(map(repr, row)) + "\n" for row in rows)
    )
    loaded, file = load_campaign(campaign(tmp_path, SINE, MULTI, 'kind = "platform_csv"\nfile = "p.csv"'))
    cases = resolve_cases(loaded, file)
    for case in cases:
        np.testing.assert_allclose(case.x, exact.x, atol=1e-12)
        np.testing.assert_allclose(case.xdd, exact.xdd, atol=1e-9)
        assert case.motion.warnings == ()
    result = compute_case(loaded, cases[0], Effort(budget=False, drawing=False))
    assert {row.verdict for row in result.rows} <= {"pass", "undecided"}
    assert max(row.peak_error for row in result.rows) < 1e-10
    # beyond its samples the motion goes on as its formula says
    q = course_of(cases[0])(np.array([1.5]))[0]
    np.testing.assert_allclose(
        cases[0].robot.forward_kinematics(q),
        platform_sine([1.5], [0, 0.02, 0.34], [0.03, 0.02, 0.03], [3, 4, 5], [0, 1, 2]).x,
        atol=1e-12,
    )


def test_a_table_that_is_doubtful_is_a_warning_of_its_case(tmp_path: Path) -> None:
    exact = platform_sine(time_grid(0, 1, samples=101), [0, 0.02, 0.34], [0.03, 0.02, 0.03], [3, 4, 5], [0, 1, 2])
    header = ",".join(["t", *(f"{axis}{order}" for order in ("", "d", "dd") for axis in "xyz")])
    rows = np.column_stack([exact.t, exact.x, exact.xd, 1.01 * exact.xdd]).tolist()
    (tmp_path / "p.csv").write_text(header + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows))
    loaded, file = load_campaign(campaign(tmp_path, 'kind = "platform_csv"\nfile = "p.csv"'))
    (case,) = resolve_cases(loaded, file)
    facts = compute_case(loaded, case, Effort(budget=False, drawing=False)).facts
    assert any("acceleration of" in said and "does not fit velocity" in said for said in facts["warnings"])


@pytest.mark.parametrize(
    ("motion", "kind", "message"),
    [
        (SINE.replace("offset = [0.0, ", "offset = ["), ParameterError, "has 3 task coordinates: x, y, z"),
        (MULTI.replace("[[0.03, 3.0]], ", ""), ParameterError, "3 offset(s) and 2 coordinate(s)"),
        (SINE + "offsets = [1.0]", SpecError, "motion.offsets: unknown key; did you mean"),
        ('kind = "platform_sin"', SpecError, 'unknown kind of motion; did you mean "platform_sine"?'),
        ('kind = "platform_csv"\nfile = "none.csv"', SpecError, "no such file"),
        (SINE.replace("0.34", "6.2"), MotionError, "t = 0 s"),
    ],
)
def test_what_a_campaign_cannot_ask_for(tmp_path: Path, motion: str, kind: type, message: str) -> None:
    with pytest.raises(kind) as caught:
        resolve_cases(*load_campaign(campaign(tmp_path, motion)))
    assert message in str(caught.value)


@pytest.mark.parametrize("motion", [SINE, MULTI])
def test_a_faster_platform_motion_runs_the_same_path(tmp_path: Path, motion: str) -> None:
    loaded, file = load_campaign(campaign(tmp_path, motion))
    spec = loaded.case[0].model_dump()
    FASTER[spec["motion"]["kind"]](spec["motion"], 2.0)
    quick = loaded.model_copy(update={"case": [type(loaded.case[0]).model_validate(spec)]})
    (slow,), (fast,) = resolve_cases(loaded, file), resolve_cases(quick, file)
    np.testing.assert_allclose(fast.motion.t, slow.motion.t / 2, atol=1e-15)
    np.testing.assert_allclose(fast.motion.q, slow.motion.q, atol=1e-12)
    np.testing.assert_allclose(fast.motion.qd, 2 * slow.motion.qd, atol=1e-10)


def test_a_campaign_follows_a_motion_around_a_cusp(tmp_path: Path) -> None:
    """From the file to the platform: where geometry alone puts it, at every sample, by table and in the result."""
    t = np.linspace(0.0, 2 * np.pi / cusp.RATE, 281)
    poses = cusp.followed(t)
    setup = cusp.setup_at(poses[0])
    home = ", ".join(f"{name} = {value!r}" for name, value in setup.initial)
    (tmp_path / "cusp.xml").write_text(cusp.model_text())
    rows = np.column_stack([t, *cusp.lengths(t)]).tolist()
    header = ",".join(["t", *(f"q{d}{k}" for d in ("", "d", "dd") for k in (1, 2, 3))])
    (tmp_path / "m.csv").write_text(header + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows))
    (tmp_path / "c.toml").write_text(
        'name = "cusp"\ntitle = "cusp"\nmodel = "cusp.xml"\nactuated = ["q1", "q2", "q3"]\nplatform_site = "P"\n'
        f"initial = {{ {home} }}\n"
        '[[case]]\nname = "around"\nmotion = { kind = "csv", file = "m.csv" }\n'
    )
    loaded, file = load_campaign(tmp_path / "c.toml")
    (case,) = resolve_cases(loaded, file)
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    place = poses[:, :2] + np.stack([0.12 * c - 0.1 * s, 0.12 * s + 0.1 * c], axis=1)
    assert np.abs(case.x[:, :2] - place).max() < 1e-11
    facts = compute_case(loaded, case, Effort(drawing=False)).facts
    assert facts["evidence"]["power_balance"]["distributed"]["relative"] < 1e-10
    assert not any("jump" in said for said in facts["warnings"])
