"""Screws of the Lie algebra se(3) as arrays ``(..., 6)``: axis (primary part) first, moment about the pole second.

A velocity state is (omega; velocity of the body's point at the pole). A wrench used with `klein` is (force; moment), so
that `klein` of a wrench and a velocity state is power. A line along ``u`` through ``A`` has the moment ``A x u`` about
the origin. Leading dimensions broadcast. Sources: [GarciaMurillo2016] sections 5 and 6 and the works it builds on.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray


def line(axis: ArrayLike, point: ArrayLike) -> FloatArray:
    """Screw of a revolute joint: ``(u; A x u)``.

    Parameters
    ----------
    axis
        Unit vector u of the axis, ``(..., 3)``.
    point
        A point A of the axis, ``(..., 3)``, metres from the pole.

    Returns
    -------
    numpy.ndarray
        ``(..., 6)``.
    """
    u, a = np.broadcast_arrays(np.asarray(axis, dtype=np.float64), np.asarray(point, dtype=np.float64))
    return np.concatenate([u, np.cross(a, u)], axis=-1)


def translation(direction: ArrayLike) -> FloatArray:
    """Screw of a prismatic joint along a unit vector ``(..., 3)``: ``(0; u)``, shape ``(..., 6)``."""
    u = np.asarray(direction, dtype=np.float64)
    return np.concatenate([np.zeros_like(u), u], axis=-1)


def klein(first: FloatArray, second: FloatArray) -> FloatArray:
    """Klein form ``{$1; $2} = s1 . s2O + s1O . s2``, shape ``(...)``: symmetric, invariant, zero if reciprocal."""
    result: FloatArray = np.sum(first[..., :3] * second[..., 3:] + first[..., 3:] * second[..., :3], axis=-1)
    return result


def lie_bracket(first: FloatArray, second: FloatArray) -> FloatArray:
    """Lie product ``[$1 $2] = (s1 x s2; s1 x s2O - s2 x s1O)``, shape ``(..., 6)``."""
    axis = np.cross(first[..., :3], second[..., :3])
    moment = np.cross(first[..., :3], second[..., 3:]) - np.cross(second[..., :3], first[..., 3:])
    return np.concatenate([axis, moment], axis=-1)


def change_pole(screw: FloatArray, shift: ArrayLike) -> FloatArray:
    """The same screw about a pole moved by ``shift`` ``(..., 3)``: ``(s; sO + s x shift)``, shape ``(..., 6)``."""
    moment = screw[..., 3:] + np.cross(screw[..., :3], np.asarray(shift, dtype=np.float64))
    return np.concatenate([np.broadcast_to(screw[..., :3], moment.shape), moment], axis=-1)


def adjoint(rotation: ArrayLike, displacement: ArrayLike) -> FloatArray:
    """Matrix ``(..., 6, 6)`` that moves a screw with a rigid body displaced by ``x -> R x + d``.

    Parameters
    ----------
    rotation
        R, ``(..., 3, 3)``.
    displacement
        d, ``(..., 3)``, metres.
    """
    r = np.asarray(rotation, dtype=np.float64)
    d = np.asarray(displacement, dtype=np.float64)
    cross = np.zeros((*d.shape[:-1], 3, 3))
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -d[..., 2], d[..., 1], -d[..., 0]
    cross -= np.swapaxes(cross, -1, -2)
    top = np.concatenate([r, np.zeros_like(r)], axis=-1)
    return np.concatenate([top, np.concatenate([cross @ r, r], axis=-1)], axis=-2)


def span(screws: FloatArray, tolerance: float = 1e-9) -> FloatArray:
    """Orthonormal basis ``(c, dimension)`` of the space spanned by the rows of ``(k, c)``; screws in metres have c = 6.

    Parameters
    ----------
    screws
        Screws, one a row; or the transpose of any matrix, whose column space is wanted.
    tolerance
        Singular values below this fraction of the largest count as zero.
    """
    left, values, _ = np.linalg.svd(screws.T, full_matrices=False)
    rank = int(np.count_nonzero(values > tolerance * values[0])) if values.size else 0
    return np.ascontiguousarray(left[:, :rank])


def intersection(first: FloatArray, second: FloatArray, tolerance: float = 1e-9) -> FloatArray:
    """Orthonormal basis ``(6, dimension)`` of the intersection of two spaces given by orthonormal bases (`span`)."""
    # principal angles: directions common to both have cosine one; (1 - cosine) is quadratic, so take the sine instead
    outside = first - second @ (second.T @ first)
    _, sines, right = np.linalg.svd(outside, full_matrices=True)
    padded = np.zeros(first.shape[1])
    padded[: len(sines)] = sines
    result: FloatArray = first @ right[padded < tolerance].T
    return result
