"""The figure of what the torque is spent on: stacked parts, their sum, and nothing where the run has none."""

from __future__ import annotations

import itertools
import json
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Polygon

from test_report import JOINTS, make_run
from workbench.report import build_report
from workbench.report.load import Run, load_run
from workbench.report.spent import EDGE_OFF, PARTS, corners, spent_plot, spent_table
from workbench.report.style import figure_style
from workbench.report.svg import new_figure

SHARES = {"weight": 1.5, "velocity": -0.7, "springs": 0.2}
"""parts that add up to the torque; the others are not there"""


def edit(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    sizes = dict.fromkeys(JOINTS, 1.25)
    manifest["cases"]["sim1"]["spent"] = {
        "mass_model": "distributed",
        "parts": {"weight": sizes, "friction": dict.fromkeys(JOINTS, 0.0)},
        "bodies": {"<arm>": sizes},
    }


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = make_run(tmp_path_factory.mktemp("spent") / "run", edit=edit)
    path = folder / "series" / "sim1.parquet"
    series = pd.read_parquet(path)
    for joint in JOINTS:
        for part, share in SHARES.items():
            series[f"part_{part}_{joint}"] = share * series[f"ref_distributed_{joint}"]
    series.to_parquet(path)
    return load_run(folder)


def test_parts_are_stacked_from_zero_and_their_sum_is_the_torque(run: Run) -> None:
    series = run.series("sim1")
    plot = spent_plot(run, "sim1", "case-sim1", series)
    assert plot is not None
    with figure_style():
        figure = new_figure(*plot.size)
        plot.draw(figure)
    assert len(figure.axes) == len(JOINTS)
    for axes, joint, unit in zip(figure.axes, JOINTS, run.manifest.force_units, strict=True):
        torque = series[f"ref_distributed_{joint}"]
        (line,) = axes.get_lines()
        assert np.allclose(line.get_ydata(), torque, atol=1e-12)
        assert f"τ{joint.removeprefix('q')} [" in axes.get_ylabel()
        assert unit.split()[0] in axes.get_ylabel()
        bands = [patch for patch in axes.patches if isinstance(patch, Polygon)]
        assert len(bands) == 2 * len(SHARES)
        # what goes up reaches as high as all that is positive at once, what goes down as low as all that is negative
        heights = np.concatenate([band.get_path().vertices[:, 1] for band in bands])
        parts = [share * torque for share in SHARES.values()]
        assert heights.max() == pytest.approx(max(sum(np.maximum(p, 0.0) for p in parts)), rel=2 * EDGE_OFF)
        assert heights.min() == pytest.approx(min(sum(np.minimum(p, 0.0) for p in parts)), rel=2 * EDGE_OFF)
        assert heights.max() > 1.4 * torque.max()  # the twin: bands on one another from the sum would end at the torque
    shown = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert shown == [part for part in PARTS if part in SHARES]
    assert "weight, velocity, springs" in plot.alt


def test_a_case_without_parts_has_no_figure(run: Run) -> None:
    assert spent_plot(run, "sim2", "case-sim2", run.series("sim2")) is None


def test_the_report_shows_figure_and_table(run: Run) -> None:
    table = spent_table(run, run.manifest.cases["sim1"], "case-sim1")
    # an item that takes nothing has no row
    assert [row[0].text for row in table.rows] == ["weight", "<arm>"]
    build_report(run.directory)
    page = (run.directory / "report.html").read_text(encoding="utf-8")
    assert page.count("What the torque is spent on</h4>") == 1
    assert "&lt;arm&gt;" in page
    assert "<arm>" not in page
    assert (run.directory / "figures" / "case-sim1-spent.svg").is_file()
    assert json.loads((run.directory / "manifest.json").read_text())["cases"]["sim1"]["spent"]["bodies"]


def test_thinned_edges_stay_within_their_tolerance() -> None:
    rng = np.random.default_rng(4)
    time = np.cumsum(rng.uniform(0.5, 1.5, 2000))
    curves = np.array([np.sin(time / 50), np.cos(time / 31) + (time > 1000), 0.01 * np.sin(time)])
    for curve, off in itertools.product(curves, (0.02, 0.002)):
        rows = corners(time, curve, off)
        assert np.abs(np.interp(time, time[rows], curve[rows]) - curve).max() <= off
        assert len(rows) < 2000
        if len(rows) > 2:
            fewer = np.interp(time, time[rows[::2]], curve[rows[::2]])
            assert np.abs(fewer - curve).max() > off  # the twin: half of the corners do not do
    assert corners(time[:1], curves[0, :1], 0.1).tolist() == [0]
