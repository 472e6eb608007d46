"""What the reference has to know of a compiled MJCF: actuated and passive freedoms, loop closures, idle spins.

Names are resolved here, once; whatever the projection does not cover is refused here, all of it at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.dry_friction import direction
from workbench.errors import ModelError
from workbench.limits import MOST_FREEDOMS
from workbench.mjcf.compile import custom_text
from workbench.mjcf.lines import with_lines
from workbench.mjcf.refusal import Refusal, joined
from workbench.reference.closures import Closures, fixed_tendons, name_of, read_closures
from workbench.reference.frames import Frames
from workbench.reference.kinds import CONNECT, JOINT, ROWS, SPIN, TENDON, WELD
from workbench.reference.rods import ROUND, Rod, RodFrame, idle_rods, refuse_rod, spin_block
from workbench.reference.uncovered import switched_off, uncovered
from workbench.robots.load import LoadedModel

__all__ = ["CONNECT", "JOINT", "ROWS", "SPIN", "TENDON", "WELD", "Structure", "read_structure", "refusals_of"]

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

MOST = 1e-6
"""m, or of the robot's size where that is more: how far from a rod's axis a platform site on it may lie."""


@dataclass(frozen=True)
class Friction:
    """Dry friction, in MuJoCo a constraint, so that neither bias nor passive forces hold it; zero where it is off."""

    actuated: FloatArray
    """``(na,)`` N or N m"""
    passive: FloatArray
    """``(nv,)``; zero at the actuated joints"""
    tendon: FloatArray
    """``(k,)`` of those fixed tendons that have any"""
    tendon_rows: FloatArray
    """``(k, nv)`` their speeds per velocity"""

    @property
    def inside(self) -> bool:
        """Whether any of it acts elsewhere than at actuated joints."""
        return bool(self.passive.any() or len(self.tendon))

    def force(self, qvel: FloatArray) -> FloatArray:
        """Generalized force ``(n, nv)`` of passive joints and tendons at velocities ``(n, nv)``; none at rest."""
        found: FloatArray = -self.passive * direction(qvel)
        if len(self.tendon):
            found -= (self.tendon * direction(qvel @ self.tendon_rows.T)) @ self.tendon_rows
        return found


@dataclass(frozen=True)
class Structure:
    """Tables of one model; ``blocks`` is ``(k, 5)``: kind, body 1, body 2, site 1, site 2 (joints for JOINT)."""

    file: str
    actuated: IntArray
    """velocity addresses of the actuated joints, in actuator order"""
    actuated_qpos: IntArray
    passive: IntArray
    joint_names: tuple[str, ...]
    dof_names: tuple[str, ...]
    blocks: IntArray
    block_names: tuple[str, ...]
    block_rows: IntArray
    polynomials: FloatArray
    """``(k, 5)`` coefficients of joint equalities"""
    moves: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    """``(nbody, nv)``: does the velocity move the body"""
    root: IntArray
    base: int
    platform_site: int
    idle: tuple[str, ...]
    """bodies whose spin about their own axis is idle"""
    home_qpos: FloatArray
    columns: IntArray = field(repr=False)
    """for each velocity its place among the passive ones, or -1"""
    frames: Frames = field(repr=False)
    """of closures by bodies, numbered after the model's sites"""
    tendons: FloatArray = field(repr=False)
    """``(ntendon, njnt)`` coefficients of fixed tendons"""
    friction: Friction = field(repr=False)
    rods: tuple[Rod, ...] = field(repr=False)
    """the rods of `idle`"""
    notes: tuple[str, ...] = ()
    """what a reader of the results should know of the model, one line each"""
    lopsided: tuple[Rod, ...] = ()
    """rods that are no bodies of revolution, to six digits"""
    joints_at: bytes = b""
    """anchors and axes of all joints: with the tree, what rods there are follows from them"""

    @property
    def rows(self) -> int:
        """Number of constraint rows, spin rows included."""
        return int(self.block_rows[-1])

    @property
    def loop_rows(self) -> int:
        """Number of rows of the loop closures alone."""
        return self.rows - len(self.idle)


def refusals_of(model: mujoco.MjModel) -> list[Refusal]:
    """Everything for which no right torque can be given, without raising; empty where the model can be read."""
    return _read(model).refusals


@dataclass(frozen=True)
class _Found:
    """What is read of a model before anything is refused."""

    closures: Closures
    base: int
    site: int
    judged: list[tuple[Rod, Refusal | None, str]]
    refusals: list[Refusal]


def _read(model: mujoco.MjModel, known: Structure | None = None) -> _Found:
    closures = read_closures(model)
    found = uncovered(model, closures)
    if not model.nu:
        found.append(
            Refusal(
                "no actuator",
                "actuator",
                "",
                "a motor says which joint is actuated, or a campaign does (actuated)",
                "no actuator",
            )
        )
    base, missing = _named(model, mujoco.mjtObj.mjOBJ_BODY, "base_body", "body")
    site, lost = _named(model, mujoco.mjtObj.mjOBJ_SITE, "platform_site", "site")
    judged = _judged(model, closures, site, _rods(model, closures, known))
    return _Found(closures, base, site, judged, found + missing + lost + [r for _, r, _ in judged if r is not None])


def structure_of(loaded: LoadedModel, known: Structure | None = None) -> Structure:
    """`read_structure` of a loaded file; what is refused stands on its line.

    *known* is the structure of another model of the same family, `LoadedModel.family`.

    Raises
    ------
    ModelError
        As `read_structure`.
    """
    try:
        return read_structure(loaded.model, loaded.file, known)
    except ModelError as error:
        raise (with_lines(error, loaded.prepared.source) if loaded.prepared else error) from None


def read_structure(model: mujoco.MjModel, file: str, known: Structure | None = None) -> Structure:
    """Resolve the tables of *model*; names and tree are those of *known*, where that is given.

    Raises
    ------
    ModelError
        Something the projection does not cover (contacts, limits, spatial tendons' equalities ...). The message joins
        all of it; ``error.facts["refusals"]`` holds one `Refusal` each.
    """
    refuse_large(model, file)
    found = _read(model, known)
    if found.refusals:
        raise joined(file, found.refusals)
    if known is not None and _made_alike(known, found):
        return _with_numbers(known, model, found)
    obj = mujoco.mjtObj
    joints = [int(model.actuator_trnid[a, 0]) for a in range(model.nu)]
    actuated = np.array([model.jnt_dofadr[j] for j in joints], dtype=np.int64)
    moves = np.zeros((model.nbody, model.nv), dtype=np.bool_)
    for body in range(1, model.nbody):
        moves[body] = moves[model.body_parentid[body]]
        first = model.body_dofadr[body]
        if first >= 0:
            moves[body, first : first + model.body_dofnum[body]] = True
    closures, site, judged = found.closures, found.site, found.judged
    rods = tuple(rod for rod, _, _ in judged)
    blocks = [*closures.blocks, *(spin_block(rod) for rod in rods)]
    idle = tuple(name_of(model, obj.mjOBJ_BODY, rod.body) for rod in rods)
    passive = np.array([d for d in range(model.nv) if d not in set(actuated.tolist())], dtype=np.int64)
    columns = np.full(model.nv, -1, dtype=np.int64)
    columns[passive] = np.arange(len(passive))
    tendons = fixed_tendons(model)
    return Structure(
        file=file,
        actuated=actuated,
        actuated_qpos=np.array([model.jnt_qposadr[j] for j in joints], dtype=np.int64),
        passive=passive,
        joint_names=tuple(name_of(model, obj.mjOBJ_JOINT, j) for j in joints),
        dof_names=tuple(name_of(model, obj.mjOBJ_JOINT, model.dof_jntid[d]) for d in range(model.nv)),
        blocks=np.array(blocks, dtype=np.int64).reshape(-1, 5),
        block_names=(*closures.names, *(f"spin of {name}" for name in idle)),
        block_rows=np.concatenate([[0], np.cumsum([ROWS[b[0]] for b in blocks])]).astype(np.int64),
        polynomials=np.array([*closures.polynomials, *(np.zeros(5) for _ in rods)], dtype=np.float64).reshape(-1, 5),
        moves=moves,
        root=np.array(model.body_rootid, dtype=np.int64),
        base=found.base,
        platform_site=site,
        idle=idle,
        home_qpos=_drawn(model),
        columns=columns,
        frames=Frames.of(closures.frames),
        tendons=tendons,
        friction=_friction(model, actuated, tendons),
        rods=rods,
        notes=tuple(note for _, _, note in judged if note),
        lopsided=tuple(rod for rod, _, note in judged if note),
        joints_at=_joints_at(model),
    )


def _joints_at(model: mujoco.MjModel) -> bytes:
    return bytes(model.jnt_pos.tobytes() + model.jnt_axis.tobytes())


def _rods(model: mujoco.MjModel, closures: Closures, known: Structure | None) -> Sequence[Rod]:
    """The model's idle rods: the known ones where the same joints stand in the same places."""
    if known is not None and known.joints_at == _joints_at(model):
        loops = len(known.blocks) - len(known.rods)
        if known.blocks[:loops].tolist() == [list(block) for block in closures.blocks]:
            return known.rods
    return idle_rods(model, closures.blocks)


def _drawn(model: mujoco.MjModel) -> FloatArray:
    home = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, "home")
    return np.array(model.key_qpos[home] if home >= 0 else model.qpos0, dtype=np.float64)


def _made_alike(known: Structure, found: _Found) -> bool:
    """Whether closures and rods are the known ones: which they are, too, follows from numbers in places."""
    blocks = [*found.closures.blocks, *(spin_block(rod) for rod, _, _ in found.judged)]
    same = known.blocks.tolist() == [list(block) for block in blocks]
    return same and tuple(rod for rod, _, _ in found.judged) == known.rods


def _with_numbers(known: Structure, model: mujoco.MjModel, found: _Found) -> Structure:
    """All that follows from a model's numbers, read anew."""
    zeros = [np.zeros(5) for _ in known.rods]
    tendons = fixed_tendons(model)
    return replace(
        known,
        polynomials=np.array([*found.closures.polynomials, *zeros], dtype=np.float64).reshape(-1, 5),
        home_qpos=_drawn(model),
        frames=Frames.of(found.closures.frames),
        tendons=tendons,
        friction=_friction(model, known.actuated, tendons),
        notes=tuple(note for _, _, note in found.judged if note),
        lopsided=tuple(rod for rod, _, note in found.judged if note),
        joints_at=_joints_at(model),
    )


def refuse_large(model: mujoco.MjModel, file: str) -> None:
    """Refuse a file of so many joints that no answer would come in sensible time.

    Raises
    ------
    ModelError
        More freedoms than `limits.MOST_FREEDOMS`.
    """
    if model.nv > MOST_FREEDOMS:
        raise ModelError(
            f"{file}: joints with {model.nv} freedoms; allowed: {MOST_FREEDOMS}; weld parts together, or take joints"
            " out that the mechanism does not need",
            file=file,
            value=model.nv,
            limit=MOST_FREEDOMS,
        )


def _named(model: mujoco.MjModel, kind: mujoco.mjtObj, key: str, element: str) -> tuple[int, list[Refusal]]:
    name = custom_text(model, key)
    if name is None:
        return -1, [Refusal(f'<custom> has no <text name="{key}">', "text", key, f"it names the {element}", key)]
    index = int(mujoco.mj_name2id(model, kind, name))
    if index >= 0:
        return index, []
    return -1, [
        Refusal(
            f'<text name="{key}"> names {element} "{name}", which does not exist',
            "text",
            key,
            "name one that does",
            key,
        )
    ]


def _friction(model: mujoco.MjModel, actuated: IntArray, tendons: FloatArray) -> Friction:
    on = 0.0 if switched_off(model, "frictionloss") else 1.0
    dry = on * np.array(model.dof_frictionloss)
    passive = dry.copy()
    passive[actuated] = 0.0
    rubbing = on * np.array(model.tendon_frictionloss).reshape(-1)
    kept = np.flatnonzero(rubbing * np.abs(tendons).sum(axis=1)) if len(rubbing) else np.zeros(0, dtype=np.int64)
    rows = np.zeros((len(kept), model.nv))
    for row, tendon in enumerate(kept):
        for joint in np.flatnonzero(tendons[tendon]):
            rows[row, model.jnt_dofadr[joint]] += tendons[tendon, joint]
    return Friction(dry[actuated], passive, rubbing[kept], rows)


def _judged(
    model: mujoco.MjModel, closures: Closures, site: int, rods: Sequence[Rod]
) -> list[tuple[Rod, Refusal | None, str]]:
    """Idle rods, each with what stands against it and what is to be said of it."""
    if not rods:
        return []
    frames = Frames.of(closures.frames)
    platform = int(model.site_bodyid[site]) if site >= 0 else -1
    wet = bool(model.opt.density or model.opt.viscosity)
    found: list[tuple[Rod, Refusal | None, str]] = []
    for rod in rods:
        shape = RodFrame(model, rod, frames)
        if platform not in rod.group and not wet and shape.plainly_round():
            found.append((rod, None, ""))
            continue
        uneven = shape.unevenness()
        name = name_of(model, mujoco.mjtObj.mjOBJ_BODY, rod.body)
        refusal = refuse_rod(model, rod, uneven) or _off_axis(model, rod, shape, site) or _in_fluid(model, name)
        note = (
            f"rod {name}: no body of revolution about the line between its spherical joints (mass centre"
            f" {uneven.off:.3g} m off it, moments of inertia unlike by {uneven.uneven:.3g} kg m^2); its spin is held at"
            " zero, by a moment that no actuator gives; what that is worth in torque is in the error budget"
            if uneven.beyond(ROUND)
            else ""
        )
        found.append((rod, refusal, note))
    return found


def _in_fluid(model: mujoco.MjModel, name: str) -> Refusal | None:
    """MuJoCo's fluid sees a box in place of a body, so that its force depends on a spin that nothing determines."""
    if not (model.opt.density or model.opt.viscosity):
        return None
    return Refusal(
        f'a fluid acts on rod "{name}", which hangs between two spherical joints; its force depends on how far the rod'
        " has turned about its own axis, which nothing determines",
        "option",
        "density" if model.opt.density else "viscosity",
        "set density and viscosity to zero, or put two hinges in place of one of the spherical joints",
        "fluid on a rod",
    )


def _off_axis(model: mujoco.MjModel, rod: Rod, shape: RodFrame, site: int) -> Refusal | None:
    """The platform must not ride on a rod's idle spin."""
    body = int(model.site_bodyid[site]) if site >= 0 else -1
    if body not in rod.group:
        return None
    off = shape.off_axis(body, np.array(model.site_pos[site]))
    if off <= MOST * max(1.0, shape.length):
        return None
    name = name_of(model, mujoco.mjtObj.mjOBJ_SITE, site)
    held = name_of(model, mujoco.mjtObj.mjOBJ_BODY, rod.body)
    return Refusal(
        f'platform site "{name}" lies {off:.3g} m off the axis of rod "{held}", about which nothing keeps it from'
        " turning",
        "site",
        name,
        "choose a site on the axis, or on another body",
        "platform on a rod",
    )
