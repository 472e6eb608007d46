"""The sections of a study's report: what the claims came to, the curves behind them, what is unstable."""

from __future__ import annotations

import math
from typing import Any

from workbench.control.names import NOT_RUN
from workbench.report.control.curves import RATE, SPEED, curve, is_number
from workbench.report.control.film import film_section
from workbench.report.control.gap import gap_section
from workbench.report.control.load import MOST_ROWS, StudyRun
from workbench.report.plot import Plot
from workbench.report.section import Section, plain_section
from workbench.report.sections import NO_REAL_ROBOT, parameters_section, reproduce_section
from workbench.report.tables import HOLDS, NOT_ABOUT, REFUTED, UNDECIDED, Cell, Status, Table, columns

LOOKS = {"holds": HOLDS, "does not hold": REFUTED, NOT_ABOUT.text: NOT_ABOUT}

DECIDED = 0.1
"""An error that is not known to this part of itself is called undecided."""


def study_sections(run: StudyRun) -> list[Section]:
    """Return all sections of a study's report."""
    sections = [
        _answer_section(run),
        _over_section(run, RATE, "Tracking error over the control rate"),
        _over_section(run, SPEED, "Tracking error over the speed"),
        gap_section(run),
        film_section(run),
        _unstable_section(run),
        _errors_section(run),
        _setting_section(run),
        parameters_section(run.manifest),
        reproduce_section(run.manifest),
        _limits_section(run),
    ]
    return [section for section in sections if section is not None]


def _status(verdict: str) -> Status:
    return LOOKS.get(verdict, UNDECIDED)


def _varied(verdict: str) -> Cell:
    return Cell(NOT_RUN) if verdict == NOT_RUN else Cell(status=_status(verdict))


def _answer_section(run: StudyRun) -> Section:
    study = run.study
    known = (
        f"{study.undecided} errors are not known to a tenth of themselves"
        if study.undecided
        else "Every error is known to a tenth of itself"
    )
    counts = f"{run.manifest.verdict}. {known}."
    tables = []
    if study.claims:
        rows = []
        for claim in study.claims:
            differing = [name for name, verdict in claim.varied.items() if verdict not in (claim.verdict, NOT_RUN)]
            robust = "the same throughout" if not differing else "another verdict with: " + ", ".join(differing)
            robust = robust if claim.varied else ""
            rows.append(
                (
                    Cell(claim.text), Cell(claim.source), Cell(status=_status(claim.verdict)),
                    Cell(claim.sentence + (f" ({claim.note})" if claim.note else "")), Cell(robust),
                )
            )  # fmt: skip
        tables.append(
            Table(
                "control-claims",
                "Sentences about models in control, judged by tracking errors.",
                columns(("Claim", "Source", "Verdict", "What decides it", "Step, integrator and gains varied")),
                tuple(rows),
                f"A model is enough at a point where its platform error (rms) is at most {100 * study.enough:g} % above"
                f" the other model's, or below {1e3 * study.wanted_m:g} mm. “Known to” is the largest change of that"
                " share with half the plant's step, or by MuJoCo's own integrator and loops.",
            )
        )
        tables += _varied_table(run)
    return plain_section("answer", "Is the model enough for control", [counts], tables)


def _varied_table(run: StudyRun) -> list[Table]:
    claims = [claim for claim in run.study.claims if claim.varied]
    names = list(dict.fromkeys(name for claim in claims for name in claim.varied))
    if not claims:
        return []
    return [
        Table(
            "control-varied",
            "The same verdicts with step, integrator and gains varied.",
            columns(("Claim", *names)),
            tuple((Cell(claim.id), *(_varied(claim.varied.get(name, NOT_RUN)) for name in names)) for claim in claims),
            "Each column judges all claims again: by runs at half the step, by MuJoCo's route, by one bandwidth.",
        )
    ]


def _cases(run: StudyRun) -> list[str]:
    return list(dict.fromkeys(row["case"] for row in run.runs))


def _bandwidths(run: StudyRun) -> list[float]:
    return sorted({row["bandwidth"] for row in run.runs})


def _over_section(run: StudyRun, over: str, title: str) -> Section | None:
    other = SPEED if over == RATE else RATE
    fixed = sorted({row[other] for row in run.runs if row["rate_asked"] != "printed cost"})
    if not fixed:
        return None
    middle = min(fixed, key=lambda value: abs(math.log(value))) if over == RATE else fixed[len(fixed) // 2]
    widths = _bandwidths(run)
    width = widths[(len(widths) - 1) // 2]
    plots = [plot for case in _cases(run) if (plot := curve(run, over, case, middle, width)) is not None]
    if not plots:
        return None
    return _with_figures(f"over-{over}", title, plots, "One line for each controller with its model; logarithmic axes.")


def _with_figures(key: str, title: str, plots: list[Plot], note: str) -> Section:
    context = {"paragraphs": [], "tables": [], "figures": plots, "note": note}
    return Section(key, title, "sweep", context, tuple(plots))


def _unstable_section(run: StudyRun) -> Section | None:
    """Which loops ran away, and the lowest rate at which each controller still tracks."""
    unstable = [row for row in run.runs if row["reason"] and run.platform(row) is None]
    if not unstable:
        return None
    rows = []
    for key in dict.fromkeys((r["case"], run.place(r).name, r["speed"], r["bandwidth"]) for r in run.runs):
        mine = [r for r in run.runs if (r["case"], run.place(r).name, r["speed"], r["bandwidth"]) == key]
        lost = [r for r in mine if run.platform(r) is None]
        if not lost:
            continue
        kept = [r["rate"] for r in mine if run.platform(r) is not None]
        lowest = f"{min(kept):g}" if kept else "none"
        rows.append(
            (
                Cell(key[0]), Cell(key[1]), Cell(f"{key[2]:g}", key[2]), Cell(f"{key[3]:g}", key[3]),
                Cell(lowest, min(kept, default=math.nan)), Cell(lost[0]["reason"]),
            )
        )  # fmt: skip
    table = Table(
        "control-unstable",
        "Loops that do not track: unstable, or led where the loops of the mechanism cannot be closed.",
        columns(
            ("Case", "Controller", "Speed", "Bandwidth [Hz]", "Lowest rate that tracks [Hz]", "First that does not"),
            numeric=("Speed", "Bandwidth [Hz]", "Lowest rate that tracks [Hz]"),
        ),
        tuple(rows[:MOST_ROWS]),
        "A loop is called unstable when a joint is off by more than its stroke (at least 0.05 m or rad).",
    )
    return plain_section("unstable", "Stability", [f"{len(unstable)} of {len(run.runs)} runs do not track."], [table])


def _errors_section(run: StudyRun) -> Section:
    """Every run's error with the difference that routes and steps make to it."""
    rows = []
    for row in run.runs:
        error = run.platform(row)
        if error is None:
            continue
        step = abs(error["rms_halved"] - error["rms"]) if is_number(error["rms_halved"]) else math.nan
        route = abs(error["rms_second"] - error["rms"]) if is_number(error["rms_second"]) else math.nan
        known = max((value for value in (step, route) if not math.isnan(value)), default=math.nan)
        decided = known <= DECIDED * error["rms"]
        effort = [run.errors[row["index"]][joint]["effort"] for joint in run.manifest.joints]
        hit = max(run.errors[row["index"]][joint]["saturated"] for joint in run.manifest.joints)
        rows.append(
            (
                Cell(row["case"]), Cell(run.place(row).name), Cell(f"{row['speed']:g}", row["speed"]),
                Cell(f"{row['rate']:.6g}", row["rate"]), Cell(f"{row['bandwidth']:g}", row["bandwidth"]),
                Cell(f"{1e3 * error['rms']:.3g}", error["rms"]), Cell(f"{1e3 * error['peak']:.3g}", error["peak"]),
                Cell(_micro(step), step), Cell(_micro(route), route),
                Cell("") if decided else Cell(status=UNDECIDED),
                Cell(", ".join(f"{value:.3g}" for value in effort)), Cell(f"{100 * hit:.2g} %" if hit else "–", hit),
            )
        )  # fmt: skip
    units = ", ".join(run.manifest.force_units)
    names = (
        "Case", "Controller", "Speed", "Rate [Hz]", "Bandwidth [Hz]", "rms [mm]", "Peak [mm]", "Half step [µm]",
        "Second route [µm]", "Known", f"Effort, rms [{units}]", "Saturated",
    )  # fmt: skip
    table = Table(
        "control-errors",
        "Tracking error of the platform, what half the step and the second route change of it, and torque effort.",
        columns(names, numeric=[name for name in names if name not in ("Case", "Controller", "Known", names[-2])]),
        tuple(rows[:MOST_ROWS]),
        f"{min(len(rows), MOST_ROWS)} of {len(rows)} runs; all of them, with every joint, stand in errors.parquet. An"
        " error is undecided where it is not known to a tenth of itself.",
    )  # fmt: skip
    return Section("errors", "All tracking errors", "sweep",
                   {"paragraphs": [], "tables": [table], "figures": (), "note": ""}, is_open=False)  # fmt: skip


def _micro(value: float) -> str:
    return "–" if math.isnan(value) else f"{1e6 * value:.2g}"


def _setting_section(run: StudyRun) -> Section:
    spec = run.manifest.spec.get("control") or {}
    shown = {
        "controllers": "Controllers", "models": "Models", "rates": "Rates [Hz]", "highest_rate": "Highest rate [Hz]",
        "bandwidths": "Bandwidths [Hz]", "damping": "Damping ratio", "speeds": "Speeds", "delay": "Delay",
        "resolution": "Encoder resolution [m, rad]", "noise": "Noise, standard deviation [m, rad]",
        "rate_from": "Rates from", "seed": "Seed", "limits": "Torque limits", "plant": "Parameters of the plant alone",
        "force_known": "The models know the external force", "printed_cost": "Printed cost [µs]",
        "step": "Plant's step [s]", "duration": "Tracked, at most [s]",
    }  # fmt: skip
    rows = tuple((Cell(text), Cell(_plain(spec.get(key)))) for key, text in shown.items())
    table = Table(
        "control-setting",
        "How the loops are sampled and tuned; the same for all models.",
        columns(("Setting", "Value")),
        rows,
        "Gains: kp = omega^2 and kd = 2 zeta omega, times the diagonal of the reference's mass matrix at home where the"
        " controller has no model of its own for it.",
    )
    return plain_section("setting", "Setting", [], [table])


def _plain(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(_plain(one) for one in value)
    if isinstance(value, dict):
        return ", ".join(f"{key} {_plain(one)}" for key, one in value.items() if one is not None) or "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "–" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def _limits_section(run: StudyRun) -> Section:
    points = [
        NO_REAL_ROBOT,
        "Bars and joints are rigid, actuators give the torque that is asked for at once, encoders sit at the joints: a "
        "real robot bends, and its drives have a bandwidth of their own.",
        "Errors are taken at the ticks. What happens between two ticks of a slow loop is not in them.",
        "Each run begins on its motion, at its rates; what a controller does with a first jump is not part of it.",
        "What is stable here may grow slowly: a loop is called unstable only when a joint has left its stroke within "
        "the time that is tracked.",
    ]
    points += _step_left_open(run)
    if run.study.undecided:
        points.append(f"{run.study.undecided} errors are not known to a tenth of themselves and decide nothing.")
    return Section("limits", "Limits and caveats", "limits", {"points": points})


def _step_left_open(run: StudyRun) -> list[str]:
    """What is not known of the plant's step where no run was made again at its half."""
    tracked = [(row, error) for row in run.runs if (error := run.platform(row)) is not None]
    halved = [(row["rate"], error) for row, error in tracked if is_number(error["rms_halved"])]
    missing = sum(not is_number(error["rms_halved"]) for _, error in tracked)
    if not missing:
        return []
    said = (
        f"{missing} of {len(tracked)} runs were not made again at half the plant's step; above 2 kHz only those at the"
        " rate of a printed cost are"
    )
    if not halved:
        return [f"{said}. What the step costs in the others is known by MuJoCo's route alone."]
    rate = max(rate for rate, _ in halved)
    most = max(abs(e["rms_halved"] / e["rms"] - 1.0) for at, e in halved if at == rate and e["rms"] > 0.0)
    return [
        f"{said}. At {rate:g} Hz half of it changed no error by more than {100 * most:.2g} %. What it changes in the"
        " others is known by MuJoCo's route alone, which takes steps of the same length in other coordinates; were both"
        " to err alike, nothing here would show it."
    ]
