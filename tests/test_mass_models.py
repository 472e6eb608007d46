"""Mass models: moments by quadrature, limit cases by hand, MuJoCo with other rods; each with a spoiled twin."""

from __future__ import annotations

from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import workbench as wb
from robots import MODEL, Motion, motion_inside, peak_error, random_changes, table_1
from workbench.campaign.evidence import Effort
from workbench.campaign.run import Outcome, run_campaign
from workbench.capabilities.robot import Robot
from workbench.errors import ParameterError
from workbench.robots.mass_models import (
    MASS_MODELS,
    Bar,
    BarModel,
    EndPointMasses,
    distributed,
    end_masses,
    equimomental,
    lumped,
    mass_model,
    three_masses,
)

ROUND_OFF = 1e-12
BOUND = 1e-10  # against MuJoCo
ERRORS_ONLY = Effort(budget=False)
UNIFORM = Bar(mass=0.3, inertia=0.3 * 0.3**2 / 12, length=0.3, fraction=0.5)
TIME = np.linspace(0.0, 1.0, 60)


def sines(frequency: tuple[float, float, float], start: float, stop: float, samples: int, ahead: float = 0.0) -> Motion:
    """The paper's offsets and amplitudes, [Almeida2010] eq. (16)-(18); q3 may run ahead."""
    rate, amplitude = np.array(frequency), np.array([0.1, np.pi / 12, np.pi / 12])
    angle = np.linspace(start, stop, samples)[:, None] * rate + np.array([0.0, 0.0, ahead])
    q = np.array([0.0, np.pi / 4, np.pi / 4]) + amplitude * np.sin(angle)
    return q, amplitude * rate * np.cos(angle), -amplitude * rate**2 * np.sin(angle)


SIMULATION_1 = sines((2, 5, 5), 0.1, 5.0, 1961)
SIMULATION_2 = sines((10, 25, 35), 0.1, 1.0, 901)


def torques(mech: Robot, motion: Motion, model: str, force: np.ndarray | None = None) -> np.ndarray:
    given_force = np.zeros_like(motion[0]) if force is None else force
    return mech.candidates[model].function(mech, *motion, given_force)


def errors(mech: Robot, motion: Motion, model: str) -> np.ndarray:
    """Peak-normalised error of each joint against distributed masses."""
    reference = mech.inverse_dynamics(*motion)
    return np.abs(torques(mech, motion, model) - reference).max(axis=0) / np.abs(reference).max(axis=0)


def as_array(masses: EndPointMasses) -> np.ndarray:
    return np.array(astuple(masses))


# One bar


def by_quadrature(density: np.ndarray) -> tuple[Bar, np.ndarray]:
    """A bar of length 0.4 with a density given at Gauss points: its parameters, and its five numbers by integration."""
    z, weight = np.polynomial.legendre.leggauss(len(density))
    z, dm = (z + 1) / 2, weight / 2 * density
    mass, k = dm.sum(), (z * dm).sum() / dm.sum()
    bar = Bar(mass, 0.4**2 * ((z - k) ** 2 * dm).sum(), 0.4, k)
    proximal, distal = 1 - z, z
    shapes = (proximal * proximal, proximal * distal, distal * distal, proximal, distal)
    return bar, np.array([(shape * dm).sum() for shape in shapes])


@given(st.lists(st.floats(0.2, 5.0), min_size=3, max_size=9))
def test_distributed_and_three_masses_are_the_integrals_over_the_bar(density: list[float]) -> None:
    bar, integrals = by_quadrature(np.array(density))
    for rule in (distributed, equimomental):
        np.testing.assert_allclose(as_array(rule(bar)), integrals, rtol=0, atol=ROUND_OFF * bar.mass)
    spoiled = Bar(bar.mass, bar.inertia * 0.999, bar.length, bar.fraction)
    assert np.abs(as_array(equimomental(spoiled)) - integrals).max() > 1e-6 * bar.mass
    assert min(point.mass for point in three_masses(bar)) >= -ROUND_OFF * bar.mass


def test_a_uniform_bar_is_a_sixth_two_thirds_and_a_sixth() -> None:
    points = three_masses(UNIFORM)
    np.testing.assert_allclose([p.mass / 0.3 for p in points], [1 / 6, 2 / 3, 1 / 6], rtol=ROUND_OFF)
    assert [p.fraction for p in points] == [0.0, 0.5, 1.0]


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        (distributed, (1 / 3, 1 / 6, 1 / 3, 1 / 2, 1 / 2)),
        (equimomental, (1 / 3, 1 / 6, 1 / 3, 1 / 2, 1 / 2)),
        (lumped, (1 / 4, 1 / 4, 1 / 4, 1 / 2, 1 / 2)),
        (end_masses(2 / 3), (2 / 3, 0, 1 / 3, 2 / 3, 1 / 3)),
        (end_masses(0.5), (1 / 2, 0, 1 / 2, 1 / 2, 1 / 2)),
        (end_masses(1.0), (1, 0, 0, 1, 0)),
    ],
)
def test_a_uniform_bar_in_numbers(rule: BarModel, expected: tuple[float, ...]) -> None:
    np.testing.assert_allclose(as_array(rule(UNIFORM)) / 0.3, expected, rtol=0, atol=ROUND_OFF)


def test_a_dumbbell_leaves_nothing_at_its_mass_centre() -> None:
    # 2 kg at the proximal end, 1 kg at the distal end, 0.5 m: k = 1/3, I = 2 (1/6)^2 + (1/3)^2 = 1/6
    points = three_masses(Bar(3.0, 1 / 6, 0.5, 1 / 3))
    np.testing.assert_allclose([p.mass for p in points], [2.0, 0.0, 1.0], atol=1e-11)


def test_a_point_mass_stays_one_point() -> None:
    for k in (0.0, 0.3, 1.0):
        assert [p.mass for p in three_masses(Bar(2.0, 0.0, 0.5, k))] == [0.0, 2.0, 0.0]


@pytest.mark.parametrize("k", [0.0, 0.2, 0.5, 1.0])
def test_more_inertia_than_mass_between_the_ends_has_is_refused(k: float) -> None:
    limit = 2.0 * k * (1 - k) * 0.5**2
    with pytest.raises(ParameterError, match=r"inertia .* allowed: <= "):
        three_masses(Bar(2.0, limit * 1.001 + 1e-9, 0.5, k))


def test_names() -> None:
    assert mass_model("codourey") is MASS_MODELS["codourey"]
    assert as_array(mass_model("end-masses-0.25").rods(UNIFORM))[0] == 0.3 * 0.25
    assert mass_model("end-masses-1").name == "end-masses-1"
    with pytest.raises(ParameterError, match='did you mean "codourey"'):
        mass_model("codurey")
    with pytest.raises(ParameterError, match="allowed: 0 to 1"):
        mass_model("end-masses-1.5")
    for wrong in ("end-masses-", "end-masses--0.5", "end-masses-0.5e0", "end-masses-nan", "end-masses-2"):
        with pytest.raises(ParameterError, match="unknown mass model"):
            mass_model(wrong)


def test_end_masses_leave_arms_and_parallelogram_as_they_are() -> None:
    for name in ("codourey", "end-masses-0.25", "lumped-rods"):
        np.testing.assert_array_equal(as_array(mass_model(name).others(UNIFORM)), as_array(distributed(UNIFORM)))


# The whole robot


@pytest.mark.parametrize("motion", [SIMULATION_1, SIMULATION_2], ids=["simulation 1", "simulation 2"])
@pytest.mark.parametrize("payload", [0.0, 2.0])
def test_three_masses_equal_distributed_masses(motion: Motion, payload: float) -> None:
    mech = table_1().with_parameters(payload=payload)
    assert errors(mech, motion, "equimomental").max() <= ROUND_OFF
    for spoiled in ("lumped", "lumped-rods", "end-masses-0.50"):
        assert errors(mech, motion, spoiled).max() > 1e-3


@pytest.mark.parametrize("seed", range(6))
def test_three_masses_equal_distributed_masses_on_other_robots(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mech, motion = wb.load_mechanism(MODEL), None
    while motion is None:
        changes = random_changes(rng)
        for bar in ("1_left", "1_right", "2_left", "2_right", "5"):
            k = changes[f"k{bar}"]
            room = changes[f"m{bar}"] * changes[f"a{bar}"] ** 2 * k * (1 - k)
            changes[f"I{bar}"] = float(rng.uniform(0.05, 1.0)) * room
        mech = wb.load_mechanism(MODEL, **changes)
        motion, _ = motion_inside(mech, rng, TIME)
    assert errors(mech, motion, "equimomental").max() <= ROUND_OFF
    heavier = mech.with_parameters(I2_left=0.999 * mech.parameters.I2_left, k2_left=mech.parameters.k2_left)
    other = np.abs(torques(heavier, motion, "equimomental") - mech.inverse_dynamics(*motion))
    assert other.max() > 1e3 * ROUND_OFF


def test_a_bar_that_three_masses_cannot_be_is_refused() -> None:
    mech = table_1().with_parameters(I2_left=1.0, k2_left=0.5)
    with pytest.raises(ParameterError, match="equimomental"):
        torques(mech, SIMULATION_1, "equimomental")


@pytest.mark.parametrize("share", [0.25, 0.5, 2 / 3, 0.9])
def test_end_masses_equal_mujoco_with_such_rods(share: float) -> None:
    """Two masses have their centre at 1 - r and the inertia m r (1-r) len^2: a MuJoCo model can be given just that."""
    mech = table_1()
    p, motion = mech.parameters, sines((7, 11, 16), 0.0, 1.0, 101)
    name = "codourey" if share == 2 / 3 else f"end-masses-{share:g}"
    force = np.tile([12.0, -8.0, 25.0], (len(motion[0]), 1))

    def with_share(r: float) -> np.ndarray:
        reference = wb.MujocoReference(MODEL, k2=1 - r, I2=p.m2 * r * (1 - r) * p.a2**2)
        return reference.inverse_dynamics(*motion, "distributed", force).tau

    assert peak_error(torques(mech, motion, name, force), with_share(share)) <= BOUND
    assert peak_error(torques(mech, motion, name, force), with_share(share - 0.01)) > 1e-3


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 2 / 3, 1.0])
def test_at_rest_the_error_is_the_weight_that_was_moved(share: float) -> None:
    """With q2 = q3 the parallelogram hangs plumb, and tau1 at rest carries only what hangs on the platform.

    That is m3 + M + m2 (half of each rod); end masses make it m3 + M + 2 (1-r) m2.
    """
    mech = table_1().with_parameters(payload=0.7)
    p = mech.parameters
    q = np.array([[0.05, 0.6, 0.6], [-0.1, 0.9, 0.9]])
    rest = (q, np.zeros_like(q), np.zeros_like(q))
    name = "codourey" if share == 2 / 3 else f"end-masses-{share:g}"
    moved = torques(mech, rest, name)[:, 0] / mech.inverse_dynamics(*rest)[:, 0] - 1
    np.testing.assert_allclose(moved, p.m2 * (1 - 2 * share) / (p.m3 + p.payload + p.m2), atol=ROUND_OFF)
    if share != 0.5:
        assert np.abs(moved - p.m2 * (2 * share - 1) / (p.m3 + p.payload + p.m2)).min() > 1e-2


@pytest.mark.parametrize("model", ["lumped", "equimomental"])
def test_at_rest_models_that_keep_the_mass_centre_are_right(model: str) -> None:
    q = np.array([[0.05, 0.6, 0.8], [-0.1, 0.9, 0.7]])
    rest = (q, np.zeros_like(q), np.zeros_like(q))
    assert errors(table_1(), rest, model).max() <= ROUND_OFF
    assert errors(table_1(), rest, "codourey").max() > 1e-2


@pytest.mark.parametrize("motion", [SIMULATION_1, SIMULATION_2], ids=["simulation 1", "simulation 2"])
def test_half_at_each_end_errs_twice_as_far_as_lumped_the_other_way(motion: Motion) -> None:
    """A uniform bar is 2/3 of itself at its centre and 1/3 of itself at its ends, and torques are linear in masses."""
    mech = table_1()
    exact = mech.inverse_dynamics(*motion)
    lumped_error = torques(mech, motion, "lumped-rods") - exact
    peak = np.abs(exact).max(axis=0)

    def distance(share: float) -> float:
        ends = torques(mech, motion, f"end-masses-{share:g}") - exact
        return float((np.abs(ends + 2 * lumped_error) / peak).max())

    assert distance(0.5) <= ROUND_OFF
    assert distance(0.51) > 1e-4


def test_without_weight_the_error_does_not_depend_on_the_frequency() -> None:
    """All inertia forces grow with the square of the frequency; only weights single out a speed."""
    floating = table_1().with_parameters(g=0.0)

    def at(mech: Robot, rate: float, model: str) -> np.ndarray:
        return errors(mech, sines((rate,) * 3, 0.0, 2 * np.pi / rate, 201, ahead=1.0), model)

    for model in ("lumped", "codourey", "end-masses-0.50"):
        np.testing.assert_allclose(at(floating, 1.0, model), at(floating, 40.0, model), rtol=1e-9)
        assert np.abs(at(table_1(), 1.0, model) - at(table_1(), 40.0, model)).min() > 0.01


# The campaign


@pytest.fixture(scope="module")
def outcome(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    out = tmp_path_factory.mktemp("mass_models") / "run"
    only = ("slow", "fast", "rate_1", "rate_10", "rate_40")
    return run_campaign(repository / "campaigns" / "mass_models.toml", out, only=only, effort=ERRORS_ONLY)


def measured(outcome: Outcome, case: str, candidate: str) -> list[float]:
    return [row.peak_error for row in outcome.rows if (row.case, row.candidate) == (case, candidate)]


def test_the_campaign_measures_codourey_s_rule(outcome: Outcome) -> None:
    assert outcome.passed
    np.testing.assert_allclose(measured(outcome, "slow", "codourey"), [0.192, 0.075, 0.075], atol=5e-4)
    np.testing.assert_allclose(measured(outcome, "fast", "codourey"), [0.026, 0.060, 0.025], atol=5e-4)
    np.testing.assert_allclose(measured(outcome, "slow", "lumped"), [0.033, 0.016, 0.016], atol=5e-4)
    np.testing.assert_allclose(measured(outcome, "fast", "lumped"), [0.055, 0.045, 0.059], atol=5e-4)


def test_the_campaign_answers_the_conjecture_joint_by_joint(outcome: Outcome) -> None:
    holds = {claim["id"]: claim["holds"] for claim in outcome.manifest["claims"]}
    conjecture = [holds[f"conjecture-{simulation}-{joint}"] for simulation in (1, 2) for joint in (1, 2, 3)]
    assert conjecture == [False, False, False, True, False, True]
    assert all(held for name, held in holds.items() if name.startswith("codourey-"))


def test_three_masses_are_judged_and_the_others_are_measured(outcome: Outcome) -> None:
    verdicts = {row.candidate: row.verdict for row in outcome.rows}
    assert {name for name, verdict in verdicts.items() if verdict == "pass"} == {"distributed", "equimomental"}
    assert set(verdicts.values()) == {"pass", "measured"}


def test_every_variant_has_a_cost_and_results_have_none(outcome: Outcome) -> None:
    costs = [candidate["cost_us"] for candidate in outcome.manifest["candidates"].values()]
    assert len(costs) == 11
    assert all(0.0 < cost < 1000.0 for cost in costs)
    assert "cost" not in (outcome.directory / "summary.csv").read_text(encoding="utf-8")


def test_the_figure_keeps_only_cases_that_were_computed(outcome: Outcome) -> None:
    (figure,) = outcome.manifest["figures"]
    assert figure["kind"] == "error_over"
    assert dict(zip(figure["cases"], figure["abscissa"], strict=True)) == {
        "rate_1": 1.0,
        "rate_10": 10.0,
        "rate_40": 40.0,
    }
