"""Print the lower bounds of all dependencies as constraints, one a line: ``numpy==2.2``. For `make test-floors`."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

REQUIREMENT = re.compile(r"([A-Za-z0-9_.-]+)(?:\[[^\]]*\])?>=([0-9.]+)")

OWN_PACE = ("mypy", "pandas-stubs", "ruff", "playwright", "axe-playwright-python", "ipykernel", "nbclient", "hatchling")
"""Tools that judge the source or open a browser: the fast tests do not depend on their versions."""


def floors(document: str) -> dict[str, str]:
    """Lower bound by package of a pyproject.toml: dependencies and extras."""
    project = tomllib.loads(document)["project"]
    every = [*project["dependencies"], *(one for extra in project["optional-dependencies"].values() for one in extra)]
    found = [match.groups() for text in every if (match := REQUIREMENT.match(text))]
    return {name: version for name, version in found if name not in OWN_PACE}


if __name__ == "__main__":
    text = (Path(__file__).resolve().parents[1] / "pyproject.toml").read_text(encoding="utf-8")
    for name, version in sorted(floors(text).items()):
        print(f"{name}=={version}")
