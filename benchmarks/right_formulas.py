"""Diagnose right formulas on robots with random parameters: whatever is found is a false alarm.

    python benchmarks/right_formulas.py --count 100 --seed 1

First every formula that comes with the package and has a bound, then examples and the benchmark's own formulas, each on
its robot with parameters drawn at random: masses and inertias by a factor of 0.3 to 3, lengths by 0.97 to 1.03. Sets
with which the loops cannot be closed along the motion are drawn again and counted.
"""

from __future__ import annotations

import argparse
import random
import tempfile
import time
from pathlib import Path

from mistakes import ROOT, formulas

from workbench.campaign.cases import resolve_cases
from workbench.campaign.spec import load_campaign
from workbench.campaign.user_candidates import load_candidates, with_rows
from workbench.diagnosis.case_subject import KIND_OF_UNIT, CaseSubject
from workbench.diagnosis.examine import diagnose_subject
from workbench.diagnosis.subject import FRICTION, GRAVITY, INERTIA, LENGTH, MASS
from workbench.diagnosis.surface import subjects
from workbench.errors import WorkbenchError

EXAMPLES = {"delta": "exact", "orthoglide": "exact", "bricard": "threefold", "fourbar": "", "fivebar": ""}
SPREAD = {MASS: (0.3, 3.0), INERTIA: (0.3, 3.0), GRAVITY: (0.3, 3.0), FRICTION: (0.3, 3.0), LENGTH: (0.97, 1.03)}


def drawn(subject: CaseSubject, rng: random.Random) -> dict[str, float]:
    """Random values of all parameters that the model lets be set one at a time."""
    robot, values = subject.case.robot, {}
    # formulas of the papers' robots read one number for both sides, and that is the one to be drawn
    read = {p.name: p.unit for p in subject.parameters if p.read} if robot.closed_form is not None else {}
    for name, unit in (read or {name: info.unit for name, info in robot.description.table.infos.items()}).items():
        kind = KIND_OF_UNIT.get(unit, FRICTION)
        low, high = SPREAD.get(kind, (0.9, 1.1))
        if kind == LENGTH or kind in SPREAD:
            value = float(getattr(robot.parameters, name)) * rng.uniform(low, high)
            try:
                _ = robot.with_parameters(**{name: value}).reference
            except WorkbenchError:
                continue
            values[name] = value
    return values


def judge(subject: CaseSubject, what: str) -> bool:
    """Print and return whether there are findings."""
    begun = time.perf_counter()
    found, _ = diagnose_subject(subject)
    if not found.right:
        print(f"FALSE ALARM {what}: {[f.sentence for f in found.findings]}", flush=True)
    print(f"{what}: {'right' if found.right else 'WRONG'}, {found.digits} digits, {time.perf_counter() - begun:.1f} s")
    return not found.right


def main() -> None:
    """Look at all of them."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng, alarms, looked, again = random.Random(options.seed), 0, 0, 0
    for name in ("almeida_2010", "garcia_murillo_2016", "mass_models", "friction_2rss_ppap", "friction_4rprp"):
        for subject in subjects(ROOT / "campaigns" / f"{name}.toml"):
            if subject.candidate == "screws-as-printed":
                continue  # wrong on purpose
            alarms += judge(subject, f"{name} {subject.candidate}")
            looked += 1
    with tempfile.TemporaryDirectory() as folder:
        table = formulas(Path(folder), ["appendix", "equation4", "screws", "delta", "rrr"])
        for name, candidate in EXAMPLES.items():
            home = ROOT / "examples" / name
            table[name] = home / f"{name}.toml", home / f"{name}.py", candidate
        number, tries, homes = 0, 0, {}
        while number < options.count:
            name = list(table)[tries % len(table)]
            campaign, path, candidate = table[name]
            tries += 1
            users = load_candidates([path])
            spec, file = load_campaign(campaign)
            spec = with_rows(spec, users)
            chosen = candidate or users[0].name
            row = next(row for row in spec.candidate if row.name == chosen)
            if name not in homes:
                homes[name] = subjects(campaign, candidates=[path], candidate=chosen)[0]
                alarms += judge(homes[name], f"{name} as it is")
                looked += 1
            values = drawn(homes[name], rng)
            try:
                cases = resolve_cases(spec, file, users=users, settings=values)
                subject = CaseSubject(cases[0], chosen, row.reference, cases[1:])
                alarms += judge(subject, f"{number} {name} with {len(values)} random parameters")
            except WorkbenchError as error:
                again += 1
                print(f"drawn again: {name}: {error}")
                if again > 10 * options.count:
                    raise
                continue
            number += 1
            looked += 1
    print(f"{looked} right formulas, {alarms} false alarms; {again} sets drawn again")


if __name__ == "__main__":
    main()
