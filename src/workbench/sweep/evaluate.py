"""One case of a sweep, computed in a worker: what happens to it becomes a record with one status and its reason."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.cases import Case, base_robot, resolve_case
from workbench.campaign.compare import CaseResult, Row, compute_case
from workbench.campaign.evidence import Effort
from workbench.campaign.spec import Campaign, CaseSpec
from workbench.campaign.user_candidates import load_candidates
from workbench.campaign.verdict import FAILURES
from workbench.capabilities.robot import Robot
from workbench.errors import MotionError, SpecError, WorkbenchError
from workbench.sweep.identity import case_key, common_key
from workbench.sweep.plan import Recipe
from workbench.sweep.record import FAILED, FILTERED, INVALID, PASSED, Record, lost

MEASURED = ("peak_error", "rms_error", "pointwise_error", "peak_reference")
"""Columns that have to be finite numbers."""

COLUMNS = tuple(f.name for f in dataclasses.fields(Row) if f.name != "case")

NO_MEMORY = "Could not allocate memory"
"""How MuJoCo says it, in errors of several kinds."""

Task = tuple[int, tuple[float, ...]]
"""A case's number and its varied numbers."""


@dataclass(frozen=True)
class Answer:
    """A case's record, and its time series as the bytes of a Parquet file where they are kept."""

    record: Record
    series: bytes | None = None

    def packed(self) -> Packed:
        """What the process that writes needs of it."""
        return Packed(self.record.index, self.record.status, self.record.line(), self.series)


@dataclass(frozen=True)
class Packed:
    """An answer as it travels: the worker makes the journal's line, so that the one process that writes only writes."""

    index: int
    status: str
    line: bytes
    """`Record.line`"""
    series: bytes | None = None


def compute(context: Context, base: Robot, task: Task) -> Packed:
    """`evaluate`, packed."""
    return evaluate(context, base, task).packed()


@dataclass(frozen=True)
class Context:
    """What all cases of a sweep share; travels to every worker once."""

    campaign: Campaign
    file: Path
    model: Path
    settings: Mapping[str, float]
    effort: Effort
    recipe: Recipe
    common: str
    """`identity.common_key` of the run; a worker whose own differs computes nothing"""
    candidates: tuple[str, ...] = ()
    """files and entry points of the user's own formulas"""

    @property
    def keep_series(self) -> str:
        """Which time series are kept."""
        assert self.campaign.sweep is not None
        return self.campaign.sweep.keep_series

    def setup(self) -> Callable[[Task], Packed]:
        """Check that this process would give the same numbers as the one that asks, and return what computes a task.

        Raises
        ------
        WorkbenchError
            The model or a version differs here, on another machine for instance.
        """
        users = load_candidates(self.candidates)
        here = common_key(self.campaign, self.file, self.model, self.settings, self.effort, self.keep_series, users)
        if here != self.common:
            raise WorkbenchError("model, formulas, code or versions of this worker are not those of the run")
        base = base_robot(self.campaign, self.file, self.model, users)[0]
        with contextlib.suppress(WorkbenchError):
            self._warm_up(base)
        if self.keep_series != "none":
            series_bytes({"t": np.zeros(1)})  # what writes files takes a gigabyte of addresses, which are no case's
        return partial(compute, self, base)

    def overrides(self, robot: Robot, spec: CaseSpec) -> dict[str, float]:
        """Parameters of a case, over those of the campaign and under those of the command line."""
        return robot.description.table.layered(self.campaign.parameters, spec.parameters, self.settings)

    def _warm_up(self, base: Robot) -> None:
        """Compile what is compiled on first use, so that no case's time and memory are charged for it."""
        spec = self.campaign.case[0]
        case = resolve_case(spec, self.file, base, self.model, self.overrides(base, spec))
        q, qd, qdd = (values[:2] for values in (case.motion.q, case.motion.qd, case.motion.qdd))
        for mass_model in dict.fromkeys(c.reference for c in self.campaign.candidate):
            case.robot.reference.inverse_dynamics(q, qd, qdd, mass_model)
            case.robot.inverse_dynamics(q, qd, qdd, mass_model)


def evaluate(context: Context, base: Robot, task: Task) -> Answer:
    """Compute one case of the robot *base*; errors come back as data.

    Raises
    ------
    MemoryError
        For the worker to report: after it, no result of the process is to be trusted.
    """
    index, numbers = task
    content = context.recipe.case_dict(index, numbers)
    key = case_key(context.common, content)
    filters = context.campaign.sweep.filter if context.campaign.sweep else None
    try:
        spec = CaseSpec.model_validate(content)
        overrides = context.overrides(base, spec)
        try:
            case = resolve_case(spec, context.file, base, context.model, overrides)
        except MotionError as error:
            status = FILTERED if filters and filters.inside_workspace else FAILED
            return Answer(lost(index, key, status, str(error)))
        if filters and filters.singularity is not None:
            nearest, name = _nearest_singularity(case)
            if nearest < filters.singularity:
                reason = f"|{name}| falls to {nearest:.3g} of its scale; the filter leaves out below"
                return Answer(lost(index, key, FILTERED, f"{reason} {filters.singularity:g}"))
        result = compute_case(context.campaign, case, context.effort)
    except MemoryError:
        raise
    except Exception as error:
        if NO_MEMORY in str(error):
            raise MemoryError from error
        if isinstance(error, WorkbenchError):
            return Answer(lost(index, key, FAILED, str(error)))
        return Answer(lost(index, key, FAILED, f"{type(error).__name__}: {error}"))
    status, reason = _judge(result)
    keep = context.keep_series == "all" or (context.keep_series == "failed" and status != PASSED)
    series = series_bytes(result.series) if keep else None
    rows = [{name: getattr(row, name) for name in COLUMNS} for row in result.rows]
    hashed = hashlib.sha256(series).hexdigest() if series is not None else ""
    return Answer(Record(index, key, status, reason, rows, _figures(result.facts), hashed), series)


def series_bytes(series: Mapping[str, FloatArray]) -> bytes:
    """Return the time series as they stand in ``series/<case>.parquet``; the same numbers give the same bytes."""
    from workbench.parquet_columns import column_bytes  # heavy, and most sweeps keep none

    return column_bytes(series)


def _nearest_singularity(case: Case) -> tuple[float, str]:
    measures = case.singularity
    if not measures:
        raise SpecError(
            "filter.singularity: this robot has no measure of singular poses; state platform.coordinates in its robot"
            " file, as many as it has freedoms"
        )
    return min((float(np.abs(values).min()), name) for name, values in measures.items())


def _judge(result: CaseResult) -> tuple[str, str]:
    if result.faults:
        not_finite = all(fault.not_finite for fault in result.faults)
        return INVALID if not_finite else FAILED, "; ".join(fault.message for fault in result.faults)
    for row in result.rows:
        for column in MEASURED:
            value = getattr(row, column)
            if not math.isfinite(value):
                return INVALID, f"{_where(row)}: {column} is {value}"
    for row in result.rows:
        if row.verdict in FAILURES:
            return FAILED, f"{_where(row)}: peak_error {row.peak_error:.3g}, bound {row.bound:g} ({row.verdict})"
    if result.facts["status"] != PASSED:
        return FAILED, str(result.facts["message"])
    return PASSED, ""


def _where(row: Row) -> str:
    return f"{row.candidate} against {row.reference}, {row.joint}"


def _figures(facts: Mapping[str, Any]) -> dict[str, float]:
    """The numbers of a case that stand in ``cases/``."""
    names = (
        "closure_residual", "velocity_residual", "acceleration_residual", "condition", "peak_speed",
        "peak_acceleration",
    )  # fmt: skip
    found = {name: float(facts[name]) for name in names}
    found |= {f"kinematics_{name}": float(value) for name, value in facts["kinematics"].items()}
    found |= {f"singularity_{name}": float(value["min"]) for name, value in facts["singularity"].items()}
    return found | {"warnings": float(len(facts["warnings"]))}
