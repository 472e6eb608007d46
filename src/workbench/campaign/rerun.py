"""The errors of a campaign, computed again and again while its files are edited: nothing is written."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from workbench.campaign import provenance
from workbench.campaign.cases import locate, resolve_cases, robot_files
from workbench.campaign.compare import Row
from workbench.campaign.evidence import Effort
from workbench.campaign.motion_spec import TableMotion
from workbench.campaign.run import compute_named_case
from workbench.campaign.spec import load_campaign
from workbench.campaign.user_candidates import load_candidates, with_rows
from workbench.errors import WorkbenchError
from workbench.mjcf.compile import find_model

QUICK = Effort(budget=False, drawing=False)
"""Errors only."""

Stamp = tuple[int, int, int] | None
"""Modification time, size and inode of a file; None where there is none."""


@dataclass(frozen=True)
class Errors:
    """What one pass over a campaign gives."""

    rows: tuple[Row, ...]
    joints: tuple[str, ...]
    parameters: Mapping[str, Mapping[str, float]]
    """case -> parameter -> value"""
    messages: tuple[str, ...]
    """what else is wrong with a case, one line each"""
    seconds: float


def compute_errors(
    path: str | Path,
    *,
    model: Path | None = None,
    only: Sequence[str] = (),
    settings: Mapping[str, float] | None = None,
    relative: Sequence[str] = (),
    candidates: Sequence[str | Path] = (),
) -> Errors:
    """Compute every error of a campaign as it now stands; arguments as for `workbench.campaign.run.run_campaign`.

    Raises
    ------
    WorkbenchError
        Bad input, in one line.
    """
    clock = time.perf_counter()
    campaign, file = load_campaign(path)
    users = load_candidates(candidates)
    campaign = with_rows(campaign, users)
    cases = resolve_cases(campaign, file, model, tuple(only), settings, relative, users)
    results = [compute_named_case(campaign, case, file, QUICK) for case in cases]
    return Errors(
        rows=tuple(row for result in results for row in result.rows),
        joints=cases[0].robot.joints,
        parameters={case.name: case.robot.values for case in cases},
        messages=tuple(f'case "{r.name}": {r.facts["message"]}' for r in results if r.facts["message"]),
        seconds=time.perf_counter() - clock,
    )


def files_of(path: str | Path, model: Path | None = None, candidates: Sequence[str | Path] = ()) -> tuple[Path, ...]:
    """Files that a campaign's numbers come from: itself, formulas, model, motions; as far as they can be told."""
    found = [Path(path), *(Path(name) for name in candidates if Path(name).suffix == ".py")]
    if model is not None:
        with contextlib.suppress(WorkbenchError):
            found.append(find_model(model))
    with contextlib.suppress(WorkbenchError):
        campaign, file = load_campaign(path)
        found[0] = file
        with contextlib.suppress(WorkbenchError):
            found += robot_files(campaign, file, model)
        for case in campaign.case:
            if isinstance(case.motion, TableMotion):
                with contextlib.suppress(WorkbenchError):
                    found.append(locate(file, case.motion.file, "motion.file"))
    return tuple(dict.fromkeys(found))


def stamps(files: Sequence[Path]) -> dict[Path, Stamp]:
    """Say of each file what changes when it is saved."""
    return {file: _stamp(file) for file in files}


def _stamp(file: Path) -> Stamp:
    try:
        return provenance.stamp(file)
    except OSError:
        return None
