"""What a real file is, seen by MuJoCo alone: its loops closed, its freedoms, which joints could drive it.

Nothing here is the reference's own: loops are closed by least-squares steps on MuJoCo's constraint Jacobian, so that a
file can be looked at that the reference would refuse, and a campaign be proposed for it.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.mjcf.engine_warnings import engine_warnings
from workbench.mjcf.free_joints import floating_bases, held_roots

STEPS = 100
STARTS = 12
"""poses tried where the drawing cannot be closed from where it is"""
CLOSED = 1e-12
LOOSE = 1e-7
"""A singular value of the constraint Jacobian below this fraction of the largest one counts as zero."""

INDEPENDENT = 1e-6
"""How much of a motion a joint must take part in to be counted as its driver."""

ALONE = 1e-12
"""A column shorter than one by less belongs to a joint that no loop ties to another."""

ROUNDING = 1e-9
"""Shares of joints in a motion that differ by less are equal."""

SHARE = 0.1
"""How much, of the most active joint, a joint near the base must take part in a motion to be preferred."""

FREE, BALL = mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL
SCALAR = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)


@dataclass(frozen=True)
class Survey:
    """A file as MuJoCo sees it."""

    bodies: int
    joints: int
    loops: int
    """active equalities"""
    rows: int
    rank: int
    mobility: int
    """freedoms that the loops leave, idle spins counted; bodies that stand still not"""
    residual: float
    """largest open loop coordinate after closing, in MuJoCo's own units"""
    qpos: FloatArray
    """``(nq,)`` the closed pose, user's coordinates"""
    fix_base: str
    loose: tuple[str, ...]
    """bodies on free joints that no loop holds"""
    actuated: tuple[str, ...]
    dropped: tuple[str, ...]
    """joints that the file drives, and that follow from the others"""
    added: tuple[str, ...]
    """joints that the file does not drive, without which the motion is not determined"""
    undriven: int
    """freedoms that no hinge or slide can drive: spins of rods"""
    nameless: tuple[str, ...]
    """hinges and slides, with their bodies, that could drive some of these if they had names"""


@engine_warnings()
def survey(model: mujoco.MjModel, wanted: tuple[str, ...] = ()) -> Survey:
    """Look at a compiled file.

    Parameters
    ----------
    model
        The user's model.
    wanted
        Joints to drive; empty: those of the file's own actuators, as many as are independent, and what they leave.
    """
    fix_base, loose, still = _standing(model)
    qpos, jacobian, residual = _closed(model, still)
    moving = np.setdiff1d(np.arange(model.nv), still)
    rank, motions = _motions(jacobian[:, moving])
    candidates = list(wanted) or _file_joints(model)
    dofs = {_joint(model, j): int(model.jnt_dofadr[j]) for j in range(model.njnt) if _scalar(model, j)}
    place = {int(dof): column for column, dof in enumerate(moving)}
    able = {name: place[dof] for name, dof in dofs.items() if dof in place}
    rest = _Rest(motions)
    chosen: list[str] = []
    dropped: list[str] = []
    for name in candidates:
        if name not in able:
            continue
        if rest.take(able[name]) or wanted:
            chosen.append(name)
        else:
            dropped.append(name)
    added: list[str] = []
    if not wanted:
        names, columns = list(able), np.array(list(able.values()), dtype=np.int64)
        depths = np.array([_depth(model, dofs[name]) for name in names], dtype=np.int64)
        while rest.freedoms:
            best = _nearest_to_base(rest.scores[columns], depths)
            if best < 0 or not rest.take(int(columns[best])):
                break
            added.append(names[best])
        chosen += added
    loops = int(np.count_nonzero(model.eq_active0)) if model.neq else 0
    nameless = _nameless(model, place) if rest.freedoms else ()
    return Survey(
        bodies=model.nbody - 1, joints=model.njnt, loops=loops, rows=len(jacobian), rank=rank, mobility=len(motions),
        residual=residual, qpos=qpos, fix_base=fix_base, loose=loose, actuated=tuple(chosen), dropped=tuple(dropped),
        added=tuple(added), undriven=rest.freedoms, nameless=nameless,
    )  # fmt: skip


def _nameless(model: mujoco.MjModel, place: dict[int, int]) -> tuple[str, ...]:
    obj = mujoco.mjtObj
    return tuple(
        f"#{j} of body {mujoco.mj_id2name(model, obj.mjOBJ_BODY, int(model.jnt_bodyid[j]))}"
        for j in range(model.njnt)
        if mujoco.mjtJoint(model.jnt_type[j]) in SCALAR
        and not mujoco.mj_id2name(model, obj.mjOBJ_JOINT, j)
        and int(model.jnt_dofadr[j]) in place
    )


def _depth(model: mujoco.MjModel, dof: int) -> int:
    """How many bodies lie between the world and the one that a velocity moves."""
    body, depth = int(model.dof_bodyid[dof]), 0
    while body:
        body, depth = int(model.body_parentid[body]), depth + 1
    return depth


class _Rest:
    """The motions ``(f, n)``, orthonormal, in which the joints taken so far rest: a step of Gram and Schmidt for each.

    What a joint does is its column. A joint that no loop ties to another has a column of length one, at right angles to
    all others, and costs nothing.
    """

    def __init__(self, motions: FloatArray) -> None:
        self._motions = motions
        self._squares = np.einsum("ij,ij->j", motions, motions)
        self._taken = np.zeros((0, len(motions)))  # grows by doubling
        self._count = 0
        self.freedoms = len(motions)
        """how many motions are left"""

    @property
    def scores(self) -> FloatArray:
        """How much each joint takes part in what is left, ``(n,)``, 0 to 1."""
        found: FloatArray = np.sqrt(np.maximum(self._squares, 0.0))
        return found

    def take(self, column: int) -> bool:
        """Let a joint rest, too; False where what is left does not move it."""
        way = self._motions[:, column]
        if self._squares[column] > 1.0 - ALONE:
            self._squares[column] = 0.0
            self.freedoms -= 1
            return True
        for _ in range(2):  # twice is enough for right angles
            taken = self._taken[: self._count]
            way = way - taken.T @ (taken @ way)
        length = float(np.linalg.norm(way))
        if length <= INDEPENDENT:
            self._squares[column] = 0.0
            return False
        if self._count == len(self._taken):
            more = np.zeros((max(8, self._count), len(way)))
            self._taken = np.vstack([self._taken, more])
        self._taken[self._count] = way / length
        self._count += 1
        self._squares -= (way / length @ self._motions) ** 2
        self._squares[column] = 0.0
        self.freedoms -= 1
        return True


def _nearest_to_base(scores: FloatArray, depths: np.ndarray) -> int:
    """Of joints that take part well, the one nearest to the base, where motors are; -1 where none does."""
    most = float(scores.max(initial=0.0))
    if most < INDEPENDENT:
        return -1
    able = scores > SHARE * most
    near = able & (depths == depths[able].min())
    # equal but for rounding: the first of the file
    return int(np.argmax(near & (scores >= scores[near].max() - ROUNDING)))


def _standing(model: mujoco.MjModel) -> tuple[str, tuple[str, ...], np.ndarray]:
    """The base to be fixed, loose bodies, and the velocities of both."""
    held, loops = held_roots(model), _loop_bodies(model)
    driven = {int(model.jnt_bodyid[j]) for j in _driven(model)}
    base, loose, still = "", [], []
    floating = floating_bases(model)
    for body in range(1, model.nbody):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body) or ""
        joint = int(model.body_jntadr[body])
        free = joint >= 0 and mujoco.mjtJoint(model.jnt_type[joint]) == FREE
        if body in held or not (free or (name and name in floating)):
            continue
        inside = {b for b in range(model.nbody) if model.body_rootid[b] == body}
        if not base and name and inside & (loops | driven):
            base = name
        elif free:
            loose.append(name or f"#{body}")
        else:
            continue
        still += list(range(int(model.body_dofadr[body]), int(model.body_dofadr[body]) + 6))
    return base, tuple(loose), np.array(still, dtype=np.int64)


def _loop_bodies(model: mujoco.MjModel) -> set[int]:
    found: set[int] = set()
    for eq in range(model.neq):
        kind, ends = mujoco.mjtEq(model.eq_type[eq]), (int(model.eq_obj1id[eq]), int(model.eq_obj2id[eq]))
        if kind == mujoco.mjtEq.mjEQ_JOINT:
            found |= {int(model.jnt_bodyid[end]) for end in ends if end >= 0}
        elif kind in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
            site = mujoco.mjtObj(model.eq_objtype[eq]) == mujoco.mjtObj.mjOBJ_SITE
            found |= {int(model.site_bodyid[end]) if site else end for end in ends}
    return found


def _driven(model: mujoco.MjModel) -> list[int]:
    """Joints of the file's own actuators, in their order; of a tendon the joints that it winds."""
    transmission = mujoco.mjtTrn
    found: list[int] = []
    for actuator in range(model.nu):
        kind, target = mujoco.mjtTrn(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
        if kind in (transmission.mjTRN_JOINT, transmission.mjTRN_JOINTINPARENT):
            found.append(target)
        elif kind == transmission.mjTRN_TENDON:
            first = int(model.tendon_adr[target])
            wraps = range(first, first + int(model.tendon_num[target]))
            joint = mujoco.mjtWrap.mjWRAP_JOINT
            found += [int(model.wrap_objid[w]) for w in wraps if mujoco.mjtWrap(model.wrap_type[w]) == joint]
    return [joint for joint in dict.fromkeys(found) if _scalar(model, joint)]


def _file_joints(model: mujoco.MjModel) -> list[str]:
    return [_joint(model, joint) for joint in _driven(model)]


def _scalar(model: mujoco.MjModel, joint: int) -> bool:
    named = bool(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint))
    return named and mujoco.mjtJoint(model.jnt_type[joint]) in SCALAR


def _joint(model: mujoco.MjModel, joint: int) -> str:
    return mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint) or f"#{joint}"


def _closed(model: mujoco.MjModel, still: np.ndarray) -> tuple[FloatArray, FloatArray, float]:
    """A closed pose near the one called home, its constraint Jacobian ``(m, nv)``, and what stays open.

    Where the way from home ends in a pose that is still open, others are tried, at random and always the same.
    """
    lean = copy.copy(model)
    flags = mujoco.mjtDisableBit
    lean.opt.disableflags |= flags.mjDSBL_CONTACT.value | flags.mjDSBL_LIMIT.value | flags.mjDSBL_FRICTIONLOSS.value
    lean.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data = mujoco.MjData(lean)
    key = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, "home")
    home = np.array(model.key_qpos[key] if key >= 0 else model.qpos0)
    found = _descended(lean, data, home, still)
    random = np.random.default_rng(0)
    for start in range(STARTS):
        if found[2] < OPEN:
            break
        away = random.uniform(-1.0, 1.0, model.nv) * (1.0 + start) / 4.0
        away[still] = 0.0
        qpos = home.copy()
        mujoco.mj_integratePos(lean, qpos, away, 1.0)
        other = _descended(lean, data, qpos, still)
        found = min(found, other, key=lambda one: one[2])
    return found


def _descended(
    lean: mujoco.MjModel, data: mujoco.MjData, qpos: FloatArray, still: np.ndarray
) -> tuple[FloatArray, FloatArray, float]:
    """Follow least-squares steps from *qpos* until the loops are closed or no step helps."""
    data.qpos = qpos
    best, best_jacobian, residual = np.array(qpos), np.zeros((0, lean.nv)), np.inf
    for _ in range(STEPS):
        mujoco.mj_fwdPosition(lean, data)
        equality = np.asarray(data.efc_type) == mujoco.mjtConstraint.mjCNSTR_EQUALITY.value
        jacobian = np.array(data.efc_J).reshape(-1)[: len(equality) * lean.nv].reshape(-1, lean.nv)[equality]
        error = np.array(data.efc_pos)[equality]
        size = float(np.abs(error).max(initial=0.0))
        if size < residual:
            best, best_jacobian, residual = np.array(data.qpos), jacobian, size
        if size < CLOSED or not np.isfinite(size):
            break
        free = jacobian.copy()
        free[:, still] = 0.0
        step = -np.linalg.lstsq(free, error, rcond=1e-8)[0]
        longest = float(np.abs(step).max(initial=0.0))
        mujoco.mj_integratePos(lean, data.qpos, step * min(1.0, 0.2 / longest if longest else 1.0), 1.0)
    return best, best_jacobian, residual


def _motions(jacobian: FloatArray) -> tuple[int, FloatArray]:
    """Rank, and an orthonormal basis ``(f, n)`` of the motions that the loops leave."""
    if not len(jacobian):
        return 0, np.eye(jacobian.shape[1])
    values, vectors = np.linalg.svd(jacobian, full_matrices=True)[1:]
    rank = int(np.count_nonzero(values > LOOSE * values.max(initial=0.0)))
    return rank, vectors[rank:]


@dataclass(frozen=True)
class Places:
    """What of a file could be named in a campaign."""

    site: str
    """the platform, as a site; empty: `body` is"""
    body: str
    initial: tuple[tuple[str, float], ...]
    """hinges and slides that are elsewhere in the closed pose than where the file begins"""
    moving: tuple[str, ...]
    """bodies that move and weigh, the heaviest first"""
    ranges: dict[str, tuple[float, float]]
    """of limited hinges and slides"""
    extent: float
    """size of the model, m"""


NAMES = ("platform", "effector", "ee", "tcp", "tool", "pinch", "tip", "foot", "hand", "attachment", "end")


def places(model: mujoco.MjModel, seen: Survey) -> Places:
    """Look for the platform, the first guess and parameters."""
    obj = mujoco.mjtObj
    key = mujoco.mj_name2id(model, obj.mjOBJ_KEY, "home")
    begin = model.key_qpos[key] if key >= 0 else model.qpos0
    initial, ranges = [], {}
    for joint in range(model.njnt):
        if not _scalar(model, joint):
            continue
        at, name = int(model.jnt_qposadr[joint]), _joint(model, joint)
        if seen.residual < OPEN and abs(seen.qpos[at] - begin[at]) > SHIFTED:
            initial.append((name, float(f"{seen.qpos[at]:.9g}")))
        limited = model.jnt_limited[joint] and not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_LIMIT.value
        if limited:
            ranges[name] = (float(model.jnt_range[joint, 0]), float(model.jnt_range[joint, 1]))
    moves = [bool(model.body_dofnum[model.body_rootid[b]] or _above(model, b)) for b in range(model.nbody)]
    bodies = [b for b in range(1, model.nbody) if moves[b] and mujoco.mj_id2name(model, obj.mjOBJ_BODY, b)]
    loops = _loop_bodies(model)
    site, score = "", -1
    for index in range(model.nsite):
        name = mujoco.mj_id2name(model, obj.mjOBJ_SITE, index)
        body = int(model.site_bodyid[index])
        if name and moves[body]:
            found = (body in loops) + 4 * any(word in name.lower() for word in NAMES)
            if found > score:
                site, score = name, found
    held = held_roots(model)
    named = sorted(bodies, key=lambda b: (b in held and bool(model.body_dofnum[b] == 6), b in loops, b), reverse=True)
    platform = str(mujoco.mj_id2name(model, obj.mjOBJ_BODY, named[0])) if named else "world"
    heavy = sorted(bodies, key=lambda b: -float(model.body_mass[b]))
    names = tuple(mujoco.mj_id2name(model, obj.mjOBJ_BODY, b) for b in heavy if model.body_mass[b] > 0)
    return Places(site, platform, tuple(initial), names, ranges, float(model.stat.extent))


SHIFTED = 1e-6
"""m or rad: a joint that the closing of the loops moves by more is part of the first guess"""

OPEN = 1e-6
"""A pose that stays open by more is no first guess."""


def _above(model: mujoco.MjModel, body: int) -> bool:
    """Whether a joint stands between the world and the body."""
    while body:
        if model.body_dofnum[body]:
            return True
        body = int(model.body_parentid[body])
    return False
