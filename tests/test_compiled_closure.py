"""Loops closed in machine code, held against MuJoCo's own kinematics, against closing by MuJoCo, and spoiled."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import cusp_robot as cusp
import workbench as wb
from random_mechanisms import RandomMechanism, draw
from robots import MODEL, sine_sum
from workbench.errors import ModelError, WorkbenchError
from workbench.reference import closure
from workbench.reference.closure import LoopCloser
from workbench.reference.kinematics import is_covered, place, room

RANDOM = 12
WITH_FREE_JOINT = 12
"""seed"""
ROUNDING = 1e-13
"""m: what two programs that place the same robots of a metre differ by"""
SAME = 1e-11
"""m, rad: two closures of one pose, at conditions of up to a hundred"""
SPOILED = 1e-9
"""m: an error of kinematics that no result may survive"""


def mechanisms(count: int) -> list[RandomMechanism]:
    drawn = (draw(seed) for seed in range(10 * count))
    return [mechanism for mechanism in drawn if mechanism is not None][:count]


def references(folder: Path, count: int) -> list[tuple[RandomMechanism, wb.MujocoReference]]:
    found = []
    for number, mechanism in enumerate(mechanisms(count)):
        path = folder / f"m{number}.xml"
        path.write_text(mechanism.text, encoding="utf-8")
        try:
            found.append((mechanism, wb.MujocoReference(path)))
        except WorkbenchError:  # near a singular pose
            continue
    assert len(found) > count / 2
    return found


def differences(reference: wb.MujocoReference, seed: int, **spoiled: Any) -> float:
    """Largest difference of places and motion vectors from MuJoCo's, at random states; the latter taken at a point."""
    model, mechanism = reference.compiled(), reference._closer.mechanism
    assert mechanism is not None
    kinematics = mechanism.kinematics._replace(**spoiled)
    places, data, rng = room(kinematics, model.nv), mujoco.MjData(model), np.random.default_rng(seed)
    worst = 0.0
    for _ in range(3):
        qpos = np.array(model.qpos0) + rng.normal(0, 1.0, model.nq)
        data.qpos = qpos  # neither side is handed unit quaternions
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        place(kinematics, qpos, places)
        gaps = [places.xpos - data.xpos, places.anchors - data.xanchor]
        own = kinematics.points[kinematics.points < model.nsite]
        gaps.append(places.site_xpos[own] - data.site_xpos[own])
        for dof in range(model.nv):
            body = int(model.dof_bodyid[dof])
            centre = data.subtree_com[model.body_rootid[body]]
            turn, slide = data.cdof[dof, :3], data.cdof[dof, 3:]
            moved = slide + np.cross(turn, kinematics.centre[body] - centre)
            gaps.append(places.cdof[dof] - np.concatenate([turn, moved]))
        worst = max(worst, *(float(np.abs(gap).max(initial=0.0)) for gap in gaps))
    return worst


def test_places_and_motion_vectors_are_those_of_mujoco(tmp_path: Path) -> None:
    kinds: set[int] = set()
    for number, (_, reference) in enumerate(references(tmp_path, RANDOM)):
        assert differences(reference, number) < 10 * ROUNDING
        kinds |= set(reference.compiled().jnt_type.tolist())
    assert {mujoco.mjtJoint.mjJNT_BALL, mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE} <= kinds


def test_places_of_a_body_on_a_free_joint_are_those_of_mujoco(tmp_path: Path) -> None:
    """In a file that says itself what drives it; where a campaign does, free joints are taken apart before."""
    drawn = draw(WITH_FREE_JOINT)
    assert drawn is not None
    path = tmp_path / "model.xml"
    path.write_text(drawn.text, encoding="utf-8")
    reference = wb.MujocoReference(path)
    assert mujoco.mjtJoint.mjJNT_FREE in reference.compiled().jnt_type
    for seed in range(4):
        assert differences(reference, seed) < 10 * ROUNDING
    mechanism = reference._closer.mechanism
    assert mechanism is not None
    assert differences(reference, 0, body_pos=mechanism.kinematics.body_pos + 1e-6) > 1e-8


@pytest.mark.parametrize("table", ["body_pos", "joint_pos", "joint_axis", "body_quat", "start"])
def test_a_spoiled_table_shows_in_the_places(table: str) -> None:
    reference = wb.MujocoReference(MODEL)
    mechanism = reference._closer.mechanism
    assert mechanism is not None
    values = getattr(mechanism.kinematics, table)
    assert differences(reference, 0) < 10 * ROUNDING
    assert differences(reference, 0, **{table: values + 1e-6}) > 1e-8


def test_machine_code_closes_loops_as_mujoco_does(tmp_path: Path) -> None:
    compared = 0
    for number, (_, reference) in enumerate(references(tmp_path, RANDOM)):
        fast = reference._closer
        slow = LoopCloser(fast.engine, fast.structure, compiled=False)
        assert slow.mechanism is None
        rng = np.random.default_rng(number)
        start = np.array(reference.home)
        # a motion that wanders, and comes to each sample by small steps
        steps = rng.uniform(-0.004, 0.004, (30, len(start)))
        q = start + np.cumsum(steps, axis=0)
        for name in ("close", "close_along"):
            found = []
            for closer in (fast, slow):
                try:
                    found.append(getattr(closer, name)(q[:, : len(closer.start)]))
                except WorkbenchError as error:
                    found.append(str(error).split(":")[0])
            if isinstance(found[0], str) or isinstance(found[1], str):
                assert found[0] == found[1]  # both refuse the same sample
                continue
            one, other = found
            well = other.condition < 100
            assert (one.rank == other.rank).all()
            assert fast._apart(one.qpos, other.qpos)[well].max(initial=0.0) < SAME
            compared += int(well.sum())
    assert compared > 100


def test_a_long_motion_meets_at_its_chunks_and_is_the_same_on_threads() -> None:
    t = np.linspace(0.0, 2.0, 1300)
    q, qd, qdd = sine_sum(np.random.default_rng(5), t, 0.7)
    one, two = (wb.MujocoReference(MODEL, threads=n).inverse_dynamics(q, qd, qdd, along=t) for n in (1, 2))
    for name in ("tau", "qpos", "closure_residual", "condition"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    reference = wb.MujocoReference(MODEL)
    reference._closer = LoopCloser(reference._closer.engine, reference._closer.structure, compiled=False)
    before = reference.inverse_dynamics(q, qd, qdd, along=t)
    assert np.abs(one.tau - before.tau).max() <= 1e-12 * np.abs(before.tau).max()
    # a sample is factored where it is closed, wherever the steps that led there had their factor from
    np.testing.assert_allclose(one.condition, before.condition, rtol=1e-10)
    assert one.velocity_residual.max() <= 1e-12 * np.abs(qd).max()


@pytest.mark.parametrize("ordered", [True, False])
def test_a_sample_among_others_is_what_it_is_alone(ordered: bool) -> None:
    """Groups of samples are factored at once, where they agree; scattered ones differ in the order of their columns."""
    t = np.linspace(0.0, 2.0, 150)
    q, qd, qdd = sine_sum(np.random.default_rng(8), t, 0.9)
    if not ordered:
        mixed = np.random.default_rng(9).permutation(len(t))
        q, qd, qdd = q[mixed], qd[mixed], qdd[mixed]
    reference = wb.MujocoReference(MODEL)
    whole = reference.inverse_dynamics(q, qd, qdd, along=t if ordered else None)
    assert len(np.unique(whole.condition.round(3))) > 20
    for s in range(0, len(t), 7):
        near = reference._closer.close_near(q[s : s + 1], whole.qpos[s : s + 1])
        alone = reference.inverse_dynamics(q[s : s + 1], qd[s : s + 1], qdd[s : s + 1], near=near)
        assert np.abs(alone.tau[0] - whole.tau[s]).max() <= 1e-12 * np.abs(whole.tau).max()
        assert alone.condition[0] == pytest.approx(whole.condition[s], rel=1e-8)
        for name, force in whole.reactions.items():
            assert np.abs(alone.reactions[name][0] - force[s]).max() <= 1e-11 * np.abs(force).max()


def test_a_chunk_that_begins_on_another_assembly_is_followed_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Around a cusp straight lines from home lead to another assembly than the motion: chunks of ten samples see it."""
    t = np.linspace(0.0, 2.0 * np.pi / cusp.RATE, cusp.SAMPLES)
    poses = cusp.followed(t)
    path = tmp_path / "cusp.xml"
    path.write_text(cusp.model_text())
    q, qd, qdd = cusp.lengths(t)
    whole = wb.MujocoReference(path, setup=cusp.setup_at(poses[0])).inverse_dynamics(q, qd, qdd, along=t)
    monkeypatch.setattr("workbench.reference.along.CHUNK", 10)
    parts = wb.MujocoReference(path, setup=cusp.setup_at(poses[0])).inverse_dynamics(q, qd, qdd, along=t)
    assert np.abs(parts.tau - whole.tau).max() <= 1e-10 * np.abs(whole.tau).max()
    scattered = wb.MujocoReference(path, setup=cusp.setup_at(poses[0]))._closer.mark(q)[0]
    assert np.abs(scattered.qpos - whole.qpos).max() > 0.1  # so there was something to see


def test_spoiled_kinematics_are_refused_at_home(monkeypatch: pytest.MonkeyPatch) -> None:
    true = closure.kinematics_of

    def spoiled(*given: Any) -> Any:
        found = true(*given)
        points = found.point_pos.copy()
        points[0, 1] += SPOILED
        return found._replace(point_pos=points)

    monkeypatch.setattr(closure, "kinematics_of", spoiled)
    with pytest.raises(ModelError, match="home pose: MuJoCo finds the loops open by 1e-09 m where they were closed"):
        wb.MujocoReference(MODEL)


@pytest.mark.parametrize("ordered", [True, False])
def test_spoiled_kinematics_are_refused_by_the_residual_of_mujoco(ordered: bool) -> None:
    t = np.linspace(0.0, 1.0, 60)
    q, qd, qdd = sine_sum(np.random.default_rng(2), t, 0.5)
    reference = wb.MujocoReference(MODEL)
    assert reference.inverse_dynamics(q, qd, qdd).closure_residual.max() <= 1e-13
    mechanism = reference._closer.mechanism
    assert mechanism is not None
    axes = mechanism.kinematics.joint_axis.copy()
    axes[:, 0] += SPOILED
    reference._closer.mechanism = mechanism._replace(kinematics=mechanism.kinematics._replace(joint_axis=axes))
    with pytest.raises(ModelError, match=r"sample \d+: MuJoCo finds the loops open by .* fault of the workbench"):
        reference.inverse_dynamics(q + 1e-3, qd, qdd, along=t if ordered else None)


def test_what_joints_do_not_determine_is_left_to_mujoco() -> None:
    text = '<mujoco><worldbody><body name="m" mocap="true"/><body><joint/><geom size="1"/></body></worldbody></mujoco>'
    assert not is_covered(mujoco.MjModel.from_xml_string(text))
    assert is_covered(mujoco.MjModel.from_xml_string(text.replace('mocap="true"', "")))
