"""A run directory as pandas frames: what a user's own script or notebook begins with.

>>> run = workbench.load_run("reports/mine")
>>> run.summary.pivot(index="case", columns="joint", values="peak_error")
>>> run.series("slow").plot(x="t", y=["ref_distributed_q1", "cand_distributed_q1"])
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from workbench.campaign.conclusion import Conclusion
from workbench.errors import OutputError, did_you_mean
from workbench.report import load
from workbench.report.concluded import conclusion_of
from workbench.report.manifest import Manifest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RATES = {"": "", "d": "/s", "dd": "/s^2"}
"""what a derivative's unit adds to the coordinate's"""

TORQUES = ("ref", "cand", "rec", "band")


@dataclass(frozen=True)
class RunFrames:
    """A run's results. Every frame holds the units of its columns in ``frame.attrs["units"]``."""

    directory: Path
    manifest: Manifest = field(repr=False)
    """what was run, with what, and everything about each case that is not a time series"""
    summary: pd.DataFrame = field(repr=False)
    """one row per case, candidate, reference and joint: errors, bound, verdict"""
    _run: load.Run = field(repr=False)

    def __repr__(self) -> str:
        """What was run, and how it came out."""
        verdicts = self.summary["verdict"].value_counts().to_dict() if len(self.summary) else {}
        counts = ", ".join(f"{count} {verdict}" for verdict, count in verdicts.items()) or "nothing compared"
        return f"<Run {self.manifest.campaign} in {self.directory}: {self.conclusion.text} ({counts})>"

    @property
    def conclusion(self) -> Conclusion:
        """The verdict on the run: ``status``, ``sentence``, ``passed``."""
        return conclusion_of(self._run)

    @property
    def cases(self) -> list[str]:
        """Names of the cases."""
        return list(self.manifest.cases)

    def series(self, case: str) -> pd.DataFrame:
        """Time series of one case, one row per sample, columns as docs/run-directory.md lists them.

        Raises
        ------
        OutputError
            No such case, or its file cannot be read.
        """
        self._check(case)
        frame = pd.DataFrame(dict(self._run.series(case)))
        frame.attrs = {"case": case, "units": {str(name): self._unit(str(name)) for name in frame.columns}}
        return frame

    def torques(self, case: str) -> pd.DataFrame:
        """Torques of one case, tidy: one row per sample, joint and curve.

        Columns ``t``, ``joint``, ``kind`` (``ref``, ``cand``, ``rec``), ``name`` (mass model or candidate), ``value``.

        Raises
        ------
        OutputError
            As `series`.
        """
        wide = self.series(case)
        torques = {str(column): found for column in wide.columns if (found := self._torque(str(column)))}
        kinds, names, joint_names = zip(*torques.values(), strict=True)
        # by arrays: some versions of pandas warn of pieces in which a failed formula left nothing but gaps
        frame = pd.DataFrame(
            {
                "t": np.tile(wide["t"].to_numpy(), len(torques)),
                "joint": np.repeat(joint_names, len(wide)),
                "kind": np.repeat(kinds, len(wide)),
                "name": np.repeat(names, len(wide)),
                "value": wide[list(torques)].to_numpy().T.ravel(),
            }
        )
        joints = zip(self.manifest.joints, self.manifest.force_units, strict=True)
        frame.attrs = {"case": case, "units": {"t": "s", "value": dict(joints)}}
        return frame

    def plot(self, case: str | None = None) -> Figure:
        """Draw the torques of one case, joint by joint: every candidate and reference, and below them the errors.

        Parameters
        ----------
        case
            Its name; None is the first.

        Raises
        ------
        OutputError
            As `series`; or nothing was compared in this case.
        """
        from workbench.report.figures import torque_plots
        from workbench.report.plot import figure_of

        case = self.cases[0] if case is None else case
        self._check(case)
        plots = torque_plots(self._run, case, case, self._run.series(case))
        if not plots:
            raise OutputError(f'{self.directory}: case "{case}" has no candidate to draw', case=case)
        return figure_of(plots)

    def parameters(self) -> pd.DataFrame:
        """Parameters of the mechanism: name, value, unit, meaning, source."""
        return pd.DataFrame([parameter.model_dump() for parameter in self.manifest.parameters])

    def _check(self, case: str) -> None:
        if case not in self.manifest.cases:
            raise OutputError(f'{self.directory}: no case "{case}"{did_you_mean(case, self.cases)}', case=case)

    def _torque(self, column: str) -> tuple[str, str, str] | None:
        kind, _, rest = column.partition("_")
        if kind not in TORQUES:
            return None
        joint = max((j for j in self.manifest.joints if rest.endswith(f"_{j}")), key=len, default="")
        return (kind, rest.removesuffix(f"_{joint}"), joint) if joint else None

    def _unit(self, column: str) -> str:
        manifest = self.manifest
        torque = self._torque(column.replace("part_", "ref_", 1) if column.startswith("part_") else column)
        if torque:
            return manifest.unit_of(torque[2])
        for rate, per in RATES.items():
            for letter, units in (("q", manifest.coordinate_units), ("x", ("m",) * len(manifest.platform_axes))):
                number = column.removeprefix(letter + rate)
                if number != column and number.isdigit() and 1 <= int(number) <= len(units):
                    return units[int(number) - 1] + per
        fixed = {"t": "s", "closure_residual": "m"}
        return fixed.get(column, "N" if column.startswith("reaction_") else "m" if column.startswith("point_") else "")


def load_run(directory: str | Path) -> RunFrames:
    """Read a run directory.

    Parameters
    ----------
    directory
        What ``workbench run`` wrote.

    Raises
    ------
    OutputError
        Missing or malformed files, in one line.
    """
    run = load.load_run(Path(directory))
    summary = pd.DataFrame([vars(row) for row in run.rows]) if run.rows else pd.DataFrame(columns=_columns())
    units: dict[str, Any] = dict.fromkeys(summary.columns, "")
    ratios = ("peak_error", "rms_error", "pointwise_error", "bound", "uncertainty")
    units |= dict.fromkeys(ratios, "1") | {"worst_time_s": "s"}
    joints = dict(zip(run.manifest.joints, run.manifest.force_units, strict=True))
    units |= {"peak_reference": joints, "normaliser": joints}
    summary.attrs = {"run": run.manifest.campaign, "units": units}
    return RunFrames(run.directory, run.manifest, summary, run)


def _columns() -> list[str]:
    return list(load.ErrorRow.__dataclass_fields__)
