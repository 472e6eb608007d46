"""Recorded torques at the times of a case: shifted by an offset, and resampled where the times differ."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import MotionError

FEWEST = 10
"""Samples that recorded torques and a case have to share."""

SAME_TIME = 1e-6
"""Of the step: times nearer than this are one."""


@dataclass(frozen=True)
class Aligned:
    """Torques at the times of a case."""

    tau: FloatArray = field(repr=False)
    """``(n, na)``, NaN where nothing was recorded"""
    inside: np.ndarray = field(repr=False)
    """``(n,)``: samples that are compared"""
    resampled: bool
    notes: tuple[str, ...]


def align(t: FloatArray, tau: FloatArray, times: FloatArray, offset: float, error: float) -> Aligned:
    """Bring torques ``(k, na)`` recorded at *t* to *times* ``(n,)``.

    Parameters
    ----------
    t, tau
        As recorded.
    times
        Of the case, s.
    offset
        Time of the case less time of the record, s.
    error
        What rounding leaves in the recorded times, s: no resampling where they differ by less.

    Raises
    ------
    MotionError
        Too few samples in common.
    """
    from scipy.interpolate import make_interp_spline

    own = t + offset
    step = float(np.median(np.diff(t)))
    slack = max(2.0 * error, SAME_TIME * step)
    if len(own) == len(times) and bool((np.abs(own - times) <= slack).all()):
        return Aligned(tau.copy(), np.ones(len(times), dtype=np.bool_), False, ())
    inside = (times >= own[0] - slack) & (times <= own[-1] + slack)
    if np.count_nonzero(inside) < min(FEWEST, len(times)):
        raise MotionError(
            f"recorded from {own[0]:.6g} s to {own[-1]:.6g} s (offset {offset:g} s), and the case runs from"
            f" {times[0]:.6g} s to {times[-1]:.6g} s: {np.count_nonzero(inside)} samples in common; allowed: at least"
            f" {FEWEST}"
        )
    curve = make_interp_spline(own - own[0], tau, k=min(3, len(own) - 1))
    found = np.full((len(times), tau.shape[1]), np.nan)
    found[inside] = curve(np.clip(times[inside], own[0], own[-1]) - own[0])
    notes = [f"torques recorded every {1e3 * step:.4g} ms are resampled to the case's times by a cubic spline"]
    if not inside.all():
        notes.append(f"{np.count_nonzero(inside)} of {len(times)} samples of the case lie inside the record")
    return Aligned(found, inside, True, tuple(notes))


def estimate_offset(t: FloatArray, values: FloatArray, times: FloatArray, wanted: FloatArray) -> tuple[float, float]:
    """Shift of recorded coordinates ``(k, m)`` at *t* under which they are those of a case ``(n, m)`` at *times*.

    Returns
    -------
    float, float
        Offset, s (case less record), and its standard error.
    """
    from scipy.interpolate import make_interp_spline
    from scipy.optimize import least_squares

    curve = make_interp_spline(times - times[0], wanted, k=3)
    span = float(times[-1] - times[0])

    def gap(offset: float) -> FloatArray:
        own = t + offset - times[0]
        inside = (own >= 0.0) & (own <= span)
        if np.count_nonzero(inside) < FEWEST:
            return np.full(values.size, 1e3)
        difference = np.where(inside[:, None], values - curve(np.clip(own, 0.0, span)), 0.0)
        out: FloatArray = (difference * np.sqrt(len(t) / np.count_nonzero(inside))).ravel()
        return out

    middle = float(times[0] - t[0])
    tried = middle + np.linspace(-0.5, 0.5, 201) * span
    start = tried[int(np.argmin([float(np.sum(gap(offset) ** 2)) for offset in (*tried,)]))]
    found = least_squares(lambda x: gap(float(x[0])), [start], x_scale=[span / 100.0], diff_step=1e-6)
    left = float(np.sum(found.fun**2)) / max(found.fun.size - 1, 1)
    slope = float(np.sum(found.jac**2))
    return float(found.x[0]), float(np.sqrt(left / slope)) if slope > 0.0 else float("inf")
