"""Build report.html, report.md and figures/ from a run directory's stored results alone."""

from __future__ import annotations

import base64
import contextlib
import hashlib
import os
import re
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from workbench.errors import OutputError
from workbench.report.load import Run, load_run
from workbench.report.plot import Plot
from workbench.report.section import Section
from workbench.report.sections import build_sections
from workbench.report.style import figure_style
from workbench.report.svg import inline, standalone
from workbench.report.text import fenced, finalize_markdown

FIGURES = "figures"
_OWN_FIGURE = re.compile(r"(?:case|figure)-[a-z0-9-]+\.svg")


def build_report(run_dir: Path) -> list[Path]:
    """Write the report of a finished run beside its results.

    Parameters
    ----------
    run_dir
        A run directory with manifest.json, summary.csv and series/. Nothing is recomputed.

    Returns
    -------
    list of Path
        The files written: report.html (one file, nothing loaded from elsewhere), report.md and the SVG figures that it
        shows. The same results give the same bytes.

    Raises
    ------
    OutputError
        Results are missing, torn or of another format version, or the report cannot be written. No file is left
        half-written.
    """
    run_dir = Path(run_dir)
    run = load_run(run_dir)
    sections = build_sections(run)
    files: dict[Path, str] = {}
    with figure_style():
        for section in sections:
            for plot in section.plots:
                files[run_dir / FIGURES / f"{plot.key}.svg"] = standalone(plot.svg, plot.alt)
    files[run_dir / "report.md"] = render_markdown(run, sections)
    files[run_dir / "report.html"] = render_html(run, sections)
    try:
        (run_dir / FIGURES).mkdir(exist_ok=True)
        for path, text in files.items():
            _write(path, text)
        for stale in (run_dir / FIGURES).iterdir():
            if stale not in files and _OWN_FIGURE.fullmatch(stale.name):
                stale.unlink()
    except OSError as error:
        where = error.filename or run_dir
        raise OutputError(f"{where}: the report cannot be written ({error.strerror or error})") from error
    return sorted(files)


def render_html(run: Run, sections: list[Section]) -> str:
    """Return the whole page."""
    environment = _environment()
    environment.globals["inline_svg"] = _inline_svg
    bodies = [
        (section, Markup(environment.get_template(f"{section.template}.html.j2").render(section.context)))
        for section in sections
    ]
    style = _source(environment, "style.css")
    script = _source(environment, "report.js")
    digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
    page = environment.get_template("report.html.j2")
    text = page.render(
        manifest=run.manifest,
        sections=bodies,
        style=Markup(style),
        script=Markup(script),
        script_hash=f"sha256-{digest}",
    )
    return _without_blank_lines(text)


def _source(environment: Environment, name: str) -> str:
    """Return a file that goes into the page as it stands, without the blank lines that the page has none of."""
    loader = environment.loader
    if loader is None:
        raise OutputError(f"{name}: the report's templates are missing")
    return _without_blank_lines(loader.get_source(environment, name)[0])


def _without_blank_lines(text: str) -> str:
    return "\n".join(line.rstrip() for line in text.splitlines() if line.strip()) + "\n"


def render_markdown(run: Run, sections: list[Section]) -> str:
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
    text = environment.get_template("report.md.j2").render(manifest=run.manifest, sections=bodies)
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("workbench.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _inline_svg(plot: Plot) -> Markup:
    return Markup(inline(plot.svg, plot.alt))


def _write(path: Path, text: str) -> None:
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.write_text(text, encoding="utf-8", newline="\n")
        os.replace(temporary, path)
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
