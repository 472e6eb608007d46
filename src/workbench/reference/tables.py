"""A model's structure as the kernels take it: tuples of arrays, in the order in which the kernels unpack them."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, NamedTuple

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.reference.kinds import BALL, FREE, SCALAR
from workbench.reference.structure import IntArray, Structure

KINDS = {mujoco.mjtJoint.mjJNT_BALL: BALL, mujoco.mjtJoint.mjJNT_FREE: FREE}


class ClosureTables(NamedTuple):
    """What rows are made of; kernels read it by name, so that a further kind of closure may bring its own table."""

    blocks: IntArray
    """``(k, 5)``, see `Structure`"""
    block_rows: IntArray
    """``(k + 1,)`` first row of each block, and their number"""
    polynomials: FloatArray
    root: IntArray
    """``(nbody,)`` root of the tree that holds each body"""
    moving: IntArray
    """``(nbody, most)`` velocities that move each body"""
    depth: IntArray
    """``(nbody,)`` how many they are"""
    tendons: FloatArray
    """``(ntendon, njnt)`` coefficients of fixed tendons"""


@dataclass(frozen=True)
class Tables:
    """What stays the same over all samples of a model."""

    closures: ClosureTables
    joints: tuple[Any, ...]
    """kind, position address and velocity address of each joint"""
    split: tuple[Any, ...]
    """passive and actuated velocity addresses"""
    bodies: tuple[Any, ...]
    """parent, root, first velocity address and number of velocities of each body"""


def tables_of(model: mujoco.MjModel, structure: Structure, known: Tables | None = None) -> Tables:
    """Collect the tables of one model; *known* are those of another one with the same tree and the same closures."""
    if known is not None and known.closures.blocks is structure.blocks:
        split = structure.passive, structure.actuated
        closures = known.closures._replace(polynomials=structure.polynomials, tendons=structure.tendons)
        return dataclasses.replace(known, closures=closures, split=split)
    depth = structure.moves.sum(axis=1).astype(np.int64)
    moving = np.zeros((model.nbody, max(1, int(depth.max(initial=0)))), dtype=np.int64)
    for body, moves in enumerate(structure.moves):
        moving[body, : depth[body]] = np.flatnonzero(moves)
    kinds = [KINDS.get(mujoco.mjtJoint(kind), SCALAR) for kind in model.jnt_type]
    return Tables(
        closures=ClosureTables(
            structure.blocks,
            structure.block_rows,
            structure.polynomials,
            structure.root,
            moving,
            depth,
            structure.tendons,
        ),
        joints=(
            np.array(kinds, dtype=np.int64),
            np.array(model.jnt_qposadr, dtype=np.int64),
            np.array(model.jnt_dofadr, dtype=np.int64),
        ),
        split=(structure.passive, structure.actuated),
        bodies=(
            np.array(model.body_parentid, dtype=np.int64),
            structure.root,
            np.array(model.body_dofadr, dtype=np.int64),
            np.array(model.body_dofnum, dtype=np.int64),
        ),
    )
