"""``workbench report``: rebuild a report from a run's stored results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def report(
    run_dir: Annotated[Path, typer.Argument(metavar="RUN_DIR", help="Directory that a run has written.")],
    format_: Annotated[
        list[str] | None,
        typer.Option("--format", metavar="html|md|pdf|csv|mat", help="May be repeated. Default: html and md."),
    ] = None,
    style: Annotated[
        str, typer.Option(metavar="page|paper", help="How figures look: on a page, or in the column of a paper.")
    ] = "page",
    paper: Annotated[str, typer.Option(metavar="a4|letter", help="Pages of report.pdf.")] = "a4",
) -> None:
    """Rebuild the report from what a run has stored; nothing is computed again.

    html: report.html. md: report.md with figures/*.svg. pdf: report.pdf, figures/*.pdf and tables/*.tex. csv, mat:
    data/, for other programs, with units.
    """
    from workbench.report import build_report
    from workbench.report.kept_drawings import NAME as KEPT
    from workbench.terminal import Steps

    formats = tuple(dict.fromkeys(format_ or ("html", "md")))
    with Steps("drawing figures, setting pages" if "pdf" in formats else "drawing figures") as show:
        written = build_report(run_dir, formats, style, show, paper, second=True)
    for path in written:
        if path.parent in (run_dir, run_dir / "data") and path.name != KEPT:
            typer.echo(str(path))
