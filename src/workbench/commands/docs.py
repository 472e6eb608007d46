"""``workbench docs``: the documents that reports and models cite, from an installed package as from a checkout."""

from __future__ import annotations

from typing import Annotated

import typer


def docs(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="As it is cited: docs/evidence.md, or evidence. Without: the list.")
    ] = "",
) -> None:
    """Print a document that a report cites: evidence, derivations, conventions."""
    from workbench.data_files import bundled, bundled_names

    if not name:
        typer.echo("\n".join(found.removesuffix(".md") for found in bundled_names("docs")))
        return
    cited = name.partition(",")[0].strip().removeprefix("docs/")  # "docs/NAME.md, section 7" is how a source cites it
    typer.echo(bundled("docs", cited).read_text(encoding="utf-8"), nl=False)
