"""Names of the joint reactions that the projection computes, in the order in which it stores them."""

from __future__ import annotations

import mujoco

from workbench.arrays import FloatArray
from workbench.reference.projection import is_site_closure
from workbench.reference.structure import Structure


def reaction_rows(model: mujoco.MjModel, structure: Structure) -> dict[str, int]:
    """Return where the kernel puts each reaction: loop closures first, then one row for each body but the world.

    The force at a joint is what the parent exerts on the child: mass times acceleration less weight of everything
    beyond the joint, less what loop closures and the external force exert there. At a loop closure it is the
    least-norm multiplier, which the second site's body exerts on the first's; where rows are redundant the split
    between them is not determined by rigid-body mechanics.
    """
    loops = [name for k, name in enumerate(structure.block_names) if is_site_closure.py_func(structure.blocks, k)]
    rows = {name: row for row, name in enumerate(loops)}
    for joint in range(model.njnt):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint) or f"joint{joint}"
        rows[name] = len(loops) + int(model.jnt_bodyid[joint]) - 1
    return rows


def named(rows: dict[str, int], reactions: FloatArray) -> dict[str, FloatArray]:
    """Return the forces ``(n, 3)`` by name from the kernel's array."""
    return {name: reactions[row] for name, row in rows.items()}
