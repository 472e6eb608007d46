"""A robot without light or sky gets both in its pictures, in memory; one that has its own keeps them."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from workbench.rendering.worker import SKY, light_up, put_behind

LIT = '<light pos="0 0 1"/>'
HEAD = '<visual><headlight ambient="0.2 0.2 0.2"/></visual>'


def model_of(world: str = "", before: str = "") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(
        f'<mujoco>{before}<worldbody>{world}<geom type="sphere" size="0.1"/></worldbody></mujoco>'
    )


def head_of(model: mujoco.MjModel) -> list[float]:
    head = model.vis.headlight
    return [*head.ambient, *head.diffuse, *head.specular]


def test_a_model_without_light_gets_one_and_its_file_none() -> None:
    bare, given = model_of(), model_of()
    light_up(bare)
    assert sum(head_of(bare)[:6]) > sum(head_of(given)[:6])
    assert bare.nlight == 0


@pytest.mark.parametrize(("world", "before"), [(LIT, ""), ("", HEAD)])
def test_a_model_s_own_light_stays(world: str, before: str) -> None:
    model = model_of(world, before)
    own = head_of(model)
    light_up(model)
    assert head_of(model) == own


def test_nothing_of_the_robot_is_painted_over() -> None:
    picture = np.zeros((6, 4, 3), dtype=np.uint8)
    picture[2:4, 1:3] = (10, 20, 30)
    empty = ~np.any(picture, axis=2)
    put_behind(picture, empty)
    assert (picture[~empty] == (10, 20, 30)).all()
    assert (picture[0] == SKY[0]).all()
    assert (picture[-1] == SKY[1]).all()
    assert picture[empty].min() > 150
