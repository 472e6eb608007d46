"""Run directories that somebody edited: what no run writes is refused, with file and column, before it is drawn."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from stored_pictures import store_pictures
from test_report import make_run
from workbench.campaign import verdict
from workbench.campaign.store import write_series
from workbench.errors import OutputError
from workbench.parquet_columns import read_columns
from workbench.report import tables
from workbench.report.build import build_report
from workbench.report.load import load_run

Edit = Callable[[pa.Table], pa.Table]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_run(tmp_path_factory.mktemp("made") / "run", samples=40)


@pytest.fixture
def run(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "run"))


def put(table: pa.Table, name: str, values: object) -> pa.Table:
    return table.set_column(table.column_names.index(name), name, pa.array(values))


def full(value: float) -> Edit:
    return lambda table: pa.table({name: np.full(table.num_rows, value) for name in table.column_names})


SERIES: dict[str, tuple[Edit, str]] = {
    "fewer rows": (lambda t: t.slice(0, 3), "3 rows, where manifest.json has 40 samples"),
    "no rows": (lambda t: t.slice(0, 0), "0 rows, where manifest.json has 40 samples"),
    "many rows of nothing": (
        lambda t: pa.table({name: pa.nulls(300_000, pa.float64()) for name in t.column_names}), "300000 rows",
    ),
    "a text": (lambda t: put(t, "q2", ["x"] * t.num_rows), 'column "q2" is of type string; allowed: numbers'),
    "a list": (lambda t: put(t, "x1", [[1.0]] * t.num_rows), 'column "x1" is of type list'),
    "one name for all": (lambda t: t.rename_columns(["t"] * t.num_columns), 'column "t" stands'),
    "a column renamed": (lambda t: t.rename_columns(["z", *t.column_names[1:]]), 'column "t" is missing'),
    "nan": (full(np.nan), "row 1: t is nan; allowed"),
    "inf": (lambda t: put(t, "ref_lumped_q1", np.full(t.num_rows, np.inf)), "row 1: ref_lumped_q1 is inf; allowed"),
    "beyond any figure": (
        lambda t: put(t, "reaction_spherical_E_x", np.full(t.num_rows, -1e308)), "reaction_spherical_E_x is -1e+308",
    ),
    "time that goes back": (lambda t: put(t, "t", t["t"].to_numpy()[::-1].copy()), "row 2: t does not grow"),
}  # fmt: skip


@pytest.mark.parametrize("what", SERIES)
def test_a_series_that_no_run_writes(run: Path, what: str) -> None:
    edit, said = SERIES[what]
    path = run / "series" / "sim1.parquet"
    pq.write_table(edit(pq.ParquetFile(path).read()), path)
    with pytest.raises(OutputError, match=re.escape(said)) as error:
        load_run(run).series("sim1")
    assert "sim1.parquet: " in str(error.value)


def test_gaps_of_a_formula_that_failed_are_no_fault(run: Path) -> None:
    path = run / "series" / "sim1.parquet"
    table = pq.ParquetFile(path).read()
    pq.write_table(put(table, "cand_lumped_q1", np.full(table.num_rows, np.nan)), path)
    assert np.isnan(load_run(run).series("sim1")["cand_lumped_q1"]).all()


@pytest.mark.parametrize(
    ("column", "value", "said"),
    [
        ("verdict", "great", "verdict is 'great'; allowed: pass, fail"),
        ("kind", "nonsense", "kind is 'nonsense'; allowed: verification"),
        ("peak_error", "1e308", "peak_error is '1e308'; allowed: at most 1e+100"),
        ("worst_time_s", "-1e200", "worst_time_s is '-1e200'; allowed: at most"),
    ],
)
def test_a_word_or_number_that_no_run_writes(run: Path, column: str, value: str, said: str) -> None:
    lines = (run / "summary.csv").read_text().splitlines()
    cells = lines[1].split(",")
    cells[lines[0].split(",").index(column)] = value
    (run / "summary.csv").write_text("\n".join([lines[0], ",".join(cells), *lines[2:]]) + "\n")
    with pytest.raises(OutputError, match=re.escape(said)):
        load_run(run)


def test_the_reader_knows_every_word_that_a_run_writes() -> None:
    written = {value for name, value in vars(verdict).items() if name.isupper() and isinstance(value, str)}
    assert written == {*tables.VERDICT_STATUS, *tables.KINDS}


@pytest.mark.parametrize("version", [True, 1.0, "1", None])
def test_a_format_is_a_whole_number(run: Path, version: object) -> None:
    manifest = json.loads((run / "manifest.json").read_text())
    (run / "manifest.json").write_text(json.dumps(manifest | {"format": version}))
    with pytest.raises(OutputError, match=r"format .* is not supported"):
        load_run(run)


def test_endless_lists_of_names_are_refused(run: Path) -> None:
    manifest = json.loads((run / "manifest.json").read_text())
    (run / "manifest.json").write_text(json.dumps(manifest | {"platform_axes": ["x1"] * 4000}))
    with pytest.raises(OutputError, match="platform_axes") as error:
        load_run(run)
    assert len(str(error.value)) < 400


@pytest.mark.parametrize("folder", ["figures", "tables"])
@pytest.mark.usefixtures("undrawn")
def test_a_report_is_written_into_its_run_alone(run: Path, tmp_path: Path, folder: str) -> None:
    (tmp_path / "elsewhere").mkdir()
    (run / folder).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OutputError, match=f"{folder}: is a symbolic link"):
        build_report(run, ["md"] if folder == "figures" else ["pdf"])
    assert list((tmp_path / "elsewhere").iterdir()) == []


@pytest.mark.usefixtures("undrawn")
def test_a_report_that_cannot_be_written_names_its_own_file(run: Path) -> None:
    (run / "report.md").mkdir()
    with pytest.raises(OutputError, match=r"report\.md: the report cannot be written"):
        build_report(run, ["md"])
    assert not list(run.glob(".*"))


@pytest.mark.usefixtures("undrawn")
def test_a_link_to_itself_is_no_missing_picture(run: Path) -> None:
    store_pictures(run)
    record = run / "pictures" / "pictures.json"
    record.unlink()
    record.symlink_to(record.name)
    with pytest.raises(OutputError, match=r"pictures\.json"):
        build_report(run, ["md"])


@pytest.mark.usefixtures("undrawn")
def test_a_malformed_still_is_named(run: Path) -> None:
    store_pictures(run)
    (run / "pictures" / "mechanism.webp").write_bytes(b"RIFF\0\0\0\0WEBP" + b"x" * 100)
    with pytest.raises(OutputError, match=r"mechanism\.webp: no WebP picture"):
        build_report(run, ["pdf"])


# --- columns of a data set --------------------------------------------------------------------------------------------

GOOD = {"index": [0, 1], "case": ["a", "b"], "error": [1.0, None]}
BAD: dict[str, tuple[dict[str, object], str]] = {
    "an index of texts": ({"index": ["0", "1"]}, 'column "index" is of type string; allowed: whole numbers'),
    "an index with a gap": ({"index": [0, None]}, 'column "index" has gaps'),
    "names of numbers": ({"case": [1, 2]}, 'column "case" is of type int64; allowed: texts'),
    "errors of texts": ({"error": ["x", "y"]}, 'column "error" is of type string; allowed: numbers'),
}


def stored(path: Path, columns: dict[str, object]) -> Path:
    pq.write_table(pa.table(columns), path)
    return path


def test_columns_are_read(tmp_path: Path) -> None:
    path = stored(tmp_path / "part.parquet", GOOD)
    assert read_columns(path, tuple(GOOD), 10_000, ("case",), ("index",)).to_pydict() == GOOD


@pytest.mark.parametrize("what", BAD)
def test_columns_of_another_kind(tmp_path: Path, what: str) -> None:
    change, said = BAD[what]
    path = stored(tmp_path / "part.parquet", GOOD | change)
    with pytest.raises(OutputError, match=re.escape(said)):
        read_columns(path, tuple(GOOD), 10_000, ("case",), ("index",))


def test_more_values_than_memory_should_hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workbench.parquet_columns.MOST_VALUES", 5)
    path = stored(tmp_path / "part.parquet", GOOD)
    with pytest.raises(OutputError, match="2 rows of 3 columns; allowed: 5 values"):
        read_columns(path, None, 10_000, ("case",))
    with pytest.raises(OutputError, match="has more than 10 bytes"):
        read_columns(path, None, 10)


@pytest.mark.parametrize("checked", [True, False])
def test_a_changed_byte_gives_no_other_numbers(tmp_path: Path, checked: bool) -> None:
    """Pages carry checksums; the twin without them reads wrong numbers as if they were right."""
    random = np.random.default_rng(7)
    columns = {f"c{i}": random.normal(size=30) for i in range(12)}
    write_series(tmp_path, "right", columns)
    right = (tmp_path / "series" / "right.parquet").read_bytes()
    if not checked:
        sink = pa.BufferOutputStream()
        pq.write_table(pa.table(columns), sink)
        right = sink.getvalue().to_pybytes()
    changes = [(int(place), int(random.integers(8))) for place in random.integers(4, len(right), 300)]
    if checked:  # what stands after the last column's name: rows of the file's parts, which no checksum covers
        after = right.rindex(b"c11")
        changes += [(place, bit) for place in range(after, after + 100) for bit in range(8)]
    wrong, path = 0, tmp_path / "changed.parquet"
    for place, bit in changes:
        path.write_bytes(right[:place] + bytes([right[place] ^ (1 << bit)]) + right[place + 1 :])
        try:
            found = read_columns(path, tuple(columns), 10_000_000)
        except OutputError:
            continue
        wrong += any((found.column(name).to_numpy() != values).any() for name, values in columns.items())
    assert (wrong == 0) == checked
