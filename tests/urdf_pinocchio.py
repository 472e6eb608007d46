"""Inverse dynamics of a URDF with loops by Pinocchio alone, read from the URDF itself: a second opinion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin


def pinocchio_torques(
    urdf: Path,
    loops: list[tuple[str, str, str]],
    actuated: list[str],
    places: dict[str, np.ndarray],
    qd: np.ndarray,
    qdd: np.ndarray,
) -> tuple[np.ndarray, float]:
    """Torques ``(n, na)`` and the largest gap of a loop.

    *loops* are frame, frame, ``3d`` or ``6d``; *places* are closed coordinates ``(n,)`` of every hinge and slide.
    """
    model = pin.buildModelFromUrdf(str(urdf))
    data = model.createData()
    driven = [model.joints[model.getJointId(name)].idx_v for name in actuated]
    passive = [k for k in range(model.nv) if k not in driven]
    torques, gap = np.empty((len(qd), len(actuated))), 0.0
    for i in range(len(qd)):
        q = pin.neutral(model)
        for name, values in places.items():
            joint = model.joints[model.getJointId(name)]
            if joint.nq == 2:
                q[joint.idx_q : joint.idx_q + 2] = np.cos(values[i]), np.sin(values[i])
            else:
                q[joint.idx_q] = values[i]
        rows, zero = [], np.zeros(model.nv)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        for a, b, kind in loops:
            ids = [model.getFrameId(name) for name in (a, b)]
            rows.append(_jacobian(model, data, ids, kind))
            one, other = (data.oMf[k] for k in ids)
            gap = max(gap, float(np.abs(one.translation - other.translation).max()))
            if kind == "6d":
                gap = max(gap, float(np.abs(one.rotation - other.rotation).max()))
        jacobian = np.vstack(rows)
        tangent = np.zeros((model.nv, len(actuated)))
        tangent[driven] = np.eye(len(actuated))
        tangent[passive] = -np.linalg.lstsq(jacobian[:, passive], jacobian[:, driven], rcond=1e-9)[0]
        v = tangent @ qd[i]
        pin.forwardKinematics(model, data, q, v, zero)
        pin.updateFramePlacements(model, data)
        drift = np.concatenate(
            [_acceleration(model, data, [model.getFrameId(name) for name in (a, b)], kind) for a, b, kind in loops]
        )
        acc = np.zeros(model.nv)
        acc[driven] = qdd[i]
        right = -drift - jacobian[:, driven] @ qdd[i]
        acc[passive] = np.linalg.lstsq(jacobian[:, passive], right, rcond=1e-9)[0]
        torques[i] = tangent.T @ pin.rnea(model, data, q, v, acc)
    return torques, gap


def _jacobian(model: pin.Model, data: pin.Data, ids: list[int], kind: str) -> np.ndarray:
    one, other = (pin.getFrameJacobian(model, data, k, pin.LOCAL_WORLD_ALIGNED) for k in ids)
    return (one - other)[: 3 if kind == "3d" else 6]


def _acceleration(model: pin.Model, data: pin.Data, ids: list[int], kind: str) -> np.ndarray:
    found = [pin.getFrameClassicalAcceleration(model, data, k, pin.LOCAL_WORLD_ALIGNED).vector for k in ids]
    return (found[0] - found[1])[: 3 if kind == "3d" else 6]
