"""Check a model as a whole: its assumptions, and what only the reference can say.

Do the loops close, how many freedoms are left, how far does each active joint reach, does the platform stand where the
closed form puts it, and does MuJoCo warn of anything when it runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, MotionError, WorkbenchError
from workbench.mjcf.compile import custom_text
from workbench.mjcf.engine_warnings import engine_warnings
from workbench.reference.closure import LoopCloser, constraint_jacobian
from workbench.reference.engine import Engine
from workbench.reference.result import Mobility
from workbench.reference.structure import Structure, structure_of
from workbench.reference.tolerance import rank_of
from workbench.robots.assumptions.check import Assumption, check_assumptions
from workbench.robots.load import LoadedModel, load_model, open_model
from workbench.robots.robot_file import RobotFile

SAME_PLACE = 1e-10
"""Metres: largest distance between the platform of the compiled model and of the closed form. The loops are closed to
1e-13 m; near a singular pose the platform feels that a hundred times over."""

SAMPLES = 12
"""Random poses at which the platform's position is compared."""

REACH = 0.6
"""Part of each joint's reachable range, seen from home, in which these poses lie."""

NEARBY = 0.1
"""m or rad: how far from home they lie where the ranges are not known."""

STEPS = 200
"""Time steps of the short simulation."""

FARTHEST = {"hinge": 2 * np.pi, "slide": 10.0}
"""How far from home a range is followed: a full turn (rad); for a slide, times the model's extent."""

BEYOND = 1e-3
"""Part of a joint's way by which the second, more exact search goes beyond the end that the first one found."""


@dataclass(frozen=True)
class JointRange:
    """How far an active joint can go from home with the other ones held there, on the home branch."""

    joint: str
    unit: str
    lower: float
    upper: float
    lower_open: bool
    """True: no end was found; ``lower`` is where the search stopped"""
    upper_open: bool


@dataclass(frozen=True)
class ModelCheck:
    """Everything that ``model check`` prints."""

    file: str
    mechanism: str | None
    assumptions: tuple[Assumption, ...]
    mobility_count: dict[str, int]
    """by the formula of the mechanism's source; empty where it gives none or the model is broken"""
    mobility: Mobility | None
    """None where the loops cannot be closed"""
    idle_bodies: tuple[str, ...]
    closure_residual: float | None
    """largest open loop coordinate at home, m"""
    ranges: tuple[JointRange, ...]
    platform_gap: float | None
    """largest distance between the platform of the model and of the closed form, m"""
    warnings: tuple[str, ...]
    """MuJoCo's own, from compiling and from a short simulation"""
    problems: tuple[str, ...]
    """why something above is missing, one line each"""

    @property
    def broken(self) -> tuple[str, ...]:
        """One line for each thing that is wrong."""
        return (*(a.message for a in self.assumptions if not a.ok), *self.problems)

    @property
    def exit_code(self) -> int:
        """0: all is well; 1: an assumption is broken or the loops do not close."""
        return 1 if self.broken else 0


def check_model(path: str | Path, ranges: bool = True, robot: RobotFile | None = None) -> ModelCheck:
    """Check an MJCF file.

    Parameters
    ----------
    path
        An MJCF file, or ``models/NAME.xml`` of those that come along.
    ranges
        Look for the reachable range of each active joint, which takes most of the time.
    robot
        What describes a file that has no robot file of its own.

    Raises
    ------
    ModelError
        The file cannot be read, is not safe, or does not compile. Anything else that is wrong is in the result.
    """
    with engine_warnings() as warnings:
        loaded = load_model(path, robot=robot) if robot else open_model(path)
        assumptions = check_assumptions(loaded)
        try:
            reached = _Closed(loaded)
        except WorkbenchError as error:
            return ModelCheck(
                loaded.file,
                _name(loaded),
                tuple(assumptions),
                {},
                None,
                (),
                None,
                (),
                None,
                tuple(warnings),
                (str(error),),
            )
        problems = list(reached.problems())
        found = reached.ranges() if ranges and not reached.excess else ()
        gap = None
        if loaded.closed_form is not None and not any(not a.ok for a in assumptions) and not problems:
            gap, agreement = _agreement(reached, loaded.closed_form, found)
            assumptions.append(agreement)
        warnings += _simulate(loaded.model, reached.closer.home)
    return ModelCheck(
        file=loaded.file,
        mechanism=_name(loaded),
        assumptions=tuple(assumptions),
        mobility_count=_counted(loaded.closed_form),
        mobility=reached.mobility(),
        idle_bodies=reached.structure.idle,
        closure_residual=reached.residual,
        ranges=found,
        platform_gap=gap,
        warnings=tuple(dict.fromkeys(warnings)),
        problems=tuple(problems),
    )


def _counted(closed_form: Any) -> dict[str, int]:
    """Freedoms by the formula of the robot's source, where it gives one."""
    count = getattr(closed_form, "mobility_count", None)
    return count() if count else {}


def refuse_elsewhere(loaded: LoadedModel) -> None:
    """Refuse a robot whose loops close only in another assembly than its closed form's, or where that has none.

    Raises
    ------
    ModelError
        The platform at home is not where the closed form puts it.
    """
    if loaded.closed_form is None:
        return
    reached = _Closed(loaded)
    agreement = _agreement(reached, loaded.closed_form, ())[1]
    if not agreement.ok:
        moved = float(
            np.max(np.abs(reached.closer.home - reached.structure.home_qpos)[reached.structure.actuated_qpos])
        )
        raise ModelError(
            f"{agreement.message}; with these lengths the robot cannot be assembled at home: the active joints had to"
            f" move by up to {moved:.3g} (m or rad) for the loops to close; nothing was written",
            file=loaded.file,
        )


def names_itself(path: str | Path) -> bool:
    """Whether a file says which closed form it is, or at least what its platform is.

    Raises
    ------
    ModelError
        As `check_model`.
    """
    loaded = open_model(path)
    return loaded.description is not None or custom_text(loaded.model, "platform_site") is not None


def _name(loaded: LoadedModel) -> str | None:
    return loaded.description.name if loaded.description is not None else None


class _Closed:
    """A model with its loops closed at home, kept apart from `MujocoReference`, which refuses a broken model."""

    def __init__(self, loaded: LoadedModel) -> None:
        self.loaded = loaded
        self.structure: Structure = structure_of(loaded)
        self.engine = Engine(loaded.model, frames=self.structure.frames)
        self.closer = LoopCloser(self.engine, self.structure)
        self.jacobian, residuals = constraint_jacobian(self.engine, self.closer.tables, self.closer.home[None, :])
        self.residual = float(np.max(np.abs(residuals[: self.structure.loop_rows]), initial=0.0))

    def mobility(self) -> Mobility:
        """Freedoms by rank at home."""
        structure, loops = self.structure, self.jacobian[: self.structure.loop_rows]
        rank = rank_of(loops, self.closer.tolerance)
        freedoms, idle = loops.shape[1], len(structure.idle)
        return Mobility(freedoms - rank - idle, freedoms, structure.loop_rows, rank, structure.loop_rows - rank, idle)

    @property
    def excess(self) -> int:
        """Actuators beyond the freedoms: none of them moves with the others held."""
        return max(0, len(self.structure.actuated) - self.mobility().mobility)

    def problems(self) -> list[str]:
        """What the projection could not work with."""
        found = []
        if not self.residual <= self.closer.tolerance.residual:
            found.append(
                f"{self.loaded.file}: the loops stay open by {self.residual:.3g} m at home (allowed:"
                f" {self.closer.tolerance.residual:.3g})"
            )
        mobility, active = self.mobility().mobility, len(self.structure.actuated)
        if mobility > active or (self.loaded.closed_form is not None and self.excess):
            found.append(f"{self.loaded.file}: mobility {mobility}, but {active} actuators; each freedom needs one")
        elif not mobility:
            found.append(f"{self.loaded.file}: the loops leave no freedom; take an equality out, or add a joint")
        return found

    def platform(self, qpos: FloatArray) -> FloatArray:
        """Platform positions ``(n, 3)`` in the base's frame."""
        data = mujoco.MjData(self.loaded.model)
        result = np.empty((len(qpos), 3))
        base = self.structure.base
        for row, configuration in enumerate(qpos):
            data.qpos = configuration
            mujoco.mj_kinematics(self.loaded.model, data)
            offset = data.site_xpos[self.structure.platform_site] - data.xpos[base]
            result[row] = data.xmat[base].reshape(3, 3).T @ offset
        return result

    def ranges(self) -> tuple[JointRange, ...]:
        """Reachable range of each active joint."""
        model = self.loaded.model
        found = []
        for column, joint in enumerate(self.structure.joint_names):
            index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
            slide = model.jnt_type[index] == mujoco.mjtJoint.mjJNT_SLIDE.value
            farthest = FARTHEST["slide"] * float(model.stat.extent) if slide else FARTHEST["hinge"]
            lower, lower_open = self._end(column, -farthest)
            upper, upper_open = self._end(column, farthest)
            found.append(JointRange(joint, "m" if slide else "rad", lower, upper, lower_open, upper_open))
        return tuple(found)

    def _end(self, column: int, farthest: float) -> tuple[float, bool]:
        """Where the way of one joint from home ends, and whether no end was found."""
        home = self.closer.home[self.structure.actuated_qpos]
        blocked = self._blocked(home, column, farthest)
        if blocked is None:
            return float(home[column] + farthest), True
        # the way is followed in steps down to a part of its length, so a shorter way ends more exactly
        closer = self._blocked(home, column, (blocked - home[column]) * (1 + BEYOND))
        return blocked if closer is None else closer, False

    def _blocked(self, home: FloatArray, column: int, change: float) -> float | None:
        """Where the way to *change* ends before its time; None where it does not."""
        target = home.copy()
        target[column] += change
        try:
            self.closer.close(target[None, :])
        except MotionError as error:
            return float(error.facts["reached"][column])
        return None


def _agreement(reached: _Closed, closed_form: Any, ranges: tuple[JointRange, ...]) -> tuple[float | None, Assumption]:
    """Compare the platform of the compiled model with the closed form's at random poses on the home branch."""
    home = reached.closer.home[reached.structure.actuated_qpos]
    low = np.array([r.lower for r in ranges]) - home if ranges else np.full(len(home), -NEARBY)
    high = np.array([r.upper for r in ranges]) - home if ranges else np.full(len(home), NEARBY)
    random = np.random.default_rng(0)
    gap, compared, worst = 0.0, 0, home
    for reach in np.linspace(0.0, REACH, SAMPLES):
        q = home + reach * random.uniform(low, high)
        try:
            model = reached.platform(reached.closer.close(q[None, :]).qpos)
            expected = closed_form.forward_kinematics(q[None, :])
        except MotionError:  # a pose that one of them cannot take is no place to compare
            continue
        compared += 1
        distance = float(np.linalg.norm(model - expected))
        if distance >= gap:
            gap, worst = distance, q
    file, site = reached.loaded.file, closed_form.layout.platform_site
    where = ", ".join(f"{j} = {v:.6g}" for j, v in zip(reached.structure.joint_names, worst, strict=True))
    if not compared:
        text = f"{file}: no pose that both the model and the closed form can take was found near home"
        return None, Assumption("platform position", f'site "{site}"', "no pose", f"{SAMPLES} poses", False, text, site)
    ok = gap <= SAME_PLACE
    text = (
        f'{file}: site "{site}" is {gap:.3g} m from where the closed form puts it at {where}; allowed: {SAME_PLACE:g} m'
    )
    value, limit = f"{gap:.3g} m off at {compared} poses", f"within {SAME_PLACE:g} m"
    return gap, Assumption("platform position", f'site "{site}"', value, limit, ok, "" if ok else text, site, "pos")


def _simulate(model: mujoco.MjModel, home: FloatArray) -> list[str]:
    """Run the model from home without control and collect MuJoCo's warnings."""
    data = mujoco.MjData(model)
    iterations, model.opt.iterations = int(model.opt.iterations), min(int(model.opt.iterations), 100)
    try:
        data.qpos = home
        for _ in range(STEPS):
            mujoco.mj_step(model, data)
    except mujoco.FatalError as error:
        return [str(error)]
    finally:
        model.opt.iterations = iterations
    counts = np.asarray(data.warning[:].number)
    return [f"{mujoco.mjtWarning(i).name[7:].lower()}: {n} times in {STEPS} steps" for i, n in enumerate(counts) if n]
