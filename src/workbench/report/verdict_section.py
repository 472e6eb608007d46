"""The verdict in one sentence, and what was put to the test."""

from __future__ import annotations

from workbench.report.load import Run
from workbench.report.manifest import Manifest
from workbench.report.section import Section
from workbench.report.tables import (
    CHECKED,
    ERROR_VERDICT,
    FAILED,
    FAILURES,
    NOT_COMPUTED,
    PASSED_VERDICT,
    UNDECIDED_VERDICT,
    Cell,
    Status,
    Table,
    columns,
)
from workbench.report.text import exact, scientific


def verdict_section(run: Run) -> Section:
    """Say in one sentence whether every bound holds, and list the formulas that were tested."""
    status, sentence = verdict(run)
    sentence = sentence[:1].upper() + sentence[1:]
    contrasts = {row.candidate for row in run.rows if row.kind == "contrast"}
    tested = sum(name not in contrasts for name in run.manifest.candidates)
    table = candidates_table(run.manifest)
    cases = _cases(len(run.manifest.cases))
    about = f"{model_text(run.manifest)}, {cases}, {tested} candidate{'s' if tested != 1 else ''}."
    context = {"status": status, "sentence": sentence, "about": about, "tables": [table]}
    context["diagnosis"] = {name: found for name, found in run.manifest.diagnosis.items() if found.findings}
    return Section("verdict", "Verdict", "verdict", context)


def candidates_table(manifest: Manifest) -> Table:
    """List the formulas that a campaign puts to the test."""
    return Table(
        "candidates",
        "The candidates: the formulas that this campaign puts to the test.",
        columns(("Candidate", "Mass model", "What it is", "Source")),
        tuple(
            (Cell(name), Cell(candidate.mass_model), Cell(candidate.description), Cell(candidate.source))
            for name, candidate in manifest.candidates.items()
        ),
        "The mass model is the assumption about the bars' masses that a formula shares with its reference.",
    )


def model_text(manifest: Manifest) -> str:
    """Name the mechanism, its paper and the model's file."""
    key = f" [{manifest.model.reference_key}]" if manifest.model.reference_key else ""
    return f"{manifest.model.title or manifest.model.mechanism}{key}, model {manifest.model.file}"


def circumstances(manifest: Manifest) -> tuple[str, ...]:
    """Say when and where the run was made: with what its formulas cost there, all that differs from run to run."""
    machine = ", ".join(f"{key} {value}" for key, value in manifest.machine.items())
    seconds = "" if manifest.seconds is None else f", in {manifest.seconds:.1f} s"
    told = [
        f"Run {manifest.started or 'at an unknown time'}{seconds}" + (f", on {machine}" if machine else ""),
        f"Git commit {manifest.git_commit}" if manifest.git_commit else "",
    ]
    return tuple(f"{text}." for text in told if text)


def verdict(run: Run) -> tuple[Status, str]:
    """Return the overall status and the sentence; a failed row or case is never hidden by the manifest's own status."""
    cases = run.manifest.cases
    checks = [row for row in run.rows if row.verdict in CHECKED]
    failed = [row for row in checks if row.verdict == "fail"]
    undecided = [row for row in run.rows if row.verdict == "undecided"]
    declared = [row for row in run.rows if row.verdict in ("expected-fail", "unexpected-pass")]
    unseen = [row for row in declared if row.verdict == "unexpected-pass"]
    broken = [name for name, record in cases.items() if record.status in NOT_COMPUTED]
    # A case can fail with every row within its bound: its kinematics disagree, and its message says so.
    accused = {row.case for row in run.rows if row.verdict in FAILURES}
    other = [name for name, record in cases.items() if record.status == "failed" and name not in accused]

    worst = max(checks, key=lambda row: row.badness, default=None)
    where = ""
    if worst is not None:
        where = (
            f"worst is {worst.candidate} on joint {worst.joint} in case {worst.case}: "
            f"{scientific(worst.peak_error)} of the "
            f"reference's peak against a bound of {exact(worst.bound)}"
        )
    bad = []
    if failed:
        bad.append(f"{len(failed)} of {len(checks)} checks exceed their bound ({where})")
    if undecided:
        bad.append(
            f"{len(undecided)} of {len(checks)} checks are undecided, because the reference's own uncertainty is not "
            f"below a tenth of the bound ({', '.join(dict.fromkeys(row.case for row in undecided))})"
        )
    if unseen:
        bad.append(f"{len(unseen)} of {len(declared)} declared failures did not happen")
    if other:
        bad.append(f"{_cases(len(other))} failed for another reason ({', '.join(other)})")
    if broken:
        bad.append(f"{len(broken)} of {_cases(len(cases))} could not be computed ({', '.join(broken)})")
    if failed or unseen or other or (run.manifest.status == "failed" and not undecided):
        return FAILED, f"{', and '.join(bad) or 'the run says so, though no row of it does'}."
    if undecided:
        held = f"; the other {len(checks) - len(undecided)} hold their bounds" if len(checks) > len(undecided) else ""
        return UNDECIDED_VERDICT, f"{', and '.join(bad)}{held}."
    if broken or run.manifest.status == "error":
        held = f"; the {len(checks)} checks that were made hold their bounds" if checks else ""
        return ERROR_VERDICT, f"{', and '.join(bad) or 'the run ended in an error'}{held}."
    seen = f"all {len(declared)} declared failures show" if declared else ""
    if not checks:
        if not declared:
            return UNDECIDED_VERDICT, "no formula was held against a bound, so nothing is verified."
        return PASSED_VERDICT, f"{seen} in {_cases(len(cases))}; no other check was made."
    also = f", and {seen}" if seen else ""
    return PASSED_VERDICT, f"all {len(checks)} checks in {_cases(len(cases))} hold their bounds{also}; {where}."


def _cases(number: int) -> str:
    return f"{number} case" if number == 1 else f"{number} cases"
