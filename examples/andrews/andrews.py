"""Inverse dynamics of Andrews' squeezing mechanism, dyad by dyad; derivation in README.md."""

import numpy as np

import workbench


def dot(one, two):
    """Scalar product of vectors in the plane, as complex numbers."""
    return (np.conj(one) * two).real


def dyad(foot, pivot, first, second, side):
    """Point at distances *first* from a moving foot and *second* from a fixed pivot, and two derivatives by q."""
    at, rate, add = foot
    way = pivot - at
    reach = np.abs(way)
    along = (first**2 - second**2 + reach**2) / (2 * reach)
    point = at + way / reach * (along + side * 1j * np.sqrt(first**2 - along**2))
    one, two = point - at, point - pivot
    moved = cross(one, two, dot(one, rate), 0.0)
    turned = cross(one, two, dot(one, add) - np.abs(moved - rate) ** 2, -(np.abs(moved) ** 2))
    return point, moved, turned


def cross(one, two, first, second):
    """The vector with the scalar products *first* with *one* and *second* with *two*."""
    return 1j * (second * one - first * two) / dot(1j * one, two)


def body(mass, inertia, start, end, share):
    """Mass, inertia, mass centre and direction with derivatives; *share* places the centre on the way from start."""
    way = [b - a for a, b in zip(start, end, strict=True)]
    centre = [a + share * v for a, v in zip(start, way, strict=True)]
    size = np.abs(way[0]) ** 2
    return mass, inertia, centre, dot(1j * way[0], way[1]) / size, dot(1j * way[0], way[2]) / size


def motion(p, q):
    """Points F, E, G, H with two derivatives by q."""
    crank = p.rr * np.exp(1j * q)
    foot = crank, 1j * crank, -crank
    corner = dyad(foot, p.xb + 1j * p.yb, p.d, p.ss, 1.0)
    left = dyad(corner, p.xa + 1j * p.ya, p.e, p.zt, -1.0)
    right = dyad(corner, p.xa + 1j * p.ya, p.zf, p.u, 1.0)
    return foot, corner, left, right


@workbench.candidate("dyads", bound=1e-10, source="examples/andrews/README.md")
def dyads(p, q, qd, qdd, force):
    """Three pairs of circles, then virtual work of the seven bodies."""
    q, qd, qdd = q[:, 0], qd[:, 0], qdd[:, 0]
    foot, corner, left, right = motion(p, q)
    still = [0 * foot[0]] * 2
    base, a, b = [[point + 0 * foot[0], *still] for point in (0.0, p.xa + 1j * p.ya, p.xb + 1j * p.yb)]
    bodies = [
        body(p.m1, p.I1, base, foot, p.ra / p.rr),
        body(p.m2, p.I2, foot, corner, p.da / p.d),
        body(p.m3, p.I3, b, corner, (p.sa + 1j * p.sb) / p.ss),
        body(p.m4, p.I4, left, corner, p.ea / p.e),
        body(p.m5, p.I5, a, left, (p.ta + 1j * p.tb) / p.zt),
        body(p.m6, p.I6, right, corner, p.fa / p.zf),
        body(p.m7, p.I7, a, right, (p.ua - 1j * p.ub) / p.u),
    ]
    tau = 0.0
    for mass, inertia, centre, turn, twist in bodies:
        add = centre[1] * qdd + centre[2] * qd**2
        tau = tau + mass * dot(centre[1], add + 1j * p.g) + inertia * turn * (turn * qdd + twist * qd**2)
    pushed = body(0.0, 0.0, b, corner, (p.sc + 1j * p.sd) / p.ss)[2][1]
    return (tau - dot(pushed, force[:, 0] + 1j * force[:, 2]))[:, None]


@workbench.forward_kinematics
def forward(p, q):
    """The point D of K3, where the spring pulls."""
    corner, pivot = motion(p, q[:, 0])[1][0], p.xb + 1j * p.yb
    point = pivot + (corner - pivot) * (p.sc + 1j * p.sd) / p.ss
    return np.stack([point.real, 0 * point.real, point.imag], axis=1)
