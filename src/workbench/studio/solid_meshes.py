"""Solids of a model as triangles, and the colours of the page."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray

from workbench.arrays import FloatArray
from workbench.rendering.solids import Solid

ROUND = 24
"""Sides of a round solid."""

FLOOR = 2.0
"""Half sides, m, of a plane that has none of its own."""

DEFAULT = (0.5, 0.5, 0.5)
"""MuJoCo's grey of geoms to which nobody gave a colour; they are drawn in `PLAIN`, which is seen on light and dark."""
PLAIN = (0.36, 0.52, 0.68)


def triangles(solid: Solid) -> tuple[FloatArray, NDArray[np.int32]]:
    """Vertices ``(k, 3)`` in the geom's frame, m, and faces ``(j, 3)``."""
    a, b, c = solid.size
    if solid.kind == "mesh":
        return solid.vertices, solid.faces
    if solid.kind == "box":
        made = trimesh.creation.box(extents=(2 * a, 2 * b, 2 * c))
    elif solid.kind == "plane":
        made = trimesh.creation.box(extents=(2 * (a or FLOOR), 2 * (b or FLOOR), 1e-3))
    elif solid.kind == "cylinder":
        made = trimesh.creation.cylinder(radius=a, height=2 * b, sections=ROUND)
    elif solid.kind == "capsule":
        made = trimesh.creation.capsule(height=2 * b, radius=a, count=[ROUND, ROUND])
        made.apply_translation([0.0, 0.0, -made.bounds.mean(axis=0)[2]])
    else:  # sphere, ellipsoid
        made = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
        made.apply_scale([a, b or a, c or a] if solid.kind == "ellipsoid" else a)
    return np.asarray(made.vertices, dtype=np.float64), np.asarray(made.faces, dtype=np.int32)


def colour_of(solid: Solid) -> tuple[int, int, int]:
    """Red, green, blue, 0 to 255."""
    rgb = solid.colour[:3]
    shown = PLAIN if np.allclose(rgb, DEFAULT) else rgb
    return int(255 * shown[0]), int(255 * shown[1]), int(255 * shown[2])


def same(one: Solid, other: Solid) -> bool:
    """Whether two solids look alike and sit alike in their bodies."""
    return (
        (one.body, one.kind, one.size, one.colour) == (other.body, other.kind, other.size, other.colour)
        and np.array_equal(one.position, other.position)
        and np.array_equal(one.wxyz, other.wxyz)
        and np.array_equal(one.vertices, other.vertices)
    )
