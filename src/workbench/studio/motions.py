"""A case's motion made larger, faster, and no finer than a page needs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.motion_spec import TableMotion
from workbench.campaign.spec import CaseSpec
from workbench.motion import JointMotion, PlatformMotion

SAMPLES = 200
"""Samples of a case on the page."""

MOST_TABLE_SAMPLES = 400
"""Of a table, whose samples are its own, every sample is taken up to here; beyond, every second, third, ..."""

PER_SPEED = ("start", "stop", "lift_time", "traverse_time", "lower_time", "dwell")
"""Seconds of a motion, which a factor on its speed divides."""


def scaled_spec(spec: CaseSpec, amplitude: float, speed: float) -> CaseSpec:
    """Return a case whose motion, given by formulas, is *amplitude* times as large and *speed* times as fast.

    Sinusoids keep their offsets and phases; a pick-and-place cycle keeps its pick, and its place and lifts move from
    there. The number of samples stays. A table is returned as it is: `scaled` scales its samples.
    """
    if isinstance(spec.motion, TableMotion) or (amplitude, speed) == (1.0, 1.0):
        return spec
    motion: dict[str, Any] = spec.motion.model_dump()
    if "terms" in motion:
        motion["terms"] = [
            [[term[0] * amplitude, term[1] * speed, *term[2:]] for term in terms] for terms in motion["terms"]
        ]
    if "amplitude" in motion:
        motion["amplitude"] = [value * amplitude for value in motion["amplitude"]]
        motion["frequency"] = [value * speed for value in motion["frequency"]]
    if "pick" in motion:
        motion["place"] = [p + amplitude * (q - p) for p, q in zip(motion["pick"], motion["place"], strict=True)]
        lift = motion["lift"]
        motion["lift"] = [v * amplitude for v in lift] if isinstance(lift, list) else lift * amplitude
    for name in PER_SPEED:
        if motion.get(name) is not None:
            motion[name] = motion[name] / speed
    if motion.get("rate") is not None:
        motion["rate"] = motion["rate"] * speed
    changed = {"motion": motion}
    if spec.replay is not None:
        changed["replay"] = {"start": spec.replay.start / speed, "stop": spec.replay.stop / speed}
    return CaseSpec.model_validate({**spec.model_dump(), **changed})


def own_samples(spec: CaseSpec) -> int | None:
    """How many samples a case has, where formulas give its motion; None for a table, and where a cycle's rate says."""
    motion = spec.motion
    if isinstance(motion, TableMotion):
        return None
    samples: int | None = motion.samples
    if samples is not None:
        return samples
    start, stop = getattr(motion, "start", None), getattr(motion, "stop", None)
    if start is None or stop is None or motion.rate is None:
        return None
    steps: float = (stop - start) * motion.rate
    return math.floor(steps + 1e-9) + 1


def thinned_spec(spec: CaseSpec, samples: int = SAMPLES) -> CaseSpec:
    """Return a case with at most *samples* samples, over the same time; a table as it is."""
    own = own_samples(spec)
    if isinstance(spec.motion, TableMotion) or (own is not None and own <= samples):
        return spec
    motion = {**spec.motion.model_dump(), "samples": samples, "rate": None}
    return CaseSpec.model_validate({**spec.model_dump(), "motion": motion})


def scaled(
    planned: JointMotion | PlatformMotion, amplitude: float, speed: float
) -> JointMotion | PlatformMotion:  # fmt: skip
    """Scale a table's samples about the first one, and thin them; times ``(n,)`` are divided by *speed*."""
    step = math.ceil(len(planned.t) / MOST_TABLE_SAMPLES)
    t = planned.t[::step] / speed

    def about_first(
        places: FloatArray, rates: FloatArray, seconds: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        first = places[:1]
        return (
            first + amplitude * (places[::step] - first),
            amplitude * speed * rates[::step],
            amplitude * speed**2 * seconds[::step],
        )

    if isinstance(planned, JointMotion):
        q, qd, qdd = about_first(planned.q, planned.qd, planned.qdd)
        return JointMotion(t, q, qd, qdd, planned.warnings)
    x, xd, xdd = about_first(planned.x, planned.xd, planned.xdd)
    return PlatformMotion(t, x, xd, xdd, planned.coordinates, planned.warnings)


def as_table(t: FloatArray, q: FloatArray, qd: FloatArray, qdd: FloatArray, joints: tuple[str, ...]) -> str:
    """A motion as the CSV file that a campaign's ``kind = "csv"`` reads, every digit kept."""
    header = ["t", *joints, *(f"{joint}_d" for joint in joints), *(f"{joint}_dd" for joint in joints)]
    rows = np.column_stack([t, q, qd, qdd])
    lines = [",".join(header), *(",".join(repr(float(value)) for value in row) for row in rows)]
    return "\n".join(lines) + "\n"
