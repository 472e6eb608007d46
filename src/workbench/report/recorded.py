"""What a case's section says of recorded torques: why they are judged so, and where the difference lies."""

from __future__ import annotations

from workbench.report.manifest import CaseRecord
from workbench.report.tables import Cell, Table, columns
from workbench.report.text import exact, percent, torque_name


def recorded_tables(record: CaseRecord, anchor: str) -> list[Table]:
    """Reasons, parts of the difference, and how the motion was differentiated; empty where nothing was recorded."""
    if not record.recorded:
        return []
    reasons, parts, smoothed = [], [], []
    for label, found in record.recorded.items():
        for joint, one in found.joints.items():
            reasons.append((Cell(label), Cell(torque_name(joint)), Cell(one.reason)))
            for part in one.parts:
                share = percent(part.share) if part.share is not None else "–"
                parts.append(
                    (Cell(label), Cell(torque_name(joint)), Cell(part.name), Cell(part.text), Cell(share, part.share))
                )
        for joint, motion in found.motion.items():
            smoothed.append(
                (
                    Cell(label),
                    Cell(joint),
                    Cell(str(motion.digits) if motion.digits is not None else "–", motion.digits),
                    Cell(_number(motion.noise), motion.noise),
                    Cell(f"{_number(motion.bandwidth_hz)} Hz" if motion.bandwidth_hz else "all", motion.bandwidth_hz),
                    Cell(_number(motion.largest_rate_error), motion.largest_rate_error),
                    Cell(_number(motion.largest_acceleration_error), motion.largest_acceleration_error),
                )
            )
    notes = " ".join(f"{label}: {note}." for label, found in record.recorded.items() for note in found.notes)
    sentences = " ".join(f"{label}: {found.sentence}" for label, found in record.recorded.items())
    return [
        Table(
            f"{anchor}-recorded-reasons",
            "Why the recorded torques are judged as they are.",
            columns(("Record", "Torque", "Reason")),
            tuple(reasons),
            notes,
        ),
        Table(
            f"{anchor}-recorded-parts",
            "Where the difference lies: parts that stand out of their standard errors, the largest first.",
            columns(("Record", "Torque", "Part", "Size", "Share"), numeric=("Share",)),
            tuple(parts),
            f"{sentences} Sizes with their standard errors; the share is of the difference's sum of squares.",
        ),
        Table(
            f"{anchor}-recorded-motion",
            "How the recorded coordinates were differentiated.",
            columns(
                ("Record", "Coordinate", "Digits", "Noise", "Bandwidth", "Rate to", "Acceleration to"),
                numeric=("Digits", "Noise", "Bandwidth", "Rate to", "Acceleration to"),
            ),
            tuple(smoothed),
            "A smoothing spline; noise is the standard deviation of a sample, rounding included. The last columns are"
            " two standard deviations where they are largest, in the coordinate's unit per second and squared.",
        ),
    ]


def _number(value: float | None) -> str:
    return "–" if value is None else exact(value, 3)
