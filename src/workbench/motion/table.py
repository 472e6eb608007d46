"""Motions from a table: by names of joints or task coordinates, with derivatives as given or from a quintic spline."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray
from workbench.delimited import Table, find_columns, parse_table, read_regular
from workbench.delimited.read import shown
from workbench.errors import MotionError, did_you_mean
from workbench.motion.base import MAX_SAMPLES, JointMotion, PlatformMotion, as_coordinates, as_times, unit_of
from workbench.motion.spline import hermite_quintic, interpolating_spline
from workbench.motion.stored import PARQUET, is_series_column, parquet_table

SPLINE_DEGREE = 5
"""Quintic: its second derivative is a cubic spline, so acceleration is smooth and fourth-order accurate."""

PER = ("", "/s", "/s^2")


@dataclass(frozen=True)
class Tabulated:
    """A motion and what is known of the table that it came from."""

    motion: JointMotion | PlatformMotion
    file: str
    names: tuple[str, ...]
    """of the coordinates, in the motion's order"""
    units: tuple[str, ...]
    """``m`` or ``rad`` each; empty texts where the caller did not say"""
    derivatives_given: bool


@dataclass(frozen=True)
class _Naming:
    """One way in which a table may name its columns: positions, velocities, accelerations, several spellings each."""

    positions: tuple[str, ...]
    derivatives: tuple[tuple[tuple[str, ...], ...], tuple[tuple[str, ...], ...]]

    @property
    def text(self) -> str:
        """For messages: ``t,q1,q2 with all or none of qd1,qd2,qdd1,qdd2``."""
        rates = ",".join(spellings[0] for group in self.derivatives for spellings in group)
        return f"t,{','.join(self.positions)} with all or none of {rates}"

    @property
    def plain(self) -> list[str]:
        """All names, one spelling each."""
        return [*self.positions, *(names[0] for group in self.derivatives for names in group)]

    @property
    def every(self) -> list[str]:
        """All names, all spellings."""
        return [*self.positions, *(name for group in self.derivatives for names in group for name in names)]


def from_csv(
    path: str | Path,
    columns: Sequence[str] = ("q1", "q2", "q3"),
    t: ArrayLike | None = None,
    units: Sequence[str] | None = None,
) -> JointMotion:
    """Read a joint motion.

    The file is a table as `workbench.delimited.read_table` takes it, or a run's ``series/CASE.parquet``. Its header
    names the columns, in any order: ``t`` (or ``time``) in seconds, strictly increasing, any spacing, and the joints,
    either by name or, in actuator order, as ``q1 q2 ...``; then either all velocities and accelerations, taken as
    given, or none. Of a joint ``crank`` they are ``crank_d`` and ``crank_dd``, of ``q1`` also ``qd1`` and ``qdd1``.
    Units may stand in the headers or below them. Columns that a run's series has besides are skipped.

    Without given derivatives a quintic spline with not-a-knot ends runs through the samples. It returns every position
    exactly. For a smooth motion with spacing h its error is O(h^6) in velocity and O(h^4) in acceleration inside, and
    O(h^5) and O(h^4) with a larger constant within some ten samples of the ends: a sine with 50 samples per period has
    a relative error of acceleration of 4e-7 inside and 1e-4 at the ends, with 200 samples 2e-9 and 4e-7.
    It does not smooth. Errors of size e in the positions, rounding to few digits included, become up to 2 e/h in
    velocity and 8 e/h^2 in acceleration (five times that at the ends): positions rounded to 1e-6 rad every millisecond
    carry some 4 rad/s^2. Write positions with all their digits, or give the derivatives.

    Parameters
    ----------
    path
        The file.
    columns
        Names of the joints in actuator order.
    t
        Times in seconds to resample to, within the file's; None keeps the file's own. Between samples with given
        derivatives runs the quintic that takes all three of them.
    units
        ``m`` or ``rad`` per joint, against which units in the file are held; None takes either.

    Returns
    -------
    JointMotion
        What its numbers are worth says `workbench.motion.judge`; nothing of that is refused here.

    Raises
    ------
    MotionError
        The file cannot be read; a column is unknown, missing or named twice; a unit measures something else; a line has
        another number of cells than the header, a cell is not a finite number, time does not increase; fewer than 6
        samples without derivatives (1 with them, 2 to resample); or *t* reaches outside the file. The message names
        file, line, column and value.
    """
    motion = read_joints(path, columns, t, units).motion
    assert isinstance(motion, JointMotion)
    return motion


def read_joints(
    path: str | Path, columns: Sequence[str], t: ArrayLike | None = None, units: Sequence[str] | None = None
) -> Tabulated:
    """As `from_csv`, with what is known of the table.

    Raises
    ------
    MotionError
        As `from_csv`.
    """
    joints = _checked_names(columns, "q")
    by_name = _naming(joints, "q")
    places = tuple(f"q{number}" for number in range(1, len(joints) + 1))
    namings = [by_name] if joints == places else [by_name, _naming(places, "q")]
    return _read(path, joints, namings, t, tuple(units or ("",) * len(joints)), JointMotion)


def platform_from_csv(
    path: str | Path, coordinates: Sequence[str] = ("x", "y", "z"), t: ArrayLike | None = None
) -> PlatformMotion:
    """Read a motion of the platform, in task coordinates.

    As `from_csv`: columns are the coordinates' names, ``x``, ``z``, ``ry`` ..., with derivatives ``x_d`` and ``x_dd``
    (or ``xd`` and ``xdd``); or ``x1 x2 ...`` in their order with ``xd1`` and ``xdd1``. Lengths in m, angles in rad,
    unless the file says a unit.

    Raises
    ------
    MotionError
        As `from_csv`.
    """
    motion = read_platform(path, coordinates, t).motion
    assert isinstance(motion, PlatformMotion)
    return motion


def read_platform(path: str | Path, coordinates: Sequence[str], t: ArrayLike | None = None) -> Tabulated:
    """As `platform_from_csv`, with what is known of the table.

    Raises
    ------
    MotionError
        As `from_csv`.
    """
    names = _checked_names(as_coordinates(coordinates), "")
    numbered = _naming(tuple(f"x{number}" for number in range(1, len(names) + 1)), "x")
    return _read(path, names, [_naming(names, ""), numbered], t, tuple(map(unit_of, names)), PlatformMotion)


def _read(
    path: str | Path,
    names: tuple[str, ...],
    namings: list[_Naming],
    t: ArrayLike | None,
    units: tuple[str, ...],
    kind: type[JointMotion] | type[PlatformMotion],
) -> Tabulated:
    file = str(path)
    data = read_regular(path, MotionError)
    expected = " or ".join(naming.text for naming in namings)
    if data[: len(PARQUET)] == PARQUET:
        table, naming = parquet_table(data, file, MAX_SAMPLES), namings[-1]  # a run's series counts the joints
    else:
        table = parse_table(data, file, MotionError, expected=expected, most_rows=MAX_SAMPLES)
        naming = _chosen(table, namings)
    _refuse_unknown(table, namings)
    orders = [[(name,) for name in naming.positions], *naming.derivatives]
    measures = {
        name: [base + PER[order] for base in ([unit] if unit else ["m", "rad"])]
        for order, group in enumerate(orders)
        for unit, spellings in zip(units, group, strict=True)
        for name in spellings
    }
    found = find_columns(table, {"t": ["s"], **measures}, MotionError)
    # one derivative column asks for all of them: half a set cannot be taken as given
    given = any(name in found for group in naming.derivatives for spellings in group for name in spellings)
    chosen = [[_one(table, spellings, found, naming) for spellings in group] for group in orders[: 3 if given else 1]]
    if "t" not in found:
        _missing(table, "t", naming)
    times = found["t"].si(table)
    _check_increasing(table, times)
    least = SPLINE_DEGREE + 1 if not given else 1 if t is None else 2
    if len(times) < least:
        why = "without qd and qdd columns" if not given else "to resample" if t is not None else "of any file"
        if kind is PlatformMotion:
            why = why.replace("qd and qdd", "velocity and acceleration")
        _refuse(f"{file}: {len(times)} samples; allowed: at least {least} {why}", file=file, value=len(times))
    arrays = [np.column_stack([found[name].si(table) for name in group]) for group in chosen]
    more: dict[str, Any] = {"coordinates": names} if kind is PlatformMotion else {}
    try:
        motion = kind(*_sampled(times, arrays, t, file), **more)
    except MotionError as error:
        prefix = "" if str(error).startswith(file) else f"{file}: "
        raise MotionError(f"{prefix}{error}", **{**error.facts, "file": file}) from error
    return Tabulated(motion, file, names, units, given)


def _sampled(
    times: FloatArray, arrays: list[FloatArray], t: ArrayLike | None, file: str
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    given = len(arrays) == 3
    if given and t is None:
        return times, arrays[0], arrays[1], arrays[2]
    grid = times if t is None else _grid_inside(file, t, times)
    # times from the first sample on: a clock that counts from long ago would cost digits in the spline
    elapsed = times - times[0]
    curve = hermite_quintic(elapsed, *arrays) if given else interpolating_spline(elapsed, arrays[0], SPLINE_DEGREE)
    position, velocity, acceleration = (np.asarray(curve(grid - times[0], nu=order)) for order in range(3))
    return grid, position, velocity, acceleration


def _checked_names(columns: Sequence[str], prefix: str) -> tuple[str, ...]:
    if isinstance(columns, str) or not columns or not all(isinstance(name, str) and name for name in columns):
        raise MotionError(f"columns = {columns!r}; allowed: a list of names", value=columns)
    every = _naming(tuple(columns), prefix).every
    if len(set(every)) < len(every) or "t" in every:
        raise MotionError(
            f"columns = {columns!r}; allowed: names that differ, from the derivatives' too, and not t", value=columns
        )
    return tuple(columns)


def _naming(names: tuple[str, ...], prefix: str) -> _Naming:
    """Spellings of derivatives: ``crank_d`` always; ``qd1`` where the name is the prefix and a number."""

    def spellings(name: str, order: int) -> tuple[str, ...]:
        plain = f"{name}_{'d' * order}"
        if prefix and name.startswith(prefix):
            return f"{prefix}{'d' * order}{name[len(prefix) :]}", plain
        return (plain, f"{name}{'d' * order}") if re.fullmatch("r?[xyz]", name) else (plain,)

    first, second = (tuple(spellings(name, order) for name in names) for order in (1, 2))
    return _Naming(names, (first, second))


def _chosen(table: Table, namings: list[_Naming]) -> _Naming:
    """By name where every joint's name is there, else by number."""
    for naming in namings:
        if len(find_columns(table, dict.fromkeys(naming.positions, _ANYTHING), MotionError)) == len(naming.positions):
            if naming is namings[0] and len(namings) > 1 and set(naming.positions) == set(namings[1].positions):
                _refuse_two_orders(table, naming)
            return naming
    # which of them was meant says the first column that is there
    seen = [naming for naming in namings if any(name in table.names for name in naming.every)]
    return seen[0] if seen else namings[0]


_ANYTHING = ("m", "rad", "m/s", "rad/s", "m/s^2", "rad/s^2", "s", "N", "N m", "1")


def _refuse_two_orders(table: Table, naming: _Naming) -> None:
    """Joints that bear the numbers of others: a table of a run's series counts, any other table names."""
    if any(is_series_column(name) for name in table.names):
        _refuse(
            f"{table.file}: line {table.header_line}: columns {', '.join(naming.positions)} of a run's series are in"
            " actuator order, and the joints have these names in another; take the columns of the run out",
            file=table.file,
        )


def _refuse_unknown(table: Table, namings: list[_Naming]) -> None:
    valid = list(dict.fromkeys(["t", *(name for naming in namings for name in naming.plain)]))
    known = {name.lower() for name in ("t", "time", *(name for naming in namings for name in naming.every))}
    where = f"{table.file}: line {table.header_line}"
    for header, name in zip(table.headers, table.names, strict=True):
        if header.lower() in known or name.lower() in known or is_series_column(header):
            continue
        if len(table.headers) == 1:
            hint = "; allowed: commas, semicolons or tabs between names"
        else:
            hint = did_you_mean(name, valid) if len(name) <= 40 else "; allowed: short names"
        _refuse(f"{where}: unknown column {shown(header)}{hint}", file=table.file, line=table.header_line, column=name)


def _one(table: Table, spellings: tuple[str, ...], found: dict[str, Any], naming: _Naming) -> str:
    name = next((name for name in spellings if name in found), None)
    return name or _missing(table, spellings[0], naming)


def _missing(table: Table, name: str, naming: _Naming) -> NoReturn:
    _refuse(
        f'{table.file}: line {table.header_line}: column "{name}" is missing; allowed: {naming.text}',
        file=table.file,
        column=name,
    )


def _check_increasing(table: Table, times: FloatArray) -> None:
    falls = np.diff(times) <= 0.0
    if falls.any():
        row = int(np.argmax(falls)) + 1
        _refuse(
            f"{table.file}: line {table.lines[row]}, column t: {times[row]:.12g} s after {times[row - 1]:.12g} s; "
            "allowed: strictly increasing",
            file=table.file,
            line=table.lines[row],
            column="t",
            value=float(times[row]),
        )


def _grid_inside(file: str, t: ArrayLike, times: FloatArray) -> FloatArray:
    grid = as_times(t)
    for moment in (grid[0], grid[-1]):
        if not times[0] <= moment <= times[-1]:
            _refuse(
                f"{file}: t = {moment:g} s is outside the file; allowed: {times[0]:g} s to {times[-1]:g} s",
                file=file,
                column="t",
                value=float(moment),
            )
    return grid


def _refuse(message: str, **facts: Any) -> NoReturn:
    raise MotionError(message, **facts)
