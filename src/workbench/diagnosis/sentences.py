"""From wrong entries and shares to sentences: one finding for what has one cause."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from workbench.diagnosis.entries import NONE_MARK, RIGHT_MARK, WRONG_MARK, Entry, show_ratio, simple
from workbench.diagnosis.items import Items, explain
from workbench.diagnosis.parts import DRY, FORCE, INERTIA, ODD, REST, VELOCITY, VISCOUS, WEIGHT, Part, Parts
from workbench.diagnosis.result import DYNAMICS, FRICTION, STRUCTURE, Finding, percent
from workbench.diagnosis.result import FORCE as FORCE_KIND
from workbench.diagnosis.shares import Share, unread_ratio
from workbench.diagnosis.subject import GRAVITY, MASS
from workbench.diagnosis.subject import INERTIA as INERTIA_KIND
from workbench.reference.terms import TURNING

MOST_FITS = 3
"""More items than these that all fit say nothing: the bodies move alike."""

Why = tuple[tuple[str, str], ...]
"""((parameter, ratio shown), ...): through which parameters an entry is wrong"""


def list_of(names: Sequence[str]) -> str:
    """Join names as a sentence does."""
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)


def reasons(entry: Entry, shares: Sequence[Share], formula: Parts, reference: Parts) -> Why:
    """Parameters through which one entry is wrong, each with its ratio; empty where none can be named."""
    found = []
    for share in shares:
        if not share.parameter.read:
            continue
        wrong = [e for e in share.wrong if e.part == entry.part and e.joint == entry.joint]
        if wrong and share.parameter.kind != GRAVITY:
            found.append((share.parameter.name, show_ratio(wrong[0].ratio)))
    if not found and entry.status == WRONG_MARK:
        unread = [share for share in shares if not share.parameter.read]
        ratios = [unread_ratio(share, formula, reference, entry.part, entry.joint) for share in unread]
        found = [
            (share.parameter.name, show_ratio(ratio))
            for share, ratio in zip(unread, ratios, strict=True)
            if ratio is not None
        ]
    if not found:
        for share in shares:
            wrong = [e for e in share.wrong if e.part == entry.part and e.joint == entry.joint]
            if wrong and share.parameter.kind == GRAVITY and share.parameter.read:
                found.append((share.parameter.name, show_ratio(wrong[0].ratio)))
    return tuple(found)


def dynamic_findings(
    entries: Sequence[Entry],
    shares: Sequence[Share],
    items: Items,
    formula: Parts,
    reference: Parts,
    joints: tuple[str, ...],
) -> list[Finding]:
    """Findings of weight, inertia and velocity: entries with the same cause are told together."""
    groups: dict[tuple[int, Why], list[Entry]] = {}
    seen: set[tuple[Part, int]] = set()
    hidden = [e for share in shares if share.parameter.read for e in share.wrong]
    for entry in [*entries, *hidden]:
        if entry.part.kind not in (WEIGHT, INERTIA, VELOCITY) or (entry.part, entry.joint) in seen:
            continue
        if entry.status != WRONG_MARK:
            continue
        seen.add((entry.part, entry.joint))
        why = reasons(entry, shares, formula, reference)
        groups.setdefault((entry.joint, why), []).append(entry)
    merged: dict[tuple[Why, tuple[Part, ...]], list[int]] = {}
    for (joint, why), found in groups.items():
        merged.setdefault((why, tuple(e.part for e in found)), []).append(joint)
    findings = []
    for (why, parts), where in merged.items():
        mine = [e for e in entries if e.part in parts and e.joint in where and e.status == WRONG_MARK]
        findings.append(_dynamic(why, parts, where, mine, shares, items, formula, reference, joints))
    return sorted(findings, key=lambda finding: -finding.weight if finding.weight == finding.weight else 0.0)


def _dynamic(
    why: Why,
    parts: tuple[Part, ...],
    where: list[int],
    mine: Sequence[Entry],
    shares: Sequence[Share],
    items: Items,
    formula: Parts,
    reference: Parts,
    joints: tuple[str, ...],
) -> Finding:
    names = [name for name, _ in why]
    ratios = {ratio for _, ratio in why}
    taus = list_of([f"tau_{joints[j]}" for j in where])
    labels = [part.label(joints) for part in parts]
    what = list_of(labels) if len(labels) <= 4 else f"{', '.join(labels[:3])} and {len(labels) - 3} more parts"
    weight = max((e.weight for e in mine), default=float("nan"))
    bodies = _bodies(parts, where, items, formula, reference)
    short = _short_of(why, mine, shares)
    whole = _whole(parts, where, why, shares)
    size = f" (off by up to {percent(weight)} of the joint's largest part)" if weight == weight else ""
    ratio = next(iter(ratios)) if len(ratios) == 1 else ""
    if not names:
        own = {show_ratio(e.ratio) for e in mine}
        ratio = own.pop() if len(own) == 1 else ""
        text = f"{what} in {taus}: {ratio or 'wrong'}{size}; through no parameter that could be varied"
    elif whole and ratio:
        text = f"{what} in {taus}: all of it {ratio}{size}"
    elif ratio == "missing":
        text = f"{list_of(names)}: missing from {what} in {taus}{size}"
    elif ratio:
        text = f"{list_of(names)}: {ratio} in {what} of {taus}{size}"
    elif len(names) > 3:
        text = f"{what} in {taus}: wrong through {len(names)} parameters, {', '.join(names[:3])} ...{size}"
    else:
        each = [f"{name} {ratio}" if ratio else name for name, ratio in why]
        text = f"{list_of(each)}: wrong share of {what} in {taus}{size}"
    if short:
        text += f"; {short}"
    elif bodies:
        text += f"; the error is {bodies[0]}"
    if not mine:
        text += "; with this robot's numbers it does not show, with others it does"
    return Finding(
        DYNAMICS, text, tuple(joints[j] for j in where), tuple(labels), tuple(names), tuple(bodies[1:]), ratio, weight
    )


def _short_of(why: Why, mine: Sequence[Entry], shares: Sequence[Share]) -> str:
    """Say by how much of a mass or inertia the mass matrix is off, where that is the same fraction at every pose."""
    if len(why) != 1 or len(mine) != 1 or mine[0].part.kind != INERTIA or mine[0].ratio == 0:
        return ""
    entry = mine[0]
    for share in shares:
        parameter = share.parameter
        if parameter.name != why[0][0] or parameter.value == 0.0 or parameter.kind not in (MASS, INERTIA_KIND):
            continue
        gap = share.formula[entry.part] - share.reference[entry.part]
        per = gap[:, entry.joint] / (parameter.varied - parameter.value) / share.acceleration(entry.part.of[0])
        fraction = simple(float(per.mean()))
        if isinstance(fraction, Fraction) and fraction != 0 and abs(per - float(fraction)).max() < 1e-6:
            return f"{'short' if fraction < 0 else 'too much'} by {abs(fraction)} {parameter.name}"
    return ""


def _whole(parts: tuple[Part, ...], where: list[int], why: Why, shares: Sequence[Share]) -> bool:
    """Whether every mass and inertia that enters is wrong alike: then it is the part, and no parameter."""
    entering = {
        share.parameter.name
        for share in shares
        if share.parameter.kind in (MASS, INERTIA_KIND) and share.parameter.read
        for e in share.entries
        if e.part in parts and e.joint in where and e.status not in (NONE_MARK,)
    }
    return len(entering) > 1 and entering == {name for name, _ in why} and len({ratio for _, ratio in why}) == 1


def _bodies(parts: tuple[Part, ...], where: list[int], items: Items, formula: Parts, reference: Parts) -> list[str]:
    """Say which body's item the error is a multiple of, then the bodies' names; empty where it is none."""
    for part in parts:
        found = [fit for fit in explain(items, formula, reference, part, where) if all(_plain(r) for _, _, r in fit)]
        if not found or len(found) > MOST_FITS:
            continue
        words = [" and ".join(f"{ratio} x {_item(part, body, axis)}" for body, axis, ratio in fit) for fit in found]
        bodies = dict.fromkeys(body for fit in found for body, _, _ in fit)
        return [" or ".join(words), *bodies]
    return []


def _plain(ratio: Fraction | float) -> bool:
    return isinstance(ratio, Fraction) and ratio.denominator <= 2 and abs(ratio.numerator) <= 2


def _item(part: Part, body: str, axis: str) -> str:
    if axis == TURNING:
        return f"the turning of {body}"
    return f"{'the weight' if part.kind == WEIGHT else 'the motion'} of {body} along {axis}"


def plain_findings(entries: Sequence[Entry], joints: tuple[str, ...], jacobian_wrong: bool) -> list[Finding]:
    """Findings of friction, of the external force where the Jacobian is right, and of what is no part at all."""
    found = []
    for kind in (VISCOUS, DRY, FORCE):
        wrong = [e for e in entries if e.part.kind == kind and e.status == WRONG_MARK]
        if not wrong or (kind == FORCE and jacobian_wrong):
            continue
        ratios = {show_ratio(e.ratio) for e in wrong}
        ratio = ratios.pop() if len(ratios) == 1 else ""
        where = sorted({e.joint for e in wrong})
        labels = list(dict.fromkeys(e.part.label(joints) for e in wrong))
        taus = list_of([f"tau_{joints[j]}" for j in where])
        size = max(e.weight for e in wrong)
        text = f"{list_of(labels)} in {taus}: {ratio or 'wrong'}"
        if kind == FORCE and len(where) == len(joints):
            text += "; masses hang rightly, so it is how the force enters, and not the Jacobian"
        named = tuple(joints[j] for j in where)
        kind_of = FORCE_KIND if kind == FORCE else FRICTION
        found.append(Finding(kind_of, text, named, tuple(labels), ratio=ratio, weight=size))
    odd = [e for e in entries if e.part.kind in (ODD, REST) and e.status not in (RIGHT_MARK, NONE_MARK)]
    odd = [e for e in odd if e.status == WRONG_MARK]
    if odd:
        where = sorted({e.joint for e in odd})
        first = [joints[e.part.of[0]] for e in odd if e.part.kind == ODD]
        through = f", seen where {list_of(sorted(set(first)))} alone moves" if first else ""
        found.append(
            Finding(
                STRUCTURE,
                f"{list_of([f'tau_{joints[j]}' for j in where])}: not affine in accelerations and force and quadratic"
                f" in rates, as the torque of a mechanism is{through}; look for an exponent, or for a product of two"
                " that should be a sum",
                tuple(joints[j] for j in where),
                tuple(dict.fromkeys(e.part.label(joints) for e in odd)),
                weight=max(e.weight for e in odd),
            )
        )
    return found
