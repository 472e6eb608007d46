"""From a file and what a campaign says of it to the model that everything else works with."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import mujoco

from workbench.errors import ModelError
from workbench.mjcf.assets import parse
from workbench.mjcf.compile import compile_spec
from workbench.mjcf.compiler_masses import compiler_changes
from workbench.mjcf.same_robot import check_same_robot
from workbench.mjcf.setup import Preparation, Setup, plan, start
from workbench.mjcf.source import Source, read_source
from workbench.mjcf.text import Element

MOST_NAMED = 4


@dataclass(frozen=True)
class Prepared:
    """A model as it was prepared, and how to make its specification again."""

    reading: Callable[[], Source] = field(repr=False)
    """how `source` is made"""
    preparation: Preparation | None
    """None: the file says all that is needed"""
    model: mujoco.MjModel
    user: mujoco.MjModel
    """the file as it lies; `model` itself where nothing had to be prepared"""
    notes: tuple[str, ...] = ()
    """what a reader of results has to know of the file"""

    @cached_property
    def source(self) -> Source:
        """The file as MuJoCo is handed it."""
        return self.reading()

    def spec(self) -> mujoco.MjSpec:
        """A fresh specification of `model`, to be changed and compiled."""
        spec = parse(self.source)
        return self.preparation.apply(spec) if self.preparation else spec


def open_source(text: str, file: str, folder: Path | None, elements: list[Element] | None = None) -> Prepared:
    """Compile a file as it lies; *elements* are what `workbench.mjcf.text.scan` found in it, where that is known.

    Raises
    ------
    ModelError
        As `workbench.mjcf.source.read_source` and `workbench.mjcf.compile.compile_spec`.
    """
    source = read_source(text, file, folder, elements)
    model = compile_spec(parse(source), file)
    return Prepared(lambda: source, None, model, model, file_notes(source))


def prepare(text: str, file: str, folder: Path | None, setup: Setup) -> Prepared:
    """Compile a file with what a campaign says of it.

    Parameters
    ----------
    text, file, folder
        The MJCF, the name under which errors speak of it, and the directory from which it may read.
    setup
        What the campaign says.

    Raises
    ------
    ModelError
        As `open_source` and `workbench.mjcf.setup.plan`; or the prepared model is not the user's robot.
    """
    return prepared_for(open_source(text, file, folder), file, setup)


def prepared_for(whole: Prepared, file: str, setup: Setup) -> Prepared:
    """As `prepare`, of a file that is compiled as it lies.

    Raises
    ------
    ModelError
        As `prepare`.
    """
    preparation = plan(whole.user, file, setup)
    bare = compile_spec(preparation.apply(parse(whole.source)), file)
    home = start(whole.user, bare, preparation)
    preparation = dataclasses.replace(preparation, qpos=tuple(map(float, home)))
    made = dataclasses.replace(whole, preparation=preparation)
    try:
        model = compile_spec(made.spec(), file)
    except ValueError as error:
        raise ModelError(f"{file}: {error}", file=file) from error
    check_same_robot(whole.user, model, preparation, file)
    return dataclasses.replace(made, model=model, notes=(*whole.notes, *what_moved(whole.user, preparation)))


def file_notes(source: Source) -> tuple[str, ...]:
    """What is not read, and what the compiler makes of the file's masses."""
    notes = []
    if source.missing:
        lost = list(source.missing.values())
        shown = "; ".join(f'{m.file} "{m.name}": {m.reason}' for m in lost[:MOST_NAMED])
        more = f"; and {len(lost) - MOST_NAMED} more" if len(lost) > MOST_NAMED else ""
        notes.append(f"{len(lost)} file(s) not read, no mass comes from them: {shown}{more}")
    return (*notes, *compiler_changes(source))


def what_moved(user: mujoco.MjModel, preparation: Preparation) -> list[str]:
    """Rotors counted at their joints, bodies that stand still, platforms in other coordinates."""
    notes = []
    names = [mujoco.mj_id2name(user, mujoco.mjtObj.mjOBJ_JOINT, j) or f"#{j}" for j in range(user.njnt)]
    for joint, more in preparation.armature:
        notes.append(f"joint {names[joint]}: rotor inertia of its actuator counts, {more:g} with gear squared")
    for joint, losses in preparation.damping:
        notes.append(f"joint {names[joint]}: damping of its actuator counts, {losses[0]:g} with gear squared")
    for body in dict.fromkeys(int(user.jnt_bodyid[joint]) for joint in preparation.free.fixed):
        name = mujoco.mj_id2name(user, mujoco.mjtObj.mjOBJ_BODY, body) or f"#{body}"
        notes.append(f'body "{name}" stands still where it is drawn: its own joints are left out')
    return notes + [
        f"joint {names[split.joint]}: loops hold its body; it counts as {', '.join(split.names)}"
        for split in preparation.free.split
    ]
