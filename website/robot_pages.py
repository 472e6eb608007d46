"""The page of robots: every folder with a robot file and a README, and every robot that comes with the package."""

from __future__ import annotations

import tomllib
from pathlib import Path

from website.pages_of import below

ROBOT_FILE = "robot.toml"
PAPER = "paper"
"""The folder of the software paper, whose page stands elsewhere."""

HEAD = """# Folders of robots

A robot is a folder: an MJCF, a `robot.toml` ([every key](docs/robots.md)), formulas, a campaign. Each page derives its
formula and says where its numbers come from.

| robot | what it is | driven | platform |
|---|---|---|---|
"""


def page(repository: Path) -> str:
    """Give the page: a row per robot file, other folders below, and all of their pages in the side bar."""
    rows = [_row(path, repository) for path in _robot_files(repository)]
    readmes = [path for path in below(repository, "README.md") if path.parent.name != PAPER]
    names = [path.relative_to(repository).with_suffix("").as_posix() for path in readmes]
    tree = ("```{toctree}", ":hidden:", "", *names, "```", "")
    others = [
        f"- [{path.read_text(encoding='utf-8').partition(chr(10))[0].removeprefix('# ')}]({name}.md)"
        for path, name in zip(readmes, names, strict=True)
        if not path.with_name(ROBOT_FILE).exists()
    ]
    return HEAD + "\n".join(rows) + "\n\nFolders that hold no robot:\n\n" + "\n".join(others) + "\n\n" + "\n".join(tree)


def _robot_files(repository: Path) -> list[Path]:
    own = sorted((repository / "src" / "workbench" / "robots").glob(f"*/{ROBOT_FILE}"))
    return own + below(repository, ROBOT_FILE)


def _row(path: Path, repository: Path) -> str:
    spec = tomllib.loads(path.read_text(encoding="utf-8"))
    name, folder = spec["name"], path.parent.relative_to(repository).as_posix()
    derivation = f"docs/derivations/{name}.md"
    page_of = derivation if (repository / derivation).exists() else f"{folder}/README.md"
    link = f"[{name}]({page_of})" if (repository / page_of).exists() else name
    free = ("x", "y", "z") if len(spec["actuated"]) >= 3 else ()  # those of a robot file that says nothing
    platform = " ".join(spec["platform"].get("coordinates", free))
    return f"| {link} | {spec.get('title', '')} | {' '.join(spec['actuated'])} | {platform} |"
