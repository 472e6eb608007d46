"""Platform motion and joint reactions from a solved motion: Newton's and Euler's equations of every body."""

from __future__ import annotations

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.reference.engine import Dynamics, Poses
from workbench.reference.structure import SPIN, Structure


def joint_reactions(
    model: mujoco.MjModel,
    structure: Structure,
    poses: Poses,
    dynamics: Dynamics,
    qvel: FloatArray,
    qacc: FloatArray,
    multipliers: FloatArray,
    applied: FloatArray,
    base_rotation: FloatArray,
    base_position: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, dict[str, FloatArray]]:
    """Return x, xd, xdd ``(n, 3)`` of the platform site and the reaction forces ``(n, 3)``, all in the base frame.

    The force at a joint is what the parent exerts on the child: mass times acceleration less weight of everything
    beyond the joint, less what loop closures and the external force exert there. At a loop closure it is the
    least-norm multiplier, which the second site's body exerts on the first's; where rows are redundant the split
    between them is not determined by rigid-body mechanics.
    """
    moves = structure.moves.astype(np.float64)
    spatial_v = np.einsum("bd,nd,ndk->nbk", moves, qvel, poses.cdof)
    spatial_a = np.einsum("bd,nd,ndk->nbk", moves, qvel, dynamics.cdof_dot) + np.einsum(
        "bd,nd,ndk->nbk", moves, qacc, poses.cdof
    )
    com = poses.com[:, structure.root]

    def point(bodies: np.ndarray | slice | int, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        w, v = spatial_v[:, bodies, :3], spatial_v[:, bodies, 3:]
        al, a = spatial_a[:, bodies, :3], spatial_a[:, bodies, 3:]
        arm = points - com[:, bodies]
        velocity = v + np.cross(w, arm)
        return velocity, a + np.cross(al, arm) + np.cross(w, velocity)

    site = structure.platform_site
    platform = int(model.site_bodyid[site])
    position = poses.site_xpos[:, site]
    velocity, acceleration = point(platform, position)

    _, mass_acceleration = point(slice(None), dynamics.body_com)
    force = np.asarray(model.body_mass)[None, :, None] * (mass_acceleration - np.asarray(model.opt.gravity))
    force[:, platform] -= applied
    reactions: dict[str, FloatArray] = {}
    for block, name, row in zip(structure.blocks, structure.block_names, structure.block_rows, strict=False):
        if block[0] == SPIN or block[3] < 0 or block[1] == block[2] == 0:
            continue
        loop = multipliers[:, row : row + 3]
        force[:, block[1]] -= loop
        force[:, block[2]] += loop
        reactions[name] = loop @ base_rotation
    for body in range(model.nbody - 1, 0, -1):
        force[:, model.body_parentid[body]] += force[:, body]
    for joint in range(model.njnt):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint) or f"joint{joint}"
        reactions[name] = force[:, model.jnt_bodyid[joint]] @ base_rotation
    x = (position - base_position) @ base_rotation
    return x, velocity @ base_rotation, acceleration @ base_rotation, reactions
