"""The second engine against MuJoCo and the closed forms, and every way in which its reader misunderstands an MJCF."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import mujoco
import numpy as np
import pytest

import workbench as wb
from robots import MODEL, FourBar, motion_inside, peak_error, random_changes, write_model
from workbench.errors import ArrayError, MissingExtraError, ModelError, MotionError, ParameterError
from workbench.reference import pinocchio_loops, pinocchio_reader
from workbench.reference.pinocchio_reference import PinocchioReference

needs_pinocchio = pytest.mark.skipif(find_spec("pinocchio") is None, reason="the extra pinocchio is not installed")

BOUND = 1e-10  # peak-normalised, per joint: rounding leaves 1e-13
PLANAR = MODEL.with_name("planar_4rprp.xml")
PLANAR_HOME = np.array([0.3893182978, 0.3768866111, 0.3893182978])
MASS_MODELS = ("distributed", "lumped")
FORCE = np.array([3.0, -7.0, 11.0])


def simulation(number: int, samples: int = 120) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The two motions of [Almeida2010], section 4."""
    rate = np.array([[2.0, 5.0, 5.0], [10.0, 25.0, 35.0]][number - 1])
    size, offset = np.array([0.1, np.pi / 12, np.pi / 12]), np.array([0.0, np.pi / 4, np.pi / 4])
    t = np.linspace(0.0, np.pi, samples)[:, None]
    return offset + size * np.sin(rate * t), size * rate * np.cos(rate * t), -size * rate**2 * np.sin(rate * t)


def near(centre: np.ndarray, width: float, samples: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Scattered samples, no trajectory."""
    rng = np.random.default_rng(seed)
    shape = (samples, len(centre))
    return centre + rng.uniform(-width, width, shape), rng.normal(size=shape), 5.0 * rng.normal(size=shape)


@needs_pinocchio
@pytest.mark.parametrize("mass_model", MASS_MODELS)
@pytest.mark.parametrize("number", [1, 2])
def test_equals_mujoco_and_the_closed_form_on_both_simulations(number: int, mass_model: str) -> None:
    motion = simulation(number)
    second = PinocchioReference(MODEL)
    result = second.inverse_dynamics(*motion, mass_model, FORCE)
    first = wb.MujocoReference(MODEL).inverse_dynamics(*motion, mass_model, FORCE)
    assert second.reader_difference == ""
    assert peak_error(result.tau, first.tau) <= BOUND
    assert peak_error(result.tau, wb.load_mechanism(MODEL).inverse_dynamics(*motion, mass_model, FORCE)) <= BOUND
    for name in ("x", "xd", "xdd"):
        np.testing.assert_allclose(getattr(result, name), getattr(first, name), rtol=0, atol=1e-10)
    assert result.closure_residual.max() <= 1e-13
    assert result.velocity_residual.max() <= 1e-12
    assert result.acceleration_residual.max() <= 1e-10
    assert set(result.rank) == set(first.rank)


@needs_pinocchio
@pytest.mark.parametrize("seed", range(100, 108))
def test_equals_mujoco_and_the_closed_form_on_random_robots(seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion = None
    while motion is None:
        changes = random_changes(rng)
        mech = wb.load_mechanism(MODEL, **changes)
        motion, _ = motion_inside(mech, rng, np.linspace(0.0, 1.0, 40))
    force = rng.uniform(-20.0, 20.0, (40, 3))
    second, first = PinocchioReference(MODEL, **changes), wb.MujocoReference(MODEL, **changes)
    for mass_model in MASS_MODELS:
        tau = second.inverse_dynamics(*motion, mass_model, force).tau
        assert peak_error(tau, first.inverse_dynamics(*motion, mass_model, force).tau) <= BOUND
        assert peak_error(tau, mech.inverse_dynamics(*motion, mass_model, force)) <= BOUND


@needs_pinocchio
@pytest.mark.parametrize("mass_model", MASS_MODELS)
def test_equals_mujoco_and_the_closed_form_on_the_planar_robot(mass_model: str) -> None:
    motion = near(PLANAR_HOME, 0.03, 60)
    result = PinocchioReference(PLANAR).inverse_dynamics(*motion, mass_model, FORCE)
    first = wb.MujocoReference(PLANAR).inverse_dynamics(*motion, mass_model, FORCE)
    assert peak_error(result.tau, first.tau) <= BOUND
    assert peak_error(result.tau, wb.load_mechanism(PLANAR).inverse_dynamics(*motion, mass_model, FORCE)) <= BOUND
    for name in ("x", "xd", "xdd"):
        np.testing.assert_allclose(getattr(result, name), getattr(first, name), rtol=0, atol=1e-10)
    assert result.closure_residual.max() <= 1e-13
    assert set(result.rank) == {11}


@needs_pinocchio
@pytest.mark.parametrize("name", ["a2_left", "m1_right", "m3", "payload", "I2_right", "k5", "g"])
def test_a_spoiled_parameter_is_noticed(name: str) -> None:
    motion = simulation(2, 20)
    mech = wb.load_mechanism(MODEL, payload=1.0)
    value = getattr(mech.parameters, name)
    spoiled = PinocchioReference(MODEL, **{"payload": 1.0, name: value * 1.001}).inverse_dynamics(*motion).tau
    assert peak_error(spoiled, mech.inverse_dynamics(*motion, "distributed")) > 1e3 * BOUND


@needs_pinocchio
def test_a_spoiled_force_mass_model_and_frame_are_noticed() -> None:
    motion = simulation(2, 20)
    second = PinocchioReference(MODEL)
    expected = wb.MujocoReference(MODEL).inverse_dynamics(*motion, "distributed", FORCE)
    world_axes = FORCE * [1.0, -1.0, -1.0]  # the base is turned by half a turn about x
    assert peak_error(second.inverse_dynamics(*motion, "distributed", world_axes).tau, expected.tau) > 1e-2
    assert peak_error(second.inverse_dynamics(*motion, "lumped", FORCE).tau, expected.tau) > 1e-4
    assert np.abs(second.inverse_dynamics(*motion).xdd * [1.0, -1.0, -1.0] - expected.xdd).max() > 1.0


@needs_pinocchio
def test_the_order_of_samples_does_not_matter() -> None:
    motion = simulation(2, 150)
    second = PinocchioReference(MODEL)
    order = np.random.default_rng(3).permutation(150)
    straight, mixed = second.inverse_dynamics(*motion).tau, second.inverse_dynamics(*(m[order] for m in motion)).tau
    assert peak_error(mixed, straight[order]) <= 1e-12
    assert peak_error(mixed, straight) > 0.1


@needs_pinocchio
def test_nothing_is_computed_by_mujoco(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = simulation(1, 5)
    expected = wb.MujocoReference(MODEL).inverse_dynamics(*motion).tau

    def refuse(*_: object) -> None:
        raise AssertionError("MuJoCo was asked to compute")

    monkeypatch.setattr(mujoco, "MjData", refuse)
    monkeypatch.setattr("workbench.reference.engine.Batch", refuse)
    assert peak_error(PinocchioReference(MODEL).inverse_dynamics(*motion).tau, expected) <= BOUND
    with pytest.raises(AssertionError, match="asked to compute"):
        wb.MujocoReference(MODEL)


INERTIAL = '<inertial pos="0.02 0.01 0.1" mass="1" diaginertia="0.02 0.03 0.04"/>'
HINGE = '<joint name="q" axis="1 0.2 0" pos="0 0.1 0"/>'


def write(folder: Path, world: str, equality: str = "", motors: tuple[str, ...] = ("q",), head: str = "") -> Path:
    """A tiny model whose gravity is along no axis."""
    path = folder / "tiny.xml"
    path.write_text(
        f"""<mujoco model="tiny"><compiler angle="radian"/>
        <option gravity="1 2 -5"><flag contact="disable"/></option>{head}
        <custom><text name="base_body" data="base"/><text name="platform_site" data="P"/>
        <text name="lumped_bodies" data="arm"/></custom>
        <worldbody>{world}</worldbody><equality>{equality}</equality>
        <actuator>{"".join(f'<motor joint="{motor}"/>' for motor in motors)}</actuator></mujoco>""",
        encoding="utf-8",
    )
    return path


TILT = 'axisangle="1 0 0 0.3"'
SITE = '<site name="P" pos="0 0.3 0.1"/>'


def arm(joint: str = HINGE, pose: str = TILT, inside: str = SITE) -> str:
    return f'<body name="arm" pos="0.1 0.2 0.3" {pose}>{joint}{INERTIAL}{inside}</body>'


def based(inside: str) -> str:
    return f'<body name="base" pos="1 2 3" euler="0.3 0.2 0.1">{inside}</body>'


TWO_JOINTS = """<joint name="q" axis="0 1 0" pos="0 0 .1" ref="0.2"/>
    <joint name="r" type="slide" axis="1 1 0" ref="0.1" armature=".2" damping="0.2"/>"""
WELDED = f'<body name="hand" pos="0 0 0.2" euler="1 2 3">{INERTIAL}<site name="P" pos="0.1 0 0"/></body>'
GEOM = '<geom type="capsule" fromto="0 0 0 .3 .1 0" size="0.02" contype="0" conaffinity="0"/>'
FOUR_BAR = f"""<site name="ground" pos="0 1 0"/><body name="arm"><joint name="q" axis="1 0 0"/>{INERTIAL}
    <site name="P" pos="0 0 .5"/><body pos="0 0 .5"><joint axis="1 0 0"/>{INERTIAL}
    <body pos="0 1 0"><joint axis="1 0 0"/>{INERTIAL}<site name="foot" pos="0 0 -.5"/></body></body></body>"""
CRANK_SLIDER = f"""<body name="arm"><joint name="q" axis="1 0 0" damping="0.3"/>{INERTIAL}<site name="P" pos="0 0 .2"/>
    <body name="rod" pos="0 0 0.2"><joint name="ball" type="ball" damping="0.2" armature="0.01"/>
    <inertial pos="0 0.2 0" mass="1" diaginertia="0.02 0.001 0.02"/><site name="end" pos="0 0.5 0"/></body></body>
    <body name="slider" pos="0 0.5 0.2"><joint name="s" type="slide" axis="0 1 0"/>{INERTIAL}
    <site name="pin"/></body>"""
COUPLED = f"""<body name="arm"><joint name="q" axis="0 1 0"/>{INERTIAL}<body name="outer" pos="1 0 0">
    <joint name="r" axis="1 0 0"/>{INERTIAL}<site name="P" pos="0 1 0"/></body></body>"""
DEFAULT = """<default><joint axis="1 1 0"/>
    <default class="c"><joint damping="0.3"/><site pos="1 2 3"/></default></default>"""

AS_WRITTEN = {
    "a turned base and odd gravity": {"world": based(arm())},
    "a hinge with a reference": {"world": based(arm('<joint name="q" axis="1 2 3" ref="0.4" pos="0 .1 0"/>'))},
    "a slide with a reference": {"world": based(arm('<joint name="q" type="slide" axis="1 2 3" ref="0.4"/>'))},
    "two top-level bodies": {"world": f'<body name="base" pos="1 2 3"/>{arm()}'},
    "damping and armature": {"world": based(arm('<joint name="q" axis="0 1 0" damping="0.7" armature="0.3"/>'))},
    "a damped ball joint": {"world": based(CRANK_SLIDER), "equality": '<connect site1="end" site2="pin"/>'},
    "coupled joints": {"world": based(COUPLED), "equality": '<joint joint1="r" joint2="q" polycoef=".1 .5 .3 .2 .1"/>'},
}
"""What Pinocchio's reader understands, once it is wrapped in one body and gravity and damping are set."""

NORMALISED = {
    "a frame element": {"world": based(f'<frame pos="1 0 0" euler="1 0 0">{arm()}</frame>')},
    "an axis that is no unit vector": {"world": based(arm(pose='axisangle="2 0 0 0.3"'))},
    "a site of a welded body": {"world": based(arm(inside=WELDED))},
    "mass from a visual geom": {"world": based(arm().replace(INERTIAL, GEOM))},
    "two joints of one body": {"world": based(arm(TWO_JOINTS)), "motors": ("q", "r")},
    "a default of sites": {
        "world": based(arm('<joint name="q" class="c"/>', inside='<site name="P" class="c"/>')),
        "head": DEFAULT,
    },
    "no names, and a site of the base": {
        "world": based(FOUR_BAR),
        "equality": '<connect site1="foot" site2="ground"/>',
    },
}
"""What it misreads without a word."""


def spread(path: Path) -> float:
    """Largest difference between the engines on scattered samples about the home pose."""
    second, first = PinocchioReference(path), wb.MujocoReference(path)
    centre = np.zeros(len(first.joint_names))
    motion = near(centre, 0.2, 12)
    one, two = (engine.inverse_dynamics(*motion, "distributed", FORCE) for engine in (second, first))
    return max(float(np.abs(getattr(one, name) - getattr(two, name)).max()) for name in ("tau", "x", "xd", "xdd"))


@needs_pinocchio
@pytest.mark.parametrize("parts", AS_WRITTEN.values(), ids=AS_WRITTEN)
def test_reads_the_file_as_written(tmp_path: Path, parts: dict[str, str]) -> None:
    path = write(tmp_path, **parts)
    assert PinocchioReference(path).reader_difference == ""
    assert spread(path) <= 1e-11


@needs_pinocchio
@pytest.mark.parametrize("parts", NORMALISED.values(), ids=NORMALISED)
def test_reads_the_normal_form_of_what_it_would_misread(tmp_path: Path, parts: dict[str, str]) -> None:
    path = write(tmp_path, **parts)
    assert PinocchioReference(path).reader_difference != ""
    assert spread(path) <= 1e-11


@needs_pinocchio
@pytest.mark.parametrize(
    "case",
    ["an axis that is no unit vector", "a site of a welded body", "mass from a visual geom", "a default of sites"],
)
def test_without_the_comparison_of_readings_it_is_misread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str
) -> None:
    monkeypatch.setattr(pinocchio_reader, "_difference", lambda *_: "")
    assert spread(write(tmp_path, **NORMALISED[case])) > 1e-3


@needs_pinocchio
def test_without_the_wrapping_body_the_base_loses_its_pose(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path, **AS_WRITTEN["a turned base and odd gravity"])
    monkeypatch.setattr(pinocchio_reader, "_under_one_body", lambda text, _: text)
    assert "pose differs" in PinocchioReference(path).reader_difference
    monkeypatch.setattr(pinocchio_reader, "_difference", lambda *_: "")
    assert spread(path) > 1e-3


@needs_pinocchio
def test_lumped_bars_lose_all_their_rotational_inertia(tmp_path: Path) -> None:
    """Twice the kinetic energy of a bar about its mass centre, by hand; the bar of a welded pair keeps the other's."""
    hand = '<body name="hand" pos="0 0 0.2"><inertial pos="0 0 0" mass="2" diaginertia="0.5 0.6 0.7"/></body>'
    inside = f'<site name="P"/>{hand}'
    joint = '<joint name="q" axis="0 0 1"/>'
    second = PinocchioReference(write(tmp_path, based(arm(joint, inside=inside))))
    still, qdd = np.zeros((2, 1)), np.array([[0.0], [1.0]])
    distributed, lumped = (np.diff(second.inverse_dynamics(still, still, qdd, m).tau, axis=0) for m in MASS_MODELS)
    centre = 1.0 * (0.02**2 + 0.01**2)  # mass times the mass centre's distance from the axis, squared
    assert lumped[0, 0] == pytest.approx(centre + 0.7, abs=1e-13)
    assert distributed[0, 0] == pytest.approx(centre + 0.7 + 0.04, abs=1e-13)


@needs_pinocchio
def test_coupled_joints_count_from_their_references(tmp_path: Path) -> None:
    """MuJoCo's rule, here by hand: r - 0.2 = 0.1 + 0.5 (q - 0.3) + ..."""
    world = COUPLED.replace('axis="0 1 0"', 'axis="0 1 0" ref="0.3"').replace('axis="1 0 0"', 'axis="1 0 0" ref="0.2"')
    equality = '<joint joint1="r" joint2="q" polycoef=".1 .5 .3 .2 .1"/>'
    second = PinocchioReference(write(tmp_path, based(world), equality))
    q = np.array([0.1, 0.4, 0.9])
    result = second.inverse_dynamics(q[:, None], np.ones((3, 1)), np.zeros((3, 1)))

    def platform(q: np.ndarray, reference: float = 0.3) -> np.ndarray:
        turn = q - reference
        outer = np.polynomial.polynomial.polyval(turn, [0.1, 0.5, 0.3, 0.2, 0.1])
        x, y, z = np.ones_like(q), np.cos(outer), np.sin(outer)  # seen from the inner body
        return np.stack([np.cos(turn) * x + np.sin(turn) * z, y, np.cos(turn) * z - np.sin(turn) * x], axis=1)

    h = 1e-4
    np.testing.assert_allclose(result.x, platform(q), atol=1e-13)
    np.testing.assert_allclose(result.xd, (platform(q + h) - platform(q - h)) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(result.xdd, (platform(q + h) - 2 * platform(q) + platform(q - h)) / h**2, atol=1e-5)
    assert np.abs(result.x - platform(q, reference=0.0)).max() > 1e-2


@needs_pinocchio
def test_dry_friction_acts_against_the_motion(tmp_path: Path) -> None:
    path = write(tmp_path, based(arm('<joint name="q" axis="0 1 0" frictionloss="0.7"/>')))
    rough = PinocchioReference(path)
    smooth = PinocchioReference(write(tmp_path, based(arm('<joint name="q" axis="0 1 0"/>'))))
    qd = np.array([[-2.0], [0.0], [3.0]])
    more = (engine.inverse_dynamics(0 * qd, qd, 0 * qd).tau for engine in (rough, smooth))
    np.testing.assert_allclose(np.subtract(*more), 0.7 * np.sign(qd), atol=1e-13)


@needs_pinocchio
def test_a_sample_out_of_reach_is_named(tmp_path: Path) -> None:
    """A rod of 0.3 m ends on a line that its crank of 0.2 m leaves by more than that beyond two thirds of pi."""
    world = CRANK_SLIDER.replace('"0 0.5', '"0 0.3')
    second = PinocchioReference(write(tmp_path, based(world), '<connect site1="end" site2="pin"/>'))
    q = np.array([[0.1], [2.05], [2.15], [0.3]])
    assert second.inverse_dynamics(q[:2], 0 * q[:2], 0 * q[:2]).closure_residual.max() <= 1e-13
    with pytest.raises(MotionError, match=r"sample 2, joint q: .* q = 2\.15") as caught:
        second.inverse_dynamics(q, 0 * q, 0 * q)
    assert caught.value.facts["sample"] == 2


@needs_pinocchio
def test_a_singular_pose_is_named(tmp_path: Path) -> None:
    """A parallelogram laid flat may go on as an antiparallelogram."""
    second = PinocchioReference(write(tmp_path, based(FOUR_BAR), '<connect site1="foot" site2="ground"/>'))
    q = np.array([[0.0], [np.pi / 2]])
    assert second.inverse_dynamics(q[:1], 0 * q[:1], 0 * q[:1]).rank == [2]
    with pytest.raises(MotionError, match=r"sample 1"):
        second.inverse_dynamics(q, 0 * q, 0 * q)


@needs_pinocchio
def test_a_freedom_that_nothing_holds_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"1 freedom\(s\) that no actuator holds"):
        PinocchioReference(write(tmp_path, based(COUPLED)))


@needs_pinocchio
@pytest.mark.parametrize("q", [(0.094, -0.666, -2.189), (0.113, -2.473, -0.629), (0.124, -2.48, -0.445)])
def test_a_far_sample_stays_on_the_branch_of_the_home_pose(
    monkeypatch: pytest.MonkeyPatch, q: tuple[float, ...]
) -> None:
    sample, still = np.array([q]), np.zeros((1, 3))
    expected = wb.load_mechanism(MODEL).inverse_dynamics(sample, still, still, "distributed")
    assert peak_error(PinocchioReference(MODEL).inverse_dynamics(sample, still, still).tau, expected) <= BOUND
    # with Newton in one long step it ends in another assembly
    monkeypatch.setattr(pinocchio_loops, "LONGEST_STEP", np.inf)
    monkeypatch.setattr(pinocchio_loops, "CORRECTION", np.inf)
    monkeypatch.setattr(pinocchio_loops.PinocchioLoops, "_same_side", lambda *_: True)
    assert peak_error(PinocchioReference(MODEL).inverse_dynamics(sample, still, still).tau, expected) > 0.1


@needs_pinocchio
@pytest.mark.parametrize("guard", ["", "CORRECTION", "LONGEST_STEP"])
def test_branches_that_nearly_meet_are_told_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, guard: str) -> None:
    """As in test_reference_closure.py: either guard alone is not enough."""
    monkeypatch.setattr(pinocchio_loops.PinocchioLoops, "_same_side", lambda *_: True)
    if guard:
        monkeypatch.setattr(pinocchio_loops, guard, np.inf)
    wrong = 0
    q = np.random.default_rng(1).uniform(-6.0, 6.0, 25)
    for branch in (1, -1):
        model = FourBar(branch)
        model.coupler, model.rocker = 0.20007, 0.2
        loop = '<connect name="loop" site1="coupler_tip" site2="rocker_tip"/>'
        second = PinocchioReference(write_model(tmp_path, model.bodies(), loop, home=model.home()))
        expected = model.poses(q)[:, 3, :2]
        for i in range(len(q)):
            x = second.inverse_dynamics(q[i : i + 1, None], np.zeros((1, 1)), np.zeros((1, 1))).x[0, [0, 2]]
            wrong += bool(np.linalg.norm(x - expected[i]) > 1e-9)
    assert wrong > 3 if guard else wrong == 0


@needs_pinocchio
def test_bad_arguments_are_refused_in_one_line(tmp_path: Path) -> None:
    second = PinocchioReference(MODEL)
    motion = simulation(1, 3)
    with pytest.raises(ParameterError, match='unknown mass model "lumpy"; did you mean "lumped"'):
        second.inverse_dynamics(*motion, "lumpy")
    with pytest.raises(ArrayError, match="qd: expected shape"):
        second.inverse_dynamics(motion[0], motion[1][:, :2], motion[2])
    with pytest.raises(ParameterError, match="payloat"):
        PinocchioReference(MODEL, payloat=1.0)
    path = write(tmp_path, based(arm()).replace('"arm"', '"forearm"'))
    with pytest.raises(ModelError, match='names body "arm"; did you mean "forearm"'):
        PinocchioReference(path).inverse_dynamics(*np.zeros((3, 1, 1)), "lumped")
    path.write_text(path.read_text(encoding="utf-8").replace("lumped_bodies", "other"), encoding="utf-8")
    with pytest.raises(ModelError, match="lumped_bodies"):
        PinocchioReference(path).inverse_dynamics(*np.zeros((3, 1, 1)), "lumped")


@needs_pinocchio
def test_no_samples_give_no_torques() -> None:
    result = PinocchioReference(MODEL).inverse_dynamics(*np.zeros((3, 0, 3)))
    assert result.tau.shape == result.x.shape == (0, 3)


def test_the_missing_extra_is_one_line_with_the_install_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    with pytest.raises(MissingExtraError) as caught:
        PinocchioReference(MODEL)
    assert 'pip install "parallel-robot-workbench[pinocchio]"' in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("version", [None, "3.7.0"])
def test_another_package_or_an_old_release_counts_as_missing(
    monkeypatch: pytest.MonkeyPatch, version: str | None
) -> None:
    impostor = ModuleType("pinocchio")
    if version:
        vars(impostor).update(__version__=version, buildModelFromMJCF=print)
    monkeypatch.setitem(sys.modules, "pinocchio", impostor)
    with pytest.raises(MissingExtraError, match=r"pin >= 4\.1 is needed; pip install"):
        pinocchio_reader.import_pinocchio()
