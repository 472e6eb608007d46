"""Trials without a map of lines: whole test files, of which it is known what each test takes and that it passes."""

from __future__ import annotations

import hashlib
import json
from functools import cache

from mutants import tree, trial
from mutants.reached import Timed

KNOWN = tree.COPY.parent / "short.json"
"""what test files were found to do without a fault"""
GIVEN_LIMIT = 900
"""seconds of the processor for one test file without a fault"""
QUICK, LONGEST = 0.3, 3.0
"""seconds; what takes less than the first goes first, what takes more than the second is left out unless asked for"""


def tests_of(files: tuple[str, ...], uncompiled: bool, longest: float) -> tuple[list[str], float, list[str]]:
    """Tests of these files that pass without a fault, and what they take.

    Quick ones first, within a file the fastest first; files stay together, since a fixture of a module is made anew
    when the next test is of another. Also returned: tests that fail without a fault, which say nothing of one.
    """
    quick, slow, failing, total = [], [], [], 0.0
    for file in files:
        durations, failed = _without_fault(file, uncompiled)
        failing += failed
        passing = [test for test in durations if test not in failed and durations[test] <= longest]
        for test in sorted(passing, key=lambda test: (durations[test], test)):
            (quick if durations[test] < QUICK else slow).append(test)
            total += durations[test]
    return [*quick, *slow], total, failing


def _without_fault(file: str, uncompiled: bool) -> tuple[dict[str, float], list[str]]:
    """What each test of a file takes on the package as it is, and which fail."""
    key = f"{file} {'uncompiled' if uncompiled else 'compiled'} {_text_of(file)}"
    known = json.loads(KNOWN.read_text(encoding="utf-8")) if KNOWN.exists() else {}
    if key not in known:
        out = KNOWN.with_name("short-now.json")
        out.unlink(missing_ok=True)
        outcome = trial.trial([file], tree.CACHE, GIVEN_LIMIT, (Timed(out),), stop=False, interpreted=uncompiled)
        said = json.loads(out.read_text(encoding="utf-8")) if out.exists() else {"durations": {}, "failed": []}
        if not said["durations"] or outcome.status in (trial.TIMED_OUT, trial.BROKEN):
            said = {"durations": {}, "failed": [outcome.by or f"{file} ({outcome.status})"]}
        print(f"{file}: {len(said['durations'])} tests, {outcome.seconds:.0f} s, without a fault", flush=True)
        for test in said["failed"]:
            print(f"left out, fails without a fault: {test}", flush=True)
        known[key] = [said["durations"], said["failed"]]
        KNOWN.write_text(json.dumps(known), encoding="utf-8")
    durations, failed = known[key]
    return durations, failed


@cache
def _text_of(file: str) -> str:
    """Digest of a test file and of the package that it tests."""
    places = [*sorted((tree.COPY / "src").rglob("*.py")), tree.COPY / file, tree.COPY / "tests" / "conftest.py"]
    return hashlib.sha256(b"".join(path.read_bytes() for path in places if path.exists())).hexdigest()[:16]
