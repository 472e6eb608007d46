"""The verdict on a whole run, made here and shown as it is by terminal, manifest, report, notebook and comparison."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from workbench.campaign.verdict import EXPECTED_FAIL, FAIL, FAILURES, PASS, UNDECIDED, UNEXPECTED_PASS

PASSED = "passed"
"""every bound holds, and at least one was held against something"""
FAILED = "failed"
UNDECIDED_RUN = "undecided"
"""no bound fails, but of some nobody can tell: the reference's own uncertainty is too large"""
INCOMPLETE = "incomplete"
"""what was computed holds its bounds, but cases are missing: not driven, lost, not finite"""
NOTHING_JUDGED = "nothing-judged"
"""no formula was held against a bound: neither good nor bad news"""

EXIT_CODES = {PASSED: 0, FAILED: 1, UNDECIDED_RUN: 1, INCOMPLETE: 1, NOTHING_JUDGED: 4}
"""What ``workbench run`` ends with; 2 is bad input, 3 a fault of the workbench."""

WORDS = {
    PASSED: "PASSED", FAILED: "FAILED", UNDECIDED_RUN: "UNDECIDED", INCOMPLETE: "INCOMPLETE",
    NOTHING_JUDGED: "NOTHING JUDGED",
}  # fmt: skip

COMPUTED = frozenset({PASSED, FAILED, UNDECIDED_RUN, NOTHING_JUDGED})
"""Statuses of cases that have numbers."""

JUDGEMENTS = frozenset({PASS, FAIL, UNDECIDED, EXPECTED_FAIL, UNEXPECTED_PASS})
"""Verdicts of rows that were held against a bound."""


class Judged(Protocol):
    """A row of errors, computed just now or read from ``summary.csv``."""

    @property
    def case(self) -> str: ...  # noqa: D102
    @property
    def candidate(self) -> str: ...  # noqa: D102
    @property
    def joint(self) -> str: ...  # noqa: D102
    @property
    def verdict(self) -> str: ...  # noqa: D102
    @property
    def peak_error(self) -> float: ...  # noqa: D102
    @property
    def bound(self) -> float | None: ...  # noqa: D102


@dataclass(frozen=True)
class CaseOutcome:
    """What became of one case, beside its rows."""

    status: str
    kinematics: Sequence[str] = ()
    """verdicts on the user's own kinematics"""


@dataclass(frozen=True)
class Conclusion:
    """The verdict on a run: a status, and a sentence that says why."""

    status: str
    sentence: str

    @property
    def text(self) -> str:
        """Word and sentence, as they stand on a terminal."""
        return f"{self.word}: {self.sentence}"

    @property
    def word(self) -> str:
        """As it stands in front of the sentence."""
        return WORDS[self.status]

    @property
    def exit_code(self) -> int:
        """Of the command that ran it."""
        return EXIT_CODES[self.status]

    @property
    def passed(self) -> bool:
        """Whether every bound holds; not where none was asked for."""
        return self.status == PASSED


def case_status(status: str, verdicts: Iterable[str]) -> str:
    """Status of one case: not ``passed`` where none of its *verdicts*, of rows and kinematics, judges anything."""
    return NOTHING_JUDGED if status == PASSED and not JUDGEMENTS.intersection(verdicts) else status


def conclude(rows: Iterable[Judged], cases: Mapping[str, CaseOutcome]) -> Conclusion:
    """Judge a run of cases by its rows and by what became of each case; nothing that failed is hidden by anything else.

    Parameters
    ----------
    rows
        All rows of the run.
    cases
        Name to outcome, in the campaign's order.
    """
    listed = list(rows)
    broken = [row for row in listed if row.verdict == FAIL and not row.bound]
    checks = [row for row in listed if row.verdict in (PASS, FAIL, UNDECIDED) and row.bound]
    kinematics = [verdict for case in cases.values() for verdict in case.kinematics]
    made = len(checks) + len(kinematics)
    declared = [row for row in listed if row.verdict in (EXPECTED_FAIL, UNEXPECTED_PASS)]
    bad, doubtful = _bad(checks, broken, declared, kinematics, cases), _doubtful(checks, made)
    missing = [name for name, case in cases.items() if case.status not in COMPUTED]
    lost = [f"{len(missing)} of {_cases(len(cases))} could not be computed ({', '.join(missing)})"] if missing else []
    held = _held(checks, made, declared, len(cases) - len(missing))
    if bad:
        return Conclusion(FAILED, f"{', and '.join([*bad, *doubtful, *lost])}.")
    if doubtful:
        sure = made - sum(row.verdict == UNDECIDED for row in checks)
        rest = f"; the other {sure} hold their bounds" if sure else ""
        return Conclusion(UNDECIDED_RUN, f"{', and '.join([*doubtful, *lost])}{rest}.")
    if lost:
        rest = held or "no formula was held against a bound in the others"
        return Conclusion(INCOMPLETE, f"{lost[0]}; {rest}.")
    if not held:
        return Conclusion(NOTHING_JUDGED, "no formula was held against a bound, so nothing is verified.")
    return Conclusion(PASSED, f"{held}.")


def _bad(
    checks: Sequence[Judged],
    broken: Sequence[Judged],
    declared: Sequence[Judged],
    kinematics: Sequence[str],
    cases: Mapping[str, CaseOutcome],
) -> list[str]:
    failed = [row for row in checks if row.verdict == FAIL]
    off = sum(verdict == FAIL for verdict in kinematics)
    unseen = [row for row in declared if row.verdict == UNEXPECTED_PASS]
    # a case can fail with every row within its bound: its kinematics disagree, and its message says so
    accused = {row.case for row in (*checks, *broken, *declared) if row.verdict in FAILURES}
    accused |= {name for name, case in cases.items() if FAIL in case.kinematics}
    other = [name for name, case in cases.items() if case.status == "failed" and name not in accused]
    bad = []
    if failed:
        bad.append(f"{len(failed)} of {len(checks)} checks exceed their bounds ({_worst(failed)})")
    if broken:
        rows = "1 row" if len(broken) == 1 else f"{len(broken)} rows"
        names = ", ".join(dict.fromkeys(row.candidate for row in broken))
        bad.append(f"{rows} of formulas without a bound broke down ({names})")
    if off:
        bad.append(f"{off} of {len(kinematics)} checks of kinematics exceed their bounds")
    if unseen:
        bad.append(f"{len(unseen)} of {len(declared)} declared failures did not happen")
    if other:
        bad.append(f"{_cases(len(other))} failed for another reason ({', '.join(other)})")
    return bad


def _doubtful(checks: Sequence[Judged], made: int) -> list[str]:
    undecided = [row for row in checks if row.verdict == UNDECIDED]
    if not undecided:
        return []
    return [
        f"{len(undecided)} of {made} checks are undecided, because the reference's own uncertainty is not below a"
        f" tenth of the bound ({', '.join(dict.fromkeys(row.case for row in undecided))})"
    ]


def _held(checks: Sequence[Judged], made: int, declared: Sequence[Judged], cases: int) -> str:
    """What holds, in words; empty where nothing was held against anything."""
    seen = f"{'all ' if len(declared) > 1 else ''}{len(declared)} declared failures show" if declared else ""
    if not made:
        return f"{seen} in {_cases(cases)}; no other check was made" if seen else ""
    where = f"; {_worst(checks)}" if checks else ""
    count = "1 check" if made == 1 else f"all {made} checks"
    return f"{count} in {_cases(cases)} {'holds its bound' if made == 1 else 'hold their bounds'}" + (
        f", and {seen}{where}" if seen else where
    )


def _worst(rows: Sequence[Judged]) -> str:
    row = max(rows, key=_badness)
    return (
        f"worst is {row.candidate} on joint {row.joint} in case {row.case}: {row.peak_error:.2e} of the reference's"
        f" peak against a bound of {row.bound:.4g}"
    )


def _badness(row: Judged) -> float:
    value = row.peak_error / row.bound if row.bound else row.peak_error
    return math.inf if math.isnan(value) else value


def _cases(number: int) -> str:
    return f"{number} case" if number == 1 else f"{number} cases"


SAID = {
    "failed": "failed",
    "invalid": "gave results that are not finite numbers",
    "timeout": "ran out of time",
    "killed": "lost their worker",
}
"""What the sentence says of cases of a sweep that did not pass."""
GOOD = ("passed", "filtered")
"""Statuses of a sweep's cases that are no trouble."""


def conclude_sweep(counts: Mapping[str, int], bounded: bool, worst: str = "") -> Conclusion:
    """Judge a sweep by what became of its cases.

    Parameters
    ----------
    counts
        Status to number of cases.
    bounded
        Whether any formula was held against a bound.
    worst
        The error that comes nearest to its bound, in words.
    """
    found = {name: count for name, count in counts.items() if count}
    total, passed = f"{sum(found.values()):,}", found.get("passed", 0)
    left = found.get("filtered", 0)
    out = f"{left:,} of {total} {'was' if left == 1 else 'were'} left out by the filter" if left else ""
    bad = {name: count for name, count in found.items() if name not in GOOD}
    if bad:
        parts = [f"{count:,} {SAID.get(name, name)}" for name, count in bad.items()]
        rest = [f"{passed:,} passed" if bounded else f"{passed:,} computed, none judged", *([out] if out else [])]
        # a lost or broken case is not a formula that failed; nothing is known of it
        status = FAILED if "failed" in bad else INCOMPLETE
        return Conclusion(status, f"of {total} cases {_joined(parts)}; {_joined(rest)}.")
    if not passed:
        return Conclusion(NOTHING_JUDGED, f"all {total} cases were left out by the filter, so nothing is verified.")
    if not bounded:
        said = f"no formula was held against a bound in {passed:,} cases, so nothing is verified"
        return Conclusion(NOTHING_JUDGED, f"{said}{f'; {out}' if out else ''}.")
    what = f"all {passed:,} cases that were computed" if left else f"all {total} cases"
    near = f" ({worst})" if worst else ""
    return Conclusion(PASSED, f"{what} hold every bound{near}{f'; {out}' if out else ''}.")


def _joined(parts: Sequence[str]) -> str:
    return " and ".join([", ".join(parts[:-1]), parts[-1]]) if len(parts) > 1 else parts[0]
