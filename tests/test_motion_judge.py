"""Tabulated motions are judged: figures cover true errors, exact motions pass in silence, familiar slips are named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from workbench.errors import MotionError
from workbench.motion import JointMotion, PickAndPlace, judged, multi_sine, read_joints, read_platform, time_grid
from workbench.motion.digits import FULL, rounding_of
from workbench.motion.judge import FEWEST, TOO_FAR, WORTH_SAYING

JOINTS, UNITS = ("q1", "q2", "q3"), ("m", "rad", "rad")


def random_motion(seed: int, samples: int = 401, stop: float = 2.0) -> JointMotion:
    rng = np.random.default_rng(seed)
    terms = [[(rng.normal() * 0.1, rng.uniform(1, 6), rng.uniform(0, 6)) for _ in range(3)] for _ in JOINTS]
    return multi_sine(time_grid(0.0, stop, samples=samples), rng.normal(size=3).tolist(), terms)


def table(path: Path, m: JointMotion, derivatives: bool = True, show: str = "{!r}", show_t: str = "{!r}") -> Path:
    groups = {"q": m.q, "qd": m.qd, "qdd": m.qdd} if derivatives else {"q": m.q}
    header = ["t", *(f"{name}{k + 1}" for name in groups for k in range(3))]
    rows = np.column_stack(list(groups.values())).tolist()
    lines = [
        ",".join([show_t.format(t), *(show.format(v) for v in row)]) for t, row in zip(m.t.tolist(), rows, strict=True)
    ]
    path.write_text("\n".join([",".join(header), *lines]) + "\n")
    return path


def judge(path: Path) -> JointMotion:
    found = judged(read_joints(path, JOINTS, units=UNITS))
    assert isinstance(found, JointMotion)
    return found


# --- silence ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("derivatives", [True, False])
@pytest.mark.parametrize("seed", range(8))
def test_exact_motions_pass_in_silence(tmp_path: Path, seed: int, derivatives: bool) -> None:
    assert judge(table(tmp_path / "m.csv", random_motion(seed), derivatives)).warnings == ()


def test_the_papers_motions_and_corners_of_a_cycle_pass_in_silence(tmp_path: Path) -> None:
    t = time_grid(0.0, 2 * np.pi, samples=401)
    paper = multi_sine(t, [0.0, 0.8, 0.8], [[(0.1, 1.0, 0.0)], [(0.3, 1.0, 1.0)], [(0.3, 1.0, 1.0)]])
    assert judge(table(tmp_path / "paper.csv", paper)).warnings == ()
    cycle = PickAndPlace(
        pick=(0.0, 0.1, 0.3), place=(0.1, 0.0, 0.3), lift=0.05, up=(0, 0, -1), lift_time=0.2, traverse_time=0.4
    )
    x = cycle.sample(time_grid(0.0, cycle.duration, samples=301))
    assert judge(table(tmp_path / "cycle.csv", JointMotion(x.t, x.x, x.xd, x.xdd))).warnings == ()


def test_a_joint_at_rest_with_rounding_is_no_doubt(tmp_path: Path) -> None:
    m = random_motion(1)
    rng = np.random.default_rng(0)
    noise = 1e-16 * rng.normal(size=(3, len(m.t)))
    q, qd, qdd = (array.copy() for array in (m.q, m.qd, m.qdd))
    q[:, 1], qd[:, 1], qdd[:, 1] = 0.3 + noise[0], noise[1], noise[2]
    assert judge(table(tmp_path / "m.csv", JointMotion(m.t, q, qd, qdd))).warnings == ()


# --- positions alone --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("places", range(4, 10))
@pytest.mark.parametrize("seed", [0, 1])
def test_the_stated_doubt_covers_the_true_error_of_rounding(tmp_path: Path, seed: int, places: int) -> None:
    m = random_motion(seed)
    path = table(tmp_path / "m.csv", m, False, f"{{:.{places}f}}")
    found = read_joints(path, JOINTS).motion
    assert isinstance(found, JointMotion)
    true = (np.abs(found.qdd - m.qdd).max(axis=0) / np.abs(found.qdd).max(axis=0)).max()
    figure, words = doubt_of(path)
    assert true < 3 * max(figure, WORTH_SAYING)
    assert figure < 5 * max(true, WORTH_SAYING)
    if words:
        assert "digits every 5 ms leave" in words
    if figure > TOO_FAR:
        assert "; give velocities and accelerations, or positions and times with all their digits" in words
        assert words.endswith(', or kind = "recorded", which smooths them')


def doubt_of(path: Path) -> tuple[float, str]:
    """Figure and words of a doubt, whether it is a warning or refused; 0 and nothing where there is none."""
    try:
        warnings = judge(path).warnings
    except MotionError as error:
        return float(error.facts["value"]), str(error)
    percent = [float(said.split(" % of its peak")[0].rsplit(" ", 1)[1]) for said in warnings]
    return max(percent, default=0.0) / 100, " ".join(warnings)


def test_rounded_times_are_refused_and_named(tmp_path: Path) -> None:
    path = table(tmp_path / "m.csv", random_motion(2, samples=701), False, show_t="{:.3f}")
    with pytest.raises(
        MotionError, match=r"acceleration of q\d is uncertain by .*: times of \d digits every \S+ ms leave"
    ):
        judge(path)


def test_a_grid_that_is_too_coarse_says_so(tmp_path: Path) -> None:
    path = table(tmp_path / "m.csv", random_motion(3, samples=24, stop=6.0), False)
    with pytest.raises(MotionError, match=r"24 samples are too few for it.*; give more samples, or velocities"):
        judge(path)
    # with its derivatives given the same grid is exact at every sample
    assert judge(table(tmp_path / "given.csv", random_motion(3, samples=24, stop=6.0))).warnings == ()


def test_few_samples_are_counted_not_judged(tmp_path: Path) -> None:
    found = judge(table(tmp_path / "m.csv", random_motion(0, samples=FEWEST - 1)))
    assert found.warnings[0].endswith(f"{FEWEST - 1} samples are too few to judge the motion (from {FEWEST} on)")


# --- derivatives given ------------------------------------------------------------------------------------------------

SPOILT: dict[str, tuple[Callable[[JointMotion], JointMotion], str]] = {
    "deg/s": (
        lambda m: JointMotion(m.t, m.q, m.qd * 180 / np.pi, m.qdd * 180 / np.pi),
        "velocity of q1 does not fit position by .* looks like degrees in place of radians",
    ),
    "mm/s": (
        lambda m: JointMotion(m.t, m.q, m.qd * 1e3, m.qdd * 1e3),
        "velocity of q1 .* looks like millimetres in place of metres, or times in milliseconds",
    ),
    "ms": (lambda m: JointMotion(m.t * 1e3, m.q, m.qd, m.qdd), "or times in milliseconds"),
    "sign of qdd": (
        lambda m: JointMotion(m.t, m.q, m.qd, -m.qdd),
        "acceleration of q. does not fit velocity by .*, 200 % of its peak, .* looks like the wrong sign",
    ),
    "one qdd": (
        lambda m: JointMotion(m.t, m.q, m.qd, m.qdd * [1, 1, -1]),
        "acceleration of q3 does not fit velocity .* the wrong sign",
    ),
    "columns": (
        lambda m: JointMotion(m.t, m.q, m.qd[:, [1, 0, 2]], m.qdd[:, [1, 0, 2]]),
        "velocity of q. does not fit",
    ),
    "one sample": (
        lambda m: JointMotion(m.t, m.q, m.qd + 0.5 * np.abs(m.qd).max() * (np.arange(len(m.t)) == 77)[:, None], m.qdd),
        "velocity of q. does not fit position",
    ),
    "another motion": (lambda m: JointMotion(m.t, m.q, random_motion(99).qd, m.qdd), "velocity of q. does not fit"),
}  # fmt: skip


@pytest.mark.parametrize("name", SPOILT)
@pytest.mark.parametrize("digits", ["{!r}", "{:.6f}"])
def test_derivatives_of_another_motion_are_refused(tmp_path: Path, name: str, digits: str) -> None:
    change, words = SPOILT[name]
    path = table(tmp_path / "m.csv", change(random_motion(4)), show=digits)
    with pytest.raises(MotionError, match=words) as caught:
        judge(path)
    assert caught.value.facts["file"] == str(path)
    assert caught.value.facts["value"] > TOO_FAR
    assert "leave all derivatives out" in str(caught.value)


@pytest.mark.parametrize("share", [0.004, 0.03])
def test_a_small_mismatch_is_a_warning_with_its_figure(tmp_path: Path, share: float) -> None:
    m = random_motion(5)
    spoilt = JointMotion(m.t, m.q, m.qd, m.qdd * (1 + share))
    (said,) = judge(table(tmp_path / "m.csv", spoilt)).warnings
    assert "acceleration of q" in said
    figure = float(said.split(" of its peak")[0].rsplit(", ", 1)[1].removesuffix(" %"))
    assert figure == pytest.approx(100 * share, rel=0.1)


def test_what_few_digits_explain_is_no_mismatch(tmp_path: Path) -> None:
    assert judge(table(tmp_path / "m.csv", random_motion(6), show="{:.5f}")).warnings == ()


# --- units ------------------------------------------------------------------------------------------------------------


def test_numbers_that_look_like_another_unit_are_said(tmp_path: Path) -> None:
    m = random_motion(7)
    large = JointMotion(m.t, m.q * [1000, 1, 1] + [300, 0, 60], m.qd * [1000, 1, 1], m.qdd * [1000, 1, 1])
    said = " ".join(judge(table(tmp_path / "m.csv", large)).warnings)
    assert "q1 reaches " in said
    assert "it looks like millimetres" in said
    assert "q3 reaches " in said
    assert "it looks like degrees" in said
    slow = JointMotion(np.arange(401.0), m.q, m.qd / 200, m.qdd / 200**2)
    assert "times are whole numbers up to 400" in judge(table(tmp_path / "slow.csv", slow)).warnings[0]


def test_platform_tables_are_judged_by_their_coordinates(tmp_path: Path) -> None:
    m = random_motion(8)
    names = ["x", "z", "ry"]
    header = ",".join(["t", *names, *(f"{n}_d" for n in names), *(f"{n}_dd" for n in names)])
    for sign, ok in ((1.0, True), (-1.0, False)):
        rows = np.column_stack([m.t, m.q, m.qd, sign * m.qdd]).tolist()
        path = tmp_path / f"p{ok}.csv"
        path.write_text(header + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows))
        read = read_platform(path, names)
        assert read.units == ("m", "m", "rad")
        if ok:
            assert judged(read).warnings == ()
        else:
            with pytest.raises(MotionError, match=r"acceleration of (x|z|ry) does not fit velocity"):
                judged(read)


# --- digits -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("digits", range(2, 11))
def test_digits_are_counted_fixed_and_significant(digits: int) -> None:
    numbers = np.random.default_rng(digits).uniform(0.1, 0.99, 200)
    fixed = np.array([float(f"{v:.{digits}f}") for v in numbers])
    assert rounding_of(fixed) == (pytest.approx(0.5 * 10.0**-digits), digits)
    spread = numbers * 10.0 ** np.random.default_rng(0).integers(-4, 1, 200)
    significant = np.array([float(f"{v:.{digits}g}") for v in spread])
    assert rounding_of(significant)[1] == digits
    assert rounding_of(numbers) == (0.0, FULL)
    assert rounding_of(np.zeros(5)) == (0.0, FULL)
