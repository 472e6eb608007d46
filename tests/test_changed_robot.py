"""docs/changed-robot.md: its two commands answer a newcomer's question, and print what the page shows."""

from __future__ import annotations

import json
import re
import shlex
import tomllib
from pathlib import Path

import pytest

from small_campaign import Workbench
from workbench.campaign.margins import margins_of_facts, shortfalls
from workbench.robots.actuators import ActuatorSpec


def blocks(page: str, kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)


def flat(text: str) -> str:
    return " ".join(text.split())


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


@pytest.mark.slow
def test_two_commands_answer_without_a_false_word_about_the_paper(workbench: Workbench, repository: Path) -> None:
    page = (repository / "docs" / "changed-robot.md").read_text(encoding="utf-8")
    run, compare = (shlex.split(line)[1:] for line in blocks(page, "")[0].splitlines())
    done = workbench(*run, "--quick")
    assert done.code == 1  # incomplete: half of the motions are out of this robot's reach
    for line in blocks(page, "text run")[0].splitlines():
        assert flat(line) in flat(done.out), line
    manifest = json.loads(Path("mine/manifest.json").read_text())
    assert {claim["holds"] for claim in manifest["claims"]} == {None}
    assert all(claim["not_about"] for claim in manifest["claims"])
    found = workbench(*compare)
    assert found.code == 0
    for line in blocks(page, "text compare")[0].splitlines():
        assert flat(line) in flat(found.out), line
    words = flat(re.sub(r"<[^>]*>", " ", Path("mine.html").read_text(encoding="utf-8")))
    for said in ("Another robot than the one that the campaign is about", "Claims about that one are not judged"):
        assert said in words
    claims = re.findall(r"claim (\S+) (holds|does not hold) (not about this robot)?", words)
    assert len(claims) == len(manifest["claims"])
    assert all(judged for _, _, judged in claims)
    # the motor of the page's last paragraph
    manifest["actuators"] = {
        joint: ActuatorSpec.model_validate(limits).model_dump()
        for joint, limits in tomllib.loads(blocks(page, "toml")[0])["actuators"].items()
    }
    for sentence in re.findall(r"`(q\d: its actuator is too small.*?)`", page):
        assert sentence in "\n".join(shortfalls(margins_of_facts(manifest)))


def test_the_page_of_the_question_is_linked_and_its_limits_are_such(repository: Path) -> None:
    page = (repository / "docs" / "changed-robot.md").read_text(encoding="utf-8")
    assert "changed-robot.md" in (repository / "README.md").read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)", page):
        assert (repository / "docs" / target).exists(), target
    for limits in tomllib.loads(blocks(page, "toml")[0])["actuators"].values():
        ActuatorSpec.model_validate(limits)
