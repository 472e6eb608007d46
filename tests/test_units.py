"""Lengths in millimetres: a campaign that uses them is told so, whatever fails first."""

from pathlib import Path

import pytest

import workbench as wb
from workbench.cli import _run

HINT = "this looks like millimetres"

CAMPAIGN = """
format = 1
name = "millimetres"
title = "A robot in millimetres"
model = "models/planar_4rprp.xml"
[parameters]
a = {a}
b = {a}
h = {h}
[[candidate]]
name = "distributed"
reference = "distributed"
bound = 1e-10
[[case]]
name = "example"
[case.motion]
kind = "sine"
offset = [{q}, {q}, {q}]
amplitude = [{step}, {step}, {step}]
frequency = [1.0, 2.0, 3.0]
stop = 1.0
samples = 11
"""


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("scale", "motion_scale", "code", "hinted"),
    [(1.0, 1.0, 0, False), (1000.0, 1000.0, 2, True), (1000.0, 1.0, 2, True)],
)
def test_a_campaign_in_millimetres_is_told_so(
    scale: float, motion_scale: float, code: int, hinted: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "millimetres.toml"
    file.write_text(CAMPAIGN.format(a=0.6 * scale, h=0.02 * scale, q=0.39 * motion_scale, step=0.01 * motion_scale))
    assert _run(["run", str(file), "--out", str(tmp_path / "out"), "--quick", "--no-pictures"]) == code
    printed = capsys.readouterr()
    shown = " ".join((printed.out + printed.err).split())
    assert (HINT in shown) is hinted
    if hinted:
        assert "a = 600 m is longer than 20 m" in shown


def test_every_length_is_looked_at() -> None:
    robot = wb.load_mechanism("models/asym_2rss_ppap.xml")
    assert robot.millimetre_warnings() == []
    for name in ("L", "l", "a1", "a2", "a4", "a5", "a6"):
        assert HINT in robot.with_parameters(**{name: 200.0}).millimetre_warnings()[0]
