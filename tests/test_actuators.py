"""What a motion asks of actuators, by independent ways; limits held against it; what a user reads of it."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad

import workbench as wb
from robots import MODEL, random_changes
from small_campaign import SMALL, Workbench
from workbench.campaign.margins import answer, margins, shortfalls, worst_of
from workbench.demand import Demand, demand_of
from workbench.errors import SpecError
from workbench.report.attention import attention
from workbench.report.build import render_markdown
from workbench.report.load import load_run
from workbench.report.sections import build_sections
from workbench.robots.robot_file import read_robot_file

UNITS = {"q1": ("N", "m"), "q2": ("N m", "rad")}


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


def random_motion(rng: np.random.Generator) -> tuple[np.ndarray, float, float, float, float, float]:
    """Unevenly sampled times, dense enough for integrals good to 1e-5, and the numbers of two sines."""
    stop = float(rng.uniform(0.5, 3.0))
    even = np.linspace(0.0, stop, 6001)
    time = even + 0.4 * stop / 6000 * np.sin(9.0 * even / stop) * (even > 0) * (even < stop)
    return time, stop, *(float(rng.uniform(*span)) for span in ((1.0, 9.0), (0.2, 3.0), (2.0, 11.0), (0.0, 3.0)))


@pytest.mark.parametrize("seed", range(5))
def test_demand_is_that_of_quadrature_and_of_a_search(seed: int) -> None:
    time, stop, force, speed, omega, phase = random_motion(np.random.default_rng(seed))

    def tau(t: float) -> float:
        return force * math.sin(omega * t + phase) + 0.3 * force

    def rate(t: float) -> float:
        return speed * math.cos(omega * t)

    found = demand_of(time, np.array([rate(t) for t in time]), np.array([tau(t) for t in time]))
    points = {"limit": 400, "points": [*np.linspace(0.0, stop, 60)]}
    square = quad(lambda t: tau(t) ** 2, 0.0, stop, **points)[0]
    work = quad(lambda t: max(tau(t) * rate(t), 0.0), 0.0, stop, **points)[0]
    back = quad(lambda t: max(-tau(t) * rate(t), 0.0), 0.0, stop, **points)[0]
    assert found.rms == pytest.approx(math.sqrt(square / stop), rel=1e-5)
    assert found.work == pytest.approx(work, rel=1e-4)
    assert found.returned == pytest.approx(back, rel=1e-4, abs=1e-6)
    assert found.peak == max(abs(tau(t)) for t in time) == abs(tau(found.peak_at_s))
    assert found.speed == max(abs(rate(t)) for t in time) == abs(rate(found.speed_at_s))
    assert found.power == max(abs(tau(t) * rate(t)) for t in time)
    assert found.braking == max(0.0, *(-tau(t) * rate(t) for t in time))
    # the mean of samples that are not even is another number: the oracle can tell
    assert abs(math.sqrt(np.mean([tau(t) ** 2 for t in time**2 / stop])) / found.rms - 1.0) > 1e-4


@pytest.mark.parametrize("seed", range(3))
def test_over_a_closed_cycle_all_work_comes_back(seed: int) -> None:
    """A second way, by physics: without friction nothing is left of the energy once robot and rates are as before."""
    rng = np.random.default_rng(seed)
    robot = wb.load_robot(MODEL, **{**random_changes(rng), "payload": 0.4})
    period = 0.8
    time = np.linspace(0.0, period, 801)
    omega = 2.0 * np.pi / period
    home, amplitude, phase = robot.home, rng.uniform(0.02, 0.08, 3), rng.uniform(0.0, 6.0, 3)
    angle = omega * time[:, None] + phase
    q = home + amplitude * np.sin(angle)
    qd, qdd = amplitude * omega * np.cos(angle), -amplitude * omega**2 * np.sin(angle)
    tau = robot.inverse_dynamics(q, qd, qdd)
    demands = [demand_of(time, qd[:, i], tau[:, i]) for i in range(3)]
    put_in = sum(one.work for one in demands)
    net = sum(one.work - one.returned for one in demands)
    assert abs(net) < 1e-4 * put_in
    spoiled = [demand_of(time, qd[:, i], tau[:, (i + 1) % 3]) for i in range(3)]  # another joint's torque
    assert abs(sum(one.work - one.returned for one in spoiled)) > 1e-2 * sum(one.work for one in spoiled)


def test_one_sample_and_a_force_that_is_no_number() -> None:
    one = demand_of(np.array([0.5]), np.array([2.0]), np.array([-3.0]))
    assert one == Demand(3.0, 0.5, 3.0, 2.0, 0.5, 6.0, 0.5, 6.0, 0.0, 0.0)
    broken = demand_of(np.arange(3.0), np.ones(3), np.array([1.0, math.nan, 2.0]))
    assert math.isnan(broken.peak)
    assert math.isnan(broken.rms)
    assert math.isnan(broken.work)


def limit(**given: float | str) -> SimpleNamespace:
    return SimpleNamespace(**{"peak": None, "rms": None, "speed": None, "power": None, "source": "", **given})


def asked(peak: float, rms: float = 1.0) -> SimpleNamespace:
    times = {"peak_at_s": 0.25, "speed_at_s": 0.5, "power_at_s": 0.75}
    return SimpleNamespace(peak=peak, rms=rms, speed=2.0, power=9.0, **times)


def test_margins_name_case_joint_time_and_by_how_much() -> None:
    limits = {"q2": limit(peak=10.0, rms=0.4, speed=4.0, source="data sheet 7")}
    demands = {"a": {"q1": asked(99.0), "q2": asked(12.5)}, "b": {"q2": asked(11.0)}, "c": {"q2": asked(9.0, 0.3)}}
    found = margins(limits, demands, UNITS)
    assert [(m.case, m.joint, m.measure.key) for m in found if m.too_much] == [
        ("a", "q2", "peak"), ("a", "q2", "rms"), ("b", "q2", "peak"), ("b", "q2", "rms"),
    ]  # fmt: skip
    assert [(m.case, m.measure.key) for m in worst_of(found)] == [("a", "peak"), ("a", "rms"), ("a", "speed")]
    peak, rms = shortfalls(found)
    assert peak == (
        "q2: its actuator is too small in case a: peak 12.5 N m at 0.25 s, allowed 10 N m (data sheet 7), 25 % too"
        " much; too small in 1 other case too"
    )
    assert "rms 1 N m over the case, allowed 0.4 N m (data sheet 7), 2.5 times what is allowed" in rms
    assert answer(found) == "The actuator of q2 is too small."
    enough = margins({"q2": limit(peak=12.5)}, demands, UNITS)  # all of it is still enough
    assert shortfalls(enough) == []
    assert "tightest is q2, peak 12.5 N m in case a, 100 % of what is allowed" in answer(enough)
    assert margins({}, demands, UNITS) == []
    assert answer([]) == ""


@pytest.mark.parametrize("value", [math.nan, None])
def test_a_demand_that_is_not_known_is_not_small(value: float | None) -> None:
    found = margins({"q1": limit(peak=5.0)}, {"a": {"q1": SimpleNamespace(peak=value, peak_at_s=None)}}, UNITS)
    assert [m.too_much for m in found] == [True]
    assert shortfalls(found) == ["q1: whether its actuator is big enough in case a is not known"]


LIMITS = """
[actuators.q1]
speed = 5.0
[actuators.q2]
peak = 5.0
rms = 2.0
source = "data sheet 7"
"""


def test_a_small_motor_needs_attention_and_fails_nothing(workbench: Workbench) -> None:
    done = workbench.run(SMALL.replace("[[candidate]]", f"{LIMITS}\n[[candidate]]", 1), "--quick", "--out", "a")
    assert done.code == 0
    assert "PASSED" in done.out
    flat = " ".join(done.out.split())
    assert (
        "q2: its actuator is too small in case second: peak 7.897 N m at 0.65 s, allowed 5 N m (data sheet 7)" in flat
    )
    manifest = json.loads(Path("a/manifest.json").read_text())
    assert manifest["actuators"]["q2"] == {
        "peak": 5.0,
        "rms": 2.0,
        "speed": None,
        "power": None,
        "source": "data sheet 7",
    }
    run = load_run(Path("a"))
    series = run.series("second")
    demand = run.manifest.cases["second"].demand
    assert demand.mass_model == "distributed"
    assert demand.joints["q2"].peak == np.abs(series["ref_distributed_q2"]).max()
    assert demand.joints["q3"].power == np.abs(series["ref_distributed_q3"] * series["qd3"]).max()
    assert len(attention(run)) == 2
    text = render_markdown(run, build_sections(run))
    assert text.index("Needs attention") < text.index("## What the actuators have to give")
    assert "TOO SMALL" in text
    assert "big enough" in text  # q1's speed
    assert run.manifest.status == "passed"


def test_without_limits_the_report_says_how_to_give_them(workbench: Workbench) -> None:
    workbench.run(SMALL, "--quick", "--out", "a")
    run = load_run(Path("a"))
    assert attention(run) == []
    text = render_markdown(run, build_sections(run))
    assert "Nobody says what the actuators can give." in text
    assert "TOO SMALL" not in text


FIVEBAR = Path(__file__).resolve().parents[1] / "examples" / "fivebar"


def robot_with(folder: Path, text: str) -> Path:
    (folder / "fivebar.xml").write_bytes((FIVEBAR / "fivebar.xml").read_bytes())
    (folder / "fivebar.py").write_bytes((FIVEBAR / "fivebar.py").read_bytes())
    path = folder / "robot.toml"
    path.write_text((FIVEBAR / "robot.toml").read_text() + text)
    return path


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[actuators.q9]\npeak = 1.0\n", 'actuators: no actuated joint "q9"; valid: q1, q2'),
        ("[actuators.q1]\nsource = 'x'\n", "actuators.q1: gives no limit; allowed: one or more of peak, rms, speed"),
        ("[actuators.q1]\npeak = 0.0\n", "actuators.q1.peak = 0.0: should be greater than 0"),
        ("[actuators.q1]\npeak = inf\n", "actuators.q1.peak = inf: should be a finite number"),
        ("[actuators.q1]\npeak = 1.0\nrms = 2.0\n", "actuators.q1: rms = 2 is above peak = 1"),
        ("[actuators.q1]\npeek = 1.0\n", 'actuators.q1.peek: unknown key; did you mean "peak"?'),
        ("[actuators]\nq1 = 3.0\n", "actuators.q1 = 3.0: should be a table"),
    ],
)
def test_limits_that_are_none_are_refused(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(SpecError) as error:
        read_robot_file(robot_with(tmp_path, text))
    assert said in str(error.value)


def test_the_campaign_goes_over_the_robot_file_joint_by_joint(workbench: Workbench) -> None:
    robot_with(workbench.directory, "[actuators.q1]\npeak = 100.0\nrms = 50.0\n[actuators.q2]\npeak = 100.0\n")
    own = (FIVEBAR / "fivebar.toml").read_text()
    limits = '[actuators.q1]\npeak = 0.001\nsource = "mine"\n'
    done = workbench.run(own.replace("[[case]]", f"{limits}\n[[case]]", 1), "--quick", "--out", "b")
    manifest = json.loads(Path("b/manifest.json").read_text())
    assert {j: (one["peak"], one["rms"]) for j, one in manifest["actuators"].items()} == {
        "q1": (0.001, None),
        "q2": (100.0, None),
    }
    assert "q1: its actuator is too small" in done.out
    assert "q2: its actuator" not in done.out
    done = workbench.run(own.replace("[[case]]", limits.replace("q1", "q7") + "\n[[case]]", 1), "--dry-run")
    assert done.code == 2
    assert 'no actuated joint "q7"' in done.err


@pytest.mark.parametrize("limits", ["", "[actuators.q1]\npeak = 100.0\n"])
@pytest.mark.usefixtures("inline_workers")
def test_a_sweep_says_that_it_holds_nothing_against_limits(workbench: Workbench, limits: str) -> None:
    robot_with(workbench.directory, limits)
    sweep = (FIVEBAR / "fivebar.toml").read_text().partition("[[case]]")
    case = "\n[[case]]".join(["", sweep[2].partition("[[case]]")[0].replace("samples = 101", "samples = 7")])
    vary = '\n[sweep]\nmethod = "grid"\n[[sweep.vary]]\nkey = "speed"\nvalues = [0.5, 1.0]\n'
    done = workbench.run(sweep[0] + case + vary, "--jobs", "1", "--out", "s")
    assert done.code in (0, 4), done.err
    assert ("holds no design against the limits" in " ".join(done.out.split())) == bool(limits)
    manifest = json.loads(Path("s/manifest.json").read_text())
    assert list(manifest["actuators"]) == (["q1"] if limits else [])
