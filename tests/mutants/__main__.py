"""Plant faults, run tests, say which faults nobody noticed: ``make mutants`` (docs/mutants.md)."""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import random
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from mutants import modules, short, tree, trial
from mutants.named import EQUIVALENT, NAMED
from mutants.operators import Mutant, compiles, mutants_of
from mutants.reached import Reached

PLACE = tree.COPY.parent
REACHED = PLACE / "reached.json"
INTERPRETED = PLACE / "reached-interpreted.json"
"""the same with kernels that are not compiled, so that their lines are seen"""
RESULTS = PLACE / "results.jsonl"
BASELINE_LIMIT = 3600
"""seconds of the processor for the core tests without a fault"""
COMPILING = 120
"""seconds of the processor that compiling kernels may add"""
A_MOMENT = 0.05
"""seconds that any test takes"""
A_WHILE = 30
"""seconds of the processor on top of twice what tests take without a fault"""


@dataclass(frozen=True)
class Planted:
    """One fault in one file, with the name of its group or of itself."""

    group: str
    module: str
    mutant: Mutant

    @property
    def key(self) -> str:
        """The same fault in the same text, whenever it is drawn again."""
        text = f"{self.module} {self.mutant} {tree.source_of(self.module)}"
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def main() -> int:
    """Run the command line."""
    options = _options()
    if options.list:
        return _list(options)
    PLACE.mkdir(parents=True, exist_ok=True)
    tree.renew()
    trial.warm()
    given = options.tests or options.short
    chosen = list(_chosen(options))
    touched = {planted.module for planted in chosen}
    if options.reach or not (given or _is_current(REACHED, touched)):
        _reach(options.tests or modules.core_test_files(), REACHED)
    kernels = {module for module in touched if modules.is_kernel(module)}
    if options.reach_kernels or (kernels and not (given or _is_current(INTERPRETED, kernels))):
        _reach([modules.test_file(name) for name in modules.INTERPRETED_TESTS], INTERPRETED)
    known = {entry["key"]: entry for entry in _results()}
    for number, planted in enumerate(chosen, 1):
        before = known.get(planted.key)
        if before and not (options.again and before["status"] == trial.SURVIVED) and before["status"] != trial.BROKEN:
            continue
        files = options.tests or (modules.short_tests(planted.module) if options.short else [])
        longer = modules.longer_tests(planted.module) if options.short and not options.tests else []
        outcome, tests = _try(planted, options.budget, files, longer)
        entry = {"key": planted.key, "group": planted.group, "module": planted.module, **asdict(planted.mutant),
                 **asdict(outcome), "tests": tests}  # fmt: skip
        known[planted.key] = entry
        with RESULTS.open("a", encoding="utf-8") as file:
            file.write(json.dumps(entry) + "\n")
        where = f"{planted.module}:{planted.mutant.line}"
        print(
            f"[{number}/{len(chosen)}] {outcome.status:9} {outcome.seconds:5.1f} s  {planted.group}  {where}"
            f"  {planted.mutant.said()}  {outcome.by}",
            flush=True,
        )
    return _summary(chosen, known)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="mutants", description=__doc__)
    parser.add_argument("--named", action="store_true", help="the faults that were chosen by hand, not a sample")
    parser.add_argument("--group", choices=list(modules.GROUPS), action="append", help="default: all groups")
    parser.add_argument("--only", default="", help="files, or names of named faults, that hold this text")
    parser.add_argument("--count", type=int, default=20, help="faults drawn from each group")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--budget", type=float, default=60.0, help="seconds of tests a fault has to survive")
    parser.add_argument("--operator", default="", help="this operator alone")
    parser.add_argument("--line", type=int, help="faults of this line alone")
    parser.add_argument("--again", action="store_true", help="try again what survived before")
    parser.add_argument(
        "--short", action="store_true", help="whole test files of each group, no look at who reaches what"
    )
    parser.add_argument("--reach", action="store_true", help="find anew which tests reach which lines")
    parser.add_argument("--reach-kernels", action="store_true", help="the same for kernels, uncompiled")
    parser.add_argument("--tests", nargs="*", help="test files for --reach, or to try faults with as they are")
    parser.add_argument("--list", action="store_true", help="show the faults, plant none")
    return parser.parse_args()


def _chosen(options: argparse.Namespace) -> Iterator[Planted]:
    if options.named:
        for name, one in NAMED.items():
            if (options.only in name or options.only in one.module) and (name not in EQUIVALENT or options.again):
                yield Planted(name, one.module, one.mutant(tree.source_of(one.module)))
        return
    for group in options.group or modules.GROUPS:
        every = [
            Planted(group, module, mutant)
            for module in modules.files_of(group)
            if options.only in module
            for mutant in mutants_of(tree.source_of(module))
            if options.operator in mutant.operator and options.line in (None, mutant.line)
        ]
        order = list(range(len(every)))
        random.Random(f"{options.seed} {group}").shuffle(order)
        drawn = 0
        for place in order:
            if drawn == options.count:
                break
            planted = every[place]
            if compiles(planted.mutant.planted(tree.source_of(planted.module))):
                drawn += 1
                yield planted


def _list(options: argparse.Namespace) -> int:
    for planted in _chosen(options):
        print(f"{planted.group}  {planted.module}:{planted.mutant.line}  {planted.mutant.said()}")
    return 0


def _text_of(module: str) -> str:
    return hashlib.sha256(tree.source_of(module).encode()).hexdigest()[:16]


def _is_current(place: Path, touched: set[str]) -> bool:
    """Whether it is known who reaches which lines of these modules as they are now: lines move with every edit."""
    if not place.exists():
        return False
    texts = json.loads(place.read_text(encoding="utf-8")).get("texts", {})
    return all(texts.get(module) == _text_of(module) for module in touched)


def _reach(files: list[str], place: Path) -> None:
    """Run tests without a fault; what is known of other test files is kept."""
    print(f"running {len(files)} test files without a fault", flush=True)
    out = PLACE / "reached-now.json"
    out.unlink(missing_ok=True)
    plugin = Reached(tree.COPY / "src" / "workbench", out)
    outcome = trial.trial(files, tree.CACHE, BASELINE_LIMIT, (plugin,), stop=False, interpreted=place == INTERPRETED)
    if not out.exists():
        sys.exit(f"mutants: the tests did not run: {outcome}; see {PLACE / 'last.log'}")
    new = json.loads(out.read_text(encoding="utf-8"))
    new["texts"] = {module: _text_of(module) for group in modules.GROUPS for module in modules.files_of(group)}
    old = json.loads(place.read_text(encoding="utf-8")) if place.exists() else {"lines": {}, "durations": {}}
    texts = old.get("texts", {})
    ran = tuple(f"{name}::" for name in files)
    for module, lines in old["lines"].items():
        if texts.get(module) != new["texts"].get(module):
            continue
        mine = new["lines"].setdefault(module, {})
        for line, tests in lines.items():
            kept = [test for test in tests if not test.startswith(ran)]
            if kept:
                mine[line] = sorted({*mine.get(line, []), *kept})
    kept = {test: time for test, time in old["durations"].items() if not test.startswith(ran)}
    new["durations"] = kept | new["durations"]
    place.write_text(json.dumps(new), encoding="utf-8")
    print(f"{len(new['durations'])} tests, {sum(new['durations'].values()):.0f} s; failed: {new['failed'] or 'none'}")


def _try(planted: Planted, budget: float, files: list[str], longer: list[str]) -> tuple[trial.Outcome, int]:
    """Try one fault: with the tests that reach it, or with test *files*, and *longer* ones if it survives those."""
    kernel = modules.is_kernel(planted.module)
    if files:
        uncompiled = kernel and planted.module.startswith("reference/")
        outcome, tried = _try_files(planted, files, uncompiled, short.LONGEST)
        if outcome.status in (trial.KILLED, trial.TIMED_OUT) or not longer:
            return outcome, tried
        second, more = _try_files(planted, longer, False, math.inf)
        decided = outcome if second.status == trial.BROKEN else second
        return trial.Outcome(decided.status, decided.by, outcome.seconds + second.seconds), tried + more
    with tree.planted(planted.module, planted.mutant.planted(tree.source_of(planted.module))):
        outcome, tried = _try_reaching(planted, INTERPRETED if kernel else REACHED, budget)
        if not kernel or outcome.status != trial.SURVIVED:
            return outcome, tried
        compiled = modules.kernel_tests(planted.module)
        durations = json.loads(REACHED.read_text(encoding="utf-8"))["durations"]
        limit = COMPILING + int(3 * sum(time for test, time in durations.items() if test.split("::")[0] in compiled))
        with tree.own_cache() as own:
            second = trial.trial(compiled, own, limit)
        return trial.Outcome(second.status, second.by, outcome.seconds + second.seconds), tried + len(compiled)


def _try_files(planted: Planted, files: list[str], uncompiled: bool, longest: float) -> tuple[trial.Outcome, int]:
    """Try one fault with the tests of these files that take no longer and pass without it."""
    tests, takes, failing = short.tests_of(tuple(files), uncompiled, longest)
    if not tests:
        return trial.Outcome(trial.BROKEN, f"fail without a fault: {' '.join(failing)}", 0.0), 0
    limit = int(2 * takes) + A_WHILE
    with tree.planted(planted.module, planted.mutant.planted(tree.source_of(planted.module))):
        if modules.is_kernel(planted.module) and not uncompiled:
            with tree.own_cache() as own:
                return trial.trial(tests, own, limit + COMPILING), len(tests)
        return trial.trial(tests, tree.CACHE, limit, interpreted=uncompiled), len(tests)


def _try_reaching(planted: Planted, place: Path, budget: float) -> tuple[trial.Outcome, int]:
    """Run the tests that reach a fault, then the rest of their files, the fastest first, until the budget is spent.

    Returns the outcome and how many tests there were.
    """
    reached = json.loads(place.read_text(encoding="utf-8"))
    durations, failed = reached["durations"], set(reached["failed"])
    lines = reached["lines"].get(planted.module, {})
    last = planted.mutant.line + planted.mutant.before.count("\n")
    seen = {test for line in range(planted.mutant.line, last + 1) for test in lines.get(str(line), [])} - failed
    files = {test.split("::")[0] for test in seen if test}
    if "" in seen:  # run when the module is imported
        files |= {test.split("::")[0] for tests in lines.values() for test in tests if test}
        seen.discard("")
    # a fixture that several tests share is known by the first of them alone, what runs at import by none
    more = [test for name in sorted(files) for test in _by_speed(durations, failed, name) if test not in seen]
    # those first that reach most of the module for what they take
    worth = Counter(test for tests in lines.values() for test in tests)
    more.sort(key=lambda test: -worth[test] / (durations[test] + A_MOMENT))
    spent, tried = 0.0, 0
    for stage in (sorted(seen, key=lambda test: (durations.get(test, 0.0), test)), more):
        total = np.cumsum([durations.get(test, 0.0) for test in stage])
        tests = stage[: int(np.searchsorted(total, budget)) + 1] if budget > 0.0 else []
        budget -= float(total[-1]) if stage else 0.0
        if tests:
            limit = int(3 * sum(durations.get(test, 0.0) for test in tests)) + 60
            outcome = trial.trial(tests, tree.CACHE, limit, interpreted=place == INTERPRETED)
            spent, tried = spent + outcome.seconds, tried + len(tests)
            if outcome.status != trial.SURVIVED:
                return trial.Outcome(outcome.status, outcome.by, spent), tried
    return trial.Outcome(trial.SURVIVED, "", spent), tried


def _by_speed(durations: dict[str, float], failed: set[str], file: str) -> list[str]:
    own = [test for test in durations if test.startswith(f"{file}::") and test not in failed]
    return sorted(own, key=lambda test: (durations[test], test))


def _results() -> list[dict[str, object]]:
    if not RESULTS.exists():
        return []
    return [json.loads(line) for line in RESULTS.read_text(encoding="utf-8").splitlines()]


def _summary(chosen: list[Planted], known: dict[str, dict[str, object]]) -> int:
    alive = untried = 0
    for group in dict.fromkeys(planted.group for planted in chosen):
        states = [known[planted.key]["status"] for planted in chosen if planted.group == group]
        survived, broken = states.count(trial.SURVIVED), states.count(trial.BROKEN)
        alive, untried = alive + survived, untried + broken
        tried = len(states) - broken
        print(f"{group}: {tried - survived} of {tried} noticed{_share(tried - survived, tried)}, {broken} not tried")
    for status, word in ((trial.SURVIVED, "survived"), (trial.BROKEN, "not tried")):
        for planted in chosen:
            if known[planted.key]["status"] == status:
                print(f"{word}: {planted.group}  {planted.module}:{planted.mutant.line}  {planted.mutant.said()}")
    return 1 if alive else 2 if untried else 0


def _share(noticed: int, tried: int) -> str:
    """The share with the interval in which that of all faults lies at 95 % (Wilson)."""
    if tried < 2:
        return ""
    interval = binomtest(noticed, tried).proportion_ci(0.95, method="wilson")
    return f" ({noticed / tried:.0%}; of all faults {interval.low:.0%} to {interval.high:.0%})"


if __name__ == "__main__":
    sys.exit(main())
