"""Change parameters in an MJCF file: ``NAME=VALUE`` from a user, moved into every number that follows from it."""

from __future__ import annotations

import contextlib
import os
import re
import stat
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from workbench.errors import OutputError, ParameterError
from workbench.output_file import refuse_target
from workbench.robots.assignments import parse_assignment, resolve_changes
from workbench.robots.catalogue import find_source
from workbench.robots.inertia import refuse_impossible_bodies
from workbench.robots.load import LoadedModel, load_edited, no_parameters, read_base, refuse_computed
from workbench.robots.values import rewrite

MANY = 10.0
"""Lengths and masses that change by such a factor are warned of."""
MEANT = "; lengths are in metres"
COMMENT = re.compile(r"<!--(.*?)-->", re.DOTALL)
NUMBER = re.compile(r"(?<![\w.-])\d+\.?\d*(?:[eE][-+]?\d+)?(?!\w)")
MILLIMETRES = 1000.0
"""Comments give lengths in millimetres as well as in metres."""


@dataclass(frozen=True)
class Change:
    """One parameter before and after an edit, SI; those that follow by the uniform-bar rules are listed too."""

    name: str
    unit: str
    before: float
    after: float


@dataclass(frozen=True)
class EditResult:
    """What an edit did."""

    source: Path
    written: Path
    changes: tuple[Change, ...]
    lines: tuple[int, ...]
    """numbers of the lines that changed, from 1"""
    stale: tuple[int, ...] = ()
    """lines of comments that name a number as it was before"""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Lengths and masses that became many times larger or smaller, each with its factor."""
        return tuple(
            f"{change.name} = {change.after:g} {change.unit} is {_times(change)} what it was ({change.before:g}"
            f" {change.unit}){MEANT if change.unit == 'm' else ''}"
            for change in self.changes
            if change.unit in ("m", "kg") and change.before and not 1 / MANY < change.after / change.before < MANY
        )


def resolve_for(path: str | Path, changes: Sequence[str]) -> dict[str, float]:
    """`resolve_changes` for a robot: what ``--set`` hands to `workbench.robots.load.load_model` as overrides.

    Raises
    ------
    ModelError, ParameterError
        As `workbench.robots.load.load_model` and `resolve_changes`.
    """
    for text in changes:
        parse_assignment(text)
    loaded = read_base(path).loaded
    if loaded.description is None or loaded.values is None:
        raise no_parameters(loaded.file)
    return resolve_changes(loaded.description.table, loaded.values, changes)


def edit_file(
    path: str | Path,
    changes: Sequence[str],
    out: str | Path | None = None,
    in_place: bool = False,
    accept: Callable[[LoadedModel], object] = lambda _: None,
) -> EditResult:
    """Change parameters of an MJCF file.

    Bodies, sites, inertias and visible geoms move together; comments, layout, line endings and every other digit stay.
    The new file is compiled and read back before it is written, and replaces the old one in one step.

    Parameters
    ----------
    path
        The robot, whose model has to keep what its formulas take for granted.
    changes
        ``a2=0.31``, ``a2*=1.1``, ``m1_left+=0.1`` ..., SI; several at once.
    out
        File to write; replaced where it exists.
    in_place
        Write the model itself. Exactly one of *out* and *in_place* is needed.
    accept
        Called with the new model before it is written; raises where it is none that can be used.

    Returns
    -------
    EditResult
        Parameters and lines that changed.

    Raises
    ------
    ParameterError
        Not a change, an unknown name, or a value that the parameter may not have.
    ModelError
        The model cannot be loaded, or cannot hold these values.
    OutputError
        Where it cannot be written.
    """
    if (out is None) == (not in_place):
        raise OutputError(
            f"{path}: give either a file to write to or in-place, not {'neither' if out is None else 'both'}"
        )
    if not changes:
        raise ParameterError("no change is given; allowed: NAME=VALUE, NAME*=FACTOR, /=, +=, -=")
    for text in changes:
        parse_assignment(text)
    found = find_source(path)
    source = found.model
    if (in_place and found.robot is not None and found.robot.builtin) or (in_place and str(source) != found.shown):
        raise OutputError(f"{path} comes with the workbench and is not changed in place; write to another file")
    target = source if out is None else Path(out)
    refuse_target(target)
    base = read_base(path)
    loaded, values = base.loaded, base.loaded.values
    if loaded.description is None or values is None:
        raise no_parameters(loaded.file)
    described = loaded.description
    given = resolve_changes(described.table, values, changes)
    wanted = described.table.changed(values, given)
    refuse_computed(base, given, values)
    refuse_impossible_bodies(base.model, described, loaded.file, values, wanted)
    text, _ = rewrite(base.model, loaded.text, loaded.file, described, values, wanted, base.elements)
    edited = load_edited(base, text, wanted)
    accept(edited)
    _write(target, text, source)
    after = edited.values or wanted
    moved = tuple(
        Change(name, info.unit, values[name], after[name])
        for name, info in described.table.infos.items()
        if after[name] != values[name]
    )
    return EditResult(
        source, target, moved, changed_lines(loaded.text, text), tuple(dict.fromkeys(_stale(text, moved)))
    )


def _times(change: Change) -> str:
    factor = change.after / change.before
    return f"{factor:.4g} times" if abs(factor) >= 1 or not factor else f"1/{1 / factor:.4g} of"


def _stale(text: str, moved: Sequence[Change]) -> Iterator[int]:
    """Lines of comments in which a number stands that a parameter no longer has."""
    old = {size * change.before for change in moved for size in (1.0, MILLIMETRES if change.unit == "m" else 1.0)}
    for comment in COMMENT.finditer(text):
        for number in NUMBER.finditer(text, comment.start(1), comment.end(1)):
            if float(number.group()) in old and _tells(number.group()):
                yield text.count("\n", 0, number.start()) + 1


def _tells(number: str) -> bool:
    """Whether a number in a comment is more than a counter: a fraction, or two digits and more."""
    return "." in number or len(number.strip("0")) > 1 or len(number) > 2


def changed_lines(before: str, after: str) -> tuple[int, ...]:
    """Numbers, from 1, of the lines in which two versions of a model differ; an edit keeps the number of lines."""
    pairs = zip(before.split("\n"), after.split("\n"), strict=True)
    return tuple(index for index, (old, new) in enumerate(pairs, start=1) if old != new)


def _write(target: Path, text: str, source: Path) -> None:
    """Write beside the target and move it there, so that nothing half-written ever has the target's name."""
    temporary = ""
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{target.name[:40]}.", suffix=".part", dir=target.parent)
        with open(handle, "wb") as stream:
            stream.write(text.encode())
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(temporary, stat.S_IMODE(os.stat(target if target.exists() else source).st_mode) | stat.S_IWUSR)
        os.replace(temporary, target)
    except OSError as error:
        if temporary:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
        raise OutputError(f"{target}: {error.strerror or error}") from error
