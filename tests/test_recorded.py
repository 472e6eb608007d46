"""Recorded torques: read in every dialect, held against the reference with what their motion leaves open."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from own_mechanisms import FOURBAR
from workbench.campaign.run import run_campaign
from workbench.errors import MotionError, SpecError
from workbench.mjcf.setup import Setup
from workbench.recorded.align import align, estimate_offset
from workbench.recorded.propagate import uncertainty
from workbench.recorded.read import Wanted, read_record
from workbench.recorded.regression import columns_of, sentence, split, units_of
from workbench.recorded.smoothing import smooth
from workbench.recorded.trend import Trend, trend_of
from workbench.reference import MujocoReference

GUESS = (("crank", 1.0), ("elbow", -0.5), ("wrist", -1.5))

CAMPAIGN = """format = 1
name = "recorded"
title = "recorded"
model = "fourbar.xml"
actuated = ["crank"]
platform_site = "coupler"
initial = { crank = 1.0, elbow = -0.5, wrist = -1.5 }
[[case]]
name = "bench"
motion = { kind = "recorded", file = "table.csv" }
[[recorded]]
label = "ADAMS 2010"
file = "table.csv"
"""


def motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A crank that swings, one column."""
    w = np.array([3.0, 7.0])
    a = np.array([0.3, 0.05])
    s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    return (1.1 + s @ a)[:, None], (c @ (a * w))[:, None], (-s @ (a * w**2))[:, None]


def written(folder: Path, digits: int | None, more: str = "", factor: float = 1.002, noise: float = 0.0) -> Path:
    """A four-bar's torques with a planted scale, the coordinate with so many decimals; returns the campaign."""
    (folder / "fourbar.xml").write_text(FOURBAR, encoding="utf-8")
    reference = MujocoReference(
        folder / "fourbar.xml", setup=Setup(actuated=("crank",), platform_site="coupler", initial=GUESS)
    )
    t = np.linspace(0.0, 2.0, 401)
    q, qd, qdd = motion(t)
    tau = factor * reference.inverse_dynamics(q, qd, qdd).tau
    tau = tau + noise * np.abs(tau).max() * np.random.default_rng(1).standard_normal(tau.shape)
    q = q if digits is None else np.round(q, digits)
    rows = "".join(f"{a!r},{float(b)!r},{float(c)!r}\n" for a, b, c in zip(t.tolist(), q[:, 0], tau[:, 0], strict=True))
    (folder / "table.csv").write_text("t,crank,tau_crank\n" + rows, encoding="utf-8")
    text = CAMPAIGN + more
    (folder / "recorded.toml").write_text(text, encoding="utf-8")
    return folder / "recorded.toml"


def test_few_digits_are_no_false_alarm_and_all_digits_find_what_was_planted(tmp_path: Path) -> None:
    run = run_campaign(written(tmp_path, 3), tmp_path / "few")
    (row,) = [row for row in run.rows if row.kind == "recorded"]
    facts = run.manifest["cases"]["bench"]["recorded"]["ADAMS 2010"]
    assert run.conclusion.status == "nothing-judged"
    assert row.verdict == "agrees"
    assert row.uncertainty > 0.002
    reason = facts["joints"]["crank"]["reason"]
    assert reason.startswith("agrees within its uncertainty: ")
    assert "4 digits every 5 ms" in reason
    assert "digits would decide 0.1 %" in reason
    assert not any(row.kind == "modelling" for row in run.rows)

    run = run_campaign(written(tmp_path, None), tmp_path / "full")
    (row,) = [row for row in run.rows if row.kind == "recorded"]
    assert row.verdict == "differs"
    assert row.uncertainty < 1e-5
    (part,) = run.manifest["cases"]["bench"]["recorded"]["ADAMS 2010"]["joints"]["crank"]["parts"]
    assert part["name"] == "scale"
    assert abs(part["value"] - 0.002) < 4.0 * part["standard_error"] + 1e-8
    assert part["standard_error"] < 1e-6


def test_a_scale_is_found_through_noise_and_a_bound_is_judged(tmp_path: Path) -> None:
    bound = "bound = 0.08\n"
    run = run_campaign(written(tmp_path, None, bound, factor=1.02, noise=0.005), tmp_path / "run")
    (row,) = [row for row in run.rows if row.kind == "recorded"]
    assert row.verdict == "pass"
    facts = run.manifest["cases"]["bench"]["recorded"]["ADAMS 2010"]["joints"]["crank"]
    found = {part["name"]: part for part in facts["parts"]}
    assert abs(found["scale"]["value"] - 0.02) < 4.0 * found["scale"]["standard_error"]
    assert found["scale"]["standard_error"] < 0.002
    assert facts["torque_noise"] == pytest.approx(0.005 * row.peak_reference * 1.0, rel=0.25)
    # finer than the record: undecided, and that fails; far too small: fails
    for value, verdict in (("0.021", "undecided"), ("0.001", "fail")):
        campaign = written(tmp_path, None, f"bound = {value}\n", factor=1.02, noise=0.005)
        run = run_campaign(campaign, tmp_path / "run")
        (row,) = [row for row in run.rows if row.kind == "recorded"]
        assert (row.verdict, run.passed) == (verdict, False)


def test_the_report_says_why_and_draws_the_band(tmp_path: Path) -> None:
    from workbench.report import build_report

    run_campaign(written(tmp_path, 3), tmp_path / "run")
    build_report(tmp_path / "run", ("html", "md", "csv", "mat"))
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert "Measured or simulated elsewhere" in page
    assert "agrees within its uncertainty" in page
    series = pd.read_parquet(tmp_path / "run" / "series" / "bench.parquet")
    assert {"rec_ADAMS 2010_crank", "band_ADAMS 2010_crank"} <= set(series.columns)
    tidy = pd.read_csv(tmp_path / "run" / "data" / "bench.csv")
    assert set(tidy.columns) == {"t_s", "name", "value", "unit"}
    assert set(tidy[tidy["name"] == "rec_ADAMS 2010_crank"]["unit"]) == {"N m"}
    from scipy.io import loadmat

    found = loadmat(tmp_path / "run" / "data" / "bench.mat", simplify_cells=True)
    assert np.array_equal(found["rec_ADAMS_2010_crank"], series["rec_ADAMS 2010_crank"])
    assert found["units"]["rec_ADAMS_2010_crank"] == "N m"


# --- derivatives ------------------------------------------------------------------------------------------------------


def test_exact_samples_are_run_through_and_rounded_ones_smoothed() -> None:
    t = np.arange(401) * 0.005
    q, _, qdd = (column[:, 0] for column in motion(t))
    exact = smooth(t, q)
    assert np.abs(exact.q - q).max() < 1e-12
    assert np.abs(exact.qdd - qdd).max() < 1e-5 * np.abs(qdd).max()
    rounded = smooth(t, np.round(q, 4), 0.5e-4)
    error = np.abs(rounded.qdd - qdd)
    assert error.max() < 0.1 * np.abs(qdd).max()
    # twin: differences of the same samples are useless
    assert np.abs(np.gradient(np.gradient(np.round(q, 4), t), t) - qdd).max() > 3.0 * error.max()
    sigma = np.sqrt(rounded.covariance[:, 2, 2])
    assert np.mean(error < 2.0 * sigma) > 0.9
    assert np.median(error) > 0.05 * np.median(sigma)  # and the statement is not idle
    assert 0.5 < rounded.bandwidth < 20.0


def test_draws_have_the_covariance_that_is_stated() -> None:
    """Over a record, that is: where an estimate bends little, smoothing takes less away, and elsewhere more."""
    t = np.arange(240) * 0.01
    rng = np.random.default_rng(4)
    one = smooth(t, motion(t)[0][:, 0] + 1e-3 * rng.standard_normal(len(t)))
    draws = one.draws(500, 3)
    for k in range(3):
        share = np.mean(draws[:, :, k] ** 2, axis=0) / one.covariance[:, k, k]
        assert np.sqrt(share.mean()) == pytest.approx(1.0, abs=0.15)
        assert np.sqrt(share.min()) > 0.6


def test_a_slow_motion_at_a_high_rate_keeps_its_digits(monkeypatch: pytest.MonkeyPatch) -> None:
    t = np.arange(1201) * 1e-3
    q, _, qdd = (column[:, 0] for column in motion(t))
    one = smooth(t, np.round(q, 7), 0.5e-7)
    error = np.abs(one.qdd - qdd)
    assert (error / np.sqrt(one.covariance[:, 2, 2])).max() < 5.0
    # twin: relative to nothing, a step of the state is lost in its last digit
    none = lambda u, y: Trend(np.zeros((12, len(u))), np.diff(u))  # noqa: E731
    monkeypatch.setattr("workbench.recorded.smoothing.trend_of", none)
    assert np.abs(smooth(t, np.round(q, 7), 0.5e-7).qdd - qdd).max() > 2.0 * error.max()


def test_what_the_trend_adds_over_a_step_is_exact() -> None:
    u = np.cumsum(np.r_[0.0, np.random.default_rng(3).uniform(0.5, 1.5, 200)])
    trend = trend_of(u, np.sin(0.1 * u))
    assert np.abs(trend.derivatives[2] + 0.01 * np.sin(0.1 * u)).max() < 1e-5
    m, values = 4, trend.derivatives
    for i in range(m):
        along = sum(values[j, :-1] * trend.dt ** (j - i) / math.factorial(j - i) for j in range(i, m))
        assert np.abs(values[i, 1:] - along + trend.drive(m)[:, i]).max() < 1e-13
        assert np.abs(values[i, 1:] - along).max() > 1e-8  # and it is not nothing


def test_neighbours_that_are_rounded_alike_count_as_few() -> None:
    t = np.arange(1201) * 1e-3
    q, _, qdd = (column[:, 0] for column in motion(t))
    fine = smooth(t, np.round(q, 4), 0.5e-4)
    assert fine.weight == pytest.approx(fine.sigma)
    coarse = smooth(t, np.round(q, 2), 0.5e-2)
    assert 1.5 < coarse.weight / coarse.sigma < 3.0
    draws = coarse.draws(200, 1)[:, :, 2]
    assert np.abs(coarse.qdd - qdd).max() < np.quantile(np.abs(draws).max(axis=1), 0.95)
    # twin: what noise of the same size leaves where samples are independent is less
    apart = dataclasses.replace(coarse, rounding=0.0).draws(200, 1)[:, :, 2]
    assert (draws.std(axis=0) / apart.std(axis=0)).max() > 1.2


def test_stated_uncertainty_covers_the_true_error() -> None:
    """A small part of the study of docs/recorded.md, on a pendulum whose torque is a formula."""

    def torque(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        return 0.3 * qdd + 2.0 * np.cos(q) + 0.1 * qd**2

    rng, covered, trials = np.random.default_rng(7), 0, 60
    for trial in range(trials):
        t = np.arange(121) * 0.01
        w, phase, a = rng.uniform(2.0, 10.0), rng.uniform(0.0, 6.0), rng.uniform(0.1, 0.5)
        q = (1.0 + a * np.sin(w * t + phase))[:, None]
        qd, qdd = (a * w * np.cos(w * t + phase))[:, None], (-a * w**2 * np.sin(w * t + phase))[:, None]
        digits = 3 + trial % 4
        one = smooth(t, np.round(q[:, 0], digits), 0.5 * 10.0**-digits)
        seen = one.q[:, None], one.qd[:, None], one.qdd[:, None]
        stated = uncertainty(torque, seen, [one], np.zeros(1), np.zeros_like(q))
        covered += np.abs(torque(*seen) - torque(q, qd, qdd)).max() <= stated.peak[0]
    assert 0.85 * trials <= covered <= trials


# --- where the difference lies ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["scale", "inertia", "gravity", "delay", "offset", "dry friction", "viscous friction"])
def test_each_part_is_found_with_its_standard_error(name: str) -> None:
    rng = np.random.default_rng(5)
    t = np.linspace(0.0, 2.0, 500)
    q, qd, qdd = (column[:, 0] for column in motion(t))
    rest, inertia = 2.0 * np.cos(q), (0.3 + 0.1 * np.sin(q)) * qdd
    columns = columns_of(t, rest + inertia + 0.2 * qd**2, qd, rest, inertia)
    planted = 0.02
    sigma = 0.002
    draws = sigma * rng.standard_normal((200, len(t)))
    found = split(
        "q1", planted * columns[name] + sigma * rng.standard_normal(len(t)), columns, units_of("rad", "N m"),
        np.full(len(t), sigma), draws,
    )  # fmt: skip
    assert found.parts[0].name == name
    assert abs(found.parts[0].value - planted) < 5.0 * found.parts[0].error
    assert found.parts[0].error < 0.2 * planted
    assert "q1" in sentence([found])
    # twin: noise alone has no parts
    assert not split("q1", draws[0], columns, units_of("rad", "N m"), np.full(len(t), sigma), draws[1:]).parts


def test_an_offset_in_time_is_estimated_and_torques_are_resampled() -> None:
    t = np.linspace(0.0, 2.0, 401)
    own = np.linspace(0.1, 1.9, 1000)
    offset, error = estimate_offset(own + 0.0123, motion(own)[0], t, motion(t)[0])
    assert abs(offset + 0.0123) < max(3.0 * error, 1e-7)
    found = align(own + 0.0123, motion(own)[1], t, offset, 0.0)
    assert found.resampled
    assert np.abs(found.tau - motion(t)[1])[found.inside].max() < 1e-5
    assert np.isnan(found.tau[~found.inside]).all()
    with pytest.raises(MotionError, match="0 samples in common"):
        align(own, motion(own)[1], t, 100.0, 0.0)


# --- tables -----------------------------------------------------------------------------------------------------------

ROWS = [[0.01 * k, 0.3 + 0.1 * k, 1.5 - 0.2 * k, 2.0 + 0.3 * k, -0.4 + 0.1 * k] for k in range(5)]
PLAIN = ["t", "q1", "q2", "tau1", "tau2"]


def table(header: list[str], rows: list[list[float]] = ROWS, separator: str = ",", decimal: str = ".") -> str:
    return "\n".join(
        [separator.join(header), *(separator.join(repr(v).replace(".", decimal) for v in row) for row in rows), ""]
    )


SCALED = [[1e3 * t, *np.degrees([a, b]).tolist(), 1e3 * c, d] for t, a, b, c, d in ROWS]
NAMED = {"t": Wanted("Time", "ms"), "q1": Wanted("A", "deg"), "q2": Wanted("B", "deg"), "tau1": Wanted("C", "N mm")}

RIGHT: dict[str, tuple[bytes, dict[str, Wanted]]] = {
    "plain": (table(PLAIN).encode(), {}),
    "semicolons": (table(PLAIN, separator=";").encode(), {}),
    "decimal commas": (table(PLAIN, separator=";", decimal=",").encode(), {}),
    "tabs": (table(PLAIN, separator="\t").encode(), {}),
    "byte order mark and CRLF": (b"\xef\xbb\xbf" + table(PLAIN).replace("\n", "\r\n").encode(), {}),
    "comments": (("% MATLAB\n# again\n" + table(PLAIN)).encode(), {}),
    "line of units": (table(PLAIN).replace("\n", "\ns,rad,rad,N m,N m\n", 1).encode(), {}),
    "units in headers": (
        table(["Time [ms]", "q1 [deg]", "q2 (deg)", "tau1 [N mm]", "tau2 [N m]"], SCALED).encode(), {},
    ),
    "columns and units in the campaign": (
        table(["Time", "A", "B", "C", "tau2"], SCALED).encode(), NAMED,
    ),
    "names of joints": (table(["time", "left", "right", "tau_left", "tau_right"]).encode(), {}),
    "further columns in another order": (
        table(["x", *PLAIN[::-1]], [[9.0, *row[::-1]] for row in ROWS]).encode(), {},
    ),
    "spaces": (table(PLAIN, separator="   ").encode(), {}),
    "no header, columns by number": (
        table(PLAIN).partition("\n")[2].encode(),
        {name: Wanted(str(k + 1)) for k, name in enumerate(PLAIN)},
    ),
    "header in a comment": (("# " + table(PLAIN)).encode(), {}),
    "sep line": (("sep=;\n" + table(PLAIN, separator=";")).encode(), {}),
}  # fmt: skip

WRONG: dict[str, tuple[str, dict[str, Wanted], str]] = {
    "mixed separators": (table(PLAIN).replace("0.02,", "0.02;"), {}, "line 4"),
    "duplicate times": (table(PLAIN, [ROWS[0], ROWS[1], ROWS[1]]), {}, "line 4, column t: 0.01 s after 0.01 s"),
    "time runs back": (table(PLAIN, [ROWS[1], ROWS[0]]), {}, "line 3, column t"),
    "missing value": (table(PLAIN).replace("0.02,0.5,", "0.02,,"), {}, 'line 4, column q1: ""'),
    "too few columns": (table(PLAIN[:4], [row[:4] for row in ROWS]), {}, "column tau_right or tau2 is missing"),
    "text in a column": (table(PLAIN).replace("0.02,0.5,", "0.02,high,"), {}, 'line 4, column q1: "high"'),
    "nan": (table(PLAIN).replace("0.02,0.5,", "0.02,nan,"), {}, "line 4, column q1"),
    "a short line": (table(PLAIN) + "0.05,1\n", {}, "line 7: 2 cells"),
    "a unit of something else": (table(["t", "q1 [N]", *PLAIN[2:]]), {}, 'column "q1 [N]"'),
    "a column that is not there": (table(PLAIN), {"q1": Wanted("A")}, 'no column "A" for q1'),
    "a quantity that does not exist": (table(PLAIN), {"q7": Wanted("A")}, "columns.q7: no such quantity"),
    "thousands": (table(PLAIN, separator=";").replace("0.02;", "1,000;"), {}, "line 4"),
}


def read(path: Path, columns: dict[str, Wanted]) -> np.ndarray:
    record = read_record(path, ("left", "right"), ("rad", "rad"), ("N m", "N m"), columns)
    assert record.q is not None
    assert record.tau is not None
    return np.column_stack([record.t, record.q, record.tau])


@pytest.mark.parametrize("shape", RIGHT)
def test_tables_of_every_shape_are_read(shape: str, tmp_path: Path) -> None:
    data, columns = RIGHT[shape]
    (tmp_path / "t.csv").write_bytes(data)
    assert read(tmp_path / "t.csv", columns) == pytest.approx(np.array(ROWS), abs=1e-12)


@pytest.mark.parametrize("shape", WRONG)
def test_wrong_tables_are_refused_in_one_line(shape: str, tmp_path: Path) -> None:
    text, columns, said = WRONG[shape]
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    with pytest.raises(MotionError) as error:
        read(tmp_path / "t.csv", columns)
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    assert str(error.value).startswith(str(tmp_path))


def test_matlab_and_parquet_files_are_read(tmp_path: Path) -> None:
    rows = np.array(ROWS)
    savemat(tmp_path / "v.mat", {"t": rows[:, 0], "q": rows[:, 1:3], "tau": rows[:, 3:]})
    assert np.array_equal(read(tmp_path / "v.mat", {}), rows)
    savemat(tmp_path / "s.mat", {"log": {name: rows[:, k] for k, name in enumerate(PLAIN)}, "comment": "bench"})
    assert np.array_equal(read(tmp_path / "s.mat", {}), rows)
    pd.DataFrame(rows, columns=PLAIN).to_parquet(tmp_path / "p.parquet")
    assert np.array_equal(read(tmp_path / "p.parquet", {}), rows)
    for name in ("bad.mat", "bad.parquet"):
        (tmp_path / name).write_bytes(b"no such thing" * 20)
        with pytest.raises(MotionError, match="that can be read"):
            read(tmp_path / name, {})


def test_rounded_even_times_are_taken_as_even(tmp_path: Path) -> None:
    step = 0.1 / 3.0
    rows = [[round(step * k, 3), *ROWS[0][1:]] for k in range(40)]
    (tmp_path / "t.csv").write_text(table(PLAIN, rows), encoding="utf-8")
    record = read_record(tmp_path / "t.csv", ("left", "right"), ("rad", "rad"), ("N m", "N m"), {})
    assert np.abs(record.t - step * np.arange(40)).max() < 3e-4
    assert np.ptp(np.diff(record.t)) < 1e-12
    assert "taken as even" in record.notes[0]
    rows[20][0] += 0.004  # twin: a step that rounding does not explain stays as it is
    (tmp_path / "t.csv").write_text(table(PLAIN, rows), encoding="utf-8")
    record = read_record(tmp_path / "t.csv", ("left", "right"), ("rad", "rad"), ("N m", "N m"), {})
    assert np.ptp(np.diff(record.t)) > 1e-3


def test_degrees_for_radians_are_refused(tmp_path: Path) -> None:
    campaign = written(tmp_path, None)
    rows = pd.read_csv(tmp_path / "table.csv")
    rows["crank"] = np.degrees(rows["crank"])
    rows.to_csv(tmp_path / "table.csv", index=False)
    with pytest.raises(MotionError, match=r"degrees|deg"):
        run_campaign(campaign, tmp_path / "run")


def test_records_name_a_case_that_exists(tmp_path: Path) -> None:
    campaign = written(tmp_path, None, 'case = "bensch"\n')
    with pytest.raises(SpecError, match=r'recorded "ADAMS 2010" names case "bensch".*bench'):
        run_campaign(campaign, tmp_path / "run")
    campaign = written(tmp_path, None, '[[recorded]]\nlabel = "ADAMS 2010"\nfile = "table.csv"\n')
    with pytest.raises(SpecError, match='two records have the label "ADAMS 2010"'):
        run_campaign(campaign, tmp_path / "run")
