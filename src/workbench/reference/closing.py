"""Loops closed in machine code: Newton on the passive joints, straight lines followed step by step, motions in order.

The arithmetic of `workbench.reference.continuation` and `workbench.reference.closure` for one sample at a time, on
positions by `workbench.reference.kinematics`. The rules that keep a sample on its branch are those of the former, word
for word; what is reached is a proposal that MuJoCo's own evaluation has to confirm.
"""

from __future__ import annotations

import math

import numpy as np

from workbench.compiled import borrowing, merged
from workbench.reference.kernels import follow_tangent, integrate, keep_if_better
from workbench.reference.kinds import SPIN
from workbench.reference.kinematics import place
from workbench.reference.linear import factor, solve, solve_beside, solve_eliminated
from workbench.reference.rows import jacobian_rows, residuals
from workbench.reference.sides import POOR, UNKNOWN, eliminate_chosen, same_side

NEAR, LINES, CHAIN = 0, 1, 2
"""Ways to close samples, see `advance`."""

BESIDE = 1e-2
"""rad or m: so far from where the loops' Jacobian was factored last its factor is good for a step: positions alone are
evaluated then."""

DRAWN = 1e-2
"""Part of the residual that such a step may leave; where it leaves more, the Jacobian is factored anew."""

ROUNDED = 1e-12
"""rad or m: a step this short from a closed configuration of a motion leaves rounding, and is not looked at again."""


@merged
def _eliminated(mechanism, w):  # type: ignore[no-untyped-def]
    """Solve the chosen rows of the closures for the actuated columns and the residual; returns the side.

    `Bench.sound` says whether they are a good measure of all rows, far from singular poses; else nothing was solved.
    """
    table, actuated, a = mechanism.sides, mechanism.actuated, w.work.a
    p, na = table.rows.shape[0], actuated.shape[0]
    for i in range(p):
        r = table.rows[i]
        for j in range(p):
            a[i, j] = w.jacobian[r, table.columns[j]]
        for j in range(na):
            a[i, p + j] = -w.jacobian[r, actuated[j]]
        a[i, p + na] = -w.residual[r]
    side, poorest = eliminate_chosen(table, w.work, p + na + 1)
    w.sound[0] = p > 0 and poorest >= POOR
    if w.sound[0]:
        solve_beside(a, p, p)
    return side


@merged
def _factored(passive, actuated, jacobian, residual, a, beta, order, lengths):  # type: ignore[no-untyped-def]
    """Factor the passive columns of the Jacobian, solve for the actuated ones and the residual; returns the rank."""
    p, na = passive.shape[0], actuated.shape[0]
    for i in range(jacobian.shape[0]):
        for j in range(p):
            a[i, j] = jacobian[i, passive[j]]
        for j in range(na):
            a[i, p + j] = -jacobian[i, actuated[j]]
        a[i, p + na] = -residual[i]
    rank = factor(a, beta, order, lengths)
    solve_beside(a, p, rank)
    return rank


@merged
def _placed(mechanism, w, qpos):  # type: ignore[no-untyped-def]
    """Evaluate the positions of one configuration, and how far its loops are open: `Bench.residual`."""
    place(mechanism.kinematics, qpos, w.places)
    residuals(mechanism.closures, mechanism.joints, qpos, w.seen.site_xpos, w.seen.site_xquat, w.residual)


@merged
def _rows(mechanism, w, qpos, jacobian):  # type: ignore[no-untyped-def]
    """Fill *jacobian* ``(m, nv)`` of the configuration that was placed last."""
    seen = w.seen
    jacobian_rows(
        mechanism.closures, mechanism.joints, qpos, seen.cdof, mechanism.kinematics.centre, seen.site_xpos,
        seen.anchors, jacobian,
    )  # fmt: skip


@borrowing
def close_one(mechanism, rules, w):  # type: ignore[no-untyped-def]
    """Newton on the passive joints from `Bench.qpos`, which is overwritten.

    The best configuration met goes to `Bench.kept`, its residual to `Bench.facts`; where it is closed, also tangent,
    rank and side. Near the pose of the last factor, as `Bench.away` says, steps are taken with it as long as they
    converge; facts and tangent are always those of the closed pose itself.
    """
    passive, actuated, columns = mechanism.passive, mechanism.actuated, mechanism.sides.columns
    qpos, step = w.qpos, w.step
    p, na = passive.shape[0], actuated.shape[0]
    limits = (rules.closed, rules.floor, rules.astray, rules.settles)
    beside = w.away[0] <= BESIDE and w.facts[1] == p and w.sound[0]
    w.least[0] = math.inf
    w.sides[0] = UNKNOWN
    for d in range(step.shape[0]):
        step[d] = w.corrected[0, d] = 0.0
    chord, last = beside, math.inf
    for _ in range(rules.steps):
        _placed(mechanism, w, qpos)
        again, good = keep_if_better(w.residual, limits, qpos, w.kept, w.least, 0)
        if not (again or good):
            break
        chord = chord and not good and w.least[0] <= DRAWN * last
        last = w.least[0]
        if chord:
            for k in range(p):
                w.x[k] = -w.residual[mechanism.sides.rows[k]]
            solve_eliminated(w.work, w.x)
            for k in range(p):
                step[columns[k]] = w.x[k]
        else:
            _rows(mechanism, w, qpos, w.jacobian)
            side = _eliminated(mechanism, w)
            # loops that agree only to some digits are closed in least squares of all rows
            w.sound[0] = w.sound[0] and not rules.settles
            found = p
            if w.sound[0]:
                for k in range(p):
                    d = columns[k]
                    step[d] = w.work.a[k, p + na]
                    if good:
                        for j in range(na):
                            w.tangent[d, j] = w.work.a[k, p + j]
            else:
                found = _factored(passive, actuated, w.jacobian, w.residual, w.a, w.beta, w.order, w.lengths)
                for k in range(p):
                    d = passive[w.order[k]]
                    step[d] = w.a[k, p + na]
                    if good:
                        for j in range(na):
                            w.tangent[d, j] = w.a[k, p + j]
            if good:
                for k in range(na):
                    for j in range(na):
                        w.tangent[actuated[k], j] = 1.0 if k == j else 0.0
                w.facts[1] = found
                if w.sides[0] == UNKNOWN or rules.settles:  # the step to rounding does not change it
                    w.sides[0] = side if found == p else UNKNOWN
            if not again:
                break
        longest = 0.0
        for d in passive:
            w.corrected[0, d] += step[d]
            longest = max(longest, abs(step[d]))
        integrate(qpos, step, mechanism.joints, qpos)
        if good and beside and longest <= ROUNDED:
            _copy(qpos, w.kept)
            break
    w.facts[0] = w.least[0]
    if not w.least[0] <= rules.closed:
        w.facts[1] = 0.0
    w.away[0] = math.inf


@borrowing
def solve_again(mechanism, w, rhs, x):  # type: ignore[no-untyped-def]
    """Solve the rows of the last factor for ``rhs (m,)``, which is overwritten: passive velocities into ``x (nv,)``."""
    table, passive = mechanism.sides, mechanism.passive
    p = passive.shape[0]
    if w.sound[0]:
        for k in range(p):
            w.x[k] = rhs[table.rows[k]]
        solve_eliminated(w.work, w.x)
        for k in range(p):
            x[table.columns[k]] = w.x[k]
    else:
        solve(w.a, w.beta, w.order, np.int64(w.facts[1]), rhs, w.x)
        for j in range(p):
            x[passive[j]] = w.x[j]


@merged
def _length(values, weights):  # type: ignore[no-untyped-def]
    squared = 0.0
    for d in range(values.shape[0]):
        squared += (values[d] * weights[d]) ** 2
    return math.sqrt(squared)


@merged
def _copy(values, out):  # type: ignore[no-untyped-def]
    """Loops: assigning a slice takes numba seconds to compile."""
    for i in range(out.shape[0]):
        out[i] = values[i]


@merged
def _copy_rows(values, out):  # type: ignore[no-untyped-def]
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = values[i, j]


@merged
def _on_side(mechanism, w):  # type: ignore[no-untyped-def]
    """Whether the step from ``Bench.here`` to ``Bench.kept`` passes no singular pose, as `Continuation._on_side`."""
    before, after, table = w.sides[1], w.sides[0], mechanism.sides
    redundant = False
    for block in range(table.least.shape[0]):
        redundant |= table.least[block] > 0.0
    if not redundant:
        if after == UNKNOWN:
            w.sides[0] = before
        return before == UNKNOWN or before == w.sides[0]
    if (before == after and after != UNKNOWN) or w.facts[1] < table.columns.shape[0]:
        return True
    for second in range(2):
        qpos, rows = (w.kept, w.after[0]) if second else (w.here, w.before[0])
        _placed(mechanism, w, qpos)
        _rows(mechanism, w, qpos, rows)
    same_side(w.before, w.after, table, w.products, w.same)
    return w.same[0]


@merged
def _follow_line(mechanism, rules, w, target, chain, factored):  # type: ignore[no-untyped-def]
    """Follow the straight line from ``Bench.ways[3]`` to *target* ``(na,)``; returns how much of it was gone, 0 to 1.

    ``Bench.here`` and its like are the closed configuration at the beginning, and then the last one reached;
    *factored* says whether the last factor was taken there. It serves along a *chain* only: of a lone sample the
    tangent is wanted to rounding.
    """
    way, aim, change, origin = w.ways[0], w.ways[1], w.ways[2], w.ways[3]
    na = way.shape[0]
    for j in range(na):
        way[j] = target[j] - origin[j]
    done, step = 0.0, 1.0
    w.closings[0] = 0.0
    while done < 1.0:
        follow_tangent(w.tangent_here, way, w.step)
        longest = rules.almost * rules.longest / _length(w.step, mechanism.weights)
        part = min(step, 1.0 - done, longest)
        last = done + part >= 1.0
        for j in range(na):
            aim[j] = target[j] if last else origin[j] + way[j] * (done + part)
            change[j] = way[j] * part
        follow_tangent(w.tangent_here, change, w.step)
        moved = _length(w.step, mechanism.weights)
        integrate(w.here, w.step, mechanism.joints, w.predicted)
        if part == 1.0:
            for d in range(w.step.shape[0]):
                w.step[d] += w.bend[d]
        integrate(w.here, w.step, mechanism.joints, w.qpos)
        for j in range(na):
            w.qpos[mechanism.actuated_qpos[j]] = w.predicted[mechanism.actuated_qpos[j]] = aim[j]
        w.away[0] = moved if factored else math.inf
        w.closings[0] += 1.0
        close_one(mechanism, rules, w)
        squared = 0.0
        for i in range(w.here.shape[0]):
            squared += ((w.kept[i] - w.predicted[i]) * mechanism.coordinate_weights[i]) ** 2
        correction = math.sqrt(squared)
        small = correction <= max(rules.correction * moved, rules.negligible)
        if w.facts[0] <= rules.closed and small and moved <= rules.longest and _on_side(mechanism, w):
            _copy(w.kept, w.here)
            w.sides[1] = w.sides[0]
            _copy_rows(w.tangent, w.tangent_here)
            _copy(w.facts, w.facts_here)
            done = 1.0 if last else done + part
            step *= 2.0
            factored = chain
            if longest < rules.smallest and done < 1.0:
                return done
        else:
            factored = False
            step = 0.5 * part
            if not step >= rules.smallest:
                return done
    return done


@merged
def _bend(mechanism, w, target, s, size, known):  # type: ignore[no-untyped-def]
    """Fill `Bench.bend` for the step to sample *s*, after one of length *size* or, for NaN, none; returns its length.

    The change of the tangent is carried on, and by how much that missed the last *known* samples, at most three.
    """
    na, missed = target.shape[1], w.corrected
    longer = 0.0
    for j in range(na):
        longer += (target[s, j] - target[s - 1, j]) ** 2
    longer = math.sqrt(longer)
    scale = 0.5 * longer / size if size > 0.0 else 0.0
    for d in range(w.bend.shape[0]):
        value = 0.0
        for j in range(na):
            value += (w.tangent_here[d, j] - w.tangent_before[d, j]) * (target[s, j] - target[s - 1, j])
        carried = 0.0
        if known == 1:
            carried = missed[1, d]
        elif known == 2:
            carried = 2.0 * missed[1, d] - missed[2, d]
        elif known == 3:
            carried = 3.0 * (missed[1, d] - missed[2, d]) + missed[3, d]
        missed[4, d] = carried
        w.bend[d] = scale * value
    if known:
        _without_spin(mechanism, w.jacobian, missed[4])
    for d in range(w.bend.shape[0]):
        w.bend[d] += missed[4, d]
    return longer


@merged
def _without_spin(mechanism, jacobian, carried):  # type: ignore[no-untyped-def]
    """Take out of *carried* ``(nv,)`` what turns rods about their own axes, by the *jacobian* of the last sample.

    Loops do not hold a rod's turn; nothing would take back what was foretold of it, and it would grow.
    """
    blocks, block_rows, passive = mechanism.closures.blocks, mechanism.closures.block_rows, mechanism.passive
    for k in range(blocks.shape[0]):
        if blocks[k, 0] == SPIN:
            row = block_rows[k]
            along, square = 0.0, 0.0
            for d in passive:
                along += jacobian[row, d] * carried[d]
                square += jacobian[row, d] ** 2
            for d in passive:
                carried[d] -= along / square * jacobian[row, d] if square > 0.0 else 0.0


@merged
def _miss(mechanism, w, known):  # type: ignore[no-untyped-def]
    """Note by what the sample was off what was foretold, where one step led to it; returns how many are known.

    None where loops leave a joint free: nothing would take back what was foretold of it.
    """
    if w.closings[0] > 1.0 or w.facts_here[1] < mechanism.passive.shape[0]:
        return 0
    for d in range(w.bend.shape[0]):
        w.corrected[3, d], w.corrected[2, d] = w.corrected[2, d], w.corrected[1, d]
        w.corrected[1, d] = w.corrected[4, d] + w.corrected[0, d]
    return min(known + 1, 3)


@borrowing
def advance(  # type: ignore[no-untyped-def]
    mechanism, rules, w, how, start, target, first, last, qpos, residual, tangent, rank, side, done
):  # fmt: skip
    """Close samples *first* to *last* - 1 in one of three ways; a single kernel, which compiles once.

    `NEAR`: Newton alone, from each of ``start (n, nq)``. `LINES`: along straight lines from ``start (n, na)`` to
    ``target (n, na)``; the arrays hold the configurations at the start, then those reached, and ``done (n,)`` becomes
    the part of each way that was gone. `CHAIN`: a motion ``target (n, na)``, each sample from the one before, the first
    from the arrays' row before it; Newton begins where the change of the tangent over the step before, carried on,
    leads, with what that missed before, and what is accepted is judged from the tangent alone, as everywhere.

    Returns the first sample of a chain that was not reached, else *last*.
    """
    size, known = math.nan, 0
    for d in range(w.bend.shape[0]):
        w.bend[d] = 0.0
    for s in range(first, last):
        if how == NEAR:
            _copy(start[s], w.qpos)
            w.away[0] = math.inf
            close_one(mechanism, rules, w)
            _copy(w.kept, w.here)
            _copy(w.facts, w.facts_here)
            w.sides[1] = w.sides[0]
            for i in range(w.tangent.shape[0]):
                for j in range(w.tangent.shape[1]):
                    w.tangent_here[i, j] = w.tangent[i, j] if w.facts[0] <= rules.closed else 0.0
        else:
            if how == LINES or s == first:
                r = s if how == LINES else s - 1
                _copy(qpos[r], w.here)
                _copy_rows(tangent[r], w.tangent_here)
                w.facts_here[0], w.facts_here[1] = residual[r], rank[r]
                w.sides[1] = side[r]
            if how == LINES:
                _copy(start[s], w.ways[3])
            else:
                _copy(target[s - 1], w.ways[3])
                size = _bend(mechanism, w, target, s, size, known)
                _copy_rows(w.tangent_here, w.tangent_before)
            gone = _follow_line(mechanism, rules, w, target[s], how == CHAIN, how == CHAIN and s > first)
            if how == LINES:
                done[s] = gone
            elif gone < 1.0:
                return s
            else:
                known = _miss(mechanism, w, known)
        _copy(w.here, qpos[s])
        _copy_rows(w.tangent_here, tangent[s])
        residual[s], rank[s] = w.facts_here[0], np.int64(w.facts_here[1])
        side[s] = w.sides[1]
    return last
