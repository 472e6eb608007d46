"""Tolerances belong to a robot's size and to a file's digits."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from made_machines import spherical
from own_mechanisms import FOURBAR
from workbench.errors import ModelError
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference
from workbench.reference.left_open import left_open
from workbench.reference.power import power_balance
from workbench.reference.tolerance import INCONSISTENT, Tolerance

GUESS = (("crank", 1.0), ("elbow", -0.5), ("wrist", -1.5))
SETUP = Setup(("crank",), "coupler", initial=GUESS)
TIMES = np.linspace(0.0, 1.0, 21)[:, None]
MOTION = 1.0 + 0.4 * np.sin(3 * TIMES), 1.2 * np.cos(3 * TIMES), -3.6 * np.sin(3 * TIMES)
SLOW = 0.1 * np.sin(TIMES), 0.1 * np.cos(TIMES), -0.1 * np.sin(TIMES)


def reference(tmp_path: Path, text: str, setup: Setup | None = SETUP) -> MujocoReference:
    path = tmp_path / "model.xml"
    path.write_text(text, encoding="utf-8")
    return MujocoReference(path, setup=setup)


def scaled(text: str, factor: float) -> str:
    """The same file with all lengths times a factor."""

    def grow(match: re.Match[str]) -> str:
        return f'{match[1]}="{" ".join(repr(factor * float(word)) for word in match[2].split())}"'

    return re.sub(r'(pos|fromto|size)="([^"]*)"', grow, text)


def test_a_robot_in_millimetres(tmp_path: Path) -> None:
    metres = reference(tmp_path, FOURBAR.replace("<option>", '<option gravity="0 0 -9.81">'))
    expected = metres.inverse_dynamics(*MOTION, external_force=[1.0, 0.0, 2.0])
    small = scaled(FOURBAR.replace("<option>", '<option gravity="0 0 -9810">'), 1000.0)
    found = reference(tmp_path, small)
    result = found.inverse_dynamics(*MOTION, external_force=[1000.0, 0.0, 2000.0])
    assert np.abs(1e-6 * result.tau - expected.tau).max() < 1e-12 * np.abs(expected.tau).max()
    assert power_balance(found, *MOTION).relative < 1e-9


@pytest.mark.parametrize("far", [10.0, 2000.0])
def test_a_robot_far_from_the_origin(tmp_path: Path, far: float) -> None:
    expected = reference(tmp_path, FOURBAR).inverse_dynamics(*MOTION).tau
    moved = FOURBAR.replace("<worldbody>", f'<worldbody><body name="b" pos="{far} 0 0">').replace(
        "</worldbody>", "</body></worldbody>"
    )
    found = reference(tmp_path, moved).inverse_dynamics(*MOTION).tau
    assert np.abs(found - expected).max() < 1e-14 * far * 100 * np.abs(expected).max()


def test_spherical_loops_of_six_digits_are_closed_by_least_squares(tmp_path: Path) -> None:
    exact = reference(tmp_path, spherical(1, None)[0], None)
    rounded = reference(tmp_path, spherical(1, 6)[0], None)
    assert exact.mobility().mobility == rounded.mobility().mobility == 1
    assert not exact.notes
    assert any("agree only to some digits" in note for note in rounded.notes)
    one, two = exact.inverse_dynamics(*SLOW), rounded.inverse_dynamics(*SLOW)
    peak = np.abs(one.tau).max()
    off = np.abs(one.tau - two.tau).max() / peak
    worth = left_open(rounded, two, *SLOW)[0] / peak
    assert two.closure_residual.max() > 1e-10
    assert 1e-9 < off < 1e-4
    assert 0.1 * off < worth < 10 * off
    assert not one.slack.any()


def test_rates_of_loops_of_few_digits_may_disagree_ten_times_as_far() -> None:
    few = Tolerance(size=2.0, closed=1e-13, allowed=1e-6, few_digits=True)
    assert (few.residual, few.velocity) == (1e-6, pytest.approx(1e-5))
    exact = dataclasses.replace(few, few_digits=False)
    assert exact.residual == exact.closed
    assert exact.velocity == pytest.approx(2.0 * INCONSISTENT)


def test_a_tolerance_that_is_named_lets_it_run(tmp_path: Path) -> None:
    text = spherical(1, 4)[0]
    with pytest.raises(ModelError, match="needs a closure tolerance of") as refused:
        reference(tmp_path, text, None)
    said = f'<custom><text name="closure_tolerance" data="{refused.value.facts["tolerance"]:.1e}"/>'
    found = reference(tmp_path, text.replace("<custom>", said), None).inverse_dynamics(*SLOW).tau
    expected = reference(tmp_path, spherical(1, None)[0], None).inverse_dynamics(*SLOW).tau
    assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()
    with pytest.raises(ModelError, match="allowed: a positive number of metres"):
        reference(tmp_path, text.replace("<custom>", '<custom><text name="closure_tolerance" data="few"/>'), None)


def test_a_linkage_that_closes_is_closed_to_rounding_whatever_the_tolerance(tmp_path: Path) -> None:
    said = '<custom><text name="closure_tolerance" data="0.01"/></custom></mujoco>'
    result = reference(tmp_path, FOURBAR.replace("</mujoco>", said)).inverse_dynamics(*MOTION)
    assert result.closure_residual.max() < 1e-13
    assert np.array_equal(result.tau, reference(tmp_path, FOURBAR).inverse_dynamics(*MOTION).tau)


def test_a_loop_that_cannot_close_is_described_as_it_is_drawn(tmp_path: Path) -> None:
    # the last link and the ground pivot are 0.9 m apart at best; as drawn it is 2.5 - 0.9 = 1.6 m
    text = FOURBAR.replace('pos="0.5 0 0"/>', 'pos="2.5 0 0"/>')
    with pytest.raises(ModelError, match=r'equality "loop" is open by 1.6 m as drawn'):
        reference(tmp_path, text, Setup(("crank",), "coupler"))
