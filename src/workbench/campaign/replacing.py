"""Whether a run may take the place of an earlier one: what the earlier one alone holds is not lost in silence."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from workbench.campaign.changed import few
from workbench.campaign.evidence import FULL, Effort
from workbench.campaign.store import MANIFEST, PICTURES
from workbench.errors import OutputError
from workbench.reading import read_json

Request = Mapping[str, Any]
"""``model``, ``set``, ``only`` and ``candidates`` as they were asked for: the manifest's key ``request``."""


def request_of(
    model: Path | None,
    settings: Mapping[str, float],
    relative: Sequence[str],
    only: Sequence[str],
    candidates: Sequence[Any],
) -> dict[str, Any]:
    """What a command asks for beside its campaign; the same request may be run again and again over its own results."""
    return {
        "model": None if model is None else str(model),
        "set": sorted([*(f"{name}={value!r}" for name, value in settings.items()), *relative]),
        "only": sorted(only),
        "candidates": sorted(
            str(one) if isinstance(one, str | Path) else getattr(one, "__name__", type(one).__name__)
            for one in candidates
        ),
    }


def refuse_loss(
    directory: Path,
    campaign: str,
    request: Request,
    cases: Collection[str],
    candidates: Collection[str],
    effort: Effort = FULL,
    drawn: bool = True,
) -> None:
    """Refuse to put a run of another robot, selection, candidates or less evidence in the place of an earlier one.

    Parameters
    ----------
    directory
        Where the run would go.
    campaign, request
        The campaign's name, and `request_of`. The same request again is never refused: formulas, model and campaign
        may have been edited in between.
    cases, candidates
        Names that the new run will hold.
    effort
        The evidence that it will hold.
    drawn
        Whether it tries to draw pictures of the robot.

    Raises
    ------
    OutputError
        What would be lost, and the way on.
    """
    try:
        old = read_json(directory / MANIFEST)
    except (OSError, ValueError):
        return
    lost = _lost(old, campaign, request, cases, candidates) if isinstance(old, Mapping) else []
    if isinstance(old, Mapping) and not old.get("sweep"):
        lost += lost_evidence(old, effort)
    if not drawn and any((directory / PICTURES).glob("*.webp")):
        lost.append("with pictures of the robot, which this one does not draw")
    if lost:
        raise OutputError(
            f"{directory}: holds an earlier run {'; '.join(lost)}; --replace (replace=True) puts this run in its place,"
            " --out (out=) names another directory",
            path=str(directory),
        )


def _lost(
    old: Mapping[str, Any], campaign: str, request: Request, cases: Collection[str], candidates: Collection[str]
) -> list[str]:
    if old.get("sweep"):
        return [f"of {old['sweep'].get('cases', 'many')} cases of a sweep"] if isinstance(old["sweep"], Mapping) else []
    if old.get("campaign") != campaign:
        return [f'of the campaign "{old.get("campaign")}"']
    before = old.get("request")
    if before == request:
        return []
    before = before if isinstance(before, Mapping) else {}
    lost = []
    gone = [name for name in _names(old, "cases") if name not in cases]
    if gone:
        lost.append(f"with {len(gone)} case{'s' if len(gone) > 1 else ''} that this one does not have ({few(gone)})")
    formulas = [name for name in _formulas(old) if name not in candidates]
    if formulas:
        lost.append(f"with candidates that this one does not have ({few(formulas)})")
    # runs of earlier versions do not say what was asked for
    for key, what in (("model", "model"), ("set", "parameters")):
        if key in before and before[key] != request[key]:
            lost.append(f"of another robot: {what} {_asked(before[key])}, here {_asked(request[key])}")
    return lost


def lost_evidence(old: Mapping[str, Any], effort: Effort) -> list[str]:
    """What an earlier run's manifest holds of evidence that a run of this *effort* does not gather, in words."""
    lost = []
    if old.get("budget") is True and not effort.budget:
        lost.append("with its error budget (power balance, forward replay), which this one does not compute")
    engines = old.get("engines")
    gone = [str(name) for name in engines if name not in effort.engines] if isinstance(engines, list) else []
    if gone:
        lost.append(f"held against a further engine ({few(gone)})")
    return lost


def asked_for(old: Mapping[str, Any]) -> str:
    """What a manifest or the state of a sweep says was asked for, in words."""
    request = old.get("request")
    request = request if isinstance(request, Mapping) else {}
    said = [f"{key} {_asked(request[key])}" for key in ("model", "set", "candidates") if request.get(key)]
    campaign = [f'campaign "{old["campaign"]}"'] if old.get("campaign") else []
    return ", ".join([*campaign, *said]) or "the campaign as it is"


def _asked(value: Any) -> str:
    if isinstance(value, list):
        return few([str(one) for one in value]) or "as in the campaign"
    return str(value) if value else "as in the campaign"


def _names(old: Mapping[str, Any], key: str) -> list[str]:
    found = old.get(key)
    return [str(name) for name in found] if isinstance(found, Mapping) else []


def _formulas(old: Mapping[str, Any]) -> list[str]:
    """Candidates of an earlier run, without what is no candidate but a contrast."""
    spec = old.get("spec")
    listed = spec.get("candidate") if isinstance(spec, Mapping) else None
    if not isinstance(listed, list):
        return []
    return list(dict.fromkeys(str(one["name"]) for one in listed if isinstance(one, Mapping) and "name" in one))
