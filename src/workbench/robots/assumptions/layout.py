"""The make-up of a model that a closed form assumes: its bodies, joints, loops and sites, as data.

Nothing here knows MuJoCo. `workbench.robots.assumptions.check` compares a compiled model with these tables.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

JointKind = Literal["hinge", "slide", "ball", "fixed"]
Axis = tuple[float, float, float]

X: Axis = (1.0, 0.0, 0.0)
Y: Axis = (0.0, 1.0, 0.0)
Z: Axis = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class BodyInfo:
    """A moving body that the closed form knows, and the one joint by which it hangs on its parent.

    Where every joint coordinate is zero, a body's axes are its parent's: only a passive hinge may be turned about its
    own axis, and a ball joint in any way. A position that no `Target` gives is zero at coordinate zero; only a passive
    slide may be shifted along its own axis.
    """

    name: str
    parent: str
    joint: str = ""
    """name of the joint; empty for a body that is fixed to its parent"""
    kind: JointKind = "fixed"
    axis: Axis = (0.0, 0.0, 0.0)
    """unit vector in the body's own frame; without meaning for ``ball`` and ``fixed``"""
    turns: bool = True
    """False: the body never turns, so neither its inertia nor the place of its mass centre acts on anything"""


@dataclass(frozen=True)
class LoopInfo:
    """An equality that closes a loop between two sites; its own name and the order of its sites are free."""

    kind: Literal["connect", "weld"]
    sites: tuple[str, str]


@dataclass(frozen=True)
class Layout:
    """All that a model must consist of for a closed form to describe it."""

    base: str
    """the fixed body in whose frame the closed form's coordinates are"""
    gravity: Axis
    """direction of gravity in the base's frame"""
    bodies: tuple[BodyInfo, ...]
    loops: tuple[LoopInfo, ...]
    sites: Mapping[str, str]
    """site -> the body that carries it"""
    platform_site: str
    lumped_bodies: tuple[str, ...]
    """the bars that lose their rotational inertia under the lumped-mass assumption"""
