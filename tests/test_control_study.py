"""Studies of control: what is refused in one line, what a user's controller may do, claims, resuming, workers."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from inline_pool import Inline
from small_campaign import Workbench
from workbench.campaign.control_spec import BUILT_IN, ControlClaim, ControlSpec, DelaySpec
from workbench.campaign.run import run_campaign
from workbench.campaign.spec import load_campaign
from workbench.commands.studies import refuse_options
from workbench.control.claims import HOLDS, REFUTED, UNDECIDED, Known, judged
from workbench.control.evaluate import Study, compute, evaluate
from workbench.control.loop import TRACKED, UNSTABLE
from workbench.control.names import ERROR_COLUMNS, LOOP_COLUMNS, NOT_RUN
from workbench.control.plan import Loop, StudyPlan, plan_study
from workbench.control.run import run_study
from workbench.control.sampling import Encoder, Sampling
from workbench.control.user_controller import load_controllers
from workbench.errors import CandidateError, OutputError, SpecError, WorkbenchError
from workbench.report.build import build_report
from workbench.report.load import load_run

CAMPAIGN = """
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
stop = 0.1
samples = 21
[control]
controllers = ["computed torque"]
models = ["lumped", "distributed"]
rates = [500.0]
bandwidths = [10.0]
"""


CLAIM_OF_A_LOAD = """
[[control.claim]]
id = "load"
text = "enough with a load"
kind = "enough"
model = "lumped"
against = "distributed"
controller = "computed torque"
parameters = { payloud = 1.0 }
"""


def write(folder: Path, *changes: tuple[str, str], more: str = "") -> Path:
    text = CAMPAIGN
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "loop.toml"
    path.write_text(text + more)
    return path


def planned(path: Path, controllers: list[Path] | None = None) -> tuple[StudyPlan, Study]:
    own = load_controllers(controllers or [])
    plan = plan_study(*load_campaign(path), controllers=own)
    return plan, Study(plan, {}, own)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("bandwidths = [10.0]", "bandwidths = [-10.0]", "control.bandwidths"),
        ("bandwidths = [10.0]", "bandwidths = [10.0]\ndamping = -1.0", "control.damping = -1.0"),
        ("rates = [500.0]", "rates = [500.0]\nstep = 0.01", "rate 500 Hz is above the plant's step of 0.01 s"),
        ("rates = [500.0]", "rates = [500.0]\ndelay = { us = 2e5 }", "a delay of 0.2 s is longer than the motion"),
        ("rates = [500.0]", "rates = [500.0]\ndelay = { us = 1.0, samples = 1.0 }", "exactly one of samples, us"),
        ("rates = [500.0]", "rates = [5.0]", "rate 5 Hz gives 0.5 ticks"),
        ("rates = [500.0]", 'rates = ["printed cost"]', 'printed_cost: none for model "lumped"'),
        ("rates = [500.0]", "rates = [500.0]\nlimits = true", "neither robot file nor campaign says"),
        ("rates = [500.0]", "rates = [500.0]\nnoise = { q9 = 1e-6 }", 'no actuated joint "q9"'),
        ("rates = [500.0]", "rates = [500.0]\nplant = { payloud = 1.0 }", "control.plant"),
        ("bandwidths = [10.0]", "bandwidths = [10.0]" + CLAIM_OF_A_LOAD, 'control.claim "load"'),
        ("rates = [500.0]", "rates = [500.0, 500.0]", "stands twice"),
        ('["computed torque"]', '["computed torqu"]', 'no controller "computed torqu"'),
        ('["lumped", "distributed"]', '["lumpt"]', 'has no candidate "lumpt"'),
        ('["lumped", "distributed"]', '["none"]', "no controller goes with any of the models"),
        ("[control]", "[control]\nfoo = 1", "control.foo: unknown key"),
    ],
)  # fmt: skip
def test_a_bad_setting_gets_one_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = write(tmp_path, (old, new))
    with pytest.raises(WorkbenchError) as caught:
        plan_study(*load_campaign(path))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_torque_limit_of_zero_gets_one_line(tmp_path: Path) -> None:
    path = write(tmp_path, ("rates = [500.0]", "rates = [500.0]\nlimits = true"), more="[actuators.q1]\npeak = 0.0\n")
    with pytest.raises(SpecError, match=r"actuators\.q1\.peak = 0\.0: should be greater than 0"):
        load_campaign(path)


def test_control_stands_alone(tmp_path: Path) -> None:
    more = '\n[[candidate]]\nname = "lumped"\nreference = "lumped"\n'
    with pytest.raises(SpecError, match="a campaign with control has cases and no candidates"):
        load_campaign(write(tmp_path, more=more))


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("return sample.q * float('nan')", "returns nan for joint q1, at t = 0 s"),
        ("return sample.q[:2]", r"returns float64 of shape \(2,\); expected 3 numbers: q1 q2 q3"),
        ("return sample.q / parameters.nothing", "AttributeError"),
        ("raise SystemExit(0)", "SystemExit: 0"),
        ("sample.q[0] = 1.0\n    return sample.q", "read-only"),
    ],
)
def test_a_fault_of_a_users_controller_is_named(tmp_path: Path, body: str, said: str) -> None:
    own = tmp_path / "mine.py"
    own.write_text(
        f"import workbench as wb\n\n@wb.controller(name='mine')\ndef mine(parameters, sample):\n    {body}\n"
    )
    _, study = planned(write(tmp_path, ('["computed torque"]', '["mine"]')), [own])
    with pytest.raises(CandidateError, match=said) as caught:
        compute(study, study.plan.loops[0])
    assert "mine.py:" in str(caught.value)
    answer = evaluate(study, "key", (0, study.plan.loops[0]))
    assert answer.record.status == "failed"
    assert "mine.py:" in answer.record.reason


def test_a_users_computed_torque_is_the_packages_own(tmp_path: Path) -> None:
    own = tmp_path / "mine.py"
    own.write_text(
        "import workbench as wb\n\n@wb.controller()\ndef mine(parameters, s):\n"
        "    s.memory['k'] = s.memory.get('k', -1) + 1\n    assert abs(s.memory['k'] * s.period - s.t) < 1e-9\n"
        "    qdd = s.qdd_desired + s.kp * (s.q_desired - s.q) + s.kd * (s.qd_desired - s.qd)\n"
        "    return s.model(s.q, s.qd, qdd)\n"
    )
    plan, study = planned(write(tmp_path, ('["computed torque"]', '["computed torque", "mine"]')), [own])
    found = {(loop.controller, loop.model): compute(study, loop) for loop in plan.loops}
    for model in ("lumped", "distributed"):
        mine, theirs = found["mine", model].tracked, found["computed torque", model].tracked
        assert mine.status == TRACKED
        assert mine.q.tolist() == theirs.q.tolist()
    assert found["mine", "lumped"].tracked.q.tolist() != found["mine", "distributed"].tracked.q.tolist()


def test_a_loop_that_runs_away_is_called_unstable(tmp_path: Path) -> None:
    _, study = planned(write(tmp_path, ("bandwidths = [10.0]", "bandwidths = [10.0, 400.0]")))
    slow, wild = study.plan.loops[:2]
    assert compute(study, slow).tracked.status == TRACKED
    assert compute(study, wild).tracked.status == UNSTABLE
    record = evaluate(study, "key", (1, wild)).record
    assert record.status == "passed"
    assert record.reason.startswith("unstable at t = 0.0")
    assert ": joint q" in record.reason
    assert not record.rows


def test_what_the_models_do_not_know_costs_accuracy(tmp_path: Path) -> None:
    """A payload in the plant alone; limits that bite; a force that the models are not told."""
    errors: dict[str, float] = {}
    highest = math.inf
    for name in ("known", "payload", "limits"):
        key = "plant = { payload = 0.3 }" if name == "payload" else ""
        more = f"limits = true\n[actuators.q3]\npeak = {highest}" if name == "limits" else key
        plan, study = planned(write(tmp_path, ("rates = [500.0]", "second_route = 'none'\nrates = [500.0]"), more=more))
        outcome = compute(study, plan.loops[1])
        assert outcome.error is not None
        errors[name] = outcome.error.platform_rms
        largest = float(np.abs(outcome.tracked.tau[:, 2]).max())
        assert bool(outcome.tracked.saturated.any()) is (name == "limits")
        assert largest <= highest or name == "payload"
        if name == "known":
            highest = 0.9 * largest
    assert errors["payload"] > 2.0 * errors["known"]
    assert errors["limits"] > 2.0 * errors["known"]


def test_an_encoder_counts_and_differs() -> None:
    zero = np.zeros(2)
    sampling = Sampling(100.0, 0.0, np.array([0.01, 0.0]), zero, False, np.full(2, np.inf))
    encoder = Encoder(sampling, np.array([5.0, 6.0]))
    q, qd = encoder.measure(np.array([0.123, 0.123]), zero)
    assert q == pytest.approx([0.12, 0.123])
    assert qd.tolist() == [5.0, 6.0]  # the first tick has no difference
    q, qd = encoder.measure(np.array([0.127, 0.127]), zero)
    assert qd == pytest.approx([1.0, 0.4])
    noisy = Sampling(100.0, 0.0, zero, np.array([1e-3, 0.0]), True, np.full(2, np.inf), seed=5)
    draws = [Encoder(noisy, zero).measure(zero, zero)[0] for _ in range(2)]
    assert draws[0].tolist() == draws[1].tolist()
    assert draws[0][0] != 0.0
    assert draws[0][1] == 0.0


SPEC: dict[str, Any] = {
    "controllers": ["computed torque"], "models": ["lumped", "distributed"], "rates": [500.0, "printed cost"],
    "bandwidths": [10.0], "speeds": [1.0, 2.0], "printed_cost": {"lumped": 6.2, "distributed": 703.0},
}  # fmt: skip


def verdict_of(kind: str, errors: dict[tuple[float, str, str], tuple[float, ...]], **claim: Any) -> str:
    one = ControlClaim(id="c", text="t", kind=kind, model="lumped", against="distributed",
                       controller="computed torque", **claim)  # type: ignore[arg-type]  # fmt: skip
    spec = ControlSpec(**SPEC, claim=[one])
    runs = [
        Known(
            Loop("swing", "computed torque", model, speed, 500.0, rate, 10.0),
            dict(zip(("rms", "rms_halved", "rms_second"), values, strict=False)),
        )
        for (speed, rate, model), values in errors.items()
    ]
    return judged(spec, runs)[0].verdict


@pytest.mark.parametrize(
    ("lumped", "verdict"),
    [
        ((1.05e-3, 1.05e-3, 1.06e-3), HOLDS), ((1.5e-3, 1.5e-3, 1.51e-3), REFUTED),
        ((1.09e-3, 1.09e-3, 1.15e-3), UNDECIDED),  # the routes differ by more than is between it and the limit
        ((1.05e-3, 1.05e-3), UNDECIDED),  # MuJoCo's route is missing
        ((), REFUTED),  # unstable, where the other tracks
    ],
)  # fmt: skip
def test_a_model_is_enough_where_that_is_known(lumped: tuple[float, ...], verdict: str) -> None:
    errors = {(1.0, "500", "lumped"): lumped, (1.0, "500", "distributed"): (1e-3, 1e-3, 1e-3)}
    assert verdict_of("enough", errors) == verdict


def test_an_error_that_nobody_minds_is_enough() -> None:
    errors = {(1.0, "500", "lumped"): (5e-5,) * 3, (1.0, "500", "distributed"): (1e-6,) * 3}
    assert verdict_of("enough", errors) == HOLDS
    # but only where two routes say so, and both below what matters
    errors[1.0, "500", "lumped"] = (9.9e-5, 9.9e-5, 1.2e-4)
    assert verdict_of("enough", errors) != HOLDS
    errors[1.0, "500", "lumped"] = (5e-5, 5e-5)
    assert verdict_of("enough", errors) == UNDECIDED


def test_claims_about_speed_and_rate() -> None:
    exact = {(speed, "500", "distributed"): (1e-3,) * 3 for speed in (1.0, 2.0)}
    slow_alone = exact | {(1.0, "500", "lumped"): (1.01e-3,) * 3, (2.0, "500", "lumped"): (2e-3,) * 3}
    never = exact | {(1.0, "500", "lumped"): (3e-3,) * 3, (2.0, "500", "lumped"): (3e-3,) * 3}
    always = exact | {(1.0, "500", "lumped"): (1.01e-3,) * 3, (2.0, "500", "lumped"): (1.02e-3,) * 3}
    assert [verdict_of("enough-but-fast", e, speeds=[2.0]) for e in (slow_alone, never, always)] == [
        HOLDS,
        REFUTED,
        REFUTED,
    ]
    assert [verdict_of("grows", e) for e in (slow_alone, never, always)] == [HOLDS, REFUTED, REFUTED]
    at_cost = {(1.0, "printed cost", "distributed"): (1e-3,) * 3}
    assert verdict_of("faster", at_cost | {(1.0, "printed cost", "lumped"): (5e-4,) * 3}) == HOLDS
    assert verdict_of("faster", at_cost | {(1.0, "printed cost", "lumped"): (2e-3,) * 3}) == REFUTED
    assert verdict_of("faster", exact) == UNDECIDED  # no run at a printed cost


def test_what_was_not_run_changes_no_verdict() -> None:
    """At high rates no run is made again at half the step."""
    claim = ControlClaim(id="c", text="t", kind="enough", model="lumped", against="distributed",
                         controller="computed torque")  # fmt: skip
    errors = {"rms": 1e-3, "rms_second": 1.001e-3}
    runs = [Known(Loop("swing", "computed torque", m, 1.0, 4000.0, "4000", 10.0), errors) for m in SPEC["models"]]
    verdict = judged(ControlSpec(**SPEC, claim=[claim]), runs)[0]
    assert verdict.verdict == HOLDS
    assert verdict.varied["half the step"] == NOT_RUN
    assert verdict.varied["MuJoCo's integrator and loops"] == HOLDS


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


def test_what_a_study_found_stands_in_its_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workbench.sweep.computing.Supervisor", Inline)
    rates = ("rates = [500.0]", "rates = [250.0, 500.0]\nspeeds = [0.5, 1.0]")
    path = write(tmp_path, rates, ("bandwidths = [10.0]", "bandwidths = [10.0, 300.0]"), more=CLAIM)
    out = tmp_path / "out"
    outcome = run_study(*load_campaign(path), out, report=lambda directory: build_report(directory, ("html", "md")))
    assert outcome.conclusion.exit_code == 0
    assert (outcome.summary["runs"], outcome.summary["tracked"], outcome.summary["unstable"]) == (16, 8, 8)
    assert outcome.summary["claims"][0]["verdict"] in (HOLDS, REFUTED, UNDECIDED)
    report = (out / "report.md").read_text(encoding="utf-8")
    for said in (
        "Is the model enough for control", "lumped is enough", "half the step", "MuJoCo's integrator and loops",
        "Tracking error over the control rate", "Tracking error over the speed", "What the model adds", "Stability",
        "8 of 16 runs do not track", "unstable at t = 0.0", "Damping ratio", "Limits and caveats",
    ):  # fmt: skip
        assert said in report, said
    assert list((out / "figures").glob("figure-control-rate-*.svg"))
    assert {path.stem for path in (out / "figures").glob("figure-control-gap-*.svg")} == {
        "figure-control-gap-rate-swing", "figure-control-gap-speed-swing",
    }  # fmt: skip
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "<script" in page
    links = set(re.findall(r'href="#([^"]+)"', page))
    assert "answer" in links
    assert links <= set(re.findall(r'id="([^"]+)"', page)), "a link that leads nowhere"
    # the same again computes nothing; a reader of cases is told where to look
    assert run_study(*load_campaign(path), out).manifest["computed"] == 0
    with pytest.raises(OutputError, match="holds a study of 16 runs under control"):
        load_run(out)
    (out / "runs.parquet").write_bytes(b"torn")
    with pytest.raises(OutputError, match=r"runs\.parquet: not a readable Parquet file"):
        build_report(out)


def test_other_commands_say_that_a_campaign_has_control(tmp_path: Path) -> None:
    path = write(tmp_path)
    with pytest.raises(SpecError, match=r"has \[control\]"):
        run_campaign(path, tmp_path / "out")
    with pytest.raises(SpecError, match="--quick does not go with a campaign that has"):
        refuse_options("x.toml", only=None, quick=True)


def test_every_key_is_documented(repository: Path) -> None:
    text = (repository / "docs" / "control.md").read_text(encoding="utf-8")
    keys = {*ControlSpec.model_fields, *ControlClaim.model_fields, *DelaySpec.model_fields}
    keys |= {*LOOP_COLUMNS, *ERROR_COLUMNS, *BUILT_IN, "ended", "agreed", "spread", "work"} - {"joint"}
    shown = {key for key in keys if f"`{key}`" in text or f'`"{key}"`' in text or f"`{key} = " in text}
    assert sorted(keys - shown) == []


@pytest.mark.slow
def test_a_study_is_the_same_by_any_number_of_workers_and_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bench = Workbench(tmp_path, monkeypatch, capsys)
    text = CAMPAIGN.replace("rates = [500.0]", "rates = [200.0, 500.0]\nspeeds = [0.5, 1.0]") + CLAIM
    one, two = bench.run(text, "--out", "one", "--jobs", "1"), bench.run(text, "--out", "two", "--jobs", "2")
    assert one.code == two.code == 0, one.err + two.err
    names = ("runs.parquet", "errors.parquet", "control.json", "journal.jsonl")
    for name in names:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    # half of the runs are lost, and a line is torn
    journal = tmp_path / "two" / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[: len(lines) // 2]) + lines[-1][:20])
    again = bench.run(text, "--out", "two", "--jobs", "1")
    assert again.code == 0, again.err
    for name in names:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    manifest = json.loads((tmp_path / "two" / "manifest.json").read_text())
    assert manifest["computed"] == len(lines) - len(lines) // 2
    runs, errors = (pd.read_parquet(tmp_path / "one" / name) for name in names[:2])
    assert len(runs) == 8
    assert (runs["status"] == "passed").all()
    platform = errors[errors["joint"] == "platform"]
    assert (np.abs(platform["rms_second"] / platform["rms"] - 1.0) < 0.1).all()
    assert math.isclose(platform["rms"].max(), platform["rms"].iloc[[0, 1, 2, 3, 4, 5, 6, 7]].max())
    build_report(tmp_path / "one", ("html", "md"))
    report = (tmp_path / "one" / "report.md").read_text()
    assert "Is the model enough for control" in report
    assert "lumped is enough" in report
    # a study that grows computes what is new
    grown = bench.run(text.replace("rates = [200.0", "rates = [100.0, 200.0"), "--out", "two", "--jobs", "1")
    assert grown.code == 0, grown.err
    assert json.loads((tmp_path / "two" / "manifest.json").read_text())["computed"] == 4
    assert len(pd.read_parquet(tmp_path / "two" / "runs.parquet")) == 12
    # another campaign does not take its place unasked
    other = bench.run(text.replace('name = "loop"', 'name = "other"'), "--out", "one")
    assert other.code == 2
    assert "--replace" in other.err
