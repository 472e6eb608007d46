"""Every command that a page shows exists, with its options; what can be copied runs here or in a test that is named."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
import typer.main

from documented import PROGRAMS, Command, commands, pages
from talking_process import TalkingProcess
from workbench.cli import app

REPOSITORY = Path(__file__).resolve().parents[1]
SHOWN = [command for page in pages(REPOSITORY) for command in commands(page, REPOSITORY)]

WALKED = ("docs/tutorial.md", "docs/start.md")
"""Pages that are walked from their beginning to their end: test_tutorial.py, and below."""

ELSEWHERE = {
    r"make (setup|test|test-slow|test-browser|run|docs)( |$)": "what the continuous integration does",
    r"make (mutants|bench|reports|format)( |$)": "by hand: hours, or they change files; test_mutants.py plans mutants",
    r"python benchmarks/": "by hand: they measure this machine",
    r"workbench run --robots all": "make library does, and keeps what it finds; test_library.py runs one robot",
    r"pip install ": "test_distribution.py installs the wheel and the source distribution",
    r"workbench run \S+ --scheduler tcp://head": "test_sweep_run.py, on a cluster of this machine",
    r"workbench run campaigns/(almeida_2010_control|control_4rprp)": "minutes; test_control_study.py has small ones",
    r"dask ssh ": "needs machines to log in to",
    r"workbench model view ": "test_rendering.py, on a virtual screen",
    r"workbench watch ": "test_watch.py, with saved files",
    r"workbench new DIR --from robot.urdf ": "test_urdf.py, with robots that it writes",
}
"""Commands in blocks that are not run here -> why."""

PATIENCE = 300
"""seconds that any command may take before the test fails instead of hanging"""


@cache
def root() -> typer.main.click.Command:
    return typer.main.get_command(app)


def fault(command: Command) -> str:
    """What is wrong with a command as it stands on the page; empty where nothing is."""
    words = [word for word in command.words if not re.match(r"[A-Z_]+=", word)]
    if words[:3] == ["python", "-m", "workbench"] or words[:4] == ["python", "-P", "-m", "workbench"]:
        return ""
    if words[0] == "make":
        targets = set(re.findall(r"^([a-z-]+):", (REPOSITORY / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
        return "".join(f"no target {word}" for word in words[1:] if not word.startswith("-") and word not in targets)
    if words[0] == "python":
        return "".join(f"no file {word}" for word in words[1:2] if "/" in word and not (REPOSITORY / word).is_file())
    return fault_of_options(words[1:], command) if words[0] == "workbench" else ""


def fault_of_options(words: list[str], command: Command) -> str:
    found = root()
    while words and hasattr(found, "commands") and not words[0].startswith("-") and not words[0].isupper():
        names = words.pop(0).split("|")
        if unknown := [name for name in names if name not in found.commands]:
            return f"no command {unknown[0]}"
        found = found.commands[names[0]]
    valid = {option for parameter in found.params for option in parameter.opts} | {"--help"}
    unknown = [option for option in command.options if option not in valid]
    return f"{found.name} has no option {unknown[0]}" if unknown else ""


def test_every_command_and_option_exists() -> None:
    assert len(SHOWN) > 150
    assert [(c.page, c.line, c.text, said) for c in SHOWN if (said := fault(c))] == []


@pytest.mark.parametrize(
    "text",
    [
        "workbench rum almeida_2010",
        "workbench run almeida_2010 --quik",
        "workbench model edit a.xml",
        "make tests",
        "python benchmarks/gone.py",
    ],
)
def test_a_command_that_does_not_exist_is_seen(text: str) -> None:
    assert fault(Command("", 1, text, True))


def where_run(command: Command) -> str:
    """``walked``, ``here``, or where and why not here."""
    if command.page in WALKED and command.words[0] != "pip":
        return "walked"
    found = [why for pattern, why in ELSEWHERE.items() if re.match(pattern, command.text)]
    if found or command.synopsis:
        return (found or ["a synopsis"])[0]
    return "here"


RUN_HERE = [command for command in SHOWN if command.block and where_run(command) == "here"]
STUDIO = [command for command in RUN_HERE if command.words[1] == "studio"]
ONE_AFTER_ANOTHER = sorted({command.page for command in RUN_HERE} - {"docs/studio.md"})


def test_commands_are_found_in_blocks_and_within_lines(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "Say `workbench status RUN`.\n\n    workbench run a.toml --quick   what it does\n\n"
        "```\n$ workbench docs  # a list\n```\n"
        "```python\nworkbench run\n```\n",
        encoding="utf-8",
    )
    found = [(c.line, c.text, c.block, c.synopsis) for c in commands(page, tmp_path)]
    assert found == [
        (1, "workbench status RUN", False, True),
        (3, "workbench run a.toml --quick", True, False),
        (6, "workbench docs", True, False),
    ]
    assert {command.words[0] for command in SHOWN} <= {*PROGRAMS, "WORKBENCH_TRACEBACK=1"}


def test_every_reason_is_needed() -> None:
    for pattern in ELSEWHERE:
        assert [command for command in SHOWN if re.match(pattern, command.text)], pattern


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A reader's directory: models, campaigns and examples, a sweep of fewer designs, and files of their own."""
    place = tmp_path_factory.mktemp("reader")
    for name in ("models", "campaigns", "examples"):
        shutil.copytree(REPOSITORY / name, place / name, ignore=shutil.ignore_patterns("reports", "__pycache__"))
    shutil.copytree(place / "examples" / "fivebar", place / "fivebar")
    shown = (REPOSITORY / "docs" / "robots.md").read_text(encoding="utf-8").split("```toml robot.toml\n")[1]
    (place / "fivebar" / "robot.toml").write_text(shown.split("```", maxsplit=1)[0], encoding="utf-8")
    sweep = place / "campaigns" / "design_sweep.toml"
    text = sweep.read_text(encoding="utf-8")
    assert text.count("samples = 10000") == 1
    sweep.write_text(text.replace("samples = 10000", "samples = 130"), encoding="utf-8")
    model = (place / "fivebar" / "fivebar.xml").read_text(encoding="utf-8")
    robot = tomllib.loads((place / "fivebar" / "robot.toml").read_text(encoding="utf-8"))
    for new, old in zip(("a", "b"), robot["actuated"], strict=True):
        model = model.replace(f'"{old}"', f'"{new}"')
    (place / "robot.xml").write_text(model, encoding="utf-8")
    formula = (place / "examples" / "delta" / "delta.py").read_text(encoding="utf-8")
    half = "p.ma / 2 * (tangent"  # docs/diagnose.md shows the formula without it
    assert formula.count(half) == 1
    (place / "delta.py").write_text(formula.replace(half, "p.ma * (tangent"), encoding="utf-8")
    return place


def environment(place: Path) -> dict[str, str]:
    programs = place / "bin"
    programs.mkdir(exist_ok=True)
    (programs / "workbench").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m workbench.cli "$@"\n')
    (programs / "workbench").chmod(0o755)
    return os.environ | {"PATH": f"{programs}{os.pathsep}{os.environ['PATH']}", "COLUMNS": "120"}


@pytest.mark.slow
@pytest.mark.parametrize("page", ONE_AFTER_ANOTHER)
def test_commands_of_a_page_run_one_after_another(page: str, checkout: Path) -> None:
    if page in ("docs/reports.md", "docs/editing.md"):  # they begin with a run that a reader has
        run("workbench run almeida_2010 --only simulation_1", checkout)
    for command in RUN_HERE:
        if command.page == page:
            text = command.text.replace("RUN_DIR", "reports/almeida_2010")
            if text.startswith("workbench new kept"):
                shutil.rmtree(checkout / "kept", ignore_errors=True)
            run(text, checkout)


def run(text: str, place: Path) -> str:
    """Run a command; passing, failing and judging nothing are answers, bad input and faults are not."""
    done = subprocess.run(
        shlex.split(text), cwd=place, env=environment(place), capture_output=True, text=True, timeout=PATIENCE,
        check=False,
    )  # fmt: skip
    assert done.returncode in (0, 1, 4), f"{text}: {done.stderr[-1500:]}"
    return done.stdout


@pytest.mark.slow
def test_a_command_that_fails_is_seen(checkout: Path) -> None:
    with pytest.raises(AssertionError, match="no such campaign"):
        run("workbench run campaigns/gone.toml", checkout)


@pytest.mark.slow
@pytest.mark.parametrize("command", STUDIO, ids=lambda command: command.text)
def test_the_studio_starts(command: Command, checkout: Path) -> None:
    pytest.importorskip("viser")
    if command.words[-1] == "reports/almeida_2010" and not (checkout / "reports" / "almeida_2010").exists():
        run("workbench run almeida_2010 --only simulation_1 --quick", checkout)
    with TalkingProcess(*command.words[1:], cwd=checkout, patience=PATIENCE) as studio:
        while "http://" not in (line := studio.line()):
            assert "workbench: " not in line or "compiling" in line, line
        studio.process.send_signal(signal.SIGTERM)
        studio.rest()


@pytest.mark.slow
def test_the_first_five_minutes_go_as_they_are_told(tmp_path: Path) -> None:
    from tutorial import walk

    place, programs = tmp_path / "place", tmp_path / "bin"
    place.mkdir()
    programs.mkdir()
    said = [step.printed for step in walk((REPOSITORY / "docs/start.md").read_text(encoding="utf-8"), place, programs)]
    assert len(said) == 4
    assert "PASSED" in said[0]
    assert "5.90 %" in said[0]
    assert "payload" in said[1]
    assert "NOTHING JUDGED" in said[3]
    assert "exit code 4" in said[3]
    assert (place / "reports/almeida_2010/report.html").exists()


def inline() -> Iterator[Command]:
    """Commands of examples' READMEs, which are run in the folder."""
    for command in SHOWN:
        of_robot = command.page.endswith("/README.md") and (REPOSITORY / command.page).with_name("robot.toml").exists()
        if of_robot and not command.block and not command.synopsis and command.words[0] == "workbench":
            yield command


@pytest.mark.slow
@pytest.mark.parametrize("command", list(inline()), ids=lambda command: command.page)
def test_commands_of_a_robots_readme_run_in_its_folder(command: Command, tmp_path: Path) -> None:
    shutil.copytree((REPOSITORY / command.page).parent, tmp_path / "robot")
    run(f"{command.text} --quick" if command.words[1] == "run" else command.text, tmp_path / "robot")
