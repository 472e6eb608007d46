"""Friction and rotors of both robots: against MuJoCo, a dissipation function, the power balance, cases by hand."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

import planar_4rprp_cases as planar
import workbench as wb
from robots import MODEL, Motion, motion_inside, peak_error, random_changes, slope, write_model
from workbench.campaign.run import run_campaign
from workbench.capabilities.robot import Robot
from workbench.dry_friction import REST_SPEED, direction
from workbench.errors import ModelError, ParameterError
from workbench.reference.power import power_balance
from workbench.robots.edit import edit_file

ROUND_OFF = 1e-10
DIFFERENCES = 1e-8
"""Joint rates by eighth-order differences of positions over 2 mrad or 2 mm, squared."""
POWER = 1e-9
SEEN = 1e-5
"""What a coefficient wrong by 1 % must at least change, of the largest torque."""

MODELS = {"asym_2rss_ppap": str(MODEL), "planar_4rprp": planar.MODEL}
DRIVES = [f"{kind}_q{number}" for kind in ("damping", "coulomb", "armature") for number in (1, 2, 3)]
PASSIVE = {
    "asym_2rss_ppap": ["damping_parallelogram", "damping_slide", "damping_ball_left", "damping_ball_right"],
    "planar_4rprp": ["damping_A", "damping_B", "damping_q4", "damping_slide"],
}
ROBOTS = pytest.mark.parametrize("robot", MODELS)
NAMES = [(robot, name) for robot in MODELS for name in DRIVES + PASSIVE[robot]]


def coefficients(robot: str, seed: int) -> dict[str, float]:
    """Random friction everywhere, strong enough to be a good part of the torques."""
    rng = np.random.default_rng(seed)
    slides = ("damping_slide", "damping_q4")
    names = DRIVES + PASSIVE[robot]
    return {name: float(rng.uniform(0.1, 1.0)) * (10.0 if name in slides else 1.0) for name in names}


def some_motion(robot: str, mech: Robot, seed: int) -> Motion:
    if robot == "planar_4rprp":
        return planar.scattered(mech, 60, seed)
    motion, _ = motion_inside(mech, np.random.default_rng(seed), np.linspace(0.0, 2.0, 60), tries=300, away=0.05)
    assert motion is not None
    return motion


def other_robot(robot: str, seed: int) -> dict[str, float]:
    if robot == "planar_4rprp":
        return planar.random_parameters(seed)
    return random_changes(np.random.default_rng(seed))


# --- against MuJoCo ---------------------------------------------------------------------------------------------------


@ROBOTS
@pytest.mark.parametrize("mass_model", ["distributed", "lumped"])
@pytest.mark.parametrize("seed", [1, 3])
def test_friction_is_mujocos(robot: str, mass_model: str, seed: int) -> None:
    changes = other_robot(robot, seed) | coefficients(robot, seed)
    mech, reference = (build(MODELS[robot], **changes) for build in (wb.load_mechanism, wb.MujocoReference))
    motion = some_motion(robot, mech, seed)
    force = np.array([8.0, -5.0, 12.0])
    needed = reference.inverse_dynamics(*motion, mass_model, force).tau
    assert peak_error(mech.inverse_dynamics(*motion, mass_model, force), needed) < ROUND_OFF
    assert peak_error(mech.inverse_dynamics(*motion, mass_model, force) - mech.friction(*motion), needed) > 0.01


@pytest.mark.parametrize(("robot", "name"), NAMES, ids=["-".join(pair) for pair in NAMES])
def test_each_coefficient_is_seen_and_counted_once(robot: str, name: str) -> None:
    alone = {name: 0.7}
    mech, reference = (build(MODELS[robot], **alone) for build in (wb.load_mechanism, wb.MujocoReference))
    motion = some_motion(robot, mech, 4)
    needed = reference.inverse_dynamics(*motion).tau
    assert peak_error(mech.inverse_dynamics(*motion), needed) < ROUND_OFF
    spoiled = mech.with_parameters(**{name: 0.7 * 1.01})
    assert peak_error(spoiled.inverse_dynamics(*motion), needed) > SEEN


@ROBOTS
def test_every_candidate_has_it(robot: str) -> None:
    smooth = wb.load_mechanism(MODELS[robot])
    rough = smooth.with_parameters(**coefficients(robot, 3))
    motion = some_motion(robot, smooth, 3)
    still = np.zeros_like(motion[0])
    added = rough.friction(*motion)
    for candidate in smooth.candidates.values():
        gap = candidate.function(rough, *motion, still) - candidate.function(smooth, *motion, still)
        assert peak_error(gap, added) < 1e-11, candidate.name
        assert peak_error(gap, 2 * added) > 0.1, candidate.name


@ROBOTS
def test_without_coefficients_nothing_changes(robot: str) -> None:
    mech = wb.load_mechanism(MODELS[robot])
    motion = some_motion(robot, mech, 5)
    still = np.zeros_like(motion[0])
    assert all(getattr(mech.parameters, name) == 0.0 for name in DRIVES + PASSIVE[robot])
    assert np.array_equal(mech.inverse_dynamics(*motion), mech.torques(*motion, "distributed", still))
    assert not mech.friction(*motion).any()
    assert mech.with_parameters(damping_slide=1e-3).friction(*motion).any()


@pytest.mark.skipif(importlib.util.find_spec("pinocchio") is None, reason="optional extra")
@ROBOTS
def test_friction_is_the_second_engines(robot: str) -> None:
    from workbench.reference.pinocchio_reference import PinocchioReference

    changes = coefficients(robot, 6)
    mech, second = (build(MODELS[robot], **changes) for build in (wb.load_mechanism, PinocchioReference))
    motion = some_motion(robot, mech, 6)
    assert peak_error(mech.inverse_dynamics(*motion), second.inverse_dynamics(*motion).tau) < ROUND_OFF


# --- the dissipation function -----------------------------------------------------------------------------------------

Function = Callable[[np.ndarray], np.ndarray]
Rates = list[tuple[str, np.ndarray]]
"""For each joint its coefficient's name and its rate per unit of each qd, ``(n, components, 3)``."""


def by_differences(function: Function, q: np.ndarray) -> np.ndarray:
    """Derivative of a function of q, ``(n, k)``, by each q: ``(n, k, 3)``."""
    return np.stack([slope(lambda h, e=e: function(q + h * e), 2e-3) for e in np.eye(3)], axis=2)


def turning(direction_of: Function, q: np.ndarray) -> np.ndarray:
    """Angular velocity, per unit of each qd, of a bar that does not spin: n x dn."""
    rates: np.ndarray = np.cross(direction_of(q)[:, :, None], by_differences(direction_of, q), axis=1)
    return rates


def rates_of_asym(mech: Robot, q: np.ndarray, hinges: int = 3, arm_sign: float = 1.0) -> Rates:
    p = mech.parameters
    found: Rates = []

    def angle(q: np.ndarray) -> np.ndarray:
        return np.arcsin(mech.forward_kinematics(q)[:, 1:2] / p.a5)

    def in_coupler(q: np.ndarray) -> np.ndarray:
        x = mech.forward_kinematics(q)
        return x[:, 2:3] - np.sqrt(p.a5**2 - x[:, 1:2] ** 2)

    found += [("damping_parallelogram", by_differences(angle, q))] * hinges
    found.append(("damping_slide", by_differences(in_coupler, q)))
    for name, column, side in (("left", 1, -1.0), ("right", 2, 1.0)):

        def arm(q: np.ndarray, column: int = column, side: float = side) -> np.ndarray:
            return np.stack([0 * q[:, column], side * np.cos(q[:, column]), np.sin(q[:, column])], axis=1)

        def rod(q: np.ndarray, name: str = name, side: float = side, arm: Function = arm) -> np.ndarray:
            base = np.array([0.0, side * getattr(p, f"L_{name}"), 0.0])
            end = mech.forward_kinematics(q) + np.array([0.0, side * getattr(p, f"l_{name}"), 0.0])
            return (end - base - getattr(p, f"a1_{name}") * arm(q)) / getattr(p, f"a2_{name}")

        found.append((f"damping_ball_{name}", turning(rod, q) - arm_sign * turning(arm, q)))
    return found


def rates_of_planar(mech: Robot, q: np.ndarray, hinges: int = 1, arm_sign: float = 1.0) -> Rates:
    p = mech.parameters
    feet = {1: (0.0, 0.0, 2), 2: (0.0, p.h, 0), 3: (p.b, 0.0, 2), 4: (p.a, p.h, 0)}
    found: Rates = []
    for number, (across, height, axis) in feet.items():

        def limb(q: np.ndarray, across: float = across, height: float = height, axis: int = axis) -> np.ndarray:
            x = mech.forward_kinematics(q)
            s, y = x[:, axis] - across, x[:, 1] - height
            return np.stack([np.arctan2(y, s), np.hypot(s, y)], axis=1)

        turn, stretch = np.split(by_differences(limb, q), 2, axis=1)
        found += [("damping_A", arm_sign * turn), ("damping_B", turn)] * hinges
        if number == 4:
            found.append(("damping_q4", stretch))
    moved = by_differences(mech.forward_kinematics, q)
    return [*found, ("damping_slide", moved[:, 0:1]), ("damping_slide", moved[:, 2:3] * arm_sign)]


def rayleigh(rates: Rates, mech: Robot, qd: np.ndarray) -> np.ndarray:
    """Derivative of half the sum of c w^2 by qd: ``(n, 3)``."""
    return np.sum(
        [
            getattr(mech.parameters, name) * np.einsum("nki,nkj,nj->ni", per_rate, per_rate, qd)
            for name, per_rate in rates
        ],
        axis=0,
    )


RATES = {"asym_2rss_ppap": rates_of_asym, "planar_4rprp": rates_of_planar}
SPOILED: dict[str, list[dict[str, float]]] = {
    "asym_2rss_ppap": [{"hinges": 2}, {"arm_sign": -1.0}, {"arm_sign": 0.0}],
    "planar_4rprp": [{"hinges": 2}, {"arm_sign": 0.0}],
}


@ROBOTS
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_passive_friction_is_the_slope_of_the_dissipation_function(robot: str, seed: int) -> None:
    changes = {name: value for name, value in coefficients(robot, seed).items() if name in PASSIVE[robot]}
    mech = wb.load_mechanism(MODELS[robot], **(other_robot(robot, 1) | changes))
    q, qd, qdd = (array[:25] for array in some_motion(robot, mech, seed))
    found = mech.friction(q, qd, qdd)
    assert peak_error(found, rayleigh(RATES[robot](mech, q), mech, qd)) < DIFFERENCES
    for wrong in SPOILED[robot]:
        assert peak_error(found, rayleigh(RATES[robot](mech, q, **wrong), mech, qd)) > 0.01, wrong


# --- power ------------------------------------------------------------------------------------------------------------


@ROBOTS
@pytest.mark.parametrize("mass_model", ["distributed", "lumped"])
def test_power_goes_into_energy_and_friction(robot: str, mass_model: str) -> None:
    changes = coefficients(robot, 8)
    mech, reference = (build(MODELS[robot], **changes) for build in (wb.load_mechanism, wb.MujocoReference))
    motion = tuple(array[:20] for array in some_motion(robot, mech, 8))
    tau = mech.inverse_dynamics(*motion, mass_model)
    balance = power_balance(reference, *motion, mass_model, tau=tau)
    assert balance.relative < POWER
    for name in DRIVES + PASSIVE[robot]:
        spoiled = mech.with_parameters(**{name: 1.01 * changes[name]}).inverse_dynamics(*motion, mass_model)
        residual = balance.residual + np.sum((spoiled - tau) * motion[1], axis=1)[balance.samples]
        assert np.abs(residual).max() > 1e3 * POWER * balance.peak_power, name


# --- by hand ----------------------------------------------------------------------------------------------------------


def test_a_platform_that_sinks_between_equal_arms() -> None:
    """Both arms alike and q1 = 0: the parallelogram stands, and each rod turns by its inclination alone."""
    ball, slide, rate, angle = 0.3, 4.0, 1.7, 0.8
    mech = wb.load_mechanism(MODEL, damping_ball=ball, damping_slide=slide, damping_parallelogram=9.0)
    p = mech.parameters
    inclination = np.arccos((p.L - p.l + p.a1 * np.cos(angle)) / p.a2)
    falls = p.a1 * np.sin(angle) * rate / (p.a2 * np.sin(inclination))
    sinks = p.a1 * np.cos(angle) * rate + p.a2 * np.cos(inclination) * falls
    # arm and rod turn against each other, so their rates add up
    each = (slide * sinks**2 / 2 + ball * (rate + falls) ** 2) / rate
    tau = mech.friction(*(np.array([row]) for row in ([0.0, angle, angle], [0.0, rate, rate], [0.0, 0.0, 0.0])))
    assert tau == pytest.approx(np.array([[0.0, each, each]]), rel=1e-12, abs=1e-12)
    subtracted = (slide * sinks**2 / 2 + ball * (rate - falls) ** 2) / rate
    assert tau[0, 1] != pytest.approx(subtracted, rel=1e-2)


def test_a_platform_that_goes_along_x_alone() -> None:
    """Only q2 changes: limbs 1 and 3 stand, limb 2 turns, limb 4 turns and changes its length."""
    c = {"damping_A": 0.2, "damping_B": 0.1, "damping_q4": 7.0, "damping_slide": 5.0}
    mech = wb.load_mechanism(planar.MODEL, **c)
    q, rate = planar.HOME + np.array([0.01, 0.02, -0.01]), 0.4
    px, py, _ = mech.forward_kinematics(q[None])[0]
    p = mech.parameters
    speed, low = q[1] * rate / px, py - p.h
    q4 = np.hypot(p.a - px, low)
    hinges = (c["damping_A"] + c["damping_B"]) * ((low / q[1] ** 2) ** 2 + (low / q4**2) ** 2)
    drag = hinges + c["damping_q4"] * ((p.a - px) / q4) ** 2 + c["damping_slide"]
    tau = mech.friction(q[None], np.array([[0.0, rate, 0.0]]), np.zeros((1, 3)))
    assert tau[0, 1] * rate == pytest.approx(drag * speed**2, rel=1e-12)
    assert tau[0, 1] * rate != pytest.approx((drag + hinges) * speed**2, rel=1e-3)


@ROBOTS
def test_drives_act_on_their_own_joint(robot: str) -> None:
    changes = {name: value for name, value in coefficients(robot, 2).items() if name in DRIVES}
    mech = wb.load_mechanism(MODELS[robot], **changes)
    q, qd, qdd = some_motion(robot, mech, 2)
    viscous, dry, rotor = (
        np.array([changes[f"{k}_q{n}"] for n in (1, 2, 3)]) for k in ("damping", "coulomb", "armature")
    )
    by_hand = viscous * qd + dry * np.sign(qd) + rotor * qdd
    assert np.abs(mech.friction(q, qd, qdd) - by_hand).max() < 1e-13 * np.abs(by_hand).max()
    assert peak_error(mech.friction(q, qd, qdd), by_hand[:, [0, 2, 1]]) > 0.01


# --- Coulomb friction at rest -----------------------------------------------------------------------------------------


def test_direction_of_a_joint_at_rest_is_none() -> None:
    rates = np.array([-1.0, -2 * REST_SPEED, -REST_SPEED / 2, -0.0, 0.0, REST_SPEED, 2 * REST_SPEED, 3.0])
    assert direction(rates).tolist() == [-1, -1, 0, 0, 0, 0, 1, 1]
    assert direction(rates).tolist() != np.sign(rates).tolist()


@ROBOTS
def test_both_sides_agree_at_rest_and_say_so(robot: str) -> None:
    changes = {"coulomb_q1": 3.0, "coulomb_q3": 2.0}
    mech, reference = (build(MODELS[robot], **changes) for build in (wb.load_mechanism, wb.MujocoReference))
    q, qd, qdd = some_motion(robot, mech, 9)
    qd = qd.copy()
    qd[:7, 0], qd[:5, 1], qd[7:9, 2] = 0.3 * REST_SPEED, 0.0, -0.9 * REST_SPEED
    assert peak_error(mech.inverse_dynamics(q, qd, qdd), reference.inverse_dynamics(q, qd, qdd).tau) < ROUND_OFF
    assert mech.friction(q, qd, qdd)[:7, 0].tolist() == [0.0] * 7
    t = np.arange(len(q), dtype=float)
    said = [text for text in mech.warnings(t, q, qd) if "Coulomb" in text]
    assert [text.split()[0] for text in said] == ["q1", "q3"]  # q2 rests too, but has no Coulomb friction
    assert "in 7 of 60 samples" in said[0]
    assert "in 2 of 60 samples" in said[1]
    assert "anything from -3 to 3" in said[0]
    qd[:9] = 1.0
    assert not [text for text in mech.warnings(t, q, qd) if "Coulomb" in text]


# --- the MJCF ---------------------------------------------------------------------------------------------------------


@ROBOTS
def test_parameters_reach_the_file_and_come_back(robot: str, tmp_path: Path) -> None:
    changes = coefficients(robot, 7)
    written = tmp_path / "robot.xml"
    edit_file(MODELS[robot], [f"{name}={value!r}" for name, value in changes.items()], out=written)
    read = wb.load_mechanism(written).parameters
    by_override = wb.load_mechanism(MODELS[robot], **changes).parameters
    assert read == by_override == wb.load_mechanism(MODELS[robot]).with_parameters(**changes).parameters
    assert {name: getattr(read, name) for name in changes} == changes
    model = mujoco.MjModel.from_xml_path(str(written))
    assert (model.dof_damping > 0).all()
    dry = sorted(changes[f"coulomb_q{number}"] for number in (1, 2, 3))
    assert sorted(model.dof_frictionloss[model.dof_frictionloss > 0]) == dry
    assert np.count_nonzero(model.dof_armature) == 3


def test_one_name_sets_both_ball_joints() -> None:
    mech = wb.load_mechanism(MODEL, damping_ball=0.4)
    assert (mech.parameters.damping_ball_left, mech.parameters.damping_ball_right) == (0.4, 0.4)


@ROBOTS
@pytest.mark.parametrize("name", DRIVES)
def test_negative_coefficients_are_refused(robot: str, name: str) -> None:
    with pytest.raises(ParameterError, match=rf"{name} = -1.*allowed: >= 0"):
        wb.load_mechanism(MODELS[robot], **{name: -1.0})


def spoiled_model(tmp_path: Path, old: str, new: str) -> Path:
    text = MODEL.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path = tmp_path / "spoiled.xml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


HINGE_1 = '<joint name="parallelogram_hinge_1" axis="1 0 0" damping="0"/>'
HINGE_2 = HINGE_1.replace("hinge_1", "hinge_2")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (HINGE_1, HINGE_1.replace('"0"/', '"0" frictionloss="0.2"/'), "frictionloss is 0.2.*no dry friction"),
        (HINGE_1, HINGE_1.replace('"0"/', '"0" armature="0.2"/'), "armature is 0.2.*no rotor inertia"),
        (HINGE_1, HINGE_1.replace('damping="0"', 'damping="0 0.3"'), "damping beyond its first number"),
        (HINGE_2, HINGE_2.replace('damping="0"', 'damping="0.1"'), "parallelogram_hinge_2.*damping is 0.1"),
    ],
)
def test_friction_that_the_closed_form_lacks_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        wb.load_mechanism(spoiled_model(tmp_path, old, new))


CRANK = """<body name="crank"><joint name="q" axis="0 1 0" {}/><inertial pos=".1 0 0" mass="1" diaginertia=".1 .1 .1"/>
<site name="P"/><site name="tip" pos=".2 0 0"/></body><body name="other" pos="0 0 .5"><joint name="r" axis="0 1 0" {}/>
<inertial pos=".1 0 0" mass="1" diaginertia=".1 .1 .1"/></body>"""
GEARED = '<joint joint1="r" joint2="q"/>'


@pytest.mark.parametrize("flag", ["damper", "frictionloss"])
def test_friction_that_mujoco_is_told_to_ignore_is_refused(tmp_path: Path, flag: str) -> None:
    path = spoiled_model(tmp_path, '<flag contact="disable"/>', f'<flag contact="disable" {flag}="disable"/>')
    assert wb.MujocoReference(path)
    with pytest.raises(ModelError, match=f'<flag {flag}> is disabled, yet joint "q2"'):
        wb.MujocoReference(path, damping_q2=0.1, coulomb_q2=0.1)


def test_the_reference_adds_dry_friction_of_any_mechanism(tmp_path: Path) -> None:
    q, qd, qdd = (np.array(column)[:, None] for column in ([0.1, 0.2, 0.3], [-2.0, 0.0, 3.0], [1.0, -1.0, 4.0]))
    smooth = wb.MujocoReference(write_model(tmp_path, CRANK.format("", ""), GEARED))
    without = smooth.inverse_dynamics(q, qd, qdd).tau
    rough = wb.MujocoReference(write_model(tmp_path, CRANK.format('frictionloss="0.7"', 'damping="0.2"'), GEARED))
    added = rough.inverse_dynamics(q, qd, qdd).tau - without
    assert added[:, 0] == pytest.approx([-0.7 - 0.4, 0.0, 0.7 + 0.6], abs=1e-12)


@pytest.mark.parametrize("name", ["friction_2rss_ppap", "friction_4rprp"])
def test_the_campaigns_hold_their_bounds(name: str, tmp_path: Path) -> None:
    file = Path(MODEL).parents[1] / "campaigns" / f"{name}.toml"
    outcome = run_campaign(file, tmp_path / "run", only=("everything",))
    assert outcome.passed
    assert all(row.peak_error < ROUND_OFF for row in outcome.rows if row.bound is not None)
    smooth = dict.fromkeys(DRIVES, 0.0)
    assert run_campaign(file, tmp_path / "smooth", only=("everything",), settings=smooth).passed
