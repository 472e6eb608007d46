"""The campaign file: a TOML document, validated against a strict schema before anything runs.

Every key is documented in docs/campaign.md. A campaign is data: nothing in it can run code, and the files that it names
lie beside it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, ValidationError, field_validator, model_validator

from workbench.campaign.candidate_spec import CandidateSpec, PrintedCost
from workbench.campaign.control_spec import ControlSpec, DelaySpec
from workbench.campaign.figure_spec import CANDIDATE_CURVE, FigureSpec
from workbench.campaign.motion_spec import MOTIONS, Motion
from workbench.campaign.recorded_spec import RecordedSpec
from workbench.campaign.robot_spec import RobotKeys
from workbench.campaign.sweep_spec import Filter, SweepSpec, Vary
from workbench.data_files import bundled, bundled_names
from workbench.documents import Form, read_toml, shorten
from workbench.errors import SpecError, WorkbenchError, did_you_mean
from workbench.robots.actuators import ActuatorSpec
from workbench.schema import Finite, Name, Strict, Triple

FORMAT = 1


def no_boolean(value: object) -> object:
    """Refuse true where 1 is meant: Python takes the one for the other."""
    if isinstance(value, bool):
        raise ValueError("should be a number")
    return value


def check_fraction(good: float) -> None:
    """Refuse what is no accuracy as a fraction.

    Raises
    ------
    ValueError
        Percent where a fraction is meant.
    """
    if not 0.0 < good < 1.0:
        raise ValueError("should be a fraction between 0 and 1; 0.02 is 2 %")


class ReplayWindow(Strict):
    """Seconds from start to stop over which torques drive the model; the motion may be defined beyond its samples."""

    start: Finite
    """s"""
    stop: Finite
    """s"""


class CaseSpec(Strict):
    """One robot on one motion."""

    name: Name
    """names the case's file and its rows; unique"""
    title: str = ""
    """heading in the report"""
    description: str = ""
    """paragraph in the report"""
    motion: Motion
    """how the robot moves; its ``kind`` says which keys it has"""
    parameters: dict[str, Finite] = Field(default_factory=dict)
    """of the robot in this case, over the campaign's, SI"""
    external_force: Triple = Field(default_factory=lambda: [0.0, 0.0, 0.0])
    """N, constant, in the base body's frame, exerted on the platform"""
    bounds: dict[str, Annotated[Finite, Field(gt=0)]] = Field(default_factory=dict)
    """by joint: a bound in place of the candidates', where the reference itself is worth less on this case"""
    replay: ReplayWindow | None = None
    """window of the forward replay; None is the case's own samples"""


class Measure(Strict):
    """Where a claim's figure is found: a number of a case, or the largest over joints of an error column."""

    quantity: Literal[
        "peak_speed", "peak_acceleration", "mobility", "rank", "peak_error", "rms_error", "pointwise_error",
        "solution_distance",
    ]  # fmt: skip
    """a number of the case, or the largest error among the rows that the other keys leave"""
    case: str
    """the case that it is measured on"""
    candidate: str | None = None
    """for errors: of this formula; any where not said"""
    reference: str | None = None
    """for errors: against this mass model; any where not said"""
    joint: str | None = None
    """for errors: of this joint; any where not said"""
    point: Triple | None = None
    """for ``solution_distance``: a platform position, m; measured is the largest coordinate difference from the nearest
    solution of the forward position problem at the case's first sample"""

    @model_validator(mode="after")
    def _point_where_needed(self) -> Measure:
        if (self.quantity == "solution_distance") != (self.point is not None):
            raise ValueError("point goes with quantity solution_distance, and only with it")
        return self


class ClaimSpec(Strict):
    """A figure that a paper prints, and how it is measured here."""

    id: Name
    """unique"""
    text: str
    """the claim in words"""
    source: str
    """where it is printed"""
    kind: Literal["upper", "value"]
    """``upper``: the measured number is smaller than *claimed*; ``value``: it is *claimed* to within *within*"""
    claimed: Finite
    """the printed number; errors are fractions, 0.05 is 5 %"""
    within: Finite = 0.0
    """for ``value``: half of the last printed digit"""
    unit: str
    """``%`` shows a fraction in percent"""
    measure: Measure
    """where the number is found"""
    parameters: dict[str, Finite] = Field(default_factory=dict)
    """of the robot that the claim is about, where they are not those of the robot's file or source"""
    note: str = ""
    """remark in the report"""


class Campaign(RobotKeys):
    """A whole campaign file."""

    format: Annotated[Literal[1], BeforeValidator(no_boolean)] = 1
    """version of this format"""
    name: Name
    """names the run directory, ``reports/NAME``"""
    title: str
    """heading of the report"""
    description: str = ""
    """paragraph below it"""
    parameters: dict[str, Finite] = Field(default_factory=dict)
    """of the robot in every case, SI"""
    candidate: list[CandidateSpec] = Field(default_factory=list)
    """may be empty where the campaign brings its own mechanism: then the reference alone is computed"""
    case: Annotated[list[CaseSpec], Field(min_length=1)]
    """one robot on one motion each"""
    recorded: list[RecordedSpec] = Field(default_factory=list)
    """torques from elsewhere; their rows are a kind of their own"""
    claim: list[ClaimSpec] = Field(default_factory=list)
    """what a paper prints"""
    figure: list[FigureSpec] = Field(default_factory=list)
    """what the report draws beyond its own figures"""
    sweep: SweepSpec | None = None
    """varies the one case of the campaign into many"""
    control: ControlSpec | None = None
    """what tracks the cases' motions; then nothing else is computed"""
    good: Annotated[Finite, Field(gt=0)] | None = None
    """wanted accuracy of formulas without a bound: largest `peak_error`, a fraction; a sweep has ``sweep.good``"""
    actuators: dict[str, ActuatorSpec] | None = None
    """what the actuators can give, by joint, over what the robot file says"""

    @field_validator("good")
    @classmethod
    def _fraction(cls, value: float | None) -> float | None:
        if value is not None:
            check_fraction(value)
        return value

    @model_validator(mode="after")
    def _one_case_varies(self) -> Campaign:
        if self.sweep and (len(self.case) != 1 or self.claim or self.figure or self.recorded):
            raise ValueError(
                "a campaign with a sweep has one case, which varies; no claims, no figures, no recorded torques"
            )
        if self.sweep and (self.good is not None or self.actuators):
            raise ValueError("a campaign with a sweep has sweep.good in place of good, and no actuators")
        return self

    @model_validator(mode="after")
    def _control_alone(self) -> Campaign:
        if self.control and (self.sweep or self.candidate or self.claim or self.figure or self.recorded or self.good):
            raise ValueError(
                "a campaign with control has cases and no candidates, claims, figures, recorded torques, good or sweep:"
                " the formulas stand in control.models, claims in control.claim"
            )
        return self


def load_campaign(path: str | Path) -> tuple[Campaign, Path]:
    """Read and validate a campaign file.

    Parameters
    ----------
    path
        A TOML file, or the name of a campaign that comes with the package.

    Returns
    -------
    Campaign, Path
        The campaign and the file it was read from.

    Raises
    ------
    SpecError
        Missing or malformed file, unknown key (with the nearest valid one), a value of the wrong kind; the message
        names file, key, value and what is allowed.
    """
    found = _find(Path(path))
    document = read_toml(found, str(path))
    try:
        campaign = Campaign.model_validate(document)
    except ValidationError as error:
        raise SpecError(f"{path}: {FORM.problem(error, document)}", file=str(path)) from error
    _check_names(campaign, str(path))
    return campaign, found


def campaign_names() -> tuple[str, ...]:
    """Names of the campaigns that come with the package."""
    return tuple(name.removesuffix(".toml") for name in bundled_names("campaigns"))


def _find(path: Path) -> Path:
    try:
        if path.is_file():
            return path
        if path.is_dir():
            raise SpecError(f"{path}: is a directory; a campaign is a TOML file", file=str(path))
    except OSError as error:  # a name longer than the system allows
        raise SpecError(f"{shorten(str(path))}: {error.strerror or error}", file=str(path)) from error
    if path.parts and (len(path.parts) == 1 or path.parts[0] == "campaigns"):
        try:
            return bundled("campaigns", path.name)
        except WorkbenchError:
            pass
    named = f"; those that come along: {', '.join(campaign_names())}" if len(path.parts) <= 1 else ""
    raise SpecError(f"{path}: no such campaign file{named}", file=str(path))


FORM = Form(
    Campaign,
    sections={
        "candidate": CandidateSpec, "case": CaseSpec, "claim": ClaimSpec, "figure": FigureSpec, "measure": Measure,
        "recorded": RecordedSpec, "sweep": SweepSpec, "vary": Vary, "filter": Filter, "printed_cost": PrintedCost,
        "actuators": ActuatorSpec, "control": ControlSpec, "delay": DelaySpec,
    },
    kinds=MOTIONS,
    kinds_of="motion",
)  # fmt: skip


def _check_names(campaign: Campaign, file: str) -> None:
    """Names that have to be unique, and names that have to exist."""
    named = campaign.actuated is not None or campaign.robot is not None
    if not campaign.candidate and not named and not campaign.recorded and campaign.control is None:
        raise SpecError(f"{file}: candidate: missing; a campaign compares at least one", file=file)
    cases = [case.name for case in campaign.case]
    for name in cases:
        if cases.count(name) > 1:
            raise SpecError(f'{file}: two cases have the name "{name}"', file=file, case=name)
    # names become file names, and some file systems do not tell A from a
    if len({name.lower() for name in cases}) < len(cases):
        raise SpecError(f"{file}: two case names differ only in upper and lower case", file=file)
    rows = [(c.name, c.reference) for c in campaign.candidate]
    for row in rows:
        if rows.count(row) > 1:
            raise SpecError(f'{file}: candidate "{row[0]}" against "{row[1]}" stands twice', file=file)
    for kind, items in (("claim", campaign.claim), ("figure", campaign.figure)):
        ids = [item.id for item in items]
        for item in items:
            if ids.count(item.id) > 1:
                raise SpecError(f'{file}: two {kind}s have the id "{item.id}"', file=file)
            for case in [item.measure.case] if isinstance(item, ClaimSpec) else item.needs:
                _check_case(f'{kind} "{item.id}" names', case, cases, file)
    for candidate in campaign.candidate:
        for case in candidate.expect_fail:
            _check_case(f'candidate "{candidate.name}": expect_fail names', case, cases, file)
    for claim in campaign.claim:
        _check_measure(claim, rows, file)
    curves = [f"cand:{name}" for name, _ in rows] + [f"ref:{reference}" for _, reference in rows]
    for figure in campaign.figure:
        for curve in figure.curves:
            if curve not in curves:
                hint = did_you_mean(curve, set(curves))
                raise SpecError(f'{file}: figure "{figure.id}": no curve "{shorten(curve)}"{hint}', file=file)
            if figure.reference and (curve.removeprefix(CANDIDATE_CURVE), figure.reference) not in rows:
                raise SpecError(
                    f'{file}: figure "{figure.id}": no candidate "{curve.removeprefix(CANDIDATE_CURVE)}" against'
                    f' "{shorten(figure.reference)}"',
                    file=file,
                )


def _check_case(who: str, case: str, cases: list[str], file: str) -> None:
    if case not in cases:
        raise SpecError(f'{file}: {who} case "{shorten(case)}"{did_you_mean(case, cases)}', file=file)


def _check_measure(claim: ClaimSpec, rows: list[tuple[str, str]], file: str) -> None:
    """A claim about an error has to name a candidate and a reference that the campaign compares."""
    measure = claim.measure
    named = [value for value in (measure.candidate, measure.reference, measure.joint) if value is not None]
    if not measure.quantity.endswith("_error"):
        if named:
            raise SpecError(f'{file}: claim "{claim.id}": {measure.quantity} belongs to a case, not to "{named[0]}"')
        return
    found = [row for row in rows if measure.candidate in (None, row[0]) and measure.reference in (None, row[1])]
    if not found:
        valid = ", ".join(f'"{name}" against "{reference}"' for name, reference in rows)
        raise SpecError(
            f'{file}: claim "{claim.id}": no candidate "{measure.candidate or "any"}" against'
            f' "{measure.reference or "any"}"; valid: {valid}',
            file=file,
        )
