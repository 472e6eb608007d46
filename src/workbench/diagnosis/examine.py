"""Diagnosis of one formula: by part, by parameter, by body; kinematics first; all against the exact reference."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from workbench.arrays import FloatArray
from workbench.diagnosis.entries import RIGHT, UNKNOWN_MARK, WRONG_MARK, Entry, compare_parts, floors_of
from workbench.diagnosis.items import items_of
from workbench.diagnosis.kinematics import WrongJacobian, wrong_jacobian
from workbench.diagnosis.noise import JUMP, SAFETY, SEEN, noise_of
from workbench.diagnosis.parts import FORCE, ODD, REST, Parts
from workbench.diagnosis.probes import Plan, choose_poses, make_plan
from workbench.diagnosis.result import FAILURE, KINEMATICS, NUMERIC, Diagnosis, Finding, percent
from workbench.diagnosis.sentences import dynamic_findings, list_of, plain_findings
from workbench.diagnosis.shares import Share, both_sides, share_of
from workbench.diagnosis.structure import structure_findings
from workbench.diagnosis.subject import AFFINE, GRAVITY, Subject
from workbench.errors import WorkbenchError

SHARE_POSES = 6
ITEM_POSES = 12
FEWEST_POSES = 8
"""With fewer poses at which a formula answers, all are kept and what is missing is fitted."""

ROUNDED = 2e-3
"""Of an entry: where every one is off by less than this, and every parameter's share too, numbers are rounded."""

TERM = 0.02
"""Of a parameter's share: an error as large as this is a term, however little it matters for this robot."""

LOUD = 1e-4
"""Of a joint's largest part: where a formula's numbers are noisier, what parameters are worth cannot be told."""

MOST_NAMED = 6
"""Findings about dynamics that are written out; a formula that is wrong all over is not served by more."""


@dataclass(frozen=True)
class Examined:
    """What was measured, before it is put into words; what the search for a mend is guided by."""

    plan: Plan
    formula: Parts
    reference: Parts
    floors: FloatArray
    entries: list[Entry]
    shares: list[Share]
    noise: float
    """of the formula's own numbers at the first few poses, which are the quietest; a fraction of the largest parts"""
    noises: FloatArray
    """``(s,)`` the same at each pose"""
    jumps: NDArray[np.bool_]
    """``(s,)`` poses at which the formula's numbers are no function of the pose to speak of"""
    jacobian: WrongJacobian | None


Failures = dict[tuple[str | int, ...], str]
"""probe -> what the formula said"""


def examine(
    subject: Subject, poses: int | None = None, parameters: bool = True
) -> tuple[Examined, list[str], Failures]:
    """Measure parts and shares.

    Returns
    -------
    Examined, notes, failures
        What was measured, what could not be, and what the formula said where it failed, by probe.
    """
    plan = make_plan(subject, choose_poses(subject, *([poses] if poses else [])))
    formula, reference, failures = both_sides(subject, plan, {})
    notes: list[str] = []
    whole = np.all([np.isfinite(tau).all(axis=1) for tau in formula.values()], axis=0)
    if failures and FEWEST_POSES <= whole.sum() < len(whole):
        # a formula that fails at some poses, outside of a root's range for instance, is looked at where it answers
        notes.append(f"{(~whole).sum()} of {len(whole)} poses, at which the formula fails")
        plan = plan.of(np.flatnonzero(whole))
        formula, reference, _ = both_sides(subject, plan, {})
    elif failures:
        # from motion alone come a column for each acceleration, one for each force, and a check
        plan = make_plan(subject, plan.poses, len(subject.joints) + 4)
        formula, reference, failures = both_sides(subject, plan, {})
    floors = floors_of(reference)
    noises = noise_of(subject, plan, floors)
    jumps = noises > JUMP
    if FEWEST_POSES <= (~jumps).sum() < len(jumps) and _wrong_somewhere(formula, reference, floors, noises, ~jumps):
        notes.append(
            f"{jumps.sum()} of {len(jumps)} poses: the torques jump there between poses that are as good as the same,"
            " as where an iteration inside does not converge"
        )
        calm = np.flatnonzero(~jumps)
        plan, noises, jumps = plan.of(calm), noises[calm], jumps[calm]
        formula, reference = ({part: tau[calm] for part, tau in parts.items()} for parts in (formula, reference))
    if noises.any() and not jumps.any():
        # the quietest poses first: parameters are varied at the first few
        order = np.argsort(noises, kind="stable")
        plan, noises = plan.of(order), noises[order]
        formula, reference = ({part: tau[order] for part, tau in parts.items()} for parts in (formula, reference))
    noise = float(noises[min(SHARE_POSES, len(noises)) - 1]) if not jumps.any() else 0.0
    noises = np.where(jumps, 0.0, noises)
    entries = compare_parts(formula, reference, floors, noise=SAFETY * noises)
    shares: list[Share] = []
    few = plan.at(SHARE_POSES)
    mine, theirs = ({part: tau[:SHARE_POSES] for part, tau in parts.items()} for parts in (formula, reference))
    if parameters and noise < LOUD and not jumps.any() and not subject.reference({}).excess_actuators:
        wrong = any(entry.status == WRONG_MARK for entry in entries)
        refused = []
        for parameter in subject.parameters:
            if parameter.kind not in AFFINE or not (parameter.read or wrong):
                continue
            share = share_of(subject, few, parameter, mine, theirs, floors, 4 * SAFETY * noises[:SHARE_POSES])
            if share is None:
                refused.append(parameter.name)
            else:
                shares.append(share)
        if refused:
            notes.append(f"parameter {list_of(refused)}: one of the sides refuses another value")
    elif parameters and jumps.any():
        notes.append("parameters one by one: the formula's numbers jump from pose to pose")
    elif parameters and noise >= LOUD:
        notes.append("parameters one by one: the formula's numbers are too noisy for differences of torques")
    if parameters and subject.no_parameters:
        notes.append(f"parameters: {subject.no_parameters}")
    notes += _unanswered(entries, subject.joints)
    jacobian = wrong_jacobian(formula, reference, shares, subject.joints, 10 * SAFETY * noise)
    return Examined(plan, formula, reference, floors, entries, shares, noise, noises, jumps, jacobian), notes, failures


def diagnose_subject(subject: Subject) -> tuple[Diagnosis, Examined]:
    """Diagnose; suggestions are another step (`workbench.diagnosis.search`)."""
    begun = time.perf_counter()
    seen, notes, failures = examine(subject)
    if not subject.takes_force:
        notes.append("the external force: the formula does not take it (a fifth argument would be handed it)")
    findings: list[Finding] = []
    if failures:
        findings.append(_failing(failures))
    if all(entry.status == UNKNOWN_MARK for entry in seen.entries):
        return _made(subject, seen, findings, notes, begun), seen
    rounded = _rounded(seen, subject.joints)
    if rounded:
        findings.append(rounded)
        return _made(subject, seen, findings, notes, begun), seen
    loud = float(seen.noises.max(initial=0.0))
    noisy = SAFETY * loud > RIGHT
    if seen.noise or noisy:
        count = "" if seen.noise else f" at {(seen.noises > SEEN).sum()} of {len(seen.noises)} poses"
        notes.append(
            f"errors below {percent(SAFETY * loud)} of a joint's largest part{count}: the formula's own numbers are"
            f" noisy by {loud:.0e} there (single precision, finite differences, or an iteration that ends early)"
        )
    findings += about_terms(subject, seen, notes)
    if noisy and not findings:
        strict = compare_parts(seen.formula, seen.reference, seen.floors)
        off = [e for e in strict if e.status == WRONG_MARK]
        if off:
            worst = max(e.weight for e in off)
            text = (
                "no term is wrong that could be seen, but numbers are: the formula's own are noisy, and agree to"
                f" {max(1, int(-np.log10(worst)))} digits and no better"
            )
            findings.append(_of_entries(NUMERIC, text, off, subject.joints))
    if not [finding for finding in findings if finding.kind != FAILURE] and not noisy:
        findings += _other_numbers(subject, seen, notes)
    return _made(subject, seen, findings, notes, begun), seen


def about_terms(subject: Subject, seen: Examined, notes: list[str], structure: bool = True) -> list[Finding]:
    """Put what was measured into findings about terms, most telling first."""
    joints = subject.joints
    findings: list[Finding] = []
    wrong = [entry for entry in seen.entries if entry.status == WRONG_MARK]
    if not wrong and not any(share.wrong for share in seen.shares if share.parameter.read):
        return findings
    if seen.jumps.any():
        return [_jumping(seen, joints)]
    jacobian = seen.jacobian
    if jacobian:
        count = len([e for e in wrong if e.part.kind not in (ODD, REST)])
        findings.append(
            Finding(
                KINEMATICS,
                f"kinematics first: {jacobian.sentence}. {count} entries of the table may follow from it",
                tuple(joints[j] for j in jacobian.joints),
                tuple(dict.fromkeys(e.part.label(joints) for e in wrong if e.part.kind == FORCE)),
                weight=max((e.weight for e in wrong), default=float("nan")),
            )
        )
    try:
        items = {} if jacobian else items_of(subject, seen.plan.at(ITEM_POSES))
    except WorkbenchError as error:
        items = {}
        notes.append(f"bodies and directions: {error}")
    dynamic = dynamic_findings(seen.entries, seen.shares, items, seen.formula, seen.reference, joints)
    if jacobian:
        apart = [f for f in dynamic if f.ratio and f.parameters]
        dynamic = apart
    findings += dynamic[:MOST_NAMED]
    if len(dynamic) > MOST_NAMED:
        notes.append(f"{len(dynamic) - MOST_NAMED} more entries that are wrong: see the table")
    findings += plain_findings(seen.entries, joints, jacobian is not None)
    if structure:
        findings += structure_findings(subject, seen.plan, seen.formula, seen.noise)
    if not findings:
        findings.append(_unnamed(wrong, joints))
    return findings


def _unnamed(wrong: Sequence[Entry], joints: tuple[str, ...]) -> Finding:
    labels = list(dict.fromkeys(e.part.label(joints) for e in wrong))
    where = tuple(dict.fromkeys(joints[e.joint] for e in wrong))
    return Finding("dynamics", f"{list_of(labels)} of {list_of(where)}: wrong", where, tuple(labels))


def _unanswered(entries: Sequence[Entry], joints: tuple[str, ...]) -> list[str]:
    """Say which parts cannot be told from the states that the formula answers."""
    unknown = list(dict.fromkeys(e.part for e in entries if e.status == UNKNOWN_MARK))
    if not unknown or len(unknown) == len({e.part for e in entries}):
        return []
    found = []
    parts = [part.label(joints) for part in unknown if part.kind not in (ODD, REST)]
    if parts:
        found.append(f"{list_of(parts)}: the formula answers too few states to tell them from the other parts")
    if len(parts) < len(unknown):
        found.append("whether the torque is affine in accelerations and quadratic in rates: it takes states at rest")
    return found


def _wrong_somewhere(
    formula: Parts, reference: Parts, floors: FloatArray, noises: FloatArray, poses: NDArray[np.bool_]
) -> bool:
    """Whether any entry is wrong at some of the poses."""
    mine, theirs = ({part: tau[poses] for part, tau in parts.items()} for parts in (formula, reference))
    entries = compare_parts(mine, theirs, floors, noise=SAFETY * noises[poses])
    return any(entry.status == WRONG_MARK for entry in entries)


def _of_entries(kind: str, text: str, wrong: Sequence[Entry], joints: tuple[str, ...]) -> Finding:
    where = tuple(dict.fromkeys(joints[e.joint] for e in wrong))
    labels = tuple(dict.fromkeys(e.part.label(joints) for e in wrong))
    return Finding(kind, text, where, labels, weight=max((e.weight for e in wrong), default=float("nan")))


def _jumping(seen: Examined, joints: tuple[str, ...]) -> Finding:
    """Say that the formula's numbers are no smooth function of the pose, and what is right where they are."""
    jumps, wrong = seen.jumps, [entry for entry in seen.entries if entry.status == WRONG_MARK]
    text = (
        f"kinematics first: at {jumps.sum()} of {len(jumps)} poses the torques jump between poses that are as good as"
        " the same: an iteration inside does not converge there, or ends on one branch and then on another"
    )
    if not jumps.all():
        wrong_there = _wrong_somewhere(seen.formula, seen.reference, seen.floors, seen.noises, ~jumps)
        text += (
            f"; at the others it is smooth, and {'not right either' if wrong_there else 'everything is right there'}"
        )
    return _of_entries(KINEMATICS, text, wrong, joints)


def _failing(failures: Failures) -> Finding:
    kinds = {"rest": "at rest", "acceleration": "at rest, accelerating", "rate": "one joint moving alone",
             "rates": "two joints moving", "force": "at rest under a force", "mixed": "moving in general"}  # fmt: skip
    where = list(dict.fromkeys(kinds[str(label[0])] for label in failures))
    return Finding(FAILURE, f"the formula fails ({'; '.join(where)}): {next(iter(failures.values()))}")


def _rounded(seen: Examined, joints: tuple[str, ...]) -> Finding | None:
    """Say that nothing but digits is wrong, where every entry and every parameter's share is nearly right."""
    wrong = [e for e in seen.entries if e.status == WRONG_MARK and e.part.kind not in (ODD, REST)]
    if (
        seen.jumps.any()
        or not wrong
        or any(e.status == WRONG_MARK and e.part.kind in (ODD, REST) and e.weight > ROUNDED for e in seen.entries)
    ):
        return None
    if any(min(e.error, 1e2 * e.weight) > ROUNDED for e in wrong):
        return None
    shares = [e for share in seen.shares if share.parameter.read for e in share.wrong]
    if any(e.error > TERM for e in shares):
        return None
    worst = max(e.error for e in wrong)
    digits = max(1, int(-np.log10(max(e.weight for e in wrong))))
    text = (
        f"no term is wrong, but numbers are: all parts agree to {digits} digits and no better (at most {percent(worst)}"
        " off in any), as where constants are rounded, derivatives are taken by finite differences or an iteration"
        " ends early"
    )
    off = [share.parameter for share in seen.shares if share.parameter.read and share.wrong]
    shares_off = tuple(p.name for p in off if p.kind != GRAVITY) or tuple(p.name for p in off)
    if shares_off:
        text += f"; seen in what {list_of(shares_off)} {'is' if len(shares_off) == 1 else 'are'} worth"
    return replace(_of_entries(NUMERIC, text, wrong, joints), parameters=shares_off)


def _other_numbers(subject: Subject, seen: Examined, notes: list[str]) -> list[Finding]:
    """All is right for this robot: look at lengths and fractions too, each moved a little on both sides."""
    few = seen.plan.at(SHARE_POSES)
    findings = []
    for parameter in subject.parameters:
        if parameter.kind in AFFINE or not parameter.read:
            continue
        try:
            formula, reference, _ = both_sides(subject, few, {parameter.name: parameter.varied})
        except WorkbenchError:
            continue
        entries = compare_parts(formula, reference, floors_of(reference))
        wrong = [e for e in entries if e.status == WRONG_MARK]
        if wrong:
            where = tuple(dict.fromkeys(subject.joints[e.joint] for e in wrong))
            labels = tuple(dict.fromkeys(e.part.label(subject.joints) for e in wrong))
            text = (
                f"{parameter.name}: right at {parameter.value:.6g} {parameter.unit}, wrong at {parameter.varied:.6g}"
                f" ({list_of(labels[:4])} of {list_of(where)}): another length or number stands where it should"
            )
            findings.append(
                Finding("parameter", text, where, labels, (parameter.name,), weight=max(e.weight for e in wrong))
            )
    return findings


def _made(subject: Subject, seen: Examined, findings: list[Finding], notes: list[str], begun: float) -> Diagnosis:
    return Diagnosis(
        title=subject.title,
        candidate=subject.candidate,
        joints=subject.joints,
        findings=tuple(findings),
        entries=tuple(seen.entries),
        not_covered=tuple(notes),
        poses=len(seen.plan.poses),
        states=seen.plan.q.shape[0] * seen.plan.q.shape[1] * (1 + len(seen.shares)),
        seconds={"findings": round(time.perf_counter() - begun, 2)},
    )


def with_suggestions(diagnosis: Diagnosis, suggestions: Sequence[object], seconds: float) -> Diagnosis:
    """Return the diagnosis with the mends that a search found."""
    return replace(
        diagnosis,
        suggestions=tuple(suggestions),  # type: ignore[arg-type]
        seconds={**diagnosis.seconds, "suggestions": round(seconds, 2)},
    )
