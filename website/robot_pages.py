"""The page of robots: every folder with a robot file and a README, and every robot that comes with the package."""

from __future__ import annotations

import tomllib
from pathlib import Path

from website.pages_of import LEFT_OUT, ROBOT_FILE

HEAD = """# Robots

A robot is a folder: an MJCF, a `robot.toml` ([every key](docs/robots.md)), formulas, a campaign. Each page derives its formula and says
where its numbers come from.

| robot | what it is | driven | platform |
|---|---|---|---|
"""


def page(repository: Path) -> str:
    """Give the page, a row per robot file, and the READMEs of all folders below it in the side bar."""
    rows = [_row(path, repository) for path in _robot_files(repository)]
    others = [
        path.relative_to(repository).with_suffix("").as_posix()
        for path in sorted(repository.rglob("README.md"))
        if path.parent != repository and path.relative_to(repository).parts[0] not in LEFT_OUT
        and not any(part.startswith(".") for part in path.relative_to(repository).parts)
    ]
    return HEAD + "\n".join(rows) + "\n\n" + "\n".join(("```{toctree}", ":maxdepth: 1", ":caption: Folders", "", *others, "```", ""))


def _robot_files(repository: Path) -> list[Path]:
    own = sorted((repository / "src" / "workbench" / "robots").glob(f"*/{ROBOT_FILE}"))
    return own + [
        path for path in sorted(repository.rglob(ROBOT_FILE)) if path.relative_to(repository).parts[0] not in LEFT_OUT
        and not any(part.startswith(".") for part in path.relative_to(repository).parts)
    ]


def _row(path: Path, repository: Path) -> str:
    spec = tomllib.loads(path.read_text(encoding="utf-8"))
    name, folder = spec["name"], path.parent.relative_to(repository).as_posix()
    derivation = f"docs/derivations/{name}.md"
    page_of = derivation if (repository / derivation).exists() else f"{folder}/README.md"
    link = f"[{name}]({page_of})" if (repository / page_of).exists() else name
    platform = spec.get("platform", {})
    return f"| {link} | {spec.get('title', '')} | {' '.join(spec['actuated'])} | {' '.join(platform.get('coordinates', ('x', 'y', 'z')))} |"
