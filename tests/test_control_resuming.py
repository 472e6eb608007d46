"""A study is gone on with by the rules of sweeps: nothing stale is taken over, nothing finished is lost unasked."""

from __future__ import annotations

import json
import os
import re
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from inline_pool import Inline
from small_campaign import SMALL, Workbench, listing
from workbench.motion import JointMotion
from workbench.report.build import build_report

STUDY = """
format = 1
name = "loop"
title = "A loop"
model = "models/asym_2rss_ppap.xml"
[[case]]
name = "swing"
[case.motion]
kind = "sine"
offset = [0.0, 0.75, 0.8]
amplitude = [0.05, 0.2, 0.2]
frequency = [8.0, 17.0, 23.0]
stop = 0.05
samples = 21
[control]
controllers = ["computed torque"]
models = ["lumped", "distributed"]
rates = [200.0, 400.0]
bandwidths = [10.0]
second_route = "none"
"""

TABLES = """
format = 1
name = "loop"
title = "A loop"
model = "models/asym_2rss_ppap.xml"
[[case]]
name = "first"
[case.motion]
kind = "csv"
file = "first.csv"
[[case]]
name = "second"
[case.motion]
kind = "csv"
file = "second.csv"
[control]
controllers = ["pd"]
models = ["none"]
rates = [200.0]
bandwidths = [10.0]
second_route = "none"
"""


@pytest.fixture
def inline(monkeypatch: pytest.MonkeyPatch) -> type[Inline]:
    class Own(Inline):
        pass

    monkeypatch.setattr("workbench.sweep.computing.Supervisor", Own)
    return Own


@pytest.fixture
def bench(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], inline: type[Inline]
) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


def computed(directory: Path) -> int:
    count: int = json.loads((directory / "manifest.json").read_text(encoding="utf-8"))["computed"]
    return count


def test_runs_of_another_robot_are_not_dropped_unasked(bench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    out = bench.directory / "out"
    assert bench.run(STUDY, "--out", "out").code == 0
    before = listing(out)
    refused = bench.run(STUDY, "--out", "out", "--set", "m3=1.5")
    assert refused.code == 2
    assert "out: holds runs of another study" in refused.complaint[0]
    assert "m3=1.5" in refused.complaint[0]
    assert "--replace" in refused.complaint[0]
    assert listing(out) == before

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("workbench.control.files.write_tables", full)
        halfway = bench.run(STUDY, "--out", "out", "--set", "m3=1.5", "--replace")
        assert halfway.code == 2
        assert "4 of 4 runs were finished before and are kept" in halfway.complaint[0]
    assert listing(bench.directory / ".out.before") == before
    assert bench.run(STUDY, "--out", "out", "--set", "m3=1.5", "--replace").code == 0
    assert not (bench.directory / ".out.before").exists()
    assert computed(out) == 0
    # the same again, and one that grows, ask nobody
    assert bench.run(STUDY, "--out", "out", "--set", "m3=1.5").code == 0
    grown = STUDY.replace("rates = [200.0, ", "rates = [100.0, 200.0, ")
    assert bench.run(grown, "--out", "out", "--set", "m3=1.5").code == 0
    assert computed(out) == 2


def test_a_study_and_a_run_of_cases_do_not_take_each_others_place(bench: Workbench) -> None:
    assert bench.run(STUDY, "--out", "study").code == 0
    cases = SMALL.replace('name = "small"', 'name = "loop"')
    assert bench.run(cases, "--out", "cases", "--quick").code == 0
    for text, place in ((STUDY, "cases"), (cases, "study")):
        before = listing(bench.directory / place)
        refused = bench.run(text, "--out", place, *(["--quick"] if text is cases else []))
        assert refused.code == 2, refused
        assert len(refused.complaint) == 1
        assert "--out" in refused.complaint[0] or "name" in refused.complaint[0]
        assert listing(bench.directory / place) == before


def test_a_model_that_is_saved_while_a_study_runs(bench: Workbench, inline: type[Inline], repository: Path) -> None:
    model = bench.directory / "robot.xml"
    text = (repository / "models" / "asym_2rss_ppap.xml").read_text(encoding="utf-8")
    model.write_text(text, encoding="utf-8")

    def edited(count: int) -> None:
        if count == 1:
            os.utime(model, (0, 0))  # saved, but the same
        if count == 2:
            model.write_text(text.replace('mass="0.45"', 'mass="0.46"'), encoding="utf-8")

    inline.before = staticmethod(edited)  # type: ignore[assignment]
    refused = bench.run(STUDY, "--out", "out", "--model", "robot.xml")
    assert refused.code == 2
    assert "robot.xml: was changed while the study ran; 2 of 4 runs" in refused.complaint[0]
    inline.before = staticmethod(lambda count: None)  # type: ignore[assignment]
    model.write_text(text, encoding="utf-8")
    assert bench.run(STUDY, "--out", "out", "--model", "robot.xml").code == 0
    assert computed(bench.directory / "out") == 2


def table(path: Path, motion: JointMotion) -> None:
    columns = {"t": motion.t}
    for j in range(3):
        columns |= {f"q{j + 1}": motion.q[:, j], f"qd{j + 1}": motion.qd[:, j], f"qdd{j + 1}": motion.qdd[:, j]}
    pd.DataFrame(columns).to_csv(path, index=False)


def swing(amplitude: float) -> JointMotion:
    t = np.linspace(0.0, 0.05, 51)
    offset, rate = np.array([0.0, 0.75, 0.8]), 20.0
    sin, cos = np.sin(rate * t)[:, None], np.cos(rate * t)[:, None]
    grow = amplitude * np.ones(3)
    return JointMotion(t, offset + grow * sin, grow * rate * cos, -grow * rate**2 * sin)


def test_each_table_of_a_study_is_part_of_what_its_runs_are(bench: Workbench, inline: type[Inline]) -> None:
    for name in ("first", "second"):
        table(bench.directory / f"{name}.csv", swing(0.02))
    assert bench.run(TABLES, "--out", "out").code == 0
    before = pd.read_parquet(bench.directory / "out" / "errors.parquet")
    table(bench.directory / "second.csv", swing(0.04))
    assert bench.run(TABLES, "--out", "out").code == 0
    after = pd.read_parquet(bench.directory / "out" / "errors.parquet")
    grown = after["rms"] / before["rms"]
    assert (grown[after["case"] == "second"] > 1.1).all()
    assert (grown[after["case"] == "first"] == 1.0).all()

    def edited(count: int) -> None:
        if count == 1:
            table(bench.directory / "second.csv", swing(0.03))

    inline.before = staticmethod(edited)  # type: ignore[assignment]
    refused = bench.run(TABLES, "--out", "out", "--fresh")
    assert refused.code == 2
    assert "second.csv: was changed while the study ran" in refused.complaint[0]


CONTROLLER = """
import workbench as wb
from gains import FACTOR

@wb.controller(name="mine")
def mine(parameters, sample):
    e, ed = sample.q_desired - sample.q, sample.qd_desired - sample.qd
    return FACTOR * sample.mass * (sample.kp * e + sample.kd * ed)
"""


def test_an_edited_neighbour_of_a_controller_makes_runs_anew(bench: Workbench) -> None:
    (bench.directory / "mine.py").write_text(CONTROLLER, encoding="utf-8")
    (bench.directory / "gains.py").write_text("FACTOR = 1.0\n", encoding="utf-8")
    text = STUDY.replace('"computed torque"', '"mine"').replace('["lumped", "distributed"]', '["none"]')
    errors = []
    for factor, runs in ((1.0, 2), (1.0, 0), (2.0, 2)):
        (bench.directory / "gains.py").write_text(f"FACTOR = {factor}\n", encoding="utf-8")
        done = bench.run(text, "--out", "out", "--controllers", "mine.py")
        assert done.code == 0, done.err
        assert computed(bench.directory / "out") == runs
        errors.append(pd.read_parquet(bench.directory / "out" / "errors.parquet")["rms"].to_numpy())
    assert (errors[0] == errors[1]).all()
    assert (errors[0] != errors[2]).all()


@pytest.mark.slow
def test_a_study_on_a_cluster_gives_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    distributed = pytest.importorskip("distributed", reason="needs the extra cluster")
    bench = Workbench(tmp_path, monkeypatch, capsys)
    assert bench.run(STUDY, "--out", "here", "--jobs", "1").code == 0
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path for path in sys.path if path))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50
    ) as cluster:
        done = bench.run(STUDY, "--out", "there", "--scheduler", cluster.scheduler_address)
    assert done.code == 0, done.err
    for name in ("runs.parquet", "errors.parquet", "control.json", "journal.jsonl"):
        assert (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes()


CLAIM = """
[[control.claim]]
id = "enough"
text = "lumped is enough"
source = "somebody"
kind = "enough"
model = "lumped"
against = "distributed"
controller = "computed torque"
"""


def test_a_studys_claims_and_numbers_follow_the_robot(bench: Workbench) -> None:
    heavy = CLAIM.replace('"enough"\ntext', '"heavy"\ntext') + 'cases = ["heavy"]\n'
    loaded = heavy.replace('"heavy"\ntext', '"loaded"\ntext') + "parameters = { payload = 1.5 }\n"
    other = heavy.replace('"heavy"\ntext', '"other"\ntext') + "parameters = { payload = 1.4 }\n"
    own = STUDY.replace("[control]", CASE_OF_ANOTHER_PAYLOAD + "[control]")
    own += CLAIM + 'cases = ["swing"]\n' + heavy + loaded + other
    found = {}
    for name, options in (("paper", ()), ("changed", ("--set", "m3=1.5"))):
        assert bench.run(own, "--out", name, *options).code == 0
        manifest = json.loads((bench.directory / name / "manifest.json").read_text(encoding="utf-8"))
        claims = json.loads((bench.directory / name / "control.json").read_text(encoding="utf-8"))["claims"]
        verdict = claims[0]
        # a load that a sentence names makes no other robot; one that it does not name does, and so does --set
        apart = [claim["id"] for claim in claims if claim["verdict"] == "not about this robot"]
        assert apart == (["heavy", "other"] if name == "paper" else ["enough", "heavy", "loaded", "other"])
        m3 = next(one for one in manifest["parameters"] if one["name"] == "m3")
        changed = {(c["name"], c["by"], *c["cases"]) for c in manifest["changes"]["parameters"]}
        build_report(bench.directory / name, ("md",))
        found[name] = verdict, m3, changed, (bench.directory / name / "report.md").read_text(encoding="utf-8")
    verdict, m3, changed, report = found["paper"]
    assert verdict["verdict"] != "not about this robot"
    assert m3["source"] != "--set"
    assert changed == {("payload", "case parameters", "heavy")}
    assert re.search("[012] of 2 claims hold", report)
    verdict, m3, changed, report = found["changed"]
    assert verdict["verdict"] == "not about this robot"
    assert "m3" in verdict["sentence"]
    assert (m3["value"], m3["source"]) == (1.5, "--set")
    assert ("m3", "--set", "swing", "heavy") in changed
    assert "4 claims are not about this robot" in report
    assert "--set" in report


CASE_OF_ANOTHER_PAYLOAD = """
[[case]]
name = "heavy"
parameters = { payload = 1.5 }
[case.motion]
kind = "sine"
offset = [0.0, 0.75, 0.8]
amplitude = [0.05, 0.2, 0.2]
frequency = [8.0, 17.0, 23.0]
stop = 0.05
samples = 21
"""


def test_a_study_of_which_no_run_tracks_has_its_report(bench: Workbench) -> None:
    text = STUDY.replace("bandwidths = [10.0]", "bandwidths = [400.0]").replace(
        "rates = [200.0, 400.0]", "rates = [200.0]"
    )
    done = bench.run(text, "--out", "out")
    assert done.code == 4
    assert "NOTHING JUDGED: none of 2 runs tracked its motion, the first is unstable at t = " in done.out
    assert json.loads((bench.directory / "out" / "control.json").read_text(encoding="utf-8"))["tracked"] == 0
    assert len(pd.read_parquet(bench.directory / "out" / "errors.parquet")) == 0
    build_report(bench.directory / "out", ("html", "md"))
    assert "2 of 2 runs do not track" in (bench.directory / "out" / "report.md").read_text(encoding="utf-8")
