"""What a report says first: what was compared with what, and what a reader has to look at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from workbench.campaign.changed import few
from workbench.report.case_section import joint_heading
from workbench.report.load import Run
from workbench.report.tables import FAILURES, NOT_COMPUTED
from workbench.report.text import error_fraction, exact

MOST_ROWS = 3
"""Failing rows and lost cases that are named one by one; the others are counted."""


@dataclass(frozen=True)
class Point:
    """A sentence, and the anchor where more stands."""

    text: str
    link: str = ""


def compared(run: Run) -> str:
    """Say which formulas are held against what, on what, in how many cases."""
    manifest = run.manifest
    contrasts = {row.candidate for row in run.rows if row.kind == "contrast"}
    names = [name for name in manifest.candidates if name not in contrasts]
    listed = few(names, len(names) if len(names) <= 6 else 5)
    joints = ", ".join(joint_heading(run, joint) for joint in manifest.joints)
    samples = sum(record.samples or 0 for record in manifest.cases.values())
    formulas = f"{len(names)} formula{'s' if len(names) != 1 else ''} ({listed})" if names else "No formula"
    cases = f"{len(manifest.cases)} case{'s' if len(manifest.cases) != 1 else ''}"
    return f"{formulas} against MuJoCo's inverse dynamics of the model, on {joints}, in {cases}, {samples} samples."


def points(run: Run, anchors: Mapping[str, str]) -> list[Point]:
    """List what fails, what is missing and what was found about the papers; empty where there is nothing."""
    return [*_failures(run, anchors), *_lost(run, anchors), *_kinematics(run, anchors), *_warned(run, anchors),
            *_claims(run)]  # fmt: skip


def _failures(run: Run, anchors: Mapping[str, str]) -> list[Point]:
    failing = sorted((row for row in run.rows if row.verdict in FAILURES), key=lambda row: -row.badness)
    found = [
        Point(
            f"{row.candidate} on {joint_heading(run, row.joint)} in case {row.case}: {error_fraction(row.peak_error)} "
            + (f"against a bound of {exact(row.bound)}" if row.bound else "without a bound")
            + (", though it is declared to fail" if row.verdict == "unexpected-pass" else "")
            + (", undecided: the reference itself is too uncertain" if row.verdict == "undecided" else ""),
            anchors[row.case],
        )
        for row in failing[:MOST_ROWS]
    ]
    if len(failing) > MOST_ROWS:
        found.append(Point(f"{len(failing) - MOST_ROWS} more rows fail or cannot be decided", "worst"))
    return found


def _lost(run: Run, anchors: Mapping[str, str]) -> list[Point]:
    lost = [(name, record) for name, record in run.manifest.cases.items() if record.status in NOT_COMPUTED]
    found = [
        Point(f"case {name} was not computed" + (f": {record.message}" if record.message else ""), anchors[name])
        for name, record in lost[:MOST_ROWS]
    ]
    if len(lost) > MOST_ROWS:
        found.append(Point(f"{len(lost) - MOST_ROWS} more cases were not computed", "cases"))
    return found


def _kinematics(run: Run, anchors: Mapping[str, str]) -> list[Point]:
    bad = [name for name, record in run.manifest.cases.items() if "fail" in record.kinematics_verdicts]
    return [Point(f"kinematics of closed form and reference disagree in case {name}", anchors[name]) for name in bad]


def _warned(run: Run, anchors: Mapping[str, str]) -> list[Point]:
    warned = [name for name, record in run.manifest.cases.items() if record.warnings]
    if not warned:
        return []
    return [Point(f"warnings stand with {few(warned, MOST_ROWS)}", anchors[warned[0]])]


def _claims(run: Run) -> list[Point]:
    about = [claim for claim in run.manifest.claims if not claim.not_about]
    refuted = [claim for claim in about if claim.holds is False]
    open_ = [claim for claim in about if claim.holds is None]
    found = []
    if refuted:
        found.append(
            Point(
                f"{len(refuted)} of {len(about)} claims of the source {'does' if len(refuted) == 1 else 'do'} not hold "
                "(a finding, no failure)",
                "claims",
            )
        )
    if open_:
        found.append(Point(f"{len(open_)} of {len(about)} claims cannot be decided by this run", "claims"))
    return found
