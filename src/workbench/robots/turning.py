"""Rotations of a platform for formulas: matrix, rotation vector and its rates; conventions of docs/notation.md."""

from __future__ import annotations

import numpy as np

from workbench.arrays import FloatArray

SMALL = 1e-4
"""Below this angle the quotients are taken from their series, right to the last digit there."""


def skew(v: FloatArray) -> FloatArray:
    """Matrices ``(n, 3, 3)`` of the cross products with *v* ``(n, 3)``."""
    x, y, z = v[:, 0], v[:, 1], v[:, 2]
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)


def unskew(matrix: FloatArray) -> FloatArray:
    """The vectors ``(n, 3)`` of the skew part of matrices ``(n, 3, 3)``."""
    part = (matrix - matrix.transpose(0, 2, 1)) / 2
    return np.stack([part[:, 2, 1], part[:, 0, 2], part[:, 1, 0]], axis=1)


def exponential(r: FloatArray) -> FloatArray:
    """Rotations ``(n, 3, 3)`` of rotation vectors ``(n, 3)``, rad."""
    angle = np.linalg.norm(r, axis=1)[:, None, None]
    small = angle < SMALL
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 1 - angle**2 / 6, np.sin(safe) / safe)
    second = np.where(small, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    matrix = skew(r)
    return np.asarray(np.eye(3) + first * matrix + second * matrix @ matrix)


def logarithm(rotation: FloatArray) -> FloatArray:
    """Rotation vectors ``(n, 3)`` of rotations ``(n, 3, 3)``, less than half a turn, rad."""
    half = unskew(rotation)
    sine = np.linalg.norm(half, axis=1, keepdims=True)
    cosine = (np.trace(rotation, axis1=1, axis2=2)[:, None] - 1) / 2
    angle = np.arctan2(sine, cosine)
    small = sine < SMALL
    return np.asarray(half * np.where(small, 1 + angle**2 / 6, angle / np.where(small, 1.0, sine)))


def rotation_vector_rates(r: FloatArray) -> FloatArray:
    """G of ``rd = G omega``, ``(n, 3, 3)``: 1 - [r]x/2 + c [r]x^2, c = (1 - a/2 cot a/2)/a^2, a = |r|."""
    angle = np.linalg.norm(r, axis=1)[:, None, None]
    small = angle < SMALL
    safe = np.where(small, 1.0, angle)
    factor = np.where(small, 1 / 12 + angle**2 / 720, (1 - safe / 2 / np.tan(safe / 2)) / safe**2)
    matrix = skew(r)
    return np.asarray(np.eye(3) - matrix / 2 + factor * matrix @ matrix)
