"""Deliberate faults in a closed form: each has to fail a campaign, on the joints where derivation says that it shows.

The same campaign without the fault passes, so it is the fault that is found and nothing else.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from small_campaign import HEAD, Workbench
from workbench.arrays import FloatArray
from workbench.capabilities.robot import Robot
from workbench.robots.asym_2rss_ppap import literal
from workbench.robots.asym_2rss_ppap.closed_form import Asym2rssPpap
from workbench.robots.asym_2rss_ppap.literal import Misprint

Torques = Callable[[Robot, FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]

# "skew" has q2 != q3; in "mirrored" they are equal at all times, as in the paper's first simulation
CAMPAIGN = f"""{HEAD}
[[candidate]]
name = "CANDIDATE"
reference = "REFERENCE"
bound = 1e-10

[[case]]
name = "skew"
[case.motion]
kind = "multi_sine"
offset = [0.02, 0.75, 0.85]
terms = [[[0.06, 4.0, 0.3]], [[0.3, 6.0]], [[0.28, 5.0, 2.6]]]
stop = 1.0
samples = 21

[[case]]
name = "mirrored"
[case.motion]
kind = "sine"
offset = [0.0, 0.78, 0.78]
amplitude = [0.1, 0.26, 0.26]
frequency = [2.0, 5.0, 5.0]
stop = 1.0
samples = 21
"""


def misprinted(function: Callable[..., FloatArray], misprint: Misprint) -> Torques:
    def torques(mech: Robot, q: FloatArray, qd: FloatArray, qdd: FloatArray, external_force: FloatArray) -> FloatArray:
        motion = mech.platform_motion(q, qd, qdd)
        return function(mech.parameters, q, qd, qdd, *motion, external_force, frozenset({misprint}))

    return torques


def swapped_joints(sound: Torques) -> Torques:
    order = [0, 2, 1]

    def torques(mech: Robot, q: FloatArray, qd: FloatArray, qdd: FloatArray, external_force: FloatArray) -> FloatArray:
        return sound(mech, q, qd, qdd, external_force)[:, order]

    return torques


def moved_mass_centre(sound: Torques) -> Torques:
    """Rod CE's mass centre by 1 % of its length: 3 mm."""

    def torques(mech: Robot, q: FloatArray, qd: FloatArray, qdd: FloatArray, external_force: FloatArray) -> FloatArray:
        return sound(mech.with_parameters(k2_left=0.51), q, qd, qdd, external_force)

    return torques


@dataclass(frozen=True)
class Fault:
    candidate: str
    reference: str
    spoil: Callable[[Torques], Torques]
    shows: dict[str, set[str]]
    """case -> joints on which it has to show, and on no other"""


FAULTS = {
    "J_q sign": Fault(
        "lumped-appendix", "lumped", lambda _: misprinted(literal.lumped_appendix, Misprint.JQ33_SIGN),
        {"skew": {"q3"}, "mirrored": {"q3"}},
    ),
    "m2/4": Fault(
        "lumped-appendix", "lumped", lambda _: misprinted(literal.lumped_appendix, Misprint.K1_M2_QUARTER),
        {"skew": {"q1"}, "mirrored": {"q1"}},
    ),
    # J_xq33 = J_xq32 where q2 = q3: the paper's first simulation cannot see this misprint
    "J_xq33 for J_xq32": Fault(
        "lumped-appendix", "lumped", lambda _: misprinted(literal.lumped_appendix, Misprint.F2_JXQ33),
        {"skew": {"q2"}},
    ),
    "J_xq33 for J_xq32, distributed": Fault(
        "distributed-rotation", "distributed", lambda _: misprinted(literal.distributed_rotation, Misprint.F2_JXQ33),
        {"skew": {"q2"}},
    ),
    "swapped joints": Fault("distributed", "distributed", swapped_joints, {"skew": {"q2", "q3"}}),
    "mass centre moved": Fault(
        "distributed", "distributed", moved_mass_centre,
        {"skew": {"q1", "q2", "q3"}, "mirrored": {"q1", "q2", "q3"}},
    ),
    "mass centre moved, lumped": Fault(
        "lumped", "lumped", moved_mass_centre,
        {"skew": {"q1", "q2", "q3"}, "mirrored": {"q1", "q2", "q3"}},
    ),
}  # fmt: skip


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


def campaign(fault: Fault) -> str:
    return CAMPAIGN.replace("CANDIDATE", fault.candidate).replace("REFERENCE", fault.reference)


def failures(directory: Path) -> dict[str, set[str]]:
    rows = pd.read_csv(directory / "reports" / "small" / "summary.csv")
    failed = rows[rows.verdict == "fail"]
    return {str(case): set(group.joint) for case, group in failed.groupby("case")}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_fails_the_campaign(name: str, workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    fault = FAULTS[name]
    sound = Asym2rssPpap.candidates[fault.candidate]
    spoiled = dataclasses.replace(sound, function=fault.spoil(sound.function))
    monkeypatch.setattr(Asym2rssPpap, "candidates", {**Asym2rssPpap.candidates, fault.candidate: spoiled})
    done = workbench.run(campaign(fault))
    assert done.code == 1, done
    assert failures(workbench.directory) == fault.shows
    assert next(line for line in done.out.splitlines() if line.startswith("FAILED"))
    manifest = json.loads((workbench.directory / "reports/small/manifest.json").read_text())
    assert manifest["status"] == "failed"
    assert {case for case, facts in manifest["cases"].items() if facts["status"] == "failed"} == set(fault.shows)


@pytest.mark.parametrize("name", FAULTS)
def test_its_unspoiled_twin_passes(name: str, workbench: Workbench) -> None:
    done = workbench.run(campaign(FAULTS[name]))
    assert done.code == 0, done
    assert failures(workbench.directory) == {}
    assert "\nPASSED: all 6 checks in 2 cases" in done.out


def test_a_candidate_that_gives_nan_fails(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = Asym2rssPpap.candidates["lumped"]
    spoiled = dataclasses.replace(
        sound, function=lambda *arguments: np.where(np.arange(3) == 1, np.nan, sound.function(*arguments))
    )
    monkeypatch.setattr(Asym2rssPpap, "candidates", {**Asym2rssPpap.candidates, "lumped": spoiled})
    done = workbench.run(campaign(Fault("lumped", "lumped", lambda f: f, {})))
    assert done.code == 1, done
    assert failures(workbench.directory) == {"skew": {"q2"}, "mirrored": {"q2"}}
