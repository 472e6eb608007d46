"""By which method and step MuJoCo's route moves a robot, when a run of it is made again, and studies estimated."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from control_machines import PENDULUM, reference_of
from small_campaign import Workbench
from test_control_study import write
from workbench.arrays import FloatArray
from workbench.campaign.control_spec import PRINTED_COST
from workbench.control.figures import Error
from workbench.control.loop import TRACKED, UNSTABLE, Tracked
from workbench.control.names import NOT_RUN
from workbench.control.routes import AGREED, IMPLICIT_STEP, LONGEST_STEP, by_routes, is_halved
from workbench.reference.forward import Plant
from workbench.reference.replay import quiet
from workbench.reference.stiff_plant import StiffPlant

INERTIA = 0.011 + 0.8 * 0.25**2


def with_joint(folder: Path, more: str) -> StiffPlant:
    text = PENDULUM.replace('<joint name="swing" axis="0 -1 0"', f'<joint name="swing" axis="0 -1 0" {more}')
    return StiffPlant(reference_of(folder, text, "swing", "tip", swing=0.4))


def test_the_fastest_damper_and_spring_decide_the_method(tmp_path: Path) -> None:
    damped = with_joint(tmp_path, 'damping="100"')
    assert damped.fastest == pytest.approx(100.0 / INERTIA, rel=1e-9)
    assert not damped.takes(LONGEST_STEP)
    sprung = with_joint(tmp_path, 'damping="0.3" stiffness="40"')
    assert sprung.fastest == pytest.approx(math.sqrt(40.0 / INERTIA), rel=1e-9)
    assert sprung.takes(LONGEST_STEP)


def test_each_method_does_what_it_is_chosen_for(tmp_path: Path) -> None:
    """A strong damper: the implicit method brings the pendulum to rest, the explicit one loses it."""
    ends = {}
    for explicit in (True, False):
        stiff = with_joint(tmp_path, 'damping="300"')
        stiff.begin(np.array([0.4]), np.array([1.0]))
        stiff.stiffen(1e-3, explicit)
        with quiet():
            stiff.move(np.zeros(1), 0.05, 50)
        ends[explicit] = abs(float(stiff.qd[0]))
    assert ends[False] < 0.01
    assert not ends[True] < 1e3


class Scripted:
    """Runs with errors that were written down, by plant and step; notes what was asked for."""

    def __init__(self, explicit: bool, errors: dict[tuple[str, float, int], float | None]) -> None:
        self.explicit, self.errors = explicit, errors
        self.asked: list[tuple[str, float, int]] = []
        self.stiffness: list[tuple[float, bool]] = []

    def takes(self, step: float) -> bool:
        return self.explicit

    def stiffen(self, step: float, explicit: bool) -> None:
        self.stiffness.append((step, explicit))

    def run(self, plant: Plant | StiffPlant, step: float, times: int) -> Tracked:
        which = "second" if cast(Any, plant) is self else "own"
        self.asked.append((which, step, times))
        found = self.errors[which, step, times]
        state = np.full((2, 1), math.nan if found is None else found)
        return Tracked(UNSTABLE if found is None else TRACKED, 1.0, 0, state, state, state, state, np.zeros(1))


def error(q: FloatArray, x: FloatArray) -> Error:
    return Error(q[0], q[0], float(x[0, 0]), float(x[0, 0]))


OWN = {("own", 1e-3, 1): 1.0, ("own", 5e-4, 1): 1.0}
COARSE, FINE = ("second", 1e-3, 1), ("second", 5e-4, 1)


def routes(script: Scripted, period: float = 1e-3) -> tuple[float | None, str, float]:
    found = by_routes(cast(Any, "own"), cast(Any, script), script.run, error, period, None, is_halved(1.0 / period, ""))
    return (found.second.platform_rms if found.second else None), found.second_status, found.spread


def test_the_second_route_is_made_again_where_it_differs() -> None:
    near = Scripted(True, {**OWN, COARSE: 1.0 + 0.9 * AGREED})
    second, status, spread = routes(near)
    assert (second, status) == (1.0 + 0.9 * AGREED, TRACKED)
    assert math.isnan(spread)
    far = Scripted(True, {**OWN, COARSE: 1.5, FINE: 1.2})
    second, status, spread = routes(far)
    # the finer run is what counts, though it agrees no better than it does
    assert (second, status) == (1.2, TRACKED)
    assert spread == pytest.approx(0.3)
    assert far.stiffness == [(1e-3, True), (5e-4, True)]


def test_a_route_of_first_order_is_extrapolated_from_exact_halves() -> None:
    script = Scripted(False, {**OWN, ("second", IMPLICIT_STEP, 1): 1.4, ("second", IMPLICIT_STEP, 2): 1.2})
    second, status, spread = routes(script)
    assert second == pytest.approx(1.0)
    assert status == TRACKED
    assert spread == pytest.approx(0.2)
    assert script.stiffness == [(IMPLICIT_STEP, False), (0.5 * IMPLICIT_STEP, False)]


@pytest.mark.parametrize(
    ("errors", "status", "runs"),
    [
        ({COARSE: None}, UNSTABLE, 2),  # both routes lose it: agreed
        ({COARSE: 1.0, FINE: 1.0}, TRACKED, 3),  # they differ, so the second has to say it twice
        ({COARSE: 1.0, FINE: None}, UNSTABLE, 3),
    ],
)
def test_what_runs_away_is_looked_at_by_both_routes(
    errors: dict[tuple[str, float, int], float | None], status: str, runs: int
) -> None:
    script = Scripted(True, {("own", 1e-3, 1): None, **errors})
    assert routes(script)[:2] == (None, status)
    assert len(script.asked) == runs


def test_fast_loops_are_not_halved_and_a_route_may_be_left_out() -> None:
    period = 1.0 / 4000.0
    script = Scripted(True, {("own", period, 1): 1.0, ("second", period, 1): 1.0})
    routes(script, period)
    assert script.asked == [("own", period, 1), ("second", period, 1)]
    assert is_halved(2000.0, "2000")
    assert is_halved(1.6e4, PRINTED_COST)  # sentences are judged by these
    assert not is_halved(1.6e4, "16000")
    alone = by_routes(cast(Any, "own"), None, Scripted(True, {**OWN}).run, error, 1e-3, None)
    assert alone.second_status == NOT_RUN
    assert alone.halved is not None


def test_a_study_says_what_it_would_take(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, ("rates = [500.0]", "rates = [250.0, 500.0]\nspeeds = [0.5, 1.0]"))
    before = sorted(tmp_path.rglob("*"))
    done = Workbench(tmp_path, monkeypatch, capsys)("run", path, "--dry-run", "--jobs", "3")
    assert done.code == 0
    assert "loop: 8 runs, of 1 case, 2 controllers with their models, 2 speeds, 2 rates, 1 bandwidth" in done.out
    assert "with 3 workers" in done.out
    assert "2 tried, at 250, 500 Hz: 0 unstable, 0 not computed" in done.out
    assert sorted(tmp_path.rglob("*")) == before
