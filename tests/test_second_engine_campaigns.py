"""Campaigns through the command line with both engines: every bound holds, and the engines agree."""

from pathlib import Path

import pandas as pd
import pytest

import workbench as wb
from own_mechanisms import PARALLELOGRAM
from workbench.cli import _run

pytest.importorskip("pinocchio", reason="the extra pinocchio is not installed")

pytestmark = pytest.mark.usefixtures("undrawn")
AGREEMENT = 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("campaign", ["almeida_2010", "garcia_murillo_2016"])
def test_engines_agree_on_every_case(campaign: str, tmp_path: Path) -> None:
    out = tmp_path / campaign
    options = ["--engines", "mujoco,pinocchio", "--quick", "--no-pictures"]
    assert _run(["run", f"campaigns/{campaign}.toml", "--out", str(out), *options]) == 0
    summary = pd.read_csv(out / "summary.csv")
    spread = summary.groupby("case")["engine_spread"].max()
    assert len(spread) >= 8
    assert (spread <= AGREEMENT).all()
    # the engines are two programs: no two of them round alike everywhere
    assert (spread > 0).any()
    bound = summary[summary.kind == "verification"]
    assert (bound.peak_error <= AGREEMENT).all()
    assert set(bound.verdict) == {"pass"}


@pytest.mark.parametrize("name", ["fourbar", "fivebar", "delta", "bricard", "orthoglide"])
def test_engines_agree_on_the_examples(repository: Path, tmp_path: Path, name: str) -> None:
    folder, out = repository / "examples" / name, tmp_path / "out"
    options = ["--candidates", str(folder / f"{name}.py"), "--engines", "mujoco,pinocchio", "--quick", "--no-pictures"]
    assert _run(["run", str(folder / f"{name}.toml"), "--out", str(out), *options]) == 0
    spread = pd.read_csv(out / "summary.csv")["engine_spread"]
    assert spread.notna().all()
    assert 0 < spread.max() <= 1e-12


REDUNDANT = """
name = "both"
title = "A parallelogram driven at both cranks"
model = "both.xml"
actuated = ["left", "right"]
platform_site = "coupler"
initial = { left = 1.0, right = 1.0, hinge = -1.0 }
[[case]]
name = "swing"
[case.motion]
kind = "sine"
offset = [1.0, 1.0]
amplitude = [0.5, 0.5]
frequency = [3.0, 3.0]
stop = 1.0
samples = 21
"""


def test_redundant_actuation_is_judged_by_power_and_replay_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("both.xml").write_text(PARALLELOGRAM)
    Path("both.toml").write_text(REDUNDANT)
    command = ["run", "both.toml", "--out", "out", "--engines", "mujoco,pinocchio", "--no-pictures"]
    assert _run(command) == 4
    case = wb.load_run("out").manifest.cases["swing"]
    assert case.evidence.power_balance["distributed"].relative < 1e-10
    assert case.evidence.replay
    assert case.evidence.replay.candidates["reference"].verdict == "converges"
    assert case.evidence.second_engine is None
    assert case.peak_reactions == {}
    assert "no second engine looks at them, and reactions are left out" in case.warnings[0]
    # twin: driven at one crank the same mechanism has both
    Path("both.toml").write_text(ONE_CRANK)
    assert _run(command) == 4
    case = wb.load_run("out").manifest.cases["swing"]
    assert case.evidence.second_engine is not None
    assert case.peak_reactions
    assert case.warnings == ()


ONE_CRANK = (
    REDUNDANT.replace('["left", "right"]', '["left"]')
    .replace("[1.0, 1.0]", "[1.0]")
    .replace("[0.5, 0.5]", "[0.5]")
    .replace("[3.0, 3.0]", "[3.0]")
)
