"""Inverse dynamics of the planar four-bar by virtual work; derivation in README.md."""

import numpy as np

import workbench


def solve(p, r, s):
    """Real u, w with p u + r w = s, for complex p, r, s."""
    area = (np.conj(p) * r).imag
    return (np.conj(s) * r).imag / area, (np.conj(p) * s).imag / area


@workbench.candidate("loop-vector", bound=1e-10, source="examples/fourbar/README.md")
def loop_vector(p, q, qd, qdd):
    """Loop equation a e^(i q) + b e^(i u) + c e^(i w) = d and the virtual work of three bars."""
    q, qd, qdd = q[:, 0], qd[:, 0], qdd[:, 0]
    crank = p.a * np.exp(1j * q)
    way = p.d - crank
    reach = np.abs(way)
    inner = np.arccos((p.b**2 + reach**2 - p.c**2) / (2 * p.b * reach))
    coupler = p.b * np.exp(1j * (np.angle(way) + inner))
    rocker = way - coupler
    # rates per unit of qd, then accelerations
    u, w = solve(1j * coupler, 1j * rocker, -1j * crank)
    ud, wd = u * qd, w * qd
    rest = -1j * crank * qdd + crank * qd**2 + coupler * ud**2 + rocker * wd**2
    udd, wdd = solve(1j * coupler, 1j * rocker, rest)
    k1, k2, k3 = p.s1 / p.a, p.s2 / p.b, p.s3 / p.c
    bars = (
        (p.m1, p.I1, 1.0, qdd, ((crank, k1, 1.0, qd, qdd),)),
        (p.m2, p.I2, u, udd, ((crank, 1.0, 1.0, qd, qdd), (coupler, k2, u, ud, udd))),
        (p.m3, p.I3, w, wdd, ((crank, 1.0, 1.0, qd, qdd), (coupler, 1.0, u, ud, udd), (rocker, k3, w, wd, wdd))),
    )
    tau = 0.0
    for mass, inertia, turn, alpha, chain in bars:
        velocity = sum(share * 1j * arm * rate for arm, share, rate, _, _ in chain)
        acceleration = sum(share * arm * (1j * add - ad**2) for arm, share, _, ad, add in chain)
        tau = tau + mass * (np.conj(velocity) * (acceleration + 1j * p.g)).real + inertia * turn * alpha
    return tau[:, None]
