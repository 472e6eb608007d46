"""Change parameters in an MJCF file: ``NAME=VALUE`` from a user, moved into every number that follows from it."""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from workbench.errors import ModelError, OutputError, ParameterError
from workbench.mjcf.compile import find_model
from workbench.robots.assignments import parse_assignment, resolve_changes
from workbench.robots.inertia import refuse_impossible_bodies
from workbench.robots.load import LoadedModel, confirm, load_model, load_text
from workbench.robots.parameters import changed_parameters, stored_names
from workbench.robots.values import rewrite


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


def resolve_for(path: str | Path, changes: Sequence[str]) -> dict[str, float]:
    """`resolve_changes` for a model file: what ``--set`` hands to `workbench.robots.load.load_model` as overrides.

    Raises
    ------
    ModelError, ParameterError
        As `workbench.robots.load.load_model` and `resolve_changes`.
    """
    for text in changes:
        parse_assignment(text)
    loaded = _describing(path)
    assert loaded.kind is not None
    assert loaded.values is not None
    return resolve_changes(loaded.kind, loaded.values, changes)


def edit_file(
    path: str | Path, changes: Sequence[str], out: str | Path | None = None, in_place: bool = False
) -> EditResult:
    """Change parameters of an MJCF file.

    Bodies, sites, inertias and visible geoms move together; comments, layout, line endings and every other digit stay.
    The new file is compiled and read back before it is written, and replaces the old one in one step.

    Parameters
    ----------
    path
        The model, which has to keep the closed form's assumptions.
    changes
        ``a2=0.31``, ``a2*=1.1``, ``m1_left+=0.1`` ..., SI; several at once.
    out
        File to write; replaced where it exists.
    in_place
        Write *path* itself. Exactly one of *out* and *in_place* is needed.

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
    source = find_model(path)
    if in_place and source != Path(path):
        raise OutputError(f"{path} comes with the workbench and is not changed in place; write to another file")
    target = source if out is None else Path(out)
    _refuse_target(target)
    loaded = _describing(path)
    assert loaded.kind is not None
    assert loaded.values is not None
    given = resolve_changes(loaded.kind, loaded.values, changes)
    wanted = changed_parameters(loaded.kind, loaded.values, given)
    refuse_impossible_bodies(loaded.model, loaded.kind, loaded.file, loaded.values, wanted)
    text = rewrite(loaded.text, loaded.file, loaded.kind, loaded.values, wanted)
    confirm(load_text(text, loaded.file).model, loaded.kind, loaded.file, wanted)
    _write(target, text, source)
    units = {name: info.unit for name, info in stored_names(loaded.kind.parameter_table).items()}
    moved = tuple(
        Change(name, units[name], loaded.values[name], value)
        for name, value in wanted.items()
        if value != loaded.values[name]
    )
    return EditResult(source, target, moved, changed_lines(loaded.text, text))


def changed_lines(before: str, after: str) -> tuple[int, ...]:
    """Numbers, from 1, of the lines in which two versions of a model differ; an edit keeps the number of lines."""
    pairs = zip(before.split("\n"), after.split("\n"), strict=True)
    return tuple(index for index, (old, new) in enumerate(pairs, start=1) if old != new)


def _describing(path: str | Path) -> LoadedModel:
    loaded = load_model(path)
    if loaded.kind is None:
        raise ModelError(
            f'{path}: parameters cannot be set, <custom> has no <text name="mechanism"> that says what they mean',
            file=str(path),
        )
    return loaded


def _refuse_target(target: Path) -> None:
    try:
        mode = os.lstat(target).st_mode
    except FileNotFoundError:
        if not target.parent.is_dir():
            raise OutputError(f"{target}: there is no directory {target.parent}") from None
        return
    except (OSError, ValueError) as error:
        raise OutputError(f"{str(target)!r}: {getattr(error, 'strerror', None) or error}") from error
    if stat.S_ISLNK(mode):
        raise OutputError(f"{target}: is a symbolic link; name the file that it leads to")
    if not stat.S_ISREG(mode):
        raise OutputError(f"{target}: is {'a directory' if stat.S_ISDIR(mode) else 'no regular file'}; name a file")
    _refuse_protected(target)


def _refuse_protected(target: Path) -> None:
    """Refuse a file that its owner has protected, or that has a second name which would keep the old content."""
    try:
        status = os.lstat(target)
    except OSError:
        return
    if not status.st_mode & stat.S_IWUSR or not os.access(target, os.W_OK):
        raise OutputError(f"{target}: is read-only; make it writable or name another file")
    if status.st_nlink > 1:
        raise OutputError(
            f"{target}: has {status.st_nlink} names (hard links), of which one would change; name another file"
        )


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
