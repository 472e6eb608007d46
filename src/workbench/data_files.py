"""Where models, campaigns and documents that come with the workbench lie: inside the wheel, or in a source checkout."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, get_args

from workbench.errors import WorkbenchError, did_you_mean

Kind = Literal["models", "campaigns", "docs", "examples"]

SUFFIXES: dict[str, str] = {"models": ".xml", "campaigns": ".toml", "docs": ".md", "examples": "robot.toml"}
"""What the files of each kind end in; a name may be given without it. Of examples: folders of robots."""

FOLDERS = {"docs": "**/", "examples": "*/"}
"""Kinds whose files lie in folders."""

_PACKAGE = Path(__file__).resolve().parent


def bundled_directory(kind: Kind, package: Path = _PACKAGE) -> Path:
    """Return the directory that holds the bundled files of one kind. Never write into it: it may be read-only.

    Parameters
    ----------
    kind
        ``models``, ``campaigns``, ``docs`` or ``examples``.
    package
        Directory of the package ``workbench``; another one only in tests.

    Raises
    ------
    WorkbenchError
        Unknown kind, or an installation without its data.
    """
    if kind not in get_args(Kind):
        raise WorkbenchError(f'unknown kind of bundled file "{kind}"{did_you_mean(kind, get_args(Kind))}', kind=kind)
    installed = package / "data" / kind
    checkout = package.parents[1] / kind
    # The check of pyproject.toml keeps a stranger's directory `models` beside an installed package out of it.
    if (package.parents[1] / "pyproject.toml").is_file() and checkout.is_dir():
        return checkout
    if installed.is_dir():
        return installed
    raise WorkbenchError(f"bundled {kind}: neither {installed} nor {checkout} exists; install the workbench again")


def bundled_names(kind: Kind, package: Path = _PACKAGE) -> tuple[str, ...]:
    """Return the file names of one kind, sorted; of documents and examples with their folder, ``derivations/x.md``.

    Raises
    ------
    WorkbenchError
        As `bundled_directory`.
    """
    directory = bundled_directory(kind, package)
    pattern = f"{FOLDERS.get(kind, '')}*{SUFFIXES[kind]}"
    return tuple(sorted(path.relative_to(directory).as_posix() for path in directory.glob(pattern)))


def bundled(kind: Kind, name: str, package: Path = _PACKAGE) -> Path:
    """Return the path of a model, campaign or document that comes with the workbench.

    Parameters
    ----------
    kind
        ``models``, ``campaigns`` or ``docs``.
    name
        File name, with or without its ending: ``NAME.xml`` or ``NAME``.
    package
        Directory of the package ``workbench``; another one only in tests.

    Raises
    ------
    WorkbenchError
        Unknown kind or name, with the nearest valid one. A name with a directory in it is unknown.
    """
    names = bundled_names(kind, package)
    for candidate in (name, f"{name}{SUFFIXES[kind]}"):
        if candidate in names:
            return bundled_directory(kind, package) / candidate
    raise WorkbenchError(
        f'bundled {kind}: no file "{name}"{did_you_mean(name, names)}', kind=kind, name=name, valid=names
    )
