"""What a film of a study shows: where the models differ most, each model's run, with its error enlarged to be seen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.control.evaluate import Study, track
from workbench.control.figures import error_of, errors_in, is_decided, platform_row, uncertainty_of
from workbench.control.loop import TRACKED
from workbench.control.plan import Loop
from workbench.errors import MotionError, WorkbenchError
from workbench.reference.closure import LoopCloser
from workbench.sweep.record import GOOD, Record

MOST_TAKES = 3
"""Films of one study, each with a model of its own."""

SHOWN = 0.1
"""Of the robot's extent: as far the largest error is enlarged, where the enlarged loops still close."""

STEPS = tuple(float(f"{digit}e{power}") for power in range(6) for digit in (1, 2, 5))
"""By what an error may be enlarged."""

SAME = 1e-9
"""Of the platform's rms error: a run that is made again for its film is the one that was kept if it is off by less."""


@dataclass(frozen=True)
class Take:
    """One run of a film."""

    run: int
    key: str
    """of its record: what the run was made of"""
    model: str
    rms: float
    """m, of the platform, as kept"""
    peak: float
    qpos: FloatArray = field(repr=False)
    """``(n, nq)`` poses with the joints' errors enlarged, loops closed"""


@dataclass(frozen=True)
class Footage:
    """Runs at one point of a study, over the same ticks."""

    loop: Loop
    """of the first take; the others differ in the model alone"""
    compiled: Any
    """the robot that is moved, a compiled MuJoCo model"""
    times: FloatArray = field(repr=False)
    """``(n,)`` s"""
    wanted: FloatArray = field(repr=False)
    """``(n, nq)`` poses of the motion that is asked for"""
    takes: tuple[Take, ...]
    enlarged: float
    worst: int
    """sample at which the platform is off most, in any take"""


def chosen(loops: Sequence[Loop], records: Sequence[Record]) -> tuple[int, ...]:
    """Which runs to film: those of the case, controller, speed, rate and bandwidth at which models differ most.

    Runs that do not track, or of which the error is not known to a tenth, are left out, and so are rates that differ
    from model to model. Where no two models meet, the run with the largest error; where none tracks, no run.
    """
    errors: dict[int, float] = {}
    places: dict[tuple[object, ...], list[int]] = {}
    for number, (loop, record) in enumerate(zip(loops, records, strict=True)):
        row = platform_row(record.rows)
        if record.status not in GOOD or row is None:
            continue
        known = uncertainty_of(errors_in(row))
        if math.isfinite(known) and not is_decided(row["rms"], known):
            continue
        errors[number] = row["rms"]
        place = loop.case, loop.controller, loop.speed, loop.rate, loop.rate_asked, loop.bandwidth
        places.setdefault(place, []).append(number)
    if not errors:
        return ()

    def apart(runs: list[int]) -> float:
        return max(errors[run] for run in runs) - min(errors[run] for run in runs)

    best = max(places.values(), key=apart)
    if len(best) < 2:
        return (max(errors, key=lambda run: errors[run]),)
    if len(best) > MOST_TAKES:
        best = [max(best, key=lambda run: errors[run]), min(best, key=lambda run: errors[run])]
    return tuple(sorted(best))


def footage_of(study: Study, records: Sequence[Record]) -> Footage | None:
    """Run what is to be filmed once more, by the package's route; None where no run tracks.

    Raises
    ------
    WorkbenchError
        A run comes out otherwise than it was kept, or its loops do not close at every tick.
    """
    runs = chosen(study.plan.loops, records)
    if not runs:
        return None
    loops = [study.plan.loops[run] for run in runs]
    bench = study.bench(loops[0])
    desired, x_desired = bench.desired(loops[0].rate)
    courses, aways, rows = [], [], []
    for run, loop in zip(runs, loops, strict=True):
        tracked, row = track(study, loop), platform_row(records[run].rows)
        assert row is not None  # a run that does not track is not chosen
        again = error_of(tracked.q, desired.q, tracked.x, x_desired) if tracked.status == TRACKED else None
        if again is None or abs(again.platform_rms - row["rms"]) > SAME * row["rms"]:
            found = tracked.status if again is None else f"errs by {again.platform_rms:.9g} m"
            raise WorkbenchError(f"run {run} made again {found}, kept is {row['rms']:.9g} m")
        courses.append(tracked.q)
        aways.append(np.linalg.norm(tracked.x - x_desired, axis=1))
        rows.append(row)
    closer, compiled = bench.plant.reference.closer, bench.plant.reference.compiled()
    largest = max(float(away.max()) for away in aways)
    most = SHOWN * compiled.stat.extent / largest if largest > 0.0 else 1.0
    enlarged, poses = _enlarged(closer, desired.q, courses, most)
    takes = tuple(
        Take(run, records[run].key, loop.model, row["rms"], row["peak"], qpos)
        for run, loop, row, qpos in zip(runs, loops, rows, poses, strict=True)
    )
    worst = int(np.argmax(np.max(aways, axis=0)))
    wanted = closer.close_along(desired.q).qpos
    return Footage(loops[0], compiled, desired.t, wanted, takes, enlarged, worst)


def _enlarged(
    closer: LoopCloser, desired: FloatArray, courses: Sequence[FloatArray], most: float
) -> tuple[float, list[FloatArray]]:
    """The largest factor up to *most* at which all loops close, and the poses ``(n, nq)`` of each course with it."""
    fitting = [step for step in STEPS if step <= most] or [1.0]
    while True:
        factor = fitting.pop()
        try:
            return factor, [closer.close_along(desired + factor * (course - desired)).qpos for course in courses]
        except MotionError:
            if not fitting:
                raise
