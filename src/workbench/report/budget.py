"""The error budget: what the reference itself is worth, per case and over the campaign."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from workbench.report.load import Run
from workbench.report.manifest import CaseRecord, ReplayRecord
from workbench.report.section import Section
from workbench.report.tables import Cell, Status, Table, columns
from workbench.report.text import exact, percent, pretty_unit, scientific

REPLAY_STATUS = {
    "converges": Status("passed", "✓", "converges"),
    "stalls": Status("measured", "→", "stalls"),
    "diverges": Status("refuted", "✗", "diverges"),
    "undecided": Status("undecided", "?", "undecided"),
}
RAW = "raw mj_inverse"
REFERENCE_TORQUES = "reference"


def budget_tables(run: Run, case: str, anchor: str) -> tuple[Table, ...]:
    """Power balance, second engine and forward replay of one case."""
    record = run.manifest.cases[case]
    return _power_table(run, case, anchor), _replay_table(run, record, anchor)


def _power_table(run: Run, case: str, anchor: str) -> Table:
    record = run.manifest.cases[case]
    evidence = record.evidence
    second = evidence.second_engine
    spread: Mapping[str, Mapping[str, float | None]] = second.spread if second else {}
    joints = list(run.manifest.joints) if second else []
    engine = second.engine if second else ""
    names = ["Reference", "Power balance", "of peak power", "Worst at", "dE/dt known to", "Samples"]
    names += [f"{engine}, {joint}" for joint in joints] + ["Smallest bound", "Uncertainty / bound"]
    rows = []
    for mass_model in dict.fromkeys([*evidence.power_balance, *spread]):
        power = evidence.power_balance.get(mass_model)
        judged = [row for row in run.rows_of_case[case] if row.reference == mass_model and row.bound]
        bound = min((row.bound for row in judged if row.bound), default=None)
        share = max((row.uncertainty / (row.bound or math.inf) for row in judged), default=math.nan)
        rows.append(
            (
                Cell(mass_model),
                Cell(scientific(power.relative if power else None), power.relative if power else None, emphasis=True),
                Cell(f"{exact(power.peak_power_w)} W" if power else "–", power.peak_power_w if power else None),
                Cell(f"{exact(power.worst_time_s)} s" if power else "–", power.worst_time_s if power else None),
                Cell(scientific(power.differentiation if power else None), power.differentiation if power else None),
                Cell(str(power.samples) if power else "–", power.samples if power else None),
                *(Cell(scientific(found), found) for j in joints for found in [spread.get(mass_model, {}).get(j)]),
                Cell(exact(bound), bound),
                Cell(percent(share) if math.isfinite(share) else "–", share),
            )
        )
    engines = (
        f" The columns of {engine} are the peak error of that engine's torques against the reference's."
        if second
        else ""
    )
    return Table(
        f"{anchor}-budget",
        "Error budget: what the reference's own torques are worth, by the balance of power"
        + (" and by a second engine." if second else "; no second engine was asked."),
        columns(names, numeric=names[1:]),
        tuple(rows),
        "Power balance is the largest |τ·q̇ + f·ẋ − dE/dt − losses| over the peak of |τ·q̇|; it cannot be smaller than "
        f"dE/dt is known. A verdict counts where the uncertainty is below a tenth of the bound.{engines}",
    )


def _replay_table(run: Run, record: CaseRecord, anchor: str) -> Table:
    found = record.evidence.replay
    replays = found.candidates if found else {}
    steps = next((replay.steps_s for replay in replays.values()), ())
    headings = [f"{exact(None if step is None else 1e3 * step, 3)} ms" for step in steps]
    names = ["Torques of", "Outcome", "Order", "Joint", *headings, "Step to zero", "In words"]
    rows = [
        (
            Cell(name),
            Cell(status=replay_status(replay)),
            Cell(exact(replay.order, 3), replay.order),
            Cell(_joint_heading(run, replay.worst_joint)),
            *(Cell(exact(error, 3), error) for error in _errors(run, replay, len(steps))),
            Cell(exact(replay.limit, 3), replay.limit),
            Cell(
                f"{replay.text}; simulated with {replay.same_as}: the same torques" if replay.same_as else replay.text
            ),
        )
        for name, replay in replays.items()
    ]
    note = f" ({found.note})" if found and found.note else ""
    return Table(
        f"{anchor}-replay",
        f"Forward replay: MuJoCo driven by the torques alone, with nothing that steers it back{note}.",
        columns(names, numeric=("Order", *headings, "Step to zero")),
        tuple(rows),
        "Largest tracking error of the joint that follows worst, at three time steps. Right torques leave the error of "
        "time stepping, which halves with the step (order 1); wrong ones leave an error that no step cures. It sees "
        "wrong torques from some 0.1 to 1 % on, and always replays on the distributed masses, so lumped torques stall.",
    )


def replay_status(replay: ReplayRecord) -> Status:
    """Return the status of a replay's verdict; ``stalls at ...`` counts as ``stalls``."""
    word = replay.verdict.split(" ", 1)[0]
    return REPLAY_STATUS.get(word, Status("undecided", "?", replay.verdict or "unknown"))


def _errors(run: Run, replay: ReplayRecord, count: int) -> list[float | None]:
    joints = run.manifest.joints
    if replay.worst_joint not in joints:
        return [None] * count
    index = joints.index(replay.worst_joint)
    found = [errors[index] if index < len(errors) else None for errors in replay.peak_error]
    return [*found, *([None] * count)][:count]


def _joint_heading(run: Run, joint: str) -> str:
    if joint not in run.manifest.joints:
        return joint
    return f"{joint} [{pretty_unit(run.manifest.coordinate_units[run.manifest.joints.index(joint)])}]"


def budget_section(run: Run, anchors: Mapping[str, str]) -> Section:
    """Say over all cases why the reference may be believed: each figure's worst value and where."""
    cases = run.manifest.cases
    rows: list[tuple[Cell, ...]] = []

    def add(what: str, found: Iterable[tuple[str, float | None]], unit: str, good: str, misses: str) -> None:
        known = [(case, value) for case, value in found if value is not None]
        if known:
            case, value = max(known, key=lambda item: math.inf if math.isnan(item[1]) else item[1])
            text = f"{scientific(value)} {unit}".strip()
            rows.append((Cell(what), Cell(text, value), Cell(case, link=anchors[case]), Cell(good), Cell(misses)))

    items = list(cases.items())
    add("Loop closure", ((c, r.closure_residual) for c, r in items), "m", "rounding", "anything but kinematics")
    add("Velocity residual", ((c, r.velocity_residual) for c, r in items), "m/s", "rounding", "anything but kinematics")
    add(
        "Acceleration residual",
        ((c, r.acceleration_residual) for c, r in items),
        "m/s²",
        "rounding",
        "anything but kinematics",
    )
    add(
        "Power balance",
        ((c, p.relative) for c, r in items for p in r.evidence.power_balance.values()),
        "of peak power",
        "below a tenth of the bound",
        "torques that do no work",
    )
    add(
        "Second engine",
        (
            (c, value)
            for c, r in items
            if r.evidence.second_engine
            for spread in r.evidence.second_engine.spread.values()
            for value in spread.values()
        ),
        "of peak torque",
        "below a tenth of the bound",
        "what the model file itself has wrong",
    )
    add(
        "Uncertainty over bound",
        ((row.case, row.uncertainty / row.bound) for row in run.rows if row.bound and not math.isnan(row.uncertainty)),
        "",
        "below 0.1: the verdicts count",
        "",
    )
    add(
        "Projection left out (raw mj_inverse)",
        ((row.case, row.peak_error) for row in run.rows if row.candidate == RAW),
        "of peak torque",
        "it is wrong for closed loops: that is the point",
        "",
    )
    skipped = run.manifest.budget is False
    table = Table(
        "budget",
        "The error budget over all cases: the largest value of each figure that judges the reference, and where.",
        columns(("Figure", "Largest value", "Case", "Good is", "It would miss"), numeric=("Largest value",)),
        tuple(rows),
        "None of these uses a closed form of this package. Each case's own budget stands in its section."
        + (" This run was told not to gather power balance, replay and raw mj_inverse." if skipped else ""),
    )
    return Section(
        "budget", "Can the reference be believed", "tables", {"tables": [table, *_replay_summary(run, anchors)]}
    )


def _replay_summary(run: Run, anchors: Mapping[str, str]) -> list[Table]:
    names = list(
        dict.fromkeys(
            name for r in run.manifest.cases.values() if r.evidence.replay for name in r.evidence.replay.candidates
        )
    )
    if not names:
        return []
    rows = []
    for case, record in run.manifest.cases.items():
        replays = record.evidence.replay.candidates if record.evidence.replay else {}
        cells = [
            Cell(status=replay_status(replays[name]), value=replays[name].order) if name in replays else Cell("–")
            for name in names
        ]
        rows.append((Cell(case, link=anchors[case]), *cells))
    return [
        Table(
            "replay",
            "Forward replay of every case: do the torques alone make MuJoCo's model move as prescribed?",
            columns(("Case", *names)),
            tuple(rows),
            "“Converges” says that only the error of time stepping is left, “stalls” that the torques belong to "
            "another robot: a lumped formula on distributed masses must stall, unless its error is too small to be "
            "seen. A dash: nothing was replayed.",
        )
    ]
