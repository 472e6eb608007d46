"""What a studio was opened on, read from its files: a robot, a campaign, or a run of one."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from workbench.campaign import provenance, store
from workbench.campaign.candidate_spec import CandidateSpec
from workbench.campaign.cases import base_robot, resolve_case, resolve_cases, robot_of
from workbench.campaign.rerun import files_of
from workbench.campaign.spec import Campaign, CaseSpec, campaign_names, load_campaign
from workbench.campaign.user_candidates import UserCandidate, load_candidates, offer, with_rows
from workbench.capabilities.load import robot_with
from workbench.capabilities.robot import Robot
from workbench.data_files import bundled_directory
from workbench.documents import read_toml
from workbench.errors import OutputError, SpecError, WorkbenchError
from workbench.reading import read_json
from workbench.robots.catalogue import Source, find_source
from workbench.robots.robot_file import FILE

FIRST_SWINGS = (0.3, 0.15, 0.08, 0.03)
"""Amplitudes of the motion of a robot without a campaign, rad; m for slides, a fifth of it. The first that closes."""


@dataclass(frozen=True)
class Run:
    """A stored run that is shown."""

    folder: Path
    parameters: Mapping[str, Mapping[str, float]]
    """case -> the parameters that it was computed with, beside the file's"""
    same_model: bool
    """whether the model's file still is the one that was run"""
    status: str


@dataclass(frozen=True)
class Subject:
    """A robot with the cases that it can be put on."""

    opened: str
    """as the user named it"""
    campaign: Campaign
    file: Path
    """the campaign's file; the robot's where it has no campaign"""
    has_campaign: bool
    base: Robot = field(repr=False)
    """the robot as its files have it"""
    model: Path
    settings: Mapping[str, float]
    """parameters from the command line"""
    candidates: tuple[str, ...]
    """files of formulas"""
    files: tuple[Path, ...]
    """what is read again when it is saved"""
    other_model: Path | None = None
    """a model in place of the campaign's own"""
    run: Run | None = None

    @property
    def shown_campaign(self) -> str:
        """The campaign as a command from here names it."""
        return _shown(self.file, "campaigns")

    @property
    def shown_model(self) -> str:
        """The model as a command from here names it."""
        return str(self.other_model) if self.other_model else _shown(self.model, "models")

    def spec(self, case: str) -> CaseSpec:
        """A case as the campaign has it."""
        return next(one for one in self.campaign.case if one.name == case)

    def start(self, case: str) -> dict[str, float]:
        """The parameters of a case that differ from the file's: the campaign's, the case's, the command line's.

        Of a run those that it was computed with.
        """
        spec = self.spec(case)
        table = self.base.description.table
        if self.run is not None and case in self.run.parameters:
            return table.layered(self.run.parameters[case], self.settings)
        return table.layered(self.campaign.parameters, spec.parameters, self.settings)


def _shown(file: Path, kind: Literal["campaigns", "models"]) -> str:
    """A file as a command names it: by name where it comes along, else by its way from here."""
    if file.resolve().parent == bundled_directory(kind).resolve():
        return file.stem if kind == "campaigns" else f"{kind}/{file.name}"
    here = Path.cwd()
    whole = file.resolve()
    return str(whole.relative_to(here)) if whole.is_relative_to(here) else str(file)


def open_subject(
    what: str,
    *,
    model: Path | None = None,
    settings: Mapping[str, float] | None = None,
    candidates: Sequence[str] = (),
) -> Subject:
    """Read a robot, a campaign or a run.

    Parameters
    ----------
    what
        A robot (folder, robot file, MJCF, name), a campaign (file or name), or a run's directory. A robot is put on the
        campaign beside it, or on one that comes along with it; else on a small motion about its home pose.
    model
        Another model in place of the campaign's.
    settings
        Parameters over all others, SI.
    candidates
        Files with formulas of the user's own, which are run.

    Raises
    ------
    WorkbenchError
        Bad input, in one line.
    """
    users = load_candidates(candidates)
    given = dict(settings or {})
    names = tuple(str(name) for name in candidates)
    path = Path(what)
    if (path / store.MANIFEST).is_file():
        return _of_run(path, what, model, given, names, users)
    if (path / store.REPORTS[0]).is_file():
        raise OutputError(
            f"{what}: a report without its results, {store.MANIFEST} is not there; workbench run CAMPAIGN makes a run"
        )
    if what in campaign_names() or (path.suffix == ".toml" and path.is_file() and "case" in read_toml(path, what)):
        return _of_campaign(path, what, model, given, names, users)
    return _of_robot(what, model, given, names, users)


def _of_campaign(
    path: Path,
    opened: str,
    model: Path | None,
    settings: dict[str, float],
    names: tuple[str, ...],
    users: Sequence[UserCandidate],
    run: Run | None = None,
) -> Subject:
    campaign, file = load_campaign(path)
    campaign = with_rows(campaign, users)
    # says in one line what does not fit, as a run does: a formula that is not there, a joint that is none
    resolve_cases(campaign, file, model, (campaign.case[0].name,), settings, users=users)
    base, found = base_robot(campaign, file, model, users)
    return Subject(
        opened, campaign, file, True, base, found, settings, names, files_of(path, model, names), model, run
    )  # fmt: skip


def _of_run(
    folder: Path,
    opened: str,
    model: Path | None,
    settings: dict[str, float],
    names: tuple[str, ...],
    users: Sequence[UserCandidate],
) -> Subject:
    try:
        manifest: dict[str, Any] = read_json(folder / store.MANIFEST)
        stored, shown = manifest["spec_file"], manifest["model"]
        cases = {name: dict(facts["parameters"]) for name, facts in manifest["cases"].items()}
        digest, status, name = shown["sha256"], str(manifest["status"]), str(manifest["campaign"])
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise OutputError(
            f"{folder / store.MANIFEST}: not readable as a run of cases ({error}); the studio opens no sweeps"
        ) from None
    file = _campaign_of(folder, str(stored), name)
    seen = _of_campaign(file, opened, model, settings, names, users)
    same = provenance.sha256(seen.model.read_bytes()) == digest
    kept = {case.name: cases[case.name] for case in seen.campaign.case if case.name in cases}
    if not kept:
        raise OutputError(f"{folder}: none of its cases stands in {file} any more")
    ordered = sorted(seen.campaign.case, key=lambda case: case.name not in kept)
    campaign = seen.campaign.model_copy(update={"case": ordered})
    return Subject(
        opened, campaign, seen.file, True, seen.base, seen.model, settings, names, seen.files, model,
        Run(folder, kept, same, status),
    )  # fmt: skip


def _campaign_of(folder: Path, stored: str, name: str) -> Path:
    """Find the file of the campaign that a run was made from: from here, beside the run, close above it, or ours."""
    whole = folder.resolve()
    for place in (Path(), whole, *whole.parents[:2]):
        for candidate in (place / stored, place / Path(stored).name):
            with contextlib.suppress(OSError, WorkbenchError):
                if candidate.is_file() and load_campaign(candidate)[0].name == name:
                    return candidate
    if name in campaign_names():
        return Path(name)
    raise OutputError(
        f'{folder}: the campaign "{name}" that it was made from, {stored}, is not found; start the studio in the'
        " directory that holds it, or open the campaign itself"
    )


def _of_robot(
    what: str, model: Path | None, settings: dict[str, float], names: tuple[str, ...], users: Sequence[UserCandidate]
) -> Subject:
    source = find_source(what)
    beside = None if model is not None else _campaign_for(source, Path(what), names)
    if beside is not None:
        return _of_campaign(beside, what, model, settings, names, users)
    base = robot_with(model or what, {})
    offer(base, users)
    file = source.robot.path if source.robot else source.model
    campaign = with_rows(_made_up(base, file, source.model), users)
    return Subject(
        what, campaign, file, False, base, model or source.model, settings, names,
        tuple(dict.fromkeys([source.model, file, *(Path(name) for name in names)])), model,
    )  # fmt: skip


def _campaign_for(source: Source, path: Path, names: Sequence[str]) -> Path | None:
    """The campaign of a robot: beside it, else among those that come along; one with printed claims first."""
    bundled = source.robot is not None and source.robot.builtin
    found: list[tuple[tuple[int, bool], Path]] = []
    if bundled:
        places = [Path(name) for name in campaign_names()]
    else:
        folder = source.robot.path.parent if source.robot else source.model.parent
        places = [place for place in sorted(folder.glob("*.toml")) if place.name != FILE]
    for place in places:
        with contextlib.suppress(WorkbenchError):
            campaign, file = load_campaign(place)
            robot, model = robot_of(campaign, file)
            own = robot is None or source.robot is None or robot.path.resolve() == source.robot.path.resolve()
            if model.resolve() != source.model.resolve() or campaign.sweep is not None or not own:
                continue
            base = base_robot(campaign, file)[0]
            unknown = [c.name for c in campaign.candidate if c.name not in base.candidates]
            if unknown and not names:
                continue
            found.append(((len(unknown), not campaign.claim), place))
    return min(found, key=lambda one: one[0])[1] if found else None


def _made_up(base: Robot, file: Path, model: Path) -> Campaign:
    """A campaign for a robot that has none: every joint swings a little about home, all formulas are measured."""
    rows = [
        CandidateSpec(name=name, reference=one.mass_model if one.mass_model in base.mass_models else "distributed")
        for name, one in base.candidates.items()
    ]
    slides = base.reference.actuated_slides
    error: WorkbenchError | None = None
    for swing in FIRST_SWINGS:
        document = {
            "name": base.name,
            "title": base.title,
            "model": model.name,
            "candidate": rows,
            "case": [
                {
                    "name": "about_home",
                    "title": "A small motion about the home pose",
                    "motion": {
                        "kind": "sine",
                        "offset": base.home.tolist(),
                        "amplitude": [swing / 5 if slide else swing for slide in slides],
                        "frequency": [2 * math.pi * (1 + 0.5 * i) for i in range(len(slides))],
                        "stop": 1.0,
                        "samples": 200,
                    },
                }
            ],
        }
        campaign = Campaign.model_validate(document)
        try:
            resolve_case(campaign.case[0], file, base, model, {})
        except WorkbenchError as found:
            error = found
            continue
        return campaign
    raise SpecError(f"{model}: no campaign beside it, and no small motion about its home pose is in reach: {error}")
