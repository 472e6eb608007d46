"""One case compared: a platform that is elsewhere fails or is refused, and each row is judged by its own bound."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from small_campaign import CANDIDATES, CASE, HEAD
from workbench.campaign import compare
from workbench.campaign.cases import Case, resolve_cases
from workbench.campaign.compare import CaseResult, compute_case
from workbench.campaign.evidence import Effort, Evidence
from workbench.campaign.spec import Campaign, load_campaign
from workbench.errors import ModelError

ERRORS_ONLY = Effort(budget=False, drawing=False)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> tuple[Campaign, Case]:
    return read(tmp_path_factory.mktemp("compare") / "small.toml", HEAD + CANDIDATES + CASE)


def read(file: Path, text: str) -> tuple[Campaign, Case]:
    file.write_text(text, encoding="utf-8")
    loaded = load_campaign(file)[0]
    return loaded, resolve_cases(loaded, file)[0]


def computed(campaign: tuple[Campaign, Case], **spoiled: np.ndarray) -> CaseResult:
    return compute_case(campaign[0], dataclasses.replace(campaign[1], **spoiled), ERRORS_ONLY)


def verdicts(result: CaseResult, candidate: str = "distributed") -> list[str]:
    return [row.verdict for row in result.rows if row.candidate == candidate]


@pytest.mark.parametrize(("name", "said"), [("x", "position"), ("xd", "velocity"), ("xdd", "acceleration")])
def test_a_platform_that_moves_otherwise_fails_the_case(campaign: tuple[Campaign, Case], name: str, said: str) -> None:
    right = computed(campaign)
    assert (right.facts["status"], right.facts["message"]) == ("passed", None)
    # ten thousand times rounding, and nothing that a picture would show
    moved = computed(campaign, **{name: (1.0 + 1e-10) * getattr(campaign[1], name)})
    assert moved.facts["status"] == "failed"
    assert moved.facts["message"].startswith(f"platform {said} by 1e-10 of its peak (allowed: ")
    assert [row.verdict for row in moved.rows] == [row.verdict for row in right.rows], "torques are another matter"


def test_a_platform_that_is_no_number_fails_the_case(campaign: tuple[Campaign, Case]) -> None:
    lost = campaign[1].xdd.copy()
    lost[3] = np.nan
    found = computed(campaign, xdd=lost)
    assert found.facts["status"] == "failed"
    assert "platform acceleration by nan" in found.facts["message"]


def test_another_pose_of_the_robot_is_refused(campaign: tuple[Campaign, Case]) -> None:
    case = campaign[1]
    x = case.x.copy()
    x[7] += [0.0, 1e-5, 0.0]
    with pytest.raises(ModelError, match=r"the platform is 1e-05 m from where the closed form puts it at t = 0\.35 s"):
        computed(campaign, x=x)
    # rounding, a thousand times over, is no other pose
    x[7] = case.x[7] + [0.0, 1e-9, 0.0]
    assert computed(campaign, x=x).facts["status"] == "failed"


@pytest.mark.parametrize(("uncertainty", "verdict"), [(0.8e-11, "pass"), (1.2e-11, "undecided")])
def test_rows_are_judged_by_what_the_reference_is_worth(
    campaign: tuple[Campaign, Case], monkeypatch: pytest.MonkeyPatch, uncertainty: float, verdict: str
) -> None:
    evidence = Evidence(spread={"distributed": {"q2": uncertainty}})
    monkeypatch.setattr(compare, "gather_evidence", lambda *_: evidence)
    found = computed(campaign)
    assert verdicts(found) == ["pass", verdict, "pass"]
    assert found.facts["status"] == ("passed" if verdict == "pass" else "failed")


def test_a_bound_of_the_case_counts_in_its_rows(tmp_path: Path) -> None:
    bounds = 'name = "first"\nbounds = { q2 = 0.5 }'
    text = HEAD + CANDIDATES + CASE.replace('name = "first"', bounds)
    # lumped masses against distributed ones are off by percents
    text = text.replace(
        'name = "lumped"\nreference = "distributed"', 'name = "lumped"\nreference = "distributed"\nbound = 1e-10'
    )
    found = compute_case(*read(tmp_path / "small.toml", text), ERRORS_ONLY)
    rows = [row for row in found.rows if (row.candidate, row.reference) == ("lumped", "distributed")]
    assert [(row.joint, row.bound, row.verdict) for row in rows] == [
        ("q1", 1e-10, "fail"),
        ("q2", 0.5, "pass"),
        ("q3", 1e-10, "fail"),
    ]
    assert rows[1].peak_error > 1e-3
