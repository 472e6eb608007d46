"""Samples of a motion, closed along it: each from its predecessor, in the order of time.

A straight line from the home pose to a sample need not pass where the motion passes: around a cusp of the singular
curve both ends are the same and the assemblies are not. So the samples of a motion are closed in order. In effect; for
speed chunks of a motion are followed side by side, each from a sample that a straight line from home reaches, and where
two chunks meet it is looked at whether the one leads to the other; where it does not, the second is followed again.
Nothing of this depends on threads.

Where the package's own kinematics do not cover a model, all samples are first closed as scattered samples are, in
blocks, and the links between neighbours are looked at: where the tangent at one sample leads to the next by the measure
that accepts every step of a continuation, the two are what following the motion would give. Only where a link is
missing the motion is followed sample by sample, until it meets what stands already.
"""

from __future__ import annotations

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import MotionError
from workbench.reference.bench import Mechanism, bench
from workbench.reference.closing import CHAIN, advance
from workbench.reference.continuation import CORRECTION, LONGEST_STEP, NEGLIGIBLE, SMALLEST_STEP, Assembly, Continuation
from workbench.reference.engine import Evaluator
from workbench.reference.kinds import SCALAR
from workbench.reference.structure import Structure

CHUNK = 1280
"""Samples of a motion that are followed one after the other; chunks are shared by threads."""

SAME = 1e-6
"""rad or m: configurations nearer than this are one; at a condition of 1e6 closures differ by 1e-7, and assemblies by
more wherever the mechanism is not singular."""

BEYOND = 2.0
"""A joint's change from one sample to the next may be so many times what its rates and accelerations at both account
for. A jump to another assembly is a hundred times that; a grid that resolves its motion stays below one."""

STILL = 1e-6
"""rad or m: smaller changes are no jumps, whatever the rates say."""


class OrderedClosure(Continuation):
    """Adds to a continuation from home the closure along a motion, and from given configurations."""

    mechanism: Mechanism | None = None
    """tables of the package's own kinematics; None: MuJoCo evaluates every step"""
    _kept: tuple[FloatArray, Assembly] | None = None
    """what was scattered last: a motion's samples are asked for in order and one by one"""

    def close(self, q: FloatArray) -> Assembly:
        """Close the loops for actuated coordinates ``(n, na)``, SI, any order of samples; not to be written into.

        Raises
        ------
        MotionError
            Naming the first sample that cannot be reached on the home branch, its coordinates and the open loop.
        """
        kept = self._kept  # another thread may put its own there in between
        if kept is None or not np.array_equal(kept[0], q):
            kept = self._kept = None  # not two of them in memory at a time
            kept = self._kept = (q.copy(), self.follow(q))
        return kept[1]

    def close_along(self, q: FloatArray) -> Assembly:
        """Close actuated coordinates ``(n, na)`` that are a motion, in order; the first is reached from home.

        Raises
        ------
        MotionError
            Naming the first sample that cannot be reached from its predecessor (the first of all: from home).
        """
        if self.mechanism is not None:
            return self._followed(self.mechanism, q)
        try:
            found = self.close(q)
        except MotionError:
            # out of the reach of straight lines from home, but perhaps not of the motion
            found = self._nothing(len(q), q.shape[1])
            found.put(np.array([0]), self.follow(q[:1]))
            missing = np.arange(len(q) - 1)
        else:
            missing = np.flatnonzero(~self._linked(found, q))
            if not len(missing):
                return found
            found = found.at(np.arange(len(q)))
        step, here = self._nothing(len(q), q.shape[1]), -1
        for link in missing:
            here = max(here, int(link))
            # from here on follow the motion until it meets what stands already
            while here + 1 < len(q):
                one = np.array([here + 1])
                self._reach(q, one, found, q[here][None, :], np.array([here]), step)
                met = np.isfinite(found.residual[one]) & (self._apart(step.qpos[one], found.qpos[one]) <= SAME)
                if met[0]:
                    break
                found.put(one, step, one)
                here += 1
        return found

    def _followed(self, mechanism: Mechanism, q: FloatArray) -> Assembly:
        """Follow the motion in machine code, in chunks that begin at samples reached from home.

        Where such a sample is not what the chunk before leads to, its chunk is followed again from there.
        """
        n, rules = len(q), self.rules()
        q = np.array(q, order="C")  # in one order, for which the kernels are compiled
        found, firsts = self._nothing(n, q.shape[1]), np.arange(0, n, CHUNK)
        home, row = np.tile(self.start, (len(firsts), 1)), np.zeros(len(firsts), dtype=np.int64)
        self._reach(q, firsts[:1], self._home, home[:1], row[:1], found)
        known = np.ones(len(firsts), dtype=np.bool_)
        known[1:] = self._reach(q, firsts[1:], self._home, home[1:], row[1:], found, SMALLEST_STEP)
        ends, unused = np.zeros(len(firsts), dtype=np.int64), np.zeros(0)

        def chunk(_: Evaluator | None, rows: slice) -> None:
            if known[rows.start // CHUNK]:
                ends[rows.start // CHUNK] = advance(
                    mechanism, rules, bench(mechanism), CHAIN, q, q, rows.start + 1, rows.stop, *found.closed, unused
                )

        self.engine.in_blocks(chunk, n, CHUNK)
        step = self._nothing(n if len(firsts) > 1 else 0, q.shape[1])
        for place, first in enumerate(firsts.tolist()):
            if place:
                one, before = np.array([first]), np.array([first - 1])
                self._reach(q, one, found, q[before], before, step)
                if not (known[place] and self._apart(step.qpos[one], found.qpos[one])[0] <= SAME):
                    found.put(one, step.at(one))
                    known[place] = True
                    chunk(None, slice(first, min(first + CHUNK, n)))
            blocked = int(ends[place])
            if blocked < min(first + CHUNK, n):
                one, before = np.array([blocked]), np.array([blocked - 1])
                self._reach(q, one, found, q[before], before, found)  # raises, and says where the way ends
        return found

    def close_near(self, q: FloatArray, qpos: FloatArray, count: int = 1) -> Assembly:
        """Close actuated coordinates ``(n count, na)``, *count* from each of the closed configurations ``(n, nq)``.

        Raises
        ------
        MotionError
            Naming the first sample that cannot be reached.
        """
        n, own = len(qpos), qpos[:, self.structure.actuated_qpos]
        start, found = self._nothing(n, q.shape[1]), self._nothing(len(q), q.shape[1])

        def block(evaluator: Evaluator, rows: slice) -> None:
            names = np.arange(rows.start, rows.stop)
            start.put(names, self._newton(evaluator, qpos[rows].copy(), own[rows]))

        self.engine.in_blocks(block, n)
        rows = np.repeat(np.arange(n), count)
        self._reach(q, np.arange(len(q)), start, own[rows], rows, found)
        return found

    def _linked(self, found: Assembly, q: FloatArray) -> np.ndarray:
        """Which samples lead to their successors, ``(n - 1,)``: one step of a continuation, judged as any other."""
        rows = np.arange(len(q) - 1)
        if not len(rows):
            return np.zeros(0, dtype=np.bool_)
        moved, predicted = self._predict(found, rows, np.diff(q, axis=0))
        near = self._apart(predicted, found.qpos[1:]) <= np.maximum(CORRECTION * moved, NEGLIGIBLE)
        linked = near & (moved <= LONGEST_STEP)
        linked &= self._on_side(found, rows, found.at(slice(1, None)), linked)
        again = np.flatnonzero(~linked)
        if len(again):  # a longer way takes several steps; again all at once, and only compared
            stepped = self._nothing(len(q), q.shape[1])
            arrived = self._reach(q, again + 1, found, q[again], again, stepped, SMALLEST_STEP)
            linked[again] = arrived & (self._apart(stepped.qpos[again + 1], found.qpos[again + 1]) <= SAME)
        return linked

    def _apart(self, one: FloatArray, other: FloatArray) -> FloatArray:
        """How far configurations ``(k, nq)`` are apart, ``(k,)``: hinges, slides, and what ball joints carry.

        A rod's spin about its own axis is idle and depends on the way; so ball and free joints count by where they take
        joints and loop closures, not by their turns.
        """
        kinds, addresses, _ = self.joints
        scalar = addresses[kinds == SCALAR]
        distance: FloatArray = np.sqrt(np.sum((one[:, scalar] - other[:, scalar]) ** 2, axis=1))
        if (kinds != SCALAR).any():
            gap = np.linalg.norm(self._points(one) - self._points(other), axis=2).max(axis=1)
            distance = np.hypot(distance, gap)
        return distance

    def _points(self, qpos: FloatArray) -> FloatArray:
        """Anchors of joints and sites of loops and platform, ``(k, points, 3)``."""
        sites = _sites(self.structure)
        points = np.zeros((len(qpos), len(sites) + len(self.joints[0]), 3))

        def block(evaluator: Evaluator, rows: slice) -> None:
            count = rows.stop - rows.start
            evaluator.qpos[:count] = qpos[rows]
            poses = evaluator.place(np.arange(count, dtype=np.int32))
            points[rows, : len(sites)] = poses.site_xpos[:count, sites]
            points[rows, len(sites) :] = poses.anchors[:count]

        self.engine.in_blocks(block, len(qpos))
        return points


def _sites(structure: Structure) -> list[int]:
    blocks = structure.blocks.tolist()
    joined = {site for block in blocks if block[0] < 2 for site in block[3:5] if site >= 0}
    return sorted({*joined, structure.platform_site})


def refuse_jumps(
    t: FloatArray, structure: Structure, joints: tuple[np.ndarray, ...], qpos: FloatArray, qvel: FloatArray,
    qacc: FloatArray,
) -> None:  # fmt: skip
    """Refuse neighbours that are farther apart than their rates and the step between them allow.

    Over a step h a joint with speeds v and accelerations a at both ends moves by no more than about
    h max|v| + h^2 max|a|; `BEYOND` times that is refused. Hinges and slides, actuated ones included, are looked at;
    not the three hinges that stand for a ball joint of a rod that may turn about its own axis: no loop holds that turn.

    Raises
    ------
    MotionError
        Naming the sample, the joint, its change and what would be allowed.
    """
    kinds, addresses, dofs = joints
    idle = _hinges_of_rods(structure, kinds)
    scalar = np.array([j for j in range(len(kinds)) if kinds[j] == SCALAR and j not in idle], dtype=np.int64)
    if len(t) < 2 or not len(scalar):
        return
    h = np.diff(t)[:, None]
    change = np.abs(np.diff(qpos[:, addresses[scalar]], axis=0))
    speed, rise = (np.abs(array[:, dofs[scalar]]) for array in (qvel, qacc))
    reach = h * np.maximum(speed[1:], speed[:-1]) + h**2 * np.maximum(rise[1:], rise[:-1])
    beyond = change > np.maximum(BEYOND * reach, STILL)
    if beyond.any():
        sample, column = (int(index) for index in np.argwhere(beyond)[0])
        joint = structure.dof_names[int(dofs[scalar[column]])]
        raise MotionError(
            f"sample {sample + 1}, joint {joint}: jumps by {change[sample, column]:.3g} since t = {t[sample]:.6g} s;"
            f" its rates there allow {BEYOND * reach[sample, column]:.3g}; q, qd, qdd and t are not one motion, or"
            " the samples are too few for it",
            sample=sample + 1,
            joint=joint,
            value=float(change[sample, column]),
            limit=float(BEYOND * reach[sample, column]),
        )


def _hinges_of_rods(structure: Structure, kinds: np.ndarray) -> set[int]:
    """Joints that by threes stand for a ball joint at an end of a rod."""
    first = [-1 - end for rod in structure.rods for end in (rod.near, rod.far) if end < 0]
    return {joint for start in first if kinds[start] == SCALAR for joint in range(start, start + 3)}
