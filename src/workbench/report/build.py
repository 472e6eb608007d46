"""Build report.html, report.md, report.pdf, figures/ and tables/ from a run directory's stored results alone."""

from __future__ import annotations

import base64
import contextlib
import gc
import hashlib
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from workbench.campaign.changed import ANOTHER, NOT_JUDGED
from workbench.errors import OutputError
from workbench.report import kept_drawings
from workbench.report.bibliography import NAME, bibliography, cited_keys
from workbench.report.cost import cost_table
from workbench.report.drawing import Show, draw
from workbench.report.drawn_from import Drawn, drawn_from, take
from workbench.report.latex import latex_table
from workbench.report.load import Run, load_run, read_manifest
from workbench.report.paper_table import paper_table
from workbench.report.section import Section
from workbench.report.sections import build_sections, unique_keys
from workbench.report.style import PAPERS, STYLES, figure_style
from workbench.report.svg import StyleSheet, inline, standalone
from workbench.report.text import fenced, finalize_markdown
from workbench.report.verdict_section import changes, circumstances

if TYPE_CHECKING:
    from workbench.report.control.load import StudyRun
    from workbench.report.sweep.load import SweepRun

FIGURES = "figures"
DRAWN_STYLE = "page"
"""In which figures are drawn beside a run."""
TABLES = "tables"
_OWN_FIGURE = re.compile(r"(?:case|figure)-[a-z0-9-]+\.(?:svg|pdf)")
_OWN_TABLE = re.compile(r"[a-z0-9-]+\.tex")
DATA_FORMATS = ("csv", "mat")
FORMATS = ("html", "md", "pdf", *DATA_FORMATS)


def build_report(
    run_dir: str | Path,
    formats: Sequence[str] = ("html", "md"),
    style: str = "page",
    show: Show | None = None,
    paper: str = "a4",
    *,
    second: bool = False,
    drawn: Drawn | None = None,
) -> list[Path]:
    """Write the report of a finished run beside its results.

    Parameters
    ----------
    run_dir
        A run directory with manifest.json, summary.csv and series/, or that of a finished sweep. Nothing is recomputed.
    formats
        ``html``: report.html, one file that loads nothing from elsewhere; ``md``: report.md and the SVG figures that it
        shows; ``pdf``: report.pdf, each figure as a PDF, and each table as LaTeX in tables/; ``csv`` and ``mat``: the
        series of each case with units in data/, for other programs.
    style
        ``page``, or ``paper``: figures for the column of a paper.
    show
        See `Show`.
    paper
        ``a4`` or ``letter``: the pages of report.pdf.
    second
        Whether a copy of this process may help to draw; not for programs with threads of their own.
    drawn
        Drawings that were made of the same run meanwhile; they are taken where they show what is stored.

    Returns
    -------
    list of Path
        The files written. The same results give the same bytes.

    Raises
    ------
    OutputError
        Results are missing, torn or of another format version, or the report cannot be written. No file is left
        half-written. Also an unknown format, style or paper.
    """
    _check_choice("format", formats, FORMATS)
    _check_choice("style", [style], STYLES)
    _check_choice("paper", [paper], PAPERS)
    run_dir = Path(run_dir)
    manifest = read_manifest(run_dir)
    run: Run | SweepRun | StudyRun
    # what a run of cases does not need is not loaded
    if manifest.control is not None:
        from workbench.report.control.load import load_study
        from workbench.report.control.sections import study_sections

        run = load_study(run_dir, manifest)
        sections = study_sections(run)
    elif manifest.sweep is None:
        run = load_run(run_dir)
        sections = build_sections(run)
    else:
        from workbench.report.sweep.load import load_sweep
        from workbench.report.sweep.sections import sweep_sections

        run = load_sweep(run_dir, manifest)
        sections = sweep_sections(run)
    with figure_style(style), _few_collections():
        files = _rendered(run, sections, formats, style, paper, show, second, drawn)
    wanted = tuple(name for name in formats if name in DATA_FORMATS)
    if wanted and not isinstance(run, Run):
        kind = "a sweep's" if manifest.sweep is not None else "a study's"
        raise OutputError(f"{run_dir}: formats {', '.join(wanted)} go with a run of cases; {kind} data are Parquet")
    if wanted:
        from workbench.report.data_out import data_files  # pandas takes longer to load than a page to write

        files |= data_files(run_dir, wanted)
    for place in {path.parent for path in files} - {run_dir}:
        if place.is_symlink():
            raise OutputError(f"{place}: is a symbolic link; a report is written into its run directory alone")
    try:
        for path, content in files.items():
            path.parent.mkdir(exist_ok=True)
            _write(path, content)
        for folder, own in ((FIGURES, _OWN_FIGURE), (TABLES, _OWN_TABLE)):
            kinds = {path.suffix for path in files if path.parent == run_dir / folder}
            for stale in (run_dir / folder).iterdir() if kinds else ():
                if stale not in files and stale.suffix in kinds and own.fullmatch(stale.name):
                    stale.unlink()
    except OSError as error:
        where = error.filename or run_dir
        raise OutputError(f"{where}: the report cannot be written ({error.strerror or error})") from error
    return sorted(files)


def _check_choice(what: str, given: Sequence[str], allowed: Iterable[str]) -> None:
    for name in given:
        if name not in allowed:
            raise OutputError(f"report: unknown {what} {name!r}; allowed: {', '.join(allowed)}")


def _rendered(
    run: Run | SweepRun | StudyRun,
    sections: list[Section],
    formats: Sequence[str],
    style: str,
    paper: str,
    show: Show | None,
    second: bool,
    drawn: Drawn | None,
) -> dict[Path, bytes]:
    files: dict[Path, bytes] = {}
    if "pdf" in formats:
        from workbench.report.pdf import all_tables, figure_pdf, report_pdf  # Typst is loaded where it is needed
    figures = run.directory / FIGURES
    plots = [plot for section in sections for plot in section.plots]
    steps = _Steps(show, len(plots) * (2 if "pdf" in formats else 1) + ("pdf" in formats))
    # a page takes no drawing from a file: what stands in it can be read by the page's script
    kept = not {"html", "md"} & {*formats} and isinstance(run, Run)
    kept = kept and kept_drawings.take(figures, run.directory, style, plots)
    if {"html", "md", "pdf"} & {*formats} and not kept:
        if drawn is not None and style == DRAWN_STYLE and isinstance(run, Run):
            take(drawn, drawn_from(run, plots, unique_keys("case", run.manifest.cases)), plots)
        draw([plot for plot in plots if "svg" not in vars(plot)], steps.to, second=second)
    for number, plot in enumerate(plots, 1):
        if "md" in formats:
            files[figures / f"{plot.key}.svg"] = standalone(plot.svg, plot.alt).encode()
        if "pdf" in formats:
            files[figures / f"{plot.key}.pdf"] = figure_pdf(plot, style)
            steps.to(len(plots) + number)
    if "md" in formats:
        files[run.directory / "report.md"] = render_markdown(run, sections).encode()
        if isinstance(run, Run):
            files[run.directory / kept_drawings.NAME] = kept_drawings.note(run.directory, style, files)
    if "html" in formats:
        files[run.directory / "report.html"] = render_html(run, sections).encode()
    if "pdf" in formats:
        files[run.directory / "report.pdf"] = report_pdf(run, sections, style, paper)
        steps.to(steps.total)
        costs = cost_table(run.manifest)
        tables = [*all_tables(sections), *([costs] if costs else [])]
        if isinstance(run, Run):
            tables.append(paper_table(run))
        for table in tables:
            files[run.directory / TABLES / f"{table.key}.tex"] = latex_table(table, cited_keys()).encode()
        files[run.directory / TABLES / NAME] = bibliography().encode()
    return files


class _Steps:
    """Tells how many figures are drawn and set, and whether the pages are, of all that is to be done."""

    def __init__(self, show: Show | None, total: int) -> None:
        self._show, self.total = show, total

    def to(self, done: int, _: int = 0) -> None:
        """So many are done."""
        if self._show:
            self._show(done, self.total)


def render_html(run: Run | SweepRun | StudyRun, sections: list[Section]) -> str:
    """Return the whole page."""
    return html_page("report.html.j2", sections, _head(run))


def html_page(template: str, sections: Sequence[Section], head: Mapping[str, Any]) -> str:
    """Return a page that loads nothing from elsewhere: *template* around the sections, *head* is what stands above."""
    environment = _environment()
    sheet = StyleSheet()
    environment.globals["inline_svg"] = lambda plot: Markup(sheet.shorten(inline(plot.svg, plot.alt)))
    bodies = [
        (section, Markup(environment.get_template(f"{section.template}.html.j2").render(section.context)))
        for section in sections
    ]
    style = _source(environment, "style.css")
    script = _source(environment, "report.js")
    digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
    page = environment.get_template(template)
    text = page.render(
        **head,
        sections=bodies,
        style=Markup(style + sheet.rules),
        shapes=Markup(sheet.shapes),
        script=Markup(script),
        script_hash=f"sha256-{digest}",
    )
    return _without_blank_lines(text)


def _head(run: Run | SweepRun | StudyRun) -> dict[str, Any]:
    """What stands over the sections."""
    return {
        "manifest": run.manifest,
        "circumstances": circumstances(run.manifest),
        "another": ANOTHER,
        "not_judged": NOT_JUDGED,
        "changes": changes(run.manifest),
        "costs": cost_table(run.manifest),
    }


def _source(environment: Environment, name: str) -> str:
    """Return a file that goes into the page as it stands, without the blank lines that the page has none of."""
    loader = environment.loader
    if loader is None:
        raise OutputError(f"{name}: the report's templates are missing")
    return _without_blank_lines(loader.get_source(environment, name)[0])


def _without_blank_lines(text: str) -> str:
    return "\n".join(line.rstrip() for line in text.splitlines() if line.strip()) + "\n"


def render_markdown(run: Run | SweepRun | StudyRun, sections: list[Section]) -> str:
    """Return the report as Markdown that shows figures/*.svg."""
    environment = _environment()
    environment.finalize = finalize_markdown
    environment.filters["fenced"] = fenced
    environment.filters["attribute"] = lambda text: Markup(escape(" ".join(str(text).split())))
    environment.globals["figures"] = FIGURES
    bodies = [
        (section, Markup(environment.get_template(f"{section.template}.md.j2").render(section.context)))
        for section in sections
    ]
    text = environment.get_template("report.md.j2").render(
        **_head(run),
        sections=bodies,
    )
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("workbench.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


@contextlib.contextmanager
def _few_collections() -> Iterator[None]:
    """Hold garbage collection back while figures are drawn: it takes a quarter of the time and frees little."""
    enabled = gc.isenabled()
    gc.disable()
    gc.freeze()  # what is there before the first figure need not be looked through
    try:
        yield
    finally:
        gc.unfreeze()
        if enabled:
            gc.enable()


def _write(path: Path, content: bytes) -> None:
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.write_bytes(content)
        os.replace(temporary, path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error  # not the name in between
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
