"""Maps over any two of the varied numbers, as data that the page's script shows as a table with coloured cells."""

from __future__ import annotations

import itertools
import json

import matplotlib as mpl
import numpy as np

from workbench.report.sweep.heat import COLOURS, map_over
from workbench.report.sweep.load import SweepRun

MOST_KEYS = 16
"""The strongest; pairs of so many numbers take a tenth of a megabyte."""
SHADES = 24


def picker_data(run: SweepRun, pair: tuple[str, str]) -> str:
    """Return the maps of one comparison over each two numbers as JSON; empty where there are fewer than three numbers.

    ``keys`` holds names and the texts of their bins; ``maps`` lists ``[i, j, median, largest, designs]``, row by row
    over j, columns over i; errors in percent with three digits, null where no design is.
    """
    keys = [d.key for d in run.summary.drivers_of(*pair) if run.key(d.key) is not None][:MOST_KEYS]
    if len(keys) < 3:
        return ""
    told: dict[int, dict[str, object]] = {}
    maps = []
    for (i, first), (j, second) in itertools.combinations(enumerate(keys), 2):
        found = map_over(run, pair, first, second)
        if found is None:
            continue
        for number, bins in ((i, found.across), (j, found.down)):
            told[number] = {"name": bins.label, "bins": [bins.text(k) for k in range(bins.count)]}
        maps.append([i, j, _percents(found.median), _percents(found.worst), found.cases.ravel().tolist()])
    if len(told) < 3:
        return ""
    shades = mpl.colormaps[COLOURS](np.linspace(0.0, 1.0, SHADES))
    content = {
        "keys": [told.get(number) for number in range(len(keys))],
        "maps": maps,
        "shades": [mpl.colors.to_hex(shade) for shade in shades],
    }
    return json.dumps(content, ensure_ascii=False, separators=(",", ":"), allow_nan=False)


def _percents(cells: np.ndarray) -> list[float | None]:
    return [float(f"{100 * value:.3g}") if np.isfinite(value) else None for value in cells.ravel().tolist()]
