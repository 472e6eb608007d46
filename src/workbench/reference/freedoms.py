"""Every freedom has to follow from the actuators; where one does not, say which, and whether the pose is to blame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError
from workbench.reference.structure import Structure
from workbench.reference.tolerance import KEY, Tolerance

NEARBY = 1e-2
"""rad or m: how far a pose is moved to see whether a freedom is loose there too."""

SHOWN = 0.1
"""A joint is named when it takes part in a loose motion by more than this fraction of the one that moves most."""

DIGITS_AT_MOST = 1e-2
"""Of the robot's size: a tolerance beyond this is not proposed; the mechanism is another one."""

Reclose = Callable[[FloatArray], FloatArray]
"""A velocity ``(nv,)`` to move the home pose by -> constraint Jacobian ``(m, nv)`` of the closed pose nearest to it."""


def check_freedoms(structure: Structure, jacobian: FloatArray, reclose: Reclose, tolerance: float) -> None:
    """Refuse a mechanism that has freedoms which no actuator holds.

    Parameters
    ----------
    structure
        The mechanism's tables.
    jacobian
        Constraint Jacobian ``(m, nv)`` of the home pose.
    reclose
        The same for a closed pose nearby.
    tolerance
        The fraction of the largest singular value below which one counts as zero, `Tolerance.relative`.

    Raises
    ------
    ModelError
        A freedom is loose: the message gives the joints that move and by how much. Or only this pose is to blame: two
        assembly branches meet in it.
    """
    loose, direction = _loose(structure, jacobian, tolerance)
    if not loose:
        return
    shown = _shown(structure, direction)
    rank = int(np.linalg.matrix_rank(jacobian, tol=tolerance)) if len(jacobian) else jacobian.shape[1]
    null = np.linalg.svd(jacobian, full_matrices=True)[2][rank:]
    ways = [sign * NEARBY * way for way in ([*null, null.sum(axis=0)] if len(null) else []) for sign in (1.0, -1.0)]
    if any(_loose(structure, reclose(way), tolerance)[0] < loose for way in ways):
        raise ModelError(
            f"{structure.file}: two assembly branches meet in the pose from which the loops are closed (there {shown}"
            " can move either way with the actuators at rest); begin from another pose, by a keyframe or initial"
            " coordinates",
            file=structure.file,
        )
    raise ModelError(
        f"{structure.file}: {loose} freedom(s) that no actuator holds: with all of {', '.join(structure.joint_names)}"
        f" at rest, {shown} can still move; add an actuator or a constraint",
        file=structure.file,
        joint=structure.dof_names[structure.passive[int(np.argmax(np.abs(direction)))]],
        direction=direction.tolist(),
    )


def refuse_locked(structure: Structure, jacobian: FloatArray, tolerance: Tolerance) -> None:
    """Refuse loops that leave no freedom; where a few digits are to blame, say with which tolerance they leave one.

    Raises
    ------
    ModelError
        Always.
    """
    values = np.linalg.svd(jacobian, compute_uv=False)
    nearly = 1.5 * float(values[jacobian.shape[1] - 1] / values[0]) * tolerance.size
    way = (
        f"; if axes or anchors in the file agree only to some digits, it needs a closure tolerance of {nearly:.1e} m"
        f' (<text name="{KEY}">)'
        if nearly < DIGITS_AT_MOST * tolerance.size
        else ""
    )
    raise ModelError(
        f"{structure.file}: the loops leave no freedom, so that {', '.join(structure.joint_names)} cannot move;"
        f" take an equality out, or add a joint{way}",
        file=structure.file,
        tolerance=nearly,
    )


def _loose(structure: Structure, jacobian: FloatArray, tolerance: float) -> tuple[int, FloatArray]:
    """Number of passive freedoms that the constraints leave, and one motion ``(np,)`` that they allow."""
    passive = jacobian[:, structure.passive]
    if not passive.shape[1]:
        return 0, np.zeros(0)
    values, vectors = np.linalg.svd(passive)[1:]
    return passive.shape[1] - int(np.count_nonzero(values > tolerance * max(values, default=1.0))), vectors[-1]


def _shown(structure: Structure, direction: FloatArray) -> str:
    """The joints of a motion, the fastest first, with their shares of it: ``joint "a" 1, "b" -0.5``."""
    names = [structure.dof_names[dof] for dof in structure.passive]
    shares = direction / direction[int(np.argmax(np.abs(direction)))]
    order = [i for i in np.argsort(-np.abs(shares), kind="stable") if abs(shares[i]) > SHOWN]
    listed = ", ".join(f'"{names[i]}" by {shares[i]:.3g}' for i in order[:4])
    return f"joint {listed}" + (f" and {len(order) - 4} more" if len(order) > 4 else "")
