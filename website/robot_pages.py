"""The page of robots: every folder with a robot file and a README, and every robot that comes with the package."""

from __future__ import annotations

import tomllib
from pathlib import Path

from website.pages_of import below

ROBOT_FILE = "robot.toml"

HEAD = """# Robots

A robot is a folder: an MJCF, a `robot.toml` ([every key](docs/robots.md)), formulas, a campaign. Each page derives its
formula and says where its numbers come from.

| robot | what it is | driven | platform |
|---|---|---|---|
"""


def page(repository: Path) -> str:
    """Give the page, a row per robot file, and the READMEs of all folders below it in the side bar."""
    rows = [_row(path, repository) for path in _robot_files(repository)]
    readmes = [path.relative_to(repository).with_suffix("").as_posix() for path in below(repository, "README.md")]
    tree = ("```{toctree}", ":maxdepth: 1", ":caption: Folders", "", *readmes, "```", "")
    return HEAD + "\n".join(rows) + "\n\n" + "\n".join(tree)


def _robot_files(repository: Path) -> list[Path]:
    own = sorted((repository / "src" / "workbench" / "robots").glob(f"*/{ROBOT_FILE}"))
    return own + below(repository, ROBOT_FILE)


def _row(path: Path, repository: Path) -> str:
    spec = tomllib.loads(path.read_text(encoding="utf-8"))
    name, folder = spec["name"], path.parent.relative_to(repository).as_posix()
    derivation = f"docs/derivations/{name}.md"
    page_of = derivation if (repository / derivation).exists() else f"{folder}/README.md"
    link = f"[{name}]({page_of})" if (repository / page_of).exists() else name
    platform = " ".join(spec.get("platform", {}).get("coordinates", ("x", "y", "z")))
    return f"| {link} | {spec.get('title', '')} | {' '.join(spec['actuated'])} | {platform} |"
