"""Dialects of tables: each is read like the plain one, or refused in one line that names what was seen."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.delimited import Table, factor_of, find_columns, parse_table, read_table, split_unit
from workbench.delimited.units import UNITS
from workbench.errors import MotionError

VALUES = [[0.0, 0.7], [0.5, -1.25], [1.0, 2e-3]]


def parsed(text: str | bytes) -> Table:
    return parse_table(text if isinstance(text, bytes) else text.encode(), "m.csv", MotionError)


def refusal(text: str | bytes) -> str:
    with pytest.raises(MotionError) as caught:
        parsed(text)
    assert "\n" not in str(caught.value)
    assert caught.value.facts["file"] == "m.csv"
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "names", "units"),
    [
        ("t,q1\n0,0.7\n0.5,-1.25\n1,2e-3\n", ["t", "q1"], [None, None]),
        ("t;q1\n0;0.7\n0.5;-1.25\n1;2e-3\n", ["t", "q1"], [None, None]),
        ("t;q1\n0,0;0,7\n0,5;-1,25\n1,0;2e-3\n", ["t", "q1"], [None, None]),
        ("t\tq1\n0\t0.7\n0.5\t-1.25\n1\t2e-3\n", ["t", "q1"], [None, None]),
        ("t\tq1\n0\t0,7\n0,5\t-1,25\n1\t2e-3\n", ["t", "q1"], [None, None]),
        ('"t","q1"\n"0,0","0,7"\n"0,5","-1,25"\n"1,0","2e-3"\n', ["t", "q1"], [None, None]),
        ("t,q1,\n0,0.7,\n0.5,-1.25,\n1,2e-3,\n", ["t", "q1"], [None, None]),
        ("t,q1\n0,0.7,\n0.5,-1.25,,\n1,2e-3\n", ["t", "q1"], [None, None]),
        ("\ufeff% exported\r\nt,q1\r\n0,0.7\r\n// note\r\n0.5,-1.25\r\n\r\n1,2e-3", ["t", "q1"], [None, None]),
        ("t,q1\r0,0.7\r0.5,-1.25\r1,2e-3\r", ["t", "q1"], [None, None]),
        ("# t,q1\n0,0.7\n0.5,-1.25\n1,2e-3\n", ["t", "q1"], [None, None]),
        ("sep=;\nt;q1\n0;0.7\n0.5;-1.25\n1;2e-3\n", ["t", "q1"], [None, None]),
        ("t,q1\ns,rad\n0,0.7\n0.5,-1.25\n1,2e-3\n", ["t", "q1"], ["s", "rad"]),
        ("t;q1\n[s];[deg]\n0;0,7\n0,5;-1,25\n1;2e-3\n", ["t", "q1"], ["s", "deg"]),
        ('"Time [s]","q1 [rad]"\n0,0.7\n0.5,-1.25\n1,2e-3\n', ["Time", "q1"], ["s", "rad"]),
        ('"Time, s";q1\n0;0.7\n0.5;-1.25\n1;2e-3\n', ["Time, s", "q1"], [None, None]),
        ('# it\'s 5" long\nt,q1\n0,0.7\n# 5" again\n0.5,-1.25\n1,2e-3\n', ["t", "q1"], [None, None]),
    ],
)
def test_each_dialect_reads_as_the_plain_one(text: str, names: list[str], units: list[str | None]) -> None:
    table = parsed(text)
    assert list(table.names) == names
    assert [a or b for a, b in zip(table.line_units, table.header_units, strict=True)] == units
    np.testing.assert_array_equal(table.values, VALUES)
    twin = text.replace("1,25", "1,26").replace("1.25", "1.26")
    assert not np.array_equal(parsed(twin).values, VALUES)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "m.csv: no header line; allowed: column names"),
        ("\n# nothing\n;;\n", "m.csv: no header line; allowed: column names"),
        ("0,0.7\n", 'line 1: numbers where the header should be: "0,0.7"; allowed: column names'),
        ("t,q1;q2\n", "line 1: commas and semicolons in the header; allowed: one separator, or names in quotes"),
        ("t,q1\n0,0,0,7\n", "line 2: 4 cells; allowed: 2, as in the header; decimal commas need semi"),
        ("t;q1\n0,0.7\n", "line 2: 1 cells; allowed: 2, as in the header; commas in this line, semi"),
        ("t;q1\n0,5;0.7\n", '"0,5" has a decimal comma, and "0.7" (line 2, column q1) a point; allowed: one of both'),
        ("t;q1\n0;0.7\n1;0,7\n", 'line 3: column q1: "0,7" has a decimal comma, and "0.7" (line 2, column q1) a point'),
        ("t;q1\n1;1,234\n2;2,345\n", 'line 2: column q1: "1,234": a decimal comma, or one between thousands?'),
        ("t;q1\n1;1.234,5\n", 'line 2, column q1: "1.234,5"; allowed: a finite number without signs between thousands'),
        ("t;q1\n1;1 234\n", 'column q1: "1 234"; allowed: a finite number without signs between thousands'),
        ("t,q1\ns,parsec\n", 'line 2, column t: "s"; allowed: a finite number'),
        ("t,q1\n0,\n", 'line 2, column q1: ""; allowed: a finite number'),
        ("t,q1\n0,1_0\n", '"1_0"; allowed: a finite number'),
        ("t,q1\n0,\u0661\n", "allowed: a finite number"),
        ("t,q1\n0,NaN\n", '"NaN"; allowed: a finite number'),
        ('t,q1\n0,"1\n2,3\n', "line 2: ", ),
        (b"\xff\xfet\x00", "m.csv: UTF-16 text; allowed: UTF-8"),
        (b"t,q\xe91\n", "m.csv: not UTF-8 text (byte 3)"),
        (",".join(f"c{k}" for k in range(10_001)), "line 1: 10001 columns; allowed: at most 10000"),
    ],
)  # fmt: skip
def test_what_is_not_clear_is_refused_by_line_and_column(text: str | bytes, message: str) -> None:
    found = refusal(text)
    if message.startswith('line 2, column t: "0,5" has'):  # where the first comma stands
        message = 'line 2: column t: "0,5" has a decimal comma, and "0.7" (line 2, column q1) a point'
    assert message in found


def test_only_regular_files_are_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(MotionError, match=r"pipe\.csv: cannot be read: no regular file$"):
        read_table(tmp_path / "pipe.csv", MotionError)
    (tmp_path / "large.csv").write_bytes(b"t,q1\n")
    os.truncate(tmp_path / "large.csv", 2**40)
    with pytest.raises(MotionError, match=r"1099511627776 bytes; allowed: at most 268435456$"):
        read_table(tmp_path / "large.csv", MotionError)


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("Time [s]", ("Time", "s")), ("t (s)", ("t", "s")), ("time_s", ("time", "s")), ("t / ms", ("t", "ms")),
        ("time/s", ("time", "s")), ("q1[deg]", ("q1", "deg")), ("q1", ("q1", None)), ("crank_d", ("crank_d", None)),
        ("q1 <rad>", ("q1", "rad")), ("q1 [furlong]", ("q1", "furlong")), ("qd1 (deg/s)", ("qd1", "deg/s")),
        ("_s", ("_s", None)), ("[s]", ("", "s")), ("tau1 [N m]", ("tau1", "N m")), ("x / mm", ("x", "mm")),
    ],
)  # fmt: skip
def test_units_are_taken_off_headers(header: str, expected: tuple[str, str | None]) -> None:
    assert split_unit(header) == expected


def test_units_are_worth_what_they_say() -> None:
    assert factor_of("mm", "m") == 1e-3
    assert factor_of("deg/s^2", "rad/s^2") == pytest.approx(np.pi / 180)
    assert factor_of("rpm", "rad/s") == pytest.approx(2 * np.pi / 60)
    assert factor_of("N mm", "N m") == factor_of("Nmm", "N m") == 1e-3
    assert factor_of("kN", "N") == 1e3
    assert factor_of("deg", "m") is None
    assert factor_of("furlong", "m") is None
    # per second and per second squared go with the unit that they are made of
    for unit, (kind, factor) in UNITS.items():
        if unit.endswith("/s") and kind.endswith("/s"):
            assert UNITS[unit.removesuffix("/s")] == (kind.removesuffix("/s"), factor)


def test_columns_are_found_by_name_unit_and_capitals() -> None:
    table = parsed("Time [ms],Q1 [deg],leg_m,q2\n500,180,3,4\n")
    found = find_columns(table, {"t": ["s"], "q1": ["rad"], "leg_m": ["rad"], "q2": ["m"], "no": ["m"]}, MotionError)
    assert {name: column.si(table)[0] for name, column in found.items()} == {
        "t": 0.5, "q1": pytest.approx(np.pi), "leg_m": 3.0, "q2": 4.0,
    }  # fmt: skip
    for text, message in (
        ("t,q1 [m]\n0,0\n", '"q1 [m]": "m" measures m; allowed: rad, deg'),
        ("t,q1 [furlong]\n0,0\n", '"furlong" is no unit known here; allowed: rad, deg'),
        ("t,q1 [rad],q1 [deg]\n0,0,0\n", 'column "q1" stands 2 times; allowed: once'),
    ):
        with pytest.raises(MotionError) as caught:
            find_columns(parsed(text), {"q1": ["rad"]}, MotionError)
        assert message in str(caught.value)


NUMBERS = st.floats(-1e6, 1e6).map(lambda number: round(number, 9))


@given(
    rows=st.lists(st.lists(NUMBERS, min_size=3, max_size=3), min_size=1, max_size=6),
    separator=st.sampled_from([",", ";", "\t"]),
    decimal=st.sampled_from([".", ","]),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
    mark=st.sampled_from([b"", b"\xef\xbb\xbf"]),
    comment=st.sampled_from(["", "# a; b, c\n", "% 1,2\n", "// x\n"]),
    header=st.sampled_from([("t", "a", "b"), ("t [s]", "a [m]", "b (rad)"), ("time_s", "a", "b")]),
    units=st.booleans(),
    trailing=st.integers(0, 2),
)
@settings(max_examples=200, deadline=None)
def test_whatever_dialect_writes_a_table_it_reads_back_or_is_refused(
    rows: list[list[float]], separator: str, decimal: str, end: str, mark: bytes, comment: str,
    header: tuple[str, ...], units: bool, trailing: int,
) -> None:  # fmt: skip
    lines = [[*header], *([["s", "m", "rad"]] if units else [])]
    lines += [[f"{number:.9f}".replace(".", decimal) for number in row] for row in rows]
    text = comment + "".join(separator.join(line) + separator * trailing + "\n" for line in lines)
    data = mark + text.replace("\n", end).encode()
    if separator == decimal == ",":
        assert "cells; allowed: 3" in refusal(data)
        return
    table = parsed(data)
    np.testing.assert_array_equal(table.values, rows)
    assert (table.separator, table.decimal) == (separator, decimal)


@given(data=st.one_of(st.binary(max_size=200), st.text(alphabet='t0123.,;\t\n\r"#%/ qn-e[]s_', max_size=200)))
@settings(max_examples=400, deadline=None)
def test_any_bytes_are_a_table_or_one_line(data: bytes | str) -> None:
    try:
        table = parsed(data)
    except MotionError:
        assert refusal(data).startswith("m.csv: ")
    else:
        assert table.values.shape == (len(table.lines), len(table.headers))
        assert np.isfinite(table.values).all()
