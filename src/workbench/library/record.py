"""``library.json``: what was measured of the robots of the library, and with which versions."""

from __future__ import annotations

import json
from pathlib import Path

from pydantic import Field, ValidationError

from workbench.data_files import bundled_directory
from workbench.errors import SpecError
from workbench.reading import read_json
from workbench.records import Record

FILE = "library.json"
FORMAT = 1


class WorkspaceFigure(Record):
    """The reachable set at the home attitude, within the joints' ranges."""

    unit: str
    """m^3, m^2 or m"""
    amount: float
    error: float
    """half of the cells at its border"""
    worst_condition: float | None = None
    """largest condition number of the scaled Jacobian over its cells"""


class RobotFigures(Record):
    """What one campaign found; errors are fractions of a joint's peak torque over a case."""

    status: str
    cases: int
    samples: int
    exact: str
    """the candidate with the bound that the verdict is about"""
    error: float
    """its largest error against MuJoCo"""
    bound: float
    engine: str = ""
    spread: float | None = None
    """largest difference of the second engine from MuJoCo"""
    power: float | None = None
    """largest residual of the power balance, of peak power"""
    replay: tuple[float, float] | None = None
    """smallest and largest order at which the forward replay of the exact form converges with the time step"""
    replay_verdict: str = ""
    """``converges`` where every case does, else all that was said"""
    kinematics: dict[str, float] = Field(default_factory=dict)
    """kind -> largest error"""
    approximations: dict[str, tuple[float, float]] = Field(default_factory=dict)
    """candidate without a bound -> smallest and largest error over joints and cases"""
    cost_us: float | None = None
    """of the exact form in numpy, per sample"""
    mobility: int
    """by rank of the constraints"""
    idle: int
    rows: int
    rank: int
    redundant: int
    worst_condition: float | None = None
    """over the campaign"""
    singular: float | None = None
    """smallest scaled determinant over the campaign"""
    workspace: WorkspaceFigure | None = None


class LibraryRecord(Record):
    """The whole file."""

    format: int = FORMAT
    versions: dict[str, str] = Field(default_factory=dict)
    robots: dict[str, RobotFigures] = Field(default_factory=dict)


def record_path() -> Path:
    """Where it lies: beside the robots."""
    return bundled_directory("examples") / FILE


def read_record(path: Path | None = None) -> LibraryRecord:
    """Read what was measured; nothing where nothing was yet.

    Raises
    ------
    SpecError
        The file is no such record.
    """
    path = record_path() if path is None else path
    if not path.is_file():
        return LibraryRecord()
    try:
        return LibraryRecord.model_validate(read_json(path))
    except (ValueError, ValidationError) as error:
        raise SpecError(f"{path}: no record of the library: {str(error).splitlines()[0]}", file=str(path)) from error


def write_record(record: LibraryRecord, path: Path) -> None:
    """Write it, robots by name, floats with three digits: more would change with every machine."""
    text = json.dumps(_rounded(record.model_dump(exclude_none=True)), indent=1, sort_keys=True, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")


def _rounded(value: object) -> object:
    if isinstance(value, dict):
        return {key: _rounded(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(inner) for inner in value]
    return float(f"{value:.3g}") if isinstance(value, float) else value
