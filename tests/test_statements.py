"""What a run says of itself: one verdict, claims about the robot that they name, nothing lost in silence."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import workbench as wb
from small_campaign import CASE, HEAD, MOTION, Workbench
from stored_pictures import store_pictures
from workbench.campaign.changed import CASE as BY_CASE
from workbench.campaign.changed import Change, sentences
from workbench.campaign.conclusion import EXIT_CODES, CaseOutcome, case_status, conclude, conclude_sweep
from workbench.campaign.evidence import Effort
from workbench.campaign.replacing import lost_evidence, refuse_loss, request_of
from workbench.compare.parameters import ParameterChange, parameter_changes
from workbench.errors import OutputError
from workbench.report import build_report
from workbench.report.manifest import Manifest
from workbench.robots.edit import Change as Edited
from workbench.robots.edit import EditResult

MINE = """
[[candidate]]
name = "mine"
reference = "distributed"
"""

FORMULA = """
import workbench

@workbench.candidate("mine")
def mine(robot, q, qd, qdd):
    return 0.2 * qdd
"""

CLAIM = """
[[claim]]
id = "speed"
text = "the platform is slow"
source = "section 4"
kind = "upper"
claimed = 50.0
unit = "m/s"
measure = { quantity = "peak_speed", case = "first" }
note = "measured by the authors"
"""

FAR = f"""
[[case]]
name = "far"
{MOTION.replace("[[0.06, 4.0, 0.3]]", "[[0.46, 4.0, 0.3]]")}
"""


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    bench = Workbench(tmp_path, monkeypatch, capsys)
    bench.write(FORMULA, "mine.py")
    return bench


@dataclass(frozen=True)
class Row:
    """A row of errors."""

    verdict: str
    case: str = "a"
    candidate: str = "mine"
    joint: str = "q1"
    peak_error: float = 1e-12
    bound: float | None = 1e-10


def row_of(verdict: str | tuple[str, None]) -> Row:
    return Row(verdict) if isinstance(verdict, str) else Row(verdict[0], bound=verdict[1])


DONE = {"a": CaseOutcome("passed")}


@pytest.mark.parametrize(
    ("verdicts", "cases", "status", "said"),
    [
        (["pass", "measured"], DONE, "passed", "1 check in 1 case holds its bound; worst is mine on joint q1"),
        (["pass", "expected-fail"], DONE, "passed", "and 1 declared failures show"),
        (["measured"], DONE, "nothing-judged", "no formula was held against a bound"),
        (["agrees", "differs"], DONE, "nothing-judged", "no formula was held against a bound"),
        ([], {"a": CaseOutcome("passed", ["pass"])}, "passed", "1 check in 1 case holds its bound"),
        ([], {"a": CaseOutcome("failed", ["fail"])}, "failed", "1 of 1 checks of kinematics exceed"),
        (["pass", "fail"], DONE, "failed", "1 of 2 checks exceed"),
        (["unexpected-pass"], DONE, "failed", "1 of 1 declared failures did not happen"),
        (["pass", "undecided"], DONE, "undecided", "the other 1 hold their bounds"),
        (["fail", "undecided"], DONE, "failed", "are undecided"),
        (["pass"], DONE | {"b": CaseOutcome("failed")}, "failed", "1 case failed for another reason (b)"),
        (["pass"], DONE | {"b": CaseOutcome("not-driven")}, "incomplete", "1 of 2 cases could not be computed (b)"),
        (["measured"], DONE | {"b": CaseOutcome("not-driven")}, "incomplete", "held against a bound in the others"),
        ([("fail", None), "pass"], DONE, "failed", "1 row of formulas without a bound broke down (mine)"),
        (["fail"], DONE | {"b": CaseOutcome("not-driven")}, "failed", "could not be computed (b)"),
    ],
)
def test_one_verdict_is_made_of_all_that_happened(
    verdicts: list[str | tuple[str, None]], cases: dict[str, CaseOutcome], status: str, said: str
) -> None:
    found = conclude([row_of(verdict) for verdict in verdicts], cases)
    assert (found.status, said in found.sentence) == (status, True), found
    assert found.passed is (status == "passed")
    assert found.exit_code == EXIT_CODES[status]
    assert (found.exit_code == 0) is (status == "passed")


def test_nothing_judged_has_an_exit_code_of_its_own() -> None:
    assert [code for status, code in EXIT_CODES.items() if status == "nothing-judged"] == [4]
    assert list(EXIT_CODES.values()).count(4) == 1
    assert not {2, 3} & set(EXIT_CODES.values())


def test_a_case_without_a_judgement_did_not_pass() -> None:
    assert case_status("passed", ["measured", "agrees"]) == "nothing-judged"
    assert case_status("passed", ["measured", "pass"]) == "passed"
    assert case_status("failed", ["measured"]) == "failed"


@pytest.mark.parametrize(
    ("counts", "bounded", "status"),
    [
        ({"passed": 3, "filtered": 1}, True, "passed"),
        ({"passed": 3}, False, "nothing-judged"),
        ({"filtered": 3}, True, "nothing-judged"),
        ({"passed": 3, "killed": 1}, True, "incomplete"),
        ({"passed": 3, "failed": 1}, True, "failed"),
    ],
)
def test_a_sweep_is_judged_by_the_same_words(counts: dict[str, int], bounded: bool, status: str) -> None:
    assert conclude_sweep(counts, bounded).status == status


@pytest.mark.usefixtures("undrawn")
def test_nothing_judged_is_said_alike_everywhere(workbench: Workbench, tmp_path: Path) -> None:
    campaign = HEAD + MINE + CASE + CLAIM
    done = workbench.run(campaign, "--quick", "--candidates", "mine.py", "--out", "run")
    sentence = "no formula was held against a bound, so nothing is verified."
    assert done.code == 4
    assert f"NOTHING JUDGED: {sentence}" in done.out
    assert "Measured, nothing judged" in done.out
    assert "mass model" not in done.out
    manifest = json.loads((tmp_path / "run/manifest.json").read_text())
    assert (manifest["status"], manifest["verdict"]) == ("nothing-judged", sentence)
    assert manifest["cases"]["first"]["status"] == "nothing-judged"
    build_report(tmp_path / "run")
    for name, words in (("report.html", "verdict-unjudged"), ("report.md", "NOTHING JUDGED")):
        text = (tmp_path / "run" / name).read_text()
        assert words in text
        assert "Measured, nothing judged" in text
        assert "Modelling error:" not in text
        assert "✓ passed" not in text
    run = wb.load_run(tmp_path / "run")
    assert f"NOTHING JUDGED: {sentence}" in repr(run)
    assert run.conclusion.exit_code == 4
    assert set(run.summary["kind"]) == {"unbounded"}
    # twin: with a bound the same formula fails, and says so
    judged = campaign.replace('"distributed"', '"distributed"\nbound = 1e-10', 1)
    assert workbench.run(judged, "--quick", "--candidates", "mine.py", "--out", "run").code == 1


@pytest.mark.usefixtures("undrawn")
def test_claims_sources_and_rows_follow_the_robot(workbench: Workbench, tmp_path: Path) -> None:
    campaign = HEAD + CLAIM + CASE + '[[candidate]]\nname = "lumped"\nreference = "lumped"\nbound = 1e-10\n'

    def told(*options: str, text: str = campaign) -> tuple[dict[str, Any], dict[str, Any], str]:
        done = workbench.run(text, "--quick", "--replace", "--out", "run", *options)
        assert done.code == 0, done.err
        manifest = json.loads((tmp_path / "run/manifest.json").read_text())
        return manifest["claims"][0], manifest, done.out

    claim, manifest, out = told()
    assert (claim["holds"], claim["not_about"], claim["note"]) == (True, "", "measured by the authors")
    assert manifest["changes"] == {"model": "", "parameters": []}
    assert "Another robot" not in out
    claim, manifest, out = told("--set", "m3=0.9")
    assert (claim["holds"], claim["note"]) == (None, "")
    assert "--set" in claim["not_about"]
    assert claim["measured"] is not None
    source = {one["name"]: one["source"] for one in manifest["parameters"]}
    assert source["m3"] == "--set"
    assert "[Almeida2010]" in source["a1_left"]
    (change,) = manifest["changes"]["parameters"]
    assert (change["name"], change["after"], change["by"], change["cases"]) == ("m3", 0.9, "--set", ["first"])
    assert "1 not about this robot" in out
    assert "--set: m3" in out
    assert (tmp_path / "run/summary.csv").read_text().splitlines()[1].endswith(",changed,")
    build_report(tmp_path / "run")
    for name in ("report.html", "report.md"):
        text = (tmp_path / "run" / name).read_text()
        assert "not about this robot" in text
        assert "--set: m3" in text
        assert "measured by the authors" not in text.partition("claims")[2].partition("worst")[0]
    # twins: the number that it has anyhow changes nothing; a claim that names the changed robot is about it
    same = f"m3={change['before']!r}"
    assert told("--set", same)[0]["holds"] is True
    named = campaign.replace("note =", "parameters = { m3 = 0.9 }\nnote =")
    assert told("--set", "m3=0.9", text=named)[0]["holds"] is True
    assert told(text=named)[0]["holds"] is None
    for text, by in (
        (campaign.replace("[[claim]]", "parameters = { m3 = 0.9 }\n[[claim]]", 1), "campaign parameters"),
        (campaign.replace('name = "first"', 'name = "first"\nparameters = { m3 = 0.9 }'), "case parameters"),
    ):
        claim, manifest, _ = told(text=text)
        assert claim["holds"] is None
        assert by in claim["not_about"]
        assert next(one["source"] for one in manifest["parameters"] if one["name"] == "m3") == by
    edited = Path(workbench.directory / "other.xml")
    assert workbench("model", "set", "asym_2rss_ppap", "m3=0.9", "--out", edited).code == 0
    claim, manifest, _ = told("--model", str(edited))
    assert claim["holds"] is None
    assert next(one["source"] for one in manifest["parameters"] if one["name"] == "m3") == "--model"
    text = campaign.replace('"models/asym_2rss_ppap.xml"', '"other.xml"')
    claim, manifest, _ = told(text=text)
    assert claim["holds"] is None
    assert next(one["source"] for one in manifest["parameters"] if one["name"] == "m3") == "the file"


def test_what_was_changed_is_told_in_few_lines() -> None:
    many = [Change(f"p{i}", "m", 0.1, 0.2, "--set", ("a", "b")) for i in range(12)]
    one = Change("m3", "kg", 0.5, 0.6, "--set", ("a",))
    own = [Change(f"k{i}", "1", 0.5, 0.4, BY_CASE, ("b",)) for i in range(3)]
    lines = sentences("another model, x.xml (--model)", [*many, one, *own], ["a", "b"])
    assert lines[0] == "Another model, x.xml (--model)."
    assert lines[1].startswith("--set: p0 0.1 -> 0.2 m, p1")
    assert lines[1].endswith(" and 4 more.")
    assert lines[2] == "--set in a: m3 0.5 -> 0.6 kg."
    assert lines[3] == "Parameters of their own in b: k0, k1, k2."
    assert sentences("", [], ["a"]) == []
    # what a campaign gives its own cases makes no other robot of the one that it is about
    assert sentences("", own, ["a", "b"]) == []


def asked(**changes: Any) -> dict[str, Any]:
    return request_of(None, {}, (), (), ()) | changes


@pytest.mark.parametrize(
    ("request_", "cases", "candidates", "lost"),
    [
        (asked(), ["a", "b"], ["x"], ""),
        (asked(), ["a"], [], ""),  # the same command: campaign and formulas may have been edited
        (asked(only=["a"]), ["a"], ["x"], "1 case that this one does not have (b)"),
        (asked(candidates=["f.py"]), ["a", "b"], ["x", "f"], ""),
        (asked(candidates=["f.py"]), ["a", "b"], ["f"], "candidates that this one does not have (x)"),
        (asked(model="bad.xml"), ["a", "b"], ["x"], "another robot: model as in the campaign, here bad.xml"),
        (asked(set=["a2=0.3"]), ["a", "b"], ["x"], "another robot: parameters as in the campaign, here a2=0.3"),
    ],
)
def test_only_what_loses_something_is_refused(
    tmp_path: Path, request_: dict[str, Any], cases: list[str], candidates: list[str], lost: str
) -> None:
    old = {"campaign": "c", "cases": {"a": {}, "b": {}}, "request": asked(), "spec": {"candidate": [{"name": "x"}]}}
    (tmp_path / "manifest.json").write_text(json.dumps(old))

    def refused(campaign: str) -> str:
        with contextlib.suppress(OutputError):
            refuse_loss(tmp_path, campaign, request_, cases, candidates)
            return ""
        with pytest.raises(OutputError, match="--replace") as found:
            refuse_loss(tmp_path, campaign, request_, cases, candidates)
        return str(found.value)

    assert (lost in refused("c")) if lost else refused("c") == ""
    assert 'the campaign "c"' in refused("other")


def test_a_larger_run_is_replaced_only_when_asked(workbench: Workbench, tmp_path: Path) -> None:
    campaign = HEAD + MINE + CASE + CASE.replace('"first"', '"second"')
    options = ("--quick", "--candidates", "mine.py", "--out", "run")
    assert workbench.run(campaign, *options).code == 4
    workbench.write(FORMULA.replace("0.2", "0.3"), "mine.py")
    assert workbench.run(campaign, *options).code == 4  # a formula edited, the same command
    before = (tmp_path / "run/manifest.json").read_bytes()
    for other in (("--only", "first"), ("--set", "m3=0.9")):
        done = workbench.run(campaign, *options, *other)
        assert done.code == 2
        (line,) = done.complaint
        assert "--replace" in line
        assert (tmp_path / "run/manifest.json").read_bytes() == before
    assert workbench.run(campaign, *options, "--only", "first", "--replace").code == 4
    assert list(json.loads((tmp_path / "run/manifest.json").read_text())["cases"]) == ["first"]
    assert workbench.run(campaign, *options).code == 4  # more cases of the same robot lose nothing


def test_a_run_of_less_evidence_takes_the_place_of_more_only_when_asked(workbench: Workbench, tmp_path: Path) -> None:
    campaign = HEAD + CASE + '[[candidate]]\nname = "lumped"\nreference = "lumped"\nbound = 1e-10\n'
    options = ("--no-pictures", "--out", "run")
    workbench.gather_evidence()
    assert workbench.run(campaign, *options).code == 0
    before = (tmp_path / "run/manifest.json").read_bytes()
    done = workbench.run(campaign, "--quick", *options)
    assert done.code == 2
    (line,) = done.complaint
    assert "run: holds an earlier run with its error budget (power balance, forward replay), which this one" in line
    assert "--replace" in line
    assert (tmp_path / "run/manifest.json").read_bytes() == before
    assert workbench.run(campaign, *options).code == 0  # as much
    assert workbench.run(campaign, "--quick", "--replace", *options).code == 0
    assert json.loads((tmp_path / "run/manifest.json").read_text())["budget"] is False
    assert workbench.run(campaign, "--quick", *options).code == 0
    assert workbench.run(campaign, *options).code == 0  # more evidence loses nothing


def test_pictures_are_lost_only_when_asked(tmp_path: Path) -> None:
    (tmp_path / "manifest.json").write_text(json.dumps({"campaign": "c", "cases": {"a": {}}, "request": asked()}))
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / "pictures.json").write_text("{}")  # says why there are none
    refuse_loss(tmp_path, "c", asked(), ["a"], [], drawn=False)
    (tmp_path / "pictures" / "film.webp").write_bytes(b"RIFF")
    with pytest.raises(OutputError, match="with pictures of the robot, which this one does not draw; --replace"):
        refuse_loss(tmp_path, "c", asked(), ["a"], [], drawn=False)
    refuse_loss(tmp_path, "c", asked(), ["a"], [], drawn=True)


def test_a_run_without_pictures_keeps_the_earlier_ones_pictures(workbench: Workbench, tmp_path: Path) -> None:
    campaign = HEAD + CASE + '[[candidate]]\nname = "lumped"\nreference = "lumped"\nbound = 1e-10\n'
    options = ("--quick", "--no-pictures", "--out", "run")
    assert workbench.run(campaign, *options).code == 0
    assert workbench.run(campaign, *options).code == 0  # nothing is lost
    store_pictures(tmp_path / "run", case="first")
    done = workbench.run(campaign, *options)
    assert done.code == 2
    assert "with pictures of the robot" in done.complaint[0]
    assert (tmp_path / "run/pictures/film.webp").is_file()
    assert workbench.run(campaign, "--replace", *options).code == 0
    assert not (tmp_path / "run/pictures").exists()


@pytest.mark.parametrize(
    ("old", "lost"),
    [
        ({"budget": True, "engines": ["mujoco"]}, "error budget"),
        ({"budget": False, "engines": ["mujoco", "pinocchio"]}, "a further engine (pinocchio)"),
        ({"budget": False, "engines": ["mujoco"]}, ""),
        ({}, ""),
        ({"budget": "yes", "engines": 3}, ""),
    ],
)
def test_what_of_evidence_would_be_lost(old: dict[str, Any], lost: str) -> None:
    said = "; ".join(lost_evidence(old, Effort(budget=False)))
    assert (lost in said) if lost else said == ""
    assert not lost_evidence(old, Effort(("mujoco", "pinocchio")))


def test_a_dry_run_goes_on_past_cases_that_cannot_be_driven_when_asked(workbench: Workbench, tmp_path: Path) -> None:
    campaign = HEAD + FAR + CASE + '[[candidate]]\nname = "lumped"\nreference = "lumped"\nbound = 1e-10\n'
    assert workbench.run(campaign, "--quick", "--dry-run").code == 2
    done = workbench.run(campaign, "--quick", "--dry-run", "--keep-going")
    assert done.code == 0
    assert "1 cases, 21 samples" in done.out
    assert 'cannot be driven, left out: small.toml: case "far"' in " ".join(done.out.split())
    assert [path.name for path in tmp_path.glob("run*")] == []
    assert (
        workbench.run(
            HEAD + FAR + '[[candidate]]\nname = "lumped"\nreference = "lumped"\n', "--dry-run", "--keep-going"
        ).code
        == 2
    )


def test_cases_that_cannot_be_driven_are_left_out_with_the_nearest_that_can(
    workbench: Workbench, tmp_path: Path
) -> None:
    campaign = HEAD + FAR + CASE + '[[candidate]]\nname = "lumped"\nreference = "lumped"\nbound = 1e-10\n'
    done = workbench.run(campaign, "--quick", "--out", "run")
    assert done.code == 2
    assert 'case "far"' in done.err
    assert not (tmp_path / "run").exists()
    done = workbench.run(campaign, "--quick", "--out", "run", "--keep-going")
    assert done.code == 1
    assert "INCOMPLETE: 1 of 2 cases could not be computed (far)" in done.out
    assert "cannot be driven" in done.out
    manifest = json.loads((tmp_path / "run/manifest.json").read_text())
    assert list(manifest["cases"]) == ["far", "first"]
    far = manifest["cases"]["far"]
    assert far["status"] == "not-driven"
    robot = wb.load_robot("asym_2rss_ppap")
    robot.forward_kinematics([far["nearest_q"]])  # it can be driven
    assert "straight way from the home pose ends at q1" in far["message"]
    build_report(tmp_path / "run")
    assert "INCOMPLETE" in (tmp_path / "run/report.md").read_text()
    assert "CANNOT BE DRIVEN" in (tmp_path / "run/report.html").read_text()
    # none at all is bad input, as without the option
    assert workbench.run(campaign, "--quick", "--out", "none", "--keep-going", "--only", "far").code == 2


def manifest_of(cases: dict[str, dict[str, float]], **more: Any) -> Manifest:
    values = {"a1_left": 0.2, "a1_right": 0.2, "m3": 0.5} | more.pop("values", {})
    return Manifest.model_validate(
        {
            "format": 1, "campaign": "c", "model": {"file": "m", "sha256": "", "mechanism": "r"}, "joints": [],
            "coordinate_units": [], "force_units": [], "status": "passed", "candidates": {},
            "parameters": [{"name": name, "value": value} for name, value in values.items()],
            "cases": {name: {"status": "passed", "parameters": given} for name, given in cases.items()},
        } | more
    )  # fmt: skip


def changed(*parameters: tuple[str, float, float, list[str]]) -> dict[str, Any]:
    keys = ("name", "before", "after", "cases")
    return {"request": {}, "changes": {"parameters": [dict(zip(keys, p, strict=True)) for p in parameters]}}


def test_a_change_of_all_cases_is_compared_once() -> None:
    names = [f"c{i}" for i in range(48)]
    old = manifest_of({name: {"a1": 0.21} for name in names}, values={"a1_left": 0.21, "a1_right": 0.21})
    limbs = {"a1_left": 0.23, "a1_right": 0.23}
    new = manifest_of(dict.fromkeys(names, limbs), values=limbs)
    assert list(parameter_changes(old, new)) == [ParameterChange(("a1_left", "a1_right"), 0.21, 0.23)]
    assert list(parameter_changes(old, old)) == []
    # runs that say what was changed: one case apart
    plain = manifest_of({name: {} for name in names}, **changed())
    apart = manifest_of({name: {} for name in names}, **changed(("m3", 0.5, 0.9, ["c7"])))
    (one,) = parameter_changes(plain, apart)
    assert (one.names, one.before, one.after) == (("m3",), 0.5, 0.9)
    assert "c7" in one.where


@pytest.mark.parametrize(
    ("before", "after", "warned"),
    [(0.23, 230.0, "1000 times"), (0.3, 0.01, "1/30 of"), (0.3, 0.4, ""), (2.0, 0.3, ""), (1e-3, 1.2e-3, "")],
)
def test_edits_warn_of_absurd_sizes_with_a_figure(before: float, after: float, warned: str) -> None:
    result = EditResult(Path("a"), Path("b"), (Edited("a1", "m", before, after),), ())
    said = " ".join(result.warnings)
    assert warned in said
    assert bool(said) is bool(warned)


def test_model_set_refuses_other_assemblies_and_names_stale_comments(workbench: Workbench, tmp_path: Path) -> None:
    done = workbench("model", "set", "asym_2rss_ppap", "a2=0.01", "--out", "bad.xml")
    assert done.code == 2
    assert "cannot be assembled at home" in done.err
    assert not (tmp_path / "bad.xml").exists()
    done = workbench("model", "set", "asym_2rss_ppap", "a1=0.22", "--out", "good.xml")
    assert done.code == 0
    assert "still name a number as it was before" in done.out
    assert "warning" not in done.out


@pytest.mark.parametrize(
    "changes", [{}, {"a2": 0.12, "L": 0.11, "l": 0.1, "a1": 0.05}, {"a1": 0.6, "a2": 1.2, "a5": 1.1}, {"a1": 0.05}]
)
def test_mobility_is_counted_for_any_lengths(changes: dict[str, float]) -> None:
    robot = wb.load_robot("asym_2rss_ppap").with_parameters(**changes)
    assert robot.mobility_count()["mobility M"] == 3


def test_show_gives_no_paper_as_the_source_of_an_edited_number(tmp_path: Path, edit: Callable[..., Any]) -> None:
    from workbench.robots.show import show_parameters

    edit("asym_2rss_ppap", ["m3=0.9"], out=tmp_path / "edited.xml")
    rows = {row.name: row.source for row in show_parameters(tmp_path / "edited.xml")}
    assert rows["m3"] == "the file"
    assert rows["a1_left"].startswith("[Almeida2010]")


@pytest.fixture
def edit() -> Callable[..., Any]:
    from workbench.robots.edit import edit_file

    return edit_file
