"""What the kernels that close loops take: a model's tables, the rules of the way, and room for one sample."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from workbench.arrays import FloatArray
from workbench.reference.kinematics import Kinematics, Places, room
from workbench.reference.linear import Elimination, Lengths, room_to_eliminate, room_to_factor
from workbench.reference.sides import NO_SIDES, SideTable
from workbench.reference.tables import ClosureTables


class Mechanism(NamedTuple):
    """All that is known of a model's loops."""

    kinematics: Kinematics
    closures: ClosureTables
    joints: tuple[np.ndarray, np.ndarray, np.ndarray]
    passive: np.ndarray
    actuated: np.ndarray
    actuated_qpos: np.ndarray
    weights: FloatArray
    """``(nv,)`` what a unit of each velocity counts"""
    coordinate_weights: FloatArray
    """``(nq,)``"""
    sides: SideTable = NO_SIDES
    """known once the home pose is closed"""


class Rules(NamedTuple):
    """Bounds of `workbench.reference.continuation` and `workbench.reference.tolerance`."""

    closed: float
    floor: float
    astray: float
    settles: bool
    """loops agree only to some digits: every Newton step counts and the last is kept"""
    steps: int
    """Newton steps at most"""
    correction: float
    longest: float
    almost: float
    negligible: float
    smallest: float
    """a smaller part of the way means that the way is blocked"""


class Bench(NamedTuple):
    """Room for the work on one sample."""

    places: Places
    seen: Places
    """views of the same that may not be written to, as MuJoCo's own: to kernels another type"""
    qpos: FloatArray
    kept: FloatArray
    predicted: FloatArray
    here: FloatArray
    """the closed configuration that a way begins at, and then the last one reached"""
    tangent: FloatArray
    tangent_here: FloatArray
    tangent_before: FloatArray
    facts: FloatArray
    """``(2,)`` residual, rank"""
    facts_here: FloatArray
    sides: np.ndarray
    """``(2,)`` of the last closing, and here: on which side of their singular poses"""
    jacobian: FloatArray
    before: FloatArray
    """``(1, m, nv)``, as `after` and ``same (1,)`` for `same_side`"""
    after: FloatArray
    same: np.ndarray
    work: Elimination
    """chosen rows (`workbench.reference.sides`): passive columns, actuated ones, the residual"""
    products: Elimination
    """for `same_side`, which must not write over the above"""
    sound: np.ndarray
    """``(1,)`` whether chosen rows were solved last, being a good measure of all"""
    residual: FloatArray
    a: FloatArray
    """``(m, .)`` all rows likewise, where they are solved in least squares"""
    beta: FloatArray
    order: np.ndarray
    lengths: Lengths
    x: FloatArray
    step: FloatArray
    bend: FloatArray
    """``(nv,)`` added to the first prediction before Newton begins: what the tangent's own change is worth"""
    least: FloatArray
    """``(1,)`` least residual met in the closing now under way"""
    away: FloatArray
    """``(1,)`` how far from where Newton begins the last factor was taken, see `BESIDE`; infinite: it is of no use"""
    closings: FloatArray
    """``(1,)`` closings of the sample now followed"""
    corrected: FloatArray
    """``(5, nv)`` by what Newton moved the sample that is closed; by what the last three were off what their tangents
    and the change of these foretold, the latest first; and what of that was carried on to the sample"""
    ways: FloatArray
    """``(4, na)`` the way, where a step leads, its change, and where the way begins"""


def bench(mechanism: Mechanism) -> Bench:
    """Room for one sample of a mechanism. Made by NumPy: compiled, making it takes longer than all that it is for."""
    m, p, na = int(mechanism.closures.block_rows[-1]), len(mechanism.passive), len(mechanism.actuated)
    nq, nv = len(mechanism.coordinate_weights), len(mechanism.weights)
    places = room(mechanism.kinematics, nv)
    seen = Places(*(array.view() for array in places))
    for array in seen:
        array.flags.writeable = False
    return Bench(
        places, seen, np.zeros(nq), np.zeros(nq), np.zeros(nq), np.zeros(nq), np.zeros((nv, na)),
        np.zeros((nv, na)), np.zeros((nv, na)), np.zeros(2), np.zeros(2), np.zeros(2, dtype=np.int64),
        np.zeros((m, nv)), np.zeros((1, m, nv)), np.zeros((1, m, nv)), np.zeros(1, dtype=np.bool_),
        room_to_eliminate(p, na + 1), room_to_eliminate(p), np.zeros(1, dtype=np.bool_), np.zeros(m),
        *room_to_factor(m, p, na + 1), np.zeros(p), np.zeros(nv), np.zeros(nv),
        np.zeros(1), np.full(1, math.inf), np.zeros(1), np.zeros((5, nv)), np.zeros((4, na)),
    )  # fmt: skip
