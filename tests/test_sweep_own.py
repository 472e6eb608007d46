"""Sweeps of a mechanism and a formula of the user's own: same bytes for any workers, faults named, edits noticed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from exact_csv import read_exact
from own_mechanisms import CAMPAIGN, FOURBAR
from small_campaign import Workbench, listing

SWEEP = (
    CAMPAIGN
    + """
[sweep]
method = "sobol"
samples = 16
seed = 3
[[sweep.vary]]
key = "speed"
low = 0.5
high = 4.0
scale = "log"
[[sweep.vary]]
key = "motion.amplitude[0]"
low = 0.1
high = 4.0
"""
)

FORMULA = """
import numpy as np
import workbench

@workbench.candidate("mine")
def mine(p, q, qd, qdd):
    return p.m1 * qdd
"""

WRONG = """
import workbench

@workbench.candidate("mine", bound=1e-10)
def mine(p, q, qd, qdd):
    if qd.max() > 4.0:
        return q / 0.0
    if qd.max() > 2.0:
        raise KeyError("nothing")
    return 0.0 * q
"""


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    made = Workbench(tmp_path, monkeypatch, capsys)
    made.write(FOURBAR, "fourbar.xml")
    made.write(SWEEP, "sweep.toml")
    return made


def summary(directory: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((directory / "sweep.json").read_text(encoding="utf-8"))
    return found


@pytest.mark.usefixtures("inline_workers")
def test_a_slow_formula_is_no_warning_that_a_sweep_stores(workbench: Workbench) -> None:
    """Whether a call took long depends on the machine's load; one such count made two equal sweeps differ."""
    workbench.write(FORMULA.replace("return", "__import__('time').sleep(0.2)\n    return"), "mine.py")
    workbench.write(SWEEP.replace("samples = 16", "samples = 2"), "sweep.toml")
    assert workbench("run", "sweep.toml", "--candidates", "mine.py", "--out", "out", "--jobs", "1").code == 4
    assert (pd.read_parquet(workbench.directory / "out" / "cases")["warnings"] == 0).all()


def test_any_number_of_workers_gives_the_same_bytes(workbench: Workbench) -> None:
    workbench.write(FORMULA, "mine.py")
    for jobs in ("1", "2"):
        done = workbench("run", "sweep.toml", "--candidates", "mine.py", "--out", f"by{jobs}", "--jobs", jobs)
        assert done.code == 4, done  # the formula has no bound
    one, two = (workbench.directory / f"by{jobs}" for jobs in (1, 2))
    for name in ("sweep.json", *(path.relative_to(one) for path in sorted(one.glob("*/*.parquet")))):
        assert (one / name).read_bytes() == (two / name).read_bytes()
    counts = summary(one)["counts"]
    assert counts["passed"] == 16

    errors = pd.read_parquet(one / "summary")
    case = str(errors["case"].iloc[0])
    alone = workbench("run", "sweep.toml", "--candidates", "mine.py", "--only", case, "--out", "alone", "--quick")
    assert alone.code == 4, alone
    rows = read_exact(workbench.directory / "alone" / "summary.csv")
    expected = errors[errors["case"] == case]
    assert rows["peak_error"].tolist() == expected["peak_error"].tolist()


def test_a_formula_that_fails_fails_its_cases_with_its_own_line(workbench: Workbench) -> None:
    workbench.write(WRONG, "mine.py")
    done = workbench("run", "sweep.toml", "--candidates", "mine.py", "--out", "out", "--jobs", "1")
    assert done.code == 1
    found = {reason["status"]: reason["example"] for reason in summary(workbench.directory / "out")["reasons"]}
    assert 'candidate "mine" (mine.py:4) returns ' in found["invalid"]
    texts = [reason["example"] for reason in summary(workbench.directory / "out")["reasons"]]
    assert any("(mine.py:9) KeyError: 'nothing'" in text for text in texts)
    assert any("mine against distributed, crank: peak_error 1, bound 1e-10" in text for text in texts)


@pytest.mark.usefixtures("inline_workers")
def test_an_edited_formula_is_computed_again(workbench: Workbench) -> None:
    options = ("run", "sweep.toml", "--candidates", "mine.py", "--out", "out", "--jobs", "1")
    workbench.write(FORMULA, "mine.py")
    assert workbench(*options).code == 4
    first = pd.read_parquet(workbench.directory / "out" / "summary")
    again = workbench(*options)
    assert json.loads((workbench.directory / "out" / "manifest.json").read_text())["computed"] == 0, again
    workbench.write(FORMULA.replace("p.m1", "2.0 * p.m1"), "mine.py")
    assert workbench(*options).code == 4
    assert not pd.read_parquet(workbench.directory / "out" / "summary")["peak_error"].equals(first["peak_error"])


def test_a_dry_run_and_what_cannot_vary(workbench: Workbench) -> None:
    workbench.write(FORMULA, "mine.py")
    before = listing(workbench.directory)
    done = workbench("run", "sweep.toml", "--candidates", "mine.py", "--dry-run")
    assert done.code == 0
    assert "own: 16 cases, 656 samples" in done.out
    assert listing(workbench.directory) == before
    workbench.write(SWEEP.replace('"motion.amplitude[0]"', '"parameters.m_one"'), "other.toml")
    refused = workbench("run", "other.toml", "--out", "out")
    assert refused.code == 2
    (complaint,) = refused.complaint
    assert 'other.toml: sweep: key "parameters.m_one"' in complaint
    assert 'did you mean "m1"' in complaint or "m1" in complaint
