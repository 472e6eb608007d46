"""Variants made in a kept specification are those that the file's text gives, bit for bit; whoever asks how often."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import workbench as wb
from workbench.capabilities.robot import Robot
from workbench.errors import ParameterError
from workbench.reference.shelf import Shelf
from workbench.robots import variants
from workbench.robots.load import Base, LoadedModel, read_base, with_overrides

ROOT = Path(__file__).resolve().parents[1]
ROBOTS = (
    ROOT / "models" / "asym_2rss_ppap.xml",
    ROOT / "models" / "planar_4rprp.xml",
    ROOT / "examples" / "rrr" / "robot.toml",
    ROOT / "examples" / "delta" / "robot.toml",
)
OFTEN = variants.MANY + 2


def fresh(robot: Path) -> Base:
    """A base that nobody has asked for a variant yet."""
    return dataclasses.replace(read_base(robot), variants=variants.Variants())


def moved(base: Base, random: np.random.Generator) -> dict[str, float]:
    """All parameters that can be set, each changed by a few per cent."""
    values = base.loaded.values
    assert values is not None
    free = [name for name in values if name not in base.computed]
    return {name: values[name] * random.uniform(0.97, 1.03) + (0.01 if values[name] == 0 else 0.0) for name in free}


def bits(model: mujoco.MjModel) -> bytes:
    buffer = np.empty(mujoco.mj_sizeModel(model), dtype=np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


def by_text(base: Base, changes: Mapping[str, float]) -> LoadedModel:
    return with_overrides(dataclasses.replace(base, variants=variants.Variants()), changes)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda path: path.stem if path.suffix == ".xml" else path.parent.name)
def test_a_kept_specification_gives_what_the_text_gives(robot: Path) -> None:
    base, random = fresh(robot), np.random.default_rng(7)
    for asked in range(1, OFTEN + 1):
        changes = moved(base, random)
        if asked % 2:  # numbers that do not change are the file's own again
            changes = dict(list(changes.items())[:2])
        quick, slow = with_overrides(base, changes), by_text(base, changes)
        assert (quick.family is not None) == (asked >= variants.MANY)
        assert slow.family is None
        assert bits(quick.model) == bits(slow.model)
        assert bits(quick.user) == bits(slow.user)
        assert (quick.text, quick.values, quick.notes) == (slow.text, slow.values, slow.notes)
        assert bits(quick.spec().compile()) == bits(slow.model)


def test_torques_do_not_depend_on_the_variants_before() -> None:
    base, random = fresh(ROBOTS[0]), np.random.default_rng(3)
    t = np.linspace(0.0, 1.0, 40)
    size, angle = random.uniform(-0.05, 0.05, 3), 6.0 * t[:, None]
    q, qd, qdd = size * np.sin(angle), 6.0 * size * np.cos(angle), -36.0 * size * np.sin(angle)
    for asked in range(OFTEN):
        changes = moved(base, random)
        pair = [
            wb.MujocoReference(ROBOTS[0], loaded=one, threads=threads)
            for one, threads in ((with_overrides(base, changes), 1 + asked % 2), (by_text(base, changes), 1))
        ]
        for mass_model in ("distributed", "lumped"):
            found = [
                one.inverse_dynamics(one.home + q, qd, qdd, mass_model, along=t if asked % 2 else None) for one in pair
            ]
            assert found[0].tau.tobytes() == found[1].tau.tobytes()
            assert found[0].condition.tobytes() == found[1].condition.tobytes()
            assert all(found[0].reactions[k].tobytes() == found[1].reactions[k].tobytes() for k in found[1].reactions)


SIMPLE = """<mujoco><option gravity="0 0 -9.81"><flag contact="disable"/></option>
<custom><text name="base_body" data="world"/><text name="platform_site" data="end"/></custom>
<worldbody><body name="rotor"><joint name="q1" axis="0 0 1"/><inertial pos="{com} 0 0" mass="1" diaginertia=".1 .1 .1"/>
<site name="end" pos=".1 0 0"/></body>
<body name="slider" pos="0 1 0"><joint name="q2" type="slide" axis="1 0 0"/>
<inertial pos="{com} 0 0" mass="2" diaginertia=".1 .1 .1"/></body></worldbody>
<actuator><motor joint="q1"/><motor joint="q2"/></actuator></mujoco>"""


def test_a_family_whose_bodies_become_simple_makes_new_batches(tmp_path: Path) -> None:
    """MuJoCo lays data out another way for bodies whose mass centre is their origin."""
    shelf, family = Shelf(), object()
    torques = []
    for place, com in enumerate((0.1, 0.0, 0.1, 0.0)):
        path = tmp_path / f"{place}.xml"
        path.write_text(SIMPLE.format(com=com))
        one = wb.MujocoReference(path)
        assert bool(one.compiled().body_simple[1:].any()) == (com == 0.0)
        shared = dataclasses.replace(one.loaded, family=family)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("workbench.reference.mujoco_reference.shelf_of", lambda _: shelf)
            other = wb.MujocoReference(path, loaded=shared)
        motion = np.array([[0.3, 0.1]]), np.array([[1.0, 2.0]]), np.array([[0.5, -1.0]])
        torques.append((one.inverse_dynamics(*motion).tau, other.inverse_dynamics(*motion).tau))
    assert all(one.tobytes() == other.tobytes() for one, other in torques)
    assert torques[0][0].tobytes() != torques[1][0].tobytes()


@pytest.mark.parametrize("robot", [ROBOTS[0], ROBOTS[3]], ids=["asym", "delta"])
def test_a_specification_that_is_not_the_texts_is_not_kept(robot: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    base, true, spoiled = fresh(robot), variants._place, []

    def shifted(base: Base, spec: mujoco.MjSpec, target: Any) -> Any:
        found = true(base, spec, target)
        if found is None or target.reads is None or spoiled:
            return found
        spoiled.append(target)
        return found[0], 1.001 * found[1]

    assert variants._kept(base) is not None
    monkeypatch.setattr(variants, "_place", shifted)
    assert variants._kept(base) is None
    assert spoiled


def test_a_number_that_is_not_put_is_noticed_in_each_variant(monkeypatch: pytest.MonkeyPatch) -> None:
    base, random = fresh(ROBOTS[0]), np.random.default_rng(5)
    for _ in range(variants.MANY):
        with_overrides(base, moved(base, random))
    assert base.variants._kept is not None
    true = variants._Numbers.put
    monkeypatch.setattr(variants._Numbers, "put", lambda self, wanted: true(self, {**wanted, "a1_left": 0.2}))
    changes = moved(base, random)
    found = with_overrides(base, changes)
    assert found.family is None  # by the text
    assert bits(found.model) == bits(by_text(base, changes).model)


def test_what_is_wrong_is_said_as_by_the_text() -> None:
    base = fresh(ROBOTS[0])
    wrong: list[tuple[dict[str, float], type[Exception]]] = [
        ({"m1_left": 1e-300}, ParameterError),
        ({"m1_left": 1e-13, "I1_left": 1e-20}, ParameterError),
        ({"a1_left": -1.0}, ParameterError),
    ]
    for asked in range(OFTEN):
        with_overrides(base, {"payload": 0.1 * asked})
    assert base.variants._kept is not None
    for changes, kind in wrong:
        said = []
        for make in (with_overrides, by_text):
            with pytest.raises(kind) as caught:
                make(base, changes)
            said.append(str(caught.value))
        assert said[0] == said[1]


def test_options_that_change_masses_go_through_the_text(tmp_path: Path) -> None:
    text = ROBOTS[0].read_text().replace("<compiler ", '<compiler boundmass="0.001" ')
    path = tmp_path / "bounded.xml"
    path.write_text(text)
    base = fresh(path)
    for asked in range(OFTEN):
        assert with_overrides(base, {"payload": 0.1 + 0.1 * asked}).family is None


def test_robots_of_one_base_may_be_made_in_any_order() -> None:
    robot = wb.load_robot(ROBOTS[2])
    random = np.random.default_rng(1)
    changes = [{name: robot.values[name] * random.uniform(0.98, 1.02) for name in ("l1", "l2")} for _ in range(OFTEN)]

    def homes(order: list[int]) -> dict[int, bytes]:
        own = Robot(dataclasses.replace(robot._base, variants=variants.Variants()), robot.values)
        return {i: own.with_parameters(**changes[i]).home.tobytes() for i in order}

    assert homes(list(range(OFTEN))) == homes(list(reversed(range(OFTEN))))
