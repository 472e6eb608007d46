"""Plant mistakes into right formulas and see what `workbench diagnose` makes of them.

    python benchmarks/mistakes.py --count 300 --seed 1 --out mistakes.json [--search] [--at-once 2]

Formulas: the papers' appendix and eq. (4), the 4-RPRP by screws, a Delta and a planar 3-RRR, each as one plain file.
One process for all: the reference answers each question once for each robot, since only the formula changes, and edits
are scored in this process, without a worker's limits. So the times printed are of a warm diagnosis, on one core, in
seconds of its own.
A mistake is one edit of the kinds of issue "diagnose" (signs, factors, sine for cosine, indices, names, parameters,
exponents, quotients, terms dropped), chosen at random with equal weight for each kind, on a line that the formula runs
through. Edits that change no torque at any of the probed states, with parameters varied or not, are no mistakes and are
drawn again; so are those that make the formula fail everywhere. Truth is taken from the two formulas, right and wrong,
without the reference: which entries (part, joint) differ, and which parameters' shares do.
"""

from __future__ import annotations

import argparse
import json
import random
import tempfile
import time
import warnings
from collections import Counter, defaultdict
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from workbench.campaign.user_candidates import load_candidates
from workbench.diagnosis import examine, search
from workbench.diagnosis.case_subject import CaseSubject
from workbench.diagnosis.edits import (
    DROP,
    EXPONENT,
    FACTOR,
    INDEX,
    NAME,
    PARAMETER,
    QUOTIENT,
    SIGN,
    TRIG,
    WHAT,
    edits_of,
)
from workbench.diagnosis.entries import WRONG_MARK, compare_parts, floors_of
from workbench.diagnosis.paper import groups_of, lines_run, missing_in
from workbench.diagnosis.parts import FORCE, ODD, REST, take_apart
from workbench.diagnosis.probes import ask, choose_poses, make_plan
from workbench.diagnosis.result import NUMERIC
from workbench.diagnosis.surface import subjects
from workbench.errors import WorkbenchError

ROOT = Path(__file__).resolve().parents[1]
KINDS = (SIGN, FACTOR, TRIG, INDEX, NAME, PARAMETER, EXPONENT, QUOTIENT, DROP)
MENDED = {
    "appendix": (
        ("Jq33 = df2 * a1", "Jq33 = -df2 * a1"),
        ("K1 = (p.m2 / 4", "K1 = (p.m2 / 2"),
        ("K6 * Jxq[:, 2, 2]\n    f3", "K6 * Jxq[:, 2, 1]\n    f3"),
    ),
    "equation4": (
        ("Jq33 = w[:, 1]", "Jq33 = -w[:, 1]"),
        ("work(2 * p.m5", "work(p.m5"),
        ("tau = tau - work(p.m1 * gravity, ofC / 2)", "tau = tau - work(p.m1 * gravity, (ofC + ofD) / 2)"),
        ("- work(p.m6 * gravity, ofI)", "- work(p.m6 * gravity, ofI) - work((p.m3 + p.payload) * gravity, ofx)"),
    ),
    "screws": (("np.cross(u, A)", "np.cross(A, u)"),),
}
"""What makes the formulas of examples/misprints right."""


def formulas(folder: Path, names: list[str]) -> dict[str, tuple[Path, Path, str]]:
    """Name -> campaign, file with the right formula, candidate."""
    found = {}
    for name, mends in MENDED.items():
        text = (ROOT / "examples" / "misprints" / f"{name}_as_printed.py").read_text()
        for old, new in mends:
            assert old in text, old
            text = text.replace(old, new)
        path = folder / f"{name}.py"
        path.write_text(text)
        campaign = "garcia_murillo_2016" if name == "screws" else "almeida_2010"
        found[name] = ROOT / "campaigns" / f"{campaign}.toml", path, f"printed-{name}"
    for home, candidate in ((ROOT / "examples" / "delta", "exact"), (ROOT / "examples" / "rrr", "exact")):
        name = home.name
        found[name] = home / f"{name}.toml", home / f"{name}.py", candidate
    return {name: found[name] for name in names if name in found}


class Warm(CaseSubject):
    """A formula on a robot whose reference has been asked the same before."""

    memory: dict[Any, Any]

    @classmethod
    def of(cls, subject: CaseSubject, memory: dict[Any, Any]) -> Warm:
        warm = cls(subject.case, subject.candidate, subject.mass_model, subject._others)
        warm.memory, warm._references = memory, subject._references
        warm.__dict__["motion"] = subject.motion
        return warm

    def torques_of_reference(self, q, qd, qdd, force, changes):
        key = (*(array.tobytes() for array in (q, qd, qdd, force)), *sorted(changes.items()))
        if key not in self.memory:
            try:
                self.memory[key] = super().torques_of_reference(q, qd, qdd, force, changes)
            except WorkbenchError as error:
                self.memory[key] = error
        if isinstance(self.memory[key], WorkbenchError):
            raise self.memory[key]
        return self.memory[key]


def remember(function, key):
    """The same function, asked once for each key of its arguments."""
    known = {}

    def remembered(*arguments):
        name = key(*arguments)
        if name not in known:
            known[name] = function(*arguments)
        return known[name]

    return remembered


def warm() -> None:
    """Let poses and items of a robot be found once."""
    examine.choose_poses = remember(choose_poses, lambda subject, *count: (subject.case.robot.name, *count))
    items = examine.items_of
    examine.items_of = remember(items, lambda s, plan: (s.case.robot.name, s.mass_model, plan.poses.tobytes()))


class InProcess:
    """Scores edits where the search runs, in place of `workbench.sweep.supervisor.Supervisor`."""

    def __init__(self, jobs, setup, *limits) -> None:
        self.work = setup()

    def run(self, tasks):
        for number, task in tasks:
            yield number, self.work(task)

    def close(self) -> None:
        """Nothing to close."""


def parts_at(subject, plan, changes):
    """Parts by the formula alone."""
    tau, _ = ask(plan, lambda q, qd, qdd, force: subject.formula(q, qd, qdd, force, changes))
    return take_apart(plan, tau, subject.takes_force)


class Bench:
    """One right formula, and what its parts and shares are."""

    def __init__(self, campaign: Path, path: Path, candidate: str, rng: random.Random) -> None:
        self.campaign, self.path, self.candidate, self.rng = campaign, path, candidate, rng
        self.text = path.read_text()
        self.memory: dict[Any, Any] = {}
        self.subject = Warm.of(subjects(campaign, candidates=[path], candidate=candidate)[0], self.memory)
        self.plan = make_plan(self.subject, examine.choose_poses(self.subject))
        self.parameters = [p for p in self.subject.parameters if p.read and p.kind in ("mass", "inertia")]
        self.right = {None: parts_at(self.subject, self.plan, {})}
        for p in self.parameters:
            self.right[p.name] = parts_at(self.subject, self.plan, {p.name: p.varied})
        self.floors = floors_of(self.right[None])
        lines, groups = lines_run(self.subject, self.plan), groups_of(self.subject.parameters)
        edits = edits_of(self.text, lines, groups, len(self.subject.joints))
        self.by_kind = defaultdict(list)
        for edit in edits:
            if edit.kind in KINDS:
                self.by_kind[edit.kind].append(edit)
        self.lines, self.groups = lines, groups
        self.known: dict[Any, bool] = {}
        self.redrawn = 0

    def truth(self, subject):
        """Entries that differ, and parameters whose shares do; None where the formula fails or nothing differs."""
        wrong = parts_at(subject, self.plan, {})
        if not any(np.isfinite(v).any() for v in wrong.values()):
            return None
        entries = {
            (e.part, e.joint) for e in compare_parts(wrong, self.right[None], self.floors) if e.status == WRONG_MARK
        }
        whole = np.flatnonzero(np.all([np.isfinite(v).all(axis=1) for v in wrong.values()], axis=0))[:8]
        poses = whole if len(whole) else np.arange(8)
        few = make_plan(subject, self.plan.poses[poses])
        shares = set()
        for p in self.parameters:
            moved = parts_at(subject, few, {p.name: p.varied})
            mine = {k: moved[k] - v[poses] for k, v in wrong.items()}
            theirs = {k: v[poses] - self.right[None][k][poses] for k, v in self.right[p.name].items()}
            if any(e.status == WRONG_MARK for e in compare_parts(mine, theirs, self.floors, 1e-6, 1e-10)):
                shares.add(p.name)
        if not entries and not shares:
            return None
        return entries, shares

    def alone(self, edit, folder: Path) -> bool:
        """Whether an edit changes a torque by itself."""
        if edit not in self.known:
            subject = self.subject_of(edit.apply(self.text), folder)
            self.known[edit] = subject is not None and self.truth(subject) is not None
        return self.known[edit]

    def subject_of(self, text: str, folder: Path):
        """The same robot with another text; None where that does not load."""
        path = folder / "planted.py"
        path.write_text(text)
        try:
            users = load_candidates([path])
            self.subject.case.robot.offer({u.name: u.as_candidate() for u in users if u.name == self.candidate})
            return Warm.of(self.subject, self.memory)
        except (WorkbenchError, SyntaxError):
            return None

    def planted(self, folder: Path, at_once: int):
        """A subject with so many mistakes, their kinds and lines; its truth."""
        for _ in range(200):
            text, lines, kinds = self.text, [], []
            for _ in range(at_once):
                kind = self.rng.choice([k for k in KINDS if self.by_kind[k]])
                edit = self.rng.choice(self.by_kind[kind])
                if edit.line in lines or (at_once > 1 and not self.alone(edit, folder)):
                    break
                old = self.text.splitlines()
                new = edit.apply(self.text).splitlines()
                changed = [i for i in range(min(len(old), len(new))) if old[i] != new[i]]
                if len(old) != len(new) or len(changed) != 1:
                    break
                rows = text.splitlines(keepends=True)
                rows[changed[0]] = new[changed[0]] + "\n"
                text = "".join(rows)
                lines.append(changed[0] + 1)
                kinds.append(WHAT[kind])
            if len(lines) < at_once:
                continue
            subject = self.subject_of(text, folder)
            if subject is None:
                continue
            truth = self.truth(subject)
            if truth is None:
                self.redrawn += 1
                continue
            return subject, kinds, lines, truth, text
        raise SystemExit("no mistake to be planted")

    def undoable(self, text: str, line: int, wanted: str, seen) -> bool:
        """Whether any of the edits that are tried gives the original line back."""
        edits = edits_of(text, self.lines, self.groups, len(self.subject.joints), missing_in(seen))
        return any(
            _same(edit.apply(text).splitlines()[line - 1], wanted) for edit in edits if abs(edit.line - line) < 3
        )


def judged(bench: Bench, subject, truth, text: str, lines: list[int], mend: bool, limit: float) -> dict:
    """What the diagnosis says of one planted formula, held against the truth."""
    entries, shares = truth
    begun = time.process_time()
    diagnosis, seen = examine.diagnose_subject(subject)
    named = {(e.part, e.joint) for e in diagnosis.wrong if e.part.kind not in (ODD, REST)}
    for finding in diagnosis.findings:
        if finding.kind == NUMERIC:  # the table shows what is noisy as right, the finding says that it is not
            strict = compare_parts(seen.formula, seen.reference, seen.floors)
            named |= {(e.part, e.joint) for e in strict if e.status == WRONG_MARK and e.part.kind not in (ODD, REST)}
            assert {e.part.label(subject.joints) for e in strict if e.status == WRONG_MARK} <= set(finding.parts)
    true = {(part, joint) for part, joint in entries if part.kind not in (ODD, REST)}
    kinematic = any(f.kind == "kinematics" for f in diagnosis.findings)
    parameters = {name for f in diagnosis.findings for name in f.parameters}
    bodies = {name for f in diagnosis.findings for name in f.bodies}
    moves = any(part.kind == FORCE for part, _ in entries) or len(shares) > 1
    row = {
        "noticed": not diagnosis.right,
        "joint_and_part": named == true,
        # kinematics is right where the force response or several masses' shares are wrong, and only there
        "parameter": (moves if kinematic else parameters == shares or (not shares and bool(bodies)))
        or (bool(parameters) and parameters <= shares),
        "seconds_findings": round(time.process_time() - begun, 2),
        "findings": [f.sentence for f in diagnosis.findings],
    }
    if mend:
        begun = time.process_time()
        found, notes = search.search_mends(subject, seen, limit)
        row["seconds_search"] = round(time.process_time() - begun, 2)
        want = bench.text.splitlines()
        steps = sorted({s.step for s in found})
        first = [s for step in steps for s in [s for s in found if s.step == step][:3]]
        row["complete"] = bool(found) and found[-1].left == 0 and not any("a part of it" in note for note in notes)
        row["undone"] = all(any(s.line == n and _same(s.after, want[n - 1]) for s in first) for n in lines)
        # the original line, or one that computes the same on all robots and at all poses looked at
        row["mended"] = row["undone"] or (row["complete"] and all(any(s.line == n for s in first) for n in lines))
        row["undoable"] = all(bench.undoable(text, line, want[line - 1], seen) for line in lines)
        row["mends"] = [f"{s.step}: {s.diff}" for s in found]
    return row


def _same(one: str, other: str) -> bool:
    def plain(text: str) -> str:
        return text.replace(" ", "").replace(".0", "")

    return plain(one) == plain(other)


def main() -> None:
    """Plant, diagnose, count."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--at-once", type=int, default=1)
    parser.add_argument("--search", action="store_true")
    parser.add_argument("--limit", type=float, default=60.0)
    parser.add_argument("--robots", default="appendix,equation4,screws,delta,rrr")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    search.Supervisor = InProcess
    search.time = SimpleNamespace(monotonic=time.process_time)  # other processes do not shorten a search
    warm()
    warnings.simplefilter("ignore")
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        table = formulas(folder, options.robots.split(","))
        benches = {robot: Bench(*entry, rng) for robot, entry in table.items()}
        for number in range(options.count):
            robot = list(benches)[number % len(benches)]
            bench = benches[robot]
            subject, kinds, lines, truth, text = bench.planted(folder, options.at_once)
            row = {"robot": robot, "kinds": kinds, "lines": lines, "seed": options.seed}
            row |= judged(bench, subject, truth, text, lines, options.search, options.limit)
            rows.append(row)
            print(number, robot, kinds, {k: v for k, v in row.items() if isinstance(v, bool)}, flush=True)
            if not all(v for k, v in row.items() if isinstance(v, bool) and k not in ("undoable", "undone")):
                was, now = bench.text.splitlines(), text.splitlines()
                row["planted"] = [(now[line - 1].strip(), was[line - 1].strip()) for line in lines]
                print("   ", row["planted"], row["findings"], row.get("mends"), flush=True)
            if options.out:
                options.out.write_text(json.dumps(rows, indent=1) + "\n")
    summary(rows)
    print(f"drawn again, since no torque changes or all fail: {sum(bench.redrawn for bench in benches.values())}")


def summary(rows: list[dict]) -> None:
    """Print figures by kind of mistake, by formula, and the misses."""
    keys = [k for k in ("noticed", "joint_and_part", "parameter", "complete", "mended", "undone") if k in rows[0]]
    kinds = Counter(kind for row in rows for kind in row["kinds"])
    robots = Counter(row["robot"] for row in rows)
    print(f"{'kind':30} {'n':>4} " + " ".join(f"{key:>15}" for key in keys) + "   mended of undoable")
    for kind in [*kinds, *robots, "all"]:
        mine = [row for row in rows if kind in ("all", row["robot"]) or kind in row["kinds"]]
        shares = [100 * sum(row[key] for row in mine) / len(mine) for key in keys]
        could = [row for row in mine if row.get("undoable")]
        print(
            f"{kind:30} {len(mine):4} "
            + " ".join(f"{share:13.1f} %" for share in shares)
            + (f"   {sum(row['mended'] for row in could)} of {len(could)}" if could else "")
        )
    for key in ("seconds_findings", "seconds_search"):
        if key in rows[0]:
            times = sorted(row[key] for row in rows)
            print(f"{key}: median {times[len(times) // 2]:.2f}, longest {times[-1]:.2f}")
    for row in rows:
        if "planted" in row:
            what = [key for key in keys if not row[key]]
            print(f"missed ({', '.join(what)}; undoable: {row.get('undoable')}): {row['robot']} {row['planted']}")


if __name__ == "__main__":
    main()
