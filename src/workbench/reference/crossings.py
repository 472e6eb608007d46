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
from workbench.reference.left_out import MOST_POSES, limits_left, touches
from workbench.reference.mujoco_reference import MujocoReference
from workbench.reference.result import ReferenceResult

INSIDE = 1e-9
"""m or rad by which a limit may be passed"""

TOUCHING = 1e-9
"""m by which geoms have to overlap"""

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
    poses = user_qpos(user, prepared.model, free, result.qpos)
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
    home = reference.structure.home_qpos[None]
    drawn: FloatArray = user_qpos(user, prepared.model, prepared.preparation.free, home)[0]
    return drawn


def _disabled(model: mujoco.MjModel, flag: str) -> bool:
    return bool(model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}").value)


def _limits(user: mujoco.MjModel, poses: FloatArray) -> tuple[int, list[Crossing]]:
    """How many limits there are, and those that the poses ``(n, nq)`` leave."""
    if _disabled(user, "limit") or not len(poses):
        return 0, []
    count = int(np.count_nonzero(user.jnt_limited)) + int(np.count_nonzero(user.tendon_limited))
    return count, [
        Crossing(
            "limits",
            found.sample,
            f'{found.element} "{found.name}" reaches {found.value:.4g} {found.unit}, its range is {found.lower:.4g} to'
            f" {found.upper:.4g} {found.unit}".rstrip(),
        )
        for found in limits_left(user, poses)
        if max(found.lower - found.value, found.value - found.upper) > INSIDE
    ]


def _contacts(user: mujoco.MjModel, poses: FloatArray, home: FloatArray) -> tuple[list[str], list[Crossing]]:
    """What to say of contacts, and pairs of geoms that come to touch although they do not at home."""
    if _disabled(user, "contact") or not len(poses):
        return [], []
    if not (user.geom_contype | user.geom_conaffinity).any() and not user.npair:
        return [], []
    before = [(one.one, one.two) for one in touches(user, home[None]) if one.depth > TOUCHING]
    known = set(before)
    new = [one for one in touches(user, poses) if one.depth > TOUCHING and (one.one, one.two) not in known]
    looked = min(len(poses), MOST_POSES)
    notes = []
    if before:
        shown = ", ".join(_pair(user, pair) for pair in before[:NAMED])
        more = f" and {len(before) - NAMED} more" if len(before) > NAMED else ""
        notes.append(f"contacts are left out; in the home pose these touch already: {shown}{more}")
    if not new:
        notes.append(
            f"contacts are left out; nothing {'else ' if before else ''}touches at {looked} poses of the motion"
        )
    crossings = [
        Crossing("contacts", one.sample, f"{_pair(user, (one.one, one.two))} touch, {one.depth:.2g} m deep")
        for one in sorted(new, key=lambda one: one.sample)
    ]
    return notes, crossings


def _pair(model: mujoco.MjModel, pair: tuple[str, str]) -> str:
    """Geoms by their names and bodies; one without a name is ``#3``."""
    texts = []
    for name in pair:
        geom = int(name[1:]) if name.startswith("#") and name[1:].isdecimal() else model.geom(name).id
        body = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, int(model.geom_bodyid[geom]))
        own = f'geom "{name}"' if model.geom(geom).name else "a geom"
        texts.append(f"{own} of {body or 'a body without a name'}")
    return " and ".join(texts)
