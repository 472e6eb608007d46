"""Closures by bodies: points and orientations that are fixed in a body and that no site marks.

They are numbered after the model's sites, so that whoever handles sites handles them too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import borrowing


@dataclass(frozen=True)
class Frames:
    """Frames in bodies; k of them."""

    bodies: np.ndarray
    """``(k,)`` body numbers"""
    positions: FloatArray
    """``(k, 3)``, m, in the body's frame"""
    quaternions: FloatArray
    """``(k, 4)``, w x y z, in the body's frame"""

    @staticmethod
    def of(rows: list[tuple[int, FloatArray, FloatArray]]) -> Frames:
        """Collect (body, position, quaternion)."""
        return Frames(
            np.array([row[0] for row in rows], dtype=np.int64),
            np.array([row[1] for row in rows], dtype=np.float64).reshape(-1, 3),
            np.array([row[2] for row in rows], dtype=np.float64).reshape(-1, 4),
        )

    def __len__(self) -> int:
        return len(self.bodies)


@borrowing
def place_frames(ids, bodies, positions, quaternions, xpos, xquat, site_xpos, site_xquat, out_pos, out_quat):  # type: ignore[no-untyped-def]
    """Fill rows *ids* of world poses: those of the sites first, then those of the frames."""
    sites = site_xpos.shape[1]
    for n in range(ids.shape[0]):
        s = ids[n]
        for k in range(sites):
            for i in range(3):
                out_pos[s, k, i] = site_xpos[s, k, i]
            for i in range(4):
                out_quat[s, k, i] = site_xquat[s, k, i]
        for f in range(bodies.shape[0]):
            b, k = bodies[f], sites + f
            w, x, y, z = xquat[s, b, 0], xquat[s, b, 1], xquat[s, b, 2], xquat[s, b, 3]
            px, py, pz = positions[f, 0], positions[f, 1], positions[f, 2]
            # p + 2 w (u x p) + 2 u x (u x p)
            cx, cy, cz = y * pz - z * py, z * px - x * pz, x * py - y * px
            out_pos[s, k, 0] = xpos[s, b, 0] + px + 2.0 * (w * cx + y * cz - z * cy)
            out_pos[s, k, 1] = xpos[s, b, 1] + py + 2.0 * (w * cy + z * cx - x * cz)
            out_pos[s, k, 2] = xpos[s, b, 2] + pz + 2.0 * (w * cz + x * cy - y * cx)
            qw, qx, qy, qz = quaternions[f, 0], quaternions[f, 1], quaternions[f, 2], quaternions[f, 3]
            out_quat[s, k, 0] = w * qw - x * qx - y * qy - z * qz
            out_quat[s, k, 1] = w * qx + x * qw + y * qz - z * qy
            out_quat[s, k, 2] = w * qy - x * qz + y * qw + z * qx
            out_quat[s, k, 3] = w * qz + x * qy - y * qx + z * qw
