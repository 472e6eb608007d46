"""Branches that all but meet are told apart, each sample alone, by the side of the singular poses between them."""

from __future__ import annotations

import importlib.util
import itertools
from pathlib import Path

import numpy as np
import pytest

import workbench as wb
from robots import FourBar, write_model
from workbench.errors import MotionError
from workbench.mjcf.setup import Setup
from workbench.reference import along, closure, continuation, pinocchio_loops, sides
from workbench.reference.linear import room_to_eliminate
from workbench.reference.pinocchio_reference import PinocchioReference

ENGINES = [
    "mujoco",
    pytest.param(
        "pinocchio",
        marks=pytest.mark.skipif(importlib.util.find_spec("pinocchio") is None, reason="needs the extra pinocchio"),
    ),
]
LOOP = '<connect name="loop" site1="coupler_tip" site2="rocker_tip"/>'
CLOSE = 1e-9


def reference(engine: str, path: Path) -> wb.MujocoReference | PinocchioReference:
    return wb.MujocoReference(path) if engine == "mujoco" else PinocchioReference(path)


def alone(found: wb.MujocoReference | PinocchioReference, q: np.ndarray) -> np.ndarray:
    """The platform ``(n, 3)``, every sample asked for by itself; NaN where it is refused."""
    x = np.full((len(q), 3), np.nan)
    for i in range(len(q)):
        still = np.zeros((1, q.shape[1]))
        try:
            x[i] = found.inverse_dynamics(q[i : i + 1], still, still).x[0]
        except MotionError:
            continue
    return x


def near_meeting(rng: np.random.Generator, branch: int) -> FourBar:
    """A crank-rocker whose bars all but fall in line, to a share of its lengths between 1e-3 and 1e-8."""
    model = FourBar(branch)
    model.crank, model.ground = rng.uniform(0.05, 0.12), rng.uniform(0.25, 0.35)
    whole = model.ground + model.crank
    model.rocker = whole * rng.uniform(0.4, 0.6)
    model.coupler = (whole - model.rocker) * (1.0 + 10.0 ** rng.uniform(-8.0, -3.0))
    return model


def blind(monkeypatch: pytest.MonkeyPatch) -> None:
    """The twin: nobody looks at sides."""
    monkeypatch.setattr(continuation, "side_table", lambda *_: sides.NO_SIDES)
    monkeypatch.setattr(pinocchio_loops.PinocchioLoops, "_same_side", lambda *_: True)


@pytest.mark.parametrize("sizes", [(1,), (2,), (5,), (1, 1), (3, 2), (2, 1, 3)])
def test_a_side_is_the_signs_of_the_determinants_of_blocks(sizes: tuple[int, ...]) -> None:
    """Against NumPy, block by block: every sign of a pivot and every exchange of rows counts."""
    random = np.random.default_rng(sum(sizes) + len(sizes))
    whole = sum(sizes)
    ends = np.cumsum((0, *sizes))
    pattern = np.zeros((whole, whole), dtype=np.bool_)
    for first, end in itertools.pairwise(ends):
        pattern[first:end, :end] = True  # a block sees those before it, as loops on one crank do
    own = np.repeat(np.arange(len(sizes)), sizes)
    columns = np.arange(whole)
    table = sides.side_table(np.where(pattern, random.normal(size=pattern.shape), 0.0), pattern, own, columns)
    assert sorted(np.diff(table.starts)) == sorted(sizes)
    seen = set()
    for _ in range(40):
        one = np.where(pattern, random.normal(size=pattern.shape), 0.0)
        signs = [
            np.linalg.det(one[np.ix_(table.rows[first:end], table.columns[first:end])]) < 0.0
            for first, end in itertools.pairwise(table.starts)
        ]
        side = sides.side_at(one, columns, table)
        assert side == sum(1 << block for block, negative in enumerate(signs) if negative)
        seen.add(side)
    assert len(seen) == 2 ** len(sizes)
    flat = one.copy()
    flat[-1] = 0.0
    assert sides.side_at(flat, columns, table) == sides.UNKNOWN


@pytest.mark.parametrize(("rows", "size"), [(3, 1), (5, 3), (6, 4)])
def test_redundant_rows_are_turned_over_where_least_squares_says_so(rows: int, size: int) -> None:
    random = np.random.default_rng(rows)
    everywhere = np.ones((rows, size), dtype=np.bool_)
    group = np.zeros(rows, dtype=np.int64)
    table = sides.side_table(random.normal(size=(rows, size)), everywhere, group, np.arange(size))
    before, after = random.normal(size=(2, 40, rows, size))
    after[-1] = 0.0  # no side at all is not the same one
    same = np.zeros(40, dtype=np.bool_)
    sides.same_side(before, after, table, room_to_eliminate(size), same)
    expected = [np.linalg.det(np.linalg.lstsq(a, b)[0]) > 0.0 for a, b in zip(before, after, strict=True)]
    assert same.tolist() == expected
    assert {True, False} == set(expected[:-1])


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("spoiled", [False, True])
def test_random_four_bars_whose_branches_all_but_meet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, engine: str, spoiled: bool
) -> None:
    if spoiled:
        blind(monkeypatch)
    rng = np.random.default_rng(11)
    wrong = refused = other = 0
    for number in range(10):
        model = near_meeting(rng, (1, -1)[number % 2])
        q = rng.uniform(-6.0, 6.0, 8)
        found = alone(reference(engine, write_model(tmp_path, model.bodies(), LOOP, home=model.home())), q[:, None])
        off = np.linalg.norm(found[:, [0, 2]] - model.poses(q)[:, 3, :2], axis=1)
        model.branch = -model.branch
        there = np.linalg.norm(found[:, [0, 2]] - model.poses(q)[:, 3, :2], axis=1)
        wrong += int((off > CLOSE).sum())
        other += int((there <= CLOSE).sum())
        refused += int(np.isnan(off).sum())
    assert refused == 0
    assert (wrong > 10 and other == wrong) if spoiled else (wrong == other == 0)


def two_on_one_crank(model: FourBar) -> tuple[str, str, str]:
    """The loop twice, side by side on one crank, the second with its own coupler and rocker: bodies, loops, home."""
    again = model.bodies()
    first = again.index('<body name="coupler"')
    coupler = again[first : again.index("</body></body>")] + "</body>"
    rocker = again[again.index('<body name="rocker"') :]
    second = coupler + "|" + rocker
    for name in ("coupler", "rocker"):
        second = second.replace(f'"{name}', f'"second_{name}').replace(f'"q_{name}', f'"q_second_{name}')
    second = second.replace('name="P"', 'name="second_P"')
    more, held = second.split("|")
    bodies = again.replace("</body></body>", "</body>" + more + "</body>") + held
    loops = LOOP + LOOP.replace('"loop"', '"second"').replace('"coupler_tip', '"second_coupler_tip').replace(
        '"rocker_tip', '"second_rocker_tip'
    )
    phi, psi = (float(angle[0]) for angle in model.angles(np.array([0.9])))
    return bodies, loops, f"0.9 {phi - 0.9} {phi - 0.9} {psi} {psi}"


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("spoiled", [False, True])
def test_two_loops_that_pass_their_near_meetings_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, engine: str, spoiled: bool
) -> None:
    """The determinant of both together keeps its sign when both jump; the twin looks at that one alone."""
    if spoiled:
        whole = sides.side_table

        def undivided(*arguments: np.ndarray) -> sides.SideTable:
            table = whole(*arguments)
            one = np.array([0, len(table.rows)])
            return table._replace(starts=one, group_starts=np.array([0, len(table.group_rows)]), least=np.full(1, 1e-9))

        monkeypatch.setattr(continuation, "side_table", undivided)
        monkeypatch.setattr(
            pinocchio_loops.PinocchioLoops,
            "_same_side",
            lambda self, before, after: np.linalg.det(before[:, self.passive].T @ after[:, self.passive]) > 0.0,
        )
    model = FourBar()
    model.coupler, model.rocker = 0.200001, 0.2
    bodies, loops, home = two_on_one_crank(model)
    q = np.random.default_rng(1).uniform(-6.0, 6.0, 12)
    found = alone(reference(engine, write_model(tmp_path, bodies, loops, home=home)), q[:, None])
    wrong = int((np.linalg.norm(found[:, [0, 2]] - model.poses(q)[:, 3, :2], axis=1) > CLOSE).sum())
    assert not np.isnan(found).any()
    assert wrong > 3 if spoiled else wrong == 0


class Rssr:
    """A crank about z, a rod between two ball joints, a rocker about a line that is skew to it: four rows, four joints.

    The rocker's angle is from Freudenstein's equation in space, A cos psi + B sin psi = C.
    """

    crank, rocker, place = 0.1, 0.3, np.array([0.25, 0.12, 0.05])

    def __init__(self, branch: int, beyond: float) -> None:
        self.branch = branch
        q = np.linspace(-np.pi, np.pi, 20001)
        # the shortest rod with which the crank goes round is that of the worst angle
        u, a, b = self._parts(q)
        need = self.rocker**2 + np.sum(u * u, axis=1)
        self.rod = float(np.sqrt((need - 2.0 * self.rocker * np.hypot(a, b)).max())) * (1.0 + beyond)

    def _parts(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        tip = self.crank * np.stack([np.cos(q), np.sin(q), 0 * q], axis=1)
        u = tip - self.place  # the rocker turns in the (y, z) plane
        return u, u[:, 1], u[:, 2]

    def tip(self, q: np.ndarray) -> np.ndarray:
        """The rocker's tip ``(n, 3)``."""
        u, a, b = self._parts(q)
        c = (self.rocker**2 + np.sum(u * u, axis=1) - self.rod**2) / (2.0 * self.rocker)
        psi = np.arctan2(b, a) + self.branch * np.arccos(c / np.hypot(a, b))
        return self.place + self.rocker * np.stack([0 * q, np.cos(psi), np.sin(psi)], axis=1)

    def write(self, folder: Path, q: float) -> Path:
        start, end = self.crank * np.array([np.cos(q), np.sin(q), 0.0]), self.tip(np.array([q]))[0]
        axis = (end - start) @ np.array([[np.cos(q), -np.sin(q), 0], [np.sin(q), np.cos(q), 0], [0, 0, 1]])
        half = np.array([axis[2] + self.rod, -axis[1], axis[0], 0.0])  # turns z into the rod
        w, x, y, z = half / np.linalg.norm(half)
        psi = np.arctan2(*(end - self.place)[[2, 1]])
        inertial = '<inertial pos="0 0 0.1" mass="0.3" diaginertia="0.002 0.002 0.001"/>'
        bodies = f"""<body name="crank"><joint name="q" axis="0 0 1"/>{inertial}
          <body name="rod" pos="{self.crank} 0 0"><joint name="ball" type="ball"/>{inertial}
            <site name="rod_tip" pos="0 0 {self.rod}"/></body></body>
          <body name="rocker" pos="{self.place[0]} {self.place[1]} {self.place[2]}">
            <joint name="q_rocker" axis="1 0 0"/>{inertial}<site name="P" pos="0 {self.rocker} 0"/></body>"""
        loop = '<connect name="loop" site1="rod_tip" site2="P"/>'
        return write_model(folder, bodies, loop, home=f"{q} {w} {x} {y} {z} {psi}")


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("spoiled", [False, True])
def test_a_loop_in_space_with_as_many_rows_as_joints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, engine: str, spoiled: bool
) -> None:
    if spoiled:
        blind(monkeypatch)
    wrong = 0
    for branch in (1, -1):
        model = Rssr(branch, 1e-7)
        found = reference(engine, model.write(tmp_path, 0.9))
        if isinstance(found, wb.MujocoReference):
            table = found._closer._side_table
            assert len(table.rows) == found.structure.rows == 4 or spoiled
        q = np.random.default_rng(5).uniform(-6.0, 6.0, 12)
        x = alone(found, q[:, None])
        assert not np.isnan(x).any()
        wrong += int((np.linalg.norm(x - model.tip(q), axis=1) > CLOSE).sum())
    assert wrong > 3 if spoiled else wrong == 0


@pytest.mark.parametrize("spoiled", ["", "never", "always"])
def test_rows_that_turn_over_where_the_mechanism_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spoiled: str
) -> None:
    """A four-bar whose plane is turned about its ground: the rows chosen at home hold nothing a quarter turn on."""
    if spoiled:  # without machine code of which nothing can be replaced
        monkeypatch.setattr(closure, "is_covered", lambda _: False)
        monkeypatch.setattr(continuation, "same_side", lambda *arrays: arrays[-1].fill(spoiled == "always"))
    wrong = refused = 0
    model = FourBar()
    model.coupler, model.rocker = 0.200001, 0.2
    inertial = '<inertial pos="0 0 0" mass="0.3" diaginertia="0.002 0.002 0.001"/>'
    bodies = f'<body name="plane"><joint name="turn" axis="1 0 0"/>{inertial}{model.bodies()}</body>'
    path = write_model(tmp_path, bodies, LOOP, motors=("turn", "q"), home=f"0 {model.home()}")
    rng = np.random.default_rng(2)
    q = np.stack([rng.uniform(1.4, 1.74, 30) * rng.choice([-1, 1], 30), rng.uniform(-6.0, 6.0, 30)], axis=1)
    x = alone(wb.MujocoReference(path), q)
    refused = int(np.isnan(x).any(axis=1).sum())
    flat = model.poses(q[:, 1])[:, 3, :2]
    expected = np.stack([flat[:, 0], -flat[:, 1] * np.sin(q[:, 0]), flat[:, 1] * np.cos(q[:, 0])], axis=1)
    wrong = int((np.linalg.norm(x - expected, axis=1) > CLOSE).sum())
    assert {"": wrong == refused == 0, "never": refused > 3, "always": wrong > 3}[spoiled]


def test_a_motion_through_a_near_meeting_stays_on_its_branch(tmp_path: Path) -> None:
    """As scattered samples, and each from its predecessor, whose tangent leads to the other branch."""
    model = FourBar()
    model.coupler, model.rocker = 0.2 + 1e-9, 0.2
    path = write_model(tmp_path, model.bodies(), LOOP, home=model.home())
    q = np.linspace(2.9, 3.4, 40)
    found = wb.MujocoReference(path)
    still = np.zeros((len(q), 1))
    scattered = found.inverse_dynamics(q[:, None], still, still)
    assert np.abs(scattered.x[:, [0, 2]] - model.poses(q)[:, 3, :2]).max() < CLOSE
    moved = found.inverse_dynamics(q[:, None], still, still, near=scattered.qpos[np.r_[0, 0:39]])
    assert np.abs(moved.qpos - scattered.qpos).max() < CLOSE


@pytest.mark.parametrize("guard", ["", "LONGEST_STEP"])
def test_a_long_step_between_neighbours_is_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, guard: str
) -> None:
    """By lengths alone, without sides: the tangent leads to the other branch, the way itself does not."""
    monkeypatch.setattr(continuation, "side_table", lambda *_: sides.NO_SIDES)
    if guard:
        monkeypatch.setattr(along, guard, np.inf)
    q = np.array([[np.pi - 0.15], [np.pi + 0.15]])
    found = {}
    for branch in (1, -1):
        model = FourBar(branch)
        model.coupler, model.rocker = 0.2001, 0.2
        closer = wb.MujocoReference(write_model(tmp_path, model.bodies(), LOOP, home=model.home()))._closer
        found[branch] = closer, closer.follow(q)
    closer, same = found[1]
    jumped = same.at(np.arange(2))
    jumped.put(np.array([1]), found[-1][1], np.array([1]))
    jumped.qpos[1] -= 2 * np.pi * np.round((jumped.qpos[1] - same.qpos[1]) / (2 * np.pi))  # hinges may have gone round
    assert np.abs(jumped.qpos[1] - same.qpos[1]).max() > 0.05
    assert closer._linked(same, q).tolist() == [True]
    assert closer._linked(jumped, q).tolist() == [bool(guard)]


@pytest.mark.parametrize("spoiled", [False, True])
def test_neighbours_on_two_sides_are_no_motion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spoiled: bool) -> None:
    """A short step whose tangent leads to the other branch: near, and yet beyond a singular pose."""
    q, found = np.array([[np.pi - 0.02], [np.pi + 0.02]]), {}
    for branch in (1, -1):
        model = FourBar(branch)
        model.coupler, model.rocker = 0.2 + 1e-8, 0.2
        closer = wb.MujocoReference(write_model(tmp_path, model.bodies(), LOOP, home=model.home()))._closer
        found[branch] = closer, closer.follow(q)
    closer, same = found[1]
    jumped = same.at(np.arange(2))
    jumped.put(np.array([1]), found[-1][1], np.array([1]))
    jumped.qpos[1] -= 2 * np.pi * np.round((jumped.qpos[1] - same.qpos[1]) / (2 * np.pi))
    if spoiled:
        monkeypatch.setattr(type(closer), "_on_side", lambda self, here, rows, *_: np.ones(len(rows), dtype=np.bool_))
    assert closer._linked(jumped, q).tolist() == [spoiled]
    assert spoiled or closer._linked(same, q).tolist() == [True]


def test_rows_are_said_to_depend_on_the_joints_that_they_depend_on(tmp_path: Path) -> None:
    """A tendon held alone, two tied together, two joints tied, a joint held alone: no row knows of another's joints."""
    names = "abcdefgh"
    bodies = "".join(
        f'<body pos="0 {k} 0"><joint name="{name}" axis="0 1 0"/><geom size=".1" mass="1" pos=".2 0 0"/>'
        f'<site name="s{name}"/></body>'
        for k, name in enumerate(names)
    )
    pairs = {"alone": "ab", "first": "cd", "second": "de", "last": "fg"}
    tendons = "".join(
        f'<fixed name="{tendon}">' + "".join(f'<joint joint="{joint}" coef="{k}"/>' for joint in pair) + "</fixed>"
        for k, (tendon, pair) in enumerate(pairs.items(), 1)
    )
    text = (
        f"<mujoco><worldbody>{bodies}</worldbody><tendon>{tendons}</tendon><equality>"
        '<tendon tendon1="alone"/><tendon tendon1="first" tendon2="second"/><tendon tendon1="last"/>'
        '<joint joint1="h" joint2="e"/></equality></mujoco>'
    )
    path = tmp_path / "model.xml"
    path.write_text(text, encoding="utf-8")
    closer = wb.MujocoReference(path, setup=Setup(("a", "c", "d", "f"), "sa"))._closer
    pattern, group = sides.pattern_of(closer.structure, closer.joints[2])
    rows = closer.jacobian(closer.home)
    assert np.array_equal(pattern, rows != 0.0)
    assert group.tolist() == [0, 1, 2, 3]
    assert pattern.sum(axis=1).tolist() == [2, 3, 2, 2]
