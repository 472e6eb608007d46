"""What a run leaves out of account, held against the motion: contacts, limits, and what ``ignore`` names.

Inverse dynamics of a mechanism that touches nothing and stays inside its ranges does not feel either. So both are left
out, and here the motion is held against them: MuJoCo's own collision detection, and the ranges of joints and tendons.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import MotionError, WorkbenchError
from workbench.mjcf.free_joints import user_qpos
from workbench.reference.mujoco_reference import MujocoReference, ReferenceResult

INSIDE = 1e-9
"""m or rad by which a limit may be passed"""

TOUCHING = 1e-9
"""m by which geoms have to overlap"""

SAMPLES = 200
"""poses of a motion at which contacts are looked for"""

NAMED = 4


@dataclass(frozen=True)
class Crossing:
    """Something left out that a motion meets."""

    what: str
    """``limits`` or ``contacts``: the entry of ``ignore`` that lets it pass"""
    sample: int
    """the first one, or the worst of a limit"""
    text: str


@dataclass(frozen=True)
class LeftOut:
    """What is left out of a case."""

    notes: tuple[str, ...]
    """one line each, with what it is worth"""
    crossings: tuple[Crossing, ...]


def look(reference: MujocoReference, result: ReferenceResult) -> LeftOut:
    """Hold contacts and limits of the user's file against the poses of *result*."""
    prepared = reference.loaded.prepared
    if prepared is None or prepared.preparation is None:
        return LeftOut((), ())
    user, free = prepared.user, prepared.preparation.free
    poses = np.array([user_qpos(user, prepared.model, free, row) for row in result.qpos])
    limited, outside = _limits(user, poses)
    notes = []
    if limited:
        notes.append(f"limits of {limited} joint(s) or tendon(s) are left out; the motion stays inside them")
    contacts, touching = _contacts(user, poses, _home(reference, user))
    notes += contacts
    if outside:
        notes = [note for note in notes if not note.startswith("limits")]
    return LeftOut(tuple(notes), (*outside, *touching))


def refuse_crossings(found: LeftOut, ignore: tuple[str, ...], times: FloatArray) -> tuple[str, ...]:
    """Notes of what was left out; what the motion meets is among them where ``ignore`` names it.

    Raises
    ------
    MotionError
        The motion leaves a limit or touches something, and ``ignore`` does not name it.
    """
    bad = [crossing for crossing in found.crossings if crossing.what not in ignore]
    if bad:
        kinds = ", ".join(f'"{what}"' for what in dict.fromkeys(crossing.what for crossing in bad))
        raise MotionError(
            f"sample {bad[0].sample}, {'; '.join(crossing.text for crossing in bad[:NAMED])}"
            f"{f'; and {len(bad) - NAMED} more' if len(bad) > NAMED else ''}; neither counts: change the motion, or say"
            f" ignore = [{kinds}]",
            sample=bad[0].sample,
        )
    return (*found.notes, *(f"ignored: {one.text} at t = {times[one.sample]:.4g} s" for one in found.crossings))


def worth(
    reference: MujocoReference, ignore: tuple[str, ...], motion: tuple[FloatArray, FloatArray, FloatArray],
    tau: FloatArray,
) -> tuple[str, ...]:  # fmt: skip
    """What ``ignore`` leaves out of the torques ``(n, na)``, measured: the same motion with it counted."""
    prepared = reference.loaded.prepared
    if prepared is None or prepared.preparation is None:
        return ()
    setup, notes = prepared.preparation.setup, []
    for what in ignore:
        if what not in ("springs", "tendons"):
            continue
        counted = dataclasses.replace(setup, ignore=tuple(other for other in ignore if other != what))
        try:
            with_it = MujocoReference(reference.file, setup=counted).inverse_dynamics(*motion).tau
        except WorkbenchError as error:
            notes.append(f"ignored: {what}; what they are worth is not known: {error}")
            continue
        shares = [
            f"{joint} {100 * np.abs(with_it[:, i] - tau[:, i]).max() / max(np.abs(with_it[:, i]).max(), 1e-300):.3g} %"
            for i, joint in enumerate(reference.joint_names)
        ]
        notes.append(f"ignored: {what}, worth of the peak torque with them: {', '.join(shares)}")
    return tuple(notes)


def _home(reference: MujocoReference, user: mujoco.MjModel) -> FloatArray:
    prepared = reference.loaded.prepared
    assert prepared is not None
    assert prepared.preparation is not None
    return user_qpos(user, prepared.model, prepared.preparation.free, reference.structure.home_qpos)


def _disabled(model: mujoco.MjModel, flag: str) -> bool:
    return bool(model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}").value)


def _limits(user: mujoco.MjModel, poses: FloatArray) -> tuple[int, list[Crossing]]:
    """How many limits there are, and those that the poses ``(n, nq)`` leave."""
    if _disabled(user, "limit") or not len(poses):
        return 0, []
    obj, kinds = mujoco.mjtObj, mujoco.mjtJoint
    tracks: list[tuple[str, str, FloatArray, tuple[float, float]]] = []
    for joint in (joint for joint in range(user.njnt) if user.jnt_limited[joint]):
        at, kind = int(user.jnt_qposadr[joint]), mujoco.mjtJoint(user.jnt_type[joint])
        name = f'joint "{_name(user, obj.mjOBJ_JOINT, joint)}"'
        unit = "m" if kind == kinds.mjJNT_SLIDE else "rad"
        if kind == kinds.mjJNT_BALL:
            angle = 2.0 * np.arccos(np.clip(np.abs(poses[:, at]), 0.0, 1.0))
            tracks.append((name, unit, angle, (-np.inf, float(user.jnt_range[joint].max()))))
        else:
            low, high = map(float, user.jnt_range[joint])
            tracks.append((name, unit, poses[:, at], (low, high)))
    tendons = [tendon for tendon in range(user.ntendon) if user.tendon_limited[tendon]]
    if tendons:
        data, lengths = mujoco.MjData(user), np.zeros((len(poses), user.ntendon))
        for row, qpos in enumerate(poses):
            data.qpos = qpos
            mujoco.mj_kinematics(user, data)
            mujoco.mj_comPos(user, data)
            mujoco.mj_tendon(user, data)
            lengths[row] = data.ten_length
        tracks += [
            (f'tendon "{_name(user, obj.mjOBJ_TENDON, t)}"', "", lengths[:, t], _pair_of(user.tendon_range[t]))
            for t in tendons
        ]
    crossings = []
    for name, unit, values, (low, high) in tracks:
        beyond = np.maximum(low - values, values - high)
        worst = int(np.argmax(beyond))
        if beyond[worst] > INSIDE:
            text = f"{name} reaches {values[worst]:.4g} {unit}, its range is {low:.4g} to {high:.4g} {unit}".rstrip()
            crossings.append(Crossing("limits", worst, text))
    return len(tracks), crossings


def _pair_of(values: FloatArray) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _contacts(user: mujoco.MjModel, poses: FloatArray, home: FloatArray) -> tuple[list[str], list[Crossing]]:
    """What to say of contacts, and pairs of geoms that come to touch although they do not at home."""
    if _disabled(user, "contact") or not len(poses):
        return [], []
    if not (user.geom_contype | user.geom_conaffinity).any() and not user.npair:
        return [], []
    data = mujoco.MjData(user)
    before = _touching(user, data, home)
    chosen = np.unique(np.linspace(0, len(poses) - 1, min(SAMPLES, len(poses))).astype(int))
    first: dict[tuple[int, int], tuple[int, float]] = {}
    for sample in chosen:
        for pair, depth in _touching(user, data, poses[sample]).items():
            if pair not in before and pair not in first:
                first[pair] = (int(sample), depth)
    notes = []
    if before:
        shown = ", ".join(_pair(user, pair) for pair in list(before)[:NAMED])
        more = f" and {len(before) - NAMED} more" if len(before) > NAMED else ""
        notes.append(f"contacts are left out; in the home pose these touch already: {shown}{more}")
    elif not first:
        notes.append(f"contacts are left out; nothing touches at {len(chosen)} poses of the motion")
    if before and not first:
        notes.append(f"contacts: nothing else touches at {len(chosen)} poses of the motion")
    crossings = [
        Crossing("contacts", sample, f"{_pair(user, pair)} touch, {depth:.2g} m deep")
        for pair, (sample, depth) in sorted(first.items(), key=lambda item: item[1][0])
    ]
    return notes, crossings


def _touching(model: mujoco.MjModel, data: mujoco.MjData, qpos: FloatArray) -> dict[tuple[int, int], float]:
    data.qpos = qpos
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    found: dict[tuple[int, int], float] = {}
    for contact in data.contact[: data.ncon]:
        if contact.dist < -TOUCHING:
            pair = (int(min(contact.geom)), int(max(contact.geom)))
            found[pair] = max(found.get(pair, 0.0), -float(contact.dist))
    return found


def _pair(model: mujoco.MjModel, pair: tuple[int, int]) -> str:
    obj = mujoco.mjtObj
    names = []
    for geom in pair:
        body = mujoco.mj_id2name(model, obj.mjOBJ_BODY, int(model.geom_bodyid[geom])) or "a body without a name"
        own = mujoco.mj_id2name(model, obj.mjOBJ_GEOM, geom)
        names.append(f'geom "{own}" of {body}' if own else f"a geom of {body}")
    return " and ".join(names)


def _name(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    return mujoco.mj_id2name(model, kind, int(index)) or f"#{index}"
