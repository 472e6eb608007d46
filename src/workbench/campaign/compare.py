"""One case computed: reference and candidates on the same motion, and the rows that say how far apart they are."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.actuators import demand_facts
from workbench.campaign.candidate_spec import CandidateSpec
from workbench.campaign.cases import Case, at_time
from workbench.campaign.evidence import FULL, Effort, Evidence, gather_evidence
from workbench.campaign.kinematics import check_kinematics
from workbench.campaign.platform import Platform, platform_of
from workbench.campaign.recorded import Found, judge
from workbench.campaign.recorded_spec import RecordedSpec
from workbench.campaign.series import series_of
from workbench.campaign.spec import Campaign
from workbench.campaign.spent import spent_on
from workbench.campaign.torques import Fault, torques_of
from workbench.campaign.unloaded import joint_errors, largest_reaction, normaliser_of
from workbench.campaign.verdict import CONTRAST, FAIL, FAILURES, RECORDED, kind_of, verdict_of
from workbench.errors import ModelError, MotionError
from workbench.hints import hint_of
from workbench.recorded.read import Record
from workbench.reference import MujocoReference, ReferenceResult
from workbench.reference.crossings import look, refuse_crossings, worth
from workbench.reference.raw_inverse import raw_mj_inverse
from workbench.reference.skeleton import skeleton

RAW_INVERSE = "raw mj_inverse"
"""Name of the row that shows MuJoCo's inverse dynamics as it comes."""

RAW_DESCRIPTION = {
    "mass_model": "distributed",
    "description": "mj_inverse as it comes, without projecting the constraint forces out: not a candidate, a contrast",
    "source": "docs/evidence.md",
}
RAW_NAME = "raw"

KINEMATICS_BOUND = 1e-11
"""Largest difference of platform position, velocity or acceleration between closed form and MuJoCo, over their peaks:
rounding, with two digits to spare near singular poses."""

OTHER_BRANCH = 1e-6
"""Metres; a platform farther than this from the closed form's is another pose of the robot, not rounding."""


@dataclass(frozen=True)
class Row:
    """One line of ``summary.csv``: a candidate against a reference on one joint of one case."""

    case: str
    candidate: str
    reference: str
    joint: str
    peak_error: float
    rms_error: float
    pointwise_error: float
    worst_time_s: float
    bound: float | None
    verdict: str
    kind: str
    unit: str
    peak_reference: float
    pointwise_skipped: int
    normaliser: float
    """what the absolute errors are divided by: `peak_reference`, unless the joint is unloaded"""
    uncertainty: float
    """the reference's own, relative: the larger of the two that follow; NaN where neither was looked at"""
    power_residual: float
    engine_spread: float


@dataclass(frozen=True)
class CaseResult:
    """What a computed case leaves behind: rows, facts for the manifest, and time series where somebody asks."""

    name: str
    rows: list[Row]
    columns: Callable[[], dict[str, FloatArray]] = field(repr=False)
    """how `series` is made; most cases of a sweep keep none"""
    facts: dict[str, Any] = field(repr=False)
    faults: Sequence[Fault] = ()
    """what the user's candidates did wrong"""
    model: Any = field(default=None, repr=False)
    """MuJoCo's model of the reference, the case's parameters in it; with drawings only"""
    qpos: FloatArray | None = field(default=None, repr=False)
    """``(n, nq)`` its poses, MuJoCo's own coordinates; with drawings only"""

    @cached_property
    def series(self) -> dict[str, FloatArray]:
        """Time series by name of their column, ``(n,)`` each; docs/run-directory.md lists them."""
        return self.columns()


def compute_case(campaign: Campaign, case: Case, effort: Effort = FULL) -> CaseResult:
    """Compute one case, with the evidence that *effort* asks for.

    Raises
    ------
    MotionError
        The reference cannot follow the motion; the message names the time and the joint.
    ModelError
        The model's platform is somewhere else than the closed form's.
    """
    motion, robot = case.motion, case.robot
    reference = case.robot.reference
    reference.threads = effort.threads
    results: dict[str, ReferenceResult] = {}
    try:
        for mass_model in _references(campaign, case):
            results[mass_model] = reference.inverse_dynamics(
                motion.q, motion.qd, motion.qdd, mass_model, case.force, along=motion.t
            )
        first = next(iter(results.values()))
        names = dict.fromkeys(c.name for c in campaign.candidate)
        computed = torques_of(case, names, first, timed=effort.timed)
        torques = computed.torques
    except MotionError as error:
        raise at_time(error, motion.t) from error
    left = _left_out(case, reference, first)
    platform = platform_of(case, first)
    if robot.closed_kinematics:  # else the case's platform motion is the reference's own
        _refuse_other_branch(case, platform.task[0])
    sound = [name for name in torques if name not in computed.faults]
    # before other poses are closed: the reference still holds those of the motion
    columns, spent = spent_on(case, reference, next(iter(results)), first) if effort.drawing else ({}, {})
    evidence = gather_evidence(case, reference, results, sound, effort)
    felt = {name: largest_reaction(result.reactions.values()) for name, result in results.items()}
    rows = [
        row
        for candidate in campaign.candidate
        for row in _rows(case, candidate, computed.judged(candidate.name), results[candidate.reference], evidence, felt)
    ]
    rows = [dataclasses.replace(row, verdict=FAIL) if row.candidate in computed.faults else row for row in rows]
    hints = _hints(case, rows, torques, results)
    recorded = [_recorded(case, spec, record, reference, results, evidence) for spec, record in case.records]
    rows += [row for found in recorded for row in _recorded_rows(case, found, evidence)]
    if effort.budget:
        rows += _raw_rows(case, reference, results, evidence, felt)
    facts = _facts(case, first, rows, platform) | {"evidence": evidence.facts()}
    if effort.described:
        facts |= _description(case, reference, first) | {"demand": demand_facts(case, results)}
    if recorded:
        facts["recorded"] = {found.spec.label: found.facts for found in recorded}
    facts["warnings"] = [*facts["warnings"], *hints, *left]
    drawn_columns: dict[str, FloatArray] = {}
    if effort.drawing:
        drawing = skeleton(reference, first.qpos)
        for point, place in drawing.points.items():
            drawn_columns |= {f"point_{point}_{axis}": place[:, i].astype(np.float32) for i, axis in enumerate("xyz")}
        facts["drawing"] = drawing.facts()
        drawn_columns |= columns
        if spent:
            facts["spent"] = spent
    poses, drawn = (first.qpos, reference.compiled()) if effort.drawing else (None, None)
    faults = tuple(computed.faults.values())
    facts = check_kinematics(case, reference, platform).noted(computed.noted(facts))

    def series() -> dict[str, FloatArray]:
        found = series_of(case, platform, results, {name: torques[name] for name in sound}, recorded)
        return found | drawn_columns

    return CaseResult(case.name, rows, series, facts, faults, drawn, poses)


def _left_out(case: Case, reference: MujocoReference, result: ReferenceResult) -> tuple[str, ...]:
    """What a reader has to know of the file and of what is left out of it.

    Raises
    ------
    MotionError
        The motion meets a limit or a contact that is left out, and the campaign does not say that it may.
    """
    ignore = case.robot.description.robot.setup.ignore
    motion = case.motion
    try:
        notes = refuse_crossings(look(reference, result), ignore, motion.t)
    except MotionError as error:
        raise at_time(error, motion.t) from error
    return (*reference.loaded.notes, *notes, *worth(reference, ignore, (motion.q, motion.qd, motion.qdd), result.tau))


def _hints(
    case: Case, rows: Sequence[Row], torques: Mapping[str, FloatArray], results: Mapping[str, ReferenceResult]
) -> list[str]:
    """What the errors of candidates that fail look like, where they have a familiar shape."""
    failed = dict.fromkeys((row.candidate, row.reference) for row in rows if row.verdict in FAILURES)
    said = []
    for name, reference in failed:
        words = hint_of(torques[name], results[reference].tau, case.motion.t, case.robot.joints)
        said += [f'candidate "{name}" against "{reference}": {words}'] if words else []
    return said


def _refuse_other_branch(case: Case, x: FloatArray) -> None:
    """Refuse a model whose platform ``(n, m)`` is elsewhere: torques on another assembly branch compare nothing."""
    gaps = np.linalg.norm(case.x - x, axis=1)
    worst = int(gaps.argmax())
    if gaps[worst] > OTHER_BRANCH:
        raise ModelError(
            f"{case.model}: the platform is {gaps[worst]:.3g} m from where the closed form puts it at t ="
            f" {case.motion.t[worst]:.6g} s; allowed: {OTHER_BRANCH:g} m; is the home pose on another assembly branch?",
            file=str(case.model),
            time=float(case.motion.t[worst]),
            value=float(gaps[worst]),
        )


def _raw_rows(
    case: Case,
    reference: MujocoReference,
    results: Mapping[str, ReferenceResult],
    evidence: Evidence,
    felt: Mapping[str, float],
) -> list[Row]:
    """What `mj_inverse` gives without projection, beside the candidates: why the reference projects."""
    motion = case.motion
    name = "distributed" if "distributed" in results else next(iter(results))
    spec = CandidateSpec(name=RAW_NAME, reference=name)
    result = results[name]
    tau = raw_mj_inverse(reference, motion.q, motion.qd, motion.qdd, name, case.force, motion.t, known=result)
    rows = _rows(case, spec, tau, result, evidence, felt)
    return [dataclasses.replace(row, candidate=RAW_INVERSE, kind=CONTRAST) for row in rows]


def _rows(
    case: Case,
    candidate: CandidateSpec,
    tau: FloatArray,
    reference: ReferenceResult,
    evidence: Evidence,
    felt: Mapping[str, float],
) -> list[Row]:
    """Rows of one candidate; *felt* is the largest reaction by reference."""
    rows = []
    reaction = felt[candidate.reference]
    known = case.robot.candidates.get(candidate.name)
    mass_model = known.mass_model if known else candidate.reference
    errors = joint_errors(tau, reference.tau, reaction)
    for i, (joint, error) in enumerate(zip(case.robot.joints, errors, strict=True)):
        uncertainty = evidence.uncertainty(candidate.reference, joint)
        judged = candidate.in_case(case.spec, joint)
        rows.append(
            Row(
                case=case.name,
                candidate=candidate.name,
                reference=candidate.reference,
                joint=joint,
                peak_error=error.peak_error,
                rms_error=error.rms_error,
                pointwise_error=error.pointwise_error,
                worst_time_s=float(case.motion.t[error.worst_index]),
                bound=judged.bound,
                verdict=verdict_of(judged, case.name, joint, error.peak_error, uncertainty),
                kind=kind_of(candidate, mass_model),
                unit=case.robot.force_units[i],
                peak_reference=error.peak_reference,
                pointwise_skipped=error.pointwise_skipped,
                normaliser=normaliser_of(error, reaction),
                uncertainty=uncertainty,
                power_residual=evidence.power_residual(candidate.reference),
                engine_spread=evidence.engine_spread(candidate.reference, joint),
            )
        )
    return rows


def _references(campaign: Campaign, case: Case) -> tuple[str, ...]:
    named = [c.reference for c in campaign.candidate] + [spec.reference for spec, _ in case.records]
    return tuple(dict.fromkeys(named)) or ("distributed",)


def _recorded(
    case: Case,
    spec: RecordedSpec,
    record: Record,
    reference: MujocoReference,
    results: Mapping[str, ReferenceResult],
    evidence: Evidence,
) -> Found:
    own = {joint: evidence.uncertainty(spec.reference, joint) for joint in case.robot.joints}
    result = results[spec.reference]
    return judge(spec, record, case.motion, case.force, case.robot, reference, result, own)


def _recorded_rows(case: Case, found: Found, evidence: Evidence) -> list[Row]:
    return [
        Row(
            case=case.name,
            candidate=found.spec.label,
            reference=found.spec.reference,
            joint=one.joint,
            peak_error=one.error.peak_error,
            rms_error=one.error.rms_error,
            pointwise_error=one.error.pointwise_error,
            worst_time_s=float(case.motion.t[one.error.worst_index]),
            bound=found.spec.bound,
            verdict=one.verdict,
            kind=RECORDED,
            unit=case.robot.force_units[i],
            peak_reference=one.error.peak_reference,
            pointwise_skipped=one.error.pointwise_skipped,
            normaliser=one.normaliser,
            uncertainty=one.uncertainty,
            power_residual=evidence.power_residual(found.spec.reference),
            engine_spread=evidence.engine_spread(found.spec.reference, one.joint),
        )
        for i, one in enumerate(found.joints)
    ]


def _facts(case: Case, result: ReferenceResult, rows: list[Row], platform: Platform) -> dict[str, Any]:
    """What is judged of a case, and figures that a sweep stores."""
    t = case.motion.t
    speed = np.linalg.norm(result.xd, axis=1)
    acceleration = np.linalg.norm(result.xdd, axis=1)
    measures = case.singularity
    kinematics = {}
    if case.robot.closed_kinematics:  # else case.x is the reference's own
        kinematics = {
            "position": platform.apart(0),
            "velocity": platform.apart(1),
            "acceleration": platform.apart(2),
        }
    apart = [f"{name} by {error:.2g}" for name, error in kinematics.items() if not error <= KINEMATICS_BOUND]
    message = f"platform {', '.join(apart)} of its peak (allowed: {KINEMATICS_BOUND:g})" if apart else None
    failed = bool(apart) or any(row.verdict in FAILURES for row in rows)
    return {
        "status": "failed" if failed else "passed",
        "message": message,
        "samples": len(t),
        "closure_residual": float(result.closure_residual.max()),
        "velocity_residual": float(result.velocity_residual.max()),
        "acceleration_residual": float(result.acceleration_residual.max()),
        "condition": float(result.condition.max()),
        "peak_speed": float(speed.max()),
        "speed_at_s": float(t[int(speed.argmax())]),
        "peak_acceleration": float(acceleration.max()),
        "acceleration_at_s": float(t[int(acceleration.argmax())]),
        "singularity": {
            name: {"min": float(np.abs(v).min()), "time": float(t[int(np.abs(v).argmin())])}
            for name, v in measures.items()
        },
        "kinematics": kinematics,
        "warnings": [
            *case.motion.warnings,
            *case.robot.warnings(case.motion.t, case.motion.q, case.motion.qd, measures),
        ],
    }


def _description(case: Case, reference: MujocoReference, result: ReferenceResult) -> dict[str, Any]:
    """What a manifest says of a case beyond that."""
    t, mobility = case.motion.t, reference.mobility()
    return {
        "title": case.spec.title,
        "description": case.spec.description,
        "duration_s": float(t[-1] - t[0]),
        "parameters": case.overrides,
        "external_force": list(case.spec.external_force),
        "mobility": mobility.mobility,
        "joint_freedoms": mobility.joint_freedoms,
        "rank": mobility.rank,
        "constraint_rows": mobility.constraint_rows,
        "redundant_rows": mobility.redundant_rows,
        "idle_freedoms": mobility.idle_freedoms,
        "conditions": [dataclasses.asdict(c) for c in case.robot.conditions(case.motion.q)],
        "solutions_at_start": case.robot.assembly_solutions(case.motion.q[:1])[0].tolist(),
        "peak_reactions": {name: float(np.linalg.norm(f, axis=1).max()) for name, f in result.reactions.items()},
    }
