"""The campaign file: a TOML document, validated against a strict schema before anything runs.

Every key is documented in docs/campaign.md. A campaign is data: nothing in it can run code, and the files that it names
lie beside it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError, model_validator

from workbench.campaign.candidate_spec import CandidateSpec, PrintedCost
from workbench.campaign.figure_spec import CANDIDATE_CURVE, FigureSpec
from workbench.campaign.recorded_spec import RecordedMotion, RecordedSpec
from workbench.campaign.robot_spec import RobotKeys
from workbench.campaign.sweep_spec import Filter, SweepSpec, Vary
from workbench.data_files import bundled
from workbench.documents import Form, read_toml, shorten
from workbench.errors import SpecError, WorkbenchError, did_you_mean
from workbench.schema import Finite, Name, Strict, Triple, Vector

FORMAT = 1
MAX_SAMPLES = 100_000
"""Samples of one case: the reference holds some 20 kB of matrices for each while it computes."""

Samples = Annotated[int, Field(le=MAX_SAMPLES)]


class Window(Strict):
    """When a motion is sampled: seconds, and either a number of samples or a rate in hertz."""

    start: Finite = 0.0
    stop: Finite
    samples: Samples | None = None
    rate: Finite | None = None

    @model_validator(mode="after")
    def _one_of(self) -> Window:
        if (self.samples is None) == (self.rate is None):
            raise ValueError("give exactly one of samples and rate")
        if self.rate is not None and (self.stop - self.start) * self.rate >= MAX_SAMPLES:
            raise ValueError(f"rate = {self.rate:g} Hz makes more samples than allowed: {MAX_SAMPLES}")
        return self


class SineMotion(Window):
    """One sinusoid per joint."""

    kind: Literal["sine"]
    offset: Vector
    amplitude: Vector
    frequency: Vector
    phase: Vector | None = None


class MultiSineMotion(Window):
    """Any number of sinusoids per joint, each ``[amplitude, frequency, phase]``."""

    kind: Literal["multi_sine"]
    offset: Vector
    terms: list[list[Annotated[list[Finite], Field(min_length=2, max_length=3)]]]


class CycleMotion(Strict):
    """A pick-and-place cycle planned in platform space."""

    kind: Literal["pick_and_place"]
    pick: Triple
    place: Triple
    lift: Finite | Triple
    up: Triple | None = None
    lift_time: Finite
    traverse_time: Finite
    lower_time: Finite | None = None
    dwell: Finite = 0.0
    overlap: Finite = 0.0
    back: bool = False
    law: str = "quintic"
    samples: Samples | None = None
    rate: Finite | None = None


class CsvMotion(Strict):
    """A motion from a file beside the campaign: ``t, q1, q2, q3`` and, if given, derivatives."""

    kind: Literal["csv"]
    file: str


Motion = Annotated[SineMotion | MultiSineMotion | CycleMotion | CsvMotion | RecordedMotion, Field(discriminator="kind")]


class ReplayWindow(Strict):
    """Seconds from start to stop over which torques drive the model; the motion may be defined beyond its samples."""

    start: Finite
    stop: Finite


class CaseSpec(Strict):
    """One robot on one motion."""

    name: Name
    title: str = ""
    description: str = ""
    motion: Motion
    parameters: dict[str, Finite] = Field(default_factory=dict)
    external_force: Triple = Field(default_factory=lambda: [0.0, 0.0, 0.0])
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
    case: str
    candidate: str | None = None
    reference: str | None = None
    joint: str | None = None
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
    text: str
    source: str
    kind: Literal["upper", "value"]
    claimed: Finite
    within: Finite = 0.0
    """for ``value``: half of the last printed digit"""
    unit: str
    measure: Measure
    note: str = ""


class Campaign(RobotKeys):
    """A whole campaign file."""

    format: Literal[1] = 1
    name: Name
    title: str
    description: str = ""
    parameters: dict[str, Finite] = Field(default_factory=dict)
    candidate: list[CandidateSpec] = Field(default_factory=list)
    """may be empty where the campaign brings its own mechanism: then the reference alone is computed"""
    case: Annotated[list[CaseSpec], Field(min_length=1)]
    recorded: list[RecordedSpec] = Field(default_factory=list)
    """torques from elsewhere; their rows are a kind of their own"""
    claim: list[ClaimSpec] = Field(default_factory=list)
    figure: list[FigureSpec] = Field(default_factory=list)
    sweep: SweepSpec | None = None

    @model_validator(mode="after")
    def _one_case_varies(self) -> Campaign:
        if self.sweep and (len(self.case) != 1 or self.claim or self.figure or self.recorded):
            raise ValueError(
                "a campaign with a sweep has one case, which varies; no claims, no figures, no recorded torques"
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
    raise SpecError(f"{path}: no such campaign file", file=str(path))


FORM = Form(
    Campaign,
    sections={
        "candidate": CandidateSpec, "case": CaseSpec, "claim": ClaimSpec, "figure": FigureSpec, "measure": Measure,
        "recorded": RecordedSpec, "sweep": SweepSpec, "vary": Vary, "filter": Filter, "printed_cost": PrintedCost,
    },
    kinds={
        "sine": SineMotion, "multi_sine": MultiSineMotion, "pick_and_place": CycleMotion, "csv": CsvMotion,
        "recorded": RecordedMotion,
    },
    kinds_of="motion",
)  # fmt: skip


def _check_names(campaign: Campaign, file: str) -> None:
    """Names that have to be unique, and names that have to exist."""
    if not campaign.candidate and campaign.actuated is None and campaign.robot is None and not campaign.recorded:
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
