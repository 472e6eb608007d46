"""From a campaign to cases that can be computed: every name resolved, every motion in joint space and in reach."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.motion_spec import MAX_SAMPLES, RecordedMotion, TableMotion
from workbench.campaign.not_driven import NotDriven, with_nearest_joints
from workbench.campaign.planned import formula_of, planned_motion
from workbench.campaign.recorded import read_torques, recorded_motion, records_of
from workbench.campaign.recorded_spec import RecordedSpec
from workbench.campaign.spec import Campaign, CaseSpec
from workbench.campaign.user_candidates import UserCandidate, offer
from workbench.capabilities.load import robot_with
from workbench.capabilities.nearest import with_nearest
from workbench.capabilities.robot import Robot
from workbench.data_files import bundled, bundled_names
from workbench.documents import shorten
from workbench.errors import MotionError, SpecError, WorkbenchError, did_you_mean
from workbench.motion import JointMotion, PlatformMotion
from workbench.recorded.read import Record
from workbench.reference.replay import motion_through
from workbench.robots.actuators import check_joints
from workbench.robots.assignments import resolve_changes
from workbench.robots.catalogue import bundled_robot, bundled_robots
from workbench.robots.robot_file import FILE, RobotFile, read_robot_file


@dataclass(frozen=True)
class Case:
    """One robot on one motion, ready to compute."""

    spec: CaseSpec
    model: Path
    overrides: dict[str, float]
    robot: Robot
    motion: JointMotion = field(repr=False)
    force: FloatArray = field(repr=False)
    x: FloatArray = field(repr=False)
    xd: FloatArray = field(repr=False)
    xdd: FloatArray = field(repr=False)
    """the platform's motion in task coordinates, ``(n, m)``, by closed form where there is one"""
    records: tuple[tuple[RecordedSpec, Record], ...] = field(default=(), repr=False)
    """torques from elsewhere"""

    @property
    def name(self) -> str:
        """The case's name, which is also its file's."""
        return self.spec.name

    @cached_property
    def singularity(self) -> dict[str, FloatArray]:
        """`Robot.singularity_measures` along the motion."""
        return self.robot.singularity_measures(self.motion.q)


def resolve_cases(
    campaign: Campaign,
    file: Path,
    model: Path | None = None,
    only: tuple[str, ...] = (),
    settings: Mapping[str, float] | None = None,
    relative: Sequence[str] = (),
    users: Sequence[UserCandidate] = (),
    left_out: Callable[[NotDriven], object] | None = None,
) -> list[Case]:
    """Resolve every case: parameters (campaign, case, command line), model, motion, candidates.

    Parameters
    ----------
    campaign, file
        From `load_campaign`.
    model
        A model file in place of the campaign's own.
    only
        Names of the cases wanted; empty is all.
    settings
        Parameters from the command line; they go over all others.
    relative
        Changes like ``a2*=1.1``, each from what the parameter then is in the case.
    users
        Candidates of the user's own.
    left_out
        Called with each case that cannot be driven; None refuses the first.

    Raises
    ------
    SpecError, ModelError, ParameterError, MotionError
        One line that names the case and, for motions, the time and the joint.
    """
    base, path = base_robot(campaign, file, model, users)
    check_joints(campaign.actuators or {}, base.joints, str(file))
    names = [case.name for case in campaign.case]
    for name in only:
        if name not in names:
            raise SpecError(f'{file}: no case "{name}"{did_you_mean(name, names)}', file=str(file), case=name)
    made: dict[tuple[tuple[str, float], ...], Robot] = {}
    table = base.description.table

    def robot_once(overrides: Mapping[str, float]) -> Robot:
        key = tuple(sorted(overrides.items()))
        if key not in made:
            made[key] = base.with_parameters(**overrides) if overrides else base
            _ = made[key].loaded, made[key].has_task  # what is wrong is refused before anything is computed
        return made[key]

    cases = []
    for spec in campaign.case:
        if only and spec.name not in only:
            continue
        overrides: dict[str, float] = {}
        robot = None
        try:
            overrides = table.layered(campaign.parameters, spec.parameters, settings or {})
            if relative:
                before = robot_once(overrides)
                overrides = table.layered(overrides, resolve_changes(table, before.values, relative))
            robot = robot_once(overrides)
            _check_candidates(campaign, robot)
            case = _resolve(spec, file, path, overrides, robot, nearest=True)
            records = tuple(
                (one, read_torques(one, locate(file, one.file, "recorded.file"), robot))
                for one in records_of(campaign.recorded, spec.name, names, str(file))
            )
            cases.append(replace(case, records=records))
        except WorkbenchError as error:
            named = _in_case(error, file, spec.name)
            if left_out is None or not isinstance(named, MotionError):
                raise named from error
            left_out(NotDriven(spec, named, overrides, robot))
    return cases


def resolve_case(spec: CaseSpec, file: Path, base: Robot, model: Path, overrides: dict[str, float]) -> Case:
    """Resolve one of many cases of a campaign that differ in numbers only; *base* is the robot as its files have it.

    Raises
    ------
    ModelError, ParameterError, MotionError
        As `resolve_cases`, without the case's name.
    """
    # out of reach is found without compiling, where kinematics are closed forms; the model is compiled when it is asked
    return _resolve(spec, file, model, overrides, base.with_parameters(**overrides) if overrides else base)


def base_robot(
    campaign: Campaign, file: Path, model: Path | None = None, users: Sequence[UserCandidate] = ()
) -> tuple[Robot, Path]:
    """The robot of a campaign as its files have it, with the user's candidates offered, and where its model lies.

    Raises
    ------
    SpecError, ModelError, ParameterError
        No such robot, or one that is wrong.
    """
    robot, path = robot_of(campaign, file, model)
    found = robot_with(path, {}, robot)
    offer(found, users)
    return found, path


def robot_of(campaign: Campaign, file: Path, model: Path | None = None) -> tuple[RobotFile | None, Path]:
    """The robot file of a campaign, None where the model's own counts, and the model.

    Raises
    ------
    SpecError
        No such file, or a robot file that is wrong.
    """
    if campaign.robot is None:
        assert campaign.model is not None
        path = model or locate(file, campaign.model, "model")
        return campaign.own_robot(path, file), path
    if campaign.robot in bundled_robots():
        robot = bundled_robot(campaign.robot)
    else:
        robot = read_robot_file(locate(file, campaign.robot, "robot"))
    return robot, model or robot.model


def robot_files(campaign: Campaign, file: Path, model: Path | None = None) -> list[Path]:
    """Files that a campaign's robot is read from.

    Raises
    ------
    SpecError
        As `robot_of`.
    """
    robot, path = robot_of(campaign, file, model)
    beside = path.parent / FILE
    return [path, *([robot.path] if robot and campaign.robot else [beside] if beside.is_file() else [])]


def tables_of(campaign: Campaign, file: Path) -> list[Path]:
    """Files of the motions that are given by one, in the order of the cases.

    Raises
    ------
    SpecError
        As `locate`.
    """
    names = [case.motion.file for case in campaign.case if isinstance(case.motion, TableMotion)]
    return [locate(file, name, "motion.file") for name in dict.fromkeys(names)]


def locate(campaign_file: Path, name: str, what: str) -> Path:
    """Find a file that a campaign names: beside the campaign, or in the directory above, never elsewhere.

    A model may also be one of those that come with the package, ``models/NAME.xml``.

    Raises
    ------
    SpecError
        An absolute path, one with ``..``, a link that leads out of these directories, or no such file.
    """
    key, relative = f'{campaign_file}: {what} = "{shorten(name)}"', Path(name)
    facts = {"file": str(campaign_file), "key": what, "value": name}
    if relative.is_absolute() or ".." in relative.parts:
        other = " (--model names one anywhere)" if what == "model" else ""
        raise SpecError(
            f"{key}: allowed: a path below the campaign's directory or the one above, without ..{other}", **facts
        )
    try:
        # the campaign's name may be a link; what it names lies beside the link's target
        home = campaign_file.resolve().parent
        for directory in (home, home.parent):
            if (directory / relative).is_file():
                if not (directory / relative).resolve().is_relative_to(home.parent):
                    raise SpecError(f"{key}: a link that leads out of {home.parent}", **facts)
                return campaign_file.parent / relative if directory == home else directory / relative
            if what == "robot" and (directory / relative / FILE).is_file():
                return locate(campaign_file, f"{name.rstrip('/')}/{FILE}", what)
    except (OSError, ValueError) as error:  # a name longer than the system allows, a null character in it
        reason = error.strerror if isinstance(error, OSError) else None
        raise SpecError(f"{key}: {reason or error}", **facts) from error
    if what == "model" and relative.parts[:1] == ("models",) and relative.name in bundled_names("models"):
        return bundled("models", relative.name)
    raise SpecError(f"{key}: no such file", **facts)


def _check_candidates(campaign: Campaign, robot: Robot) -> None:
    for candidate in campaign.candidate:
        if candidate.name not in robot.candidates:
            # forms that are wrong on purpose are not among those that a walk through the candidates shows
            known = {*robot.candidates, *getattr(robot.candidates, "on_purpose", ())}
            hint = did_you_mean(candidate.name, known)
            where = "; formulas of your own come from a Python file: --candidates FILE"
            raise SpecError(f'{robot.name} has no candidate "{candidate.name}"{hint}{where}')
        if candidate.reference not in robot.mass_models:
            hint = did_you_mean(candidate.reference, robot.mass_models)
            raise SpecError(f'candidate "{candidate.name}": no reference "{candidate.reference}"{hint}')
        for failing in (name for joints in candidate.expect_fail.values() for name in joints):
            if failing not in robot.joints:
                hint = did_you_mean(failing, robot.joints)
                raise SpecError(f'candidate "{candidate.name}": expect_fail: no joint "{shorten(failing)}"{hint}')
    for record in campaign.recorded:
        if record.reference not in robot.mass_models:
            hint = did_you_mean(record.reference, robot.mass_models)
            raise SpecError(f'recorded "{record.label}": no reference "{record.reference}"{hint}')
    for figure in campaign.figure:
        if (figure.kind == "torque" or figure.joint) and figure.joint not in robot.joints:
            hint = did_you_mean(str(figure.joint), robot.joints)
            raise SpecError(f'figure "{figure.id}": no joint "{figure.joint}"{hint}')
    for claim in campaign.claim:
        joint = claim.measure.joint
        if joint is not None and joint not in robot.joints:
            raise SpecError(f'claim "{claim.id}": no joint "{joint}"{did_you_mean(joint, robot.joints)}')


def _in_case(error: WorkbenchError, file: Path, case: str) -> WorkbenchError:
    """Name the case; the error keeps its kind and its facts."""
    facts = {**error.facts, "case": case}
    prefix = "" if isinstance(error, SpecError) and str(error).startswith(str(file)) else f'{file}: case "{case}": '
    return type(error)(f"{prefix}{error}", **facts)


def _resolve(
    spec: CaseSpec, file: Path, model: Path, overrides: dict[str, float], robot: Robot, nearest: bool = False
) -> Case:
    for joint in spec.bounds:
        if joint not in robot.joints:
            raise SpecError(f'bounds: no joint "{joint}"{did_you_mean(joint, robot.joints)}')
    return case_on(spec, model, overrides, robot, plan_motion(spec, file, robot), nearest)


def case_on(
    spec: CaseSpec,
    model: Path,
    overrides: dict[str, float],
    robot: Robot,
    planned: JointMotion | PlatformMotion,
    nearest: bool = False,
) -> Case:
    """Put a robot on a motion that has been planned, by `plan_motion` or by other means.

    With *nearest* an error names the last pose on the way from home that can be driven, which takes as long as some
    cases do: a sweep, which leaves such cases out by the thousand, does not ask for it.

    Raises
    ------
    MotionError
        Too many samples, or a pose out of reach; the message names the time.
    """
    if len(planned.t) > MAX_SAMPLES:
        raise MotionError(f"motion: {len(planned.t)} samples; allowed: at most {MAX_SAMPLES}", value=len(planned.t))
    try:
        if isinstance(planned, PlatformMotion):
            q, qd, qdd = robot.joint_motion(planned.x, planned.xd, planned.xdd)
            motion = JointMotion(planned.t, q, qd, qdd, planned.warnings)
        else:
            motion = planned
        x, xd, xdd = robot.platform_along(motion.t, motion.q, motion.qd, motion.qdd)
        if robot.closed_form is not None:  # else the reference has just computed these torques
            robot.inverse_dynamics(motion.q[:1], motion.qd[:1], motion.qdd[:1])
    except MotionError as error:
        if nearest and isinstance(planned, PlatformMotion):
            error = with_nearest(error, robot, planned.x)
        elif nearest and isinstance(planned, JointMotion):
            error = with_nearest_joints(error, robot, planned.q)
        raise with_unit_hint(at_time(error, planned.t), robot) from error
    force = np.tile(np.array(spec.external_force), (len(motion.t), 1))
    return Case(spec, model, overrides, robot, motion, force, x, xd, xdd)


def with_unit_hint(error: WorkbenchError, robot: Robot) -> WorkbenchError:
    """Add to an error that lengths look like millimetres, where they do: then that is what is wrong."""
    hints = robot.millimetre_warnings()
    return type(error)(f"{error}; {hints[0]}", **error.facts) if hints else error


def at_time(error: MotionError, t: FloatArray) -> MotionError:
    """Say the time of the sample that an error names."""
    sample = error.facts.get("sample")
    if sample is None:
        return error
    time = float(t[sample])
    text = str(error).removeprefix(f"sample {sample}, ")
    return MotionError(f"t = {time:.6g} s, {text}", **{**error.facts, "time": time})


def plan_motion(spec: CaseSpec, file: Path, robot: Robot) -> JointMotion | PlatformMotion:
    """Build the motion that a case asks for, at the times that it asks for.

    Raises
    ------
    MotionError
        As the functions of `workbench.motion`.
    ParameterError
        Another number of joints than the mechanism has.
    """
    if isinstance(spec.motion, RecordedMotion):
        return recorded_motion(spec.motion, locate(file, spec.motion.file, "motion.file"), robot)
    return planned_motion(
        spec.motion,
        lambda name: locate(file, name, "motion.file"),
        robot.name,
        robot.joints,
        robot.coordinate_units,
        robot.coordinates,
    )


Course = Callable[[FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
"""Times ``(n,)`` in seconds -> q, qd, qdd, each ``(n, na)``."""


def course_of(case: Case) -> Course:
    """Return the case's motion as a function of time: exact where it is given by formulas, else through its samples.

    The function raises MotionError for times or poses that the motion does not have.
    """
    formula = formula_of(case.spec.motion, case.robot.coordinates)
    if formula is not None:

        def course(t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            found = formula(t)
            if isinstance(found, PlatformMotion):
                return case.robot.joint_motion(found.x, found.xd, found.xdd)
            return found.q, found.qd, found.qdd

        return course
    return motion_through(case.motion.t, case.motion.q, case.motion.qd, case.motion.qdd)
