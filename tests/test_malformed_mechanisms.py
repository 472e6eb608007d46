"""Ten ways to get a mechanism wrong; each is one line that says what to mend."""

from __future__ import annotations

from pathlib import Path

import pytest

from own_mechanisms import CAMPAIGN, FOURBAR
from small_campaign import Workbench

TIP = '<site name="tip" pos="0.3 0 0"/>'
LINK = """<body pos="0.3 0 0"><joint name="fifth" axis="0 -1 0"/><geom size=".01" mass=".1"/>
<site name="tip" pos="0.02 0 0"/></body>"""
GROUND = '<site name="ground" pos="0.5 0 0"/>'

MALFORMED: dict[str, tuple[tuple[str, str], tuple[str, str], str]] = {
    "loop that cannot close": ((GROUND, GROUND.replace("0.5", "2.5")), ("", ""), 'equality "loop" is open by'),
    "actuated joint misspelt": (("", ""), ('["crank"]', '["crnk"]'), '"crnk": no such joint; did you mean "crank"?'),
    "unactuated freedom": (
        (TIP, LINK),
        ("", ""),
        "no actuator holds: with all of crank at rest, joint",
    ),
    "two branches": (
        (GROUND, GROUND.replace("0.5", "0.9")),
        ("initial = { crank = 1.0, elbow = -0.5, wrist = -1.5 }\n", ""),
        "two assembly branches meet in the pose",
    ),
    "disconnected body": (
        ("</worldbody>", '<body name="lost"><joint name="stray"/><geom size=".1"/></body></worldbody>'),
        ("", ""),
        'joint "stray" by 1 can still move; add an actuator or a constraint',
    ),
    "joint on the world": ((GROUND, GROUND + '<joint name="nowhere"/>'), ("", ""), "joint"),
    "mass zero": (('size=".01" mass="0.5"', 'size=".01" mass="0"'), ("", ""), "mass and inertia of moving bodies"),
    "mesh missing": (
        (TIP, TIP + '<geom type="mesh" mesh="cover"/>'),
        ("", ""),
        "cover",
    ),
    "duplicate site": ((TIP, TIP + TIP), ("", ""), "repeated name 'tip' in site"),
    "degrees for radians": (
        ("", ""),
        ("crank = 1.0", "crank = 57.0"),
        "angles are in radians (57 degrees are 0.994838",
    ),
    "degrees in a motion": (("", ""), ("offset = [1.0]", "offset = [57.0]"), "angles are in radians"),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_one_line_that_would_let_a_user_mend_it(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    model, campaign, message = MALFORMED[name]
    assert model[0] in FOURBAR
    assert campaign[0] in CAMPAIGN
    workbench = Workbench(tmp_path, monkeypatch, capsys)
    workbench.write(FOURBAR.replace(*model, 1) if model[0] else FOURBAR, "fourbar.xml")
    done = workbench.run(CAMPAIGN.replace(*campaign, 1) if campaign[0] else CAMPAIGN, "--out", "out")
    assert done.code == 2
    assert len(done.complaint) == 1
    assert message in done.err
    assert not Path("out").exists()
