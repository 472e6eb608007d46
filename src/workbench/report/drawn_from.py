"""What figures are drawn from, as digests: drawings that were made beside a run are taken where these are the same."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence

from workbench.report.load import Run
from workbench.report.plot import Plot

Drawn = Mapping[tuple[str, str], str]
"""From a figure's key, and a digest of what it was drawn from, to the drawing."""


def take(drawn: Drawn, digests: Mapping[str, str], plots: Sequence[Plot]) -> None:
    """Give figures the drawings there are of just what they show; *digests* is what `drawn_from` tells of them."""
    for plot in plots:
        svg = drawn.get((plot.key, digests.get(plot.key, "")))
        if svg is not None:
            vars(plot)["svg"] = svg  # where the property keeps it


def drawn_from(run: Run, plots: Sequence[Plot], anchors: Mapping[str, str]) -> dict[str, str]:
    """Tell what each figure of a case shows from everything else that it could: series, rows, records and names.

    Parameters
    ----------
    run, plots
        The run, and some of its report's figures; those that are of no case are left out.
    anchors
        By the names of cases.

    Returns
    -------
    dict
        From a figure's key to a SHA-256.

    Raises
    ------
    OSError
        A series cannot be read.
    """
    cases = {anchor: case for case, anchor in anchors.items()}
    wanted = {plot.case for plot in plots} & set(cases)
    digests = {anchor: _digest(run, cases[anchor]) for anchor in wanted}
    return {
        plot.key: hashlib.sha256(f"{digests[plot.case]}{plot.declared}".encode()).hexdigest()
        for plot in plots
        if plot.case in digests
    }


def _digest(run: Run, case: str) -> str:
    manifest = run.manifest
    told = {
        "joints": manifest.joints,
        "units": (manifest.coordinate_units, manifest.force_units),
        "axes": manifest.platform_axes,
        "mass models": sorted((name, one.mass_model) for name, one in manifest.candidates.items()),
        "case": (case, manifest.cases[case].model_dump_json()),
        "rows": [repr(row) for row in run.rows_of_case[case]],
    }
    found = hashlib.sha256(json.dumps(told).encode())
    found.update((run.directory / "series" / f"{case}.parquet").read_bytes())
    return found.hexdigest()
