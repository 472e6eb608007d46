"""The tables of a case that say why its reference can be trusted, and where the mechanism moves."""

from __future__ import annotations

from workbench.report.load import Run
from workbench.report.manifest import CaseRecord
from workbench.report.tables import Cell, Status, Table, columns
from workbench.report.text import count, exact, quantity, scientific, with_unit

CONDITION_STATUS = {
    True: Status("passed", "✓", "met"),
    False: Status("refuted", "✗", "not met"),
    None: Status("undecided", "?", "cannot be decided"),
}


def evidence_table(record: CaseRecord, anchor: str) -> Table:
    """Loop closure, rank, mobility, conditioning and kinematics."""
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
        rows.append(
            ("Rank of the constraints", text, record.rank, f"independent rows of all constraint rows{redundant}")
        )
    if record.mobility is not None:
        idle = f", besides {record.idle_freedoms} idle spins" if record.idle_freedoms else ""
        rows.append(("Mobility", str(record.mobility), record.mobility, f"freedoms that the actuators drive{idle}"))
    if record.condition is not None:
        meaning = "largest over the case; its power of ten is the digits that linear algebra may lose"
        rows.append(("Condition number", exact(record.condition, 3), record.condition, meaning))
    for level, value in record.kinematics.items():
        add(f"Kinematics: {level}", value, "", "closed form against the reference, largest error over the peak")
    if rows and not record.kinematics:
        meaning = "the mechanism has no closed form of its kinematics; the platform's motion is the reference's own"
        rows.append(("Kinematics", "not compared", None, meaning))
    return Table(
        f"{anchor}-evidence",
        "Loop closure, rank and kinematics: the evidence that reference and closed form describe the same closed "
        "mechanism.",
        columns(("Check", "Value", "Meaning"), numeric=("Value",)),
        tuple((Cell(what), Cell(text, value), Cell(meaning)) for what, text, value, meaning in rows),
        "Residuals are maxima over the case; an error below the reference's own residuals says nothing about the "
        "formula.",
    )


def singularity_table(record: CaseRecord, anchor: str) -> Table:
    """How close the case comes to singular poses."""
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
        "Dimensionless: 1 is far away, 0 is singular; near 0 the torques grow without limit and relative errors "
        "with them.",
    )


def reactions_table(record: CaseRecord, anchor: str) -> Table:
    """The largest force in every joint."""
    return Table(
        f"{anchor}-reactions",
        "Joint reactions: the largest force that the reference finds in each joint and loop closure.",
        columns(("Joint", "Largest force [N]"), numeric=("Largest force [N]",)),
        tuple((Cell(name), Cell(exact(force), force)) for name, force in record.peak_reactions.items()),
        "Magnitude of the force between the two bodies, over the whole case; where constraints are redundant the "
        "share of each "
        "is the least-squares one.",
    )


def conditions_table(record: CaseRecord, anchor: str) -> Table:
    """The paper's own conditions against singular poses."""
    return Table(
        f"{anchor}-conditions",
        "Conditions that the mechanism's source states against singular poses, evaluated over this case.",
        columns(("Condition", "Value", "Limit", "Outcome", "Note"), numeric=("Value", "Limit")),
        tuple(
            (
                Cell(condition.name),
                Cell(quantity(condition.value, condition.unit), condition.value),
                Cell(f"{condition.relation} {quantity(condition.limit, condition.unit)}".strip(), condition.limit),
                Cell(status=CONDITION_STATUS[condition.holds]),
                Cell(condition.note),
            )
            for condition in record.conditions
        ),
        "What the source asks for is not always necessary or sufficient: compare with the distance from singular "
        "poses above.",
    )


def solutions_table(run: Run, record: CaseRecord, anchor: str) -> Table:
    """All platform positions that the first sample's actuated coordinates allow, where there are several."""
    axes = [f"{axis} [m]" for axis in run.manifest.platform_axes]
    several = record.solutions_at_start if len(record.solutions_at_start) > 1 else ()
    return Table(
        f"{anchor}-solutions",
        "All solutions of the forward position problem at the case's first sample.",
        columns(("Solution", *axes), numeric=axes),
        tuple(
            (Cell(str(number)), *(Cell(exact(value, 8), value) for value in solution))
            for number, solution in enumerate(several, start=1)
            if len(solution) == len(axes)
        ),
        "The mechanism can be assembled in each of these ways; the case moves on one of them.",
    )
