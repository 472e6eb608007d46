"""Is it good enough: the wanted accuracy of a campaign, answered by joint and case."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from types import SimpleNamespace

import pytest

from small_campaign import CANDIDATES, CASES, HEAD, SMALL, Workbench
from sweep_campaign import SWEEP
from workbench.campaign.good import NO, UNDECIDED, YES, answers, good_enough
from workbench.report.attention import attention
from workbench.report.build import render_markdown
from workbench.report.load import load_run
from workbench.report.sections import build_sections


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


def row(error: float, kind: str = "modelling", uncertainty: float = math.nan, **given: str) -> SimpleNamespace:
    named = {"case": "a", "candidate": "lumped", "reference": "distributed", "joint": "q1"} | given
    return SimpleNamespace(peak_error=error, kind=kind, uncertainty=uncertainty, worst_time_s=0.5, **named)


@pytest.mark.parametrize(
    ("one", "answer"),
    [
        (row(0.0199), YES),
        (row(0.02), YES),
        (row(0.0201), NO),
        (row(math.inf), NO),
        (row(math.nan), NO),
        (row(0.5, "unbounded"), NO),
        (row(0.5, "verification"), ""),
        (row(0.5, "expected-failure"), ""),
        (row(0.5, "contrast"), ""),
        (row(0.019, uncertainty=0.0021), UNDECIDED),
        (row(0.019, uncertainty=0.0019), YES),
        (row(0.03, uncertainty=0.0029), NO),
        (row(0.03, uncertainty=0.0031), UNDECIDED),
    ],
)
def test_an_answer_is_yes_no_or_undecided(one: SimpleNamespace, answer: str) -> None:
    assert good_enough(one, 0.02) == answer
    assert good_enough(one, None) == ""


def test_one_joint_of_one_case_decides_and_is_named() -> None:
    rows = [
        row(0.01),
        row(0.05, joint="q2"),
        row(0.031, joint="q3"),
        row(0.01, case="b"),
        row(0.002, case="b", joint="q2"),
    ]
    (found,) = answers(rows, 0.02)
    assert found.answer == NO
    assert found.sentence == (
        "Is lumped good enough, within 2 % of distributed on every joint? No: 5 % on q2 in case a at 0.5 s; no in a"
        " (q2, q3); yes in b."
    )
    (found,) = answers(rows, 0.05)
    assert found.answer == YES
    assert "Yes: the largest error is 5 % on q2 in case a" in found.sentence
    (found,) = answers([row(0.01), row(0.019, case="b", uncertainty=0.01)], 0.02)
    assert found.answer == UNDECIDED
    assert "too large in b" in found.sentence
    assert answers(rows, None) == []


def test_the_answer_stands_in_terminal_report_and_summary_and_judges_nothing(workbench: Workbench) -> None:
    asked = SMALL.replace("[[candidate]]", "good = 0.015\n\n[[candidate]]", 1)
    done = workbench.run(asked, "--quick", "--out", "a")
    assert done.code == 0
    flat = " ".join(done.out.split())
    assert "Is lumped good enough, within 1.5 % of distributed on every joint? No: 2.21 % on q1 in case first" in flat
    assert "no in first (q1, q2); yes in second." in flat
    with Path("a/summary.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    said = {(r["case"], r["joint"]): r["good_enough"] for r in rows if r["kind"] == "modelling"}
    for one in rows:
        expected = "" if one["kind"] != "modelling" else "yes" if float(one["peak_error"]) <= 0.015 else "no"
        assert one["good_enough"] == expected
    assert set(said.values()) == {"yes", "no"}
    assert json.loads(Path("a/manifest.json").read_text())["good"] == 0.015
    run = load_run(Path("a"))
    assert len(attention(run)) == 1
    text = render_markdown(run, build_sections(run))
    assert text.index("Needs attention") < text.index("## Is it good enough") < text.index("## Worst errors first")
    assert "**✗ 2.21 %**" in text
    assert run.manifest.status == "passed"


def test_the_command_line_asks_over_the_campaign(workbench: Workbench) -> None:
    asked = SMALL.replace("[[candidate]]", "good = 0.015\n\n[[candidate]]", 1)
    done = workbench.run(asked, "--quick", "--out", "a", "--good", "0.05")
    assert "within 5 % of distributed on every joint? Yes" in " ".join(done.out.split())
    plain = workbench.run(SMALL, "--quick", "--out", "b")
    assert "good enough" not in plain.out
    run = load_run(Path("b"))
    assert "Is it good enough" not in render_markdown(run, build_sections(run))
    dry = workbench.run(SMALL, "--dry-run", "--good", "0.05")
    assert "good: 5 % is asked of lumped against distributed" in dry.out


BOUNDED = CANDIDATES.rpartition("[[candidate]]")[0]


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        (SMALL, ("--good", "2"), "--good 2: should be a fraction between 0 and 1; 0.02 is 2 %"),
        (SMALL, ("--good", "-0.1"), "--good -0.1: should be a fraction"),
        (SMALL, ("--good", "nan"), "--good nan: should be a fraction"),
        (HEAD + "good = 2\n" + CANDIDATES + CASES, (), "good = 2: should be a fraction between 0 and 1; 0.02 is 2 %"),
        (HEAD + "good = 0.0\n" + CANDIDATES + CASES, (), "good = 0.0: should be greater than 0"),
        (HEAD + "good = [0.02]\n" + CANDIDATES + CASES, (), "good: should be a valid number"),
        (HEAD + "good = 0.02\n" + BOUNDED + CASES, (), "good = 0.02: no formula without a bound"),
        (SWEEP, ("--good", "0.02"), "a sweep counts its designs by sweep.good"),
        ("good = 0.02\n" + SWEEP, (), "a campaign with a sweep has sweep.good in place of good"),
    ],
)
@pytest.mark.parametrize("dry", [(), ("--dry-run",)])
def test_an_accuracy_that_is_none_is_refused_before_anything_is_computed(
    workbench: Workbench, text: str, options: tuple[str, ...], said: str, dry: tuple[str, ...]
) -> None:
    done = workbench.run(text, *options, *dry, "--out", "a")
    assert done.code == 2
    assert said in done.err
    assert done.err.count("\n") == 1
    assert not Path("a").exists()
