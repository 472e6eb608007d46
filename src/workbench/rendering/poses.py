"""What is to be drawn: a model and its poses over time, the loops closed in each."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.cases import course_of, resolve_cases
from workbench.campaign.spec import load_campaign
from workbench.errors import MotionError, WorkbenchError
from workbench.reference.closure import LoopCloser
from workbench.reference.engine import Engine
from workbench.reference.structure import structure_of
from workbench.robots.load import open_model

MOST_FRAMES = 6000
"""Frames of one film: four minutes at 25 a second."""


@dataclass(frozen=True)
class Poses:
    """Poses of a model."""

    model: mujoco.MjModel
    """parameters of the case written into it"""
    qpos: FloatArray = field(repr=False)
    """``(n, nq)``"""
    times: FloatArray = field(repr=False)
    """``(n,)`` seconds of the motion"""
    title: str


def home_pose(path: Path) -> Poses:
    """Return the home pose of a model, closed where it closes: a broken model is worth a look, too.

    Raises
    ------
    ModelError
        The file cannot be read, is not safe, or does not compile.
    """
    loaded = open_model(path)
    try:
        structure = structure_of(loaded)
        qpos = LoopCloser(Engine(loaded.model, frames=structure.frames), structure).home
    except WorkbenchError:
        model = loaded.model
        home = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, "home")
        qpos = np.array(model.key_qpos[home] if home >= 0 else model.qpos0, dtype=np.float64)
    return Poses(loaded.model, qpos[None, :], np.zeros(1), f"{loaded.file}, home pose")


def motion_poses(
    path: Path, campaign: Path, case: str | None, start: float | None, stop: float | None, step: float
) -> Poses:
    """Return the poses of a model along a case of a campaign.

    Parameters
    ----------
    path
        The model, in place of the campaign's own.
    campaign, case
        Campaign file and the name of a case; None is its first one.
    start, stop
        Part of the motion, s; None is its own start or end.
    step
        Seconds of the motion between two poses.

    Raises
    ------
    WorkbenchError
        As for a run; or times that the motion does not have, or too many frames.
    """
    spec, file = load_campaign(campaign)
    found = resolve_cases(spec, file, path, (spec.case[0].name if case is None else case,))[0]
    first, last = float(found.motion.t[0]), float(found.motion.t[-1])
    start, stop = first if start is None else start, last if stop is None else stop
    if not first <= start <= stop <= last:
        raise MotionError(
            f'{file}: case "{found.name}": {start:g} to {stop:g} s; allowed: a part of {first:g} to {last:g} s',
            case=found.name,
        )
    count = (stop - start) / step
    if not count < MOST_FRAMES:
        raise MotionError(
            f'{file}: case "{found.name}": {count:.0f} frames; allowed: at most {MOST_FRAMES}; take a part of the'
            " motion, or fewer frames a second"
        )
    times = start + step * np.arange(int(count) + 1, dtype=np.float64)
    reference = found.robot.reference
    qpos = reference.inverse_dynamics(*course_of(found)(times), along=times).qpos
    return Poses(reference.compiled(), qpos, times, f"{path}, {found.name}")
