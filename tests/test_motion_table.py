"""Motions from tables: by name and by number, with and without derivatives, in other units, from a run's series."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.polynomial import Polynomial

from workbench.errors import MotionError
from workbench.motion import JointMotion, from_csv, multi_sine, platform_from_csv, sine, time_grid

OFFSET = [0.0, 0.8, 0.7]
TERMS = [
    [(0.05, 2.0, 0.3), (0.02, 7.0, -1.0)],
    [(0.2, 5.0, 0.0)],
    [(0.1, 3.0, 1.0), (0.05, 9.0, 2.0), (-0.01, 0.0, 1.0)],
]


def gap(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest difference, over the largest expected value."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def written(path: Path, moved: JointMotion, derivatives: bool) -> Path:
    """Write a motion with all its digits."""
    groups = {"q": moved.q, "qd": moved.qd, "qdd": moved.qdd} if derivatives else {"q": moved.q}
    header = ["t", *(f"{name}{joint + 1}" for name, array in groups.items() for joint in range(array.shape[1]))]
    rows = np.column_stack([moved.t, *groups.values()])
    path.write_text("\n".join([",".join(header), *(",".join(map(repr, row)) for row in rows.tolist())]) + "\n")
    return path


@pytest.fixture
def smooth() -> JointMotion:
    return multi_sine(time_grid(0.1, 2.1, samples=801), OFFSET, TERMS)


def test_csv_with_derivatives_comes_back_bit_for_bit(tmp_path: Path, smooth: JointMotion) -> None:
    back = from_csv(written(tmp_path / "m.csv", smooth, derivatives=True))
    for name in ("t", "q", "qd", "qdd"):
        np.testing.assert_array_equal(getattr(back, name), getattr(smooth, name))


def test_csv_spline_has_the_documented_accuracy(tmp_path: Path) -> None:
    """Orders 6 and 4 inside, and the figures of the docstring, for 50 and 200 samples per period."""
    errors = {}
    for per_period in (50, 200):
        exact = sine(time_grid(0, 4 * math.pi, samples=2 * per_period + 1), [0.0], [1.0], [1.0], [0.7])
        back = from_csv(written(tmp_path / "m.csv", exact, derivatives=False), columns=["q1"])
        np.testing.assert_allclose(back.q, exact.q, atol=1e-15)
        inside = slice(per_period // 2, -per_period // 2)
        errors[per_period] = [
            np.abs(getattr(back, name) - getattr(exact, name))[part].max()
            for name in ("qd", "qdd")
            for part in (inside, slice(None))
        ]
    velocity, _, acceleration, acceleration_ends = np.log(np.divide(errors[50], errors[200])) / math.log(4)
    assert velocity == pytest.approx(6, abs=0.2)
    assert acceleration == pytest.approx(4, abs=0.2)
    assert acceleration_ends == pytest.approx(4, abs=0.3)
    assert errors[50][2] < 4e-7
    assert errors[50][3] < 1.2e-4
    assert errors[200][2] < 2e-9
    assert errors[200][3] < 5e-7


def test_csv_spline_of_a_quintic_polynomial_is_exact(tmp_path: Path) -> None:
    """On an uneven grid far from t = 0; a degree-6 term is what a quintic spline cannot hold."""
    t = 1000.0 + time_grid(0, 2, samples=15) ** 1.3
    for sixth, expected_exact in ((0.0, True), (0.5, False)):
        p = Polynomial([1, -2, 0.5, 0.3, -0.2, 0.1, sixth])
        value, first, second = (p.deriv(order)(t - 1000.0) if order else p(t - 1000.0) for order in range(3))
        exact = JointMotion(t, value[:, None], first[:, None], second[:, None])
        back = from_csv(written(tmp_path / "m.csv", exact, derivatives=False), columns=["q1"])
        assert (gap(back.qdd, exact.qdd) < 1e-9) is expected_exact


@pytest.mark.parametrize("derivatives", [True, False])
def test_csv_is_resampled(tmp_path: Path, smooth: JointMotion, derivatives: bool) -> None:
    path = written(tmp_path / "m.csv", smooth, derivatives)
    grid = time_grid(0.1, 2.1, samples=1237)
    back, exact = from_csv(path, t=grid), multi_sine(grid, OFFSET, TERMS)
    np.testing.assert_array_equal(back.t, grid)
    for name, tolerance in (("q", 1e-10), ("qd", 1e-7), ("qdd", 1e-4)):
        assert gap(getattr(back, name), getattr(exact, name)) < tolerance
    wrong = multi_sine(grid + 1e-3, OFFSET, TERMS)
    assert gap(back.q, wrong.q) > 1e-4


def test_resampled_quintic_takes_what_was_given(tmp_path: Path) -> None:
    """Given derivatives that do not fit the positions are kept at the samples, and the figure says so."""
    rng = np.random.default_rng(1)
    given_motion = JointMotion(np.array([0.0, 0.5, 2.0]), *rng.standard_normal((3, 3, 3)))
    path = written(tmp_path / "m.csv", given_motion, derivatives=True)
    back = from_csv(path, t=given_motion.t)
    for name in ("q", "qd", "qdd"):
        np.testing.assert_allclose(getattr(back, name), getattr(given_motion, name), atol=1e-13)
    assert from_csv(path).consistency().velocity.max() > 0.1
    # twice continuously differentiable: no jump across the inner sample
    around = from_csv(path, t=[0.5 - 1e-9, 0.5 + 1e-9])
    np.testing.assert_allclose(around.qdd[0], around.qdd[1], atol=1e-6)


def test_csv_may_have_any_column_order_comments_blanks_and_a_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    rows = "".join(f"{k} , {k / 10},1,2\n\n# between\n" for k in range(6))
    path.write_text(f"\ufeff# made by hand\n q2,t, q1,q3\n{rows}", encoding="utf-8")
    back = from_csv(path)
    np.testing.assert_allclose(back.t, np.arange(6) / 10)
    np.testing.assert_allclose(back.qd, [[0, 10, 0]] * 6, atol=1e-10)


HEAD = "t,q1,q2,q3\n"
GOOD = "".join(f"{k},0,0,0\n" for k in range(6))
ALL_OR_NONE = "t,q1,q2,q3 with all or none of qd1,qd2,qd3,qdd1,qdd2,qdd3"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", f"no header line; allowed: {ALL_OR_NONE}"),
        ("t,q1,q2,qq3\n", 'line 1: unknown column "qq3"; did you mean "q3"?'),
        (
            "t,q1,q2,q3,torque\n",
            'line 1: unknown column "torque"; valid: q1, q2, q3, qd1, qd2, qd3, qdd1, qdd2, qdd3, t',
        ),
        ("#\nt,q1,q2\n", f'line 2: column "q3" is missing; allowed: {ALL_OR_NONE}'),
        ("q1,q2,q3\n", f'line 1: column "t" is missing; allowed: {ALL_OR_NONE}'),
        ("t,q1,q2,q3,qd1,qd2,qd3\n", f'line 1: column "qdd1" is missing; allowed: {ALL_OR_NONE}'),
        ("t,q1,q2,q3,q1\n", 'line 1: column "q1" stands 2 times; allowed: once'),
        ("t;q1;q2;q3\n", None),
        (
            "x" * 100 + "\n",
            f'line 1: unknown column "{"x" * 40}..."; allowed: commas, semicolons or tabs between names',
        ),
        (HEAD + "0,0,0\n", "line 2: 3 cells; allowed: 4, as in the header"),
        (HEAD + "0,0,zero,0\n", 'line 2, column q2: "zero"; allowed: a finite number'),
        (HEAD + "\n0,0,,0\n", 'line 3, column q2: ""; allowed: a finite number'),
        (HEAD + "0,0,0,nan\n", 'line 2, column q3: "nan"; allowed: a finite number'),
        (HEAD + "0,inf,0,0\n", 'line 2, column q1: "inf"; allowed: a finite number'),
        (HEAD + "0,1_0,0,0\n", 'line 2, column q1: "1_0"; allowed: a finite number'),
        (HEAD + "0,\x1b[31m,0,0\n", 'line 2, column q1: "\\x1b[31m"; allowed: a finite number'),
        (HEAD + GOOD + "5,0,0,0\n", "line 8, column t: 5 s after 5 s; allowed: strictly increasing"),
        (HEAD + GOOD + "4.5,0,0,0\n", "line 8, column t: 4.5 s after 5 s; allowed: strictly increasing"),
        (HEAD + GOOD[:-8], "5 samples; allowed: at least 6 without qd and qdd columns"),
        (HEAD, "0 samples; allowed: at least 6 without qd and qdd columns"),
        ("t,q1,q2,q3,qd1,qd2,qd3,qdd1,qdd2,qdd3\n", "0 samples; allowed: at least 1 of any file"),
        (HEAD + '0,"' + "1" * 200000 + '",0,0\n', "line 2: field larger than field limit (131072)"),
        (HEAD + "0,0,0,0\r1,0,0,0\n", None),
        (
            "t,q1,q2,q3\n" + "".join(f"{k}e-200,{k % 2},0,0\n" for k in range(5)) + "1,0,0,0\n",
            "spline: time steps from 1e-200 s to 1 s are too uneven; allowed: steps of similar size",
        ),
    ],
)
def test_csv_refusals_name_file_line_column_and_value(tmp_path: Path, text: str, message: str | None) -> None:
    path = tmp_path / "m.csv"
    path.write_bytes(text.encode())
    with pytest.raises(MotionError) as caught:
        from_csv(path)
    found = str(caught.value)
    assert found.startswith(f"{path}: ")
    assert "\n" not in found
    assert caught.value.facts["file"] == str(path)
    if message is not None:
        assert found == f"{path}: {message}"


def test_spline_that_misses_its_own_samples_is_refused(tmp_path: Path) -> None:
    """Steps graded over many decades: SciPy returns a spline without a word, and it does not pass its samples."""
    rng = np.random.default_rng(0)
    for decades, refused in ((2, False), (12, True)):
        t = np.cumsum(10.0 ** rng.uniform(-decades, 0, 40))
        samples = JointMotion(t, *(rng.standard_normal((40, 1)) for _ in range(3)))
        path = written(tmp_path / "m.csv", samples, derivatives=False)
        if refused:
            with pytest.raises(MotionError, match=r"m\.csv: spline: time steps from \S+ s to \S+ s are too uneven"):
                from_csv(path, columns=["q1"])
        else:
            np.testing.assert_allclose(from_csv(path, columns=["q1"]).q, samples.q, atol=1e-11)


def test_csv_refusal_keeps_the_facts(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    path.write_text(HEAD + "0,0,zero,0\n")
    with pytest.raises(MotionError) as caught:
        from_csv(path)
    assert caught.value.facts == {"file": str(path), "line": 2, "column": "q2", "value": "zero"}


def test_csv_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(MotionError, match=r"none\.csv: cannot be read: No such file or directory$"):
        from_csv(tmp_path / "none.csv")
    with pytest.raises(MotionError, match=r"cannot be read: Is a directory$"):
        from_csv(tmp_path)
    with pytest.raises(MotionError, match=r"cannot be read: embedded null"):
        from_csv("a\0b")
    (tmp_path / "latin.csv").write_bytes(HEAD.encode() + b"0,\xe9,0,0\n")
    with pytest.raises(MotionError, match=r"latin\.csv: not UTF-8 text \(byte \d+\)$"):
        from_csv(tmp_path / "latin.csv")


def test_csv_with_more_samples_than_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "m.csv"
    path.write_text(HEAD + GOOD)
    monkeypatch.setattr("workbench.motion.table.MAX_SAMPLES", 6)
    assert len(from_csv(path).t) == 6
    monkeypatch.setattr("workbench.motion.table.MAX_SAMPLES", 5)
    with pytest.raises(MotionError, match=r"m\.csv: line 7: more samples than allowed: 5$"):
        from_csv(path)


def test_csv_is_not_extrapolated(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    path.write_text(HEAD + GOOD)
    for grid, moment in (([-0.1, 1.0], "-0.1"), ([1.0, 5.1], "5.1")):
        with pytest.raises(MotionError) as caught:
            from_csv(path, t=grid)
        assert str(caught.value) == f"{path}: t = {moment} s is outside the file; allowed: 0 s to 5 s"
    path.write_text("t,q1,qd1,qdd1\n1,0,0,0\n")
    assert len(from_csv(path, columns=["q1"]).t) == 1
    with pytest.raises(MotionError, match=r"1 samples; allowed: at least 2 to resample$"):
        from_csv(path, columns=["q1"], t=[1.0])


@pytest.mark.parametrize("columns", ["q1", [], [""], ["q1", "q1"], ["q1", "qd1"], ["a", "a_d"], ["t"]])
def test_csv_column_names_that_cannot_work(columns: list[str]) -> None:
    with pytest.raises(MotionError, match=r"^columns = .*; allowed: "):
        from_csv("m.csv", columns=columns)


# --- names, units, series ---------------------------------------------------------------------------------------------

ROWS = "".join(f"{0.1 * k!r},{0.2 * k!r},{0.5 + 0.01 * k * k!r}\n" for k in range(8))


@pytest.mark.parametrize(
    "header", ["t,crank,slide", "time,crank,slide", "t,q1,q2", "T,Crank,SLIDE", "t [s],crank_rad,slide (m)"]
)
def test_joints_are_found_by_name_or_by_number(tmp_path: Path, header: str) -> None:
    path = tmp_path / "m.csv"
    path.write_text(f"{header}\n{ROWS}")
    found = from_csv(path, ["crank", "slide"], units=["rad", "m"])
    np.testing.assert_allclose(found.q[:, 0], 0.2 * np.arange(8))
    np.testing.assert_allclose(found.qd[:, 0], 2.0, atol=1e-9)
    swapped = from_csv(path, ["slide", "crank"]) if "crank" in header.lower() else None
    assert swapped is None or np.array_equal(swapped.q[:, 0], found.q[:, 1])


def test_derivatives_go_by_the_names_of_their_joints(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    for names in ("crank_d,q2_d,crank_dd,q2_dd", "crank_d,qd2,crank_dd,qdd2"):
        path.write_text(f"t,crank,q2,{names}\n0,1,2,3,4,5,6\n1,1,2,3,4,5,6\n")
        found = from_csv(path, ["crank", "q2"])
        np.testing.assert_array_equal(np.hstack([found.q, found.qd, found.qdd])[0], [1, 2, 3, 4, 5, 6])
    path.write_text("t,crank,q2,crank_d\n0,1,2,3\n")
    with pytest.raises(
        MotionError, match=r'column "qd2" is missing; allowed: t,crank,q2 with all or none of crank_d,qd2'
    ):
        from_csv(path, ["crank", "q2"])
    path.write_text("t,crank\n0,1\n")
    with pytest.raises(MotionError, match=r'line 1: column "q2" is missing; allowed: t,crank,q2 with all or none'):
        from_csv(path, ["crank", "q2"])
    path.write_text("t,crnk,q2\n0,1,2\n")
    with pytest.raises(MotionError, match=r'unknown column "crnk"; did you mean "crank"\?'):
        from_csv(path, ["crank", "q2"])


def test_units_of_headers_are_taken_to_si_or_refused(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    path.write_text("Time [ms];crank [deg];slide [mm]\n" + "".join(f"{100 * k};{k},5;{10 * k},25\n" for k in range(8)))
    found = from_csv(path, ["crank", "slide"], units=["rad", "m"])
    np.testing.assert_allclose(found.t, 0.1 * np.arange(8))
    np.testing.assert_allclose(found.q[:, 0], np.radians(np.arange(8) + 0.5))
    np.testing.assert_allclose(found.q[:, 1], 1e-3 * (10 * np.arange(8) + 0.25))
    with pytest.raises(MotionError, match=r'column "crank \[deg\]": "deg" measures rad; allowed: m, mm'):
        from_csv(path, ["crank", "slide"], units=["m", "m"])


def test_the_series_of_a_run_reads_back_bit_for_bit(tmp_path: Path, smooth: JointMotion) -> None:
    """As Parquet, where joints are counted whatever their names; and as a table made from it."""
    columns = {"t": smooth.t}
    for name in ("q", "qd", "qdd"):
        columns |= {f"{name}{k + 1}": getattr(smooth, name)[:, k] for k in range(3)}
    others = ("x1", "xd1", "xdd3", "ref_distributed_crank", "cand_mine_q1", "reaction_loop_x", "closure_residual")
    columns |= dict.fromkeys(others, smooth.t)
    frame = pd.DataFrame(columns)
    frame.to_parquet(tmp_path / "case.parquet", index=False)
    frame.to_csv(tmp_path / "case.csv", index=False)
    for file in ("case.parquet", "case.csv"):
        for joints in (("q1", "q2", "q3"), ("crank", "arm", "slide")):
            back = from_csv(tmp_path / file, joints)
            for name in ("t", "q", "qd", "qdd"):
                np.testing.assert_array_equal(getattr(back, name), getattr(smooth, name))
    np.testing.assert_array_equal(from_csv(tmp_path / "case.parquet", ("q3", "q1", "q2")).q, smooth.q)
    with pytest.raises(MotionError, match="actuator order, and the joints have these names in another"):
        from_csv(tmp_path / "case.csv", ("q3", "q1", "q2"))
    with pytest.raises(MotionError, match=r'case\.parquet: line 1: column "q4" is missing'):
        from_csv(tmp_path / "case.parquet", ("a", "b", "c", "d"))


@pytest.mark.parametrize("spoil", ["cut", "text", "nan"])
def test_parquet_files_that_hold_no_motion_are_refused(tmp_path: Path, spoil: str) -> None:
    path = tmp_path / "m.parquet"
    frame = pd.DataFrame({"t": [0.0, 1.0], "q1": ["a", "b"] if spoil == "text" else [0.0, float("nan")]})
    frame.to_parquet(path)
    if spoil == "cut":
        path.write_bytes(path.read_bytes()[:50])
    with pytest.raises(MotionError, match=r"m\.parquet: (no Parquet file|row 2, column q1: nan)") as caught:
        from_csv(path, ["q1"])
    assert "\n" not in str(caught.value)


def test_a_pipe_is_refused_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "m.csv")
    with pytest.raises(MotionError, match=r"m\.csv: cannot be read: no regular file$"):
        from_csv(tmp_path / "m.csv")


def test_platform_tables_have_named_coordinates(tmp_path: Path) -> None:
    path = tmp_path / "p.csv"
    path.write_text("t,ry,x [mm],z\n" + "".join(f"{k},{0.1 * k},{1000 * k},0.5\n" for k in range(8)))
    found = platform_from_csv(path, ["x", "z", "ry"])
    assert (found.coordinates, found.units) == (("x", "z", "ry"), ("m", "m", "rad"))
    np.testing.assert_allclose(found.x[3], [3.0, 0.5, 0.3])
    np.testing.assert_allclose(found.xd, [[1.0, 0.0, 0.1]] * 8, atol=1e-9)
    path.write_text("t,x1,x2,xd1,xd2,xdd1,xdd2\n0,1,2,3,4,5,6\n")
    np.testing.assert_array_equal(platform_from_csv(path, ["y", "rz"]).xdd, [[5, 6]])
    path.write_text("t,x,xd,xdd\n0,1,2,3\n")
    np.testing.assert_array_equal(platform_from_csv(path, ["x"]).xd, [[2]])
    with pytest.raises(MotionError, match='task coordinate "q1"; valid: rx, ry, rz, x, y, z'):
        platform_from_csv(path, ["q1"])
