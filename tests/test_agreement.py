"""One parameter that stands in several places of the model: they agree when it is read, and after it has been set."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

import workbench as wb
from own_mechanisms import FOURBAR
from workbench.errors import ModelError
from workbench.robots.load import load_model

ROBOT = """
format = 1
name = "fourbar"
title = "A four-bar"
model = "fourbar.xml"
actuated = ["crank"]
platform = { site = "coupler", coordinates = ["x"] }
initial = { crank = 1.0, elbow = -0.5, wrist = -1.5 }

[parameters.d]
at = ["damping elbow", "damping wrist"]
unit = "N m s/rad"
meaning = "damping of the passive joints"
"""

IN_A_CLASS = '<default><joint damping="0.1"/></default><worldbody>'


def folder(tmp_path: Path, elbow: str, wrist: str, head: str = "<worldbody>") -> Path:
    text = FOURBAR.replace("<worldbody>", head)
    for name, damping in (("elbow", elbow), ("wrist", wrist)):
        written = f' damping="{damping}"' if damping else ""
        text = text.replace(f'<joint name="{name}"', f'<joint name="{name}"{written}')
    (tmp_path / "fourbar.xml").write_text(text, encoding="utf-8")
    (tmp_path / "robot.toml").write_text(ROBOT, encoding="utf-8")
    return tmp_path


def dampings(model: mujoco.MjModel) -> list[float]:
    return [float(model.dof_damping[model.joint(name).dofadr[0]]) for name in ("crank", "elbow", "wrist")]


def test_setting_it_sets_every_place(tmp_path: Path) -> None:
    robot = folder(tmp_path, "0.1", "0.1")
    assert wb.load_robot(robot).parameters.d == 0.1
    assert dampings(load_model(robot, {"d": 0.3}).model) == [0.0, 0.3, 0.3]


@pytest.mark.parametrize("wrist", ["0.2", "0.1000001"])
def test_places_that_disagree_are_refused(tmp_path: Path, wrist: str) -> None:
    with pytest.raises(
        ModelError, match=rf'fourbar\.xml:\d+: "damping wrist" is {wrist}, .* parameter d makes it 0\.1,'
    ):
        load_model(folder(tmp_path, "0.1", wrist))


def test_rounding_is_no_disagreement(tmp_path: Path) -> None:
    load_model(folder(tmp_path, "0.1", "0.10000000000000002"))


def test_a_place_that_stays_behind_when_it_is_set_is_refused(tmp_path: Path) -> None:
    """The wrist's number comes from a class, where it cannot be set: the edited model would be two robots."""
    robot = folder(tmp_path, "0.1", "", IN_A_CLASS)
    assert load_model(robot).values == {"d": 0.1}
    assert load_model(robot, {"d": 0.1}).values == {"d": 0.1}
    with pytest.raises(ModelError, match=r'"damping wrist" is 0\.1, but parameter d makes it 0\.3, .* have to agree'):
        load_model(robot, {"d": 0.3})
