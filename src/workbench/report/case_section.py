"""The section of one case: its motion, torques, errors, and the evidence that its reference can be trusted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from workbench.metrics import POINTWISE_FLOOR
from workbench.report.figures import Plot, motion_plots, torque_plots
from workbench.report.load import ErrorRow, Run, Series
from workbench.report.manifest import CaseRecord
from workbench.report.tables import CASE_STATUS, Cell, Status, Table, columns, verdict_status
from workbench.report.text import count, error_fraction, exact, percent, pretty_unit, scientific, with_unit

ERRORS_DEFINED = (
    "Peak error is max|Δτ| / max|τ_ref|, rms error is rms(Δτ) / rms(τ_ref), both per joint over the whole case, so "
    "the normaliser is the reference's own peak or rms on that joint; pointwise error is the largest |Δτ| / |τ_ref| over "
    f"the samples with |τ_ref| of at least {POINTWISE_FLOOR:.0%} of its peak, and “left out” counts the others, because "
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
    tables: tuple[Table, ...]

    @property
    def heading(self) -> str:
        """The case's title, or its name where it has none."""
        return self.record.title or self.name

    @property
    def plots(self) -> tuple[Plot, ...]:
        """All figures of the case."""
        return self.motion + self.torques


def case_view(run: Run, case: str, anchor: str, series: Series | None) -> CaseView:
    """Collect the section of one case; *series* is None for a case that was not computed."""
    record = run.manifest.cases[case]
    rows = run.rows_of_case[case]
    tables = [
        _error_table(run, case, [row for row in rows if row.is_verification], anchor),
        _error_table(run, case, [row for row in rows if not row.is_verification], anchor),
        _evidence_table(record, anchor),
        _singularity_table(record, anchor),
    ]
    return CaseView(
        name=case,
        anchor=anchor,
        record=record,
        status=CASE_STATUS[record.status],
        facts=tuple(_facts(record)),
        motion=tuple(motion_plots(run, case, anchor, series)) if series is not None else (),
        torques=tuple(torque_plots(run, case, anchor, series)) if series is not None else (),
        tables=tuple(table for table in tables if table.rows),
    )


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


def _error_table(run: Run, case: str, rows: list[ErrorRow], anchor: str) -> Table:
    verification = bool(rows) and rows[0].is_verification
    samples = run.manifest.cases[case].samples
    number = error_fraction if verification else percent
    names = ["Joint", "Candidate", "Reference", "Peak error", "Rms error", "Pointwise error", "Left out", "Worst at"]
    names += ["Peak of reference", *(["Bound"] if verification else []), "Verdict"]
    body = []
    for row in rows:
        total = f" of {samples}" if samples is not None else ""
        cells = [
            Cell(row.joint),
            Cell(row.candidate),
            Cell(row.reference),
            Cell(number(row.peak_error), row.peak_error, emphasis=True),
            Cell(number(row.rms_error), row.rms_error),
            Cell(number(row.pointwise_error), row.pointwise_error),
            Cell(f"{row.pointwise_skipped}{total}", row.pointwise_skipped),
            Cell(f"{exact(row.worst_time_s)} s", row.worst_time_s),
            Cell(with_unit(exact(row.peak_reference), row.unit), row.peak_reference),
        ]
        if verification:
            cells.append(Cell(exact(row.bound), row.bound))
        body.append((*cells, Cell(status=verdict_status(row.verdict))))
    if verification:
        shows = "Verification: each closed form against the reference that makes the same assumption about the masses."
        reading = f"These are fractions and should be round-off. {ERRORS_DEFINED} A row fails above its bound."
    else:
        shows = "Modelling error: formulas against a reference whose mass model is another, so a real difference is expected."
        reading = f"A measured result without a bound. {ERRORS_DEFINED}"
    kind = "verification" if verification else "modelling"
    return Table(f"{anchor}-{kind}", shows, columns(names, numeric=names[3:-1]), tuple(body), reading)


def _evidence_table(record: CaseRecord, anchor: str) -> Table:
    rows: list[tuple[str, str, float | None, str]] = []

    def add(what: str, value: float | None, unit: str, meaning: str) -> None:
        if value is not None:
            rows.append((what, with_unit(scientific(value), unit), value, meaning))

    add("Loop closure", record.closure_residual, "m", "largest gap left in any loop; round-off is about 1e-16 to 1e-13")
    add("Velocity residual", record.velocity_residual, "m/s", "how far the velocities violate the closed loops")
    add("Acceleration residual", record.acceleration_residual, "m/s²", "how far the accelerations violate them")
    if record.rank is not None:
        text = f"{record.rank} of {count(record.constraint_rows)}"
        redundant = f", {record.redundant_rows} redundant by nature" if record.redundant_rows else ""
        rows.append(("Rank of the constraints", text, record.rank, f"independent rows of all constraint rows{redundant}"))
    if record.mobility is not None:
        idle = f", besides {record.idle_freedoms} idle spins" if record.idle_freedoms else ""
        rows.append(("Mobility", str(record.mobility), record.mobility, f"freedoms that the actuators drive{idle}"))
    add("Condition number", record.condition, "", "largest over the case; the digits that linear algebra may lose")
    for level, value in record.kinematics.items():
        add(f"Kinematics: {level}", value, "", "closed form against the reference, largest error over the peak")
    return Table(
        f"{anchor}-evidence",
        "Loop closure, rank and kinematics: the evidence that reference and closed form describe the same closed mechanism.",
        columns(("Check", "Value", "Meaning"), numeric=("Value",)),
        tuple((Cell(what), Cell(text, value), Cell(meaning)) for what, text, value, meaning in rows),
        "Residuals are maxima over the case; an error below the reference's own residuals says nothing about the formula.",
    )


def _singularity_table(record: CaseRecord, anchor: str) -> Table:
    return Table(
        f"{anchor}-singularity",
        "Distance from singular poses: the smallest value that each scaled determinant reaches.",
        columns(("Measure", "Smallest value", "At"), numeric=("Smallest value", "At")),
        tuple(
            (
                Cell(name),
                Cell(exact(found.min, 3), found.min),
                Cell("–" if found.time is None else f"{exact(found.time)} s", found.time),
            )
            for name, found in record.singularity.items()
        ),
        "Dimensionless: 1 is far away, 0 is singular; near 0 the torques grow without limit and relative errors with them.",
    )


def joint_heading(run: Run, joint: str) -> str:
    """Return ``q1 [N]``: the joint with the unit of its force or torque."""
    return f"{joint} [{pretty_unit(run.manifest.unit_of(joint))}]"
