"""Sinusoidal motions of joints and of the platform, with analytic derivatives.

[Almeida2010] eq. (16)-(18), and sums of such terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray
from workbench.errors import MotionError
from workbench.motion.base import POSITION, JointMotion, PlatformMotion, as_coordinates, as_times
from workbench.motion.checks import as_list, as_number, as_vector


class Harmonic(NamedTuple):
    """One term ``amplitude * sin(frequency * t + phase)`` of a joint's motion."""

    amplitude: float
    """m or rad"""
    frequency: float
    """rad/s, >= 0"""
    phase: float = 0.0
    """rad"""


def sine(
    t: ArrayLike,
    offset: Sequence[float],
    amplitude: Sequence[float],
    frequency: Sequence[float],
    phase: Sequence[float] | None = None,
) -> JointMotion:
    """One sinusoid per joint: q_i = offset_i + amplitude_i sin(frequency_i t + phase_i), [Almeida2010] eq. (16)-(18).

    Parameters
    ----------
    t
        Times in seconds, ``(n,)``, strictly increasing.
    offset, amplitude
        One entry per joint, in actuator order, m or rad.
    frequency
        One entry per joint, rad/s, >= 0.
    phase
        One entry per joint, rad; None is zero.

    Raises
    ------
    MotionError
        Numbers of entries that differ, an entry that is not finite, or a negative frequency.
    """
    joints = len(as_vector("sine: offset", offset, ""))
    columns = {"amplitude": amplitude, "frequency": frequency, "phase": [0.0] * joints if phase is None else phase}
    rows = [as_vector(f"sine: {name}", column, "", joints) for name, column in columns.items()]
    return multi_sine(t, offset, [[Harmonic(*term)] for term in zip(*rows, strict=True)])


def multi_sine(t: ArrayLike, offset: Sequence[float], terms: Sequence[Sequence[Sequence[float]]]) -> JointMotion:
    """Sum any number of sinusoids per joint: q_i = offset_i + sum_k amplitude_ik sin(frequency_ik t + phase_ik).

    Parameters
    ----------
    t
        Times in seconds, ``(n,)``, strictly increasing.
    offset
        One entry per joint, in actuator order, m or rad.
    terms
        Per joint a sequence of `Harmonic` or ``(amplitude, frequency, phase)``; an empty one holds the joint still.

    Raises
    ------
    MotionError
        Another number of joints in *terms* than in *offset*, a term that is not two or three finite numbers, or a
        negative frequency; the message names joint and term.
    """
    times = as_times(t)
    offsets = as_vector("offset", offset, "")
    joints = as_list("terms", terms, "joints, each a list of terms")
    if len(joints) != len(offsets):
        raise MotionError(f"terms has {len(joints)} joints; allowed: {len(offsets)}, as offset has", value=len(joints))
    q = np.tile(np.array(offsets), (len(times), 1))
    qd, qdd = np.zeros_like(q), np.zeros_like(q)
    for joint, listed in enumerate(joints):
        for harmonic in _checked_terms(joint, listed):
            # overflow is reported by JointMotion, with time and joint
            with np.errstate(over="ignore", invalid="ignore"):
                _add(harmonic, times, q[:, joint], qd[:, joint], qdd[:, joint])
    return JointMotion(times, q, qd, qdd)


def platform_sine(
    t: ArrayLike,
    offset: Sequence[float],
    amplitude: Sequence[float],
    frequency: Sequence[float],
    phase: Sequence[float] | None = None,
    coordinates: Sequence[str] = POSITION,
) -> PlatformMotion:
    """As `sine`, one sinusoid per task coordinate; *coordinates* names them, m or rad each.

    Raises
    ------
    MotionError
        As `sine`, and another number of entries than of coordinates.
    """
    names = as_coordinates(coordinates)
    _check_width("platform_sine", offset, names)
    return _of_platform(sine(t, offset, amplitude, frequency, phase), names)


def platform_multi_sine(
    t: ArrayLike,
    offset: Sequence[float],
    terms: Sequence[Sequence[Sequence[float]]],
    coordinates: Sequence[str] = POSITION,
) -> PlatformMotion:
    """As `multi_sine`, any number of sinusoids per task coordinate; *coordinates* names them, m or rad each.

    Raises
    ------
    MotionError
        As `multi_sine`, and another number of entries than of coordinates.
    """
    names = as_coordinates(coordinates)
    _check_width("platform_multi_sine", offset, names)
    return _of_platform(multi_sine(t, offset, terms), names)


def _check_width(kind: str, offset: Sequence[float], names: tuple[str, ...]) -> None:
    count = len(as_vector(f"{kind}: offset", offset, ""))
    if count != len(names):
        raise MotionError(
            f"{kind}: offset has {count} entries; allowed: {len(names)}, the task coordinates {', '.join(names)}",
            value=count,
        )


def _of_platform(found: JointMotion, names: tuple[str, ...]) -> PlatformMotion:
    return PlatformMotion(found.t, found.q, found.qd, found.qdd, names)


def _add(harmonic: Harmonic, t: FloatArray, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> None:
    amplitude, frequency, phase = (np.float64(value) for value in harmonic)
    angle = frequency * t + phase
    wave = amplitude * np.sin(angle)
    q += wave
    qd += amplitude * frequency * np.cos(angle)
    qdd -= frequency * frequency * wave


def _checked_terms(joint: int, listed: Any) -> list[Harmonic]:
    rows = as_list(f"joint q{joint + 1}: terms", listed, "terms")
    result = []
    for number, term in enumerate(rows, start=1):
        where = f"joint q{joint + 1}" + (f", term {number}" if len(rows) > 1 else "")
        entries = as_list(where, term, "amplitude, frequency and phase")
        if len(entries) not in (2, 3):
            raise MotionError(
                f"{where} has {len(entries)} entries; allowed: amplitude, frequency and phase", joint=joint
            )
        harmonic = Harmonic(*entries)
        result.append(
            Harmonic(
                as_number(f"{where}: amplitude", harmonic.amplitude, ""),
                as_number(f"{where}: frequency", harmonic.frequency, "rad/s", 0.0),
                as_number(f"{where}: phase", harmonic.phase, "rad"),
            )
        )
    return result
