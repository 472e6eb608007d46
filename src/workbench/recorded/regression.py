"""Where a difference of torques lies: offset, scale, delay, friction, gravity or inertia, with standard errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.arrays import FloatArray

NEEDED = 3.0
"""A part stands out where its coefficient is so many standard errors from zero,"""

WORTH = 0.05
"""and where it takes so large a share off what is left of the difference."""

MOST = 4
"""Parts that one joint's difference is split into."""

WORDS = {
    "scale": "a scale of the torque",
    "inertia": "inertia-like (a scale of M qdd)",
    "gravity": "gravity-like (a scale of the torque at rest)",
    "delay": "a delay",
    "offset": "a constant offset",
    "dry friction": "like dry friction",
    "viscous friction": "like viscous friction",
}
"""In the order of preference where two explain the same."""


@dataclass(frozen=True)
class Part:
    """One part of the difference on one joint."""

    name: str
    value: float
    error: float
    """standard error"""
    unit: str
    share: float
    """of the difference's sum of squares that it explains, taken after the parts before it"""


@dataclass(frozen=True)
class Split:
    """The difference on one joint."""

    joint: str
    parts: tuple[Part, ...]
    explained: float
    """share of the difference's sum of squares"""


def columns_of(
    t: FloatArray, tau: FloatArray, qd: FloatArray, rest: FloatArray, inertia: FloatArray
) -> dict[str, FloatArray]:
    """What the difference on one joint may look like, each ``(n,)``: tau measured is tau plus coefficient times it."""
    return {
        "scale": tau,
        "inertia": inertia,
        "gravity": rest,
        "delay": -np.gradient(tau, t),
        "offset": np.ones_like(tau),
        "dry friction": np.sign(qd),
        "viscous friction": qd,
    }


def units_of(coordinate: str, force: str) -> dict[str, str]:
    """Unit of each coefficient; ``1`` reads best in percent."""
    return {
        "scale": "1", "inertia": "1", "gravity": "1", "delay": "s", "offset": force, "dry friction": force,
        "viscous friction": f"{force} s/{coordinate}",
    }  # fmt: skip


def split(
    joint: str,
    difference: FloatArray,
    columns: Mapping[str, FloatArray],
    units: Mapping[str, str],
    sigma: FloatArray,
    draws: FloatArray,
) -> Split:
    """Split a difference ``(n,)`` into the parts that stand out, the largest first.

    Parameters
    ----------
    joint
        Its name.
    difference
        Recorded less reference.
    columns, units
        From `columns_of` and `units_of`.
    sigma
        Standard deviation of each sample, ``(n,)``; weights are its inverse squares.
    draws
        Differences that motion and recorder may leave, ``(count, n)``: from them come the standard errors, so that
        neighbouring samples do not count as independent.
    """
    floor = max(float(np.median(sigma)), 1e-300)
    weight = 1.0 / np.maximum(sigma, floor) if sigma.any() else np.ones_like(sigma)
    y = difference * weight
    total = float(y @ y)
    chosen: list[str] = []
    left, shares = total, []
    best: tuple[FloatArray, FloatArray] = (np.zeros(0), np.zeros(0))
    usable = {name: c * weight for name, c in columns.items() if np.abs(c).max(initial=0.0) > 0.0}
    while total > 0.0 and left > 1e-12 * total and len(chosen) < MOST:
        tried = []
        for name in WORDS:
            if name in chosen or name not in usable:
                continue
            a = np.column_stack([usable[other] for other in (*chosen, name)])
            if np.linalg.matrix_rank(a / np.linalg.norm(a, axis=0), tol=1e-6) < a.shape[1]:
                continue
            value, error, rest = _fitted(a, y, draws * weight)
            if bool((np.abs(value) >= NEEDED * error).all()):
                tried.append((rest, name, value, error))
        if not tried:
            break
        # the first within a tenth of the best: the simpler explanation
        least = min(rest for rest, *_ in tried)
        rest, name, value, error = next(one for one in tried if one[0] <= least + 0.1 * (left - least))
        if left - rest < WORTH * left:
            break
        chosen.append(name)
        shares.append((left - rest) / total)
        left, best = rest, (value, error)
    parts = [Part(name, float(best[0][k]), float(best[1][k]), units[name], shares[k]) for k, name in enumerate(chosen)]
    return Split(joint, tuple(parts), 1.0 - left / total if total > 0.0 else 0.0)


def _fitted(a: FloatArray, y: FloatArray, draws: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Coefficients, standard errors, and the sum of squares that is left."""
    inverse = np.linalg.pinv(a)
    value = inverse @ y
    residual = y - a @ value
    left = float(residual @ residual)
    spread = np.einsum("kn,dn->dk", inverse, draws).std(axis=0)
    # what is left counts too, its neighbours as alike as they are
    freedom = max(len(y) - a.shape[1], 1)
    alike = float(residual[1:] @ residual[:-1]) / left if left > 0.0 else 0.0
    alike = min(max(alike, 0.0), 0.999)
    own = np.sqrt(np.sum(inverse**2, axis=1) * left / freedom * (1.0 + alike) / (1.0 - alike))
    return value, np.maximum(spread, own), left


def sentence(splits: Sequence[Split]) -> str:
    """One sentence on where the difference lies."""
    groups: dict[tuple[str, ...], list[Split]] = {}
    for one in splits:
        groups.setdefault(tuple(part.name for part in one.parts), []).append(one)
    said = []
    for names, members in groups.items():
        joints = ", ".join(one.joint for one in members)
        if not names:
            said.append(f"on {joints} nothing stands out of its standard error")
            continue
        words = " and ".join(
            f"{WORDS[name]} ({', '.join(amount(one.parts[k]) for one in members)})" for k, name in enumerate(names)
        )
        share = min(one.explained for one in members)
        said.append(f"on {joints} it is {words}, which explains {100 * share:.3g} % of it")
    text = "; ".join(said)
    return f"The difference: {text}." if text else ""


def amount(part: Part) -> str:
    """``+0.200 % +- 0.003 %``."""
    factor, unit = (100.0, "%") if part.unit == "1" else (1e3, "ms") if part.unit == "s" else (1.0, part.unit)
    value, error = factor * part.value, factor * part.error
    digits = int(np.clip(1 - np.floor(np.log10(error)), 0, 9)) if 0.0 < error < np.inf else 3
    return f"{value:+.{digits}f} {unit} ± {error:.{digits}f} {unit}"
