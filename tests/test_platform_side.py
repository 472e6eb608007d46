"""Inverse kinematics from the platform's side: closed forms, round trips and finite differences, branch, refusals."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import scipy.linalg
from scipy.spatial.transform import Rotation

import workbench as wb
from own_mechanisms import FOURBAR
from platform_robots import RRR_HOME, rrr, six_ups, three_rps
from robots import CENTRAL
from workbench.errors import ModelError, MotionError, ParameterError
from workbench.mjcf.setup import Setup

ROOT = Path(__file__).resolve().parents[1]
SAME = 1e-12
PAPERS = {
    "asym_2rss_ppap": ((-0.15, -0.12, 0.2), (0.15, 0.12, 0.42)),
    "planar_4rprp": ((0.12, 0.1, 0.12), (0.48, 0.45, 0.48)),
}
FIVEBAR_HOME = {"q1": 2.1, "elbow1": -1.3, "q2": 1.04, "elbow2": 1.3}


def built(folder: Path, text: str, actuated: str, site: str = "centre", **keys: object) -> wb.MujocoReference:
    path = folder / "robot.xml"
    path.write_text(text)
    return wb.MujocoReference(path, setup=Setup(tuple(actuated.split()), site, **keys))  # type: ignore[arg-type]


def robot(name: str, folder: Path, threads: int = 1) -> tuple[wb.MujocoReference, str, np.ndarray]:
    """A robot, its task coordinates, and how far from home (one number a coordinate) its platform surely gets."""
    if name == "rrr":
        found = built(folder, rrr(), "q1 q2 q3", initial=tuple(RRR_HOME.items()))
        return found, "x z ry", np.array([0.04, 0.04, 0.4])
    if name == "six_ups":
        return (
            built(folder, six_ups(), "q1 q2 q3 q4 q5 q6"),
            "x y z rx ry rz",
            np.array([0.08, 0.08, 0.08, 0.3, 0.3, 0.3]),
        )
    if name == "three_rps":
        return built(folder, three_rps(), "q1 q2 q3"), "z rx ry", np.array([0.1, 0.3, 0.3])
    if name == "delta":
        setup = Setup(("q1", "q2", "q3"), "platform")
        return wb.MujocoReference(ROOT / "examples/delta/delta.xml", setup=setup), "x y z", np.array([0.05, 0.05, 0.05])
    setup = Setup(("q1", "q2"), "end1", initial=tuple(FIVEBAR_HOME.items()))
    return wb.MujocoReference(ROOT / "examples/fivebar/fivebar.xml", setup=setup), "x z", np.array([0.06, 0.05])


GUESS = (("crank", 1.0), ("elbow", -0.5), ("wrist", -1.5))
CRANK = FOURBAR.replace('<body name="coupler"', '<site name="own"/><body name="coupler"')
"""The four-bar with a site on its crank."""

OWN = ["rrr", "six_ups", "three_rps", "delta", "fivebar"]


def home(reference: wb.MujocoReference, names: str) -> np.ndarray:
    """Task coordinates of the home pose."""
    q = reference._closer.home[None, reference.structure.actuated_qpos]
    return reference.platform_motion(q, 0 * q, 0 * q, names.split())[0][0]


def motion(reference: wb.MujocoReference, names: str, reach: np.ndarray, n: int = 60) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(8)
    x = home(reference, names) + reach * rng.uniform(-1, 1, (n, len(reach)))
    return x, *rng.normal(size=(2, n, len(reach)))


# --- the papers' robots: closed forms ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PAPERS)
def test_a_thousand_random_poses_as_the_closed_form_has_them(name: str) -> None:
    path = ROOT / "models" / f"{name}.xml"
    mech, reference = wb.load_mechanism(path), wb.MujocoReference(path)
    rng = np.random.default_rng(11)
    x = rng.uniform(*PAPERS[name], (1200, 3))
    x = x[mech.reach(x).reachable][:1000]
    assert len(x) == 1000
    xd, xdd = rng.normal(size=(2, 1000, 3)) * np.array([[[1.0]], [[20.0]]])
    found, expected = reference.joint_motion(x, xd, xdd), mech.joint_motion(x, xd, xdd)
    for got, want in zip(found, expected, strict=True):
        assert np.all(np.abs(got - want).max(axis=0) <= SAME * np.abs(want).max(axis=0))
    assert np.abs(reference.jacobian(expected[0]) - mech.jacobian(expected[0])).max() < SAME * 10
    # twins: another velocity must show in the accelerations, another robot in the coordinates
    assert np.abs(found[2] - mech.joint_motion(x, 0 * xd, xdd)[2]).max() > 1e-3
    longer = {"asym_2rss_ppap": "a2", "planar_4rprp": "h"}[name]
    other = wb.load_mechanism(path, **{longer: mech.parameters.__dict__.get(longer, 0.3) * 1.001})
    assert np.abs(found[0] - other.inverse_kinematics(x)).max() > 1e-6


# --- robots of one's own: round trips and finite differences ----------------------------------------------------------


@pytest.mark.parametrize("name", OWN)
def test_forward_of_inverse_is_the_motion_itself(name: str, tmp_path: Path) -> None:
    reference, names, reach = robot(name, tmp_path)
    x, xd, xdd = motion(reference, names, reach)
    coordinates = names.split()
    q, qd, qdd = reference.joint_motion(x, xd, xdd, coordinates)
    for got, want in zip(reference.platform_motion(q, qd, qdd, coordinates), (x, xd, xdd), strict=True):
        assert np.abs(got - want).max() < SAME * max(1.0, np.abs(qdd).max())
    assert np.abs(reference.platform_motion(q, qd, 0 * qdd, coordinates)[2] - xdd).max() > 1e-2
    assert np.array_equal(reference.inverse_kinematics(x, coordinates), q)
    jacobian = reference.jacobian(q, coordinates)
    assert np.abs(np.matmul(jacobian, qd[:, :, None])[:, :, 0] - xd).max() < 1e-12
    assert np.abs(np.matmul(jacobian[:, ::-1], qd[:, :, None])[:, :, 0] - xd).max() > 1e-2


@pytest.mark.parametrize("name", OWN)
def test_rates_are_differences_of_positions(name: str, tmp_path: Path) -> None:
    reference, names, reach = robot(name, tmp_path)
    x, xd, xdd = motion(reference, names, reach * 0.8, n=8)
    h, coordinates = 5e-4, names.split()

    def at(t: float) -> tuple[np.ndarray, ...]:
        return reference.joint_motion(x + xd * t + xdd * t * t / 2, xd + xdd * t, xdd, coordinates)

    _, qd, qdd = at(0.0)
    sides = [(w / h, at(i * h), at(-i * h)) for i, w in CENTRAL]
    for order, exact in ((0, qd), (1, qdd)):
        differences = sum(w * (ahead[order] - behind[order]) for w, ahead, behind in sides)
        assert np.abs(differences - exact).max() < 1e-8 * np.abs(exact).max()
        assert np.abs(differences - 1.001 * exact).max() > 1e-5 * np.abs(exact).max()


def test_legs_of_a_six_ups_are_distances(tmp_path: Path) -> None:
    ground = [0.4 * np.array([np.cos(a), np.sin(a), 0.0]) for a in np.radians([-10, 10, 110, 130, 230, 250])]
    feet = [0.2 * np.array([np.cos(a), np.sin(a), 0.0]) for a in np.radians([-50, 50, 70, 170, 190, 290])]
    at_home = [np.linalg.norm(f + np.array([0, 0, 0.5]) - g) for f, g in zip(feet, ground, strict=True)]
    reference, names, _ = robot("six_ups", tmp_path)
    rng = np.random.default_rng(2)
    x = np.array([0, 0, 0.5, 0, 0, 0]) + rng.uniform(-1, 1, (50, 6)) * [0.1, 0.1, 0.1, 0.5, 0.5, 0.5]
    turned = Rotation.from_rotvec(x[:, 3:])
    legs = [np.linalg.norm(x[:, :3] + turned.apply(f) - g, axis=1) for f, g in zip(feet, ground, strict=True)]
    expected = np.column_stack(legs) - at_home
    q = reference.inverse_kinematics(x, names.split())
    assert np.abs(q - expected).max() < SAME
    euler = Rotation.from_euler("xyz", x[:, 3:])  # the convention is not that of angles about x, y, z
    assert np.abs(euler.as_matrix() - turned.as_matrix()).max() > 1e-2


def test_what_is_no_coordinate_turns_as_the_loops_have_it(tmp_path: Path) -> None:
    reference, names, reach = robot("three_rps", tmp_path)
    x, xd, xdd = motion(reference, names, reach)
    q, qd, qdd = reference.joint_motion(x, xd, xdd, names.split())
    every = reference.platform_motion(q, qd, qdd, ["x", "y", "z", "rx", "ry", "rz"])[0]
    assert np.abs(every[:, [2, 3, 4]] - x).max() < SAME
    assert np.abs(every[:, [0, 1]]).max() > 1e-3  # the parasitic shift of a 3-RPS


def test_a_single_rotation_goes_past_a_turn(tmp_path: Path) -> None:
    reference = built(tmp_path, CRANK, "crank", "own", initial=GUESS)
    angle = np.linspace(-8.0, 8.0, 50)[:, None]
    q, qd, _ = reference.joint_motion(-angle, -np.ones_like(angle), 0 * angle, ["ry"])
    assert np.abs(q - angle).max() < SAME  # the crank turns about -y
    assert np.abs(qd - 1).max() < SAME


# --- order, threads, branch -------------------------------------------------------------------------------------------


def test_order_and_threads_do_not_matter(tmp_path: Path) -> None:
    reference, names, reach = robot("rrr", tmp_path)
    steps = np.linspace(0, 6, 1300)
    x = home(reference, names) + reach * np.column_stack([np.sin(steps), np.cos(2 * steps), np.sin(3 * steps)])
    order = np.random.default_rng(1).permutation(len(x))
    along = reference.joint_motion(x, x, x, names.split())
    scattered = reference.joint_motion(x[order], x[order], x[order], names.split())
    for one, other in zip(along, scattered, strict=True):
        assert np.abs(one[order] - other).max() < SAME * np.abs(one).max()
    setup = Setup(("q1", "q2", "q3"), "centre", initial=tuple(RRR_HOME.items()))
    two = wb.MujocoReference(tmp_path / "robot.xml", setup=setup, threads=2)
    for one, other in zip(along, two.joint_motion(x, x, x, names.split()), strict=True):
        assert np.array_equal(one, other)
    grid = home(reference, names) + reach * np.random.default_rng(2).uniform(-4, 4, (1300, 3))
    one, other = reference.reach(grid, names.split()), two.reach(grid, names.split())
    assert np.array_equal(one.reachable, other.reachable)
    assert 0.05 < one.reachable.mean() < 0.95
    assert np.array_equal(one.q, other.q, equal_nan=True)


@pytest.mark.parametrize("name", ["asym_2rss_ppap", "planar_4rprp"])
def test_condition_in_task_coordinates_is_that_of_pivots(name: str) -> None:
    """Of the loops' rows and the platform's, by SciPy's factor of MuJoCo's Jacobians."""
    path = ROOT / "models" / f"{name}.xml"
    mech, reference = wb.load_mechanism(path), wb.MujocoReference(path)
    home = mech.forward_kinematics(np.array(reference.home)[None])[0]
    found = reference.reach(home + np.random.default_rng(0).uniform(-0.03, 0.03, (6, 3)))
    still = np.zeros_like(found.q)
    model, platform = reference.compiled(), np.zeros((3, reference.compiled().nv))
    data = mujoco.MjData(model)
    for k, qpos in enumerate(reference.inverse_dynamics(found.q, still, still).qpos):
        data.qpos = qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacSite(model, data, platform, None, reference._structure.platform_site)
        rows = np.vstack([reference._closer.jacobian(qpos), platform])
        pivots = np.abs(np.diag(scipy.linalg.qr(rows, pivoting=True, mode="r")[0]))
        assert found.condition[k] == pytest.approx(pivots[0] / pivots[model.nv - 1], rel=1e-10)


def test_marked_poses_are_those_of_the_closed_form() -> None:
    path = ROOT / "models" / "asym_2rss_ppap.xml"
    mech, reference = wb.load_mechanism(path), wb.MujocoReference(path)
    # the part of the workspace in which the arms point down and outwards: there "larger x3" is the home branch
    axes = np.linspace(-0.3, 0.3, 9), np.linspace(-0.2, 0.2, 7), np.linspace(0.15, 0.55, 9)
    x = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    found, expected = reference.reach(x), mech.reach(x)
    assert np.array_equal(found.reachable, expected.reachable)
    assert 0.2 < found.reachable.mean() < 0.9
    inside = found.reachable
    assert np.abs(found.q[inside] - expected.q[inside]).max() < 1e-10
    assert np.isnan(found.q[~inside]).all()
    assert np.isnan(found.condition[~inside]).all()
    for name, other in (("direct", "det J_x"), ("inverse", "J_q22")):
        assert np.corrcoef(found.measures[name][inside], np.abs(expected.measures[other][inside]))[0, 1] > 0.3
    near = inside & (np.abs(x - [0.0, 0.0, 0.32]).max(axis=1) < 0.12)
    for name, values in reference.singularity_measures(found.q[near]).items():
        assert np.abs(values - found.measures[name][near]).max() < 1e-9


@pytest.mark.parametrize("name", ["asym_2rss_ppap", "planar_4rprp"])
def test_a_refused_pose_names_the_last_in_reach_on_the_way_to_it(name: str) -> None:
    """It can be reached, all before it on the straight way too, and what comes next cannot."""
    robot = wb.load_robot(name)
    start, generator = robot.forward_kinematics(robot.home), np.random.default_rng(8)
    refused = 0
    for _ in range(20):
        far = start + generator.uniform(-0.8, 0.8, 3)
        try:  # inverse kinematics alone do not tell the other assembly branch, which `reach` leaves out
            robot.inverse_kinematics(far)
        except MotionError as error:
            told, nearest = str(error), np.array(error.facts["nearest"])
        else:
            continue
        refused += 1
        assert "the straight way from the home pose ends at x = " in told
        robot.inverse_kinematics(nearest)
        beyond = nearest + 1e-6 * (far - start)
        assert not robot.reach(beyond[None, :]).reachable[0]
        assert np.linalg.norm(np.cross(nearest - start, far - start)) < 1e-12
        assert (robot.reach(start + np.linspace(0, 1, 50)[:, None] * (nearest - start)).reachable).all()
    assert refused > 5


def test_closeness_vanishes_in_singular_poses(tmp_path: Path) -> None:
    reference, _, _ = robot("fivebar", tmp_path)
    # symmetric: cranks 0.2 at (-+0.1, 0), bars 0.3; stretched arms reach (0, z) with z^2 + 0.1^2 = 0.5^2
    end = np.sqrt(0.5**2 - 0.1**2)
    z = end - np.array([1e-1, 1e-3, 1e-5])
    q = reference.inverse_kinematics(np.column_stack([0 * z, z]), ["x", "z"])
    inverse = reference.singularity_measures(q, ["x", "z"])["inverse"]
    assert np.all(np.diff(inverse) < 0)
    # the arm's velocity over the platform's grows as the root of the way that is left
    assert 5 < inverse[1] / inverse[2] < 15
    with pytest.raises(MotionError, match=r"the way from the home pose ends at x = .*, z = 0\.4898") as refusal:
        reference.inverse_kinematics([[0.0, 0.3], [0.0, 0.6]], ["x", "z"])
    assert refusal.value.facts["sample"] == 1
    assert refusal.value.facts["value"] == [0.0, 0.6]
    assert abs(refusal.value.facts["reached"][1] - end) < 1e-5


def test_a_way_through_a_pose_in_which_the_actuators_lose_hold_is_refused(tmp_path: Path) -> None:
    # driven at the wrist, the crank cannot be led over the pose in which crank and ground are in line
    reference = built(tmp_path, CRANK, "wrist", "own", initial=GUESS)
    start = home(reference, "ry")[0]
    assert reference.inverse_kinematics([[0.9 * start]], ["ry"]).shape == (1, 1)
    with pytest.raises(MotionError, match=r"the way from the home pose ends at ry = .*lose hold") as refusal:
        reference.inverse_kinematics([[-start]], ["ry"])
    assert abs(refusal.value.facts["reached"][0]) < 1e-5
    assert reference.reach([[0.9 * start], [-start]], ["ry"]).reachable.tolist() == [True, False]


def test_coordinates_that_do_not_lead_back_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reference, names, reach = robot("rrr", tmp_path)
    x = motion(reference, names, reach, n=5)[0]
    closer = reference._platform_closer(names.split())
    elsewhere = x.copy()
    elsewhere[3, 0] += 1e-6
    monkeypatch.setattr(reference, "_assemble", lambda q: closer.follow(elsewhere))
    with pytest.raises(MotionError, match=r"sample 3: .* is on another assembly branch") as refusal:
        reference.inverse_kinematics(x, names.split())
    assert refusal.value.facts["sample"] == 3

    def blocked(q: np.ndarray) -> None:
        raise MotionError("sample 2, joint q1: blocked", sample=2, joint="q1")

    monkeypatch.setattr(reference, "_assemble", blocked)
    with pytest.raises(
        MotionError, match=r"sample 2: the platform can be at x = .*straight from the home pose"
    ) as refusal:
        reference.inverse_kinematics(x, names.split())
    assert refusal.value.facts["value"] == x[2].tolist()


# --- redundant actuation ----------------------------------------------------------------------------------------------


def test_excess_actuators_follow_the_platform(tmp_path: Path) -> None:
    single = built(tmp_path, FOURBAR, "crank", "coupler", initial=GUESS)
    double = built(tmp_path, FOURBAR, "crank wrist", "coupler", initial=GUESS)
    start = home(single, "x")
    x = start + np.linspace(-0.025, 0.025, 20)[:, None]
    one, two = (robot.joint_motion(x, 0 * x + 1, 0 * x + 2, ["x"]) for robot in (single, double))
    for lead, both in zip(one, two, strict=True):
        assert np.abs(lead[:, 0] - both[:, 0]).max() < SAME * np.abs(lead).max()
    found = double.inverse_dynamics(*two)
    assert np.abs(found.x[:, :1] - x).max() < SAME
    jacobian = double.jacobian(two[0], ["x"])
    assert jacobian.shape == (20, 1, 2)
    assert np.abs((jacobian[:, 0] * two[1]).sum(axis=1) - 1).max() < 1e-11
    with pytest.raises(MotionError, match="more actuators than freedoms"):
        double.jacobian(two[0] + [0.0, 0.1], ["x"])


# --- refusals ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("coordinates", "message"),
    [
        ("x y z", r"task coordinate y does not change when the robot moves; give 3 of those it has: x z ry"),
        ("x z", r"2 task coordinate\(s\) \(x z\), but the robot has 3 freedom\(s\); give 3 of x z ry"),
        ("x z ry rx", r"4 task coordinate\(s\)"),
    ],
)
def test_coordinates_that_the_robot_does_not_have(coordinates: str, message: str, tmp_path: Path) -> None:
    reference, _, _ = robot("rrr", tmp_path)
    with pytest.raises(ParameterError, match=message):
        reference.inverse_kinematics(np.zeros((1, len(coordinates.split()))), coordinates.split())


def test_coordinates_that_follow_from_one_another(tmp_path: Path) -> None:
    ends = '<body name="one"><joint name="a" type="slide" axis="1 0 1"/><geom size="0.1" mass="1"/>'
    inner = '<body name="two"><joint name="b" axis="0 1 0"/><geom size="0.1" mass="1"/><site name="P"/></body></body>'
    head = '<mujoco><compiler angle="radian"/><option><flag contact="disable"/></option><worldbody>'
    reference = built(tmp_path, f"{head}{ends}{inner}</worldbody></mujoco>", "a b", "P")
    with pytest.raises(ParameterError, match=r"of task coordinates x z only 1 can be chosen; .* x z ry"):
        reference.inverse_kinematics([[0.0, 0.0]], ["x", "z"])
    assert np.allclose(reference.inverse_kinematics([[0.3, 0.4]], ["x", "ry"]), [[0.3 * np.sqrt(2), 0.4]])


def test_a_site_that_is_turned_over_and_a_singular_home(tmp_path: Path) -> None:
    reference = built(tmp_path, rrr(), "q1 q2 q3", "tipped", initial=tuple(RRR_HOME.items()))
    with pytest.raises(ModelError, match=r"turned over .* an axis across ry"):
        reference.inverse_kinematics([[0.0, 0.0, 0.0]], ["x", "z", "ry"])
    text = (ROOT / "examples/fivebar/fivebar.xml").read_text()
    stretch = np.arctan2(np.sqrt(0.24), 0.1)
    stretched = (("q1", stretch), ("elbow1", 0.0), ("q2", np.pi - stretch), ("elbow2", 0.0))
    reference = built(tmp_path, text, "q1 q2", "end1", initial=stretched)
    with pytest.raises(ModelError, match="the home pose is a singular one"):
        reference.inverse_kinematics([[0.0, 0.3]], ["x", "z"])


def test_no_samples_and_the_platforms_turning(tmp_path: Path) -> None:
    reference, names, reach = robot("rrr", tmp_path)
    nothing = np.zeros((0, 3))
    for array in reference.joint_motion(nothing, nothing, nothing, names.split()):
        assert array.shape == (0, 3)
    assert reference.reach(nothing, names.split()).reachable.shape == (0,)
    x, xd, xdd = motion(reference, names, reach)
    found = reference.inverse_dynamics(*reference.joint_motion(x, xd, xdd, names.split()))
    turned = Rotation.from_rotvec(x[:, 2:] * [[0.0, 1.0, 0.0]])
    assert np.abs(found.rotation - turned.as_matrix()).max() < SAME
    assert np.abs(found.omega - xd[:, 2:] * [[0.0, 1.0, 0.0]]).max() < SAME
    assert np.abs(found.alpha - xdd[:, 2:] * [[0.0, 1.0, 0.0]]).max() < SAME * 10


def test_a_box_leaves_out_probes_that_cannot_be_followed(repository: Path) -> None:
    """With shorter cranks some poses can be assembled, but the way there from home passes a singular pose."""
    robot = wb.load_robot(repository / "examples" / "fivebar").with_parameters(a=0.21)
    low, high = robot.reach_box()
    assert (high > low).all()
    assert np.isfinite([low, high]).all()
