"""The 4-RPRP robot by screws, the paper's own route: [GarciaMurillo2016] sections 5 and 6, equation by equation.

Pole: the origin O = A1 of the paper's frame. The six screws of a limb, in order from the base, are those of the
equivalent SPRP chain: 0$1 (revolute u at A_i), the two virtual revolutes 1$2 (w) and 2$3 (v) at A_i, 3$4 (prismatic w),
4$5 (revolute u at B_i) and 5$6 (prismatic u, rod in platform). Nothing here shares code with the direct form in
`planar_4rprp_kernel`.

Moments are ``A x u``. The text that reached us reads ``u x A``; with that the revolutes' rates and the Lie-screw terms
change sign (``moment_sign=-1`` shows what follows).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.robots import screws

REVOLUTE_AXES: dict[int, tuple[float, float, float]] = {
    1: (1.0, 0.0, 0.0),
    2: (0.0, 0.0, 1.0),
    3: (1.0, 0.0, 0.0),
    4: (0.0, 0.0, 1.0),
}
ACTIVE = (1, 2, 3)
LINE_OF_LIMB = 1
"""Column of 1$2, the line along the limb: reciprocal to every screw of the limb but 3$4."""

CYLINDER, PISTON, ROD, PLATFORM = 3, 4, 5, 6
"""Number of screws between the base and a body."""

ROD_OWNERS = (1, 2)
"""Limbs in whose chain a rod is counted: rod 1-3 with limb 1, rod 2-4 with limb 2."""


@dataclass(frozen=True)
class Limb:
    """One limb's screws and the points they stand on, for a batch of poses."""

    number: int
    pivot: FloatArray
    """A_i, ``(3,)``"""
    tip: FloatArray
    """B_i, ``(n, 3)``"""
    direction: FloatArray
    """w_i, ``(n, 3)``"""
    screws: FloatArray
    """``(n, 6, 6)``: screw, then component"""

    @property
    def jacobian(self) -> FloatArray:
        """J_i with the screws as columns, ``(n, 6, 6)``."""
        return np.swapaxes(self.screws, 1, 2)


def limb(parameters: Any, number: int, x: FloatArray, moment_sign: float = 1.0) -> Limb:
    """Return limb *number* (1 to 4) with P at ``x`` ``(n, 3)``; [GarciaMurillo2016] section 5, Figure 6.

    Parameters
    ----------
    parameters
        Parameters of the mechanism, SI.
    number
        1 to 4.
    x
        Position of P, ``(n, 3)``, metres, paper frame.
    moment_sign
        1 for moments ``A x u``; -1 for ``u x A`` as printed.
    """
    a, b, h = parameters.a, parameters.b, parameters.h
    pivot = np.array({1: (0, 0, 0), 2: (0, 0, b), 3: (a, 0, b), 4: (a, 0, 0)}[number], dtype=np.float64)
    tip = x.copy()
    if number in (1, 3):
        tip[:, 0] = pivot[0]
    else:
        tip[:, 1] -= h
        tip[:, 2] = pivot[2]
    u = np.broadcast_to(np.array(REVOLUTE_AXES[number]), x.shape)
    w = tip - pivot
    w = w / np.linalg.norm(w, axis=1, keepdims=True)
    v = np.cross(u, w)
    chain = np.stack(
        [
            screws.line(u, pivot),
            screws.line(w, pivot),
            screws.line(v, pivot),
            screws.translation(w),
            screws.line(u, tip),
            screws.translation(u),
        ],
        axis=1,
    )
    if moment_sign != 1.0:
        for revolute in (0, 1, 2, 4):
            chain[:, revolute, 3:] *= moment_sign
    return Limb(number, pivot, tip, w, chain)


def reduced_jacobian(limbs: dict[int, Limb]) -> FloatArray:
    """J_r ``(n, 3, 3)`` of eq. (19): Klein forms of 1$2 with a translation along each axis."""
    translations = screws.translation(np.eye(3))
    rows = [screws.klein(limbs[i].screws[:, None, LINE_OF_LIMB, :], translations[None]) for i in ACTIVE]
    return np.stack(rows, axis=1)


def lie_screw(chain: FloatArray, rates: FloatArray, bodies: int) -> FloatArray:
    """Lie screw of the first *bodies* screws, ``(n, 6)``: sum of [w_j $_j, sum over k > j of w_k $_k]; section 5."""
    moving = chain * rates[:, :, None]
    total = np.zeros((len(chain), 6))
    for j in range(bodies - 1):
        total += screws.lie_bracket(moving[:, j], moving[:, j + 1 : bodies].sum(axis=1))
    return total


@dataclass(frozen=True)
class Motion:
    """Platform motion and joint rates, from the limb rates by screws."""

    limbs: dict[int, Limb]
    jacobian_r: FloatArray
    xd: FloatArray
    """``(n, 3)``"""
    xdd: FloatArray
    """``(n, 3)``"""
    rates: dict[int, FloatArray]
    """joint rates of each limb, ``(n, 6)``"""
    accelerations: dict[int, FloatArray]
    """their derivatives, ``(n, 6)``"""


def motion(parameters: Any, qd: FloatArray, qdd: FloatArray, x: FloatArray, moment_sign: float = 1.0) -> Motion:
    """Velocity and acceleration of P and of every joint; [GarciaMurillo2016] section 5, eq. (17) and after.

    Parameters
    ----------
    parameters
        Parameters of the mechanism, SI.
    qd, qdd
        Actuated velocity and acceleration, ``(n, 3)``.
    x
        Position of P, ``(n, 3)``.
    moment_sign
        See `limb`.
    """
    limbs = {number: limb(parameters, number, x, moment_sign) for number in REVOLUTE_AXES}
    jacobian_r = reduced_jacobian(limbs)
    xd = _solve(jacobian_r, qd)
    state = screws.translation(xd)
    rates = {i: _solve(limbs[i].jacobian, state) for i in limbs}
    lie = {i: lie_screw(limbs[i].screws, rates[i], PLATFORM) for i in limbs}
    driver = qdd + np.stack([screws.klein(limbs[i].screws[:, LINE_OF_LIMB], lie[i]) for i in ACTIVE], axis=1)
    xdd = _solve(jacobian_r, driver)
    reduced = screws.translation(xdd)  # the platform does not turn: no omega x v in its reduced acceleration state
    accelerations = {i: _solve(limbs[i].jacobian, reduced - lie[i]) for i in limbs}
    return Motion(limbs, jacobian_r, xd, xdd, rates, accelerations)


def torques(
    parameters: Any,
    q: FloatArray,
    qd: FloatArray,
    qdd: FloatArray,
    x: FloatArray,
    external_force: FloatArray,
    mass_model: str = "distributed",
    moment_sign: float = 1.0,
) -> FloatArray:
    """Driving forces tau ``(n, 3)``, N, by partial screws and virtual work; [GarciaMurillo2016] section 6, to eq. (32).

    Parameters
    ----------
    parameters
        Parameters of the mechanism, SI.
    q, qd, qdd
        Actuated motion, ``(n, 3)``.
    x
        Position of P, ``(n, 3)``, on the branch wanted.
    external_force
        Newtons on the platform, ``(n, 3)``.
    mass_model
        ``distributed``, or ``lumped`` for cylinders and pistons without rotational inertia.
    moment_sign
        See `limb`.
    """
    p = parameters
    moving = motion(p, qd, qdd, x, moment_sign)
    inverse_r = np.linalg.inv(moving.jacobian_r)
    turning = 1.0 if mass_model == "distributed" else 0.0
    # the axial inertia takes no part, for limbs do not turn about their axes
    cylinder = turning * np.array([p.I2x, 0.0, p.I2z])
    piston = turning * np.array([p.I3x, 0.0, p.I3z])
    tau = np.zeros_like(q)
    for number, chain in moving.limbs.items():
        # influence coefficients G: joint rates per qd, eq. (26)-(27); the state of the platform is (0; J_r^-1 qd)
        states = np.concatenate([np.zeros_like(inverse_r), inverse_r], axis=1)
        influence = np.linalg.solve(chain.jacobian, states)
        bodies = [
            (CYLINDER, p.m2, chain.pivot + p.c2 * chain.direction, cylinder),
            (PISTON, p.m3, chain.tip - p.c3 * chain.direction, piston),
        ]
        if number in ROD_OWNERS:
            bodies.append((ROD, p.m4, chain.tip, np.zeros(3)))
        for body, mass, centre, inertia in bodies:
            tau -= _power_per_rate(moving, number, body, mass, centre, inertia, influence, p.g, np.zeros((1, 3)))
        if number == ACTIVE[0]:
            tau -= _power_per_rate(moving, number, PLATFORM, p.m6, x, np.zeros(3), influence, p.g, external_force)
    return tau


def _power_per_rate(
    moving: Motion,
    number: int,
    body: int,
    mass: float,
    centre: FloatArray,
    inertia: FloatArray,
    influence: FloatArray,
    g: float,
    force: FloatArray,
) -> FloatArray:
    """Klein form of one body's wrench with its three partial screws, ``(n, 3)``; eq. (25), (29), (31)."""
    chain, rates = moving.limbs[number], moving.rates[number]
    screws_below = chain.screws[:, :body]
    velocity = screws.change_pole(np.einsum("nk,nkc->nc", rates[:, :body], screws_below), centre)
    reduced = np.einsum("nk,nkc->nc", moving.accelerations[number][:, :body], screws_below)
    reduced = screws.change_pole(reduced + lie_screw(chain.screws, rates, body), centre)
    omega, alpha = velocity[:, :3], reduced[:, :3]
    acceleration = reduced[:, 3:] + np.cross(omega, velocity[:, 3:])
    tensor = _global_inertia(chain, inertia)
    spin = np.einsum("nij,nj->ni", tensor, omega)
    moment = -np.einsum("nij,nj->ni", tensor, alpha) - np.cross(omega, spin)
    wrench = np.concatenate([force + mass * (np.array([0.0, -g, 0.0]) - acceleration), moment], axis=1)
    partial = np.einsum("nkm,nkc->nmc", influence[:, :body], screws_below)
    partial = screws.change_pole(partial, centre[:, None, :])
    return screws.klein(wrench[:, None, :], partial)


def _global_inertia(chain: Limb, inertia: FloatArray) -> FloatArray:
    """I0 = R I* R^T, ``(n, 3, 3)``, section 6: body frames have y along the limb, x or z along the revolute axis."""
    y = chain.direction
    u = np.broadcast_to(np.array(REVOLUTE_AXES[chain.number]), y.shape)
    x, z = (u, np.cross(u, y)) if chain.number in (1, 3) else (np.cross(y, u), u)
    rotation = np.stack([x, y, z], axis=2)
    result: FloatArray = (rotation * inertia) @ np.swapaxes(rotation, 1, 2)
    return result


def _solve(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.solve(matrices, vectors[:, :, None])[:, :, 0], dtype=np.float64)
