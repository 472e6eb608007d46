"""Two runs side by side: what changed in inputs and errors, and what counts as worse."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest

from small_campaign import SMALL, Workbench
from workbench.compare.errors import FLOOR, growth, growth_text
from workbench.compare.runs import compare_runs, differences

Change = Callable[[dict[str, str]], None]
"""Changes a row of ``summary.csv`` in place."""


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    bench = Workbench(tmp_path, monkeypatch, capsys)
    assert bench.run(SMALL, "--quick", "--out", "a").code == 0
    return bench


def rewrite(run: Path, change: Change) -> None:
    """Change rows of a stored summary."""
    path = run / "summary.csv"
    with path.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    for row in rows:
        change(row)
    with path.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def set_error(
    value: float, kind: str = "verification", measure: str = "peak_error"
) -> Callable[[dict[str, str]], None]:
    def change(row: dict[str, str]) -> None:
        if (row["case"], row["joint"], row["kind"]) == ("first", "q2", kind) and row["candidate"] == "lumped":
            row[measure] = repr(value)

    return change


def test_the_same_run_twice_differs_in_nothing(workbench: Workbench) -> None:
    assert workbench.run(SMALL, "--quick", "--out", "b").code == 0
    done = workbench("compare", "a", "b")
    assert done.code == 0
    assert "Inputs: no difference." in done.out
    assert "18 of 18 errors are the same, bit for bit." in done.out
    assert "worse" not in done.out.replace("nothing got worse", "")


def test_inputs_that_changed_are_listed(workbench: Workbench) -> None:
    other = SMALL.replace('name = "second"', 'name = "third"').replace("bound = 1e-10", "bound = 1e-9", 1)
    assert workbench.run(other, "--quick", "--out", "b", "--set", "a2*=1.01").code == 0
    found = compare_runs(Path("a"), Path("b"))
    inputs = {(d.group, d.what): (d.before, d.after) for d in found.inputs}
    assert inputs["parameter", "a2_left, a2_right"] == (0.3, 0.303)
    assert inputs["campaign", 'candidate "lumped" against lumped bound'] == (1e-10, 1e-9)
    assert not any(group == "version" for group, _ in inputs)
    assert {d.what for d in found.outcomes} == {'case "second"', 'case "third"'}
    done = workbench("compare", "a", "b")
    assert done.code == 0
    assert "18 errors in one run only" in done.out
    assert max(len(line.rstrip()) for line in done.out.splitlines()) <= 80, done.out


def test_another_version_is_an_input(workbench: Workbench) -> None:
    workbench.run(SMALL, "--quick", "--out", "b")
    path = workbench.directory / "b/manifest.json"
    manifest = json.loads(path.read_text())
    manifest["versions"]["numpy"] = "9.9.9"
    manifest["cases"]["first"]["mobility"] = 4
    path.write_text(json.dumps(manifest))
    found = compare_runs(Path("a"), Path("b"))
    assert [(d.group, d.what, d.after) for d in found.inputs] == [("version", "numpy", "9.9.9")]
    assert [(d.what, d.before, d.after) for d in found.outcomes] == [('case "first" mobility', 3, 4)]


@pytest.mark.parametrize(
    ("change", "options", "worse"),
    [
        (set_error(1e-9), (), "first: lumped against lumped, q2: peak_error"),
        (set_error(1e-9, measure="rms_error"), (), "first: lumped against lumped, q2: rms_error"),
        (set_error(1.1 * 10 * FLOOR), (), "(x11)"),
        (set_error(0.9 * 10 * FLOOR), (), None),
        (set_error(5e-12), ("--factor", "4"), "(x5.00)"),
        (set_error(1e-9), ("--floor", "1e-9"), None),
        (set_error(math.nan), (), "-> nan (lost)"),
        (set_error(math.inf), (), "-> inf (lost)"),
        (set_error(9.0, "modelling"), (), "first: lumped against distributed, q2"),
        (set_error(1e-30), (), None),
        (lambda row: row.update(verdict="fail") if row["verdict"] == "pass" else None, (), "pass -> fail"),
    ],
)  # fmt: skip
def test_what_counts_as_worse(
    workbench: Workbench, change: Change, options: tuple[str, ...], worse: str | None
) -> None:
    workbench.run(SMALL, "--quick", "--out", "b")
    rewrite(workbench.directory / "b", change)
    done = workbench("compare", "a", "b", *options)
    assert done.code == (1 if worse else 0), done.out
    if worse:
        assert any(line.startswith("worse: ") and worse in line for line in done.out.splitlines()), done.out
    # the other way round the same change is an improvement
    if worse and "nan" not in worse:
        assert workbench("compare", "b", "a", *options).code == 0


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("a", "nowhere"), "nowhere/manifest.json: missing"),
        (("a", "a", "--factor", "0.5"), "factor 0.5; allowed: a number of at least 1"),
        (("a", "a", "--factor", "nan"), "factor nan; allowed"),
        (("a", "a", "--floor", "0"), "floor 0; allowed: a positive number"),
        (("a",), "Missing argument 'RUN_B'"),
    ],
)
def test_bad_input_is_one_line(workbench: Workbench, arguments: tuple[str, ...], expected: str) -> None:
    done = workbench("compare", *arguments)
    assert done.code == 2
    assert expected in done.err
    assert len(done.complaint) == 1
    assert done.out == ""


def test_growth_is_measured_from_the_floor() -> None:
    assert growth(1e-16, 9e-13) == 1.0
    assert growth(1e-16, 5e-12) == pytest.approx(5.0)
    assert growth(5e-12, 0.0) == pytest.approx(0.2)
    assert growth(0.5, math.nan) == math.inf
    assert growth(math.nan, math.nan) == growth(math.nan, 1.0) == growth(math.inf, math.inf) == 1.0
    assert [growth_text(f) for f in (1.0, 1.24, 35.4, 3e5, 0.5, 1e-7, math.inf)] == [
        "x1.00", "x1.24", "x35", "x3e+05", "/2.00", "/1e+07", "lost",
    ]  # fmt: skip


def test_entries_of_lists_are_told_apart_by_name() -> None:
    before = {"case": [{"name": "one", "stop": 1.0}, {"name": "two", "stop": 2.0}], "title": "old"}
    after = {"case": [{"name": "new", "stop": 5.0}, {"name": "one", "stop": 1.5}, {"name": "two", "stop": 2.0}]}
    found = list(differences("campaign", "", before, after))
    assert [(d.what, d.before, d.after) for d in found] == [
        ('case "one" stop', 1.0, 1.5),
        ('case "new"', None, {"name": "new", "stop": 5.0}),
    ]
