"""Which cases a sweep has: methods, keys, seeds, what is refused; and what a dry run says of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from small_campaign import Workbench, listing
from sweep_campaign import SWEEP
from workbench.campaign.spec import load_campaign
from workbench.campaign.sweep_spec import SweepSpec
from workbench.errors import WorkbenchError
from workbench.sweep.plan import Plan, plan_sweep
from workbench.sweep.samples import sweep_values

HEAD, _, _ = SWEEP.partition("[sweep]")


def sweep(**keys: object) -> SweepSpec:
    return SweepSpec.model_validate(keys)


def plan(directory: Path, table: str, **settings: float) -> Plan:
    path = directory / "sweep.toml"
    path.write_text(HEAD + "[sweep]\n" + table, encoding="utf-8")
    campaign, file = load_campaign(path)
    return plan_sweep(campaign, file, None, settings)


def test_a_grid_runs_through_its_last_key_fastest() -> None:
    found = sweep_values(
        sweep(
            method="grid",
            vary=[
                {"key": "parameters.payload", "values": [0.0, 1.0]},
                {"key": "speed", "low": 1.0, "high": 4.0, "count": 3, "scale": "log"},
            ],
        )
    )
    np.testing.assert_allclose(found, [[0, 1], [0, 2], [0, 4], [1, 1], [1, 2], [1, 4]], rtol=1e-15)
    assert found[-1, 1] == 4.0


def test_a_list_goes_through_its_keys_together() -> None:
    vary = [{"key": "a", "values": [1.0, 2.0]}, {"key": "b", "values": [5.0, 3.0]}]
    assert sweep_values(sweep(method="list", vary=vary)).tolist() == [[1.0, 5.0], [2.0, 3.0]]


RANGES = [{"key": "a", "low": -1.0, "high": 3.0}, {"key": "b", "low": 0.5, "high": 8.0, "scale": "log"}]


@pytest.mark.parametrize("method", ["latin_hypercube", "sobol"])
def test_sampled_sweeps_fill_their_ranges_and_follow_their_seed(method: str) -> None:
    one, same, other = (sweep_values(sweep(method=method, samples=64, seed=s, vary=RANGES)) for s in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)
    assert (one >= [-1.0, 0.5]).all()
    assert (one <= [3.0, 8.0]).all()
    # one point in each of 64 slices of each key, on the key's own scale: what a random sample would not have
    for unit in ((one[:, 0] + 1) / 4, np.log(one[:, 1] / 0.5) / np.log(16)):
        assert sorted(np.floor(unit * 64).astype(int)) == list(range(64))
    random = np.random.default_rng(1).random(64)
    assert sorted(np.floor(random * 64).astype(int)) != list(range(64))


def test_more_sobol_points_begin_with_the_same() -> None:
    few, many = (sweep_values(sweep(method="sobol", samples=n, seed=5, vary=RANGES)) for n in (10, 100))
    np.testing.assert_array_equal(few, many[:10])


def test_keys_change_what_they_name(tmp_path: Path) -> None:
    found = plan(
        tmp_path,
        """method = "list"
        vary = [
          { key = "parameters.a2", values = [1.1], relative = true },
          { key = "parameters.m1_left", values = [0.7] },
          { key = "motion.amplitude[1]", values = [0.5], relative = true },
          { key = "motion.offset[2]", values = [0.77] },
          { key = "external_force[0]", values = [3.0] },
          { key = "speed", values = [2.0] },
        ]""",
    )
    case = found.case_dict(0)
    base = found.robot.parameters
    expected = {"a2_left": base.a2_left * 1.1, "a2_right": base.a2_right * 1.1, "m1_left": 0.7}
    assert case["parameters"] == expected
    assert case["motion"]["amplitude"] == [0.08, 0.11, 0.2]
    assert case["motion"]["offset"] == [0.0, 0.75, 0.77]
    assert case["external_force"] == [3.0, 0.0, 0.0]
    # twice as fast: double frequencies, half the time, as many samples, the same path
    assert case["motion"]["frequency"] == [10.0, 20.0, 30.0]
    assert (case["motion"]["stop"], case["motion"]["samples"]) == (0.5, 11)
    assert case["name"] == "variant-000000"
    assert found.recipe.case["motion"]["frequency"] == [5.0, 10.0, 15.0]


def test_a_case_of_its_own_is_changed_too(tmp_path: Path) -> None:
    found = plan(
        tmp_path, 'method = "list"\nvary = [{ key = "parameters.m2", values = [2.0], relative = true }]', m1=0.9
    )
    assert found.robot.parameters.m1_left == 0.9
    assert found.case_dict(0)["parameters"] == {"m2_left": 0.6, "m2_right": 0.6}


@pytest.mark.parametrize(
    ("table", "complaint"),
    [
        (
            'method = "grid"\nvary = [{ key = "speed", low = 1.0, high = 2.0 }]',
            "grid needs values, or low, high and count",
        ),
        ('method = "sobol"\nvary = [{ key = "speed", low = 1.0, high = 2.0 }]', "method sobol needs samples"),
        ('method = "list"\nvary = [{ key = "x", values = [1.0] }]', "allowed: parameters.NAME, motion.NAME"),
        ('method = "list"\nvary = [{ key = "parameters.a3", values = [1.0] }]', 'unknown parameter "a3"'),
        ('method = "list"\nvary = [{ key = "motion.offset", values = [1.0] }]', "a list needs the number of its entry"),
        ('method = "list"\nvary = [{ key = "motion.offset[3]", values = [1.0] }]', "numbers in brackets count from 0"),
        ('method = "list"\nvary = [{ key = "motion.ofset[0]", values = [1.0] }]', 'did you mean "offset"?'),
        ('method = "list"\nvary = [{ key = "motion.samples", values = [5.0] }]', "names no real number"),
        ('method = "list"\nvary = [{ key = "speed", values = [0.0] }]', "allowed: factors > 0"),
        (
            'method = "list"\nvary = [{ key = "speed", values = [1.0] }, { key = "speed", values = [1.0] }]',
            "varies twice",
        ),
        (
            'method = "list"\nvary = [{ key = "parameters.a2_left", values = [0.3] },'
            ' { key = "parameters.a2", values = [0.3] }]',
            'key "parameters.a2_left" has no effect: "parameters.a2" sets it too, after it',
        ),
        ('method = "list"\nvary = [{ key = "speed", vales = [1.0] }]', 'unknown key; did you mean "values"?'),
        (
            'method = "grid"\nvary = [{ key = "speed", low = 1.0, high = 2.0, count = 2000000 }]',
            "2000000 cases; allowed: at most 1000000",
        ),
    ],
)
def test_what_is_refused(tmp_path: Path, table: str, complaint: str) -> None:
    with pytest.raises(WorkbenchError) as error:
        plan(tmp_path, table)
    assert complaint in str(error.value)
    assert str(error.value).startswith(str(tmp_path / "sweep.toml"))


@pytest.mark.parametrize("order", [1, -1])
def test_speed_goes_over_all_of_the_motion(tmp_path: Path, order: int) -> None:
    keys = ['{ key = "speed", values = [2.0] }', '{ key = "motion.frequency[0]", values = [3.0] }'][::order]
    found = plan(tmp_path, f'method = "list"\nvary = [{", ".join(keys)}]')
    assert found.case_dict(0)["motion"]["frequency"] == [6.0, 20.0, 30.0]


def test_a_key_of_one_side_goes_over_one_of_both(tmp_path: Path) -> None:
    both, left = ('{ key = "parameters.a2", values = [0.3] }', '{ key = "parameters.a2_left", values = [0.31] }')
    found = plan(tmp_path, f'method = "list"\nvary = [{both}, {left}]')
    assert found.case_dict(0)["parameters"] == {"a2_left": 0.31, "a2_right": 0.3}


def test_set_and_sweep_may_not_both_say_a_parameter(tmp_path: Path) -> None:
    with pytest.raises(WorkbenchError, match="--set sets a2_left in every case"):
        plan(tmp_path, 'method = "list"\nvary = [{ key = "parameters.a2", values = [0.4] }]', a2_left=0.3)


def test_a_sweep_has_one_case_and_no_claims(tmp_path: Path) -> None:
    path = tmp_path / "two.toml"
    second = HEAD[HEAD.index("[[case]]") :].replace("variant", "second")
    path.write_text(HEAD + second + SWEEP[len(HEAD) :], encoding="utf-8")
    with pytest.raises(WorkbenchError, match="a campaign with a sweep has one case"):
        load_campaign(path)


# --- dry run ---


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


def test_a_dry_run_counts_and_writes_nothing(workbench: Workbench) -> None:
    name = workbench.write(SWEEP)
    before = listing(workbench.directory)
    done = workbench("run", name, "--dry-run", "--jobs", "2")
    assert (done.code, done.complaint) == (0, [])
    assert "sweep: 40 cases, 440 samples" in done.out
    assert "with 2 workers" in done.out
    assert "left out by the filter" in done.out
    assert listing(workbench.directory) == before


def test_a_dry_run_of_a_campaign_without_sweep(workbench: Workbench) -> None:
    from small_campaign import SMALL

    done = workbench.run(SMALL, "--dry-run", "--quick")
    assert done.code == 0
    assert "small: 2 cases, 42 samples" in done.out


def test_a_dry_run_refuses_what_a_run_refuses(workbench: Workbench) -> None:
    done = workbench.run(SWEEP.replace('"parameters.payload"', '"parameters.payloat"'), "--dry-run")
    assert done.code == 2
    assert len(done.complaint) == 1
    assert 'did you mean "payload"?' in done.complaint[0]


@pytest.mark.parametrize("name", ["variant", "variant-000040", "variant-1", "other-000001", "variant-000001x"])
def test_a_case_that_the_sweep_does_not_have(workbench: Workbench, name: str) -> None:
    done = workbench.run(SWEEP, "--only", name)
    assert done.code == 2
    assert done.complaint == [
        f'workbench: small.toml: no case "{name}"; the sweep has variant-000000 to variant-000039'
    ]
