"""Projected inverse dynamics against answers known by other means; each oracle with a twin that must not agree.

Oracles: formulas for a pendulum, MuJoCo's own inverse of an open chain, Lagrange's equation of one-freedom linkages
from their closed-form positions, energy and power, virtual work of a force, Newton's law of single bodies.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

import workbench as wb
from robots import MODEL, FourBar, Motion, peak_error, sine_sum, slope, write_model
from workbench.errors import ModelError, ParameterError

EXACT = 1e-12
DIFFERENCES = 1e-9  # eighth-order differences of smooth functions, with a margin
SPOILED = 1e-4
G = 9.81
GRAVITY = np.array([0.0, 0.0, -G])

CONNECT = '<connect name="loop" site1="coupler_tip" site2="rocker_tip"/>'
STATES = np.random.default_rng(11).uniform(-1.0, 1.0, (40, 3)) * [2.5, 8.0, 60.0]


def four_bar(folder: Path, change: Callable[[str], str] = str, **options: str) -> wb.MujocoReference:
    model = FourBar()
    options = {"equality": CONNECT, "home": model.home()} | options
    return wb.MujocoReference(write_model(folder, change(model.bodies()), **options))


def columns(states: np.ndarray) -> Motion:
    return states[:, :1], states[:, 1:2], states[:, 2:3]


def lagrange(poses: Callable[[np.ndarray], np.ndarray], mass: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Tau at STATES of a planar linkage with one freedom, from mass centres and angles (x, z, angle) ``(n, k, 3)``."""
    q, qd, qdd = STATES.T
    weights = np.stack([mass, mass, inertia], axis=1)

    def inertia_of(at: np.ndarray) -> np.ndarray:
        return np.sum(weights * slope(lambda h: poses(at + h), 2e-3) ** 2, axis=(1, 2))

    weight = slope(lambda h: np.sum(mass * G * poses(q + h)[:, :, 1], axis=1), 2e-3)
    return inertia_of(q) * qdd + 0.5 * slope(lambda h: inertia_of(q + h), 5e-3) * qd**2 + weight


# --- open chains ------------------------------------------------------------------------------------------------------

ROD = """<body name="rod"><joint name="q" axis="0 -1 0" {}/>
  <inertial pos="0 0 -.4" mass="1.5" diaginertia=".2 .2 .01"/>{}</body>"""
TIP = '<site name="P" pos="0 0 -.7"/>'


def test_a_pendulum(tmp_path: Path) -> None:
    q, qd, qdd = columns(STATES)
    res = wb.MujocoReference(write_model(tmp_path, ROD.format("", TIP))).inverse_dynamics(q, qd, qdd)
    needed = (0.2 + 1.5 * 0.4**2) * qdd + 1.5 * G * 0.4 * np.sin(q)
    assert peak_error(res.tau, needed) < EXACT
    assert peak_error(res.tau, needed - 0.2 * qdd) > SPOILED
    sin, cos = np.sin(q), np.cos(q)
    out, ahead = np.hstack([sin, 0 * q, -cos]), np.hstack([cos, 0 * q, sin])
    assert np.abs(res.x - 0.7 * out).max() < EXACT
    assert np.abs(res.xd - 0.7 * qd * ahead).max() < EXACT * 10
    assert np.abs(res.xdd - 0.7 * (qdd * ahead - qd**2 * out)).max() < 1e-10
    hinge = 1.5 * 0.4 / 0.7 * res.xdd - 1.5 * GRAVITY
    assert peak_error(res.reactions["q"][:, [0, 2]], hinge[:, [0, 2]]) < EXACT


def test_damping_and_armature_of_a_pendulum(tmp_path: Path) -> None:
    q, qd, qdd = columns(STATES)
    plain = wb.MujocoReference(write_model(tmp_path, ROD.format("", TIP))).inverse_dynamics(q, qd, qdd)
    both = wb.MujocoReference(write_model(tmp_path, ROD.format('damping="0.3" armature="0.02"', TIP)))
    added = both.inverse_dynamics(q, qd, qdd).tau - plain.tau
    assert np.abs(added - 0.3 * qd - 0.02 * qdd).max() < EXACT * 100


def test_no_sample_gives_no_result(tmp_path: Path) -> None:
    nothing = np.zeros((0, 1))
    reference = wb.MujocoReference(write_model(tmp_path, ROD.format("", TIP)))
    assert reference.inverse_dynamics(nothing, nothing, nothing).tau.shape == (0, 1)


def test_a_double_pendulum_is_mujocos_own_inverse(tmp_path: Path) -> None:
    second = '<body name="two" pos="0 0 -.7"><joint name="q2" axis="1 0 0"/>'
    second += '<inertial pos="0 0.1 -.2" mass=".7" diaginertia=".03 .02 .01"/><site name="P" pos="0 0 -.4"/></body>'
    path = write_model(tmp_path, ROD.format("", second), motors=("q", "q2"))
    rng = np.random.default_rng(2)
    q, qd, qdd = (rng.normal(size=(20, 2)) * s for s in (1.0, 5.0, 40.0))
    res = wb.MujocoReference(path).inverse_dynamics(q, qd, qdd)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    needed = np.empty_like(q)
    for i in range(len(q)):
        data.qpos, data.qvel, data.qacc = q[i], qd[i], qdd[i]
        mujoco.mj_inverse(model, data)
        needed[i] = data.qfrc_inverse
    assert peak_error(res.tau, needed) < EXACT
    assert (res.rank == 0).all()
    assert np.isfinite(res.condition).all()
    # actuator order, not tree order
    swapped = wb.MujocoReference(write_model(tmp_path, ROD.format("", second), motors=("q2", "q")))
    turned = [a[:, ::-1] for a in (q, qd, qdd)]
    assert np.abs(swapped.inverse_dynamics(*turned).tau - res.tau[:, ::-1]).max() < EXACT
    assert peak_error(swapped.inverse_dynamics(q, qd, qdd).tau, needed) > SPOILED


# --- linkages with one freedom ----------------------------------------------------------------------------------------


def test_a_four_bar_obeys_lagrange(tmp_path: Path) -> None:
    model = FourBar()
    oracle = lagrange(lambda q: model.poses(q)[:, :3], model.mass, model.inertia)[:, None]
    res = four_bar(tmp_path).inverse_dynamics(*columns(STATES))
    assert peak_error(res.tau, oracle) < DIFFERENCES
    assert res.acceleration_residual.max() < 1e-10
    heavier = lagrange(lambda q: model.poses(q)[:, :3], model.mass * [1, 1, 1.001], model.inertia)[:, None]
    assert peak_error(res.tau, heavier) > SPOILED / 10
    mirrored = lagrange(lambda q: FourBar(-1).poses(q)[:, :3], model.mass, model.inertia)[:, None]
    assert peak_error(res.tau, mirrored) > SPOILED


def test_a_slider_crank_obeys_lagrange(tmp_path: Path) -> None:
    r, l = 0.1, 0.28
    bodies = f"""<body name="crank"><joint name="q" axis="0 -1 0"/>
      <inertial pos="0.03 0 0" mass="0.4" diaginertia=".001 .001 .001"/>
      <body name="rod" pos="{r} 0 0"><joint name="q_rod" axis="0 -1 0"/>
        <inertial pos="0.1 0 0.01" mass="0.6" diaginertia=".004 .004 .004"/><site name="rod_tip" pos="{l} 0 0"/>
      </body></body>
      <body name="slider"><joint name="q_slider" type="slide" axis="1 0 0"/><site name="P"/>
        <inertial pos="0 0 0" mass="1.1" diaginertia=".001 .001 .001"/></body>"""
    equality = '<connect name="loop" site1="rod_tip" site2="P"/>'
    path = write_model(tmp_path, bodies, equality, home=f"0 0 {r + l}")

    def poses(q: np.ndarray) -> np.ndarray:
        phi = -np.arcsin(r * np.sin(q) / l)
        cos, sin = np.cos(phi), np.sin(phi)
        slider = r * np.cos(q) + l * cos
        parts = [
            (0.03 * np.cos(q), 0.03 * np.sin(q), q),
            (r * np.cos(q) + 0.1 * cos - 0.01 * sin, r * np.sin(q) + 0.1 * sin + 0.01 * cos, phi),
            (slider, 0 * q, 0 * q),
        ]
        return np.stack([np.stack(part, axis=1) for part in parts], axis=1)

    mass, inertia = np.array([0.4, 0.6, 1.1]), np.array([0.001, 0.004, 0.001])
    res = wb.MujocoReference(path).inverse_dynamics(*columns(STATES))
    assert peak_error(res.tau, lagrange(poses, mass, inertia)[:, None]) < DIFFERENCES
    assert np.abs(res.x[:, 0] - poses(STATES[:, 0])[:, 2, 0]).max() < EXACT
    assert peak_error(res.tau, lagrange(poses, mass, inertia * [1, 1.05, 1])[:, None]) > SPOILED


def test_a_gear_carries_load_by_its_ratio(tmp_path: Path) -> None:
    bodies = ROD.format("", TIP) + ROD.replace("rod", "wheel").replace('"q"', '"q_wheel"').format("", "")
    path = write_model(tmp_path, bodies, '<joint joint1="q_wheel" joint2="q" polycoef="0.2 -1.5 0 0 0"/>')
    q, qd, qdd = columns(STATES)
    res = wb.MujocoReference(path).inverse_dynamics(q, qd, qdd)

    def alone(q: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        return (0.2 + 1.5 * 0.4**2) * qdd + 1.5 * G * 0.4 * np.sin(q)

    needed = alone(q, qdd) - 1.5 * alone(0.2 - 1.5 * q, -1.5 * qdd)
    assert peak_error(res.tau, needed) < EXACT
    assert peak_error(res.tau, alone(q, qdd)) > SPOILED


def test_a_welded_loop_is_the_hinged_one(tmp_path: Path) -> None:
    model = FourBar()
    stub = f"""<body name="stub" pos="{model.rocker} 0 0"><joint name="q_stub" axis="0 -1 0"/>
      <inertial pos="0 0 0" mass="0.3" diaginertia="0.002 0.002 0.002"/><site name="stub" quat=".6 0 .8 0"/></body>"""
    phi, psi = model.angles(np.array([0.9]))
    bodies = model.bodies().replace('<site name="rocker_tip"', stub + '<site name="rocker_tip"')
    bodies = bodies.replace('<site name="coupler_tip"', '<site name="coupler_tip" quat=".6 0 .8 0"')
    weld = '<weld name="loop" site1="coupler_tip" site2="stub"/>'
    path = write_model(tmp_path, bodies, weld, home=f"{model.home()} {phi[0] - psi[0]}")
    res = wb.MujocoReference(path).inverse_dynamics(*columns(STATES))

    def poses(q: np.ndarray) -> np.ndarray:
        angle, _ = model.angles(q)
        tip = [model.crank * turn(q) + model.coupler * turn(angle) for turn in (np.cos, np.sin)]
        return np.concatenate([model.poses(q)[:, :3], np.stack([*tip, angle], axis=1)[:, None]], axis=1)

    mass, inertia = np.append(model.mass, 0.3), np.append(model.inertia, 0.002)
    assert peak_error(res.tau, lagrange(poses, mass, inertia)[:, None]) < DIFFERENCES
    # without the weld's turn rows the stub would not turn with the coupler
    assert peak_error(res.tau, lagrange(poses, mass, inertia * [1, 1, 1, 0.9])[:, None]) > SPOILED / 10


# --- a spatial linkage ------------------------------------------------------------------------------------------------


def spatial_slider(
    folder: Path, axial: str = "1e-5", joint: str = "", gravity: str = "0 0 -9.81", base: str = ""
) -> Path:
    """Crank about y, a rod between two ball joints, a slider along (3, 4, 0)/5: the rod leaves every plane."""
    near, far = (end[0] for end in _rod_ends(np.zeros(1)))
    along = " ".join(repr(float(v)) for v in far - near)
    bodies = f"""<body name="crank"><joint name="q" axis="0 -1 0" {joint}/>
      <inertial pos="0.05 0 0" mass="0.4" diaginertia=".001 .001 .001"/>
      <body name="rod" pos="0.1 0 0" zaxis="{along}"><joint name="ball" type="ball"/>
        <inertial pos="0 0 0.2" mass="0.6" diaginertia=".008 .008 {axial}"/><site name="tip" pos="0 0 0.45"/>
      </body></body>
      <body name="slider" pos="0.05 0 0.03"><joint name="slide" type="slide" axis="3 4 0" {joint}/>
        <inertial pos="0 0 0" mass="1.1" diaginertia=".001 .001 .001"/><site name="P"/></body>"""
    start = _slider_travel(np.zeros(1))[0]
    loop = '<connect name="loop" site1="tip" site2="P"/>'
    return write_model(folder, bodies, loop, home=f"0 1 0 0 0 {start}", gravity=gravity, base=base)


def _slider_travel(q: np.ndarray) -> np.ndarray:
    gap = np.stack([0.05 - 0.1 * np.cos(q), 0 * q, 0.03 - 0.1 * np.sin(q)], axis=1)
    along = gap @ [0.6, 0.8, 0.0]
    return -along + np.sqrt(along**2 - np.sum(gap**2, axis=1) + 0.45**2)


def _rod_ends(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    near = 0.1 * np.stack([np.cos(q), 0 * q, np.sin(q)], axis=1)
    return near, np.array([0.05, 0.0, 0.03]) + _slider_travel(q)[:, None] * np.array([0.6, 0.8, 0.0])


def _spatial_energy(q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Kinetic and potential energy of `spatial_slider`, the rod with omega = r x rd / len^2."""
    near, far = _rod_ends(q)
    near_d, far_d = (part * qd[:, None] for part in slope(lambda h: np.array(_rod_ends(q + h)), 2e-3))
    k = 0.2 / 0.45
    omega = np.cross(far - near, far_d - near_d) / 0.45**2
    centre, centre_d = (1 - k) * near + k * far, (1 - k) * near_d + k * far_d
    kinetic = (0.4 * 0.05**2 + 0.001) * qd**2 + 0.6 * np.sum(centre_d**2, axis=1)
    kinetic += 0.008 * np.sum(omega**2, axis=1) + 1.1 * np.sum(far_d**2, axis=1)
    height = 0.4 * 0.05 * np.sin(q) + 0.6 * centre[:, 2] + 1.1 * far[:, 2]
    return np.stack([G * height, 0.5 * kinetic], axis=1)


def test_a_spatial_linkage_obeys_lagrange_and_its_energy_is_right(tmp_path: Path) -> None:
    q, qd, qdd = STATES.T
    res = wb.MujocoReference(spatial_slider(tmp_path)).inverse_dynamics(*columns(STATES))
    assert np.abs(res.x - _rod_ends(q)[1]).max() < EXACT

    def inertia(at: np.ndarray) -> np.ndarray:
        return 2 * _spatial_energy(at, np.ones_like(at))[:, 1]

    weight = slope(lambda h: _spatial_energy(q + h, q)[:, 0], 2e-3)
    oracle = inertia(q) * qdd + 0.5 * slope(lambda h: inertia(q + h), 5e-3) * qd**2 + weight
    assert peak_error(res.tau, oracle[:, None]) < DIFFERENCES
    assert peak_error(res.tau, (oracle - weight)[:, None]) > SPOILED
    # potential energy up to a constant (the fixed base body has a height too)
    energy = _spatial_energy(q, qd)
    assert np.abs(res.energy[:, 1] - energy[:, 1]).max() < 1e-10
    assert np.ptp(res.energy[:, 0] - energy[:, 0]) < 1e-10


def test_a_rods_axial_inertia_does_not_act(tmp_path: Path) -> None:
    references = [wb.MujocoReference(spatial_slider(tmp_path, axial)) for axial in ("1e-8", "1e-2")]
    thin, thick = (reference.inverse_dynamics(*columns(STATES)) for reference in references)
    assert peak_error(thin.tau, thick.tau) < 1e-11
    turned = wb.MujocoReference(spatial_slider(tmp_path)).inverse_dynamics(*columns(STATES * [1, 1, 1.001]))
    assert peak_error(thin.tau, turned.tau) > SPOILED


def test_a_turned_base_turns_nothing_that_is_told_in_its_frame(tmp_path: Path) -> None:
    quat = np.array([0.5, -0.1, 0.7, 0.3])
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quat / np.linalg.norm(quat))
    rotation = matrix.reshape(3, 3)
    base = f'pos="0.3 -0.2 0.5" quat="{quat[0]} {quat[1]} {quat[2]} {quat[3]}"'
    pull = rotation @ [0.0, 0.0, -G]
    force = np.array([3.0, -7.0, 5.0])
    plain = wb.MujocoReference(spatial_slider(tmp_path)).inverse_dynamics(*columns(STATES), external_force=force)
    path = spatial_slider(tmp_path, gravity=" ".join(repr(float(v)) for v in pull), base=base)
    turned = wb.MujocoReference(path).inverse_dynamics(*columns(STATES), external_force=force)
    for one, two in ((plain.tau, turned.tau), (plain.x, turned.x), (plain.xd, turned.xd), (plain.xdd, turned.xdd)):
        assert np.abs(one - two).max() < 1e-11 * np.abs(one).max()
    for name, reaction in plain.reactions.items():
        assert np.abs(turned.reactions[name] - reaction).max() < 1e-11 * np.abs(reaction).max(), name
    unturned = wb.MujocoReference(spatial_slider(tmp_path, base=base))
    wrong = unturned.inverse_dynamics(*columns(STATES), external_force=force)
    assert peak_error(wrong.tau, plain.tau) > SPOILED


# --- energy, power, virtual work --------------------------------------------------------------------------------------


def _imbalance(
    reference: wb.MujocoReference, motion: Callable[[float], Motion], force: np.ndarray, factor: float
) -> float:
    """Power of actuators (times *factor*) and force less the rate of energy, over the peak rate."""
    q, qd, qdd = motion(0.0)
    res = reference.inverse_dynamics(q, qd, qdd, external_force=force)
    rate = slope(lambda h: reference.inverse_dynamics(*motion(h)).energy.sum(axis=1), 1e-3)
    power = factor * np.sum(res.tau * qd, axis=1) + np.sum(force * res.xd, axis=1)
    return float(np.abs(power - rate).max() / np.abs(rate).max())


def test_power_balance_of_the_robot() -> None:
    t = np.linspace(0.0, 1.0, 25)
    reference = wb.MujocoReference(MODEL, payload=0.7, k2_left=0.4, m1_right=0.35)

    def motion(h: float) -> Motion:
        return sine_sum(np.random.default_rng(6), t + h, 0.8)

    force = np.random.default_rng(1).uniform(-20, 20, (len(t), 3))
    assert _imbalance(reference, motion, force, 1.0) < 10 * DIFFERENCES
    assert _imbalance(reference, motion, force, 1.001) > SPOILED


def test_power_balance_with_damping(tmp_path: Path) -> None:
    t = np.linspace(0.0, 1.0, 25)[:, None]

    def motion(h: float) -> Motion:
        s = t + h
        return 2 * np.sin(5 * s), 10 * np.cos(5 * s), -50 * np.sin(5 * s)

    reference = wb.MujocoReference(spatial_slider(tmp_path, joint='damping="0.4" armature="0.01"'))
    res = reference.inverse_dynamics(*motion(0.0))
    rate = slope(lambda h: reference.inverse_dynamics(*motion(h)).energy.sum(axis=1), 1e-3)
    lost = 0.4 * (res.qvel[:, 0] ** 2 + res.qvel[:, -1] ** 2)
    power = np.sum(res.tau * motion(0.0)[1], axis=1)
    assert np.abs(power - rate - lost).max() < DIFFERENCES * np.abs(rate).max()
    assert np.abs(power - rate).max() > SPOILED * np.abs(rate).max()


def test_an_external_force_works_through_the_platforms_slope() -> None:
    q, qd, qdd = sine_sum(np.random.default_rng(9), np.linspace(0.0, 1.0, 20), 0.9)
    reference = wb.MujocoReference(MODEL)
    force = np.random.default_rng(1).uniform(-50, 50, (len(q), 3))
    pulled, free = (reference.inverse_dynamics(q, qd, qdd, external_force=f).tau for f in (force, None))
    carried = pulled - free
    rest = np.zeros_like(q)
    jacobian = np.stack(
        [slope(lambda h, e=e: reference.inverse_dynamics(q + h * e, rest, rest).x, 2e-3) for e in np.eye(3)], axis=2
    )
    assert peak_error(carried, -np.einsum("nki,nk->ni", jacobian, force)) < DIFFERENCES
    assert peak_error(carried, -np.einsum("nki,nk->ni", jacobian, force[:, [0, 2, 1]])) > SPOILED
    assert np.array_equal(
        reference.inverse_dynamics(q, qd, qdd, external_force=force[0]).tau[0],
        pulled[0],
    )


# --- reactions --------------------------------------------------------------------------------------------------------


def test_newtons_law_of_rods_and_platform() -> None:
    t = np.linspace(0.0, 1.0, 25)
    reference = wb.MujocoReference(MODEL, payload=0.4, k2_left=0.4)
    gravity = np.array([0.0, 0.0, G])  # the paper's frame has x3 down

    def motion(h: float) -> Motion:
        return sine_sum(np.random.default_rng(6), t + h, 0.8)

    def centres(h: float) -> np.ndarray:
        """Mass centres of rods CE and DF and the platform's position, from the actuated and platform coordinates."""
        q, qd, qdd = motion(h)
        x = reference.inverse_dynamics(q, qd, qdd).x
        nil = 0 * q[:, 0]
        c = np.stack([nil, -0.2 - 0.2 * np.cos(q[:, 1]), 0.2 * np.sin(q[:, 1])], axis=1)
        d = np.stack([nil, 0.2 + 0.2 * np.cos(q[:, 2]), 0.2 * np.sin(q[:, 2])], axis=1)
        return np.array([0.6 * c + 0.4 * (x - [0, 0.1, 0]), 0.5 * d + 0.5 * (x - [0, -0.1, 0]), x])

    acceleration = slope(lambda h: slope(lambda k: centres(h + k), 2e-3), 2e-3)
    force = np.random.default_rng(1).uniform(-20, 20, (len(t), 3))
    reactions = reference.inverse_dynamics(*motion(0.0), external_force=force).reactions
    left, right = reactions["spherical_E"], reactions["spherical_F"]
    sums = [
        (reactions["spherical_C"] + left, 0.3 * (acceleration[0] - gravity)),
        (reactions["spherical_D"] + right, 0.3 * (acceleration[1] - gravity)),
        (reactions["platform_slide"] - left - right + force, 0.85 * (acceleration[2] - gravity)),
    ]
    for found, needed in sums:
        assert peak_error(found, needed) < 100 * DIFFERENCES
        assert peak_error(found, needed + 0.3 * gravity * [0, 0, 0.01]) > SPOILED
    assert peak_error(reactions["spherical_C"] - left, sums[0][1]) > SPOILED


def test_newtons_law_at_the_spatial_rod_and_slider(tmp_path: Path) -> None:
    q, qd, qdd = STATES.T
    res = wb.MujocoReference(spatial_slider(tmp_path)).inverse_dynamics(*columns(STATES))
    k = 0.2 / 0.45

    def centre(h: float) -> np.ndarray:
        at = q + h * qd + 0.5 * h**2 * qdd
        near, far = _rod_ends(at)
        return (1 - k) * near + k * far

    acceleration = slope(lambda h: slope(lambda j: centre(h + j), 2e-4), 2e-4)
    needed = 0.6 * (acceleration - GRAVITY)
    assert peak_error(res.reactions["ball"] + res.reactions["loop"], needed) < 1e-6
    assert peak_error(res.reactions["ball"] - res.reactions["loop"], needed) > 1e-2
    # a slide joint carries nothing along its axis but what its own balance asks
    slider = res.reactions["slide"] - res.reactions["loop"]
    assert peak_error(slider, 1.1 * (res.xdd - GRAVITY)) < 1e-11
    assert np.abs(res.reactions["slide"] @ [0.6, 0.8, 0.0]).max() < 1e-10


# --- mass models, threads ---------------------------------------------------------------------------------------------

LUMPED = '<text name="lumped_bodies" data="coupler rocker"/>'


def test_lumped_bars_keep_mass_and_lose_inertia(tmp_path: Path) -> None:
    model = FourBar()
    reference = four_bar(tmp_path, extra=LUMPED)
    lumped = reference.inverse_dynamics(*columns(STATES), "lumped").tau
    oracle = lagrange(lambda q: model.poses(q)[:, :3], model.mass, model.inertia * [1, 0, 0])[:, None]
    assert peak_error(lumped, oracle) < DIFFERENCES
    distributed = reference.inverse_dynamics(*columns(STATES)).tau
    assert peak_error(distributed, oracle) > SPOILED
    whole = lagrange(lambda q: model.poses(q)[:, :3], model.mass, model.inertia)[:, None]
    assert peak_error(distributed, whole) < DIFFERENCES


@pytest.mark.parametrize("option", ['settotalmass="20"', 'boundinertia="0.01"'])
def test_a_compiler_option_that_makes_lumped_bars_others_is_refused(tmp_path: Path, option: str) -> None:
    text = MODEL.read_text(encoding="utf-8")
    path = tmp_path / "model.xml"
    path.write_text(text.replace('autolimits="true"', f'autolimits="true" {option}'), encoding="utf-8")
    reference = wb.MujocoReference(path)
    home = np.array([[0.01, 0.78, 0.74]])
    still = 0.0 * home
    with pytest.raises(ModelError, match=r"model\.xml: the model with lumped masses cannot be made, body_"):
        reference.inverse_dynamics(home, still, still, "lumped")
    # the model as it stands is one robot, whatever made it so
    expected = wb.load_mechanism(path).inverse_dynamics(home, still, still)
    assert peak_error(reference.inverse_dynamics(home, still, still).tau, expected) < 1e-10


@pytest.mark.parametrize("threads", [1, 2])
def test_the_engines_warnings_leave_no_log_behind(
    tmp_path: Path, threads: int, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """A platform next to no mass: MuJoCo prints that its mass matrix is nearly singular, and writes a log file."""
    monkeypatch.chdir(tmp_path)
    reference = wb.MujocoReference(MODEL, threads=threads, m3=1e-15)
    home = np.tile([[0.0, 0.78, 0.74]], (1100, 1))
    for mass_model in ("distributed", "lumped"):
        reference.inverse_dynamics(home, 0.0 * home, 0.0 * home, mass_model)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def test_lumped_without_names_or_with_a_wrong_one_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="lumped_bodies"):
        four_bar(tmp_path).inverse_dynamics(*columns(STATES), "lumped")
    wrong = four_bar(tmp_path, extra=LUMPED.replace("rocker", "rockr"))
    with pytest.raises(ModelError, match='names body "rockr"; did you mean "rocker"'):
        wrong.inverse_dynamics(*columns(STATES), "lumped")
    with pytest.raises(ParameterError, match='did you mean "lumped"'):
        wrong.inverse_dynamics(*columns(STATES), "lumpd")


@pytest.mark.parametrize("mass_model", ["distributed", "lumped"])
def test_threads_change_no_bit(mass_model: str) -> None:
    motion = sine_sum(np.random.default_rng(12), np.linspace(0.0, 1.0, 101), 0.9)
    one = wb.MujocoReference(MODEL).inverse_dynamics(*motion, mass_model)
    two = wb.MujocoReference(MODEL, threads=2).inverse_dynamics(*motion, mass_model)
    for name in ("tau", "x", "xd", "xdd", "qpos", "qvel", "qacc", "energy", "closure_residual", "condition"):
        assert np.array_equal(getattr(one, name), getattr(two, name)), name
    for name, reaction in one.reactions.items():
        assert np.array_equal(reaction, two.reactions[name]), name


def test_asking_again_changes_no_bit() -> None:
    first = sine_sum(np.random.default_rng(12), np.linspace(0.0, 1.0, 50), 0.9)
    second = sine_sum(np.random.default_rng(13), np.linspace(0.0, 1.0, 31), 0.9)
    reference = wb.MujocoReference(MODEL)
    before = reference.inverse_dynamics(*first)
    tau, qpos = before.tau.copy(), before.qpos.copy()
    reference.inverse_dynamics(*second, "lumped")
    after = reference.inverse_dynamics(*first)
    assert np.array_equal(before.tau, tau)
    assert np.array_equal(before.qpos, qpos)
    assert np.array_equal(after.tau, tau)
