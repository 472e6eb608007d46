"""The worked examples: each closed form is round-off away from the reference, and a spoiled one is not."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import workbench as wb
from workbench.campaign.evidence import Effort
from workbench.campaign.run import run_campaign
from workbench.report.frames import RunFrames

EXAMPLES = {
    "fourbar": ("tau[:, None]", "1.000001 * tau[:, None]"),
    "fivebar": ("w**2", "1.0001 * w**2"),
    "delta": ("p.If / p.lz**2", "1.0001 * p.If / p.lz**2"),
    "bricard": ("slope * qdd", "1.0001 * slope * qdd"),
}


def run(directory: Path, name: str, code: Path) -> RunFrames:
    out = directory / "out"
    run_campaign(directory / f"{name}.toml", out, effort=Effort(budget=False), candidates=[code])
    return wb.load_run(out)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_holds_and_its_spoiled_twin_does_not(repository: Path, tmp_path: Path, name: str) -> None:
    directory = tmp_path / name
    shutil.copytree(repository / "examples" / name, directory)
    code = directory / f"{name}.py"
    summary = run(directory, name, code).summary
    judged = summary[summary["kind"] == "verification"]
    assert len(judged) > 0
    assert judged["peak_error"].max() < 1e-12
    right, wrong = EXAMPLES[name]
    text = code.read_text()
    assert right in text
    code.write_text(text.replace(right, wrong))
    summary = run(directory, name, code).summary
    assert summary[summary["kind"] == "verification"]["peak_error"].max() > 1e-10


def test_codoureys_split_is_a_modelling_error_of_some_percent(repository: Path, tmp_path: Path) -> None:
    directory = tmp_path / "delta"
    shutil.copytree(repository / "examples" / "delta", directory)
    summary = run(directory, "delta", directory / "delta.py").summary
    error = summary[summary["candidate"] == "codourey"]["peak_error"]
    assert 0.02 < error.min() < error.max() < 0.08


def test_bricards_redundant_rows_are_counted(repository: Path, tmp_path: Path) -> None:
    directory = tmp_path / "bricard"
    shutil.copytree(repository / "examples" / "bricard", directory)
    case = run(directory, "bricard", directory / "bricard.py").manifest.cases["swing"]
    assert (case.mobility, case.rank, case.redundant_rows) == (1, 4, 2)
