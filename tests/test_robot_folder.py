"""A robot folder made from scratch, walked through every verb; its numbers are known from its own closed form."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import workbench as wb
from slider_crank import CAMPAIGN, FORMULA, MODEL, write_slider
from small_campaign import Workbench
from test_watch import Watch, save
from workbench.report import build_report

RUN = "--candidates", "slider.py", "--quick", "--no-pictures"
LINES = MODEL.splitlines()


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    made = Workbench(tmp_path, monkeypatch, capsys)
    write_slider(tmp_path)
    return made


def peak(run: str, case: str = "joint") -> float:
    """Largest torque of the reference, N m."""
    torques = wb.load_run(run).torques(case)
    return float(torques[torques["name"] == "distributed"]["value"].abs().max())


def errors(run: str) -> list[float]:
    summary = wb.load_run(run).summary
    return summary[summary["candidate"] == "virtual-work"]["peak_error"].tolist()


def test_show_and_check(workbench: Workbench) -> None:
    shown = workbench("model", "show", ".")
    assert shown.code == 0
    rows = {line.split()[0]: line for line in shown.out.splitlines() if line.strip()}
    assert "length of the crank" in rows["a"]
    assert "line 9" in rows["a"]
    assert "N s/m" in rows["c"]
    assert "damping, line 15" in rows["c"]
    assert "kg m^2" in rows["J"]
    assert "kg or" not in rows["J"]  # the joint is a hinge
    checked = workbench("model", "check", "robot.toml")
    assert checked.code == 0
    assert "mobility by rank     1 = 3 joint freedoms - rank 2" in checked.out
    workbench.write(MODEL.replace('site1="tip"', 'site1="tipp"'), "slider.xml")
    assert workbench("model", "check", "robot.toml").code == 2


def test_set_changes_the_lines_that_it_must_and_both_sides(workbench: Workbench) -> None:
    assert workbench.run(CAMPAIGN, "--out", "before", *RUN).code == 0
    done = workbench("model", "set", ".", "a*=1.1", "m2=0.7", "m3+=0.1", "--in-place")
    assert done.code == 0, done
    text = (workbench.directory / "slider.xml").read_text().splitlines()
    changed = [number for number, (old, new) in enumerate(zip(LINES, text, strict=True), 1) if old != new]
    assert changed == [7, 8, 9, 10, 16]  # bar of the crank, its geom, place of the rod, two masses
    assert "<!-- the crank's bar -->" in text[4]
    values = wb.load_mechanism(".").parameters
    a = 0.2 * 1.1
    assert (values.a, values.m2, values.m3) == (a, 0.7, 0.9 + 0.1)
    assert values.s1 == pytest.approx(a / 2, rel=1e-15)
    assert pytest.approx(0.4 * a**2 / 12, rel=1e-15) == values.I1
    assert workbench.run(CAMPAIGN, "--out", "after", *RUN).code == 0
    assert max(errors("after")) < 1e-13
    assert peak("after") > 1.05 * peak("before")
    compared = workbench("compare", "before", "after")
    assert compared.code == 0  # nothing got worse, and what differs is listed
    assert all(name in compared.out for name in ("m2", "m3", "I1"))
    # the twin: a formula that does not know the new length
    workbench.write(FORMULA.replace("crank, rod = p.a *", "crank, rod = 0.2 *"), "slider.py")
    assert workbench.run(CAMPAIGN, "--out", "stale", *RUN).code == 1
    assert workbench("compare", "after", "stale").code == 1


def test_what_is_given_goes_over_what_a_bar_makes_of_it(workbench: Workbench) -> None:
    assert workbench("model", "set", ".", "m1*=2", "I1=0.004", "--in-place").code == 0
    values = wb.load_mechanism(".").parameters
    assert (values.m1, values.I1, values.s1) == (0.8, 0.004, 0.1)


def test_settings_of_a_run(workbench: Workbench) -> None:
    assert workbench.run(CAMPAIGN, "--out", "plain", *RUN).code == 0
    assert max(errors("plain")) < 1e-13
    done = workbench.run(CAMPAIGN, "--out", "heavy", *RUN, "--set", "m*=2", "--set", "J=0.05", "--set", "c=0")
    assert done.code == 0, done
    assert max(errors("heavy")) < 1e-13
    found = wb.load_run("heavy")
    joint = found.manifest.cases["joint"].parameters
    assert {name: joint[name] for name in ("m1", "m2", "m3", "J", "c")} == {
        "m1": 0.8, "m2": 1.2, "m3": 1.8, "J": 0.05, "c": 0.0,
    }  # fmt: skip
    assert found.manifest.cases["platform"].parameters["m2"] == 1.6  # of the case's own 0.8
    assert peak("heavy") > 1.5 * peak("plain")
    # the platform moved as it was told to, on the branch that the robot file begins on
    series = found.series("platform")
    time = series["t"].to_numpy()
    stroke = 0.2 * np.cos(series["q1"]) + np.sqrt(0.25 - (0.2 * np.sin(series["q1"])) ** 2)
    np.testing.assert_allclose(stroke, 0.58 + 0.05 * np.sin(4.0 * time), atol=1e-12)
    refused = workbench.run(CAMPAIGN, "--out", "none", *RUN, "--set", "m4=1")
    assert refused.code == 2
    assert len(refused.complaint) == 1
    assert 'unknown parameter "m4"' in refused.complaint[0]


@pytest.mark.parametrize(
    ("old", "new"),
    [("+ p.J)", "+ 2 * p.J)"), ("p.c * along", "-p.c * along"), ("p.I2 * u", "p.I2"), ("p.s2 * bend", "bend")],
)
def test_a_spoiled_formula_fails(workbench: Workbench, old: str, new: str) -> None:
    assert FORMULA.count(old) == 1
    workbench.write(FORMULA.replace(old, new), "slider.py")
    assert workbench.run(CAMPAIGN, "--out", "out", *RUN).code == 1
    assert min(errors("out")) > 1e-4


SWEEP = """
[sweep]
method = "sobol"
samples = 8
filter = { inside_workspace = true }
[[sweep.vary]]
key = "parameters.m"
low = 0.5
high = 2.0
relative = true
[[sweep.vary]]
key = "parameters.b"
low = 0.1
high = 0.6
"""


@pytest.mark.usefixtures("inline_workers")
def test_a_sweep_over_its_parameters(workbench: Workbench) -> None:
    """Rods that are shorter than the crank reaches do not close: the filter leaves them out."""
    first = CAMPAIGN[: CAMPAIGN.index('\n[[case]]\nname = "platform"')]
    done = workbench.run(first.replace('name = "slider"', 'name = "sweep"') + SWEEP, "--out", "sweep", "--jobs", "1",
                         "--candidates", "slider.py")  # fmt: skip
    assert done.code == 0, done
    cases = pd.read_parquet("sweep/cases")
    reach = 0.2 * np.sin(1.4)
    status = cases.set_index("parameters.b")["status"]
    assert set(status[status.index < reach]) == {"filtered"}
    assert set(status[status.index > reach * 1.05]) == {"passed"}
    summary = pd.read_parquet("sweep/summary")
    assert summary["peak_error"].max() < 1e-11


def test_workspace(workbench: Workbench) -> None:
    assert workbench("workspace", ".", "--out", "space").code == 0
    found = json.loads((workbench.directory / "space/workspace.json").read_text())
    low, high = (0.2 * np.cos(q) + np.sqrt(0.25 - (0.2 * np.sin(q)) ** 2) for q in (1.5, 0.3))
    assert found["length_m"] == pytest.approx(high - low, abs=found["length_error_m"])
    assert found["length_error_m"] < 0.05 * found["length_m"]
    narrow = workbench("workspace", ".", "--out", "narrow", "--limit", "crank=0.8:1.5")
    assert narrow.code == 0
    assert json.loads((workbench.directory / "narrow/workspace.json").read_text())["length_m"] < 0.8 * found["length_m"]


def test_render(workbench: Workbench) -> None:
    done = workbench("model", "render", ".", "--out", "robot.png", "--size", "64x48")
    if done.code == 2 and "draw" in done.err:
        pytest.skip("nothing to draw with")
    assert done.code == 0, done
    assert (workbench.directory / "robot.png").read_bytes().startswith(b"\x89PNG")


def test_report(workbench: Workbench) -> None:
    assert workbench.run(CAMPAIGN, "--out", "out", *RUN).code == 0
    build_report(workbench.directory / "out", ("md",))
    text = (workbench.directory / "out/report.md").read_text()
    assert "Slider-crank" in text
    assert "virtual-work" in text


def test_diagnose_names_the_spoiled_term(workbench: Workbench) -> None:
    workbench.write(CAMPAIGN)
    right = workbench("diagnose", "small.toml", "--candidates", "slider.py", "--no-mend", "--jobs", "1")
    assert (right.code, "Nothing is wrong" in right.out) == (0, True)
    workbench.write(FORMULA.replace("+ p.J)", "+ 2 * p.J)"), "slider.py")
    wrong = workbench("diagnose", "small.toml", "--candidates", "slider.py", "--no-mend", "--json", "found.json")
    assert wrong.code == 1
    assert '"J"' in (workbench.directory / "found.json").read_text()


def test_watch_sees_the_model_and_the_formula(tmp_path: Path) -> None:
    write_slider(tmp_path)
    with Watch(tmp_path, "slider.toml", "--candidates", "slider.py", "--only", "joint") as watch:
        assert "1 within their bounds" in watch.shown()
        save(tmp_path / "slider.xml", MODEL.replace('mass="0.9"', 'mass="1.1"'))
        assert "1 within their bounds" in watch.until("m3: 0.9 -> 1.1\n")
        save(tmp_path / "slider.py", FORMULA.replace("+ p.J)", "- p.J)"))
        watch.until("beyond their bounds")
