"""The section of one case: its motion, torques, errors, and the evidence that its reference can be trusted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from workbench.campaign.conclusion import case_status
from workbench.metrics import POINTWISE_FLOOR
from workbench.report.budget import budget_tables
from workbench.report.evidence import (
    conditions_table,
    evidence_table,
    reactions_table,
    singularity_table,
    solutions_table,
)
from workbench.report.figures import motion_plots, reaction_plot, torque_plots
from workbench.report.kinematics import kinematics_table
from workbench.report.load import ErrorRow, Run, Series
from workbench.report.manifest import CaseRecord
from workbench.report.mechanism import mechanism_plot
from workbench.report.pictures import Film
from workbench.report.plot import Plot
from workbench.report.recorded import recorded_tables
from workbench.report.signed import signed_plot
from workbench.report.spent import spent_plot, spent_table
from workbench.report.tables import CASE_STATUS, KINDS, Cell, Status, Table, columns, verdict_status
from workbench.report.text import error_fraction, exact, percent, pretty_unit, scientific, torque_label, with_unit

ERRORS_DEFINED = (
    "Peak error is max|Δτ| / max|τ_ref|, rms error is rms(Δτ) / rms(τ_ref), both per joint over the whole case, so "
    "the normaliser is the reference's own peak or rms on that joint; pointwise error is the largest |Δτ| / "
    "|τ_ref| over "
    f"the samples with |τ_ref| of at least {100 * POINTWISE_FLOOR:g} % of its peak, and “left out” counts the others, "
    "because "
    "near a zero crossing the quotient means nothing."
)


@dataclass(frozen=True)
class CaseView:
    """Everything the templates show of one case."""

    name: str
    anchor: str
    record: CaseRecord
    status: Status
    facts: tuple[tuple[str, str], ...]
    motion: tuple[Plot, ...]
    torques: tuple[Plot, ...]
    mechanism: Plot | None
    reactions: Plot | None
    spent: Plot | None
    signed: Plot | None
    tables: tuple[Table, ...]
    signed_units: str = ""
    """of `signed`: N, N·m, or both"""
    film: Film | None = None
    """rendered pictures of the robot in this case, or why there are none; on one case of a run"""
    times: str = ""
    """first and last moment, and the moment of the largest error, for the time slider"""

    @property
    def heading(self) -> str:
        """The case's title, or its name where it has none."""
        return self.record.title or self.name

    @property
    def plots(self) -> tuple[Plot, ...]:
        """All figures of the case."""
        others = tuple(plot for plot in (self.signed, self.spent, self.mechanism, self.reactions) if plot is not None)
        return self.motion + self.torques + others


def case_view(run: Run, case: str, anchor: str, series: Series | None, film: Film | None = None) -> CaseView:
    """Collect the section of one case; *series* is None for a case that was not computed."""
    record = run.manifest.cases[case]
    rows = run.rows_of_case[case]
    tables = [
        *(_error_table(run, case, kind, [row for row in rows if row.kind == kind], anchor) for kind in KINDS),
        *recorded_tables(record, anchor),
        kinematics_table(record, anchor),
        *budget_tables(run, case, anchor),
        evidence_table(record, anchor),
        spent_table(run, record, anchor),
        reactions_table(record, anchor),
        singularity_table(record, anchor),
        conditions_table(record, anchor),
        solutions_table(run, record, anchor),
    ]
    return CaseView(
        name=case,
        anchor=anchor,
        record=record,
        status=CASE_STATUS[case_status(record.status, [*(r.verdict for r in rows), *record.kinematics_verdicts])],
        facts=tuple(_facts(record)),
        motion=tuple(motion_plots(run, case, anchor, series)) if series is not None else (),
        torques=tuple(torque_plots(run, case, anchor, series)) if series is not None else (),
        mechanism=mechanism_plot(run, case, anchor, series) if series is not None else None,
        reactions=reaction_plot(run, case, anchor, series) if series is not None else None,
        signed=signed_plot(run, case, anchor, series) if series is not None else None,
        spent=spent_plot(run, case, anchor, series) if series is not None else None,
        tables=tuple(table for table in tables if table.rows),
        signed_units=" and ".join(dict.fromkeys(pretty_unit(unit) for unit in run.manifest.force_units)),
        film=film if film is not None and film.case == case else None,
        times=_times(rows, series) if series is not None else "",
    )


def _times(rows: list[ErrorRow], series: Series) -> str:
    time = series["t"]
    judged = [row for row in rows if row.kind != "contrast" and math.isfinite(row.worst_time_s)]
    worst = max(judged, key=lambda row: row.badness).worst_time_s if judged else float(time[0])
    return " ".join(f"{moment:.6g}" for moment in (float(time[0]), float(time[-1]), worst))


def _facts(record: CaseRecord) -> list[tuple[str, str]]:
    facts = []
    if record.samples is not None:
        facts.append(("Samples", str(record.samples)))
    if record.duration_s is not None:
        facts.append(("Duration", f"{exact(record.duration_s)} s"))
    for what, unit, peak, at in (
        ("Peak speed", "m/s", record.peak_speed, record.speed_at_s),
        ("Peak acceleration", "m/s²", record.peak_acceleration, record.acceleration_at_s),
    ):
        if peak is not None:
            moment = f" at {exact(at)} s" if at is not None else ""
            facts.append((what, f"{exact(peak)} {unit}{moment}"))
    if record.parameters:
        facts.append(("Changed parameters", ", ".join(f"{k} = {exact(v, 6)}" for k, v in record.parameters.items())))
    if _is_force(record.external_force):
        facts.append(("External force", f"{_force_text(record.external_force)} N on the platform"))
    return facts


def _is_force(force: Any) -> bool:
    return isinstance(force, list | tuple) and any(force)


def _force_text(force: Any) -> str:
    return "(" + ", ".join(exact(v, 6) if isinstance(v, int | float) else str(v) for v in force) + ")"


SHOWS = {
    "verification": "Verification: each closed form against the reference that makes the same assumption about "
    "the masses.",
    "expected-failure": "Declared failures: formulas that are kept wrong on purpose, against the reference.",
    "modelling": "Modelling error: formulas against a reference that assumes something else, its masses for "
    "instance, so that a real difference is expected.",
    "unbounded": "Measured, nothing judged: formulas without a bound, against the reference that makes the same "
    "assumption about the masses.",
    "recorded": "Measured or simulated elsewhere: recorded torques against the reference on the recorded motion.",
    "contrast": "For contrast: MuJoCo's own mj_inverse, which does not project the loops' constraint forces out.",
}
READING = {
    "verification": f"These are fractions and should be round-off; a row fails above its bound. {ERRORS_DEFINED}",
    "expected-failure": f"A declared failure has to exceed its bound, every other row has to keep it. {ERRORS_DEFINED}",
    "modelling": "A measured result without a bound, in percent of the reference's own peak, or rms, on that joint; "
    f"the pointwise error leaves out samples below {100 * POINTWISE_FLOOR:g} % of that peak; “left out” counts them.",
    "unbounded": "Nobody says how good these formulas have to be; a right one differs by round-off. In percent of the "
    "reference's own peak, or rms, on that joint.",
    "recorded": "In percent of the reference's own peak, or rms, on that joint. “Uncertainty” is what the digits and "
    "the noise of motion and recorder leave open: in 95 % of cases the largest difference that they make is smaller.",
    "contrast": "Nothing judges these rows: they show why the reference projects. In percent of the reference's own "
    "peak, or rms, on that joint.",
}


def _error_table(run: Run, case: str, kind: str, rows: list[ErrorRow], anchor: str) -> Table:
    bounded = kind in ("verification", "expected-failure")
    recorded = kind == "recorded"
    doubted = bounded and any(not math.isnan(row.uncertainty) for row in rows)
    scaled = any(row.normaliser != row.peak_reference for row in rows)
    samples = run.manifest.cases[case].samples
    number = error_fraction if bounded else percent
    names = ["Joint", "Candidate", "Reference", "Peak error", "Rms error", "Pointwise error", "Left out", "Worst at"]
    names += ["Peak of reference", *(["Normaliser"] if scaled else []), *(["Bound"] if bounded else [])]
    names += [*(["Uncertainty"] if recorded else []), *(["Reference's own"] if doubted else []), "Verdict"]
    body = []
    for row in rows:
        total = f" of {samples}" if samples is not None else ""
        cells = [
            Cell(joint_heading(run, row.joint)),
            Cell(row.candidate),
            Cell(row.reference),
            Cell(number(row.peak_error), row.peak_error, emphasis=True),
            Cell(number(row.rms_error), row.rms_error),
            Cell(number(row.pointwise_error), row.pointwise_error),
            Cell(f"{row.pointwise_skipped}{total}", row.pointwise_skipped),
            Cell(f"{exact(row.worst_time_s)} s", row.worst_time_s),
            Cell(with_unit(exact(row.peak_reference), row.unit), row.peak_reference),
        ]
        if scaled:
            cells.append(Cell(with_unit(exact(row.normaliser), row.unit), row.normaliser))
        if bounded:
            cells.append(Cell(exact(row.bound), row.bound))
        if recorded:
            cells.append(Cell(percent(row.uncertainty), row.uncertainty))
        if doubted:
            cells.append(Cell(scientific(row.uncertainty), row.uncertainty))
        body.append((*cells, Cell(status=verdict_status(row.verdict))))
    reading = READING[kind]
    if scaled:
        reading += (
            " A joint that carries next to nothing is judged by the column “Normaliser” in place of its own peak."
        )
    if doubted:
        reading += " “Reference's own” is the reference's own uncertainty; a verdict counts where it is below a tenth."
    return Table(f"{anchor}-{kind}", SHOWS[kind], columns(names, numeric=names[3:-1]), tuple(body), reading)


def joint_heading(run: Run, joint: str) -> str:
    """Return ``τ1 [N]``: the generalized force of a joint with its unit."""
    return torque_label(joint, run.manifest.unit_of(joint))
