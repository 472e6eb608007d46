"""One case compared: a platform that is elsewhere fails or is refused, and each row is judged by its own bound."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import workbench as wb
from small_campaign import CANDIDATES, CASE, HEAD
from workbench.campaign import compare
from workbench.campaign.cases import Case, resolve_cases
from workbench.campaign.compare import CaseResult, compute_case
from workbench.campaign.evidence import Effort, Evidence
from workbench.campaign.spec import Campaign, load_campaign
from workbench.errors import ModelError

ERRORS_ONLY = Effort(budget=False, drawing=False)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> tuple[Campaign, Case]:
    return read(tmp_path_factory.mktemp("compare") / "small.toml", HEAD + CANDIDATES + CASE)


def read(file: Path, text: str) -> tuple[Campaign, Case]:
    file.write_text(text, encoding="utf-8")
    loaded = load_campaign(file)[0]
    return loaded, resolve_cases(loaded, file)[0]


def computed(campaign: tuple[Campaign, Case], **spoiled: np.ndarray) -> CaseResult:
    return compute_case(campaign[0], dataclasses.replace(campaign[1], **spoiled), ERRORS_ONLY)


def verdicts(result: CaseResult, candidate: str = "distributed") -> list[str]:
    return [row.verdict for row in result.rows if row.candidate == candidate]


@pytest.mark.parametrize(("name", "said"), [("x", "position"), ("xd", "velocity"), ("xdd", "acceleration")])
def test_a_platform_that_moves_otherwise_fails_the_case(campaign: tuple[Campaign, Case], name: str, said: str) -> None:
    right = computed(campaign)
    assert (right.facts["status"], right.facts["message"]) == ("passed", None)
    # ten thousand times rounding, and nothing that a picture would show
    moved = computed(campaign, **{name: (1.0 + 1e-10) * getattr(campaign[1], name)})
    assert moved.facts["status"] == "failed"
    assert moved.facts["message"].startswith(f"platform {said} by 1e-10 of its peak (allowed: ")
    assert [row.verdict for row in moved.rows] == [row.verdict for row in right.rows], "torques are another matter"


def test_a_platform_that_is_no_number_fails_the_case(campaign: tuple[Campaign, Case]) -> None:
    lost = campaign[1].xdd.copy()
    lost[3] = np.nan
    found = computed(campaign, xdd=lost)
    assert found.facts["status"] == "failed"
    assert "platform acceleration by nan" in found.facts["message"]


def test_another_pose_of_the_robot_is_refused(campaign: tuple[Campaign, Case]) -> None:
    case = campaign[1]
    x = case.x.copy()
    x[7] += [0.0, 1e-5, 0.0]
    with pytest.raises(ModelError, match=r"the platform is 1e-05 m from where the closed form puts it at t = 0\.35 s"):
        computed(campaign, x=x)
    # rounding, a thousand times over, is no other pose
    x[7] = case.x[7] + [0.0, 1e-9, 0.0]
    assert computed(campaign, x=x).facts["status"] == "failed"


@pytest.mark.parametrize(("uncertainty", "verdict"), [(0.8e-11, "pass"), (1.2e-11, "undecided")])
def test_rows_are_judged_by_what_the_reference_is_worth(
    campaign: tuple[Campaign, Case], monkeypatch: pytest.MonkeyPatch, uncertainty: float, verdict: str
) -> None:
    evidence = Evidence(spread={"distributed": {"q2": uncertainty}})
    monkeypatch.setattr(compare, "gather_evidence", lambda *_: evidence)
    found = computed(campaign)
    assert verdicts(found) == ["pass", verdict, "pass"]
    assert found.facts["status"] == ("passed" if verdict == "pass" else "failed")


def test_a_bound_of_the_case_counts_in_its_rows(tmp_path: Path) -> None:
    bounds = 'name = "first"\nbounds = { q2 = 0.5 }'
    text = HEAD + CANDIDATES + CASE.replace('name = "first"', bounds)
    # lumped masses against distributed ones are off by percents
    text = text.replace(
        'name = "lumped"\nreference = "distributed"', 'name = "lumped"\nreference = "distributed"\nbound = 1e-10'
    )
    found = compute_case(*read(tmp_path / "small.toml", text), ERRORS_ONLY)
    rows = [row for row in found.rows if (row.candidate, row.reference) == ("lumped", "distributed")]
    assert [(row.joint, row.bound, row.verdict) for row in rows] == [
        ("q1", 1e-10, "fail"),
        ("q2", 0.5, "pass"),
        ("q3", 1e-10, "fail"),
    ]
    assert rows[1].peak_error > 1e-3


FORCE = [12.0, -8.0, 25.0]


def test_rows_facts_and_columns_are_those_of_the_python_interface(tmp_path: Path) -> None:
    """Everything that a reader of a run sees of a case, computed a second time from the public functions alone."""
    parts = f'name = "first"\nparameters = {{ payload = 1.5 }}\nexternal_force = {FORCE}'
    campaign, case = read(tmp_path / "small.toml", HEAD + CANDIDATES + CASE.replace('name = "first"', parts))
    found = compute_case(campaign, case, Effort(budget=True, drawing=True))
    series, facts = found.series, found.facts
    t = series["t"]
    np.testing.assert_allclose(t, np.linspace(0.0, 1.0, 21), rtol=1e-15)
    q, qd, qdd = (np.column_stack([series[f"{name}{i}"] for i in (1, 2, 3)]) for name in ("q", "qd", "qdd"))
    # the motion as it is written, one sine a joint
    terms = ((0.02, 0.06, 4.0, 0.3), (0.75, 0.3, 6.0, 0.0), (0.85, 0.28, 5.0, 2.6))
    for i, (offset, size, rate, phase) in enumerate(terms):
        np.testing.assert_allclose(q[:, i], offset + size * np.sin(rate * t + phase), atol=1e-14)
        np.testing.assert_allclose(qd[:, i], size * rate * np.cos(rate * t + phase), atol=1e-13)
        np.testing.assert_allclose(qdd[:, i], -size * rate**2 * np.sin(rate * t + phase), atol=1e-12)

    model = "models/asym_2rss_ppap.xml"
    mech, reference = wb.load_mechanism(model, payload=1.5), wb.MujocoReference(model, payload=1.5)
    results = {name: reference.inverse_dynamics(q, qd, qdd, name, FORCE, along=t) for name in ("lumped", "distributed")}
    for name, result in results.items():
        for i in range(3):
            np.testing.assert_array_equal(series[f"ref_{name}_q{i + 1}"], result.tau[:, i])
            closed = mech.inverse_dynamics(q, qd, qdd, name, FORCE)
            np.testing.assert_array_equal(series[f"cand_{name}_q{i + 1}"], closed[:, i])
    motion = mech.platform_motion(q, qd, qdd)
    for name, values in zip(("x", "xd", "xdd"), motion, strict=True):
        np.testing.assert_allclose(np.column_stack([series[f"{name}{i}"] for i in (1, 2, 3)]), values, rtol=1e-12)
    first = results["lumped"]
    for joint, force in first.reactions.items():
        np.testing.assert_array_equal(np.column_stack([series[f"reaction_{joint}_{a}"] for a in "xyz"]), force)
        assert facts["peak_reactions"][joint] == max(float(np.sqrt(f @ f)) for f in force)

    speed, rise = (np.sqrt((values**2).sum(axis=1)) for values in motion[1:])
    assert facts["peak_speed"] == pytest.approx(speed.max(), rel=1e-12)
    assert facts["speed_at_s"] == t[int(np.argmax(speed))]
    assert facts["peak_acceleration"] == pytest.approx(rise.max(), rel=1e-12)
    assert facts["acceleration_at_s"] == t[int(np.argmax(rise))]
    assert (facts["samples"], facts["duration_s"]) == (21, 1.0)
    assert (facts["parameters"], facts["external_force"]) == ({"payload": 1.5}, FORCE)
    for name in ("closure_residual", "velocity_residual", "acceleration_residual", "condition"):
        assert facts[name] == max(getattr(first, name).tolist()), name
    mobility = reference.mobility()
    for name in ("mobility", "joint_freedoms", "rank", "constraint_rows", "redundant_rows", "idle_freedoms"):
        assert facts[name] == getattr(mobility, name)
    for name, values in mech.singularity_measures(q).items():
        size = np.abs(values)
        assert facts["singularity"][name] == {"min": size.min(), "time": t[int(np.argmin(size))]}
    assert all(0.0 <= worth < 1e-11 for worth in facts["kinematics"].values())

    assert [(row.candidate, row.reference) for row in found.rows[::3]] == [
        ("lumped", "lumped"), ("distributed", "distributed"), ("lumped", "distributed"),
        ("raw mj_inverse", "distributed"),
    ]  # fmt: skip
    evidence = facts["evidence"]
    for row in found.rows[:9]:
        i = int(row.joint[1]) - 1
        tau, ref = (series[f"{kind}_{row.joint}"] for kind in (f"cand_{row.candidate}", f"ref_{row.reference}"))
        off = np.abs(tau - ref)
        assert row.peak_reference == row.normaliser == np.abs(ref).max()
        assert row.peak_error == off.max() / np.abs(ref).max()
        assert row.rms_error == pytest.approx(np.sqrt((off**2).sum() / (ref**2).sum()), rel=1e-12)
        assert row.worst_time_s == t[int(np.argmax(off))]
        assert (row.case, row.unit) == ("first", ["N", "N m", "N m"][i])
        assert row.power_residual == row.uncertainty == evidence["power_balance"][row.reference]["relative"] < 1e-11
        same = row.candidate == row.reference
        assert (row.bound, row.verdict) == ((1e-10, "pass") if same else (None, "measured"))
        assert row.kind == ("verification" if same else "modelling")
    for row in found.rows[9:]:  # MuJoCo's inverse as it comes misses what the loops carry, and nothing judges it
        assert (row.kind, row.verdict, row.bound) == ("contrast", "measured", None)
        assert row.peak_error > 0.1
    assert set(evidence["replay"]["candidates"]) == {"reference", "lumped", "distributed"}
    assert evidence["replay"]["candidates"]["distributed"]["verdict"] == "converges"
    assert found.qpos is not None
    np.testing.assert_array_equal(found.qpos, first.qpos)
    for i in (1, 2, 3):  # what the torque is spent on, of the first mass model
        parts = [values for name, values in series.items() if name.startswith("part_") and name.endswith(f"_q{i}")]
        assert len(parts) > 2
        np.testing.assert_allclose(sum(parts), first.tau[:, i - 1], atol=1e-10)


@pytest.mark.parametrize("name", ["q1", "q3"])
def test_a_candidate_off_on_one_joint_fails_on_that_joint(
    campaign: tuple[Campaign, Case], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    joint = campaign[1].robot.joints.index(name)
    ask = compare.torques_of

    def off(*arguments: object, **options: object) -> object:
        found = ask(*arguments, **options)  # type: ignore[arg-type]
        found.torques["distributed"][4, joint] *= 1.01
        return found

    monkeypatch.setattr(compare, "torques_of", off)
    found = computed(campaign)
    assert verdicts(found) == ["fail" if one == name else "pass" for one in campaign[1].robot.joints]
    assert found.facts["status"] == "failed"
    assert next(row for row in found.rows if row.verdict == "fail").worst_time_s == campaign[1].motion.t[4]
