"""Motions: every derivative against two independent oracles, each with a twin that is wrong on purpose."""

from __future__ import annotations

import dataclasses
import math
import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.integrate import cumulative_simpson

from workbench import motion
from workbench.errors import MotionError
from workbench.motion import JointMotion, PickAndPlace, PlatformMotion, multi_sine, sine, time_grid

UP = (0.0, 0.0, -1.0)
"""away from the ground where x3 points down"""

CYCLE = PickAndPlace(
    pick=(-0.05, 0.02, 0.30),
    place=(0.07, -0.04, 0.28),
    lift=0.06,
    up=(0.0, 0.0, -2.0),
    lift_time=0.2,
    traverse_time=0.4,
    lower_time=0.3,
    dwell=0.05,
    overlap=0.4,
    back=True,
    law="septic",
)

DERIVATIVE_TOLERANCE = 1e-8
"""Richardson differences of step 1e-3: truncation and cancellation both stay near 1e-10 of the peak here."""


def richardson(position: Callable[[np.ndarray], np.ndarray], t: np.ndarray, h: float = 1e-3) -> np.ndarray:
    """Sixth-order derivative of a motion's position, from positions only."""

    def central(step: float) -> np.ndarray:
        return (position(t + step) - position(t - step)) / (2.0 * step)

    once = [(4.0 * central(h / 2**k / 2) - central(h / 2**k)) / 3.0 for k in range(2)]
    return np.asarray((16.0 * once[1] - once[0]) / 15.0)


def gap(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest difference, over the largest expected value."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())


# --- time grids -------------------------------------------------------------------------------------------------------


def test_grid_by_samples_has_both_ends() -> None:
    np.testing.assert_allclose(time_grid(0.1, 0.5, samples=5), [0.1, 0.2, 0.3, 0.4, 0.5], rtol=1e-15)


def test_grid_by_rate_ends_on_stop_when_steps_are_whole() -> None:
    grid = time_grid(0.1, 2.0, rate=1000.0)
    assert len(grid) == 1901
    assert grid[0] == 0.1
    assert grid[-1] == 2.0


def test_grid_by_rate_ends_before_stop_otherwise() -> None:
    np.testing.assert_allclose(time_grid(0.0, 1.0, rate=1.5), [0.0, 2 / 3], rtol=1e-15)


@given(start=st.floats(-10, 10), length=st.floats(0.01, 10), rate=st.floats(200, 2000))
@settings(max_examples=50, deadline=None)
def test_grid_by_rate_never_passes_stop_and_leaves_less_than_a_step(start: float, length: float, rate: float) -> None:
    grid = time_grid(start, start + length, rate=rate)
    assert grid[0] == start
    assert start + length - 1.001 / rate < grid[-1] <= start + length
    np.testing.assert_allclose(np.diff(grid), 1.0 / rate, rtol=1e-5)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0, 1, {}), "time grid: neither of samples and rate given; allowed: exactly one of them"),
        (
            (0, 1, {"samples": 3, "rate": 2.0}),
            "time grid: both of samples and rate given; allowed: exactly one of them",
        ),
        ((1, 1, {"samples": 3}), "time grid: stop = 1 s; allowed: > start = 1 s"),
        ((math.nan, 1, {"samples": 3}), "time grid: start = nan s; allowed: a finite number"),
        ((0, "1", {"samples": 3}), "time grid: stop = '1'; allowed: a number"),
        ((0, True, {"samples": 3}), "time grid: stop = True; allowed: a number"),
        ((0, 10**400, {"samples": 3}), "time grid: stop = inf s; allowed: a finite number"),
        ((0, 1, {"samples": 1}), "time grid: samples = 1 makes 1 samples; allowed: 2 to 10000000"),
        ((0, 1, {"samples": 2.5}), "time grid: samples = 2.5; allowed: a whole number"),
        ((0, 1, {"rate": 0.0}), "time grid: rate = 0 Hz; allowed: > 0"),
        ((0, 1, {"rate": 0.5}), "time grid: rate = 0.5 Hz makes 1.5 samples; allowed: 2 to 10000000"),
        ((0, 1, {"rate": 1e12}), "time grid: rate = 1e+12 Hz makes 1e+12 samples; allowed: 2 to 10000000"),
        ((0, 1e300, {"rate": 1e300}), "time grid: rate = 1e+300 Hz makes inf samples; allowed: 2 to 10000000"),
        (
            (1e16, 1e16 + 4, {"samples": 100}),
            "time grid: 100 samples from 1e+16 s to 1e+16 s; allowed: steps that a float resolves",
        ),
    ],
)
def test_grid_refusals(arguments: tuple, message: str) -> None:
    start, stop, keywords = arguments
    with pytest.raises(MotionError) as caught:
        time_grid(start, stop, **keywords)
    assert str(caught.value) == message


# --- the arrays of a motion -------------------------------------------------------------------------------------------


def test_motion_keeps_its_own_copy() -> None:
    q = np.zeros((2, 3))
    kept = JointMotion(np.array([0.0, 1.0]), q, q, q)
    q[:] = 7.0
    assert not kept.q.any()


def test_motion_is_frozen() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        sine([0.0], [0], [1], [1]).q = np.ones((1, 1))  # type: ignore[misc]


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda z: JointMotion([0, 1], z, z, z[:1]), "qdd: expected shape (2, 3), got (1, 3)"),
        (lambda z: JointMotion([0, 1], z, z[:, :2], z), "qd: expected shape (2, 3), got (2, 2)"),
        (lambda z: JointMotion([0, 1], z[0], z, z), "q: expected shape (2, m), got (3,)"),
        (lambda z: PlatformMotion([0, 1], z[:, :2], z, z), "x: expected shape (2, 3), got (2, 2)"),
        (lambda z: JointMotion([0, 1], "abc", z, z), "q: expected an array of numbers, got str"),
        (lambda z: JointMotion([], z, z, z), "t: expected shape (n,) with n >= 1, got (0,)"),
        (lambda z: JointMotion([0, math.nan], z, z, z), "t: sample 1 is nan; allowed: a finite number"),
        (lambda z: JointMotion([0, 0], z, z, z), "t: sample 1 is 0 s after 0 s; allowed: strictly increasing"),
        (
            lambda z: JointMotion([0, 0.5], z, z, np.array([[0, 0, 0], [0, math.inf, 0]])),
            "qdd2 at t = 0.5 s is inf; allowed: a finite number",
        ),
    ],
)
def test_motion_refusals(build: Callable[[np.ndarray], object], message: str) -> None:
    with pytest.raises(MotionError) as caught:
        build(np.zeros((2, 3)))
    assert str(caught.value) == message


def test_refusal_keeps_the_facts() -> None:
    z = np.zeros((2, 3))
    with pytest.raises(MotionError) as caught:
        JointMotion(np.array([0.0, 0.5]), z, np.array([[0, 0, 0], [0, 0, math.nan]]), z)
    assert caught.value.facts == {"time": 0.5, "joint": 2, "sample": 1}


def consistency_of(spoil_qd: float = 1.0, spoil_qdd: float = 1.0) -> motion.Consistency:
    t = time_grid(0, 2, samples=400) ** 1.1  # an uneven grid
    exact = sine(t, [0.3] * 3, [0.5, 0.2, 0.1], [3, 5, 7])
    return JointMotion(t, exact.q, spoil_qd * exact.qd, spoil_qdd * exact.qdd).consistency()


def test_consistency_is_small_for_exact_derivatives_only() -> None:
    fine = consistency_of()
    assert max(fine.velocity.max(), fine.acceleration.max()) < 1e-6
    np.testing.assert_allclose(consistency_of(spoil_qdd=1.01).acceleration, 0.01, rtol=0.02)
    wrong_velocity = consistency_of(spoil_qd=1.01)
    assert wrong_velocity.velocity.min() > 0.009
    assert consistency_of(spoil_qdd=-1.0).acceleration.min() > 1.0


def test_consistency_falls_with_the_fourth_power_of_the_step() -> None:
    def coarse(samples: int) -> motion.Consistency:
        return sine(time_grid(0, 2, samples=samples), [0.0], [1.0], [5.0], [0.3]).consistency()

    for name in ("velocity", "acceleration"):
        ratio = getattr(coarse(101), name) / getattr(coarse(201), name)
        assert 12 < ratio[0] < 20


def test_consistency_of_rest_and_of_one_sample_is_zero() -> None:
    for samples in (np.array([0.0]), np.array([0.0, 1.0])):
        result = multi_sine(samples, [1.0, 2.0], [[], []]).consistency()
        assert not result.velocity.any()
        assert not result.acceleration.any()


def test_consistency_of_a_jump_with_no_velocity_is_one() -> None:
    z = np.zeros((2, 1))
    assert JointMotion(np.array([0.0, 1.0]), np.array([[0.0], [1.0]]), z, z).consistency().velocity == 1.0


# --- sinusoids --------------------------------------------------------------------------------------------------------


def test_sine_is_the_papers_motion() -> None:
    """[Almeida2010] eq. (16)-(18), Table 1, at a time where the values are known in closed form."""
    moved = sine([math.pi / 10], [0, math.pi / 4, math.pi / 4], [0.1, math.pi / 12, math.pi / 12], [5, 5, 10])
    np.testing.assert_allclose(moved.q[0], [0.1, math.pi / 3, math.pi / 4], rtol=1e-14)
    np.testing.assert_allclose(moved.qd[0], [0, 0, -10 * math.pi / 12], atol=1e-14)
    np.testing.assert_allclose(moved.qdd[0], [-2.5, -25 * math.pi / 12, 0], atol=1e-13)


TERMS = [
    [(0.05, 2.0, 0.3), (0.02, 7.0, -1.0)],
    [(0.2, 5.0, 0.0)],
    [(0.1, 3.0, 1.0), (0.05, 9.0, 2.0), (-0.01, 0.0, 1.0)],
]
OFFSET = [0.0, 0.8, 0.7]


def test_sine_derivatives_by_finite_differences() -> None:
    t = time_grid(0, 2, samples=101)
    moved = multi_sine(t, OFFSET, TERMS)
    for name, rate in (("q", moved.qd), ("qd", moved.qdd)):
        oracle = richardson(lambda times, name=name: getattr(multi_sine(times, OFFSET, TERMS), name), t)
        assert gap(rate, oracle) < DERIVATIVE_TOLERANCE
        swapped = rate[:, [0, 2, 1]]
        assert gap(swapped, oracle) > 1e4 * DERIVATIVE_TOLERANCE


def test_sine_derivatives_in_the_complex_plane() -> None:
    """With q = Im(sum A exp(i(w t + p))) + offset, a derivative multiplies each term by i w: no code in common."""
    t = time_grid(0, 2, samples=57)
    moved = multi_sine(t, OFFSET, TERMS)

    def phasors(order: int, spoil: float = 1.0) -> np.ndarray:
        columns = [
            sum((a * (1j * w * spoil) ** order * np.exp(1j * (w * t + p)) for a, w, p in joint), np.zeros(len(t)))
            for joint in TERMS
        ]
        return np.imag(np.stack(columns, axis=1)) + (np.array(OFFSET) if order == 0 else 0.0)

    for order, found in enumerate((moved.q, moved.qd, moved.qdd)):
        assert gap(found, phasors(order)) < 1e-14
        if order:
            assert gap(found, phasors(order, spoil=1.0 + 1e-6)) > 1e-7


@given(
    offset=st.floats(-2, 2),
    terms=st.lists(
        st.tuples(st.floats(-1, 1), st.integers(0, 12).map(float), st.floats(-4, 4)), min_size=1, max_size=4
    ),
)
@settings(max_examples=50, deadline=None)
def test_sine_derivatives_by_fourier_transform(offset: float, terms: list[tuple[float, float, float]]) -> None:
    """Whole frequencies over one period of 2 pi: the discrete Fourier derivative is exact to round-off."""
    n = 64
    moved = multi_sine(np.arange(n) * (2 * math.pi / n), [offset], [terms])
    k = np.fft.rfftfreq(n, 1.0 / n)[:, None]
    spectrum = np.fft.rfft(moved.q, axis=0)
    for order, found in ((1, moved.qd), (2, moved.qdd)):
        np.testing.assert_allclose(found, np.fft.irfft((1j * k) ** order * spectrum, n, axis=0), atol=1e-10)


def test_multi_sine_takes_any_number_of_joints_and_terms() -> None:
    moved = multi_sine(time_grid(0, 1, samples=4), [1, 2, 3, 4], [[], [motion.Harmonic(1, 2)], [(1, 2)], [[1, 2, 0]]])
    assert moved.q.shape == (4, 4)
    assert (moved.q[:, 0] == 1).all()
    np.testing.assert_array_equal(moved.qdd[:, 1], moved.qdd[:, 3])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0, 0, 0], [1, 1], [1, 1, 1]), "sine: amplitude has 2 entries; allowed: 3"),
        (([], [], []), "sine: offset has 0 entries; allowed: one or more"),
        (([0, 0], [1, math.inf], [1, 1]), "sine: amplitude, entry 2 = inf; allowed: a finite number"),
        (([0, 0], [1, 1], [1, -3]), "joint q2: frequency = -3 rad/s; allowed: >= 0"),
        (([0, 0], [1, 1], [1, 1], [0, "x"]), "sine: phase, entry 2 = 'x'; allowed: a number"),
        ((0, [1], [1]), "sine: offset = 0; allowed: a list of numbers"),
        (([[1, 2], 3], [1, 1], [1, 1]), "sine: offset, entry 1 = [1, 2]; allowed: a number"),
        (([0], [1e100], [1e200]), "qdd1 at t = 1 s is inf; allowed: a finite number"),
    ],
)
def test_sine_refusals(arguments: tuple, message: str) -> None:
    with pytest.raises(MotionError) as caught:
        sine([1.0], *arguments)
    assert str(caught.value).replace("-inf", "inf") == message


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ([[(1, 2, 3)]], "terms has 1 joints; allowed: 2, as offset has"),
        (3, "terms = 3; allowed: a list of joints, each a list of terms"),
        ([[], 3], "joint q2: terms = 3; allowed: a list of terms"),
        ([[], [(1, 2, 3), (1,)]], "joint q2, term 2 has 1 entries; allowed: amplitude, frequency and phase"),
        ([[], [5.0]], "joint q2 = 5.0; allowed: a list of amplitude, frequency and phase"),
        ([[(1, 1, 1), (1, math.nan, 1)], []], "joint q1, term 2: frequency = nan rad/s; allowed: >= 0"),
        ([[(1, 1, math.nan)], []], "joint q1: phase = nan rad; allowed: a finite number"),
    ],
)
def test_multi_sine_refusals(terms: object, message: str) -> None:
    with pytest.raises(MotionError) as caught:
        multi_sine([0.0], [0, 0], terms)  # type: ignore[arg-type]
    assert str(caught.value) == message


# --- pick and place ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("law", "coefficients"),
    [("quintic", [0, 0, 0, 10, -15, 6]), ("septic", [0, 0, 0, 0, 35, -84, 70, -20])],
)
def test_time_law_is_the_textbook_polynomial(law: str, coefficients: list[float]) -> None:
    s = np.linspace(0, 1, 101)
    expected = Polynomial(coefficients)
    spoiled = Polynomial([*coefficients[:-1], coefficients[-1] + 1e-6])
    for order, found in enumerate(motion.time_law(law, s)):
        np.testing.assert_allclose(found, (expected.deriv(order) if order else expected)(s), atol=1e-12)
        assert np.abs(found - (spoiled.deriv(order) if order else spoiled)(s)).max() > 5e-7


@pytest.mark.parametrize("law", motion.LAWS)
def test_time_law_rises_from_rest_to_rest(law: str) -> None:
    value, first, second = motion.time_law(law, np.linspace(-1, 2, 301))
    assert (value[:101] == 0).all()
    assert (value[200:] == 1).all()
    assert (np.diff(value[100:201]) > 0).all()
    for rate in (first, second):
        assert not rate[:101].any()
        assert not rate[200:].any()


def test_septic_starts_without_jerk_and_quintic_does_not() -> None:
    s = 1e-6
    assert motion.time_law("septic", s)[2] / s < 1e-2
    assert motion.time_law("quintic", s)[2] / s > 50


@pytest.mark.parametrize("law", motion.LAWS)
@pytest.mark.parametrize("overlap", [0.0, 0.4])
def test_cycle_derivatives_by_finite_differences(law: str, overlap: float) -> None:
    cycle = dataclasses.replace(CYCLE, law=law, overlap=overlap)
    t = time_grid(0, cycle.duration, samples=601)
    # the law is a polynomial between corners only: differences may not reach across one
    corners = np.array([edge for move in cycle.moves for edge in (move.start, move.stop)])
    t = t[np.abs(t[:, None] - corners).min(axis=1) > 2e-3]
    moved = cycle.sample(t)
    for name, rate in (("x", moved.xd), ("xd", moved.xdd)):
        oracle = richardson(lambda times, name=name: getattr(cycle.sample(times), name), t)
        assert gap(rate, oracle) < DERIVATIVE_TOLERANCE
        assert gap(1.0001 * rate, oracle) > 1e3 * DERIVATIVE_TOLERANCE


@pytest.mark.parametrize("law", motion.LAWS)
def test_cycle_integrates_back(law: str) -> None:
    """Acceleration integrated twice from rest gives the cycle's velocity and position."""
    cycle = dataclasses.replace(CYCLE, law=law)
    moved = cycle.sample(time_grid(0, cycle.duration, samples=20001))

    def integrated(rate: np.ndarray) -> np.ndarray:
        return np.asarray(cumulative_simpson(rate, x=moved.t, axis=0, initial=0))

    assert gap(integrated(moved.xdd), moved.xd) < 1e-6
    assert gap(moved.x[0] + integrated(integrated(moved.xdd)), moved.x) < 1e-6
    late = np.roll(moved.xdd, 1, axis=0)
    assert gap(integrated(late), moved.xd) > 1e-4


def test_cycle_reaches_its_poses_at_rest() -> None:
    cycle = dataclasses.replace(CYCLE, overlap=0.0)
    names = [move.name for move in cycle.moves]
    assert names == ["lift", "traverse", "lower", "lift back", "traverse back", "lower back"]
    stops = [0.0, *(move.stop for move in cycle.moves), cycle.duration]
    np.testing.assert_allclose(stops, [0, 0.2, 0.6, 0.9, 1.15, 1.55, 1.85, 1.9], rtol=1e-14)
    moved = cycle.sample(stops)
    pick, place, lift = np.array(cycle.pick), np.array(cycle.place), np.array([0, 0, -0.06])
    poses = [pick, pick + lift, place + lift, place, place + lift, pick + lift, pick, pick]
    np.testing.assert_allclose(moved.x, poses, atol=1e-15)
    # round-off in the time of a stop leaves a motion of its own size
    assert max(np.abs(moved.xd).max(), np.abs(moved.xdd).max()) < 1e-9


def test_cycle_rests_outside_and_while_it_dwells() -> None:
    moved = CYCLE.sample([-1.0, 0.0, CYCLE.moves[2].stop + 0.01, CYCLE.moves[2].stop + 0.04, CYCLE.duration, 10.0])
    np.testing.assert_allclose(moved.x[[0, 1, 4, 5]], [CYCLE.pick] * 4, atol=1e-15)
    np.testing.assert_allclose(moved.x[2:4], [CYCLE.place] * 2, atol=1e-15)
    assert not moved.xd.any()
    assert not moved.xdd.any()


@pytest.mark.parametrize("law", motion.LAWS)
@pytest.mark.parametrize("overlap", [0.0, 0.3, 0.8])
def test_cycle_has_no_jump_at_any_corner(law: str, overlap: float) -> None:
    cycle = dataclasses.replace(CYCLE, law=law, overlap=overlap)
    step = 1e-9
    for move in cycle.moves:
        for corner in (move.start, move.stop):
            around = cycle.sample([corner - step, corner + step])
            for name, bound in (("x", 1e-8), ("xd", 1e-6), ("xdd", 1e-4)):
                values = getattr(around, name)
                assert np.abs(values[1] - values[0]).max() < bound


def test_overlap_shortens_the_cycle_and_keeps_the_height() -> None:
    plain, blended = (dataclasses.replace(CYCLE, overlap=overlap) for overlap in (0.0, 0.8))
    assert blended.duration == pytest.approx(plain.duration - 2 * 0.8 * (0.2 + 0.3), rel=1e-14)
    # a level traverse shows the height alone
    level = dataclasses.replace(blended, place=(0.07, -0.04, 0.30))
    moved = level.sample(time_grid(0, level.duration, rate=10000.0))
    assert moved.x[:, 2].min() == pytest.approx(0.30 - 0.06, abs=1e-9)
    assert moved.x[:, 2].max() <= 0.30 + 1e-15
    # lift and traverse run together: that is what the overlap is for
    assert ((np.abs(moved.xd[:, 0]) > 1e-3) & (np.abs(moved.xd[:, 2]) > 1e-3)).any()
    corner = plain.sample(time_grid(0, plain.duration, rate=10000.0))
    level_plain = dataclasses.replace(plain, place=(0.07, -0.04, 0.30)).sample(corner.t)
    assert not ((np.abs(level_plain.xd[:, 0]) > 1e-3) & (np.abs(level_plain.xd[:, 2]) > 1e-3)).any()


def test_lift_as_vector_is_height_along_up() -> None:
    vector = dataclasses.replace(CYCLE, lift=(0.0, 0.0, -0.06), up=None)
    assert vector == CYCLE
    assert CYCLE.lift == (0.0, 0.0, -0.06)
    inclined = PickAndPlace((0, 0, 0), (1, 0, 0), lift=5.0, up=(0, 3, 4), lift_time=1, traverse_time=1)
    np.testing.assert_allclose(inclined.lift, (0, 3, 4), rtol=1e-15)
    assert inclined.lower_time == 1


def test_pick_and_place_samples_the_whole_cycle() -> None:
    arguments = {"lift": 0.05, "up": UP, "lift_time": 0.2, "traverse_time": 0.3, "law": "septic"}
    moved = motion.pick_and_place((0, 0, 0.3), (0.1, 0, 0.3), rate=1000.0, **arguments)
    assert isinstance(moved, PlatformMotion)
    assert moved.t[-1] == pytest.approx(0.7)
    assert len(moved.t) == 701
    np.testing.assert_allclose(moved.x[-1], (0.1, 0, 0.3), atol=1e-15)
    assert max(moved.consistency().velocity.max(), moved.consistency().acceleration.max()) < 1e-4
    assert len(motion.pick_and_place((0, 0, 0.3), (0.1, 0, 0.3), samples=11, **arguments).t) == 11


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pick": (0, 0)}, "pick and place: pick has 2 entries; allowed: 3, the task coordinates x, y, z"),
        ({"place": (0, math.nan, 0)}, "pick and place: place, entry 2 = nan; allowed: a finite number"),
        ({"lift": 0.0}, "pick and place: lift = 0 m; allowed: > 0"),
        ({"lift": "high"}, "pick and place: lift = 'high'; allowed: a number"),
        ({"up": None}, "pick and place: lift = 0.06 m without up; allowed: a height with up, or a vector"),
        ({"up": (0, 0, 0)}, "pick and place: up is all zeros; allowed: a direction, of any length but zero"),
        ({"lift": (0, 0, 1)}, "pick and place: lift is a vector and up is given too; allowed: a height with up"),
        ({"lift": (0, 0, 0), "up": None}, "pick and place: lift is all zeros; allowed: a vector that is not zero"),
        ({"lift_time": 0.0}, "pick and place: lift_time = 0 s; allowed: > 0"),
        ({"traverse_time": -1.0}, "pick and place: traverse_time = -1 s; allowed: > 0"),
        ({"lower_time": math.inf}, "pick and place: lower_time = inf s; allowed: > 0"),
        ({"dwell": -0.1}, "pick and place: dwell = -0.1 s; allowed: >= 0"),
        ({"overlap": 1.0}, "pick and place: overlap = 1; allowed: >= 0 and < 1"),
        ({"overlap": -0.1}, "pick and place: overlap = -0.1; allowed: >= 0 and < 1"),
        (
            {"overlap": 0.9},
            "pick and place: traverse_time = 0.4 s with overlap = 0.9; "
            "allowed: >= 0.45 s, or the lower begins before the lift has ended",
        ),
        ({"law": "quintik"}, 'unknown time law "quintik"; did you mean "quintic"?'),
    ],
)
def test_cycle_refusals(changes: dict, message: str) -> None:
    arguments = {"lift": 0.06, "up": UP}
    with pytest.raises(MotionError) as caught:
        dataclasses.replace(CYCLE, **{**arguments, **changes})
    assert str(caught.value) == message


def test_cycle_that_overflows_is_refused() -> None:
    with pytest.raises(MotionError, match=r"^xd+[123] at t = 5e-201 s is -?(inf|nan); allowed: a finite number$"):
        dataclasses.replace(CYCLE, lift_time=1e-200, overlap=0.0).sample([0.5e-200])


# --- the package ------------------------------------------------------------------------------------------------------


def test_importing_motions_does_not_load_scipy() -> None:
    code = "import sys, workbench.motion; sys.exit('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
