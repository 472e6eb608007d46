"""What models of one family lend each other: data come back as new, and only to models that they fit."""

from __future__ import annotations

import mujoco
import numpy as np

from workbench.reference.shelf import Shelf, shelf_of

BAR = """<mujoco><worldbody><body><joint axis="0 1 0" damping="{damping}"/><geom type="capsule" size=".02"
 fromto="0 0 0 .3 0 0"/><body pos=".3 0 0"><joint name="end" type="{kind}"/><geom size=".05" pos="{at} 0 0"/></body>
 </body></worldbody></mujoco>"""


def bar(damping: float = 0.1, kind: str = "hinge", at: float = 0.1) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(BAR.format(damping=damping, kind=kind, at=at))


def test_data_that_come_back_are_as_new() -> None:
    shelf, one, other = Shelf(), bar(), bar(0.7)
    with shelf.data_of(one) as first:
        first.qpos[:], first.qvel[:], first.qfrc_applied[:], first.time = 0.3, 2.0, 5.0, 4.0
        mujoco.mj_forward(one, first)
    with shelf.data_of(other) as second:
        assert second is first
        fresh = mujoco.MjData(other)
        for name in ("qpos", "qvel", "qfrc_applied", "time", "qacc", "xpos"):
            assert np.array_equal(getattr(second, name), getattr(fresh, name)), name
        with shelf.data_of(other) as third:  # the first is in use
            assert third is not second


def test_a_model_with_another_mass_matrix_has_data_of_its_own() -> None:
    plain = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><freejoint/><geom size=".1"/></body></worldbody></mujoco>'
    )
    lopsided = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><freejoint/><geom size=".1" pos=".1 0 0"/></body></worldbody></mujoco>'
    )
    assert plain.nC < lopsided.nC  # MuJoCo calls the first body simple
    shelf = Shelf()
    for model in (plain, lopsided, plain):
        with shelf.data_of(model) as data:
            assert len(data.M) == model.nC
            mujoco.mj_forward(model, data)


def test_a_family_has_one_shelf_and_no_family_none() -> None:
    class Family:
        pass

    one, other = Family(), Family()
    assert shelf_of(one) is shelf_of(one)
    assert shelf_of(one) is not shelf_of(other)
    assert shelf_of(None) is not shelf_of(None)
