"""A PDF takes the drawings that stand there, where they are those it would draw; an axis draws what matplotlib does."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import RendererSVG

from test_report import make_run
from workbench.report import build, kept_drawings, layout, svg
from workbench.report.build import build_report
from workbench.report.layout import figure_legend, legend, log_axis, stack
from workbench.report.style import figure_style


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_run(tmp_path_factory.mktemp("kept") / "run", cases=1, samples=20)
    build_report(folder, ["html", "md", "pdf"])
    return folder


def copy_of(run: Path, place: Path) -> Path:
    for path in sorted(run.rglob("*")):
        if path.is_file() and path.suffix != ".pdf":
            target = place / path.relative_to(run)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
    return place


def drawn_of(run: Path, monkeypatch: pytest.MonkeyPatch) -> int:
    """How many figures are drawn anew for a PDF."""
    counts = [0]
    own = build.draw

    def counting(plots: list[object], *arguments: object, **options: object) -> None:
        counts[0] += len(plots)
        own(plots, *arguments, **options)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(build, "draw", counting)
        build_report(run, ["pdf"])
    return counts[0]


def test_the_same_results_need_no_drawing_and_give_the_same_pdf(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = copy_of(whole, tmp_path / "run")
    assert drawn_of(run, monkeypatch) == 0
    assert (run / "report.pdf").read_bytes() == (whole / "report.pdf").read_bytes()
    names = sorted(path.name for path in (whole / "figures").glob("*.pdf"))
    assert names
    for name in names:
        assert (run / "figures" / name).read_bytes() == (whole / "figures" / name).read_bytes()


def tampered(run: Path) -> None:
    path = next(iter(sorted((run / "figures").glob("*.svg"))))
    path.write_text(path.read_text("utf-8").replace("<path", "<path ", 1), "utf-8")


def forged(run: Path) -> None:
    """A drawing that asks for another file, with its digest beside it as if it were ours."""
    path = next(iter(sorted((run / "figures").glob("*.svg"))))
    text = path.read_text("utf-8").replace("</svg>", '<image href="/etc/hostname"/></svg>')
    path.write_text(text, "utf-8")
    note = json.loads((run / kept_drawings.NAME).read_text("utf-8"))
    note["drawings"][path.name] = hashlib.sha256(text.encode()).hexdigest()
    (run / kept_drawings.NAME).write_text(json.dumps(note), "utf-8")


def other_results(run: Path) -> None:
    manifest = json.loads((run / "manifest.json").read_text("utf-8"))
    (run / "manifest.json").write_text(json.dumps(manifest | {"title": "Another"}), "utf-8")


def gone(run: Path) -> None:
    next(iter(sorted((run / "figures").glob("*.svg")))).unlink()


def broken(run: Path) -> None:
    (run / kept_drawings.NAME).write_text("[]", "utf-8")


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("spoil", [tampered, forged, other_results, gone, broken])
def test_other_drawings_are_drawn_anew(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spoil: Callable[[Path], None]
) -> None:
    run = copy_of(whole, tmp_path / "run")
    spoil(run)
    assert drawn_of(run, monkeypatch) > 0


def test_progress_reaches_the_pages(whole: Path, tmp_path: Path) -> None:
    said: list[tuple[int, int]] = []
    build_report(copy_of(whole, tmp_path / "run"), ["pdf"], show=lambda done, of: said.append((done, of)))
    assert said[-1][0] == said[-1][1]
    assert said[-2][0] == said[-1][1] - 1
    assert [done for done, _ in said] == sorted(done for done, _ in said)


def test_an_axis_draws_what_matplotlib_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    def drawn() -> str:
        figure = svg.new_figure(4.0, 3.0)
        above, below = stack(figure, (2, 1))
        above.plot([0.0, 0.3, 1.0], [-2.0, 3.5, 1.0])
        below.plot([0.0, 0.3, 1.0], [1e-9, 1e-3, 1e-6])
        log_axis(below, 1e-9, 1e-3)
        above.set_ylabel("τ1 [N]")
        below.tick_params(axis="x", labelsize=6, length=4)
        below.grid(axis="y", visible=False)
        free = figure.add_axes((0.6, 0.6, 0.2, 0.2))
        free.plot([1, 2], [3, 4])
        free.set_ylabel("placed by its ticks")
        return svg.svg_of(figure, "figure-x")

    with figure_style():
        light = drawn()
        with monkeypatch.context() as patched:
            patched.setattr(svg, "lighten", lambda figure: None)
            assert light == drawn()
        monkeypatch.setattr(layout, "LightAxes", Axes)
        assert light == drawn()


@pytest.mark.parametrize("style", ["page", "paper"])
def test_words_and_legends_measured_once_are_drawn_as_by_matplotlib(
    monkeypatch: pytest.MonkeyPatch, style: str
) -> None:
    def drawn() -> list[str]:
        found = []
        for names in (["a", "a long name\nover two lines", "", "Ωmega"], ["other"], ["with a gap below", "g"]):
            figure = svg.new_figure(4.0, 3.0)
            (axes,) = stack(figure, [1.0], header=2)
            for name in names:
                axes.plot([0.0, 1.0], [0.0, len(name)], marker="s", label=name)
            figure_legend(figure, axes, columns=2)
            legend(axes)
            axes.text(0.5, 0.5, "turned\nby 30 degrees", rotation=30.0, va="center", fontsize=11)
            found.append(svg.svg_of(figure, "figure-x"))
        return found

    with figure_style(style):
        light = drawn()
        monkeypatch.setattr(svg, "_renderer", RendererSVG)
        monkeypatch.setattr(svg, "measure_once", lambda figure: None)
        assert light == drawn()
