"""The paper has the form that the Journal of Open Source Software asks for, and what else a citation needs agrees."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import yaml

from workbench._version import __version__

SECTIONS = (
    "Summary", "Statement of need", "State of the field", "Software design", "Research impact statement",
    "AI usage disclosure", "Acknowledgements", "References",
)  # fmt: skip
WORDS = range(750, 1751)


def faults(paper: str, bibliography: str) -> list[str]:
    """What keeps a paper from the journal's form."""
    _, head, text = paper.split("---\n", 2)
    found = [
        f"no {key}"
        for key in ("title", "tags", "authors", "affiliations", "date", "bibliography")
        if key not in yaml.safe_load(head)
    ]
    if tuple(re.findall(r"^# (.+)$", text, re.MULTILINE)) != SECTIONS:
        found.append("sections")
    if (count := len(text.split())) not in WORDS:
        found.append(f"{count} words")
    cited, entries = (
        set(re.findall(r"@([A-Za-z]+\d*)", text)),
        set(re.findall(r"^@\w+\{([^,]+),", bibliography, re.MULTILINE)),
    )
    return found + [f"{key} only on one side" for key in sorted(cited ^ entries)]


@pytest.fixture
def paper(repository: Path) -> tuple[str, str]:
    return tuple((repository / "paper" / name).read_text(encoding="utf-8") for name in ("paper.md", "paper.bib"))


def test_the_paper_has_the_journals_form(paper: tuple[str, str]) -> None:
    assert faults(*paper) == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("# State of the field", "## State of the field", "sections"),
        ("[@Merlet2006]", "", "Merlet2006 only on one side"),
        ("@Lam2015", "@Lam2016", "Lam2016 only on one side"),
        ("tags:", "labels:", "no tags"),
        ("# References\n", f"# References\n{'word ' * 700}", "words"),
    ],
)
def test_a_paper_of_another_form_is_seen(paper: tuple[str, str], old: str, new: str, said: str) -> None:
    assert paper[0].count(old) >= 1
    assert any(said in fault for fault in faults(paper[0].replace(old, new), paper[1]))


def test_one_version_stands_everywhere(repository: Path) -> None:
    citation = yaml.safe_load((repository / "CITATION.cff").read_text(encoding="utf-8"))
    archive = json.loads((repository / ".zenodo.json").read_text(encoding="utf-8"))
    assert {citation["version"], archive["version"]} == {__version__}
    changes = (repository / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (\d+\.\d+\.\d+)", changes, re.MULTILINE)[0] == __version__
    assert citation["title"] == archive["title"]
    assert citation["license"] == archive["license"]


def test_every_template_of_an_issue_is_a_form(repository: Path) -> None:
    templates = sorted((repository / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))
    assert {path.stem for path in templates} == {"config", "fault", "wrong_number", "robot", "question"}
    for path in templates:
        form = yaml.safe_load(path.read_text(encoding="utf-8"))
        if path.stem != "config":
            assert form["name"]
            assert form["description"]
            assert {field["type"] for field in form["body"]} <= {"textarea", "input", "dropdown"}
            assert all(isinstance(option, str) for f in form["body"] for option in f["attributes"].get("options", []))
