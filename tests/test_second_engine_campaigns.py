"""The papers' campaigns through the command line with both engines: every bound holds, and the engines agree."""

from pathlib import Path

import pandas as pd
import pytest

from workbench.cli import _run

pytest.importorskip("pinocchio", reason="the extra pinocchio is not installed")

AGREEMENT = 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("campaign", ["almeida_2010", "garcia_murillo_2016"])
def test_engines_agree_on_every_case(campaign: str, tmp_path: Path) -> None:
    out = tmp_path / campaign
    code = _run(["run", f"campaigns/{campaign}.toml", "--out", str(out), "--engines", "mujoco,pinocchio", "--quick"])
    assert code == 0
    summary = pd.read_csv(out / "summary.csv")
    spread = summary.groupby("case")["engine_spread"].max()
    assert len(spread) >= 8
    assert (spread <= AGREEMENT).all()
    # the engines are two programs: no two of them round alike everywhere
    assert (spread > 0).any()
    bound = summary[summary.kind == "verification"]
    assert (bound.peak_error <= AGREEMENT).all()
    assert set(bound.verdict) == {"pass"}
