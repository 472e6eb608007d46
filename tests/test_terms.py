"""The torque as a sum of terms, and the inertial regressor, against the reference and finite differences."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import workbench as wb
from own_mechanisms import FOURBAR, PARALLELOGRAM
from test_counted_forces import FEATURES, SETUP, motion, with_feature
from test_plant_terms import machine
from workbench.campaign.cases import base_robot
from workbench.campaign.spec import load_campaign
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference
from workbench.reference.body_motion import body_motion
from workbench.reference.regressor import NUMBERS, inertial_numbers, inertial_regressor
from workbench.reference.terms import ACCELERATION, PARTS, VELOCITY, WEIGHT, torque_terms
from workbench.reference.varied_model import places_of, settable, varied_reference
from workbench.robots.load import LoadedModel
from workbench.robots.parameters import Target
from workbench.robots.places import parse_place

FORCE = np.array([12.0, -8.0, 25.0])
FRICTION = {"damping_q1": 3.0, "coulomb_q2": 0.2, "armature_q3": 0.01, "damping_slide": 0.7}
EXAMPLES = ("delta", "fivebar", "fourbar", "orthoglide", "bricard")

Robot = tuple[MujocoReference, np.ndarray, np.ndarray, np.ndarray, str]


def own(repository: Path, name: str) -> MujocoReference:
    return base_robot(*load_campaign(repository / "examples" / name / f"{name}.toml"))[0].reference


@pytest.fixture(params=["almeida", "almeida lumped", "garcia", *EXAMPLES])
def robot(request: pytest.FixtureRequest, repository: Path) -> Robot:
    rng = np.random.default_rng(5)
    model = "lumped" if "lumped" in request.param else "distributed"
    if request.param.startswith("almeida"):
        reference = wb.MujocoReference(repository / "models" / "asym_2rss_ppap.xml", payload=0.7, **FRICTION)
        home = np.array([0.02, 0.75, 0.85])
    elif request.param == "garcia":
        reference = wb.MujocoReference(repository / "models" / "planar_4rprp.xml")
        home = np.array([0.389, 0.377, 0.389])
    else:
        reference = own(repository, request.param)
        home = reference.structure.home_qpos[reference.structure.actuated_qpos]
        if request.param in ("fivebar", "fourbar"):
            home = {"fivebar": np.array([2.1, 1.04]), "fourbar": np.array([1.0])}[request.param]
    na = len(reference.joint_names)
    q = home + 0.02 * rng.uniform(-1, 1, (6, na))
    return reference, q, 5 * rng.normal(size=q.shape), 40 * rng.normal(size=q.shape), model


def off(found: np.ndarray, wanted: np.ndarray) -> float:
    return float(np.abs(found - wanted).max() / np.abs(wanted).max())


@pytest.mark.parametrize("centres", [True, False])
@pytest.mark.parametrize("name", ["six legs", "15", "57"])
def test_bodies_move_as_the_jacobians_of_mujoco_say(tmp_path: Path, name: str, centres: bool) -> None:
    """On free, ball, hinge and slide joints, in trees that begin at several bodies of the world."""
    text, actuated, site = machine(name)
    (tmp_path / "model.xml").write_text(text)
    reference = MujocoReference(tmp_path / "model.xml", setup=Setup(actuated, site))
    rng = np.random.default_rng(4)
    q = reference.home + 0.02 * rng.uniform(-1, 1, (3, len(actuated)))
    qd, qdd = rng.uniform(-1, 1, (2, *q.shape))
    moving = body_motion(reference, q, qd, qdd, centres=centres)
    model, tangent = reference.compiled(), moving.tangent
    data, jac, turn, dot, turn_dot = mujoco.MjData(model), *np.zeros((4, 3, model.nv))
    for k, (qvel, qacc) in enumerate(zip(moving.result.qvel, moving.result.qacc, strict=True)):
        data.qpos[:], data.qvel[:] = moving.result.qpos[k], qvel
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        for body in range(1, model.nbody):
            place, b = (data.xipos if centres else data.xpos)[body], body - 1
            mujoco.mj_jac(model, data, jac, turn, place, body)
            mujoco.mj_jacDot(model, data, dot, turn_dot, place, body)
            driven = tangent[k] @ qdd[k]
            for found, wanted in (
                (moving.linear[k, b], jac @ tangent[k]), (moving.angular[k, b], turn @ tangent[k]),
                (moving.spin[k, b], turn @ qvel), (moving.linear_driven[k, b], jac @ driven),
                (moving.angular_driven[k, b], turn @ driven),
                (moving.linear_carried[k, b], jac @ (qacc - driven) + dot @ qvel),
                (moving.angular_carried[k, b], turn @ (qacc - driven) + turn_dot @ qvel),
            ):  # fmt: skip
                assert np.abs(found - wanted).max() < 1e-12 * (1.0 + np.abs(wanted).max())


def test_items_add_up_to_the_torque(robot: Robot) -> None:
    reference, *motion, model = robot
    terms = torque_terms(reference, *motion, model, FORCE)
    assert off(terms.total, terms.tau) < 1e-12
    assert {item.part for item in terms.items} <= set(PARTS)
    # the twin: with one item's sign turned they must not
    largest = max(terms.items, key=lambda item: float(np.abs(item.tau).max()))
    assert off(terms.total - 2 * largest.tau, terms.tau) > 0.01


def test_parts_are_what_the_reference_gives_alone(robot: Robot) -> None:
    reference, q, qd, qdd, model = robot
    rest = np.zeros_like(q)
    sums = torque_terms(reference, q, qd, qdd, model).by("part")
    weight = reference.inverse_dynamics(q, rest, rest, model).tau
    pushed = reference.inverse_dynamics(q, rest, qdd, model).tau - weight
    assert np.abs(sums.get((WEIGHT,), rest) - weight).max() < 1e-12 * max(np.abs(weight).max(), 1.0)
    assert off(sums[ACCELERATION,], pushed) < 1e-12
    assert off(sums[ACCELERATION,], 1.000001 * pushed) > 1e-7
    # rates to both sides: what is even in them, less the weight, is the velocity part
    both = [reference.inverse_dynamics(q, sign * qd, rest, model).tau for sign in (1, -1)]
    assert off(sums[VELOCITY,], (both[0] + both[1]) / 2 - weight) < 1e-10


def test_weight_is_the_slope_of_potential_energy(robot: Robot) -> None:
    reference, q, _, _, model = robot
    found = torque_terms(reference, q, 0 * q, 0 * q, model).total
    slope = np.zeros_like(q)
    h = 1e-5
    for joint in range(q.shape[1]):
        step = np.zeros(q.shape[1])
        step[joint] = h
        high, low = (reference.inverse_dynamics(q + s * step, 0 * q, 0 * q, model).energy[:, 0] for s in (1, -1))
        slope[:, joint] = (high - low) / (2 * h)
    assert np.abs(found - slope).max() < 1e-7 * max(np.abs(slope).max(), 1.0)
    if np.abs(slope).max() > 1e-3:
        assert np.abs(-found - slope).max() > 1e-3


def test_regressor_times_inertial_numbers_is_the_torque(robot: Robot) -> None:
    reference, q, qd, qdd, model = robot
    terms = torque_terms(reference, q, qd, qdd, model)
    bodies = sum(item.tau for item in terms.items if item.body != "joints")
    numbers = inertial_numbers(reference.compiled(model))
    found = inertial_regressor(reference, q, qd, qdd)
    assert off(found.matrix @ numbers.ravel(), bodies) < 1e-12
    for part, columns in ((WEIGHT, found.weight), (ACCELERATION, found.acceleration), (VELOCITY, found.velocity)):
        wanted = sum(item.tau for item in terms.items if item.part == part and item.body != "joints")
        assert np.abs(np.einsum("nabk,bk->na", columns, numbers) - wanted).max() < 1e-12 * np.abs(bodies).max()
    spoiled = numbers * np.linspace(1.0, 1.01, numbers.size).reshape(numbers.shape)
    assert off(found.matrix @ spoiled.ravel(), bodies) > 1e-6


def changed(reference: MujocoReference, body: int, number: int, step: float) -> MujocoReference:
    """The same robot with one of a body's ten numbers moved, by the specification."""
    spec, model = reference.spec(), reference.compiled()
    numbers = inertial_numbers(model)[body - 1]
    numbers[[4, 7, 9]] += 0.1  # a slender rod's inertia leaves no room
    numbers[number] += step
    mass, moment = numbers[0], numbers[1:4]
    centre = moment / mass
    tensor = np.zeros((3, 3))
    for value, (i, j) in zip(numbers[4:], ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)), strict=True):
        tensor[i, j] = tensor[j, i] = value
    tensor -= mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    element = spec.body(model.body(body).name)
    element.explicitinertial = True
    element.mass, element.ipos = mass, centre
    element.iquat, element.inertia = [1, 0, 0, 0], [0, 0, 0]
    element.fullinertia = [tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]]
    return MujocoReference("robot", loaded=LoadedModel("robot", reference.loaded.text, spec.compile()))


def test_regressor_columns_are_differences_of_the_reference(repository: Path) -> None:
    reference = own(repository, "bricard")
    rng = np.random.default_rng(3)
    q = np.array([[0.1], [0.3], [-0.1], [0.2]])
    qd, qdd = 5 * rng.normal(size=q.shape), 40 * rng.normal(size=q.shape)
    columns = inertial_regressor(reference, q, qd, qdd)
    whole = columns.weight + columns.acceleration + columns.velocity
    model = reference.compiled()
    body = model.body("rod3").id
    for number in range(len(NUMBERS)):
        step = 1e-6
        found = [changed(reference, body, number, s * step).inverse_dynamics(q, qd, qdd).tau for s in (1, 0)]
        slope = (found[0] - found[1]) / step
        size = max(np.abs(slope).max(), np.abs(whole[:, :, body - 1]).max() * 1e-6)
        assert np.abs(whole[:, :, body - 1, number] - slope).max() < 1e-4 * size, NUMBERS[number]


def test_more_actuators_than_freedoms_have_no_terms(repository: Path, tmp_path: Path) -> None:
    path = tmp_path / "p.xml"
    path.write_text(PARALLELOGRAM)
    setup = Setup(actuated=("left", "right"), platform_site="coupler", initial=(("left", 0.8), ("right", 0.8)))
    reference = MujocoReference(path, setup=setup)
    with pytest.raises(wb.WorkbenchError, match="more than freedoms"):
        torque_terms(reference, [[0.8, 0.8]], [[0.0, 0.0]], [[0.0, 0.0]])


def places(*words: str) -> dict[str, tuple[Target, ...]]:
    return places_of(parse_place(text, name, "robot.toml") for name, text in (w.split(": ") for w in words))


def test_a_parameter_changes_the_bodies_that_its_places_name(repository: Path) -> None:
    reference = own(repository, "delta")
    model = reference.compiled()
    arms = [model.body(f"arm{limb}").id for limb in (1, 2, 3)]
    before = float(model.body_mass[arms[0]])

    def masses(changes: dict[str, float], *words: str) -> list[float]:
        made = varied_reference(reference, places(*words), {"m": before, "k": before}, changes, "distributed", True)
        return [float(made.compiled().body_mass[arm]) for arm in arms]

    # several places: those and no others, although all arms weigh the same
    assert masses({"m": 0.5}, "m: mass arm1", "m: mass arm2") == [0.5, 0.5, before]
    # one place stands for all that are alike, but for those of other parameters
    assert masses({"m": 0.5}, "m: mass arm1") == [0.5, 0.5, 0.5]
    assert masses({"m": 0.5}, "m: mass arm1", "k: mass arm3") == [0.5, 0.5, before]
    # what stands there is a product, and another parameter of it stays
    assert masses({"m": 0.5}, "m: mass arm1 = 2 * m", "k: mass arm3", "k: mass arm2") == [1.0, before, before]
    assert settable(places("m: mass arm1", "a: offset arm1 x", "m: site foot1 x", "g: gravity z = -g")) == {"g"}
    with pytest.raises(wb.WorkbenchError, match="cannot be set"):
        masses({"a": 0.5}, "a: offset arm1 x")
    field = varied_reference(reference, places("g: gravity z = -g"), {"g": 9.81}, {"g": 4.0}, "distributed", True)
    assert list(field.compiled().opt.gravity) == [0.0, 0.0, -4.0]


def test_two_axes_of_one_inertia_are_moved_once(repository: Path) -> None:
    reference = own(repository, "bricard")
    model = reference.compiled()
    rod = model.body("rod1").id
    value = 1.5 * float(np.sort(model.body_inertia[rod])[1])
    both = places("I: inertia rod1 y", "I: inertia rod1 z", "J: inertia rod1 x")
    for words in (both, places("I: inertia rod1 y", "J: inertia rod1 x")):
        made = varied_reference(reference, words, {"I": 0.0, "J": 0.0}, {"I": value}, "distributed", True)
        assert np.allclose(np.sort(made.compiled().body_inertia[rod])[1:], value, rtol=1e-12)


@pytest.mark.parametrize("name", FEATURES)
def test_every_force_that_the_reference_counts_is_an_item(tmp_path: Path, name: str) -> None:
    path = tmp_path / "fourbar.xml"
    path.write_text(with_feature(name), encoding="utf-8")
    reference = MujocoReference(path, setup=SETUP)
    q, qd, qdd = motion(np.linspace(0.0, 1.0, 11))
    terms = torque_terms(reference, q, qd, qdd)
    assert off(terms.total, terms.tau) < 1e-12
    # the twin: without the force these items are others
    path.write_text(FOURBAR, encoding="utf-8")
    plain = torque_terms(MujocoReference(path, setup=SETUP), q, qd, qdd)
    assert off(plain.total, terms.tau) > 1e-4
    bodies = sum(item.tau for item in terms.items if item.body != "joints")
    numbers = inertial_numbers(reference.compiled())
    assert off(inertial_regressor(reference, q, qd, qdd).matrix @ numbers.ravel(), bodies) < 1e-12


def test_parts_that_leave_something_out_are_refused(repository: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workbench.reference.terms._of_joints", lambda *_: [])
    reference = wb.MujocoReference(repository / "models" / "asym_2rss_ppap.xml", **FRICTION)
    with pytest.raises(wb.WorkbenchError, match="leave out"):
        torque_terms(reference, [[0.02, 0.75, 0.85]], [[1.0, 1.0, 1.0]], [[0.0, 0.0, 0.0]])
