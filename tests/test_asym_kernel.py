"""The end-point form of the 2RSS+PPaP robot against oracles that share no code with it.

Oracles: the loop equations, solved here by Newton's method; Lagrange's equation with kinetic energy written as mass
centre and angular velocity of every bar; the power balance along a motion; the slope of the potential energy at rest.
First derivatives of positions are complex steps (no truncation), those of the mass matrix and of energies eighth-order
differences. Every agreement has a twin with one parameter or sign spoiled, which must not agree.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import workbench as wb
from robots import MODEL, Motion, motion_inside, peak_error, random_changes, sine_sum, table_1
from workbench.capabilities.robot import Robot
from workbench.errors import ArrayError, MotionError, ParameterError

EXACT = 1e-12  # rounding, relative to the quantity's peak
DIFFERENCES = 1e-8  # what eighth-order differences with STEP leave, with a margin
STEP = 1e-3
CENTRAL = ((1, 4 / 5), (2, -1 / 5), (3, 4 / 105), (4, -1 / 280))
TINY = 1e-30  # of the complex step
SPOILED = 1e-4  # a twin must be off by more than this: ten thousand times the loosest tolerance

ROBOTS = ("table 1", "random 1", "random 4", "random 3")


def robot(label: str) -> Robot:
    if label == "table 1":
        return table_1()
    return wb.load_mechanism(MODEL, **random_changes(np.random.default_rng(int(label.split()[1]))))


def states(mech: Robot, label: str, count: int = 24) -> tuple[Motion, np.ndarray]:
    """A random motion inside the workspace, where differences are good, sampled coarsely; and a force."""
    rng = np.random.default_rng(ROBOTS.index(label) + 100)
    motion, _ = motion_inside(mech, rng, np.linspace(0.0, 1.0, count), tries=200, away=0.3)
    assert motion is not None
    return motion, rng.uniform(-20.0, 20.0, (count, 3))


# --- the oracle -------------------------------------------------------------------------------------------------------


def points(p: Any, q: np.ndarray) -> dict[str, np.ndarray]:
    """C, D, E, F, I and the platform x, each ``(n, 3)``, real or complex q; the loops closed by Newton's method."""
    q1, q2, q3 = q.T
    nil = np.zeros_like(q1)
    c = np.stack([nil, -p.L_left - p.a1_left * np.cos(q2), p.a1_left * np.sin(q2)], axis=1)
    d = np.stack([nil, p.L_right + p.a1_right * np.cos(q3), p.a1_right * np.sin(q3)], axis=1)
    # from far below, Newton's method comes down on the lower meet of the rods: the platform hangs
    y, z = nil.copy(), nil + 5.0
    for _ in range(60):
        uy, uz, wy, wz = y - p.l_left - c[:, 1], z - c[:, 2], y + p.l_right - d[:, 1], z - d[:, 2]
        f = 0.5 * (q1**2 + uy**2 + uz**2 - p.a2_left**2)
        g = 0.5 * (q1**2 + wy**2 + wz**2 - p.a2_right**2)
        det = uy * wz - uz * wy
        y, z = y - (wz * f - uz * g) / det, z - (uy * g - wy * f) / det
    x = np.stack([q1, y, z], axis=1)
    left, right = np.array([0.0, p.l_left, 0.0]), np.array([0.0, p.l_right, 0.0])
    tip = np.stack([q1, y, np.sqrt(p.a5**2 - y**2)], axis=1)
    return {"C": c, "D": d, "x": x, "E": x - left, "F": x + right, "I": tip}


def rates(p: Any, q: np.ndarray) -> dict[str, np.ndarray]:
    """d(point)/dq, each ``(n, 3, 3)``, by complex steps."""
    steps = [points(p, q + 1j * TINY * np.eye(3)[j]) for j in range(3)]
    return {name: np.stack([s[name].imag / TINY for s in steps], axis=2) for name in steps[0]}


def bars(p: Any, where: dict[str, np.ndarray]) -> list[tuple[str, str | np.ndarray, str, float, float, float, float]]:
    """Proximal point, distal point, mass, inertia, fraction, length of every bar."""
    q1 = where["x"][:, :1]
    fixed = np.zeros((len(q1), 3), dtype=q1.dtype)
    slider = np.concatenate([q1, 0 * q1, 0 * q1], axis=1)
    a, b = fixed + np.array([0.0, -p.L_left, 0.0]), fixed + np.array([0.0, p.L_right, 0.0])
    return [
        ("A", a, "C", p.m1_left, p.I1_left, p.k1_left, p.a1_left),
        ("B", b, "D", p.m1_right, p.I1_right, p.k1_right, p.a1_right),
        ("C", where["C"], "E", p.m2_left, p.I2_left, p.k2_left, p.a2_left),
        ("D", where["D"], "F", p.m2_right, p.I2_right, p.k2_right, p.a2_right),
        ("H", slider, "I", p.m5, p.I5, p.k5, p.a5),
    ]


def mass_matrix(p: Any, q: np.ndarray, inertia: float) -> np.ndarray:
    """M(q) ``(n, 3, 3)`` from T = sum m |v|^2 / 2 + I |omega|^2 / 2, with omega = r x rd / len^2 for every bar."""
    where, rate = points(p, q), rates(p, q)
    still = np.zeros_like(rate["C"])
    slide = still.copy()
    slide[:, 0, 0] = 1.0
    rate |= {"A": still, "B": still, "H": slide}
    total = np.zeros_like(rate["C"])

    def add(weight: float, jacobian: np.ndarray) -> None:
        total[:] += weight * np.einsum("nki,nkj->nij", jacobian, jacobian)

    for near, near_point, far, m, i_t, k, length in bars(p, where):
        add(m, (1 - k) * rate[near] + k * rate[far])
        turn = np.cross((where[far] - near_point)[:, :, None], rate[far] - rate[near], axis=1) / length**2
        add(inertia * i_t, turn)
    add(p.m3 + p.payload, rate["x"])
    add(p.m4, slide)
    add(p.m6, rate["I"])
    return total


def potential(p: Any, q: np.ndarray) -> np.ndarray:
    """V ``(n,)``; x3 points down, so weight lowers V along +x3."""
    where = points(p, q)
    height = (p.m3 + p.payload) * where["x"][:, 2] + p.m6 * where["I"][:, 2]
    for _, near_point, far, m, _, k, _ in bars(p, where):
        height = height + m * ((1 - k) * near_point[:, 2] + k * where[far][:, 2])
    return -p.g * height


def weight(p: Any, q: np.ndarray) -> np.ndarray:
    """dV/dq ``(n, 3)``."""
    return np.stack([potential(p, q + 1j * TINY * np.eye(3)[j]).imag / TINY for j in range(3)], axis=1)


def lagrange(p: Any, motion: Motion, force: np.ndarray, inertia: float) -> np.ndarray:
    """Tau from d/dt (dT/dqd) - dT/dq + dV/dq - J^T f."""
    q, qd, qdd = motion
    slopes = [
        sum(w * (mass_matrix(p, q + i * STEP * e, inertia) - mass_matrix(p, q - i * STEP * e, inertia)) / STEP
            for i, w in CENTRAL)
        for e in np.eye(3)
    ]  # fmt: skip
    dm = np.stack(slopes, axis=1)  # [n, k, i, j]
    tau = np.einsum("nij,nj->ni", mass_matrix(p, q, inertia), qdd)
    tau += np.einsum("nkij,nk,nj->ni", dm, qd, qd) - 0.5 * np.einsum("nkij,ni,nj->nk", dm, qd, qd)
    return tau + weight(p, q) - np.einsum("nki,nk->ni", rates(p, q)["x"], force)


def energy(p: Any, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    return 0.5 * np.einsum("ni,nij,nj->n", qd, mass_matrix(p, q, 1.0), qd) + potential(p, q)


def differentiate(function: Any, h: float) -> np.ndarray:
    return sum(w * (function(i * h) - function(-i * h)) for i, w in CENTRAL) / h


# --- kinematics -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("label", ROBOTS)
def test_the_platform_solves_the_loop_equations_and_hangs(label: str) -> None:
    mech = robot(label)
    p = mech.parameters
    (q, _, _), _ = states(mech, label)
    x = mech.forward_kinematics(q)
    where = points(p, q)
    gaps = [
        np.linalg.norm(x - [0, p.l_left, 0] - where["C"], axis=1) - p.a2_left,
        np.linalg.norm(x - [0, -p.l_right, 0] - where["D"], axis=1) - p.a2_right,
        x[:, 0] - q[:, 0],
        *(x - where["x"]).T,  # Newton's root, reached from below
    ]
    assert np.abs(gaps).max() < EXACT
    # the other root is the mirror image in the line through the two circle centres; the platform hangs below it
    centre_l, centre_r = where["C"] + [0, p.l_left, 0], where["D"] - [0, p.l_right, 0]
    line = (centre_r - centre_l)[:, 1:]
    normal = np.stack([-line[:, 1], line[:, 0]], axis=1) / np.linalg.norm(line, axis=1)[:, None]
    other = x[:, 1:] - 2 * normal * np.sum((x - centre_l)[:, 1:] * normal, axis=1)[:, None]
    assert (x[:, 2] > other[:, 1] + 1e-3).all()


def test_a_rod_longer_by_a_micrometre_leaves_the_loop_open() -> None:
    mech = table_1()
    (q, _, _), _ = states(mech, "table 1")
    x = mech.with_parameters(a2_left=0.300001).forward_kinematics(q)
    gap = np.linalg.norm(x - [0, 0.1, 0] - points(mech.parameters, q)["C"], axis=1) - 0.3
    assert np.abs(gap).min() > 1e-7


@pytest.mark.parametrize("label", ROBOTS)
@pytest.mark.parametrize("elbows", [("out", "out"), ("in", "out"), ("out", "in"), ("in", "in")])
def test_forward_kinematics_undo_inverse_kinematics(label: str, elbows: tuple[str, str]) -> None:
    mech = robot(label)
    (q0, _, _), _ = states(mech, label)
    x = mech.forward_kinematics(q0)
    q = mech.inverse_kinematics(x, elbows)
    p, where = mech.parameters, points(mech.parameters, q.copy())
    u, w = x - [0, p.l_left, 0] - where["C"], x - [0, -p.l_right, 0] - where["D"]
    assert np.abs(np.linalg.norm(u, axis=1) - p.a2_left).max() < EXACT
    assert np.abs(np.linalg.norm(w, axis=1) - p.a2_right).max() < EXACT
    if elbows == ("out", "out"):
        # equal only modulo the elbow that q0 had; the paper's pose is out
        out = np.abs(q - q0).max(axis=1) < 1e-9
        assert out.sum() >= len(q) // 2
    # arms turned inwards may pass each other; the pose is the hanging one exactly where x is the lower meet
    span = where["D"] - [0, p.l_right, 0] - where["C"] - [0, p.l_left, 0]
    hangs = np.sign(span[:, 1]) * (u[:, 2] * span[:, 1] - u[:, 1] * span[:, 2]) > 1e-6
    for sample in np.flatnonzero(hangs):
        again = mech.forward_kinematics(q[sample : sample + 1])[0]
        assert np.abs(again - x[sample]).max() < 1e-11
    if elbows == ("out", "out"):
        assert hangs.all()


def test_the_elbow_branches_differ_and_meet_the_paper_pose() -> None:
    mech = table_1()
    q = np.array([[0.02, 0.7, 0.9]])
    x = mech.forward_kinematics(q)
    assert np.abs(mech.inverse_kinematics(x) - q).max() < EXACT
    inner = mech.inverse_kinematics(x, ("in", "out"))
    assert abs(inner[0, 1] - q[0, 1]) > 0.1
    assert inner[0, 2] == pytest.approx(q[0, 2], abs=EXACT)
    with pytest.raises(ParameterError, match="elbow branch"):
        mech.inverse_kinematics(x, ("out", "up"))


@pytest.mark.parametrize("label", ROBOTS)
def test_jacobian_is_the_slope_of_the_platform_position(label: str) -> None:
    mech = robot(label)
    (q, qd, qdd), _ = states(mech, label)
    jacobian, slope = mech.jacobian(q), rates(mech.parameters, q)["x"]
    peak = np.abs(slope).max()
    assert np.abs(jacobian - slope).max() < EXACT * peak
    assert np.abs(mech.platform_motion(q, qd, qdd)[1] - np.einsum("nij,nj->ni", slope, qd)).max() < 1e-11
    swapped = jacobian[:, :, [0, 2, 1]]
    assert np.abs(swapped - slope).max() > SPOILED * peak


@pytest.mark.parametrize("label", ROBOTS)
def test_platform_acceleration_is_the_slope_of_its_velocity(label: str) -> None:
    mech = robot(label)
    (q, qd, qdd), _ = states(mech, label)

    def velocity(h: float, factor: float = 1.0) -> np.ndarray:
        at = q + h * qd + 0.5 * factor * h**2 * qdd
        return np.einsum("nij,nj->ni", rates(mech.parameters, at)["x"], qd + factor * h * qdd)

    xdd = mech.platform_motion(q, qd, qdd)[2]
    assert peak_error(differentiate(velocity, 1e-4), xdd) < DIFFERENCES
    assert peak_error(differentiate(lambda h: velocity(h, 1.001), 1e-4), xdd) > SPOILED


@pytest.mark.parametrize("label", ROBOTS)
def test_joint_motion_undoes_platform_motion(label: str) -> None:
    mech = robot(label)
    motion, _ = states(mech, label)
    platform = mech.platform_motion(*motion)
    out = np.abs(mech.inverse_kinematics(platform[0]) - motion[0]).max(axis=1) < 1e-9
    assert out.any()
    back = mech.joint_motion(*(array[out] for array in platform))
    for found, given_ in zip(back, motion, strict=True):
        assert peak_error(found, given_[out]) < 1e-10
    spoiled = mech.joint_motion(platform[0][out], platform[1][out], platform[2][out] * 1.001)[2]
    assert peak_error(spoiled, motion[2][out]) > SPOILED


# --- inverse dynamics -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("label", ROBOTS)
@pytest.mark.parametrize(("mass_model", "inertia"), [("distributed", 1.0), ("lumped", 0.0)])
def test_torques_obey_lagrange(label: str, mass_model: str, inertia: float) -> None:
    mech = robot(label)
    motion, force = states(mech, label)
    tau = mech.inverse_dynamics(*motion, mass_model, force)
    oracle = lagrange(mech.parameters, motion, force, inertia)
    assert peak_error(tau, oracle) < DIFFERENCES
    assert peak_error(mech.inverse_dynamics(*motion, mass_model, -force), oracle) > SPOILED
    assert peak_error(lagrange(mech.parameters, motion, force, 1.0 - inertia), tau) > SPOILED


FRACTIONS = ("k1_left", "k1_right", "k2_left", "k2_right", "k5")


@pytest.mark.parametrize("name", [*FRACTIONS, "I1_left", "I2_right", "I5", "m3", "m4", "m6", "payload", "l_left"])
def test_lagrange_notices_every_parameter(name: str) -> None:
    mech = robot("random 1")
    motion, force = states(mech, "random 1")
    value = getattr(mech.parameters, name)
    changed = mech.with_parameters(**{name: value * 1.2})
    oracle = lagrange(mech.parameters, motion, force, 1.0)
    assert peak_error(changed.inverse_dynamics(*motion, "distributed", force), oracle) > SPOILED


@pytest.mark.parametrize("label", ROBOTS)
def test_power_of_the_actuators_is_the_rate_of_energy(label: str) -> None:
    mech = robot(label)
    t = np.linspace(0.0, 1.0, 15)
    seed = next(s for s in range(1000) if _inside(mech, sine_sum(np.random.default_rng(s), t, 0.8)[0]))

    def motion(h: float) -> Motion:
        return sine_sum(np.random.default_rng(seed), t + h, 0.8)

    def total(h: float) -> np.ndarray:
        q, qd, _ = motion(h)
        return energy(mech.parameters, q, qd)

    q, qd, qdd = motion(0.0)
    force = np.random.default_rng(seed).uniform(-20, 20, (len(t), 3))
    xd = mech.platform_motion(q, qd, qdd)[1]
    rate = differentiate(total, 5e-4)

    def imbalance(tau: np.ndarray) -> float:
        power = np.sum(tau * qd, axis=1) + np.sum(force * xd, axis=1)
        return float(np.abs(power - rate).max() / np.abs(rate).max())

    assert imbalance(mech.inverse_dynamics(q, qd, qdd, "distributed", force)) < DIFFERENCES
    assert imbalance(mech.inverse_dynamics(q, qd, qdd, "lumped", force)) > SPOILED
    assert imbalance(mech.inverse_dynamics(q, qd, qdd, "distributed")) > SPOILED


def _inside(mech: Robot, q: np.ndarray) -> bool:
    try:
        mech.forward_kinematics(q)
    except MotionError:
        return False
    return True


@pytest.mark.parametrize("label", ROBOTS)
@pytest.mark.parametrize("mass_model", ["distributed", "lumped"])
def test_at_rest_torques_are_the_slope_of_the_potential(label: str, mass_model: str) -> None:
    mech = robot(label)
    (q, _, _), _ = states(mech, label)
    still = np.zeros_like(q)
    tau = mech.inverse_dynamics(q, still, still, mass_model)
    slope = weight(mech.parameters, q)
    assert np.abs(tau - slope).max() < EXACT * np.abs(slope).max()
    heavier = mech.with_parameters(m3=mech.parameters.m3 * 1.01)
    assert np.abs(heavier.inverse_dynamics(q, still, still) - slope).max() > SPOILED * np.abs(slope).max()


@pytest.mark.parametrize("label", ROBOTS)
def test_a_static_force_is_carried_by_the_transposed_jacobian(label: str) -> None:
    mech = robot(label)
    (q, _, _), force = states(mech, label)
    still = np.zeros_like(q)
    carried = mech.inverse_dynamics(q, still, still, external_force=force) - mech.inverse_dynamics(q, still, still)
    needed = -np.einsum("nki,nk->ni", rates(mech.parameters, q)["x"], force)
    assert np.abs(carried - needed).max() < EXACT * 100 * np.abs(needed).max()
    assert np.abs(carried + needed).max() > SPOILED * np.abs(needed).max()


# --- batches, and what is no pose -------------------------------------------------------------------------------------


def test_a_batch_equals_its_samples_one_by_one_bit_for_bit() -> None:
    mech = robot("random 4")
    motion, force = states(mech, "random 4", 40)
    tau = mech.inverse_dynamics(*motion, external_force=force)
    platform = mech.platform_motion(*motion)
    for i in range(40):
        one = tuple(array[i : i + 1] for array in motion)
        assert np.array_equal(mech.inverse_dynamics(*one, external_force=force[i]), tau[i : i + 1])
        for whole, single in zip(platform, mech.platform_motion(*one), strict=True):
            assert np.array_equal(single, whole[i : i + 1])
    backwards = mech.inverse_dynamics(*(array[::-1] for array in motion), external_force=force[::-1])
    assert np.array_equal(backwards[::-1], tau)


def test_no_sample_gives_no_result() -> None:
    empty = np.zeros((0, 3))
    assert table_1().inverse_dynamics(empty, empty, empty).shape == (0, 3)


HOME = [0.0, np.pi / 4, np.pi / 4]
OUTSIDE = [
    ([0.31, np.pi / 4, np.pi / 4], "q1", "rod length"),
    ([0.29, 0.1, 0.1], "q2, q3", "cannot meet"),
    ([0.0, 0.1, 2.4], "q2, q3", ""),
    ([0.0, 1.9, -0.9], "q2, q3", ""),
]


@pytest.mark.parametrize(("bad", "joint", "reason"), OUTSIDE)
@pytest.mark.parametrize("place", [0, 3, 6])
def test_a_sample_outside_is_an_error_that_names_sample_and_joint(
    bad: list[float], joint: str, reason: str, place: int
) -> None:
    mech = table_1()
    if joint != "q1":  # a short parallelogram, so that its reach is a limit too
        mech = mech.with_parameters(a5=0.05)
    q = np.tile(HOME, (7, 1))
    q[place] = bad
    still = np.zeros_like(q)
    calls = [
        lambda: mech.forward_kinematics(q),
        lambda: mech.jacobian(q),
        lambda: mech.platform_motion(q, still, still),
        lambda: mech.inverse_dynamics(q, still, still),
        lambda: mech.inverse_dynamics(q, still, still, "lumped"),
    ]
    for call in calls:
        with pytest.raises(MotionError, match=rf"^sample {place}, joint {joint}: .*{reason}") as caught:
            call()
        assert caught.value.facts["sample"] == place
        assert caught.value.facts["joint"] == joint


POSES = st.tuples(st.floats(-0.4, 0.4), st.floats(-4.0, 4.0), st.floats(-4.0, 4.0))


@given(st.lists(POSES, min_size=1, max_size=3))
def test_every_answer_is_finite_and_closed_or_an_error(samples: list[tuple[float, float, float]]) -> None:
    mech = _TABLE_1
    q = np.array(samples)
    rate = np.ones_like(q)
    refusal, x = None, q
    try:
        x = mech.forward_kinematics(q)
    except MotionError as error:
        refusal = error.facts
    if refusal is not None:
        assert 0 <= refusal["sample"] < len(q)
        assert refusal["joint"]
        return
    p = mech.parameters
    c = np.stack([0 * q[:, 0], -0.2 - 0.2 * np.cos(q[:, 1]), 0.2 * np.sin(q[:, 1])], axis=1)
    # near a singular pose the position is good to the root of rounding, its distance to C to rounding
    assert np.abs(np.linalg.norm(x - [0, p.l_left, 0] - c, axis=1) - p.a2_left).max() < 1e-9
    assert np.isfinite(mech.inverse_dynamics(q, rate, rate)).all()


_TABLE_1 = table_1()


def test_what_is_not_finite_is_refused_before_any_arithmetic() -> None:
    mech = table_1()
    q = np.tile(HOME, (4, 1))
    for argument in range(3):
        arrays = [q.copy(), np.zeros_like(q), np.zeros_like(q)]
        arrays[argument][2, 1] = np.nan
        with pytest.raises(ArrayError, match="sample 2, column 1 is nan"):
            mech.inverse_dynamics(*arrays)
    with pytest.raises(ArrayError, match="external_force"):
        mech.inverse_dynamics(q, q, q, external_force=[0.0, np.inf, 0.0])


def test_unreachable_platform_positions_name_the_limb() -> None:
    mech = table_1()
    x = np.tile(mech.forward_kinematics(np.array([HOME])), (3, 1))
    far_left, far_down = x.copy(), x.copy()
    far_left[1, 1] = 0.45
    far_down[2, 2] = 1.0
    with pytest.raises(MotionError, match="sample 1, joint q2"):
        mech.inverse_kinematics(far_left)
    with pytest.raises(MotionError, match="sample 2, joint q2"):
        mech.inverse_kinematics(far_down)


def test_an_arm_in_line_with_its_rod_is_singular() -> None:
    mech = table_1()
    # x2 = 0, the left arm points straight at E: q2 = angle of E seen from A, |AE| = a1 + a2
    x3 = np.sqrt(0.5**2 - 0.1**2)
    q2 = np.pi - np.arctan2(x3, 0.1)
    q = np.array([HOME, [0.0, q2, q2]])
    assert np.hypot(-0.2 - 0.2 * np.cos(q2) + 0.1, 0.2 * np.sin(q2) - x3) == pytest.approx(0.3, abs=EXACT)
    with pytest.raises(MotionError, match="sample 1, joint q2: singular pose"):
        mech.forward_kinematics(q)
    near = mech.singularity_measures(np.array([[0.0, q2 - 0.01, q2 - 0.01]]))
    assert 0 < abs(near["J_q22"][0]) < 0.05 < abs(mech.singularity_measures(q[:1])["J_q22"][0])


def test_torques_at_a_singular_pose_are_refused() -> None:
    q2 = np.pi - np.arctan2(np.sqrt(0.24), 0.1)
    q, still = np.array([HOME, [0.0, q2, q2]]), np.zeros((2, 3))
    with pytest.raises(MotionError, match="sample 1, joint q2: singular pose"):
        table_1().inverse_dynamics(q, still, still)


def test_rates_so_large_that_torques_overflow_are_refused() -> None:
    q = np.array([HOME])
    with pytest.raises(MotionError, match="sample 0"):
        table_1().inverse_dynamics(q, np.full((1, 3), 1e200), np.zeros((1, 3)))
