"""What the actuators have to give in each case, and whether they can."""

from __future__ import annotations

from collections.abc import Mapping

from workbench.campaign.margins import Margin, answer, shortfalls, worst_of
from workbench.report.attention import margins_of, unknown_cases
from workbench.report.load import Run
from workbench.report.manifest import Manifest
from workbench.report.section import Section, plain_section
from workbench.report.tables import Cell, Status, Table, columns
from workbench.report.text import exact, pretty_unit, with_unit

BIG_ENOUGH = Status("passed", "✓", "big enough")
TOO_SMALL = Status("refuted", "✗", "TOO SMALL", loud=True)
UNKNOWN = Status("undecided", "?", "not known")

BESIDE = (
    "No limit that is exceeded changes the verdict: that one is about formulas. Figures are mechanical, at the joint,"
    " behind the gear; a motor's own rotor is in them only where the model has an armature, and losses of motor, gear"
    " and drive are not."
)


def actuator_section(run: Run, anchors: Mapping[str, str]) -> Section | None:
    """Say what each case asks of the actuators, and hold it against their limits where there are any."""
    demanded = [name for name, record in run.manifest.cases.items() if record.demand.joints]
    if not demanded:
        return None
    found = margins_of(run.manifest)
    paragraphs = [answer(found, unknown_cases(run.manifest)), *shortfalls(found)] if found else [NO_LIMITS]
    tables = [
        *([limits_table(found, anchors)] if found else []),
        demand_table(run.manifest, anchors),
    ]
    return plain_section("actuators", "What the actuators have to give", paragraphs, tables)


NO_LIMITS = (
    "Nobody says what the actuators can give. With [actuators.JOINT] in robot.toml or campaign (peak, rms, speed,"
    " power, source) this section says whether they are big enough."
)


def margin_status(margin: Margin) -> Status:
    """Look of one margin."""
    if margin.demanded != margin.demanded:
        return UNKNOWN
    return TOO_SMALL if margin.too_much else BIG_ENOUGH


def limits_table(found: list[Margin], anchors: Mapping[str, str]) -> Table:
    """Each limit with the case that comes nearest to it, or exceeds it most."""
    numeric = ("Asked for", "Allowed", "Used", "At")
    rows = []
    for worst in worst_of(found):
        over = sum(m.too_much for m in found if (m.joint, m.measure) == (worst.joint, worst.measure))
        of = sum((m.joint, m.measure) == (worst.joint, worst.measure) for m in found)
        rows.append(
            (
                Cell(worst.joint),
                Cell(worst.measure.words),
                Cell(with_unit(exact(worst.demanded), worst.unit), worst.demanded),
                Cell(with_unit(exact(worst.allowed), worst.unit), worst.allowed),
                Cell(f"{100 * worst.used:.3g} %", worst.used, emphasis=worst.too_much),
                Cell(worst.case, link=anchors.get(worst.case)),
                Cell("–" if worst.at_s is None else f"{exact(worst.at_s)} s", worst.at_s),
                Cell(f"{over} of {of}", over),
                Cell(status=margin_status(worst)),
                Cell(worst.source or "not said"),
            )
        )
    return Table(
        "actuator-limits",
        "Actuators against their limits: of each limit the case that takes most of it.",
        columns(
            ("Actuator", "Figure", *numeric[:3], "Case", "At", "Cases beyond", "Big enough", "Source of the limit"),
            (*numeric, "Cases beyond"),
        ),
        tuple(rows),
        "“Used” is asked for over allowed; above 100 % the actuator is too small. “rms” is the root mean square over"
        f" the case, as if it were repeated without pause. {BESIDE}",
    )


def demand_table(manifest: Manifest, anchors: Mapping[str, str]) -> Table:
    """What every case asks of every actuator."""
    names = (
        "Peak force or torque",
        "At",
        "Rms force or torque",
        "Peak speed",
        "Peak power",
        "Braking power",
        "Work",
        "Returned",
    )
    rows = []
    models = list(dict.fromkeys(r.demand.mass_model for r in manifest.cases.values() if r.demand.joints))
    for case, record in manifest.cases.items():
        for joint, force, coordinate in zip(
            manifest.joints, manifest.force_units, manifest.coordinate_units, strict=True
        ):
            asked = record.demand.joints.get(joint)
            if asked is None:
                continue
            figures = (
                (asked.peak, force),
                (asked.peak_at_s, "s"),
                (asked.rms, force),
                (asked.speed, f"{coordinate}/s"),
                (asked.power, "W"),
                (asked.braking, "W"),
                (asked.work, "J"),
                (asked.returned, "J"),
            )
            cells = [Cell(with_unit(exact(value), pretty_unit(unit)), value) for value, unit in figures]
            rows.append((Cell(case, link=anchors.get(case)), Cell(joint), *cells))
    return Table(
        "actuator-demand",
        f"What each case asks of each actuator, by the reference with {' and '.join(models)} masses.",
        columns(("Case", "Actuator", *names), names),
        tuple(rows),
        "The actuator is named by its joint. Power is force times speed at the joint, its peak driving or braking."
        " “Work” is what the actuator puts in while it drives, “returned” what flows back while it brakes: a drive that"
        " cannot store it burns it.",
    )
