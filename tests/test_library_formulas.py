"""Formulas of the library at random: random robots, motions and forces; each parameter and term of a formula spoiled.

Campaigns see the papers' numbers or chosen ones; here every robot gets others. The spoiled twins are made by machine,
so that no robot is without them: each parameter scaled, and small edits of a formula's source that diagnosis knows.
"""

from __future__ import annotations

import re
import runpy
import sys
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import FrameType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

import workbench as wb
from workbench.diagnosis.edits import Edit, edits_of
from workbench.errors import ParameterError
from workbench.library.shelf import entry, robot_names
from workbench.robots.registration import MARK

NAMES = robot_names()
BOUND = 1e-10
SAMPLES = 12
STARTS = "where the search for the platform begins"
"""Meaning of parameters that a result does not depend on."""

SHARE = 0.03
"""How far parameters are changed."""


def exact_of(space: dict[str, Any]) -> Callable[..., np.ndarray]:
    """The formula of a file that has a bound."""
    (found,) = [
        f for f in space.values() if getattr(getattr(f, MARK, None), "bound", None) and f.__code__.co_argcount > 3
    ]
    return found


@cache
def formula(name: str) -> Callable[..., np.ndarray]:
    return exact_of(runpy.run_path(str(entry(name).formulas[0])))


def torque(function: Callable[..., np.ndarray], values: Any, motion: tuple[np.ndarray, ...], force: np.ndarray) -> Any:
    """The formula's torques, with or without an external force."""
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        more = (force,) if function.__code__.co_argcount == 5 else ()
        return function(SimpleNamespace(**values), *motion, *more)


def with_changes(folder: Path, changes: dict[str, float]) -> wb.Robot:
    """The robot with the changes that can be made: MuJoCo computes some numbers, and no body has just any inertia."""
    left = dict(changes)
    while True:
        try:
            robot = wb.load_robot(folder, **left)
        except ParameterError as error:
            (name,) = re.findall(r"parameter (\w+)", str(error))[:1]
            del left[name]
            continue
        assert len(left) >= min(4, len(changes)), sorted(changes.keys() - left)
        return robot


@cache
def trial(name: str, seed: int) -> tuple[dict[str, float], tuple[np.ndarray, ...], np.ndarray, np.ndarray]:
    """A random robot of one kind, a random motion near home, a force, and MuJoCo's torques."""
    found, rng = entry(name), np.random.default_rng(seed)
    plain = wb.load_robot(found.folder)
    changes = {key: value * rng.uniform(1 - SHARE, 1 + SHARE) for key, value in plain.values.items() if value}
    robot = with_changes(found.folder, changes)
    number = len(robot.joints)
    span = np.array([0.02 * (high - low) if high - low < 3 else 0.06 for low, high in robot.joint_limits])
    q = robot.home + span * rng.uniform(-1, 1, (SAMPLES, number))
    scale = span / span.max()
    motion = q, 3 * scale * rng.normal(size=(SAMPLES, number)), 20 * scale * rng.normal(size=(SAMPLES, number))
    forced = formula(name).__code__.co_argcount == 5
    force = forced * robot.values.get("mp", 1.0) * rng.normal(size=(SAMPLES, 3))
    tau = robot.inverse_dynamics(*motion, external_force=force if forced else None)
    return dict(robot.values), motion, force, tau


def error(name: str, seed: int, values: dict[str, float], function: Callable[..., np.ndarray]) -> float:
    """Largest error of a joint over its peak; infinite where the formula gives no numbers."""
    _, motion, force, tau = trial(name, seed)
    try:
        off = np.abs(torque(function, values, motion, force) - tau).max(axis=0) / np.abs(tau).max(axis=0)
    except (ValueError, TypeError, ArithmeticError, AttributeError, IndexError, np.linalg.LinAlgError, NameError):
        return np.inf
    return float(off.max()) if np.isfinite(off).all() else np.inf


@pytest.mark.parametrize("name", NAMES)
def test_a_random_robot_of_each_kind_is_round_off_away_from_mujoco(name: str) -> None:
    for seed in (1, 2):
        assert error(name, seed, trial(name, seed)[0], formula(name)) < BOUND


@pytest.mark.parametrize("name", NAMES)
def test_each_parameter_of_a_formula_is_seen(name: str) -> None:
    spec = entry(name).robot.spec.parameters
    values = trial(name, 1)[0]
    read = [key for key, value in values.items() if value and not spec[key].meaning.endswith(STARTS)]
    assert len(read) > 2
    for key in read:
        spoiled = values | {key: values[key] * 1.001}
        assert error(name, 1, spoiled, formula(name)) > BOUND, key


def lines_of(name: str) -> set[int]:
    """Lines of the file that the exact form runs through, found by running it."""
    code, found = str(entry(name).formulas[0]), set()
    function = exact_of(runpy.run_path(code))
    values, motion, force, _ = trial(name, 1)

    def look(frame: FrameType, event: str, argument: object) -> Any:
        if frame.f_code.co_filename != code:
            return None
        found.add(frame.f_lineno)
        return look

    before = sys.gettrace()
    sys.settrace(look)
    try:
        torque(function, values, motion, force)
    finally:
        sys.settrace(before)
    return found


def unseen_lines(name: str) -> list[str]:
    """Lines of the exact form of which every small edit that diagnosis knows leaves the torques within the bound."""
    text, values = entry(name).formulas[0].read_text(encoding="utf-8"), trial(name, 1)[0]
    edits: dict[int, list[Edit]] = {}
    for edit in edits_of(text, lines_of(name), {}):
        edits.setdefault(edit.line, []).append(edit)
    lines = [
        text.splitlines()[line - 1].strip() for line, tried in edits.items() if not seen(name, text, values, tried)
    ]
    return sorted(lines)


def seen(name: str, text: str, values: dict[str, float], edits: list[Edit]) -> bool:
    for edit in edits:
        space: dict[str, Any] = {"__name__": "mutant"}
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                exec(compile(edit.apply(text), "mutant.py", "exec"), space)
            function = exact_of(space)
        except Exception:
            continue  # no formula any more: nothing that a bound had to find
        if BOUND < error(name, 1, values, function) < np.inf:
            return True
    return False


IDLE = {
    "zero = np.zeros((len(q), 3))", "turn, spin, swing, rate, add, tau = zero, zero, zero, zero, zero, 0.0",
    "for part in (0, 1):  # to the mass centre, then to the far end", "for j in (0, 1):", "tau = np.empty_like(q)",
    "at, rate, add = foot", "near, far, cross = masses", "near, far, both = masses", "LEGS = range(1, 7)", ")[:, 0]",
    "x = np.zeros(elbow.shape)", "x = np.zeros((len(elbow), 3))", "x = np.zeros_like(q)",
    "x[:, 0], x[:, 1] = p.hx, p.hz", "NEXT = np.roll(np.arange(3), -1)",
    # with one freedom a body's rate is along its unit turn, and the gyroscopic moment does no work on it
    "momentum = p.I * spin + (p.J - p.I) * (spin * along).sum(axis=1, keepdims=True) * along",
}  # fmt: skip
"""Lines that hold no physics: shapes, names, and where Newton's method begins."""


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_each_line_of_a_formula_is_seen(name: str) -> None:
    assert set(unseen_lines(name)) <= IDLE
