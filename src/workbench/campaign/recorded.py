"""Recorded torques of one case held against the reference: errors, verdicts with reasons, where the difference lies.

Nothing here is a closed form: these rows are a kind of their own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.motion_spec import RecordedMotion
from workbench.campaign.recorded_spec import RecordedSpec, wanted_of
from workbench.campaign.unloaded import joint_error, largest_reaction, normaliser_of
from workbench.campaign.verdict import AGREES, DIFFERS, FAIL, PASS, UNDECIDED
from workbench.capabilities.robot import Robot
from workbench.errors import MotionError, SpecError, WorkbenchError, did_you_mean
from workbench.metrics import JointError
from workbench.motion import JointMotion
from workbench.motion.digits import FULL
from workbench.recorded.align import align, estimate_offset
from workbench.recorded.propagate import Uncertainty, uncertainty
from workbench.recorded.read import Record, Written, read_record
from workbench.recorded.regression import Split, amount, columns_of, sentence, split, units_of
from workbench.recorded.smoothing import Smoothed, smooth
from workbench.reference import MujocoReference, ReferenceResult

FINE = 1e-3
"""Of the peak torque: what agreement should be worth where no bound is given."""

ALARM = 1.5
"""Widths of the band from which on torques differ: one joint in twenty leaves the band, and false alarms cost days."""

NOISE_DRAWN_FROM = 24
"""Samples of torques; fewer say nothing of their own noise."""


@dataclass(frozen=True, eq=False)
class EstimatedMotion(JointMotion):
    """A motion whose derivatives were estimated, with what that leaves open."""

    smoothed: tuple[Smoothed, ...] = ()
    written: tuple[Written, ...] = ()


@dataclass(frozen=True)
class Judged:
    """One joint of one record."""

    joint: str
    error: JointError
    normaliser: float
    uncertainty: float
    """relative to the normaliser"""
    verdict: str
    reason: str
    split: Split


@dataclass(frozen=True)
class Found:
    """One record on one case."""

    spec: RecordedSpec
    joints: tuple[Judged, ...]
    tau: FloatArray = field(repr=False)
    band: FloatArray = field(repr=False)
    facts: dict[str, Any] = field(repr=False)


def recorded_motion(spec: RecordedMotion, path: Path, robot: Robot) -> EstimatedMotion:
    """Read coordinates and differentiate them.

    Raises
    ------
    MotionError
        A table that cannot be read, without coordinates, or too short.
    """
    found = read_record(
        path, robot.joints, robot.coordinate_units, robot.force_units, wanted_of(spec.columns), torques=False
    )
    assert found.q is not None
    if not len(found.t) >= 2:
        raise MotionError(f"{path}: {len(found.t)} samples")
    try:
        smoothed = tuple(
            smooth(found.t, column, written.half) for column, written in zip(found.q.T, found.written_q, strict=True)
        )
    except MotionError as error:
        raise MotionError(f"{path}: {error}", **error.facts) from error
    notes = [f"{path.name}: {note}" for note in found.notes]
    notes += [
        f"{path.name}: {joint} is smoothed at {one.bandwidth:.3g} Hz, noise {one.sigma:.2g} {unit} per sample"
        for joint, unit, one in zip(robot.joints, robot.coordinate_units, smoothed, strict=True)
        if math.isfinite(one.bandwidth) and one.bandwidth > 0.0
    ]
    q, qd, qdd = (np.column_stack([getattr(one, name) for one in smoothed]) for name in ("q", "qd", "qdd"))
    return EstimatedMotion(found.t, q, qd, qdd, tuple(notes), smoothed, found.written_q)


def records_of(specs: list[RecordedSpec], case: str, cases: list[str], file: str) -> list[RecordedSpec]:
    """The records that belong to a case.

    Raises
    ------
    SpecError
        A record that names no case where there are several, or one that does not exist.
    """
    labels = [spec.label for spec in specs]
    for spec in specs:
        if labels.count(spec.label) > 1:
            raise SpecError(f'{file}: two records have the label "{spec.label}"', file=file)
        if spec.case is None and len(cases) > 1:
            raise SpecError(f'{file}: recorded "{spec.label}": case: missing; the campaign has {len(cases)}', file=file)
        if spec.case is not None and spec.case not in cases:
            hint = did_you_mean(spec.case, cases)
            raise SpecError(f'{file}: recorded "{spec.label}" names case "{spec.case}"{hint}', file=file)
    return [spec for spec in specs if spec.case in (None, case)]


def read_torques(spec: RecordedSpec, path: Path, robot: Robot) -> Record:
    """Read the torques of a record.

    Raises
    ------
    MotionError
        As `read_record`, with the record's label.
    """
    try:
        return read_record(path, robot.joints, robot.coordinate_units, robot.force_units, wanted_of(spec.columns))
    except MotionError as error:
        raise MotionError(f'recorded "{spec.label}": {error}', **error.facts) from error


def judge(
    spec: RecordedSpec,
    record: Record,
    motion: JointMotion,
    force: FloatArray,
    robot: Robot,
    reference: MujocoReference,
    result: ReferenceResult,
    own: Mapping[str, float],
) -> Found:
    """Hold one record against the reference.

    Parameters
    ----------
    spec, record
        What was recorded.
    motion, force, robot
        The case.
    reference, result
        MuJoCo's side, and its torques on the case.
    own
        The reference's own relative uncertainty, by joint; NaN where nobody looked.

    Raises
    ------
    WorkbenchError
        The times do not meet, or the offset cannot be estimated.
    """
    try:
        offset, doubt, notes = _offset(spec, record, motion)
        assert record.tau is not None
        aligned = align(record.t, record.tau, motion.t, offset, record.time_error)
    except WorkbenchError as error:
        raise type(error)(f'recorded "{spec.label}": {error}', **error.facts) from error
    inside = aligned.inside

    def torque(q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        return reference.inverse_dynamics(q, qd, qdd, spec.reference, force[: len(q)], near=result.qpos).tau

    smoothed = motion.smoothed if isinstance(motion, EstimatedMotion) else None
    noise = _noise(record)
    rate = np.gradient(result.tau, motion.t, axis=0)
    open_ = uncertainty(torque, (motion.q, motion.qd, motion.qdd), smoothed, noise, doubt * np.abs(rate))
    zero = np.zeros_like(motion.q)
    rest = torque(motion.q, zero, zero)
    inertia = torque(motion.q, zero, motion.qdd) - rest
    reaction = largest_reaction(result.reactions.values())
    joints = []
    for i, joint in enumerate(robot.joints):
        tau, ref = aligned.tau[inside, i], result.tau[inside, i]
        apart = joint_error(tau, ref, reaction)
        normaliser = normaliser_of(apart, reaction)
        fit = split(
            joint,
            tau - ref,
            columns_of(motion.t[inside], ref, motion.qd[inside, i], rest[inside, i], inertia[inside, i]),
            units_of(robot.coordinate_units[i], robot.force_units[i]),
            open_.sigma[inside, i],
            open_.draws[:, inside, i],
        )
        relative = float(open_.peak[i]) / normaliser if normaliser > 0.0 else math.inf
        relative = float(np.nanmax([relative, own.get(joint, math.nan)]))
        within = bool((np.abs(tau - ref) <= ALARM * open_.band[inside, i] + own_part(own, joint, normaliser)).all())
        verdict = verdict_of(apart.peak_error, relative, within, spec.bound)
        reason = _reason(verdict, spec, apart.peak_error, relative, motion, open_, i, robot)
        joints.append(Judged(joint, apart, normaliser, relative, verdict, reason, fit))
    where = np.flatnonzero(inside)
    joints = [_at(one, int(where[one.error.worst_index])) for one in joints]
    facts = _facts(spec, record, motion, robot, aligned.notes + tuple(notes), offset, doubt, inside, joints, noise)
    return Found(spec, tuple(joints), aligned.tau, open_.band, facts)


def own_part(own: Mapping[str, float], joint: str, normaliser: float) -> float:
    """The reference's own uncertainty in the joint's unit."""
    share = own.get(joint, math.nan)
    return share * normaliser if share == share else 0.0


def verdict_of(error: float, relative: float, within: bool, bound: float | None) -> str:
    """Judge one joint: *error* and its uncertainty *relative*, both over the peak; *within* its band all along."""
    if bound is not None:
        if error + relative <= bound:
            return PASS
        return FAIL if error - relative > bound else UNDECIDED
    return AGREES if within else DIFFERS


def _at(one: Judged, sample: int) -> Judged:
    import dataclasses

    return dataclasses.replace(one, error=dataclasses.replace(one.error, worst_index=sample))


def _offset(spec: RecordedSpec, record: Record, motion: JointMotion) -> tuple[float, float, list[str]]:
    if spec.offset != "estimate":
        return float(spec.offset), record.time_error, []
    if record.q is None:
        raise MotionError(
            'offset = "estimate" needs the coordinates in the record too; allowed: a number of seconds, or columns for'
            " the coordinates"
        )
    offset, error = estimate_offset(record.t, record.q, motion.t, motion.q)
    return offset, error, [f"time offset estimated from the coordinates: {1e3 * offset:.5g} ms ± {1e3 * error:.2g} ms"]


def _noise(record: Record) -> FloatArray:
    """Standard deviation of each torque's own noise: of its digits, or of what it shows."""
    assert record.tau is not None
    if len(record.t) < NOISE_DRAWN_FROM:
        return np.array([written.sigma for written in record.written_tau])
    return np.array(
        [
            smooth(record.t, column, written.half).sigma
            for column, written in zip(record.tau.T, record.written_tau, strict=True)
        ]
    )


def _percent(value: float) -> str:
    return f"{100 * value:.2g} %" if value < 10.0 else f"{value:.2g} times"


def _reason(
    verdict: str,
    spec: RecordedSpec,
    error: float,
    relative: float,
    motion: JointMotion,
    open_: Uncertainty,
    i: int,
    robot: Robot,
) -> str:
    """Why a joint is judged as it is, in one line."""
    left = f"motion and recorder leave {_percent(relative)} of its peak open"
    way = ""
    if open_.noise_peak[i] > 0.7 * open_.peak[i]:
        left += " (the noise of the recorded torques themselves; the parts below are averages and know more)"
    elif isinstance(motion, EstimatedMotion):
        way = _way(motion, spec.bound or FINE, relative)
        worst = max(range(len(motion.smoothed)), key=lambda j: float(np.median(motion.smoothed[j].covariance[:, 2, 2])))
        one, written = motion.smoothed[worst], motion.written[worst]
        step = 1e3 * float(np.median(np.diff(motion.t)))
        doubt = 2.0 * float(np.sqrt(one.covariance[:, 2, 2].max()))
        how = f"{written.digits} digits" if written.digits < FULL else f"noise of {one.sigma:.2g}"
        unit = robot.coordinate_units[worst]
        left += f" ({robot.joints[worst]}: {how} every {step:.3g} ms, acceleration to ±{doubt:.2g} {unit}/s^2)"
    said = {
        AGREES: f"agrees within its uncertainty: {_percent(error)} seen, {left}{way}",
        DIFFERS: f"differs by {_percent(error)}, and {left}",
        PASS: f"{_percent(error)} seen and {left}: both together within {_percent(spec.bound or 0.0)}",
        FAIL: f"{_percent(error)} seen, and {left}: beyond {_percent(spec.bound or 0.0)}",
        UNDECIDED: f"undecided: {_percent(error)} seen, but {left}{way}",
    }
    return said[verdict]


def _way(motion: EstimatedMotion, target: float, relative: float) -> str:
    """Which digits, or which rate, would decide: the smoother's own uncertainty with less noise."""
    rounded = [one for one, w in zip(motion.smoothed, motion.written, strict=True) if w.digits < FULL]
    noisy = rounded or list(motion.smoothed)
    aim = target / 2.0
    if relative <= aim:
        return ""
    for more in range(1, 10):
        if relative * max(one.quieter(10.0**more) for one in noisy) <= aim:
            if rounded:
                digits = max(w.digits for w in motion.written if w.digits < FULL) + more
                rate = f", or {100**more} times the rate" if more == 1 else ""
                return f"; {digits} digits would decide {_percent(target)}{rate}"
            return f"; a noise {10**more} times smaller would decide {_percent(target)}"
    return f"; no number of digits at this rate decides {_percent(target)}: more samples are needed"


def _facts(
    spec: RecordedSpec,
    record: Record,
    motion: JointMotion,
    robot: Robot,
    notes: tuple[str, ...],
    offset: float,
    doubt: float,
    inside: np.ndarray,
    joints: list[Judged],
    noise: FloatArray,
) -> dict[str, Any]:
    smoothed = motion.smoothed if isinstance(motion, EstimatedMotion) else ()
    return {
        "file": spec.file,
        "description": spec.description,
        "reference": spec.reference,
        "samples": len(record.t),
        "compared": int(np.count_nonzero(inside)),
        "offset_s": offset,
        "offset_error_s": doubt,
        "notes": [*(f"{Path(record.file).name}: {note}" for note in record.notes), *notes],
        "sentence": sentence([one.split for one in joints]),
        "motion": {
            joint: {
                "digits": motion.written[j].digits if isinstance(motion, EstimatedMotion) else None,
                "noise": one.sigma,
                "bandwidth_hz": one.bandwidth,
                "order": one.order,
                "largest_rate_error": 2.0 * float(np.sqrt(one.covariance[:, 1, 1].max())),
                "largest_acceleration_error": 2.0 * float(np.sqrt(one.covariance[:, 2, 2].max())),
            }
            for j, (joint, one) in enumerate(zip(robot.joints, smoothed, strict=False))
        },
        "joints": {
            one.joint: {
                "verdict": one.verdict,
                "reason": one.reason,
                "peak_error": one.error.peak_error,
                "uncertainty": one.uncertainty,
                "torque_noise": float(noise[j]),
                "explained": one.split.explained,
                "parts": [
                    {"name": p.name, "value": p.value, "standard_error": p.error, "unit": p.unit, "share": p.share,
                     "text": amount(p)}
                    for p in one.split.parts
                ],
            }
            for j, one in enumerate(joints)
        },
    }  # fmt: skip
