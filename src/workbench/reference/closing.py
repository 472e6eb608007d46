"""Loops closed in machine code: Newton on the passive joints, straight lines followed step by step, motions in order.

The arithmetic of `workbench.reference.continuation` and `workbench.reference.closure` for one sample at a time, on
positions by `workbench.reference.kinematics`. The rules that keep a sample on its branch are those of the former, word
for word; what is reached is a proposal that MuJoCo's own evaluation has to confirm.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import compiled, inlined
from workbench.reference.kernels import integrate, keep_if_better
from workbench.reference.kinematics import Kinematics, Places, place, room
from workbench.reference.linear import factor, solved
from workbench.reference.rows import constraint_rows
from workbench.reference.tables import ClosureTables

ARRIVED, BLOCKED = 1, 0


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
    qpos: FloatArray
    kept: FloatArray
    predicted: FloatArray
    tangent: FloatArray
    facts: FloatArray
    """``(4,)`` residual, rank, condition, weakest"""
    jacobian: FloatArray
    residual: FloatArray
    a: FloatArray
    beta: FloatArray
    order: np.ndarray
    x: FloatArray
    step: FloatArray
    best: FloatArray


@compiled
def bench(mechanism):  # type: ignore[no-untyped-def]
    """Room for one sample of a mechanism."""
    closures = mechanism.closures
    m, p, na = closures.block_rows[-1], mechanism.passive.shape[0], mechanism.actuated.shape[0]
    nq, nv = mechanism.coordinate_weights.shape[0], mechanism.weights.shape[0]
    points = mechanism.kinematics.points
    sites = points.max() + 1 if points.shape[0] else 1
    return Bench(
        room(mechanism.kinematics, sites, nv), np.zeros(nq), np.zeros(nq), np.zeros(nq), np.zeros((nv, na)),
        np.zeros(4), np.zeros((m, nv)), np.zeros(m), np.zeros((m, p + na + 1)), np.zeros(p),
        np.zeros(p, dtype=np.int64), np.zeros(p), np.zeros(nv), np.zeros(1),
    )  # fmt: skip


@inlined
def _factored(mechanism, w):  # type: ignore[no-untyped-def]
    """Factor the passive columns of the Jacobian, the actuated ones and the residual along; returns the rank."""
    passive, actuated = mechanism.passive, mechanism.actuated
    p, na = passive.shape[0], actuated.shape[0]
    for i in range(w.a.shape[0]):
        for j in range(p):
            w.a[i, j] = w.jacobian[i, passive[j]]
        for j in range(na):
            w.a[i, p + j] = -w.jacobian[i, actuated[j]]
        w.a[i, p + na] = -w.residual[i]
    return factor(w.a, w.beta, w.order)


@inlined
def _stepped(mechanism, found, w):  # type: ignore[no-untyped-def]
    """Take a Newton step of the passive joints from `Bench.qpos`, by the last factor."""
    passive = mechanism.passive
    solved(w.a, w.order, found, w.a.shape[1] - 1, w.x)
    for j in range(passive.shape[0]):
        w.step[passive[j]] = w.x[j]
    for j in range(mechanism.actuated.shape[0]):
        w.step[mechanism.actuated[j]] = 0.0
    integrate(w.qpos, w.step, mechanism.joints, w.qpos)


@inlined
def _noted(mechanism, found, w):  # type: ignore[no-untyped-def]
    """Velocities per actuated velocity, rank, condition and weakest freedom, from the last factor."""
    passive, actuated = mechanism.passive, mechanism.actuated
    p, na = passive.shape[0], actuated.shape[0]
    for j in range(na):
        solved(w.a, w.order, found, p + j, w.x)
        for k in range(p):
            w.tangent[passive[k], j] = w.x[k]
        for k in range(na):
            w.tangent[actuated[k], j] = 1.0 if k == j else 0.0
    w.facts[1] = found
    if p == 0:  # an open chain: nothing to solve for
        w.facts[2], w.facts[3] = 1.0, actuated[0]
    else:
        w.facts[2] = abs(w.a[0, 0] / w.a[p - 1, p - 1]) if found == p else math.inf
        w.facts[3] = passive[w.order[min(found, p - 1)]]


@compiled
def close_one(mechanism, rules, w):  # type: ignore[no-untyped-def]
    """Newton on the passive joints from `Bench.qpos`, which is overwritten.

    The best configuration met goes to `Bench.kept`, its residual to `Bench.facts`; where it is closed, also tangent,
    rank, condition and weakest freedom.
    """
    kin, closures, places = mechanism.kinematics, mechanism.closures, w.places
    limits = (rules.closed, rules.floor, rules.astray, rules.settles)
    w.best[0] = math.inf
    w.facts[1], w.facts[2], w.facts[3] = 0.0, math.inf, 0.0
    for _ in range(rules.steps):
        place(kin, w.qpos, places)
        constraint_rows(
            closures, mechanism.joints, w.qpos, places.cdof, kin.centre, places.site_xpos, places.site_xquat,
            places.anchors, w.jacobian, w.residual,
        )  # fmt: skip
        again, good = keep_if_better(w.residual, limits, w.qpos, w.kept, w.best, 0)
        if not (again or good):
            break
        found = _factored(mechanism, w)
        if good:
            _noted(mechanism, found, w)
        if not again:
            break
        _stepped(mechanism, found, w)
    w.facts[0] = w.best[0]


@inlined
def _along(tangent, rates, out):  # type: ignore[no-untyped-def]
    for d in range(tangent.shape[0]):
        value = 0.0
        for j in range(tangent.shape[1]):
            value += tangent[d, j] * rates[j]
        out[d] = value


@inlined
def _length(values, weights):  # type: ignore[no-untyped-def]
    squared = 0.0
    for d in range(values.shape[0]):
        squared += (values[d] * weights[d]) ** 2
    return math.sqrt(squared)


@compiled
def follow_line(mechanism, rules, w, qpos, tangent, facts, origin, target, bend):  # type: ignore[no-untyped-def]
    """Follow the straight line from *origin* to *target* ``(na,)``; returns whether it arrived, and how far it came.

    ``qpos``, ``tangent`` and ``facts`` are the closed configuration at *origin*, and then the last one reached.
    ``bend (nv,)`` is added to the first prediction before Newton begins, and to nothing else: what the tangent's own
    change is worth over the whole way.
    """
    na = target.shape[0]
    way, aim, change = np.empty(na), np.empty(na), np.empty(na)
    for j in range(na):
        way[j] = target[j] - origin[j]
    done, step = 0.0, 1.0
    while done < 1.0:
        _along(tangent, way, w.step)
        longest = rules.almost * rules.longest / _length(w.step, mechanism.weights)
        part = min(step, 1.0 - done, longest)
        last = done + part >= 1.0
        for j in range(na):
            aim[j] = target[j] if last else origin[j] + way[j] * (done + part)
            change[j] = way[j] * part
        _along(tangent, change, w.step)
        moved = _length(w.step, mechanism.weights)
        integrate(qpos, w.step, mechanism.joints, w.predicted)
        if part == 1.0:
            for d in range(w.step.shape[0]):
                w.step[d] += bend[d]
            integrate(qpos, w.step, mechanism.joints, w.qpos)
        else:
            w.qpos[:] = w.predicted
        for j in range(na):
            w.qpos[mechanism.actuated_qpos[j]] = w.predicted[mechanism.actuated_qpos[j]] = aim[j]
        close_one(mechanism, rules, w)
        squared = 0.0
        for i in range(qpos.shape[0]):
            squared += ((w.kept[i] - w.predicted[i]) * mechanism.coordinate_weights[i]) ** 2
        correction = math.sqrt(squared)
        small = correction <= max(rules.correction * moved, rules.negligible)
        if w.facts[0] <= rules.closed and small and moved <= rules.longest:
            qpos[:] = w.kept
            tangent[:, :] = w.tangent
            facts[:] = w.facts
            done = 1.0 if last else done + part
            step *= 2.0
            if longest < rules.smallest and done < 1.0:
                return False, done
        else:
            step = 0.5 * part
            if not step >= rules.smallest:
                return False, done
    return True, done


@compiled
def close_many(mechanism, rules, start, qpos, residual, tangent, rank, condition, weakest):  # type: ignore[no-untyped-def]
    """`close_one` from each of ``start (n, nq)``."""
    w = bench(mechanism)
    for s in range(start.shape[0]):
        w.qpos[:] = start[s]
        close_one(mechanism, rules, w)
        _stored(w.kept, w.tangent, w.facts, qpos, residual, tangent, rank, condition, weakest, s)
        if not w.facts[0] <= rules.closed:
            tangent[s] = 0.0


@inlined
def _stored(here, tangents, facts, qpos, residual, tangent, rank, condition, weakest, s):  # type: ignore[no-untyped-def]
    qpos[s] = here
    tangent[s] = tangents
    residual[s], rank[s], condition[s], weakest[s] = facts[0], np.int64(facts[1]), facts[2], np.int64(facts[3])


@compiled
def follow_lines(  # type: ignore[no-untyped-def]
    mechanism, rules, origin, target, qpos, residual, tangent, rank, condition, weakest, done
):  # fmt: skip
    """Follow straight lines from closed configurations ``(n, nq)`` at *origin* to *target* ``(n, na)``.

    The arrays hold the configurations at *origin* and then those reached; ``done (n,)`` becomes the part of each way
    that was gone. A way may be blocked, then the rest is not looked at if it must not be: see `Rules.smallest`.
    """
    w = bench(mechanism)
    here, tangents, facts, bend = w.qpos.copy(), w.tangent.copy(), w.facts.copy(), np.zeros(w.step.shape[0])
    for s in range(origin.shape[0]):
        here[:] = qpos[s]
        tangents[:, :] = tangent[s]
        facts[0], facts[1], facts[2], facts[3] = residual[s], rank[s], condition[s], weakest[s]
        _arrived, done[s] = follow_line(mechanism, rules, w, here, tangents, facts, origin[s], target[s], bend)
        _stored(here, tangents, facts, qpos, residual, tangent, rank, condition, weakest, s)


@compiled
def follow_chain(  # type: ignore[no-untyped-def]
    mechanism, rules, target, first, last, qpos, residual, tangent, rank, condition, weakest
):  # fmt: skip
    """Follow a motion: samples first + 1 to last - 1 of ``target (n, na)``, each from its predecessor.

    Returns the first sample that was not reached, or *last*. Newton begins where the change of the tangent over the
    step before, carried on, leads; what is accepted is judged from the tangent alone, as everywhere.
    """
    w = bench(mechanism)
    nv, na = w.tangent.shape
    here, tangents, facts, bend = qpos[first].copy(), tangent[first].copy(), w.facts.copy(), np.zeros(nv)
    before, way = tangents.copy(), np.zeros(na)
    straight = False
    size = 0.0
    for s in range(first + 1, last):
        longer = 0.0
        for j in range(na):
            way[j] = target[s, j] - target[s - 1, j]
            longer += way[j] ** 2
        longer = math.sqrt(longer)
        scale = 0.5 * longer / size if straight and size > 0.0 else 0.0
        for d in range(nv):
            value = 0.0
            for j in range(na):
                value += (tangents[d, j] - before[d, j]) * way[j]
            bend[d] = scale * value
        before[:, :] = tangents
        arrived, _done = follow_line(mechanism, rules, w, here, tangents, facts, target[s - 1], target[s], bend)
        if not arrived:
            return s
        size, straight = longer, True
        _stored(here, tangents, facts, qpos, residual, tangent, rank, condition, weakest, s)
    return last
