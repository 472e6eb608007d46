"""docs/robots.md names every key of a robot file and every kind of place, and its example is a robot."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from pydantic import BaseModel

import workbench as wb
from workbench.library.card import Card, MobilitySpec
from workbench.robots.actuators import ActuatorSpec
from workbench.robots.places import KINDS
from workbench.robots.robot_file import BarSpec, ParameterSpec, PlatformSpec, RobotSpec

SECTIONS: dict[str, type[BaseModel]] = {
    "## The file": RobotSpec,
    "### `[platform]`": PlatformSpec,
    "### `[parameters.NAME]`": ParameterSpec,
    "### `[[bars]]`": BarSpec,
    "### `[actuators.JOINT]`": ActuatorSpec,
    "## The card of a robot of the library": Card,
    "### `[mobility]`": MobilitySpec,
}


@pytest.fixture(scope="module")
def page(repository: Path) -> str:
    return (repository / "docs" / "robots.md").read_text(encoding="utf-8")


def rows(page: str, heading: str) -> list[str]:
    """First cells of the table below a heading."""
    assert page.count(f"\n{heading}\n") == 1, heading
    section = re.split(r"\n##", page.split(f"\n{heading}\n")[1])[0]
    return re.findall(r"^\| `([^`]+)` \|", section, re.MULTILINE)


@pytest.mark.parametrize("heading", SECTIONS)
def test_every_key_stands_in_its_table_and_no_other(page: str, heading: str) -> None:
    assert sorted(rows(page, heading)) == sorted(SECTIONS[heading].model_fields)


def test_every_kind_of_place_stands_in_the_table_with_its_units(page: str) -> None:
    assert sorted(rows(page, "## Places")) == sorted(KINDS)
    for name, kind in KINDS.items():
        if kind.unit:
            assert re.search(rf"^\| `{name}` \|.*\| {re.escape(kind.unit.replace('|', ' or '))} \|", page, re.MULTILINE)


def test_a_key_that_is_missing_is_seen(page: str) -> None:
    spoiled = page.replace("| `follows` |", "| `folows` |")
    heading = "### `[parameters.NAME]`"
    assert sorted(rows(spoiled, heading)) != sorted(SECTIONS[heading].model_fields)


def test_the_example_is_a_robot(page: str, repository: Path, tmp_path: Path) -> None:
    shutil.copytree(repository / "examples" / "fivebar", tmp_path / "fivebar")
    (tmp_path / "fivebar" / "robot.toml").write_text(
        page.split("```toml robot.toml\n")[1].split("```", maxsplit=1)[0], encoding="utf-8"
    )
    robot = wb.load_robot(tmp_path / "fivebar", m=0.5, a=0.21)
    assert robot.mass_models == ("distributed", "lumped")
    assert (robot.values["m1"], robot.values["m2"], robot.values["a"]) == (0.5, 0.5, 0.21)


def test_the_python_example_prints_what_it_says(
    page: str, repository: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code = page.split("## From Python\n\n```python\n")[1].split("```", maxsplit=1)[0]
    monkeypatch.chdir(repository)
    exec(compile(code, "robots.md", "exec"), {})
    expected = [line.removeprefix("# prints ") for line in code.splitlines() if line.startswith("# prints ")]
    assert capsys.readouterr().out.splitlines() == expected != []


def test_links_of_the_page_lead_somewhere(page: str, repository: Path) -> None:
    targets = re.findall(r"\]\(([^)]+)\)", page)
    assert len(targets) > 10
    for target in targets:
        file, _, anchor = target.partition("#")
        path = repository / "docs" / file if file else repository / "docs" / "robots.md"
        assert path.exists(), target
        if anchor:
            titles = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
            slugs = {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}
            assert anchor in slugs, target
