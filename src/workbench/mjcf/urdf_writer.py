"""A compiled model, read from a URDF, as MJCF text in full digits with loops; and the check that both are one robot."""

from __future__ import annotations

from collections.abc import Iterator
from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, did_you_mean
from workbench.mjcf.loop_table import Loop

HINGE_ARM = 0.1
"""m: a hinge as two points that meet, so far apart along its axis."""

ROUND_TRIP = 1e-9
"""kg, m, kg m^2 and of rotation matrices: masses, mass centres, inertias, poses, axes of both files agree to this."""

Pose = tuple[FloatArray, FloatArray]
"""position ``(3,)`` and rotation ``(3, 3)``"""


class Writer:
    """Writes one model; links without mass go into those behind them, whose body then has several joints."""

    def __init__(self, model: mujoco.MjModel, spherical: set[str], massless: frozenset[str], file: str) -> None:
        self._model, self._spherical, self._massless, self._file = model, spherical, massless, file
        self._sites: dict[str, list[str]] = {}

    def text(
        self,
        name: str,
        loops: tuple[Loop, ...],
        frames: dict[str, str],
        mimics: list[tuple[str, str, float, float]],
    ) -> str:
        """The MJCF.

        Raises
        ------
        ModelError
            A loop at a frame that is not there; a link without mass that cannot go into another.
        """
        equalities = [line for k, loop in enumerate(loops, start=1) for line in self._loop(k, loop, frames)]
        for joint, leader, factor, offset in mimics:
            names = f"joint1={quoteattr(joint)} joint2={quoteattr(leader)}"
            equalities.append(
                f'<joint name={quoteattr("mimic_" + joint)} {names} polycoef="{offset!r} {factor!r} 0 0 0"/>'
            )
        lines = [
            f"<mujoco model={quoteattr(name)}>",
            '  <compiler angle="radian" autolimits="true" balanceinertia="false"/>',
            '  <option gravity="0 0 -9.81"><flag contact="disable"/></option>',
            "  <worldbody>",
            *(f"    {site}" for site in self._sites.get("world", [])),
        ]
        for body in self._children(0):
            lines += self._body(body, [], (np.zeros(3), np.eye(3)), "    ")
        lines.append("  </worldbody>")
        if equalities:
            lines += ["  <equality>", *(f"    {equality}" for equality in equalities), "  </equality>"]
        return "\n".join([*lines, "</mujoco>", ""])

    def _loop(self, number: int, loop: Loop, frames: dict[str, str]) -> Iterator[str]:
        ends = (("a", loop.first), ("b", loop.second))
        for side, frame in ends:
            if frame not in frames:
                raise ModelError(
                    f'{self._file}: closed_loop: no frame "{frame}"{did_you_mean(frame, frames)}', file=self._file
                )
            self._sites.setdefault(frames[frame], []).append(f'<site name="loop{number}_{side}"/>')
        kind = "connect" if loop.freed else "weld"
        yield f'<{kind} name="loop{number}" site1="loop{number}_a" site2="loop{number}_b"/>'
        if len(loop.freed) == 1:
            place = " ".join(str(HINGE_ARM if axis == loop.freed[0] else 0.0) for axis in ("rx", "ry", "rz"))
            for side, frame in ends:
                self._sites[frames[frame]].append(f'<site name="loop{number}_{side}_axis" pos="{place}"/>')
            yield f'<connect name="loop{number}_axis" site1="loop{number}_a_axis" site2="loop{number}_b_axis"/>'

    def _children(self, body: int) -> list[int]:
        model = self._model
        return [child for child in range(1, model.nbody) if model.body_parentid[child] == body]

    def _body(self, body: int, carried: list[tuple[int, Pose]], above: Pose, indent: str) -> Iterator[str]:
        """One body; *carried* are joints of links without mass in front of it, each with the pose of its link."""
        model = self._model
        name = model.body(body).name
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, model.body_quat[body])
        pose = above[0] + above[1] @ model.body_pos[body], above[1] @ rotation.reshape(3, 3)
        own = range(int(model.body_jntadr[body]), int(model.body_jntadr[body]) + int(model.body_jntnum[body]))
        joints = [*carried, *((joint, pose) for joint in own)]
        if name in self._massless:
            behind = self._children(body)
            if len(behind) != 1 or name in self._sites:
                raise ModelError(
                    f'{self._file}: link "{name}" moves and has no mass; allowed where exactly one link follows and no'
                    " loop ends at it",
                    file=self._file,
                    body=name,
                )
            yield from self._body(behind[0], joints, pose, indent)
            return
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(pose[1]).ravel())
        yield f"{indent}<body name={quoteattr(name)} pos={_numbers(pose[0])} quat={_numbers(quaternion)}>"
        if model.body_mass[body] > 0.0:
            yield (
                f"{indent}  <inertial pos={_numbers(model.body_ipos[body])} quat={_numbers(model.body_iquat[body])}"
                f' mass="{float(model.body_mass[body])!r}" diaginertia={_numbers(model.body_inertia[body])}/>'
            )
        for joint, where in joints:
            yield f"{indent}  {self._joint(joint, where, pose)}"
        for site in self._sites.get(name, []):
            yield f"{indent}  {site}"
        for child in self._children(body):
            yield from self._body(child, [], (np.zeros(3), np.eye(3)), indent + "  ")
        yield f"{indent}</body>"

    def _joint(self, joint: int, where: Pose, own: Pose) -> str:
        """One joint of the link at *where*, written into the body at *own*."""
        model = self._model
        name, kind, dof = model.joint(joint).name, int(model.jnt_type[joint]), int(model.jnt_dofadr[joint])
        types = mujoco.mjtJoint
        place = own[1].T @ (where[0] + where[1] @ model.jnt_pos[joint] - own[0])
        if kind == types.mjJNT_FREE.value and name in self._spherical:
            return f'<joint name={quoteattr(name)} type="ball" pos={_numbers(place)}/>'
        if kind == types.mjJNT_FREE.value:
            return f"<freejoint name={quoteattr(name)}/>"
        if kind == types.mjJNT_BALL.value:
            return f'<joint name={quoteattr(name)} type="ball" pos={_numbers(place)}/>'
        word = "slide" if kind == types.mjJNT_SLIDE.value else "hinge"
        axis = own[1].T @ where[1] @ model.jnt_axis[joint]
        parts = [f'<joint name={quoteattr(name)} type="{word}" axis={_numbers(axis)} pos={_numbers(place)}']
        if model.jnt_limited[joint]:
            parts.append(f"range={_numbers(model.jnt_range[joint])}")
        for key, value in (("damping", model.dof_damping[dof]), ("frictionloss", model.dof_frictionloss[dof])):
            if value:
                parts.append(f'{key}="{float(value)!r}"')
        return " ".join(parts) + "/>"


def _numbers(values: FloatArray) -> str:
    return '"' + " ".join(repr(float(v)) for v in values) + '"'


def same_robot(one: mujoco.MjModel, other: mujoco.MjModel, massless: frozenset[str], file: str) -> None:
    """Hold two models against each other, body by body and joint by joint, at the zero of all coordinates.

    Raises
    ------
    ModelError
        What differs by more than `ROUND_TRIP`.
    """
    first, second = (_at_zero(model) for model in (one, other))
    for body in range(1, one.nbody):
        name = one.body(body).name
        if name in massless:
            continue
        twin = other.body(name).id
        tensors = [
            d.ximat[b].reshape(3, 3) @ np.diag(m.body_inertia[b]) @ d.ximat[b].reshape(3, 3).T
            for d, m, b in ((first, one, body), (second, other, twin))
        ]
        _agree(
            f'link "{name}"',
            {
                "mass": (one.body_mass[body], other.body_mass[twin]),
                "mass centre": (first.xipos[body], second.xipos[twin]),
                "inertia": (tensors[0], tensors[1]),
                "position": (first.xpos[body], second.xpos[twin]),
                "rotation": (first.xmat[body], second.xmat[twin]),
            },
            file,
        )
    for joint in range(one.njnt):
        name = one.joint(joint).name
        twin = other.joint(name).id
        found = {"place": (first.xanchor[joint], second.xanchor[twin])}
        if one.jnt_type[joint] >= mujoco.mjtJoint.mjJNT_SLIDE.value:
            found["axis"] = first.xaxis[joint], second.xaxis[twin]
        _agree(f'joint "{name}"', found, file)


def _at_zero(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0
    mujoco.mj_kinematics(model, data)
    return data


def _agree(who: str, pairs: dict[str, tuple[FloatArray, FloatArray]], file: str) -> None:
    for what, (one, other) in pairs.items():
        gap = float(np.abs(np.asarray(one) - np.asarray(other)).max())
        if not gap <= ROUND_TRIP:
            raise ModelError(
                f"{file}: {what} of {who} differs by {gap:.3g} after the round trip; allowed: {ROUND_TRIP:g}", file=file
            )
