"""Rods between two spherical joints: where a model has them, and how far they are from turning idly about their axis.

Wherever the loop is cut, a group of bodies welded together that is held by two ball joints and nothing else may turn
about the line between their centres, and nothing feels it. Ball joints are: a ball joint to the parent or to a child,
three hinges through one point, a connect.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.mjcf.refusal import Refusal
from workbench.reference.closures import Block, name_of
from workbench.reference.frames import Frames
from workbench.reference.kinds import CONNECT, SPIN, WELD
from workbench.robots.values import inertia_matrix

ROUND = 1e-6
"""Of a rod's length and of its inertia: how unlike a body of revolution a rod may be and still count as one; six digits
in a file stay below it."""

LOPSIDED = 0.02
"""As `ROUND`: up to here a rod counts as made for a body of revolution, with the digits of a CAD file and a hole or a
flat; what the difference is worth in torque is computed. Beyond, it is another body."""

BALL, HINGE, FREE = (
    kind.value for kind in (mujoco.mjtJoint.mjJNT_BALL, mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_FREE)
)

CLEARLY = 0.1
"""Of `ROUND`: a rod that is rounder than this needs no closer look."""

IDENTITY = np.eye(3)

COPLANAR = 1e-6
"""Determinant of three hinge axes below which they make no spherical joint."""


@dataclass(frozen=True)
class Rod:
    """A group of welded bodies with an idle spin."""

    body: int
    """the group's first body, which the spin row turns"""
    group: tuple[int, ...]
    near: int
    """a point: a site or frame where >= 0, the anchor of joint ``-1 - near`` otherwise"""
    far: int


@dataclass(frozen=True)
class Unevenness:
    """How far a rod is from a body of revolution, in one pose of it."""

    length: float
    """between the centres of its ball joints, m"""
    off: float
    """distance of its mass centre from the line between, m"""
    uneven: float
    """difference of its moments of inertia around the line, kg m^2"""
    trace: float
    """sum of its principal moments, kg m^2"""

    def beyond(self, limit: float) -> bool:
        """Whether it is more unlike a body of revolution than the fraction *limit*."""
        return self.off > limit * self.length or self.uneven > limit * self.trace


def idle_rods(model: mujoco.MjModel, blocks: list[Block]) -> list[Rod]:
    """All groups of bodies that two spherical joints hold and nothing else."""
    parents, joints = model.body_parentid.tolist(), model.body_jntnum.tolist()
    first = _groups(parents, joints)
    rods = []
    for body in range(1, model.nbody):
        if first[body] != body or not joints[body]:
            continue
        group = tuple(other for other, leader in enumerate(first) if leader == body)
        points = _held_by(model, blocks, group, body, parents)
        if points is not None and len(points) == 2:
            rods.append(Rod(body, group, points[0], points[1]))
    return rods


def _groups(parents: list[int], joints: list[int]) -> list[int]:
    """The first body of the group that each body is welded into by the tree."""
    first = list(range(len(parents)))
    for body in range(1, len(parents)):
        if not joints[body]:
            first[body] = first[parents[body]]
    return first


def _held_by(
    model: mujoco.MjModel, blocks: list[Block], group: tuple[int, ...], body: int, parents: list[int]
) -> list[int] | None:
    """Centres of the spherical joints that hold a group; None where something else holds it as well."""
    points = []
    own = _spherical(model, body)
    if own is not None:
        points.append(own)
    elif model.jnt_type[model.body_jntadr[body]] != FREE:
        return None
    for child in range(1, model.nbody):
        if child not in group and parents[child] in group:
            centre = _spherical(model, child)
            if centre is None:
                return None
            points.append(centre)
    for kind, one, two, at_one, at_two in blocks:
        if kind not in (CONNECT, WELD):
            continue
        inside = (one in group) + (two in group)
        if inside == 1 and kind == CONNECT:
            points.append(at_one if one in group else at_two)
        elif inside:
            return None
    return points


def _spherical(model: mujoco.MjModel, body: int) -> int | None:
    """The centre of the spherical joint between a body and its parent; None where there is another joint."""
    start, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    kinds = model.jnt_type[start : start + count].tolist()
    if kinds == [BALL]:
        return -1 - start
    if kinds == [HINGE] * 3:
        joints = slice(start, start + 3)
        together = np.ptp(np.array(model.jnt_pos[joints]), axis=0).max() == 0.0
        if together and abs(np.linalg.det(np.array(model.jnt_axis[joints]))) > COPLANAR:
            return -1 - start
    return None


def spin_block(rod: Rod) -> Block:
    """The constraint that holds a rod's spin at zero."""
    return SPIN, rod.body, 0, rod.far, rod.near


class RodFrame:
    """A rod in the frame of its first body, which its joints do not change."""

    def __init__(self, model: mujoco.MjModel, rod: Rod, frames: Frames) -> None:
        self._model, self._frames = model, frames
        self._poses: dict[int, tuple[FloatArray, FloatArray]] = {rod.body: (np.eye(3), np.zeros(3))}
        for body in rod.group[1:]:
            turn, place = self._poses[int(model.body_parentid[body])]
            self._poses[body] = turn @ _rotation(model.body_quat[body]), place + turn @ model.body_pos[body]
        self.group = rod.group
        self.near, self.far = self._end(rod.near), self._end(rod.far)
        self.length = float(np.linalg.norm(self.far - self.near))

    def off_axis(self, body: int, position: FloatArray) -> float:
        """Distance of a point of one of the rod's bodies from its axis, m."""
        turn, place = self._poses[body]
        return self._off(place + turn @ position)

    def unevenness(self) -> Unevenness:
        """Compare the rod with a body of revolution."""
        if not self.length:
            return Unevenness(0.0, 0.0, 0.0, 0.0)
        centre, inertia = self._inertia()
        turn = self._axes()
        seen = turn @ inertia @ turn.T
        uneven = max(abs(seen[0, 1]), abs(seen[0, 2]), abs(seen[1, 2]), abs(seen[1, 1] - seen[2, 2]))
        return Unevenness(self.length, self._off(centre), float(uneven), float(np.trace(inertia)))

    def plainly_round(self) -> bool:
        """Whether the rod is one body and a body of revolution, well within `ROUND`: most are, and variants are asked.

        Its own inertia is held against the round one that is nearest to it; what they differ by is at least half of
        `Unevenness.uneven`.
        """
        if len(self.group) > 1 or not self.length:
            return False
        body = self.group[0]
        axis = (self.far - self.near) / self.length
        x, y, z = axis.tolist()
        a, b, c = (self._model.body_ipos[body] - self.near).tolist()
        off = math.hypot(y * c - z * b, z * a - x * c, x * b - y * a)
        inertia = inertia_matrix(self._model, body)
        trace, along = float(inertia[0, 0] + inertia[1, 1] + inertia[2, 2]), float(axis @ inertia @ axis)
        across = 0.5 * (trace - along)
        rest = inertia - (along - across) * np.multiply.outer(axis, axis)
        gap = math.hypot(*(rest - across * IDENTITY).ravel().tolist())
        return off <= CLEARLY * ROUND * self.length and gap <= CLEARLY * ROUND * trace

    def rounded(self) -> tuple[FloatArray, FloatArray]:
        """Mass centre ``(3,)`` and inertia ``(3, 3)`` about it that make the rod round.

        They are the first body's, in its own frame; mass, mass centre along the axis, inertia along and mean inertia
        across the axis stay those of the rod.
        """
        model, first = self._model, self.group[0]
        centre, inertia = self._inertia()
        turn = self._axes()
        seen = turn @ inertia @ turn.T
        across = 0.5 * (seen[1, 1] + seen[2, 2])
        wanted = turn.T @ np.diag([seen[0, 0], across, across]) @ turn
        axis = turn[0]
        on_axis = self.near + axis * (axis @ (centre - self.near))
        mass = float(model.body_mass[first])
        whole = sum(float(model.body_mass[body]) for body in self.group)
        place = np.array(model.body_ipos[first])
        if mass:
            place = place + (on_axis - centre) * whole / mass
        # what the other bodies bring about the new centre is taken off
        for body in self.group:
            rotation, origin = self._poses[body]
            at = place if body == first else origin + rotation @ model.body_ipos[body]
            arm = at - on_axis
            wanted -= model.body_mass[body] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
            if body != first:
                wanted -= rotation @ inertia_matrix(model, body) @ rotation.T
        return place, wanted

    def _axes(self) -> FloatArray:
        """Rows: the rod's axis and two directions across it."""
        axis = (self.far - self.near) / self.length
        return np.vstack([axis, np.linalg.svd(axis[None, :])[2][1:]])

    def _inertia(self) -> tuple[FloatArray, FloatArray]:
        """Mass centre of all the rod's bodies, and their inertia about it."""
        model = self._model
        mass = sum(float(model.body_mass[body]) for body in self.group)
        places = {body: place + turn @ model.body_ipos[body] for body, (turn, place) in self._poses.items()}
        centre = self.near
        if mass:
            centre = sum((model.body_mass[body] * places[body] for body in self.group), np.zeros(3)) / mass
        inertia = np.zeros((3, 3))
        for body in self.group:
            turn, arm = self._poses[body][0], places[body] - centre
            inertia += turn @ inertia_matrix(model, body) @ turn.T
            inertia += model.body_mass[body] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        return centre, inertia

    def _off(self, point: FloatArray) -> float:
        return float(np.linalg.norm(np.cross((self.far - self.near) / self.length, point - self.near)))

    def _end(self, point: int) -> FloatArray:
        model = self._model
        if point < 0:
            joint = -1 - point
            body, position = int(model.jnt_bodyid[joint]), np.array(model.jnt_pos[joint])
            if body not in self.group:  # a child's: fixed where the child hangs
                position = model.body_pos[body] + _rotation(model.body_quat[body]) @ position
                body = int(model.body_parentid[body])
        elif point < model.nsite:
            body, position = int(model.site_bodyid[point]), np.array(model.site_pos[point])
        else:
            body = int(self._frames.bodies[point - model.nsite])
            position = self._frames.positions[point - model.nsite]
        turn, place = self._poses[body]
        end: FloatArray = place + turn @ position
        return end


def _rotation(quaternion: FloatArray) -> FloatArray:
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, np.array(quaternion))
    return turn.reshape(3, 3)


def refuse_rod(model: mujoco.MjModel, rod: Rod, found: Unevenness) -> Refusal | None:
    """Refuse what is no rod: a body that two spherical joints hold and that is far from a body of revolution."""
    name = name_of(model, mujoco.mjtObj.mjOBJ_BODY, rod.body)
    joint = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, int(model.body_jntadr[rod.body]))
    kind = "lopsided rods"
    if not found.length:
        return Refusal(
            f'body "{name}" hangs between two spherical joints that have one centre',
            "body",
            name,
            "place the site at the rod's other end, or the second joint",
            kind,
        )
    if not found.beyond(LOPSIDED):
        return None
    if found.off > LOPSIDED * found.length:
        what = f"its mass centre lies {found.off:.3g} m off the line between them"
    else:
        what = f"its moments of inertia differ around the line between them by {found.uneven:.3g} kg m^2"
    return Refusal(
        f'body "{name}" hangs between two spherical joints, and {what}',
        "body",
        name,
        f'what spins it no actuator holds; put two hinges in place of spherical joint "{joint}", or make the rod alike'
        " all around",
        kind,
    )
