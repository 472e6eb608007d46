"""From a campaign to cases that can be computed: every name resolved, every motion in joint space and in reach."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.generic import generic_mechanism
from workbench.campaign.spec import (
    MAX_SAMPLES,
    Campaign,
    CaseSpec,
    CsvMotion,
    CycleMotion,
    MultiSineMotion,
    SineMotion,
)
from workbench.campaign.user_candidates import UserCandidate, offer
from workbench.data_files import bundled, bundled_names
from workbench.documents import shorten
from workbench.errors import MotionError, ParameterError, SpecError, WorkbenchError, did_you_mean
from workbench.mjcf.setup import Setup
from workbench.motion import (
    JointMotion,
    PickAndPlace,
    PlatformMotion,
    from_csv,
    multi_sine,
    pick_and_place,
    sine,
    time_grid,
)
from workbench.reference.replay import motion_through
from workbench.robots.assignments import resolve_changes
from workbench.robots.base import Mechanism
from workbench.robots.load import LoadedModel, load_model, plan_mechanism
from workbench.robots.parameters import SIDES


@dataclass(frozen=True)
class Case:
    """One robot on one motion, ready to compute."""

    spec: CaseSpec
    model: Path
    overrides: dict[str, float]
    mechanism: Mechanism
    motion: JointMotion = field(repr=False)
    force: FloatArray = field(repr=False)
    x: FloatArray = field(repr=False)
    xd: FloatArray = field(repr=False)
    xdd: FloatArray = field(repr=False)
    """platform motion by the closed form, ``(n, 3)``"""
    loaded: LoadedModel | None = field(default=None, repr=False)
    """the model with the overrides, where it is at hand and need not be read again"""
    setup: Setup | None = None
    """what the campaign says about a mechanism of its own"""

    @property
    def name(self) -> str:
        """The case's name, which is also its file's."""
        return self.spec.name


def resolve_cases(
    campaign: Campaign,
    file: Path,
    model: Path | None = None,
    only: tuple[str, ...] = (),
    settings: Mapping[str, float] | None = None,
    relative: Sequence[str] = (),
    users: Sequence[UserCandidate] = (),
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

    Raises
    ------
    SpecError, ModelError, ParameterError, MotionError
        One line that names the case and, for motions, the time and the joint.
    """
    path = model or locate(file, campaign.model, "model")
    names = [case.name for case in campaign.case]
    for name in only:
        if name not in names:
            raise SpecError(f'{file}: no case "{name}"{did_you_mean(name, names)}', file=str(file), case=name)
    loaded: dict[tuple[tuple[str, float], ...], Mechanism] = {}

    def mechanism_once(overrides: Mapping[str, float]) -> Mechanism:
        key = tuple(sorted(overrides.items()))
        if key not in loaded:
            loaded[key] = mechanism_with(path, overrides, campaign)
            offer(loaded[key], users)
        return loaded[key]

    cases = []
    for spec in campaign.case:
        if only and spec.name not in only:
            continue
        try:
            overrides = layered(campaign.parameters, spec.parameters, settings or {})
            if relative:
                before = mechanism_once(overrides)
                changes = resolve_changes(type(before), dataclasses.asdict(before.parameters), relative)
                overrides = layered(overrides, changes)
            mechanism = mechanism_once(overrides)
            _check_candidates(campaign, mechanism)
            cases.append(dataclasses.replace(_resolve(spec, file, path, overrides, mechanism), setup=campaign.setup))
        except WorkbenchError as error:
            raise _in_case(error, file, spec.name) from error
    return cases


def resolve_case(
    campaign: Campaign,
    spec: CaseSpec,
    file: Path,
    model: Path,
    overrides: dict[str, float],
    users: Sequence[UserCandidate] = (),
) -> Case:
    """Resolve one of many cases of a campaign that differ in numbers only: what they share is made once.

    Raises
    ------
    ModelError, ParameterError, MotionError
        As `resolve_cases`, without the case's name.
    """
    if campaign.setup:
        if overrides:
            raise _cannot_be_set(model, overrides)
        own = _own(model, campaign.setup, tuple(campaign.read.items()), tuple(users))
        return dataclasses.replace(_resolve(spec, file, model, {}, own), setup=campaign.setup)
    # out of reach is found without compiling; the loaded model gives the same parameters, bit for bit, or is refused
    planned = _named(plan_mechanism(model, overrides), model)
    case = _resolve(spec, file, model, overrides, planned)
    loaded = load_model(model, overrides)
    mechanism = _named(loaded.mechanism, model)
    offer(mechanism, users)
    return dataclasses.replace(case, loaded=loaded, mechanism=mechanism)


@lru_cache(maxsize=1)
def _own(model: Path, setup: Setup, read: tuple[tuple[str, str], ...], users: tuple[UserCandidate, ...]) -> Mechanism:
    mechanism = generic_mechanism(model, setup, read)
    offer(mechanism, users)
    return mechanism


def _cannot_be_set(model: Path, names: Iterable[str]) -> ParameterError:
    return ParameterError(f"{model}: parameter {next(iter(names))} cannot be set; edit the MJCF, which both sides read")


def layered(*layers: Mapping[str, float]) -> dict[str, float]:
    """Merge parameters, later layers over earlier ones; a later ``m2`` also goes over an earlier ``m2_left``."""
    merged: dict[str, float] = {}
    for layer in layers:
        for name in layer:
            for side in SIDES:
                merged.pop(f"{name}_{side}", None)
        merged |= layer
    return merged


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
    except (OSError, ValueError) as error:  # a name longer than the system allows, a null character in it
        reason = error.strerror if isinstance(error, OSError) else None
        raise SpecError(f"{key}: {reason or error}", **facts) from error
    if what == "model" and relative.parts[:1] == ("models",) and relative.name in bundled_names("models"):
        return bundled("models", relative.name)
    raise SpecError(f"{key}: no such file", **facts)


def mechanism_with(path: Path, overrides: Mapping[str, float], campaign: Campaign) -> Mechanism:
    """Load the mechanism of a campaign's cases with parameters changed.

    Raises
    ------
    ModelError, ParameterError, SpecError
        See `resolve_cases`.
    """
    if campaign.setup:
        if overrides:
            raise _cannot_be_set(path, overrides)
        return generic_mechanism(path, campaign.setup, tuple(campaign.read.items()))
    return _named(load_model(path, overrides).mechanism, path)


def _named(mechanism: Mechanism | None, path: Path) -> Mechanism:
    if mechanism is None:
        raise SpecError(
            f'{path}: <custom> has no <text name="mechanism">, so there is no closed form to'
            " validate; a mechanism of your own needs actuated and platform_site in the campaign"
        )
    return mechanism


def _check_candidates(campaign: Campaign, mechanism: Mechanism) -> None:
    for candidate in campaign.candidate:
        if candidate.name not in mechanism.candidates:
            # forms that are wrong on purpose are not among those that a walk through the candidates shows
            known = {*mechanism.candidates, *getattr(mechanism.candidates, "on_purpose", ())}
            hint = did_you_mean(candidate.name, known)
            where = "; formulas of your own come from a Python file: --candidates FILE"
            raise SpecError(f'{mechanism.name} has no candidate "{candidate.name}"{hint}{where}')
        if candidate.reference not in mechanism.mass_models:
            hint = did_you_mean(candidate.reference, mechanism.mass_models)
            raise SpecError(f'candidate "{candidate.name}": no reference "{candidate.reference}"{hint}')
        for failing in (name for joints in candidate.expect_fail.values() for name in joints):
            if failing not in mechanism.joints:
                hint = did_you_mean(failing, mechanism.joints)
                raise SpecError(f'candidate "{candidate.name}": expect_fail: no joint "{shorten(failing)}"{hint}')
    for figure in campaign.figure:
        if (figure.kind == "torque" or figure.joint) and figure.joint not in mechanism.joints:
            hint = did_you_mean(str(figure.joint), mechanism.joints)
            raise SpecError(f'figure "{figure.id}": no joint "{figure.joint}"{hint}')
    for claim in campaign.claim:
        joint = claim.measure.joint
        if joint is not None and joint not in mechanism.joints:
            raise SpecError(f'claim "{claim.id}": no joint "{joint}"{did_you_mean(joint, mechanism.joints)}')


def _in_case(error: WorkbenchError, file: Path, case: str) -> WorkbenchError:
    """Name the case; the error keeps its kind and its facts."""
    facts = {**error.facts, "case": case}
    prefix = "" if isinstance(error, SpecError) and str(error).startswith(str(file)) else f'{file}: case "{case}": '
    return type(error)(f"{prefix}{error}", **facts)


def _resolve(spec: CaseSpec, file: Path, model: Path, overrides: dict[str, float], mechanism: Mechanism) -> Case:
    for joint in spec.bounds:
        if joint not in mechanism.joints:
            raise SpecError(f'bounds: no joint "{joint}"{did_you_mean(joint, mechanism.joints)}')
    planned = plan_motion(spec, file, mechanism)
    if len(planned.t) > MAX_SAMPLES:
        raise MotionError(f"motion: {len(planned.t)} samples; allowed: at most {MAX_SAMPLES}", value=len(planned.t))
    try:
        if isinstance(planned, PlatformMotion):
            q, qd, qdd = mechanism.joint_motion(planned.x, planned.xd, planned.xdd)
            motion = JointMotion(planned.t, q, qd, qdd)
        else:
            motion = planned
        x, xd, xdd = mechanism.platform_motion(motion.q, motion.qd, motion.qdd)
        mechanism.inverse_dynamics(motion.q[:1], motion.qd[:1], motion.qdd[:1])
    except MotionError as error:
        raise with_unit_hint(at_time(error, planned.t), mechanism) from error
    force = np.tile(np.array(spec.external_force), (len(motion.t), 1))
    return Case(spec, model, overrides, mechanism, motion, force, x, xd, xdd)


def with_unit_hint(error: WorkbenchError, mechanism: Mechanism) -> WorkbenchError:
    """Add to an error that lengths look like millimetres, where they do: then that is what is wrong."""
    hints = mechanism.millimetre_warnings()
    return type(error)(f"{error}; {hints[0]}", **error.facts) if hints else error


def at_time(error: MotionError, t: FloatArray) -> MotionError:
    """Say the time of the sample that an error names."""
    sample = error.facts.get("sample")
    if sample is None:
        return error
    time = float(t[sample])
    text = str(error).removeprefix(f"sample {sample}, ")
    return MotionError(f"t = {time:.6g} s, {text}", **{**error.facts, "time": time})


def plan_motion(spec: CaseSpec, file: Path, mechanism: Mechanism) -> JointMotion | PlatformMotion:
    """Build the motion that a case asks for, at the times that it asks for.

    Raises
    ------
    MotionError
        As the functions of `workbench.motion`.
    ParameterError
        Another number of joints than the mechanism has.
    """
    motion = spec.motion
    if isinstance(motion, CsvMotion):
        return from_csv(locate(file, motion.file, "motion.file"), mechanism.joints)
    if isinstance(motion, CycleMotion):
        return pick_and_place(**motion.model_dump(exclude={"kind"}))
    joints = len(motion.terms) if isinstance(motion, MultiSineMotion) else len(motion.amplitude)
    if len(motion.offset) != len(mechanism.joints) or joints != len(mechanism.joints):
        raise ParameterError(
            f"motion: {len(motion.offset)} offset(s) and {joints} joint(s); {mechanism.name} has"
            f" {len(mechanism.joints)} actuated joints: {', '.join(mechanism.joints)}"
        )
    return _harmonic(motion, time_grid(motion.start, motion.stop, samples=motion.samples, rate=motion.rate))


def _harmonic(motion: SineMotion | MultiSineMotion, t: FloatArray) -> JointMotion:
    if isinstance(motion, SineMotion):
        return sine(t, motion.offset, motion.amplitude, motion.frequency, motion.phase)
    return multi_sine(t, motion.offset, motion.terms)


Course = Callable[[FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
"""Times ``(n,)`` in seconds -> q, qd, qdd, each ``(n, na)``."""


def course_of(case: Case) -> Course:
    """Return the case's motion as a function of time: exact where it is given by formulas, else through its samples.

    The function raises MotionError for times or poses that the motion does not have.
    """
    motion = case.spec.motion
    if isinstance(motion, SineMotion | MultiSineMotion):

        def harmonic(t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            found = _harmonic(motion, t)
            return found.q, found.qd, found.qdd

        return harmonic
    if isinstance(motion, CycleMotion):
        plan = PickAndPlace(**motion.model_dump(exclude={"kind", "samples", "rate"}))

        def cycle(t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            found = plan.sample(np.clip(t, 0.0, plan.duration))
            return case.mechanism.joint_motion(found.x, found.xd, found.xdd)

        return cycle
    return motion_through(case.motion.t, case.motion.q, case.motion.qd, case.motion.qdd)
