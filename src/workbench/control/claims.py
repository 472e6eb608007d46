"""Judging sentences about models in control: by tracking errors, at every point of a study.

A point is one case at one speed, rate and bandwidth. The share of a model there is E / E0 - 1, E and E0 the platform's
rms errors with the model and with the one that it is held against, everything else equal. It is known to the largest
difference that half the plant's step, or MuJoCo's route, makes to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from workbench.campaign.control_spec import PRINTED_COST, ControlClaim, ControlSpec
from workbench.control.names import NOT_RUN, ROUTES
from workbench.control.plan import Loop

HOLDS, REFUTED, UNDECIDED = "holds", "does not hold", "cannot be decided"
NOT_ABOUT = "not about this robot"

MANY = 2.0
"""Shares beyond this read better as so many times the error."""

ROUTE_NAMES = {"rms": "as computed", "rms_halved": "half the step", "rms_second": "MuJoCo's integrator and loops"}


@dataclass(frozen=True)
class Known:
    """One finished run: its place in the study, and the platform's rms error by each route, m; empty if unstable."""

    loop: Loop
    errors: Mapping[str, float]


@dataclass(frozen=True)
class Point:
    """Two models at one place of a study."""

    case: str
    speed: float
    rate: str
    bandwidth: float
    error: float
    """m; infinite where the loop is unstable"""
    against: float
    share: float
    uncertainty: float
    """of the share"""
    fine: bool | None
    """whether the model is enough there; None where nobody can tell"""


@dataclass(frozen=True)
class Verdict:
    """What became of a claim."""

    id: str
    text: str
    source: str
    verdict: str
    sentence: str
    """the figures that decide it"""
    varied: dict[str, str]
    """the verdict again by half the step, MuJoCo's route, each bandwidth"""
    note: str = ""

    def facts(self) -> dict[str, Any]:
        """For control.json."""
        return asdict(self)


def points_of(
    claim: ControlClaim, spec: ControlSpec, runs: Iterable[Known], route: str = "rms", bandwidth: float | None = None
) -> list[Point]:
    """All places of a study at which both models of a claim have run, in the study's order."""
    by_place: dict[tuple[str, float, str, float], dict[str, Known]] = {}
    for run in runs:
        loop = run.loop
        if loop.controller != claim.controller or (claim.cases and loop.case not in claim.cases):
            continue
        if claim.kind == "faster" and loop.rate_asked != PRINTED_COST:
            continue
        if claim.kind != "faster" and loop.rate_asked == PRINTED_COST:
            continue  # there the models run at rates of their own
        if claim.kind == "enough" and claim.speeds and not _among(loop.speed, claim.speeds):
            continue
        if bandwidth is not None and loop.bandwidth != bandwidth:
            continue
        place = loop.case, loop.speed, loop.rate_asked, loop.bandwidth
        by_place.setdefault(place, {})[loop.model] = run
    found = []
    for (case, speed, rate, width), models in by_place.items():
        if claim.model not in models or claim.against not in models:
            continue
        one, other = models[claim.model].errors, models[claim.against].errors
        if not one and not other:
            continue  # neither tracks: that is not the model's doing
        if any(errors and route not in errors for errors in (one, other)):
            continue
        error, against = one.get(route, math.inf), other.get(route, math.inf)
        share = _share(error, against)
        shares = [_share(one[r], other[r]) for r in ROUTES if r in one and r in other]
        spread = max((abs(value - share) for value in shares), default=math.nan) if math.isfinite(share) else 0.0
        vouched = spec.second_route == "none" or ("rms_second" in one and "rms_second" in other)
        others = [abs(one[r] - error) for r in ROUTES if r in one and r != route]
        known = max(others, default=math.nan) if vouched else math.nan
        # one route alone vouches for nothing
        uncertainty = spread if not math.isfinite(share) or (vouched and len(shares) > 1) else math.nan
        found.append(
            Point(
                case,
                speed,
                rate,
                width,
                error,
                against,
                share,
                uncertainty,
                _enough(error, known, share, uncertainty, spec),
            )
        )
    return found


def _among(speed: float, speeds: Sequence[float]) -> bool:
    return any(math.isclose(speed, one) for one in speeds)


def _share(error: float, against: float) -> float:
    if math.isinf(against):
        return math.nan if math.isinf(error) else -1.0
    return error / against - 1.0 if against > 0.0 else math.nan


def _enough(error: float, known: float, share: float, uncertainty: float, spec: ControlSpec) -> bool | None:
    """Enough where the error, *known* to so much, does not matter, or is hardly larger than the other model's."""
    if error + known <= spec.wanted:
        return True
    if math.isnan(share) or math.isnan(uncertainty):
        return None
    if share + uncertainty <= spec.enough:
        return True
    return False if share - uncertainty > spec.enough else None


Judge = Callable[[ControlClaim, Sequence[Point]], tuple[str, str]]


def _worst(points: Sequence[Point]) -> str:
    known = [point for point in points if not math.isnan(point.share)]
    if not known:
        return ""
    worst = max(known, key=lambda point: (point.fine is False, point.share))
    if math.isinf(worst.error):
        return f"unstable in {worst.case} at speed {worst.speed:g}, {_rate(worst)}, {worst.bandwidth:g} Hz bandwidth"
    return (
        f"at worst {_added(worst)} in {worst.case} at speed"
        f" {worst.speed:g}, {_rate(worst)}, bandwidth {worst.bandwidth:g} Hz: {1e3 * worst.error:.3g} mm against"
        f" {1e3 * worst.against:.3g} mm"
    )


def _added(point: Point) -> str:
    if point.share > MANY:
        return f"{1.0 + point.share:.3g} times the other's error (known to {point.uncertainty:.2g})"
    return f"{100 * point.share:+.3g} % (known to {100 * point.uncertainty:.2g} %)"


def _rate(point: Point) -> str:
    return "rates of the printed costs" if point.rate == PRINTED_COST else f"{point.rate} Hz"


def _counted(claim: ControlClaim, points: Sequence[Point]) -> str:
    fine = sum(point.fine is True for point in points)
    open_ = sum(point.fine is None for point in points)
    unsure = f", undecided at {open_}" if open_ else ""
    return f"{claim.model} is enough at {fine} of {len(points)} points{unsure}; {_worst(points)}"


def _judge_enough(claim: ControlClaim, points: Sequence[Point]) -> tuple[str, str]:
    said = _counted(claim, points)
    if any(point.fine is False for point in points):
        return REFUTED, said
    return (HOLDS if points and all(point.fine for point in points) else UNDECIDED), said


def _judge_faster(claim: ControlClaim, points: Sequence[Point]) -> tuple[str, str]:
    better = [point for point in points if point.share + point.uncertainty < 0.0]
    worse = [point for point in points if point.share - point.uncertainty > 0.0]
    said = f"at its own rate {claim.model} tracks better than {claim.against} at {len(better)} of {len(points)} points"
    if worse:
        return REFUTED, f"{said}, worse at {len(worse)}; {_worst(points)}"
    return (HOLDS if points and len(better) == len(points) else UNDECIDED), f"{said}; {_worst(points)}"


def _extra(points: Sequence[Point], speed: float) -> tuple[float, float]:
    """The largest error that the model adds at a speed, m, and the largest of the error that remains anyway."""
    here = [point for point in points if math.isclose(point.speed, speed)]
    return max((p.error - p.against for p in here), default=math.nan), max((p.against for p in here), default=math.nan)


def _judge_grows(claim: ControlClaim, points: Sequence[Point]) -> tuple[str, str]:
    speeds = sorted({point.speed for point in points})
    if len(speeds) < 2:
        return UNDECIDED, "needs two speeds"
    low, high = _extra(points, speeds[0])[0], _extra(points, speeds[-1])[0]
    said = f"the model adds {1e3 * low:.3g} mm at speed {speeds[0]:g} and {1e3 * high:.3g} mm at speed {speeds[-1]:g}"
    limits = [point for point in points if math.isclose(point.speed, speeds[-1])]
    if not low < high or all(point.fine is True for point in limits):
        return REFUTED, f"{said}; {_counted(claim, limits)} there"
    return (HOLDS if any(p.fine is False for p in limits) else UNDECIDED), f"{said}; {_counted(claim, limits)} there"


def _judge_enough_but_fast(claim: ControlClaim, points: Sequence[Point]) -> tuple[str, str]:
    slow = [point for point in points if not _among(point.speed, claim.speeds)]
    fast = [point for point in points if _among(point.speed, claim.speeds)]
    first, said = _judge_enough(claim, slow)
    second, also = _judge_enough(claim, fast)
    text = f"below: {said}; at speeds {', '.join(f'{s:g}' for s in claim.speeds)}: {also}"
    if first == REFUTED or second == HOLDS:
        return REFUTED, text
    return (HOLDS if first == HOLDS and second == REFUTED else UNDECIDED), text


JUDGES: Mapping[str, Judge] = {
    "enough": _judge_enough, "faster": _judge_faster, "grows": _judge_grows, "enough-but-fast": _judge_enough_but_fast,
}  # fmt: skip


NotAbout = Callable[[ControlClaim], str]
"""Why a claim is not about the robots of its cases; empty where it is."""


def judged(spec: ControlSpec, runs: Sequence[Known], not_about: NotAbout = lambda claim: "") -> list[Verdict]:
    """Judge every claim of a study that is about its robots, and each again with step, integrator and gains varied."""
    found = []
    for claim in spec.claim:
        if said := not_about(claim):
            found.append(Verdict(claim.id, claim.text, claim.source, NOT_ABOUT, said, {}, ""))
            continue
        judge = JUDGES[claim.kind]
        verdict, sentence = judge(claim, points_of(claim, spec, runs))
        varied = {ROUTE_NAMES[route]: points_of(claim, spec, runs, route) for route in ROUTES[1:]}
        for width in spec.bandwidths:
            varied[f"bandwidth {width:g} Hz"] = points_of(claim, spec, runs, bandwidth=width)
        verdicts = {name: judge(claim, points)[0] if points else NOT_RUN for name, points in varied.items()}
        found.append(Verdict(claim.id, claim.text, claim.source, verdict, sentence, verdicts, claim.note))
    return found
