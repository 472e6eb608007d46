"""Inverse dynamics of the symmetric five-bar by virtual work; derivation in README.md."""

import numpy as np

import workbench


def solve(p, r, s):
    """Real u, w with p u + r w = s, for complex p, r, s."""
    area = (np.conj(p) * r).imag
    return (np.conj(s) * r).imag / area, (np.conj(p) * s).imag / area


def distals(p, q):
    """Cranks, the point where the distal bars meet, and these bars."""
    crank = p.a * np.exp(1j * q)
    elbow = np.array([p.x1, p.x2]) + crank
    way = elbow[:, 1] - elbow[:, 0]
    height = np.sqrt(p.b**2 - np.abs(way) ** 2 / 4)
    meet = elbow.mean(axis=1) + 1j * way / np.abs(way) * height
    return crank, meet, meet[:, None] - elbow


@workbench.candidate("virtual-work", bound=1e-10, source="examples/fivebar/README.md")
def virtual_work(p, q, qd, qdd):
    """Two cranks, two distal bars that meet in the payload."""
    crank, _, distal = distals(p, q)
    # i crank_1 qd_1 + i distal_1 u = i crank_2 qd_2 + i distal_2 w
    one, two = 1j * distal[:, 0], -1j * distal[:, 1]
    inertias, masses = (p.J1 + p.IM, p.J2), (p.n1, p.n2)
    columns = [solve(one, two, -1j * crank[:, 0]), solve(one, two, 1j * crank[:, 1])]
    u, w = (columns[0][i] * qd[:, 0] + columns[1][i] * qd[:, 1] for i in (0, 1))
    swing = crank * (1j * qdd - qd**2)
    rest = swing[:, 1] - swing[:, 0] + distal[:, 0] * u**2 - distal[:, 1] * w**2
    udd, wdd = solve(one, two, rest)
    tau = np.empty_like(q)
    for j in (0, 1):
        own = np.array([j == 0, j == 1], dtype=float)
        total = 0.0
        for limb, (rate, speed, add) in enumerate(zip(columns[j], (u, w), (udd, wdd), strict=True)):
            bar, base = distal[:, limb], crank[:, limb]
            lift = bar * (1j * add - speed**2)
            spots = [
                ((p.m1, p.m2)[limb], 0.5 * 1j * base * own[limb], 0.5 * swing[:, limb]),
                (masses[limb], 1j * base * own[limb] + 0.5j * bar * rate, swing[:, limb] + 0.5 * lift),
            ]
            if limb == 0:
                spots.append((p.M, 1j * base * own[0] + 1j * bar * rate, swing[:, 0] + lift))
            for mass, velocity, acceleration in spots:
                total = total + mass * (np.conj(velocity) * (acceleration + 1j * p.g)).real
            total = total + (p.I1, p.I2)[limb] * own[limb] * qdd[:, limb] + inertias[limb] * rate * add
        tau[:, j] = total
    return tau


@workbench.forward_kinematics
def forward(p, q):
    """Where the distal bars meet, above the line of the elbows."""
    meet = distals(p, q)[1]
    return np.column_stack([meet.real, meet.imag])


@workbench.inverse_kinematics
def inverse(p, x):
    """Two circles for each limb, the elbows outside."""
    way = (x[:, 0] + 1j * x[:, 1])[:, None] - np.array([p.x1, p.x2])
    reach = np.abs(way)
    opening = np.arccos((p.a**2 + reach**2 - p.b**2) / (2 * p.a * reach))
    return np.angle(way) + opening * np.array([1.0, -1.0])


@workbench.jacobian
def jacobian(p, q):
    """Rates of (x, z): each distal bar keeps its length."""
    crank, _, distal = distals(p, q)
    rows = np.stack([distal.real, distal.imag], axis=2)
    return np.linalg.solve(rows, (np.conj(distal) * 1j * crank).real[..., None] * np.eye(2))
