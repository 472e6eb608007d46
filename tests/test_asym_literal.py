"""[Almeida2010] as written: appendix, eq. (4) and the rotation terms, against energies built from point positions.

The oracle shares nothing with the formulas: every bar becomes two equal masses on its line (same mass, mass centre and
transverse inertia), positions come from intersecting two circles, derivatives from the complex step, and tau from
Lagrange's equation. Every agreement has a spoiled twin that must not agree.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from workbench.metrics import relative_error
from workbench.robots.asym_2rss_ppap import literal
from workbench.robots.asym_2rss_ppap.closed_form import Asym2rssPpap
from workbench.robots.asym_2rss_ppap.literal import Misprint
from workbench.robots.catalogue import bundled_robot
from workbench.robots.parameter_set import parameter_type

STEP = 5e-4  # of the eighth-order differences: poses within 0.03 of the workspace boundary allow no larger one
ORACLE_TOLERANCE = 1e-9  # relative to the joint's peak: what those differences leave, with a margin
ROUND_OFF = 1e-12
CENTRAL = ((1, 4 / 5), (2, -1 / 5), (3, 4 / 105), (4, -1 / 280))

FORMS: dict[str, tuple[Callable[..., Any], float]] = {
    "lumped_appendix": (literal.lumped_appendix, 0.0),
    "lumped_equation4": (literal.lumped_equation4, 0.0),
    "distributed_rotation": (literal.distributed_rotation, 1.0),
}
"""The function and the factor on every bar's rotational inertia that its mass assumption means."""

SEEN_BY = {
    "lumped_appendix": literal.APPENDIX_AS_PRINTED,
    "lumped_equation4": literal.EQUATION4_AS_PRINTED,
    "distributed_rotation": literal.DISTRIBUTED_AS_PRINTED,
}


TABLE = bundled_robot("asym_2rss_ppap").table


def Parameters(**values: float) -> Any:
    """Parameters of the robot by name; friction is none unless it is given."""
    unset = {name: 0.0 for name in TABLE.infos if name.startswith(("damping", "coulomb", "armature"))}
    return parameter_type(tuple(TABLE.infos), tuple(TABLE.groups.items()))(**unset | values)


def table_1() -> Any:
    one_limb = {"L": 0.2, "l": 0.1, "a1": 0.2, "a2": 0.3, "m1": 0.2, "m2": 0.3, "k1": 0.5, "k2": 0.5}
    one_limb |= {"I1": 0.2 * 0.2**2 / 12, "I2": 0.3 * 0.3**2 / 12}
    sided = {f"{name}_{side}": value for name, value in one_limb.items() for side in ("left", "right")}
    return Parameters(
        **sided, a4=0.1, a5=0.25, a6=0.1, m3=0.45, m4=0.1, m5=0.5, m6=0.1, payload=0.0, g=9.81,
        I5=0.5 * 0.25**2 / 12, k5=0.5,
    )  # fmt: skip


def random_robot(seed: int) -> Any:
    """A robot whose limbs differ, with mass centres off the middle and a payload."""
    rng = np.random.default_rng(seed)
    values = {name: value * rng.uniform(0.9, 1.1) for name, value in dataclasses.asdict(table_1()).items()}
    values |= {name: rng.uniform(0.3, 0.7) for name in values if name.startswith("k")}
    return Parameters(**values | {"payload": rng.uniform(0.2, 1.0)})


def random_states(seed: int, count: int = 20) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """q, qd, qdd and an external force; q2 and q3 differ."""
    rng = np.random.default_rng(1000 + seed)
    q = np.array([0.0, np.pi / 4, np.pi / 4]) + rng.uniform(-1, 1, (count, 3)) * [0.1, 0.26, 0.26]
    qd = rng.uniform(-1, 1, (count, 3)) * [1.0, 8.0, 8.0]
    qdd = rng.uniform(-1, 1, (count, 3)) * [10.0, 200.0, 200.0]
    return q, qd, qdd, rng.uniform(-20, 20, (count, 3))


def paper_motion(rates: tuple[float, float, float], duration: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """[Almeida2010] eq. (16)-(18)."""
    t = np.linspace(0.0, duration, 2001)[:, None]
    amplitude, rate = np.array([0.1, np.pi / 12, np.pi / 12]), np.array(rates)
    sine, cosine = np.sin(rate * t), np.cos(rate * t)
    return (
        np.array([0.0, np.pi / 4, np.pi / 4]) + amplitude * sine,
        amplitude * rate * cosine,
        -amplitude * rate**2 * sine,
    )


SIMULATION_1 = paper_motion((2, 5, 5), 5.0)
SIMULATION_2 = paper_motion((10, 25, 35), 1.0)


def platform(p: Any, q: np.ndarray) -> np.ndarray:
    """Lower intersection of the two circles about the arms' tips; analytic, so complex q are welcome."""
    left = np.stack([-(p.L_left - p.l_left) - p.a1_left * np.cos(q[:, 1]), p.a1_left * np.sin(q[:, 1])], axis=1)
    right = np.stack([p.L_right - p.l_right + p.a1_right * np.cos(q[:, 2]), p.a1_right * np.sin(q[:, 2])], axis=1)
    between = right - left
    squared = np.sum(between**2, axis=1)
    radius_left, radius_right = p.a2_left**2 - q[:, 0] ** 2, p.a2_right**2 - q[:, 0] ** 2
    along = (radius_left - radius_right + squared) / (2 * squared)
    across = np.sqrt(radius_left / squared - along**2)
    x2 = left[:, 0] + along * between[:, 0] - across * between[:, 1]
    x3 = left[:, 1] + along * between[:, 1] + across * between[:, 0]
    return np.stack([q[:, 0], x2, x3], axis=1)


def point_masses(p: Any, q: np.ndarray, bar_inertia: float) -> list[tuple[float, np.ndarray]]:
    """Every body as (mass, positions (n, 3)); a bar is two masses, apart by twice its radius of gyration."""
    zero = np.zeros_like(q[:, 0])
    x = platform(p, q)
    a, b = np.array([0.0, -p.L_left, 0.0]), np.array([0.0, p.L_right, 0.0])
    c = a + p.a1_left * np.stack([zero, -np.cos(q[:, 1]), np.sin(q[:, 1])], axis=1)
    d = b + p.a1_right * np.stack([zero, np.cos(q[:, 2]), np.sin(q[:, 2])], axis=1)
    e, f = x - np.array([0.0, p.l_left, 0.0]), x + np.array([0.0, p.l_right, 0.0])
    h = np.stack([q[:, 0], zero, zero], axis=1)
    i = h + np.stack([zero, x[:, 1], np.sqrt(p.a5**2 - x[:, 1] ** 2)], axis=1)
    bars = [
        (a, c, p.m1_left, p.k1_left, p.I1_left, p.a1_left),
        (b, d, p.m1_right, p.k1_right, p.I1_right, p.a1_right),
        (c, e, p.m2_left, p.k2_left, p.I2_left, p.a2_left),
        (d, f, p.m2_right, p.k2_right, p.I2_right, p.a2_right),
        (h, i, p.m5, p.k5, p.I5, p.a5),
    ]
    points = [(p.m3 + p.payload, x), (p.m4, h), (p.m6, i)]
    for proximal, distal, mass, centre, inertia, length in bars:
        spread = math.sqrt(bar_inertia * inertia / mass) / length
        points += [(mass / 2, proximal + (centre + s) * (distal - proximal)) for s in (-spread, spread)]
    return points


def gradients(function: Callable[[np.ndarray], np.ndarray], q: np.ndarray) -> np.ndarray:
    """d function / dq by the complex step, exact to round-off; joint index last."""
    tiny = 1e-30
    return np.stack([function(q + 1j * tiny * np.eye(3)[k]).imag / tiny for k in range(3)], axis=-1)


def differences(function: Callable[[np.ndarray], np.ndarray], q: np.ndarray) -> np.ndarray:
    """d function / dq by central differences of eighth order; joint index last."""
    shifts = STEP * np.eye(3)
    return np.stack(
        [sum(w * (function(q + n * s) - function(q - n * s)) for n, w in CENTRAL) / STEP for s in shifts], axis=-1
    )


def mass_matrix(p: Any, q: np.ndarray, bar_inertia: float) -> np.ndarray:
    total = np.zeros((len(q), 3, 3))
    for index, (mass, _) in enumerate(point_masses(p, q, bar_inertia)):
        moved = gradients(lambda z, index=index: point_masses(p, z, bar_inertia)[index][1], q)
        total += mass * np.einsum("nai,naj->nij", moved, moved)
    return total


def potential(p: Any, q: np.ndarray, bar_inertia: float) -> np.ndarray:
    """V = -sum m g x3, for x3 points down."""
    return -p.g * sum(mass * position[:, 2] for mass, position in point_masses(p, q, bar_inertia))


def lagrange(
    p: Any, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, force: np.ndarray, bar_inertia: float
) -> np.ndarray:
    """tau = d/dt dT/dqd - dT/dq + dV/dq - J^T F with T = qd^T M(q) qd / 2."""
    inertia = mass_matrix(p, q, bar_inertia)
    slope = differences(lambda z: mass_matrix(p, z, bar_inertia), q)
    jacobian = gradients(lambda z: platform(p, z), q)
    return (
        np.einsum("nij,nj->ni", inertia, qdd)
        + np.einsum("nijk,nk,nj->ni", slope, qd, qd)
        - 0.5 * np.einsum("nijk,ni,nj->nk", slope, qd, qd)
        + gradients(lambda z: potential(p, z, bar_inertia), q)
        - np.einsum("nji,nj->ni", jacobian, force)
    )


def motion(p: Any, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    jacobian = gradients(lambda z: platform(p, z), q)
    slope = differences(lambda z: gradients(lambda y: platform(p, y), z), q)
    bend = np.einsum("nijk,nk,nj->ni", slope, qd, qd)
    return platform(p, q), np.einsum("nij,nj->ni", jacobian, qd), np.einsum("nij,nj->ni", jacobian, qdd) + bend


def peak_errors(candidate: np.ndarray, reference: np.ndarray) -> np.ndarray:
    return np.array([relative_error(candidate[:, j], reference[:, j]).peak_error for j in range(3)])


def without_bar_inertia(p: Any) -> Any:
    return dataclasses.replace(p, I1_left=0.0, I1_right=0.0, I2_left=0.0, I2_right=0.0, I5=0.0)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("form", FORMS)
def test_agrees_with_lagrange_for_unequal_limbs_payload_and_force(form: str, seed: int) -> None:
    function, bar_inertia = FORMS[form]
    p, (q, qd, qdd, force) = random_robot(seed), random_states(seed)
    expected = lagrange(p, q, qd, qdd, force, bar_inertia)
    found = function(p, q, qd, qdd, *motion(p, q, qd, qdd), force)
    assert peak_errors(found, expected).max() < ORACLE_TOLERANCE


# in the order of the enumeration: workers have to collect the same tests
@pytest.mark.parametrize(("form", "misprint"), [(form, m) for form in FORMS for m in Misprint if m in SEEN_BY[form]])
def test_every_misprint_disagrees_with_lagrange(form: str, misprint: Misprint) -> None:
    function, bar_inertia = FORMS[form]
    p, (q, qd, qdd, force) = random_robot(1), random_states(1)
    expected = lagrange(p, q, qd, qdd, force, bar_inertia)
    found = function(p, q, qd, qdd, *motion(p, q, qd, qdd), force, frozenset({misprint}))
    assert peak_errors(found, expected).max() > 1e3 * ORACLE_TOLERANCE


FRICTION = ("damping_", "coulomb_", "armature_")
"""Begin the names of what is added to every form alike, and tested with friction."""


@pytest.mark.parametrize("field", [f.name for f in dataclasses.fields(table_1()) if not f.name.startswith(FRICTION)])
def test_lagrange_tells_every_parameter(field: str) -> None:
    """A spoiled parameter must show in the rotation form, or the oracle would be blind to its term."""
    p, (q, qd, qdd, force) = random_robot(2), random_states(2)
    expected = lagrange(p, q, qd, qdd, force, 1.0)
    spoiled = dataclasses.replace(p, **{field: 1.01 * getattr(p, field)})
    found = literal.distributed_rotation(spoiled, q, qd, qdd, *motion(p, q, qd, qdd), force)
    error = peak_errors(found, expected).max()
    if field in ("a4", "a6"):  # listed in Table 1, in no equation
        assert error < ORACLE_TOLERANCE
    else:
        assert error > 1e3 * ORACLE_TOLERANCE


@pytest.mark.parametrize("form", FORMS)
def test_at_rest_holds_the_weight_and_the_external_force(form: str) -> None:
    function, _ = FORMS[form]
    p, (q, _, _, force) = random_robot(4), random_states(4)
    rest = np.zeros_like(q)
    x = platform(p, q)
    expected = differences(lambda z: potential(p, z, 1.0) - np.sum(force * platform(p, z), axis=1), q)
    found = function(p, q, rest, rest, x, rest, rest, force)
    assert peak_errors(found, expected).max() < ORACLE_TOLERANCE
    pushed_the_other_way = function(p, q, rest, rest, x, rest, rest, -force)
    assert peak_errors(pushed_the_other_way, expected).min() > 0.1


@pytest.mark.parametrize("form", FORMS)
def test_power_in_is_energy_gained(form: str) -> None:
    """tau . qd + F . xd = dE/dt, with E from positions differenced in time and no Lagrange equation in between."""
    function, bar_inertia = FORMS[form]
    p, (q, qd, qdd, force) = random_robot(5), random_states(5)
    step = 1e-4  # seconds

    def energy(t: float) -> np.ndarray:
        now, rate = q + qd * t + qdd * t**2 / 2, qd + qdd * t
        along = lambda s: point_masses(p, now + s * rate, bar_inertia)  # noqa: E731
        velocities = [position.imag / 1e-30 for _, position in along(1e-30j)]
        masses = [mass for mass, _ in along(0.0)]
        kinetic = sum(m * np.sum(v**2, axis=1) for m, v in zip(masses, velocities, strict=True)) / 2
        return kinetic + potential(p, now, bar_inertia)

    gained = sum(w * (energy(n * step) - energy(-n * step)) for n, w in CENTRAL) / step
    x, xd, xdd = motion(p, q, qd, qdd)
    supplied = np.sum(function(p, q, qd, qdd, x, xd, xdd, force) * qd + force * xd, axis=1)
    assert relative_error(supplied, gained).peak_error < ORACLE_TOLERANCE
    force_left_out = np.sum(function(p, q, qd, qdd, x, xd, xdd, 0 * force) * qd + force * xd, axis=1)
    assert relative_error(force_left_out, gained).peak_error > 1e-3


def test_without_bar_inertia_the_rotation_form_is_the_appendix() -> None:
    p, (q, qd, qdd, force) = random_robot(6), random_states(6)
    state = (q, qd, qdd, *motion(p, q, qd, qdd), force)
    lumped = literal.lumped_appendix(p, *state)
    assert peak_errors(literal.distributed_rotation(without_bar_inertia(p), *state), lumped).max() < ROUND_OFF
    assert peak_errors(literal.distributed_rotation(p, *state), lumped).min() > 1e-3


def test_equation_4_expands_to_the_appendix() -> None:
    p, (q, qd, qdd, force) = random_robot(7), random_states(7)
    state = (q, qd, qdd, *motion(p, q, qd, qdd), force)
    assert peak_errors(literal.lumped_equation4(p, *state), literal.lumped_appendix(p, *state)).max() < ROUND_OFF
    both_printed = literal.lumped_equation4(p, *state, literal.EQUATION4_AS_PRINTED)
    assert peak_errors(both_printed, literal.lumped_appendix(p, *state, literal.APPENDIX_AS_PRINTED)).max() > 1e-3


def test_the_literal_forms_are_those_of_the_mechanism() -> None:
    """The kernel and its kinematics were written apart from these forms."""
    p, (q, qd, qdd, force) = random_robot(8), random_states(8)
    mechanism = Asym2rssPpap(p)
    state = (q, qd, qdd, *mechanism.platform_motion(q, qd, qdd), force)
    lumped = mechanism.inverse_dynamics(q, qd, qdd, "lumped", force)
    distributed = mechanism.inverse_dynamics(q, qd, qdd, "distributed", force)
    assert peak_errors(literal.lumped_appendix(p, *state), lumped).max() < ROUND_OFF
    assert peak_errors(literal.lumped_equation4(p, *state), lumped).max() < ROUND_OFF
    assert peak_errors(literal.distributed_rotation(p, *state), distributed).max() < ROUND_OFF
    assert peak_errors(literal.distributed_rotation(p, *state), lumped).min() > 1e-3


def printed_appendix(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, x: np.ndarray, xd: np.ndarray, xdd: np.ndarray):
    """The appendix to the letter, misprints included, with the numbers of Table 1; scalar, sample by sample."""
    a1, a5, L, l, g = 0.2, 0.25, 0.2, 0.1, 9.81
    m1, m2, m3, m4, m5, m6, M = 0.2, 0.3, 0.45, 0.1, 0.5, 0.1, 0.0
    tau = []
    for (_, q2, q3), (_, v2, v3), (w1, w2, w3), (x1, x2, x3), (_, y2, _), (_, z2, z3) in zip(
        q, qd, qdd, x, xd, xdd, strict=True
    ):
        s2, c2, s3, c3 = math.sin(q2), math.cos(q2), math.sin(q3), math.cos(q3)
        Jx = [[1, 0, 0], [x1, x2 - l + L + a1 * c2, x3 - a1 * s2], [x1, x2 + l - L - a1 * c3, x3 - a1 * s3]]
        Jq22 = (x2 - l + L + a1 * c2) * (a1 * s2) + (x3 - a1 * s2) * (a1 * c2)
        Jq33 = (x2 + l - L - a1 * c3) * (a1 * s3) + (x3 - a1 * s3) * (a1 * c3)
        J = np.linalg.inv(Jx) @ np.diag([1, Jq22, Jq33])
        r = a5**2 - x2**2
        K1 = (m2 / 4 + m3 + m4 + m5 + m6 + M) * w1
        K2 = (m1 + m2) * (a1**2 * w2 / 4 - g * a1 * c2 / 2) + m2 * a1 / 4 * (z2 * s2 + z3 * c2)
        K3 = (m1 + m2) * (a1**2 * w3 / 4 - g * a1 * c3 / 2) + m2 * a1 / 4 * (-z2 * s3 + z3 * c3)
        K4 = m2 * a1 / 4 * (w2 * s2 + v2**2 * c2 - w3 * s3 - v3**2 * c3) + (m2 / 2 + m3 + m5 / 4 + m6 + M) * z2
        K5 = (m5 / 4 + m6) * ((y2**2 + x2 * z2) * r**-0.5 + (x2 * y2) ** 2 * r**-1.5) + (m5 / 2 + m6) * g
        K5 *= x2 * r**-0.5
        K6 = m2 * a1 / 4 * (w2 * c2 - v2**2 * s2 + w3 * c3 - v3**2 * s3)
        K6 += (m2 / 2 + m3 + M) * z3 - (m2 + m3 + M) * g
        f1 = -K1 - (K4 + K5) * J[1, 0] - K6 * J[2, 0]
        f2 = -K2 - (K4 + K5) * J[1, 1] - K6 * J[2, 2]
        f3 = -K3 - (K4 + K5) * J[1, 2] - K6 * J[2, 2]
        tau.append([-f1, -f2, -f3])
    return np.array(tau)


def test_all_switches_on_is_the_appendix_to_the_letter() -> None:
    p, (q, qd, qdd) = table_1(), SIMULATION_2
    state = (q, qd, qdd, *motion(p, q, qd, qdd))
    as_printed = printed_appendix(*state)
    force = np.zeros_like(q)
    found = literal.lumped_appendix(p, *state, force, literal.APPENDIX_AS_PRINTED)
    assert peak_errors(found, as_printed).max() < ROUND_OFF
    assert peak_errors(literal.lumped_appendix(p, *state, force), as_printed).max() > 0.1


EFFECTS = [
    # misprints, form, then percent of the joint's peak on simulation 1 and on simulation 2: tau1 tau2 tau3
    ({Misprint.JQ33_SIGN}, "lumped_appendix", (0, 0, 101.60), (0, 0, 116.67)),
    ({Misprint.K1_M2_QUARTER}, "lumped_appendix", (0.52, 0, 0), (1.10, 0, 0)),
    ({Misprint.F2_JXQ33}, "lumped_appendix", (0, 0, 0), (0, 6.04, 0)),
    # J_xq33 reaches tau2 only through the misprint in f2
    ({Misprint.JQ33_SIGN, Misprint.F2_JXQ33}, "lumped_appendix", (0, 101.60, 101.60), (0, 122.27, 116.67)),
    (literal.APPENDIX_AS_PRINTED, "lumped_appendix", (0.52, 101.60, 101.60), (1.10, 122.27, 116.67)),
    ({Misprint.TWO_M5}, "lumped_equation4", (3.48, 0, 0), (7.39, 8.61, 8.06)),
    ({Misprint.BD_GRAVITY_MISSING}, "lumped_equation4", (0, 0, 9.33), (0, 0, 1.07)),
    ({Misprint.PLATFORM_GRAVITY_MISSING}, "lumped_equation4", (95.00, 63.34, 63.34), (6.60, 8.01, 6.51)),
    (literal.EQUATION4_AS_PRINTED, "lumped_equation4", (98.39, 63.34, 96.09), (13.92, 12.40, 118.80)),
    ({Misprint.BD_ROTATION_Q2}, "distributed_rotation", (0, 0.24, 0.24), (0, 0.81, 1.27)),
    (literal.DISTRIBUTED_AS_PRINTED, "distributed_rotation", (0.53, 102.04, 100.98), (1.04, 116.80, 118.28)),
]


@pytest.mark.parametrize(("misprints", "form", "first", "second"), EFFECTS, ids=range(len(EFFECTS)))
def test_misprints_cost_what_the_errata_table_says(
    misprints: set[Misprint], form: str, first: tuple[float, ...], second: tuple[float, ...]
) -> None:
    function, _ = FORMS[form]
    p = table_1()
    for (q, qd, qdd), percent in ((SIMULATION_1, first), (SIMULATION_2, second)):
        state = (q, qd, qdd, *motion(p, q, qd, qdd), np.zeros_like(q))
        error = 100 * peak_errors(function(p, *state, frozenset(misprints)), function(p, *state))
        assert error == pytest.approx(percent, abs=0.006)


def test_lumped_against_distributed_on_the_papers_simulations() -> None:
    p = table_1()
    for (q, qd, qdd), percent in ((SIMULATION_1, (3.3, 1.6, 1.6)), (SIMULATION_2, (5.5, 4.5, 5.9))):
        state = (q, qd, qdd, *motion(p, q, qd, qdd), np.zeros_like(q))
        distributed = literal.distributed_rotation(p, *state)
        error = 100 * peak_errors(literal.lumped_appendix(p, *state), distributed)
        assert error == pytest.approx(percent, abs=0.06)


def test_equation_10_is_the_rods_angular_velocity() -> None:
    """Each column of the rod's rotation matrix must turn with omega; the printed eq. (9) lacks 1/a2^2 and does not."""
    p, (q, qd, qdd, _) = random_robot(9), random_states(9)
    _, xd, _ = motion(p, q, qd, qdd)

    def rod(z: np.ndarray) -> np.ndarray:
        tip = np.stack([0 * z[:, 0], -p.L_left - p.a1_left * np.cos(z[:, 1]), p.a1_left * np.sin(z[:, 1])], axis=1)
        return platform(p, z) - [0.0, p.l_left, 0.0] - tip

    u, ud = rod(q), np.einsum("nij,nj->ni", gradients(rod, q), qd)
    omega = np.cross(u, ud) / p.a2_left**2
    assert np.abs(np.cross(omega, u) - ud).max() < ROUND_OFF * np.abs(ud).max()
    printed = np.stack(
        [
            u[:, 1] * ud[:, 2] - u[:, 2] * ud[:, 1],
            u[:, 2] * ud[:, 0] - u[:, 0] * (xd[:, 2] - (xd - ud)[:, 1]),
            u[:, 0] * ud[:, 1] - u[:, 1] * ud[:, 0],
        ],
        axis=1,
    )
    assert np.abs(np.cross(printed, u) - ud).max() > 0.1 * np.abs(ud).max()


def test_rotation_matrices_are_rotations_in_every_direction() -> None:
    rng = np.random.default_rng(10)
    axes = np.concatenate([rng.normal(size=(200, 3)), np.eye(3), -np.eye(3), [[1e-9, 0.0, -1.0]]])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    rotation = literal._rotation_with_third_axis(axes)
    assert np.abs(rotation @ rotation.transpose(0, 2, 1) - np.eye(3)).max() < ROUND_OFF
    assert np.abs(np.linalg.det(rotation) - 1).max() < ROUND_OFF
    assert np.array_equal(rotation[:, :, 2], axes)
    assert np.abs(np.linalg.det(rotation[:, :, [1, 0, 2]]) - 1).min() > 1  # a reflection would be seen


def test_det_j_x_vanishes_although_the_arms_are_shorter_than_the_rods() -> None:
    """[Almeida2010] section 2 says it cannot unless a1 > a2; what counts is whether L - l + a1 reaches a2."""
    swing = 0.5455
    edge = math.sqrt(0.3**2 - (0.2 - 0.1 + 0.2 * math.cos(swing)) ** 2)  # 0.129 m, where the rods come in line
    near, at = (np.array([[edge - distance, swing, swing]]) for distance in (1e-2, 1e-6))
    mechanism = Asym2rssPpap(table_1())
    assert mechanism.singularity_measures(near)["det J_x"][0] > 0.1
    assert mechanism.singularity_measures(at)["det J_x"][0] < 0.01
