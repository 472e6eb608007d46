"""What a run shows on a terminal: progress while it runs, then the errors and the verdict."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from workbench.campaign.changed import ANOTHER, Change, not_known, sentences
from workbench.campaign.compare import Row
from workbench.campaign.conclusion import (
    FAILED,
    INCOMPLETE,
    NOTHING_JUDGED,
    PASSED,
    UNDECIDED_RUN,
    Conclusion,
)
from workbench.campaign.good import NO, WORDS, YES, answers, good_enough
from workbench.campaign.good import UNDECIDED as UNDECIDED_ANSWER
from workbench.campaign.margins import answer, shortfalls
from workbench.campaign.not_driven import NOT_DRIVEN
from workbench.campaign.run import Outcome
from workbench.campaign.verdict import (
    AGREES,
    CONTRAST,
    DIFFERS,
    EXPECTED_FAIL,
    EXPECTED_FAILURE,
    FAIL,
    FAILURES,
    MEASURED,
    MODELLING,
    PASS,
    RECORDED,
    UNBOUNDED,
    UNDECIDED,
    UNEXPECTED_PASS,
    VERIFICATION,
)
from workbench.terminal import out

SEEN_AS_PERCENT = 1e-6
"""Smaller errors show as powers of ten also among percentages."""


STYLES = {
    FAIL: "bold red", UNEXPECTED_PASS: "bold red", UNDECIDED: "bold magenta", EXPECTED_FAIL: "yellow",
    DIFFERS: "yellow", PASS: "green", AGREES: "green", MEASURED: "cyan",
}  # fmt: skip
"""Colour of each verdict; a row of the table shows the first of them that one of its joints has."""


CONCLUSIONS = {
    PASSED: "bold green", FAILED: "bold red", UNDECIDED_RUN: "bold magenta", INCOMPLETE: "bold yellow",
    NOTHING_JUDGED: "bold cyan",
}  # fmt: skip
"""Colour of each verdict on a run: green where every bound holds, and nowhere else."""


ANSWERS = {NO: "bold yellow", UNDECIDED_ANSWER: "magenta", YES: "green"}
"""Colour of each answer to "is it good enough"; a row shows the first of them that one of its joints has."""


def print_outcome(outcome: Outcome) -> None:
    """Print the table of errors, the claims, the verdict and where the report lies."""
    manifest = outcome.manifest
    print_changes(manifest)
    tables = (
        (VERIFICATION, "Verification: closed form against MuJoCo, same masses", _scientific),
        (EXPECTED_FAILURE, "Declared failures: what each mistake costs, joint by joint", _percent),
        (MODELLING, "Modelling error: what another mass model than the reference's costs", _percent),
        (UNBOUNDED, "Measured, nothing judged: formulas without a bound against MuJoCo, same masses", _percent),
        (RECORDED, "Measured or simulated elsewhere: recorded torques against MuJoCo, as found by error", _percent),
        (CONTRAST, "For contrast: MuJoCo's inverse dynamics without projection", _percent),
    )
    for kind, title, show in tables:
        rows = [row for row in outcome.rows if row.kind == kind]
        if rows:
            out.print(_table(title, rows, manifest["joints"], show, manifest["good"]))
        if kind == RECORDED and rows:
            _print_recorded(manifest)
    out.print(Text("Each error is max|tau - tau_ref| / max|tau_ref| of that joint over the case."), style="dim")
    _print_kinematics(manifest["cases"])
    for name, case in manifest["cases"].items():
        if case["status"] == NOT_DRIVEN:
            out.print(Text(f"cannot be driven: {case['message']}", style="yellow"), soft_wrap=True)
        for warning in case["warnings"]:
            out.print(Text(f'warning: case "{name}": {warning}'), style="yellow")
    _print_attention(outcome)
    refuted = [claim for claim in manifest["claims"] if claim["holds"] is False]
    if manifest["claims"]:
        held = sum(claim["holds"] is True for claim in manifest["claims"])
        others = sum(bool(claim["not_about"]) for claim in manifest["claims"])
        undecided = len(manifest["claims"]) - held - len(refuted) - others
        counts = [f"{held} confirmed", f"{len(refuted)} not confirmed", f"{undecided} cannot be decided"]
        counts.append(f"{others} not about this robot")
        out.print(Text(f"Claims: {', '.join(c for c in counts if not c.startswith('0 '))}."))
    for claim in refuted:
        measured, claimed = _quantity(claim["measured"], claim["unit"]), _quantity(claim["claimed"], claim["unit"])
        out.print(Text(f"  not confirmed: {claim['text']}: measured {measured}, printed {claimed} ({claim['source']})"))
    _print_diagnosis(manifest.get("diagnosis", {}))
    print_conclusion(outcome.conclusion)
    out.print(Text(f"Report: {outcome.directory / 'report.html'}"), soft_wrap=True)


def _print_attention(outcome: Outcome) -> None:
    """Print what changes no verdict and still has to be looked at: accuracy that was asked for, actuators too small."""
    cases = outcome.manifest["cases"].items()
    unknown = not_known([name for name, case in cases if case["status"] == NOT_DRIVEN])
    for found in answers(outcome.rows, outcome.manifest["good"], unknown):
        out.print(Text(found.sentence, style=ANSWERS[found.answer]), soft_wrap=True)
    held = outcome.margins
    small = shortfalls(held)
    if small:
        out.print(Text("Needs attention (no failure of a formula; the verdict stands):", style="bold yellow"))
    for sentence in small:
        out.print(Text(f"  {sentence}", style="yellow"), soft_wrap=True)
    if held and not small:
        out.print(Text(answer(held, unknown)), soft_wrap=True)


def _print_recorded(manifest: dict[str, Any]) -> None:
    """Why each record is judged as it is, and where its difference lies."""
    for case in manifest["cases"].values():
        for label, record in case.get("recorded", {}).items():
            for joint, found in record["joints"].items():
                out.print(Text(f"  {label}, {joint}: {found['reason']}"), soft_wrap=True)
            out.print(Text(f"  {label}: {record['sentence']}"), soft_wrap=True)
            for note in record["notes"]:
                out.print(Text(f"  {label}: {note}"), style="dim", soft_wrap=True)


def _print_kinematics(cases: dict[str, Any]) -> None:
    """Print what a user's kinematics are off, coordinate by coordinate."""
    rows = [(case, row) for case, facts in cases.items() for row in facts.get("kinematics_checks", ())]
    if not rows:
        return
    table = Table(
        title="Verification: kinematics against MuJoCo", title_justify="left", title_style="bold",
        box=box.SIMPLE_HEAD, pad_edge=False,
    )  # fmt: skip
    for column in ("case", "formula", "kind", "coordinate", "error", "bound", "verdict"):
        table.add_column(column, overflow="fold", justify="right" if column in ("error", "bound") else "left")
    previous = ""
    for case, row in rows:
        first = case if case != previous else ""
        cells = [first, row["name"], row["kind"], row["coordinate"], _scientific(row["error"]), f"{row['bound']:.0e}"]
        table.add_row(*map(Text, cells), Text(row["verdict"], style=STYLES[row["verdict"]]))
        previous = case
    out.print(table)
    said = "Each is the largest error over the case, over the largest value of its unit; of a Jacobian's row, over its"
    out.print(Text(f"{said} largest entry.", style="dim"))


def _print_diagnosis(diagnosis: dict[str, Any]) -> None:
    """Say of each failing formula what is wrong with it, and the command that says more."""
    for candidate, found in diagnosis.items():
        if not found["findings"]:
            continue
        out.print(Text(f'What is wrong with "{candidate}":', style="bold"))
        for sentence in found["findings"]:
            out.print(Text(f"  - {sentence}"))
        out.print(Text(f"  {found['command']}", style="dim"), soft_wrap=True)


def print_changes(manifest: Mapping[str, Any]) -> None:
    """Print what was changed of the robot that the campaign's claims are about."""
    changes = manifest["changes"]
    said = sentences(changes["model"], [Change(**one) for one in changes["parameters"]], list(manifest["cases"]))
    if said:
        out.print(Text(f"{ANOTHER}:", style="bold yellow"))
    for line in said:
        out.print(Text(f"  {line}"), soft_wrap=True)


def print_conclusion(found: Conclusion) -> None:
    """Print the verdict on a run, in the colour of its status."""
    out.print(Text(found.text, style=CONCLUSIONS[found.status]), soft_wrap=True)


def _table(title: str, rows: list[Row], joints: Iterable[str], show: Any, good: float | None = None) -> Table:
    """One line per case and candidate; where that is wider than the terminal, cases stand on lines of their own."""
    names = tuple(joints)
    beside = _laid_out(title, rows, names, show, good, case_above=False)
    unbounded = out.options.update(max_width=1000)
    if out.measure(beside, options=unbounded).maximum <= out.width:
        return beside
    return _laid_out(title, rows, names, show, good, case_above=True)


def _force(joint: str, rows: list[Row]) -> str:
    """Name the generalized force of a joint with its unit: ``tau2 [N m]`` of q2."""
    unit = next((row.unit for row in rows if row.joint == joint), "")
    number = joint.removeprefix("q")
    return (f"tau{number}" if number.isdigit() else f"tau {joint}") + (f" [{unit}]" if unit else "")


def _laid_out(
    title: str, rows: list[Row], joints: Iterable[str], show: Any, good: float | None, *, case_above: bool
) -> Table:
    bounds = {row.bound for row in rows if row.bound is not None}
    if len(bounds) == 1:
        title += f"; bound {next(iter(bounds)):.0e}"
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    for column in (["candidate"] if case_above else ["case", "candidate"]) + ["MuJoCo model"]:
        table.add_column(column, overflow="fold")
    for joint in joints:
        table.add_column(_force(joint, rows), justify="right", no_wrap=True)
    if len(bounds) > 1:
        table.add_column("bound", justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    groups: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.case, row.candidate, row.reference), []).append(row)
    previous = ""
    for (case, candidate, reference), members in groups.items():
        verdict = next(v for v in STYLES if any(r.verdict == v for r in members))
        cells = [Text(f"  {candidate}" if case_above else candidate), Text(reference)]
        if not case_above:
            cells.insert(0, Text(case if case != previous else ""))
        elif case != previous:
            table.add_row(Text(case))
        said = {good_enough(r, good) for r in members} - {""}
        if said:  # asked for: the answer takes the place of a word that says nothing
            verdict = next(a for a in ANSWERS if a in said)
        bad = [r.verdict in FAILURES or good_enough(r, good) == NO for r in members]
        cells += [Text(show(r.peak_error), style="red" if b else "") for r, b in zip(members, bad, strict=True)]
        if len(bounds) > 1:
            cells.append(Text("" if members[0].bound is None else f"{members[0].bound:.0e}"))
        word, style = (WORDS[verdict], ANSWERS[verdict]) if said else (verdict, STYLES[verdict])
        table.add_row(*cells, Text(word, style=style))
        previous = case
    return table


def _scientific(value: float) -> str:
    return f"{value:.1e}"


def _percent(value: float) -> str:
    return f"{100 * value:.2f} %" if value >= SEEN_AS_PERCENT or value == 0.0 else _scientific(value)


def _quantity(value: float, unit: str) -> str:
    if unit in ("", "1", "%"):
        return f"{100 * value:.2g} %" if unit == "%" else f"{value:.4g}"
    return f"{value:.4g} {unit}"


def print_workspace(facts: dict[str, Any], directory: Path) -> None:
    """Print volume, its error, extent and joint limits of a workspace, and where it lies."""
    what, unit = {3: ("volume", "m^3"), 2: ("area", "m^2"), 1: ("length", "m")}[len(facts["shape"])]
    key = f"{what}_{unit.replace('^', '')}"
    amount, error = facts[key], facts[key.replace(what, f"{what}_error")]
    held = "".join(f", {name} held at {value:.4g}" for name, value in facts["held"].items())
    out.print(
        Text(
            f"{what.capitalize()} {amount:.5f} {unit} +- {error:.5f} {unit} (half of the cells at the"
            f" border), {facts['cells']} cells of {1000 * facts['spacing_m']:g} mm{held}"
        )
    )
    for axis, (low, high) in facts["extent_m"].items():
        out.print(Text(f"  {axis}: {low:.3f} to {high:.3f} m"))
    limits = ", ".join(f"{joint} {low:.4g} to {high:.4g}" for joint, (low, high) in facts["joint_limits"].items())
    out.print(Text(f"Limits of the active joints (m, rad): {limits}"))
    out.print(Text(f"Written to {directory}: workspace.parquet, workspace.json, figures"), soft_wrap=True)
