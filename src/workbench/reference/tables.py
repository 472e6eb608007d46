"""A model's structure as the kernels take it: tuples of arrays, in the order in which the kernels unpack them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from workbench.reference.structure import Structure

BALL = 1
"""Kind of a joint in the tables; hinges and slides are 0."""


@dataclass(frozen=True)
class Tables:
    """What stays the same over all samples of a model."""

    closures: tuple[Any, ...]
    """blocks, first row of each, polynomials, root body of each body, velocities that move each body, how many"""
    joints: tuple[Any, ...]
    """kind, position address and velocity address of each joint"""
    split: tuple[Any, ...]
    """passive and actuated velocity addresses"""
    bodies: tuple[Any, ...]
    """parent, root, first velocity address and number of velocities of each body"""


def tables_of(model: mujoco.MjModel, structure: Structure) -> Tables:
    """Collect the tables of one model."""
    depth = structure.moves.sum(axis=1).astype(np.int64)
    moving = np.zeros((model.nbody, max(1, int(depth.max(initial=0)))), dtype=np.int64)
    for body, moves in enumerate(structure.moves):
        moving[body, : depth[body]] = np.flatnonzero(moves)
    ball = mujoco.mjtJoint.mjJNT_BALL.value
    return Tables(
        closures=(structure.blocks, structure.block_rows, structure.polynomials, structure.root, moving, depth),
        joints=(
            np.where(np.asarray(model.jnt_type) == ball, BALL, 0).astype(np.int64),
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
