"""A run's results for other programs: tidy CSV with units, and MATLAB files that Octave reads too."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from workbench.report.frames import RunFrames, load_run

DATA = "data"
LONGEST_NAME = 63
"""Characters of a MATLAB name."""

RATIOS = ("peak_error", "rms_error", "pointwise_error", "bound", "uncertainty")


def data_files(run_dir: Path, formats: tuple[str, ...]) -> dict[Path, bytes]:
    """``data/summary.csv`` and ``data/CASE.csv``, ``data/CASE.mat``: by path; same results, same bytes.

    Raises
    ------
    OutputError
        Results that cannot be read.
    """
    run = load_run(run_dir)
    folder, found = run.directory / DATA, dict[Path, bytes]()
    if not formats:
        return found
    if "csv" in formats:
        found[folder / "summary.csv"] = _text(_summary(run))
    for case, record in run.manifest.cases.items():
        if record.samples is None:
            continue
        series = run.series(case)
        if "csv" in formats:
            found[folder / f"{case}.csv"] = _text(_tidy(series))
        if "mat" in formats:
            found[folder / f"{case}.mat"] = _matlab(run, case, series)
    return found


def _text(frame: pd.DataFrame) -> bytes:
    return frame.to_csv(index=False, lineterminator="\n").encode()


def _summary(run: RunFrames) -> pd.DataFrame:
    """One row per case, candidate, joint and figure, each with its unit."""
    keys = ["case", "candidate", "reference", "joint", "kind", "verdict"]
    names, summary = (*RATIOS, "worst_time_s", "peak_reference", "normaliser"), run.summary
    units: list[str] = []
    for name in names:
        by_joint = name in ("peak_reference", "normaliser")
        of_all = ["1" if name in RATIOS else "s"] * len(summary)
        units += [run.manifest.unit_of(j) for j in summary["joint"]] if by_joint else of_all
    # by arrays: some versions of pandas warn of pieces that hold nothing but gaps
    frame = pd.concat([summary[keys]] * len(names), ignore_index=True)
    frame["quantity"] = np.repeat([name.removesuffix("_s") for name in names], len(summary))
    frame["value"] = np.concatenate([summary[name].to_numpy() for name in names])
    frame["unit"] = units
    return frame


def _tidy(series: pd.DataFrame) -> pd.DataFrame:
    """One row per sample and column: time, name as in the series, value, unit."""
    units = series.attrs["units"]
    long = series.melt(id_vars="t", var_name="name", value_name="value").rename(columns={"t": "t_s"})
    long["unit"] = long["name"].map(units)
    return long


def _matlab(run: RunFrames, case: str, series: pd.DataFrame) -> bytes:
    """Vectors by name, their units and original names in structures of the same names, and the parameters."""
    from scipy.io import savemat

    names = _names([str(column) for column in series.columns])
    units = series.attrs["units"]
    content: dict[str, Any] = {names[str(c)]: series[c].to_numpy(dtype=np.float64)[:, None] for c in series.columns}
    content["units"] = {names[str(c)]: units[str(c)] for c in series.columns}
    content["names"] = {names[str(c)]: str(c) for c in series.columns}
    content["parameters"] = {p.name: p.value if p.value is not None else np.nan for p in run.manifest.parameters}
    content["case_name"] = case
    stream = io.BytesIO()
    savemat(stream, content, long_field_names=True, do_compression=True)
    data = bytearray(stream.getvalue())
    data[:116] = b"MATLAB 5.0 MAT-file, parallel-robot-workbench".ljust(116)  # else the time of writing stands there
    return bytes(data)


def _names(columns: list[str]) -> dict[str, str]:
    """Names that MATLAB takes: letters, digits and _, at most 63, each once."""
    found: dict[str, str] = {}
    for column in columns:
        plain = re.sub(r"\W", "_", column, flags=re.ASCII)
        plain = (plain if plain[:1].isalpha() else f"x_{plain}")[: LONGEST_NAME - 3]
        number, name = 1, plain
        while name in found.values() or name in ("units", "names", "parameters", "case_name"):
            number += 1
            name = f"{plain}_{number}"
        found[column] = name
    return found
