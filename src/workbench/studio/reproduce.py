"""What was found by hand as something that others can run: a command, a case, a diff, a table."""

from __future__ import annotations

import difflib
import re
import shlex
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from workbench.campaign.cases import case_on, plan_motion
from workbench.campaign.motion_spec import TableMotion
from workbench.campaign.spec import CaseSpec
from workbench.errors import OutputError, WorkbenchError
from workbench.robots.edit import edit_file
from workbench.robots.parameters import ParameterTable
from workbench.studio.motions import as_table, scaled_spec
from workbench.studio.outcome import Outcome, overrides_of
from workbench.studio.session import Session
from workbench.studio.state import State

COPY = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+-]{0,95}\.xml")
"""Names of copies: a file in the directory where the studio was started, never a path."""


def grouped(table: ParameterTable, values: Mapping[str, float]) -> dict[str, float]:
    """Parameters with groups in place of members that are all given, and equal."""
    found = dict(values)
    for group, members in table.groups.items():
        own = {found.get(member) for member in members}
        if len(own) == 1 and None not in own:
            place = list(found)
            first = min(place.index(member) for member in members)
            value = found[members[0]]
            kept = [(name, number) for name, number in found.items() if name not in members]
            found = dict([*kept[:first], (group, value), *kept[first:]])
    return found


def set_command(session: Session) -> str:
    """The command that computes the shown state, with every sample of the case.

    Raises
    ------
    OutputError
        No option says what was changed: the motion was.
    """
    subject, state = session.subject, session.good.state
    if not subject.has_campaign:
        raise OutputError("this robot has no campaign: keep the case as a file, and run that")
    if state.moved:
        raise OutputError("the motion was changed, too, which no option says: keep the case, and run that")
    given = grouped(subject.base.description.table, _over_campaign(session))
    words = ["workbench", "run", subject.shown_campaign, "--only", state.case]
    words += [word for name, value in given.items() for word in ("--set", f"{name}={value!r}")]
    words += ["--model", str(subject.other_model)] if subject.other_model else []
    words += [word for name in subject.candidates for word in ("--candidates", name)]
    return shlex.join(words)


def _over_campaign(session: Session) -> dict[str, float]:
    """Parameters that are not what campaign and case say: those of a run, of the command line, and by hand."""
    subject, state = session.subject, session.good.state
    table, spec = subject.base.description.table, subject.spec(state.case)
    own = table.expand(table.layered(subject.campaign.parameters, spec.parameters))
    wanted = table.expand(session.overrides())
    return {name: value for name, value in wanted.items() if own.get(name) != value}


def campaign_case(session: Session, name: str) -> tuple[str, dict[str, str]]:
    """The shown state as a ``[[case]]`` table, with every sample of the case it came from; and files that it names.

    Returns
    -------
    str, dict
        TOML for the end of the campaign's file; of a robot without a campaign a whole campaign. File name -> content.
    """
    subject, state = session.subject, session.good.state
    spec = subject.spec(state.case)
    table = subject.base.description.table
    shown = scaled_spec(spec, state.amplitude, state.speed)
    motion: dict[str, Any] = shown.motion.model_dump(exclude_none=True)
    files: dict[str, str] = {}
    if isinstance(spec.motion, TableMotion) and state.moved:
        whole = _whole_table(session, spec, state)
        motion = {"kind": "csv", "file": f"{name}.csv"}
        files[f"{name}.csv"] = whole
    given = table.expand(overrides_of(subject, state))
    parameters = grouped(
        table, {n: v for n, v in given.items() if table.expand(subject.campaign.parameters).get(n) != v}
    )
    lines = ["[[case]]", f'name = "{name}"', f"title = {_text(_title(session))}"]
    if any(spec.external_force):
        lines.append(f"external_force = {_value(list(spec.external_force))}")
    if shown.replay is not None:
        lines.append(f"replay = {{ start = {shown.replay.start!r}, stop = {shown.replay.stop!r} }}")
    if spec.bounds:
        lines += ["[case.bounds]", *(f"{_key(joint)} = {bound!r}" for joint, bound in spec.bounds.items())]
    if parameters:
        lines += ["[case.parameters]", *(f"{_key(n)} = {_value(v)}" for n, v in parameters.items())]
    lines += ["[case.motion]", *(f"{key} = {_value(value)}" for key, value in motion.items())]
    text = "\n".join(lines) + "\n"
    return (text if subject.has_campaign else _head(session) + text), files


def _head(session: Session) -> str:
    subject = session.subject
    robot = subject.base.description.robot.path
    where = ["robot", robot.name] if robot.suffix == ".toml" else ["model", subject.model.name]
    lines = ["format = 1", f'name = "{subject.campaign.name}"', f"title = {_text(subject.campaign.title)}"]
    lines.append(f"{where[0]} = {_text(where[1])}")
    for index in session.good.state.rows:
        row = subject.campaign.candidate[index]
        lines += ["", "[[candidate]]", f"name = {_text(row.name)}", f"reference = {_text(row.reference)}"]
        lines += [f"bound = {row.bound!r}"] if row.bound is not None else []
    return "\n".join(lines) + "\n\n"


def _title(session: Session) -> str:
    state = session.good.state
    words = [f"{n} = {v:g}" for n, v in grouped(session.subject.base.description.table, dict(state.changes)).items()]
    words += [f"motion {state.amplitude:g} times as large"] if state.amplitude != 1.0 else []
    words += [f"{state.speed:g} times as fast"] if state.speed != 1.0 else []
    return f"{state.case} with {', '.join(words)}" if words else state.case


def _whole_table(session: Session, spec: CaseSpec, state: State) -> str:
    """Every sample of a table's motion, made larger and faster."""
    subject, robot = session.subject, session.robot()
    planned = plan_motion(spec, subject.file, robot)
    motion = case_on(spec, subject.model, {}, robot, planned).motion
    first = motion.q[:1]
    a, s = state.amplitude, state.speed
    return as_table(
        motion.t / s, first + a * (motion.q - first), a * s * motion.qd, a * s**2 * motion.qdd, robot.joints
    )  # fmt: skip


def _text(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else " " for c in escaped) + '"'


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _text(name)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(one) for one in value)}]"
    if isinstance(value, dict):
        inside = ", ".join(f"{_key(key)} = {_value(one)}" for key, one in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    return repr(value)


def model_changes(session: Session) -> list[str]:
    """The changes of ``workbench model set`` that make the file hold what is shown."""
    table = session.subject.base.description.table
    return [f"{name}={value!r}" for name, value in grouped(table, table.expand(session.overrides())).items()]


def model_diff(session: Session) -> str:
    """The lines of the MJCF that ``workbench model set`` would change, as a diff; empty where nothing is changed.

    Raises
    ------
    WorkbenchError
        The file cannot hold the changes.
    """
    changes = model_changes(session)
    if not changes:
        return ""
    source = session.subject.model
    with tempfile.TemporaryDirectory(prefix="workbench-") as folder:
        copy = Path(folder) / source.name
        edit_file(_edited(session), changes, copy)
        before = source.read_text(encoding="utf-8").splitlines(keepends=True)
        after = copy.read_text(encoding="utf-8").splitlines(keepends=True)
    return "".join(difflib.unified_diff(before, after, source.name, f"{source.stem} (changed)", n=1))


def _edited(session: Session) -> Path:
    """The robot whose model is changed: by its robot file where it has one beside it."""
    return session.subject.other_model or session.subject.model


def write_copy(session: Session, name: str) -> Path:
    """Write the changed model under a new name, in the directory where the studio was started.

    Raises
    ------
    OutputError
        Not the name of an XML file, or one that exists: nothing is ever replaced from the page.
    WorkbenchError
        The file cannot hold the changes.
    """
    if not COPY.fullmatch(name):
        raise OutputError(f'"{name}": allowed: the name of a new file, letters, digits and _ . + -, ending in .xml')
    target = session.folder / name
    if target.exists() or target.is_symlink():
        raise OutputError(f"{name}: exists, and the studio replaces no file; choose another name")
    changes = model_changes(session)
    if not changes:
        raise OutputError("nothing is changed: the copy would be the file itself")
    return edit_file(_edited(session), changes, target).written


def model_command(session: Session, name: str) -> str:
    """The command that writes the same copy."""
    return shlex.join(
        ["workbench", "model", "set", session.subject.shown_model, *model_changes(session), "--out", name]
    )


def csv_of(outcome: Outcome) -> str:
    """Motion, torques of reference and formulas, and power, as a table with a header; SI."""
    case = outcome.case
    joints, motion = case.robot.joints, case.motion
    columns: dict[str, Any] = {"t": motion.t}
    for prefix, values in (("", motion.q), ("d", motion.qd), ("dd", motion.qdd)):
        columns |= {f"{joint}{'_' if prefix else ''}{prefix}": values[:, i] for i, joint in enumerate(joints)}
    for name, tau in outcome.references.items():
        columns |= {f"tau_{joint} MuJoCo {name}": tau[:, i] for i, joint in enumerate(joints)}
    for name, tau in outcome.formulas.items():
        columns |= {f"tau_{joint} {name}": tau[:, i] for i, joint in enumerate(joints)}
    columns |= {f"power_{joint}": outcome.power[:, i] for i, joint in enumerate(joints)}
    header = ",".join(f'"{name}"' if "," in name else name for name in columns)
    rows = np.column_stack(list(columns.values()))
    return "\n".join([header, *(",".join(repr(float(value)) for value in row) for row in rows)]) + "\n"


def or_reason(make: Any, *arguments: Any) -> tuple[str, bool]:
    """What *make* gives, or the one line that says why it gives nothing; and whether it gave something."""
    try:
        return str(make(*arguments)), True
    except WorkbenchError as error:
        return str(error), False
