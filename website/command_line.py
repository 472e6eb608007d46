"""The page of the command line, from the commands themselves."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer.main

from workbench.cli import app

HEAD = """# Command line

Made from the commands themselves: `workbench COMMAND --help` says the same. Exit codes are those of every command:

"""
CODES = "| exit code | meaning |"


def page(repository: Path) -> str:
    """Give the page; exit codes are the README's table."""
    readme = (repository / "README.md").read_text(encoding="utf-8")
    codes = re.search(rf"^{re.escape(CODES)}\n(\|.*\n)+", readme, re.MULTILINE)
    assert codes, "README.md has no table of exit codes"
    root = typer.main.get_command(app)
    return HEAD + codes[0] + "\n" + "\n".join(_lines(root, "workbench", 2))


def _lines(command: Any, path: str, level: int) -> Iterator[str]:
    """Heading, what it does, how it is called and what its arguments and options mean; then its sub-commands."""
    context = typer.Context(command, info_name=path)
    yield f"{'#' * level} {path}\n"
    yield f"{_plain(command.help or '')}\n"
    yield f"```text\n{path} {' '.join(command.collect_usage_pieces(context))}\n```\n"
    records = [record for parameter in command.get_params(context) if (record := parameter.get_help_record(context))]
    if records:
        yield "| argument, option | meaning |\n|---|---|"
        yield from (f"| {_code(name)} | {_cell(_plain(text))} |" for name, text in records)
        yield ""
    for name in command.list_commands(context) if hasattr(command, "list_commands") else ():
        yield from _lines(command.get_command(context, name), f"{path} {name}", min(level + 1, 3))


def _code(text: str) -> str:
    return f"`{_cell(text)}`"


def _plain(text: str) -> str:
    """Lines of one paragraph as one, paragraphs apart."""
    return "\n\n".join(" ".join(part.split()) for part in re.split(r"\n\s*\n|\f", text.strip()) if part.strip())


def _cell(text: str) -> str:
    return re.sub(r"\s+", " ", text).replace("|", "\\|").replace("<", "&lt;") if "`" in text else _escaped(text)


def _escaped(text: str) -> str:
    return re.sub(r"\s+", " ", text).replace("|", "\\|")
