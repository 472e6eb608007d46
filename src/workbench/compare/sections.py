"""The sections of a comparison's page, in reading order: what changed, what it asks of motors and joints, errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from workbench.campaign.changed import not_shared
from workbench.campaign.margins import answer, worst_of
from workbench.campaign.verdict import WITHOUT_BOUND
from workbench.compare.asked import WORDS, Asked, shared_cases, size_of, worst_over_cases
from workbench.compare.errors import FLOOR, ErrorChange, growth, growth_text
from workbench.compare.parameters import ParameterChange, parameter_changes
from workbench.compare.plots import case_plots
from workbench.compare.runs import Difference, RunComparison
from workbench.report.actuator_section import BESIDE, margin_status
from workbench.report.load import Run
from workbench.report.plot import Plot
from workbench.report.section import Section, plain_section
from workbench.report.sections import unique_keys
from workbench.report.tables import Cell, Table, columns, verdict_status
from workbench.report.text import exact, percent, pretty_unit, scientific, torque_name, with_unit

BY_CASE = ("peak", "rms", "speed", "power", "work")
"""Figures of an actuator in the table of all cases."""
WORST_REACTIONS = 40


@dataclass(frozen=True)
class CasePlots:
    """The figures of one case."""

    name: str
    title: str
    plots: tuple[Plot, ...]


def comparison_sections(old: Run, new: Run, found: RunComparison, floor: float = FLOOR) -> list[Section]:
    """Return what stands below the head of the page.

    Raises
    ------
    OutputError
        A series file of a case that both runs have is missing or unreadable.
    """
    sections = [
        changed_section(old, new, found),
        asked_section(found),
        cases_section(old, new),
        reactions_section(found),
        errors_section(found, floor),
        rest_section(found),
    ]
    return [section for section in sections if section is not None]


def _section(key: str, title: str, paragraphs: Sequence[str], tables: Sequence[Table]) -> Section:
    return plain_section(key, title, paragraphs, [table for table in tables if table.rows])


def changed_section(old: Run, new: Run, found: RunComparison) -> Section:
    """Say what was changed of the robot, each parameter once."""
    changes = list(parameter_changes(old.manifest, new.manifest))
    limits = [one for one in found.inputs if one.group == "actuator"]
    said = [] if changes else ["Both runs are of the same robot: no parameter differs in any case that both have."]
    tables = [
        Table(
            "parameters",
            "Parameters that differ from A to B, each once.",
            columns(("Parameter", "A", "B", "B / A", "Unit", "Meaning", "Changed by"), ("A", "B", "B / A")),
            tuple(map(_parameter, changes)),
            "SI. Parameters that changed alike stand together; cases are named where it does not concern all that both"
            " runs have. “Changed by” says why B's number is not that of the robot's source, as far as B knows.",
        ),
        Table(
            "limits",
            "Limits of actuators that differ from A to B; both runs are held against B's.",
            columns(("Limit", "A", "B")),
            tuple((Cell(one.what), Cell(_value(one.before)), Cell(_value(one.after))) for one in limits),
            "SI, at the joint.",
        ),
    ]
    return _section("changed", "What was changed", said, tables)


def _parameter(change: ParameterChange) -> tuple[Cell, ...]:
    before, after = change.before, change.after
    ratio = after / before if before and after is not None else math.nan
    return (
        Cell(change.what),
        Cell(exact(before, 6), before),
        Cell(exact(after, 6), after),
        Cell("–" if math.isnan(ratio) else exact(ratio), ratio),
        Cell("–" if change.unit in ("", "1") else pretty_unit(change.unit)),
        Cell(change.meaning),
        Cell(change.by or "–"),
    )


def asked_section(found: RunComparison) -> Section:
    """Hold what actuators have to give against what they had to, and against their limits."""
    if not found.demands:
        missing = (
            "The runs have no case and actuator in common, or one of them was written by an earlier version, which did"
            " not say what its actuators have to give: run that campaign again."
        )
        return _section("actuators", "What the actuators have to give", [missing], [])
    said: list[str] = []
    for name, margins in zip("AB", found.margins, strict=True):
        if margins:
            said.append(f"{name}: {answer(margins, not_shared(found.apart))}")
    if not found.margins[1]:
        said.append(
            "Neither run says what the actuators can give; with [actuators.JOINT] in robot.toml or campaign this says"
            " whether they are still big enough."
        )
    return _section(
        "actuators", "What the actuators have to give", said, [_margins(found), _worst(found.demands), _by_case(found)]
    )


def _margins(found: RunComparison) -> Table:
    before = {(m.joint, m.measure.key): m for m in worst_of(found.margins[0])}
    rows = []
    for margin in worst_of(found.margins[1]):
        old = before.get((margin.joint, margin.measure.key))
        rows.append(
            (
                Cell(margin.joint),
                Cell(margin.measure.words),
                Cell(with_unit(exact(margin.allowed), margin.unit), margin.allowed),
                Cell(f"{100 * old.used:.3g} %" if old else "–", old.used if old else None),
                Cell(status=margin_status(old)) if old else Cell("–"),
                Cell(f"{100 * margin.used:.3g} %", margin.used, emphasis=margin.too_much),
                Cell(status=margin_status(margin)),
                Cell(margin.case),
                Cell("–" if margin.at_s is None else f"{exact(margin.at_s)} s", margin.at_s),
                Cell(margin.source or "not said"),
            )
        )
    numeric = ("Allowed", "Used in A", "Used in B", "At")
    return Table(
        "margins",
        "Are the actuators still big enough? Of each limit the case that takes most of it.",
        columns(
            ("Actuator", "Figure", "Allowed", "Used in A", "A", "Used in B", "B", "B's case", "At", "Source"), numeric
        ),
        tuple(rows),
        f"Both runs against the same limits, over the cases that both have. {BESIDE}",
    )


def _worst(found: Sequence[Asked]) -> Table:
    rows = [
        (
            Cell(one.item),
            Cell(WORDS[one.key]),
            Cell(with_unit(exact(one.before), one.unit), one.before),
            Cell(one.before_in),
            Cell(with_unit(exact(one.after), one.unit), one.after),
            Cell(one.after_in),
            Cell(ratio_text(one.ratio), one.ratio, emphasis=not one.same),
        )
        for one in worst_over_cases(found)
    ]
    return Table(
        "worst-asked",
        "The largest figure of each actuator over the cases that both runs have.",
        columns(("Actuator", "Figure", "A", "in case", "B", "in case", "B / A"), ("A", "B", "B / A")),
        tuple(rows),
        "By the reference. Work is put in while driving, “returned” flows back while braking, both over one case. The"
        " largest of A and of B may stand in different cases.",
    )


def _by_case(found: RunComparison) -> Table:
    groups: dict[tuple[str, str], dict[str, Asked]] = {}
    for one in found.demands:
        groups.setdefault((one.case, one.item), {})[one.key] = one
    rows = [
        (Cell(case), Cell(joint), *(_both(figures[key]) for key in BY_CASE))
        for (case, joint), figures in groups.items()
    ]
    names = [WORDS[key].capitalize() for key in BY_CASE]
    return Table(
        "asked-by-case",
        "What each case asks of each actuator: A → B, and B over A.",
        columns(("Case", "Actuator", *names), names),
        tuple(rows),
        "Sorted by B over A when a heading is pressed.",
    )


def in_short(found: RunComparison) -> list[str]:
    """What B asks of actuators and joints over A, in a sentence each; empty where nothing is known."""
    worst = list(worst_over_cases(found.demands))
    said = []
    for key in ("peak", "rms", "power"):
        parts = [f"{one.item} {ratio_text(one.ratio)}" for one in worst if one.key == key]
        said += [f"{WORDS[key]} {', '.join(parts)}"] if parts else []
    lines = [f"B over A, the largest over the cases of both: {'; '.join(said)}."] if said else []
    most = max(worst_over_cases(found.reactions), key=lambda one: size_of(one.after), default=None)
    if most is not None:
        lines.append(
            f"The largest reaction of B is {exact(most.after)} N at {most.item} in case {most.after_in}; in A the same"
            f" joint bears {exact(most.before)} N at most."
        )
    return lines


def _both(one: Asked) -> Cell:
    if one.before == one.after:
        return Cell(f"{with_unit(exact(one.after), pretty_unit(one.unit))} =", 1.0)
    unit = pretty_unit(one.unit)
    return Cell(f"{exact(one.before)} → {with_unit(exact(one.after), unit)} ({ratio_text(one.ratio)})", one.ratio)


def ratio_text(ratio: float) -> str:
    """Write B over A: ``×1.24``; a dash where nobody can tell."""
    if math.isnan(ratio):
        return "–"
    return f"×{ratio:.3g}" if math.isfinite(ratio) else "from 0"


def cases_section(old: Run, new: Run) -> Section | None:
    """Draw the torques and powers of every case that both runs have."""
    shared = shared_cases(old.manifest, new.manifest)
    keys = unique_keys("case", shared)
    views = []
    for name in shared:
        plots = case_plots(old, new, name, keys[name])
        if plots:
            views.append(CasePlots(name, new.manifest.cases[name].title or name, tuple(plots)))
    if not views:
        return None
    drawn = tuple(plot for view in views for plot in view.plots)
    return Section("cases", "Torque and power over time", "compare_cases", {"cases": views}, drawn)


def reactions_section(found: RunComparison) -> Section | None:
    """Say what the joints bear."""
    if not found.reactions:
        return None
    worst = sorted(worst_over_cases(found.reactions), key=lambda one: -size_of(one.after))
    rest = len(worst) - WORST_REACTIONS
    table = Table(
        "reactions",
        "The largest reaction of each joint over the cases that both runs have.",
        columns(("Joint", "A", "in case", "B", "in case", "B / A"), ("A", "B", "B / A")),
        tuple(
            (
                Cell(one.item),
                Cell(f"{exact(one.before)} N", one.before),
                Cell(one.before_in),
                Cell(f"{exact(one.after)} N", one.after),
                Cell(one.after_in),
                Cell(ratio_text(one.ratio), one.ratio, emphasis=not one.same),
            )
            for one in worst[:WORST_REACTIONS]
        ),
        "Size of the force in each joint, by the reference, the largest of B first."
        + (f" The other {rest} are smaller." if rest > 0 else ""),
    )
    return _section("reactions", "What the joints bear", [], [table])


def errors_section(found: RunComparison, floor: float) -> Section:
    """Errors of both runs side by side: modelling errors as percentages, verification apart."""
    said = [f"{name}: {one.sentence}" for name, answered in zip("AB", found.answers, strict=True) for one in answered]
    modelling = [one for one in found.errors if one.kind in WITHOUT_BOUND]
    other = [one for one in found.errors if one.kind not in WITHOUT_BOUND]
    tables = [
        _errors(
            "modelling", "Errors of formulas without a bound, modelling errors mostly: A → B.", modelling,
            found.joints, percent, floor,
        ),
        _errors(
            "bounded", "Errors of formulas against their bounds, and everything else: A → B.", other, found.joints,
            scientific, floor,
        ),
    ]  # fmt: skip
    return _section("errors", "Errors of both", said, tables)


def _errors(
    key: str,
    shows: str,
    found: Sequence[ErrorChange],
    joints: Sequence[str],
    show: Callable[[float], str],
    floor: float,
) -> Table:
    groups: dict[tuple[str, str, str], dict[str, ErrorChange]] = {}
    for one in found:
        groups.setdefault((one.case, one.candidate, one.reference), {})[one.joint] = one
    rows, torques = [], [torque_name(joint) for joint in joints]
    for (case, candidate, reference), by_joint in groups.items():
        cells = [_error(by_joint[joint], show, floor) if joint in by_joint else Cell("–") for joint in joints]
        last = next((one.after for one in by_joint.values() if one.after is not None), None)
        status = Cell(status=verdict_status(last.verdict)) if last else Cell("only in A")
        rows.append((Cell(case), Cell(candidate), Cell(reference), *cells, status))
    return Table(
        f"errors-{key}",
        shows,
        columns(("Case", "Candidate", "Reference", *torques, "Verdict in B"), torques),
        tuple(rows),
        f"Peak error max|Δτ| / max|τ_ref| over the case. “=” the same bits, “~” both below {floor:g},"
        " which is rounding; ×2 and /2 grew and fell by that factor.",
    )


def _error(change: ErrorChange, show: Callable[[float], str], floor: float) -> Cell:
    before, after = change.before, change.after
    if after is None or before is None:
        one = after or before
        assert one is not None
        return Cell(f"{show(one.peak_error)} (only in {'B' if after else 'A'})")
    if change.same:
        return Cell(f"{show(after.peak_error)} =", 1.0)
    if max(before.peak_error, after.peak_error) <= floor:
        return Cell(f"{show(after.peak_error)} ~", 1.0)
    grown = growth(before.peak_error, after.peak_error, floor)
    return Cell(f"{show(before.peak_error)} → {show(after.peak_error)} ({growth_text(grown)})", grown)


def rest_section(found: RunComparison) -> Section:
    """List what else differs: versions, campaign, outcomes."""

    def table(key: str, shows: str, listed: Sequence[Difference]) -> Table:
        return Table(
            key,
            shows,
            columns(("", "What", "A", "B")),
            tuple((Cell(d.group), Cell(d.what), Cell(_value(d.before)), Cell(_value(d.after))) for d in listed),
            "A dash: that run does not have it.",
        )

    inputs = [one for one in found.inputs if one.group not in ("parameter", "actuator")]
    tables = [
        table("outcomes", "Outcomes that differ: verdict, status, mobility, claims.", found.outcomes),
        table("inputs", "Other inputs that differ: model, campaign, versions, machine.", inputs),
    ]
    said = [] if inputs or found.outcomes else ["Nothing else differs."]
    return _section("rest", "What else differs", said, tables)


def _value(value: object) -> str:
    return "–" if value is None else exact(value, 6) if isinstance(value, float) else str(value)
