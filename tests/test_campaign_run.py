"""What a run writes: the same numbers every time, what was asked for on record, claims judged, all or nothing."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

import workbench as wb
from exact_csv import read_exact
from small_campaign import CANDIDATES, HEAD, SMALL, Workbench, listing
from workbench import console
from workbench.campaign import store
from workbench.campaign.unloaded import UNLOADED, joint_error, largest_reaction

CLAIMS = """
[[claim]]
id = "speed"
text = "the platform reaches CLAIMED m/s"
source = "nowhere"
kind = "value"
claimed = CLAIMED
within = 0.005
unit = "m/s"
measure = { quantity = "peak_speed", case = "first" }

[[claim]]
id = "below"
text = "lumped masses cost less than LIMIT"
source = "nowhere"
kind = "upper"
claimed = LIMIT
unit = "%"
parameters = { payload = 1.5 }
measure = { quantity = "peak_error", case = "second", candidate = "lumped", reference = "distributed" }
"""


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


def manifest(workbench: Workbench, run: str = "reports/small") -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((workbench.directory / run / "manifest.json").read_text(encoding="utf-8"))
    return loaded


def summary(workbench: Workbench, run: str = "reports/small") -> pd.DataFrame:
    return read_exact(workbench.directory / run / "summary.csv")


def series(workbench: Workbench, case: str, run: str = "reports/small") -> pd.DataFrame:
    return pd.read_parquet(workbench.directory / run / "series" / f"{case}.parquet")


# --- the same numbers ---


def test_two_runs_give_the_same_bytes(workbench: Workbench) -> None:
    workbench.gather_evidence()
    assert workbench.run(SMALL, "--out", "one").code == 0
    assert workbench.run(SMALL, "--out", "two").code == 0
    one, two = (listing(workbench.directory / name) for name in ("one", "two"))
    assert one.keys() == two.keys()
    assert {"summary.csv", "series/first.parquet", "series/second.parquet"} <= one.keys()
    assert {name for name in one if one[name] != two[name]} <= {"manifest.json"}


def test_another_parameter_gives_other_bytes(workbench: Workbench) -> None:
    workbench.run(SMALL, "--out", "one")
    workbench.run(SMALL, "--out", "two", "--set", "m2=0.3000001")
    one, two = (listing(workbench.directory / name) for name in ("one", "two"))
    assert one["summary.csv"] != two["summary.csv"]
    assert one["series/first.parquet"] != two["series/first.parquet"]


def test_numbers_are_those_of_the_python_interface(workbench: Workbench) -> None:
    workbench.run(SMALL)
    frame = series(workbench, "second")
    q, qd, qdd = (frame[[f"{prefix}{i}" for i in (1, 2, 3)]].to_numpy() for prefix in ("q", "qd", "qdd"))
    mech = wb.load_mechanism("models/asym_2rss_ppap.xml", payload=1.5)
    force = [12.0, -8.0, 25.0]
    tau = mech.inverse_dynamics(q, qd, qdd, "lumped", force)
    columns = [f"q{i}" for i in (1, 2, 3)]
    np.testing.assert_array_equal(frame[[f"cand_lumped_{c}" for c in columns]].to_numpy(), tau)
    reference = wb.MujocoReference("models/asym_2rss_ppap.xml", payload=1.5)
    ref = reference.inverse_dynamics(q, qd, qdd, "distributed", force, along=frame["t"].to_numpy())
    np.testing.assert_array_equal(frame[[f"ref_distributed_{c}" for c in columns]].to_numpy(), ref.tau)
    rows = summary(workbench).set_index(["case", "candidate", "reference", "joint"])
    for i, joint in enumerate(columns):
        expected = np.abs(tau - ref.tau)[:, i].max() / np.abs(ref.tau)[:, i].max()
        assert rows.loc[("second", "lumped", "distributed", joint), "peak_error"] == expected


# --- what was asked for is on record ---


def test_parameters_of_campaign_case_and_command_line(workbench: Workbench) -> None:
    text = SMALL.replace("[[candidate]]", "[parameters]\nm2 = 0.35\npayload = 0.2\n\n[[candidate]]", 1)
    done = workbench.run(text, "--set", "m2=0.4", "--set", "k1_left = 0.45")
    assert done.code == 0, done
    record = manifest(workbench)
    # the command line goes over the case, the case over the campaign
    assert record["cases"]["first"]["parameters"] == {"m2": 0.4, "payload": 0.2, "k1_left": 0.45}
    assert record["cases"]["second"]["parameters"] == {"m2": 0.4, "payload": 1.5, "k1_left": 0.45}
    assert record["spec"]["parameters"] == {"m2": 0.35, "payload": 0.2}
    assert record["command"].endswith("--set m2=0.4 --set 'k1_left = 0.45'")
    values = {entry["name"]: entry["value"] for entry in record["parameters"]}
    assert (values["m2_left"], values["m2_right"], values["k1_left"], values["k1_right"]) == (0.4, 0.4, 0.45, 0.5)


def test_a_one_sided_setting_goes_over_a_two_sided_one_of_the_campaign(workbench: Workbench) -> None:
    text = SMALL.replace("[[candidate]]", "[parameters]\nm2 = 0.35\n\n[[candidate]]", 1)
    workbench.run(text, "--set", "m2_left=0.4")
    values = {entry["name"]: entry["value"] for entry in manifest(workbench)["parameters"]}
    assert (values["m2_left"], values["m2_right"]) == (0.4, 0.35)


def test_a_two_sided_setting_goes_over_a_one_sided_one_of_the_case(workbench: Workbench) -> None:
    text = SMALL.replace("payload = 1.5", "m2_left = 0.35")
    workbench.run(text, "--set", "m2=0.4", "--only", "second")
    values = {entry["name"]: entry["value"] for entry in manifest(workbench)["parameters"]}
    assert (values["m2_left"], values["m2_right"]) == (0.4, 0.4)


def test_only(workbench: Workbench) -> None:
    assert workbench.run(SMALL, "--only", "second").code == 0
    assert list(manifest(workbench)["cases"]) == ["second"]
    assert set(summary(workbench).case) == {"second"}
    assert os.listdir(workbench.directory / "reports/small/series") == ["second.parquet"]


def test_every_key_that_a_reader_needs(workbench: Workbench) -> None:
    workbench.run(SMALL)
    record = manifest(workbench)
    assert record["format"] == store.FORMAT
    assert record["status"] == "passed"
    assert record["joints"] == ["q1", "q2", "q3"]
    assert len(record["model"]["sha256"]) == 64
    assert {"workbench", "python", "mujoco", "numpy"} <= record["versions"].keys()
    first = record["cases"]["first"]
    assert (first["mobility"], first["rank"], first["redundant_rows"], first["idle_freedoms"]) == (3, 8, 1, 2)
    assert first["closure_residual"] < 1e-13
    assert list(summary(workbench).columns[:10]) == [
        "case", "candidate", "reference", "joint", "peak_error", "rms_error", "pointwise_error", "worst_time_s",
        "bound", "verdict",
    ]  # fmt: skip


@pytest.mark.parametrize("page", ["campaign.md", "run-directory.md"])
def test_every_key_is_documented(workbench: Workbench, repository: Path, page: str) -> None:
    workbench.gather_evidence()
    workbench.run(SMALL)
    text = (repository / "docs" / page).read_text(encoding="utf-8")
    record = manifest(workbench)
    if page == "campaign.md":
        from workbench.campaign import figure_spec, motion_spec, spec

        models = [
            spec.Campaign, spec.CaseSpec, spec.CandidateSpec, spec.ClaimSpec, spec.Measure, figure_spec.FigureSpec,
            *motion_spec.MOTIONS.values(),
        ]  # fmt: skip
        keys = {key for model in models for key in model.model_fields}
    else:
        keys = {*record, *record["cases"]["first"], *record["model"], *summary(workbench).columns}
    assert sorted(key for key in keys if f"`{key}`" not in text) == []


# --- claims ---


def claims(workbench: Workbench, claimed: float, limit: float, *options: str) -> dict[str, Any]:
    text = SMALL + CLAIMS.replace("CLAIMED", repr(claimed)).replace("LIMIT", repr(limit))
    done = workbench.run(text, *options)
    assert done.code == 0, done
    return {claim["id"]: claim for claim in manifest(workbench)["claims"]}


def test_claims_are_judged(workbench: Workbench) -> None:
    judged = claims(workbench, 1.0, 0.5)
    speed, error = judged["speed"]["measured"], judged["below"]["measured"]
    rows = summary(workbench).query("case == 'second' and kind == 'modelling'")
    assert error == rows.peak_error.max()
    frame = series(workbench, "first")
    assert speed == pytest.approx(np.sqrt((frame[["xd1", "xd2", "xd3"]] ** 2).sum(axis=1)).max(), rel=1e-12)
    assert (judged["speed"]["holds"], judged["below"]["holds"]) == (False, True)
    right = claims(workbench, round(speed, 2), error * 1.01)
    assert (right["speed"]["holds"], right["below"]["holds"]) == (True, True)
    wrong = claims(workbench, speed + 0.0051, error * 0.99)
    assert (wrong["speed"]["holds"], wrong["below"]["holds"]) == (False, False)
    # "smaller than" is not "at most"
    assert claims(workbench, speed, error)["below"]["holds"] is False


def test_a_claim_about_a_case_that_was_left_out_is_open(workbench: Workbench) -> None:
    judged = claims(workbench, 1.0, 0.5, "--only", "second")
    assert judged["speed"]["holds"] is None
    assert judged["speed"]["measured"] is None
    assert judged["below"]["holds"] is True


def test_a_claim_that_does_not_hold_is_printed_and_fails_nothing(workbench: Workbench) -> None:
    done = workbench.run(SMALL + CLAIMS.replace("CLAIMED", "9.0").replace("LIMIT", "0.5"))
    assert done.code == 0
    assert "1 confirmed, 1 not confirmed." in done.out
    assert "not confirmed: the platform reaches 9.0 m/s: measured " in done.out


# --- the terminal ---


@pytest.mark.parametrize(("columns", "beside"), [(80, False), (120, True)])
def test_the_table_fits_the_terminal(
    workbench: Workbench, monkeypatch: pytest.MonkeyPatch, columns: int, beside: bool
) -> None:
    monkeypatch.setattr(console, "out", Console(width=columns, highlight=False))
    text = SMALL.replace('"first"', '"longer_than_most"').replace('"distributed"\n', '"distributed-rotation"\n', 1)
    done = workbench.run(text.replace('reference = "distributed-rotation"', 'reference = "distributed"'))
    assert done.code == 0, done
    table = done.out.split("Modelling")[0].splitlines()
    assert max(len(line) for line in table) <= columns
    names = [line for line in table if "longer_than_most" in line]
    assert [len(line.split()) > 1 for line in names] == [beside]


# --- joints that carry nothing ---

REST = (
    HEAD
    + CANDIDATES
    + """
[[case]]
name = "in_plane"
[case.motion]
kind = "sine"
offset = [0.0, 0.8, 0.7]
amplitude = [0.0, 0.2, 0.2]
frequency = [1.0, 5.0, 6.0]
stop = 1.0
samples = 21
"""
)


def test_a_joint_without_force_is_judged_by_the_reactions(workbench: Workbench) -> None:
    done = workbench.run(REST)
    assert done.code == 0, done
    rows = summary(workbench).query("joint == 'q1' and kind == 'verification'")
    assert (rows.peak_reference < 1e-12).all()
    assert (rows.peak_error < 5e-11).all()


def test_its_twin_with_a_small_force_in_the_candidate_fails() -> None:
    quiet, reaction = np.full(5, 1e-15), 10.0
    assert joint_error(np.zeros(5), quiet, reaction).peak_error < 1e-10
    assert joint_error(np.full(5, 1e-12), quiet, reaction).peak_error > 1e-9
    assert np.isnan(joint_error(np.full(5, np.nan), quiet, reaction).peak_error)


def test_a_loaded_joint_is_judged_by_its_own_force() -> None:
    tau = np.array([1.0, -2.0])
    assert joint_error(tau + 0.02, tau, 10.0).peak_error == pytest.approx(0.01)
    just_loaded = np.array([UNLOADED * 10.0])
    assert joint_error(1.5 * just_loaded, just_loaded, 10.0).peak_error == pytest.approx(0.5)
    assert joint_error(tau + 0.02, tau, 0.0).peak_error == pytest.approx(0.01)


def test_largest_reaction() -> None:
    assert largest_reaction([]) == 0.0
    assert largest_reaction([np.array([[3.0, 4.0, 0.0]]), np.array([[0.0, 0.0, 2.0]])]) == 5.0


# --- all or nothing ---


def test_a_run_is_replaced_as_a_whole(workbench: Workbench) -> None:
    workbench.run(SMALL)
    assert workbench.run(SMALL, "--only", "second").code == 2  # it would lose a case
    assert workbench.run(SMALL, "--only", "second", "--replace").code == 0
    assert os.listdir(workbench.directory / "reports/small/series") == ["second.parquet"]
    assert os.listdir(workbench.directory / "reports") == ["small"]


def test_an_empty_directory_is_used_and_a_link_followed(workbench: Workbench) -> None:
    (workbench.directory / "target").mkdir()
    (workbench.directory / "link").symlink_to("target")
    assert workbench.run(SMALL, "--out", "link", "--only", "first").code == 0
    assert (workbench.directory / "link").is_symlink()
    assert (workbench.directory / "target" / "manifest.json").is_file()


def interrupt(*_: object) -> None:
    raise KeyboardInterrupt


@pytest.mark.parametrize("point", ["write_series", "write_summary", "write_manifest"])
def test_interrupted_while_writing(workbench: Workbench, monkeypatch: pytest.MonkeyPatch, point: str) -> None:
    workbench.run(SMALL)
    before = listing(workbench.directory)
    monkeypatch.setattr(store, point, interrupt)
    done = workbench("run", "small.toml")
    assert (done.code, done.complaint) == (130, ["workbench: interrupted"])
    assert listing(workbench.directory) == before


@pytest.mark.parametrize("after", [1, 2])
def test_interrupted_between_the_two_renames(workbench: Workbench, monkeypatch: pytest.MonkeyPatch, after: int) -> None:
    workbench.run(SMALL)
    before = listing(workbench.directory)
    rename, calls = Path.rename, []

    def rename_then_interrupt(path: Path, target: Path) -> Path:
        result = rename(path, target)
        calls.append(target)
        if len(calls) == after:
            raise KeyboardInterrupt
        return result

    monkeypatch.setattr(Path, "rename", rename_then_interrupt)
    assert workbench("run", "small.toml").code == 130
    now = listing(workbench.directory)
    if after == 1:  # the earlier run has gone back
        assert now == before
    else:  # the new one stands, whole
        assert now.keys() == before.keys()
        assert now["reports/small/summary.csv"] == before["reports/small/summary.csv"]


def test_a_full_disk(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    workbench.write(SMALL)
    before = listing(workbench.directory)
    monkeypatch.setattr(store, "write_manifest", full)
    done = workbench("run", "small.toml")
    assert done.code == 2
    assert done.complaint == ["workbench: reports/small: cannot be written: No space left on device"]
    assert listing(workbench.directory) == before


# --- the README ---


def test_the_readme_example_runs_and_prints_what_it_says(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (repository / "README.md").read_text(encoding="utf-8")
    code = text.split("```python\n")[1].split("```")[0]
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {})
    expected = [line.removeprefix("# prints ") for line in code.splitlines() if line.startswith("# prints ")]
    assert expected
    assert capsys.readouterr().out.splitlines() == expected


def test_links_of_the_pages_lead_somewhere(repository: Path) -> None:
    pages = [repository / "README.md", *(repository / "docs").glob("*.md")]
    assert len(pages) > 4
    for page in pages:
        targets = re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8"))
        missing = [t for t in targets if not t.startswith("http") and not (page.parent / t).exists()]
        assert missing == [], page


def test_the_readme_quotes_the_campaign(repository: Path, workbench: Workbench) -> None:
    """The table of modelling errors in the README is what the campaign of the paper measures."""
    text = (repository / "README.md").read_text(encoding="utf-8")
    done = workbench("run", "almeida_2010", "--quick", "--out", "run")
    assert done.code == 0, done
    rows = summary(workbench, "run")
    for case, group in rows[rows.kind == "modelling"].groupby("case", sort=False):
        line = next(line for line in text.splitlines() if line.startswith(f"| {case}"))
        assert line.endswith(f"| {', '.join(f'{100 * error:.2f} %' for error in group.peak_error)} |")
    assert rows[rows.kind == "verification"].peak_error.max() < 1e-12
    assert "seven are confirmed" in " ".join(text.split())
    assert [claim["holds"] for claim in manifest(workbench, "run")["claims"]].count(True) == 7
