"""Pages of the site that are made: nothing of a schema or of a command is left out, and every page has its place."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pydantic import BaseModel

from website import command_line, gallery, links, pages_of, schema_pages, stage
from workbench.campaign.spec import Campaign
from workbench.robots.robot_file import RobotSpec


def schemas(root: type[BaseModel]) -> list[type[BaseModel]]:
    return list(schema_pages.tables(root))


@pytest.mark.parametrize("root", [Campaign, RobotSpec])
def test_every_key_of_a_file_has_a_meaning(root: type[BaseModel]) -> None:
    """The string below a field of the schema; it is what the site's table says."""
    silent = [
        f"{model.__name__}.{key}"
        for model in schemas(root)
        for key in model.model_fields
        if not schema_pages.field_docstrings(model).get(key)
    ]
    assert silent == []


def test_a_key_without_a_meaning_is_seen() -> None:
    class Silent(BaseModel):
        said: int
        """what it is"""
        silent: int

    assert schema_pages.field_docstrings(Silent) == {"said": "what it is"}


@pytest.mark.parametrize(
    ("root", "page"), [(Campaign, schema_pages.campaign_page), (RobotSpec, schema_pages.robot_page)]
)
def test_every_key_stands_in_the_table_of_its_schema(root: type[BaseModel], page: object, repository: Path) -> None:
    text = page(repository)  # type: ignore[operator]
    sections = re.split(r"^## ", text, flags=re.MULTILINE)[1:]
    assert len(sections) == len(schemas(root)) > 4
    for section, model in zip(sections, schemas(root), strict=True):
        assert re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE) == list(model.model_fields)


def test_limits_and_defaults_are_said(repository: Path) -> None:
    text = schema_pages.campaign_page(repository)
    assert "| `rate` | number |  | or samples per second |" in text
    assert re.search(r"^\| `bound` \| number, > 0, <= 1e\+06 \|", text, re.MULTILINE)
    assert re.search(r"^\| `name` \| text \| \*\*required\*\* \| names the run directory", text, re.MULTILINE)
    assert re.search(
        r"^\| `external_force` \| list of number, exactly 3 \| `\[0\.0, 0\.0, 0\.0\]` \|", text, re.MULTILINE
    )
    assert '`"linear"` or `"log"` | `"linear"` |' in text


def test_every_command_and_option_stands_on_the_page(repository: Path) -> None:
    text = command_line.page(repository)
    for heading in ("## workbench", "### workbench run", "### workbench model set"):
        assert re.search(rf"^{heading}$", text, re.MULTILINE)
    assert "`--candidates <path>" in text or "`--candidates" in text
    assert "| 130 |" in text


def test_every_page_has_one_place(repository: Path) -> None:
    pages = (*pages_of.repository_pages(repository), *stage.MADE)
    placed = [page for section in pages_of.sections(repository / "website", pages) for page in section.pages]
    assert len(placed) == len(set(placed))
    assert {page for page in pages if not page.endswith("/README")} == {
        page for page in placed if not page.endswith("/README")
    }
    assert not {page for page in placed if page not in pages}


def test_a_new_page_of_docs_appears_by_itself(repository: Path) -> None:
    pages = (*pages_of.repository_pages(repository), *stage.MADE, "docs/new")
    (how_to,) = [s for s in pages_of.sections(repository / "website", pages) if s.title == "How to"]
    assert how_to.pages[-1] == "docs/new"


def test_every_published_report_has_a_card(repository: Path) -> None:
    text = gallery.page(repository)
    for report in (repository / "reports" / "published").glob("*/report.html"):
        assert f'href="reports/published/{report.parent.name}/report.html"' in text
    assert len(re.findall(r"<em>[A-Z]\w+.*?: ", text)) == text.count('class="card"') > 3


def small(tmp_path: Path, page: str) -> Path:
    """A repository of one page beside what pages are made from."""
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "one.md").write_text(page, encoding="utf-8")
    (tmp_path / "docs" / "images").mkdir()
    for name in ("references.md", "images/two_families.png"):  # the first page links to them
        (tmp_path / "docs" / name).write_text("# B\n", encoding="utf-8")
    (tmp_path / "src").mkdir()
    readme = (Path(__file__).resolve().parents[1] / "README.md").read_text(encoding="utf-8")
    (tmp_path / "README.md").write_text(re.sub(r"\]\([^)]*\)", "]", readme), encoding="utf-8")
    (tmp_path / "reports" / "published" / "a").mkdir(parents=True)
    (tmp_path / "reports" / "published" / "a" / "report.html").write_text("<p>")
    return tmp_path


def test_links_are_followed_and_dead_ones_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage, "MADE", {"reference/command-line": command_line.page})
    page = (
        "# A\n\n[r](../reports/published/a/report.html) [x](../src) [home](../README.md)\n\n```\n[no](gone.md)\n```\n"
    )
    stage.stage(small(tmp_path, page), tmp_path / "out", tmp_path / "extra")
    text = (tmp_path / "out" / "docs" / "one.md").read_text(encoding="utf-8")
    assert '<a href="../reports/published/a/report.html">r</a> x [home](../index.md)' in text
    assert "[no](gone.md)" in text
    assert (tmp_path / "extra" / "reports" / "published" / "a" / "report.html").exists()
    (tmp_path / "docs" / "one.md").write_text("# A\n\n[no](gone.md)\n", encoding="utf-8")
    with (tmp_path / "README.md").open("a", encoding="utf-8") as readme:
        readme.write("[no](docs/gone.md#a)\n")
    with pytest.raises(
        stage.DeadLinkError, match=r"README\.md: dead link docs/gone\.md\ndocs/one\.md: dead link gone\.md"
    ):
        stage.stage(tmp_path, tmp_path / "out", tmp_path / "extra")


def test_faults_of_a_built_site_are_found(tmp_path: Path) -> None:
    (tmp_path / "b.html").write_text('<h1 id="top">B</h1>', encoding="utf-8")
    (tmp_path / "s.css").write_text("a { background: url(https://x.org/a.png) }", encoding="utf-8")
    (tmp_path / "a.html").write_text(
        '<a href="b.html#top">1</a><a href="b.html#no">2</a><a href="c.html">3</a><a href="https://x.org">4</a>'
        '<img src="https://x.org/p.png"><script src="data:,"></script>',
        encoding="utf-8",
    )
    assert links.findings(tmp_path) == [
        "a.html: dead anchor b.html#no",
        "a.html: dead link c.html",
        "a.html: loads https://x.org/p.png",
        "s.css: loads https://x.org/a.png",
    ]
