"""The part of manifest.json that a report reads, as typed records.

Keys that a report does not need are ignored; a key that it cannot do without and that is missing is an error.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from workbench.records import Record
from workbench.report.demand_records import ActuatorRecord, CaseDemandRecord

FORMAT_VERSION = 1
"""The version of the run directory that this reader understands."""


class ModelRecord(Record):
    """The MJCF file and the mechanism that was read from it."""

    file: str
    sha256: str
    mechanism: str
    title: str = ""
    reference_key: str = ""


class ParameterRecord(Record):
    """One parameter of the mechanism, SI."""

    name: str
    value: float | None = None
    unit: str = ""
    meaning: str = ""
    source: str = ""


class PrintedCostRecord(Record):
    """Microseconds per sample that a formula's authors printed."""

    us: float
    source: str = ""


class CandidateRecord(Record):
    """One closed form and the mass model whose assumption it shares."""

    mass_model: str
    description: str = ""
    source: str = ""
    cost_us: float | None = None
    """microseconds per sample, measured in the run"""
    printed_cost: PrintedCostRecord | None = None


class ClaimRecord(Record):
    """A statement of a paper next to what was measured; ``holds`` is None where it cannot be decided."""

    id: str
    text: str
    source: str = ""
    kind: str = "value"
    """``upper``: the claim is that the quantity stays below *claimed*"""
    claimed: float
    within: float = 0.0
    """how far from *claimed* a ``value`` may lie and still agree with print"""
    unit: str = ""
    """``%`` says that the numbers are fractions and read best as percentages"""
    measured: float | None = None
    holds: bool | None = None
    not_about: str = ""
    """why the claim is not about the robot of this run; then it is not judged"""
    note: str = ""


class FigureRecord(Record):
    """A figure that the campaign asks for."""

    id: str
    title: str
    kind: str
    case: str | None = None
    joint: str | None = None
    curves: tuple[str, ...] = ()
    """``cand:NAME`` or ``ref:MASS_MODEL``"""
    source: str = ""
    cases: tuple[str, ...] = ()
    """for ``error_over``: the cases, in the order of *abscissa*"""
    abscissa: tuple[float, ...] = ()
    label: str = ""
    """for ``error_over``: what the numbers of *abscissa* are, with their unit"""
    reference: str | None = None
    """for ``error_over``: the reference mass model that the errors are held against"""
    not_about: str = ""
    """why the figure's source does not show the robot that is drawn"""


class SingularityRecord(Record):
    """The smallest value of a dimensionless determinant over a case, and when."""

    min: float | None = None
    time: float | None = None


class ConditionRecord(Record):
    """A condition that a paper states against singular poses, evaluated over a case."""

    name: str
    value: float | None = None
    relation: str = ""
    limit: float | None = None
    holds: bool | None = None
    unit: str = ""
    note: str = ""


class PowerRecord(Record):
    """Power balance of the reference under one mass model."""

    relative: float | None = None
    """largest residual over peak power"""
    peak_power_w: float | None = None
    worst_time_s: float | None = None
    differentiation: float | None = None
    """how well the energy's derivative is known, over peak power"""
    rounding: float | None = None
    """what rounding alone may leave of the balance, over peak power"""
    samples: int | None = None


class EngineRecord(Record):
    """A second engine against the reference: mass model -> joint -> peak error."""

    engine: str
    spread: dict[str, dict[str, float | None]] = Field(default_factory=dict)


class ReplayRecord(Record):
    """Forward simulation with one candidate's torques, at several time steps."""

    steps_s: tuple[float | None, ...] = ()
    peak_error: tuple[tuple[float | None, ...], ...] = ()
    """``(steps, joints)``, in the coordinates' units"""
    order: float | None = None
    worst_joint: str = ""
    limit: float | None = None
    """extrapolated to a step of zero, on the worst joint"""
    verdict: str = ""
    text: str = ""
    same_as: str = ""  # whose simulation this is, of the same torques; empty: its own


class ReplaySetRecord(Record):
    """All replays of a case."""

    start_s: float | None = None
    stop_s: float | None = None
    note: str = ""
    candidates: dict[str, ReplayRecord] = Field(default_factory=dict)


class EvidenceRecord(Record):
    """What the reference itself is worth in one case."""

    power_balance: dict[str, PowerRecord] = Field(default_factory=dict)
    undetermined: dict[str, dict[str, float | None]] = Field(default_factory=dict)
    """what the model leaves open, of each peak torque: mass model -> joint"""
    second_engine: EngineRecord | None = None
    replay: ReplaySetRecord | None = None


class JointRecord(Record):
    """A joint of the drawing."""

    point: str
    kind: str = ""
    actuated: bool = False


class DrawingRecord(Record):
    """What a drawing of the mechanism joins; the points over time stand in the series."""

    links: dict[str, tuple[tuple[str, str], ...]] = Field(default_factory=dict)
    joints: dict[str, JointRecord] = Field(default_factory=dict)
    platform: str
    up: tuple[float, float, float]


class PartRecord(Record):
    """One part of a difference, found by regression."""

    name: str
    value: float | None = None
    standard_error: float | None = None
    unit: str = ""
    share: float | None = None
    text: str = ""


class RecordedJointRecord(Record):
    """Recorded torques on one joint."""

    verdict: str
    reason: str = ""
    peak_error: float | None = None
    uncertainty: float | None = None
    torque_noise: float | None = None
    explained: float | None = None
    parts: tuple[PartRecord, ...] = ()


class SmoothedRecord(Record):
    """How a recorded coordinate was differentiated."""

    digits: int | None = None
    noise: float | None = None
    bandwidth_hz: float | None = None
    order: int | None = None
    largest_rate_error: float | None = None
    largest_acceleration_error: float | None = None


class RecordedRecord(Record):
    """Torques that were measured or simulated elsewhere."""

    file: str
    description: str = ""
    reference: str = ""
    samples: int | None = None
    compared: int | None = None
    offset_s: float | None = None
    offset_error_s: float | None = None
    notes: tuple[str, ...] = ()
    sentence: str = ""
    motion: dict[str, SmoothedRecord] = Field(default_factory=dict)
    joints: dict[str, RecordedJointRecord] = Field(default_factory=dict)


class SpentRecord(Record):
    """What a case's torques are spent on: root mean squares, N or N m, by part and by body, joint by joint."""

    mass_model: str = ""
    parts: dict[str, dict[str, float | None]] = Field(default_factory=dict)
    bodies: dict[str, dict[str, float | None]] = Field(default_factory=dict)


class KinematicsRecord(Record):
    """A user's kinematics formula against the reference, one coordinate."""

    name: str
    kind: str
    coordinate: str
    error: float | None
    scale: float | None = None
    unit: str = ""
    bound: float
    verdict: Literal["pass", "fail"]


class CaseRecord(Record):
    """One case: its status and the scalar evidence about mechanism and reference. Missing evidence is None."""

    status: Literal[
        "passed", "failed", "error", "undecided", "nothing-judged", "not-driven", "invalid", "timeout", "killed",
        "filtered",
    ]  # fmt: skip
    title: str = ""
    description: str = ""
    message: str | None = None
    time_s: float | None = None
    """of a case that cannot be driven: when"""
    nearest: tuple[float | None, ...] | None = None
    """of such a case: the last pose of the platform that can be reached on the straight way from home"""
    nearest_q: tuple[float | None, ...] | None = None
    """likewise, actuated coordinates"""
    samples: int | None = None
    duration_s: float | None = None
    parameters: dict[str, float | None] = Field(default_factory=dict)
    external_force: Any = None
    mobility: int | None = None
    rank: int | None = None
    constraint_rows: int | None = None
    redundant_rows: int | None = None
    idle_freedoms: int | None = None
    closure_residual: float | None = None
    velocity_residual: float | None = None
    acceleration_residual: float | None = None
    condition: float | None = None
    peak_speed: float | None = None
    peak_acceleration: float | None = None
    speed_at_s: float | None = None
    acceleration_at_s: float | None = None
    singularity: dict[str, SingularityRecord] = Field(default_factory=dict)
    kinematics: dict[str, float | None] = Field(default_factory=dict)
    peak_reactions: dict[str, float | None] = Field(default_factory=dict)
    conditions: tuple[ConditionRecord, ...] = ()
    solutions_at_start: tuple[tuple[float | None, ...], ...] = ()
    evidence: EvidenceRecord = EvidenceRecord()
    drawing: DrawingRecord | None = None
    recorded: dict[str, RecordedRecord] = Field(default_factory=dict)
    spent: SpentRecord = SpentRecord()
    kinematics_checks: tuple[KinematicsRecord, ...] = ()
    demand: CaseDemandRecord = CaseDemandRecord()
    warnings: tuple[str, ...] = ()

    @property
    def kinematics_verdicts(self) -> list[str]:
        """Verdicts on the user's own kinematics."""
        return [check.verdict for check in self.kinematics_checks]


class ChangeRecord(Record):
    """One parameter that is not what the robot's source says, SI."""

    name: str
    unit: str = ""
    before: float | None = None
    after: float | None = None
    by: str = ""
    cases: tuple[str, ...] = ()


class ChangesRecord(Record):
    """In what the robots of a run are others than the one that claims, sources and published figures are about."""

    model: str = ""
    parameters: tuple[ChangeRecord, ...] = ()


class DiagnosisRecord(Record):
    """What is wrong with a formula that fails its verification, in a few sentences."""

    reference: str = ""
    findings: tuple[str, ...] = ()
    command: str = ""
    """``workbench diagnose ...``, which says more"""


class SweepRecord(Record):
    """That the run is a sweep: then its cases stand in data sets and not here."""

    cases: int
    counts: dict[str, int] = Field(default_factory=dict)


class ControlRecord(Record):
    """That the run is a study of control: then its runs stand in tables and not here."""

    runs: int
    limits: dict[str, float] = Field(default_factory=dict)
    """largest torques, by joint, where they were heeded"""


class Manifest(Record):
    """manifest.json."""

    format: Literal[1]
    campaign: str
    title: str = ""
    description: str = ""
    spec_file: str = ""
    spec: dict[str, Any] = Field(default_factory=dict)
    model: ModelRecord
    joints: tuple[str, ...] = Field(max_length=1000)
    coordinate_units: tuple[str, ...]
    force_units: tuple[str, ...]
    platform_axes: tuple[str, ...] = Field(("x1", "x2", "x3"), max_length=6)
    mobility_count: dict[str, int] = Field(default_factory=dict)
    parameters: tuple[ParameterRecord, ...] = ()
    changes: ChangesRecord = ChangesRecord()
    versions: dict[str, str] = Field(default_factory=dict)
    machine: dict[str, Any] = Field(default_factory=dict)
    git_commit: str | None = None
    engines: tuple[str, ...] = ()
    budget: bool | None = None
    """whether the evidence about the reference was gathered; None where the run does not say"""
    command: str = ""
    request: dict[str, Any] | None = None
    """model, set, only, candidates as they were asked for; None in runs of earlier versions"""
    started: str = ""
    finished: str = ""
    seconds: float | None = None
    status: Literal["passed", "failed", "error", "undecided", "incomplete", "nothing-judged"]
    verdict: str = ""
    """the sentence beside the status; it can always be made again from rows and cases"""
    candidates: dict[str, CandidateRecord]
    good: float | None = Field(None, gt=0)
    """wanted accuracy of formulas without a bound; None where nobody asked"""
    actuators: dict[str, ActuatorRecord] = Field(default_factory=dict)
    claims: tuple[ClaimRecord, ...] = ()
    figures: tuple[FigureRecord, ...] = ()
    cases: dict[str, CaseRecord]
    diagnosis: dict[str, DiagnosisRecord] = Field(default_factory=dict)
    sweep: SweepRecord | None = None
    control: ControlRecord | None = None

    def unit_of(self, joint: str) -> str:
        """Unit of the force or torque of *joint*."""
        return self.force_units[self.joints.index(joint)]
