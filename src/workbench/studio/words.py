"""What the page says of an outcome, as HTML; every sentence is about the robot and the motion that are shown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from workbench.campaign.compare import Row
from workbench.campaign.verdict import EXPECTED_FAIL, FAIL, PASS, UNEXPECTED_PASS
from workbench.report.text import torque_name
from workbench.studio.outcome import Outcome
from workbench.studio.reproduce import grouped
from workbench.studio.session import FILE, STEP, Session

GOOD, BAD, MUTED = "#2b8a3e", "#c92a2a", "inherit"
MOST_REACTIONS = 4
STYLE = (
    "<style>.wb{font-size:0.82rem;line-height:1.42;padding:0 0.7em}.wb table{border-collapse:collapse;width:100%;"
    "margin:0.3em 0 0.6em;font-variant-numeric:tabular-nums}.wb td,.wb th{padding:0.12em 0.35em;text-align:right;"
    "border-bottom:1px solid color-mix(in srgb,currentColor 16%,transparent)}.wb td:first-child,.wb th:first-child"
    "{text-align:left;padding-left:0}.wb th{font-weight:600}.wb h3{font-size:0.9rem;margin:0.7em 0 0.1em}"
    ".mantine-Slider-root+.mantine-NumberInput-root{width:4.4rem!important}"
    ".wb p{margin:0.25em 0}.wb .say{border-left:3px solid;padding:0.25em 0.6em;margin:0.4em 0}.wb small{opacity:.75}"
    "</style>"
)


def number(value: float, digits: int = 4) -> str:
    """A number as people read it."""
    if not math.isfinite(value):
        return "not finite"
    return f"{value:.{digits}g}"


def head(session: Session, working: bool = False) -> str:
    """Who is shown, what was changed, and whether it is what is asked for."""
    subject, good = session.subject, session.good
    robot, spec = good.case.robot, good.case.spec
    parts = [f"<p><b>{escape(robot.title)}</b><br><small>{escape(subject.opened)}"]
    parts.append(f" · campaign {escape(subject.campaign.name)}" if subject.has_campaign else " · no campaign")
    parts.append(f" · case {escape(spec.name)}</small></p>")
    if session.problem:
        parts.append(_say(BAD, f"<b>Not shown:</b> {escape(session.problem)}<br>Shown is the last state that works."))
    elif session.stale or working:
        parts.append(_say("#e67700", "<b>Old:</b> computing what was just asked for."))
    parts.append(_state(session))
    parts += [f"<p><small>{escape(line)}</small></p>" for line in _about(session)]
    return _page(parts)


def _state(session: Session) -> str:
    good = session.good
    moved = changes_in_words(session, good)
    if not moved:
        run = session.subject.run
        if run is not None:
            return f"<p>As run in {escape(str(run.folder))}; nothing was changed here.</p>"
        return "<p>As the files have it; nothing was changed here.</p>"
    return f"<p><b>Changed here:</b> {'; '.join(escape(text) for text in moved)}.</p>"


def changes_in_words(session: Session, outcome: Outcome) -> list[str]:
    """What was changed by hand, from what to what."""
    table, state = session.subject.base.description.table, outcome.state
    start = table.changed(session.subject.base.values, session.subject.start(state.case))
    found = []
    for name, value in grouped(table, dict(state.changes)).items():
        before = {start[member] for member in table.members(name)}
        unit = table.infos[table.members(name)[0]].unit
        was = number(before.pop(), 6) if len(before) == 1 else "values that differed"
        found.append(f"{name} from {was} to {number(value, 6)} {'' if unit == '1' else unit}".rstrip())
    found += [f"motion {number(state.amplitude)} times as large"] if state.amplitude != 1.0 else []
    found += [f"motion {number(state.speed)} times as fast"] if state.speed != 1.0 else []
    return found


def _about(session: Session) -> Iterable[str]:
    good, subject = session.good, session.subject
    state = good.state
    if subject.campaign.claim:
        if state.changes or _beyond_campaign(session):
            yield "The paper's claims are not about this robot, and are not judged here."
        elif state.moved:
            yield "The paper's claims are not about this motion, and are not judged here."
        else:
            yield "The paper's claims are judged by workbench run, on all samples."
    run = subject.run
    if run is not None and not run.same_model:
        yield f"The model's file was changed since {run.folder} was run: what is shown is computed from the file now."
    shown, whole = len(good.t), good.whole
    if whole is not None and whole != shown:
        yield f"{shown} of the case's {whole} samples: between them peaks may be a little larger."
    else:
        yield f"{shown} samples."


def _beyond_campaign(session: Session) -> bool:
    """Whether the robot has other parameters than the campaign gives it, by the command line or a run."""
    subject = session.subject
    spec = subject.spec(session.good.state.case)
    table = subject.base.description.table
    own = table.changed(subject.base.values, table.layered(subject.campaign.parameters, spec.parameters))
    return own != dict(session.good.case.robot.values)


def verdict(session: Session) -> str:
    """Formulas against MuJoCo: the largest error of each, its bound, and what follows."""
    good = session.good
    parts = ["<h3>Formulas against MuJoCo</h3>"]
    if not good.rows:
        parts.append("<p>No formula is held against MuJoCo. Choose some under Motion, or start with --candidates.</p>")
        return _page(parts)
    lines = []
    for pair in dict.fromkeys((row.candidate, row.reference, row.bound is None) for row in good.rows):
        rows = [r for r in good.rows if (r.candidate, r.reference, r.bound is None) == pair]
        worst = max(rows, key=lambda row: row.peak_error if math.isfinite(row.peak_error) else math.inf)
        lines.append(
            f"<tr><td>{escape(pair[0])}<br><small>against {escape(pair[1])}</small></td>"
            f"<td>{number(worst.peak_error, 3)}<br><small>{escape(worst.joint)}, t = {number(worst.worst_time_s, 4)} s"
            f"</small></td><td>{_judged(rows)}</td></tr>"
        )
    parts.append("<table><tr><th>formula</th><th>largest error</th><th>verdict</th></tr>" + "".join(lines) + "</table>")
    parts.append("<p><small>Error: largest difference over the largest torque of that joint.</small></p>")
    parts += [f"<p><small>{escape(w)}</small></p>" for w in good.facts["warnings"]]
    if good.facts.get("message"):
        parts.append(_say(BAD, escape(str(good.facts["message"]))))
    return _page(parts)


def _judged(rows: Sequence[Row]) -> str:
    verdicts, bound = {row.verdict for row in rows}, rows[0].bound
    if bound is None:
        return "measured"
    if verdicts == {PASS}:
        return f'<b style="color:{GOOD}">✓ within {number(bound)}</b>'
    if FAIL in verdicts:
        return f'<b style="color:{BAD}">✗ beyond {number(bound)}</b>'
    if EXPECTED_FAIL in verdicts:
        return f"beyond {number(bound)}, as the campaign declares"
    if UNEXPECTED_PASS in verdicts:
        return f"within {number(bound)}; the campaign declares otherwise for its own robot and motion"
    return "undecided: the reference itself is not known that well"


def against_words(session: Session) -> str:
    """What the page compares with, in words."""
    return {FILE: "file", STEP: "step before"}.get(session.against, "")


def peaks(session: Session, other: Outcome | None) -> str:
    """Peak torques, powers and reactions, beside those of what is compared with."""
    good = session.good
    robot = good.case.robot
    name = against_words(session)
    parts = ["<h3>What the motors need</h3>"]
    columns = f"<th>{escape(name)}</th><th>change</th>" if other else ""
    lines = [f"<tr><th>peak</th><th>now</th>{columns}</tr>"]
    rows = [
        *((f"|{torque_name(j)}|, {u}", good.peak_torques()[i].value, other.peak_torques()[i].value if other else None)
          for i, (j, u) in enumerate(zip(robot.joints, robot.force_units, strict=True))),
        *((f"|power {j}|, W", good.peak_powers()[i].value, other.peak_powers()[i].value if other else None)
          for i, j in enumerate(robot.joints)),
    ]  # fmt: skip
    lines += [_line(*row) for row in rows]
    parts.append(f"<table>{''.join(lines)}</table>")
    mine = good.peak_reactions()
    if mine:
        theirs = other.peak_reactions() if other else {}
        largest = sorted(mine, key=lambda joint: -mine[joint].value)[:MOST_REACTIONS]
        lines = [f"<tr><th>peak reaction, N</th><th>now</th>{columns}</tr>"]
        lines += [
            _line(joint, mine[joint].value, theirs[joint].value if joint in theirs else None) for joint in largest
        ]
        parts.append(f"<h3>Joint reactions</h3><table>{''.join(lines)}</table>")
        if len(mine) > len(largest):
            parts.append(f"<p><small>The {len(largest)} largest of {len(mine)}.</small></p>")
    return _page(parts)


def _line(name: str, now: float, before: float | None) -> str:
    cells = f"<td>{escape(name)}</td><td>{number(now)}</td>"
    if before is not None:
        change = f"{100 * (now / before - 1):+.1f} %" if before else "–"
        cells += f"<td>{number(before)}</td><td>{change}</td>"
    return f"<tr>{cells}</tr>"


def pose_facts(session: Session) -> str:
    """How well conditioned the motion is, and where it comes closest to a singular pose."""
    facts = session.good.facts
    lines = [
        f"<tr><td>condition of the loops, largest</td><td>{number(facts['condition'], 3)}</td></tr>",
        f"<tr><td>platform's peak speed</td><td>{number(facts['peak_speed'])} m/s</td></tr>",
        f"<tr><td>platform's peak acceleration</td><td>{number(facts['peak_acceleration'])} m/s²</td></tr>",
    ]
    lines += [
        f"<tr><td>nearest singular pose, |{escape(name)}|</td><td>{number(found['min'], 3)} of its scale at"
        f" {number(found['time'])} s</td></tr>"
        for name, found in facts["singularity"].items()
    ]
    return _page(["<h3>Poses</h3>", f"<table>{''.join(lines)}</table>"])


def moment(outcome: Outcome, sample: int) -> str:
    """Time and torques of the pose that is drawn."""
    robot = outcome.case.robot
    torques = ", ".join(
        f"{escape(torque_name(j))} {number(float(v), 3)} {u}"
        for j, u, v in zip(robot.joints, robot.force_units, outcome.tau[sample], strict=True)
    )
    place = ", ".join(
        f"{name} {number(float(v), 3)}" for name, v in zip(robot.platform_axes, outcome.case.x[sample], strict=False)
    )
    return _page([f"<p>t = {number(float(outcome.t[sample]))} s · {torques}<br><small>platform {place}</small></p>"])


def finite(values: Iterable[float]) -> list[float | None]:
    """Numbers with None for those that are not finite, as a plot wants them."""
    return [float(v) if np.isfinite(v) else None for v in values]


def _say(colour: str, text: str) -> str:
    return f'<div class="say" role="status" style="border-color:{colour}">{text}</div>'


def _page(parts: Iterable[str]) -> str:
    return f'{STYLE}<div class="wb">{"".join(parts)}</div>'
