"""What a campaign needs to say of a file, found out from the file itself and tried before it is proposed."""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import MotionError, WorkbenchError
from workbench.mjcf.compile import find_model
from workbench.mjcf.files import read_text
from workbench.mjcf.prepared import Prepared, open_source
from workbench.mjcf.refusal import Refusal
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference
from workbench.reference.crossings import look
from workbench.reference.structure import refuse_large
from workbench.reference.survey import Places, Survey, places, survey

SAMPLES = 51
STOP_S = 1.0
HINGE, SLIDE = 0.2, 0.05
"""First amplitudes: rad, and part of the model's extent in m."""

HALVINGS = 8
PARAMETERS = 12


@dataclass(frozen=True)
class Motion:
    """A small motion around the home pose: ``offset + amplitude sin(frequency t)`` per driven joint."""

    offset: tuple[float, ...]
    amplitude: tuple[float, ...]
    frequency: tuple[float, ...]


@dataclass(frozen=True)
class Proposal:
    """A robot made of a file; whatever writes it down needs nothing else."""

    model: Path
    setup: Setup
    parameters: tuple[tuple[str, str], ...]
    """name and the place where the model holds it, as in a campaign's ``read``"""
    motion: Motion | None
    """None where the reference refuses the file: see `problem`"""
    survey: Survey
    prepared: Prepared
    notes: tuple[str, ...]
    """why it is as it is, one line each"""
    problem: str = ""
    """why no motion was found, one line"""
    refusals: tuple[Refusal, ...] = ()
    """each thing in the file for which no torque can be given, with its line"""
    left_out: tuple[str, ...] = ()
    """what the motion was held against"""


def propose(path: str | Path, actuated: tuple[str, ...] = ()) -> Proposal:
    """Look at a file, and try what is proposed for it.

    Parameters
    ----------
    path
        An MJCF file.
    actuated
        Joints to drive; empty: those of the file's own actuators, as far as they are independent.

    Raises
    ------
    ModelError
        The file cannot be read, is not safe, does not compile, or has too many joints.
    """
    found = find_model(path)
    prepared = open_source(read_text(found), str(path), found.parent)
    refuse_large(prepared.user, str(path))
    seen = survey(prepared.user, actuated)
    where = places(prepared.user, seen)
    ignore = ("free bodies",) if seen.loose else ()
    setup = Setup(
        seen.actuated,
        platform_site=where.site,
        platform_body="" if where.site else where.body,
        initial=where.initial,
        ignore=ignore,
        fix_base=seen.fix_base,
    )
    notes = list(_notes(seen))
    parameters = _parameters(where)
    try:
        if not seen.actuated:
            raise MotionError(f"{path}: no hinge or slide with a name is there to be driven; say --actuated")
        reference = MujocoReference(path, setup=setup)
        motion, ignored, said, left = _motion(reference, where)
    except WorkbenchError as error:
        return Proposal(
            found, setup, parameters, None, seen, prepared, tuple(notes), str(error), error.facts.get("refusals", ())
        )
    setup = dataclasses.replace(setup, ignore=(*ignore, *ignored))
    prepared = reference.loaded.prepared or prepared
    return Proposal(found, setup, parameters, motion, seen, prepared, (*notes, *said), left_out=left)


def _notes(seen: Survey) -> list[str]:
    notes = []
    if seen.fix_base:
        notes.append(f'the loops lie in a robot that floats: its body "{seen.fix_base}" is held still')
    if seen.loose:
        notes.append(f"bodies that nothing holds stand still: {', '.join(seen.loose)}")
    if seen.dropped:
        notes.append(f"driven by the file and not here, since they follow from the others: {', '.join(seen.dropped)}")
    if seen.added:
        notes.append(f"not driven by the file, but nothing else moves them: {', '.join(seen.added)}")
    if seen.nameless:
        notes.append(f"joints without a name cannot be driven, give them one: {', '.join(seen.nameless)}")
    return notes


def _parameters(where: Places) -> tuple[tuple[str, str], ...]:
    """Masses of what moves, and gravity."""
    found: dict[str, str] = {}
    for body in where.moving:
        name = "m_" + re.sub(r"\W", "_", body, flags=re.ASCII)[:36]
        if body and len(body.split()) == 1 and name not in found and len(found) < PARAMETERS:
            found[name] = f"mass {body}"
    return (*found.items(), ("g", "gravity"))


Tried = tuple[Motion, tuple[str, ...], tuple[str, ...], tuple[str, ...]]
"""A motion, what of `ignore` it needs, why, and what it was held against."""


def _motion(reference: MujocoReference, where: Places) -> Tried:
    """The largest of ever smaller motions that the reference follows inside limits and without new contacts.

    Raises
    ------
    MotionError
        Not even the smallest one can be followed.
    """
    home = reference.home
    slides = np.array(reference.actuated_slides)
    first: FloatArray = np.where(slides, SLIDE * where.extent, HINGE).astype(np.float64)
    ranges = np.array([where.ranges.get(joint, (-np.inf, np.inf)) for joint in reference.joint_names], dtype=np.float64)
    low, high = ranges.T
    amplitude: FloatArray = np.minimum(first, np.maximum((high - low) / 4.0, 1e-4))
    frequency: FloatArray = 3.0 + 0.5 * np.arange(len(home), dtype=np.float64) % 4.0
    t = np.linspace(0.0, STOP_S, SAMPLES)
    last: WorkbenchError | None = None
    kept: Tried | None = None
    for halving in range(HALVINGS):
        part: FloatArray = amplitude * 0.5**halving
        offset = np.clip(home, low + 1.01 * part, high - 1.01 * part) if np.all(low + 2.1 * part <= high) else home
        q, qd, qdd = sine(t, offset, part, frequency)
        try:
            result = reference.inverse_dynamics(q, qd, qdd)
        except MotionError as error:
            last = error
            continue
        seen = look(reference, result)
        met = tuple(dict.fromkeys(crossing.what for crossing in seen.crossings))
        one = Motion(_digits(offset), _digits(part), _digits(frequency))
        if not met:
            return one, (), (), seen.notes
        said = f"even a small motion meets {' and '.join(met)} that the file has, so they are ignored"
        kept = kept or (one, met, (said,), seen.notes)
        if kept and len(met) < len(kept[1]):
            kept = one, met, (said,), seen.notes
    if kept is None:
        assert last is not None
        raise last
    return kept


def sine(
    t: FloatArray, offset: FloatArray, amplitude: FloatArray, frequency: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """q, qd, qdd ``(n, na)`` at times ``(n,)``."""
    phase = t[:, None] * frequency
    return (
        offset + amplitude * np.sin(phase),
        amplitude * frequency * np.cos(phase),
        -amplitude * frequency**2 * np.sin(phase),
    )


def _digits(values: FloatArray) -> tuple[float, ...]:
    return tuple(float(f"{value:.12g}") for value in values)
