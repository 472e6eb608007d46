"""Tables for a paper fit it: LaTeX itself says so, in one column and in two; and a table that does not is noticed."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from test_report import make_run
from workbench.report.bibliography import cited_keys
from workbench.report.build import build_report
from workbench.report.latex import latex_table
from workbench.report.latex_layout import GAP, LETTERS, NARROW, TALLEST, WIDE, Content, chunks, lay_out, width_of
from workbench.report.latex_text import latex_text
from workbench.report.load import load_run
from workbench.report.paper_table import paper_table
from workbench.report.pdf import COLUMN, FULL_WIDTH_FROM, TEXT, article_size, figure_pdf
from workbench.report.sections import build_sections
from workbench.report.style import figure_style
from workbench.report.tables import Cell, Table, columns

FORMS = ("", "twocolumn", "11pt,twocolumn", "12pt")
latex = pytest.mark.skipif(shutil.which("pdflatex") is None, reason="there is no pdflatex here")


def compiled(folder: Path, names: Iterable[str], form: str, cite: bool = True) -> tuple[list[str], str]:
    """What LaTeX complains of, and its log, for an article that holds the tables of *folder*."""
    listed = [f"\\input{{{name}}}\\clearpage" for name in names]
    (folder / "article.tex").write_text(
        f"\\documentclass[{form}]{{article}}\\usepackage[T1]{{fontenc}}\\usepackage{{booktabs,array}}\n"
        "\\begin{document}Text.\\clearpage\n"
        + "\n".join(listed)
        + "\n\\bibliographystyle{plain}\\bibliography{references}\n"
        "\\end{document}\n",
        encoding="utf-8",
    )
    steps = [["pdflatex", "-interaction=nonstopmode", "article"]]
    steps += [["bibtex", "article"], *steps, *steps] if cite and shutil.which("bibtex") else []
    for step in steps:
        subprocess.run(step, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, check=False, timeout=120)
    log = (folder / "article.log").read_text(encoding="utf-8", errors="replace")
    undefined = ("LaTeX Warning: Citation",) if len(steps) > 1 else ()
    bad = ("Overfull", "! ", "LaTeX Warning: Float too large", *undefined)
    return [line for line in log.splitlines() if line.startswith(bad)], log


def long_name(manifest: dict, rows: list) -> None:  # type: ignore[type-arg]
    manifest["cases"]["sim1"]["title"] = "A_very_long_title_of_a_case_without_any_blank_or_hyphen_in_it_" + "9f" * 40
    manifest["claims"][0]["source"] = "[Almeida2010] section 4"
    manifest["parameters"][0]["meaning"] = "words " * 60
    manifest["claims"][0]["note"] = r"50 % & {more} \of $it$ ~ # ^ _ < > | \" 1.2e-13, τ2 → 3 × 4 ± 5 ≥ 6 ≈ 7"


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tables of a report with long names, which no test changes."""
    run = make_run(tmp_path_factory.mktemp("latex") / "run", cases=2, samples=20, edit=long_name)
    build_report(run, ["pdf"])
    return run / "tables"


@latex
@pytest.mark.parametrize("form", FORMS)
def test_every_table_of_a_report_fits_an_article(tables: Path, tmp_path: Path, form: str) -> None:
    folder = tmp_path / "tables"
    shutil.copytree(tables, folder)
    complaints, log = compiled(folder, sorted(path.stem for path in folder.glob("*.tex")), form)
    assert complaints == []
    assert "Output written" in log
    assert r"\cite{Almeida2010}" in (folder / "claims.tex").read_text(encoding="utf-8")


@latex
@pytest.mark.parametrize("seed", range(3))
def test_random_tables_fit_and_broken_ones_are_noticed(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    words = ["lumped", "distributed-rotation", "pick_and_place", "spherical_E", "1.23e-14", "45.6 N·m", "a/b_c", "of",
             "the", "motion", "parallelogram_closure", "5.43 → 7.61 (×1.4)", "i", "MMMM"]  # fmt: skip
    names = []
    for number in range(6):
        width, height = int(rng.integers(1, 15)), int(rng.integers(1, 70))
        numeric = [f"H{i}" for i in range(width) if rng.random() < 0.5]
        rows = tuple(
            tuple(
                Cell(f"{rng.normal():.4g} N·m", emphasis=bool(rng.random() < 0.2))
                if f"H{i}" in numeric
                else Cell(" ".join(rng.choice(words, int(rng.integers(0, 9)))), emphasis=bool(rng.random() < 0.1))
                for i in range(width)
            )
            for _ in range(height)
        )
        table = Table(
            f"t{number}", "What it shows, in words.", columns([f"H{i}" for i in range(width)], numeric), rows, "r."
        )
        (tmp_path / f"t{number}.tex").write_text(latex_table(table), encoding="utf-8")
        names.append(f"t{number}")
    for form in FORMS[:2]:
        complaints, _ = compiled(tmp_path, names, form, cite=False)
        assert complaints == []
    # as tables were before: every column as wide as it likes
    text = (tmp_path / "t0.tex").read_text(encoding="utf-8")
    wide = r"\begin{tabular}{lll}" + " & ".join(["distributed-rotation of the parallelogram"] * 3) + r"\end{tabular}"
    (tmp_path / "t0.tex").write_text(
        re.sub(r"\\begin\{tabular\}.*?\\end\{tabular\}", lambda _: wide, text, flags=re.DOTALL)
    )
    assert any(line.startswith("Overfull") for line in compiled(tmp_path, ["t0"], "", cite=False)[0])


def content(cells: list[str], numeric: bool = False, head: str = "Head") -> Content:
    return Content(head, tuple(cells), numeric, (False,) * len(cells))


@pytest.mark.parametrize("seed", range(5))
def test_parts_are_as_wide_as_there_is_room_and_hold_every_column_once(seed: int) -> None:
    rng = np.random.default_rng(seed)
    contents = [
        content(["word " * int(rng.integers(1, 12)), "x" * int(rng.integers(1, 15))], bool(rng.random() < 0.4))
        for _ in range(int(rng.integers(1, 16)))
    ]
    parts, wide = lay_out(contents, 1)
    assert [0, *(i for part in parts for i in part.columns if i)] == list(range(len(contents)))
    for part in parts:
        widths = [
            contents[i].natural if width is None else width for i, width in zip(part.columns, part.widths, strict=True)
        ]
        assert sum(widths) + GAP * (len(widths) - 1) <= (WIDE if wide else NARROW) + 1e-6
        assert all(width is None or width > 0 for width in part.widths)


def test_a_narrow_table_is_one_for_a_column_and_rows_are_cut_by_height() -> None:
    assert lay_out([content(["a"]), content(["1.0"], numeric=True)], 1)[1] is False
    assert lay_out([content(["a long sentence of several words"])] * 9, 1)[1] is True
    stretches = chunks([30.0] * 40)
    assert [row for stretch in stretches for row in stretch] == list(range(40))
    assert all(30.0 * len(stretch) <= TALLEST for stretch in stretches)
    assert chunks([2 * TALLEST, 1.0]) == [range(1), range(1, 2)]
    assert chunks([]) == [range(0)]
    assert width_of("1.2e-13") > width_of("1.2") + 20.0  # printed as a power of ten


def test_keys_become_citations_only_where_the_bibliography_has_them(repository: Path) -> None:
    assert latex_text("[Almeida2010] Table 1", cited_keys()) == r"\cite{Almeida2010} Table 1"
    assert latex_text("[Nobody1999] x", cited_keys()) == "{}[Nobody1999] x"
    assert latex_text("[Almeida2010]") == "{}[Almeida2010]"
    listed = re.findall(r"^\*\*\[(\w+)\]\*\*", (repository / "docs" / "references.md").read_text(), re.MULTILINE)
    assert set(listed) == cited_keys()


def test_the_compact_table_has_the_worst_of_each_formula_and_joint(tmp_path: Path) -> None:
    run = load_run(make_run(tmp_path / "run", cases=2, samples=20))
    table = paper_table(run)
    worst: dict[tuple[str, str, str], float] = {}
    for row in run.rows:
        key = row.candidate, row.reference, row.joint
        worst[key] = max(worst.get(key, 0.0), row.peak_error)
    shown = {
        (row[0].text, row[1].text, joint): cell.value
        for row in table.rows
        for joint, cell in zip(run.manifest.joints, row[2:], strict=True)
        if cell.value is not None
    }
    assert shown == {key: value for key, value in worst.items() if key[0] in {row[0].text for row in table.rows}}
    assert len(shown) >= 6
    assert lay_out([Content(c.title, tuple(r[i].text for r in table.rows), c.numeric, (False,) * len(table.rows))
                    for i, c in enumerate(table.columns)], 1)[1] is False  # fmt: skip


def test_figures_of_a_paper_are_as_wide_as_a_column_with_letters_of_the_tables(tmp_path: Path) -> None:
    run = load_run(make_run(tmp_path / "run", cases=1, samples=20))
    plots = [plot for section in build_sections(run) for plot in section.plots]
    assert {plot.size[0] > FULL_WIDTH_FROM for plot in plots} == {True, False}
    seen: dict[str, float] = {}
    for style, letters in (("paper", {7.0, 7.5, 8.0}), ("page", {7.5, 8.0, 8.5, 9.0})):
        for plot in plots[:3] + [plot for plot in plots if plot.size[0] > FULL_WIDTH_FROM][:1]:
            with figure_style(style):
                box = re.search(rb"/MediaBox\s*\[0 0 ([\d.]+) ([\d.]+)\]", figure_pdf(plot, style))
                drawing = plot.drawn(article_size(plot))
            assert box is not None
            width = float(box[1]) * 72.27 / 72.0
            room = TEXT if plot.size[0] > FULL_WIDTH_FROM else COLUMN
            assert (width <= room + 0.01) == (style == "paper"), (plot.key, width)
            found = {float(size) for size in re.findall(r"font-size: ([\d.]+)px", drawing)}
            found |= {float(size) for size in re.findall(r"font: ([\d.]+)px", drawing)}
            assert found, plot.key
            assert found <= letters, (plot.key, found)
            seen[style] = seen.get(style, 0.0) if max(found) < seen.get(style, 0.0) else max(found)
    assert seen["paper"] == LETTERS < seen["page"]
