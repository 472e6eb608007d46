"""``workbench watch``: save the MJCF or the campaign in an editor and see the errors change."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from workbench.commands.assignments import settings
from workbench.commands.options import CampaignArgument, OtherModel, SetInCases

if TYPE_CHECKING:
    from workbench.campaign.rerun import Errors, Stamp

DEBOUNCE_MS, STEP_MS = 200, 20
"""Milliseconds: editors write a file in several steps; a pass starts when it has been quiet for a step."""

LOOK_MS = 500
"""Milliseconds after which files are looked at even if the system reports nothing, as on network drives."""

RENAMING_S = 1.0
"""Seconds that a file may be gone while an editor puts the new one in its place."""

WORSE_SHOWN = 6
"""Lines about what got worse, so that the table stays in sight."""


def watch(
    campaign: CampaignArgument,
    only: Annotated[list[str] | None, typer.Option(metavar="CASE", help="Run this case only; may be repeated.")] = None,
    set_: SetInCases = None,
    model: OtherModel = None,
    candidates: Annotated[
        list[str] | None,
        typer.Option(metavar="FILE", help="Python file with formulas of your own, run at every save; may be repeated."),
    ] = None,
    factor: Annotated[
        float, typer.Option(metavar="X", help="An error that grew by more than this factor is worse.")
    ] = 10.0,
) -> None:
    """Rerun a campaign whenever its MJCF, its TOML, a motion or a file of formulas is saved, until Ctrl-C.

    Shows every error with its change against the run before. Nothing is written; `workbench run` writes reports.
    """
    from rich.text import Text

    from workbench.campaign.rerun import compute_errors, files_of, stamps
    from workbench.campaign.spec import load_campaign
    from workbench.campaign.user_candidates import load_candidates
    from workbench.compare.errors import all_worse
    from workbench.errors import WorkbenchError
    from workbench.terminal import out

    values, relative = settings(set_ or [])
    all_worse((), factor)
    if not campaign.exists():
        load_campaign(campaign)  # a file that never was is a mistake, not an edit
    formulas = candidates or []
    load_candidates(name for name in formulas if not Path(name).is_file())  # likewise; raises, or a package's own
    before: Errors | None = None
    try:
        while True:
            files = files_of(campaign, model, formulas)
            seen = stamps(files)
            try:
                now = compute_errors(
                    campaign, model=model, only=only or (), settings=values, relative=relative, candidates=formulas
                )
            except WorkbenchError as error:
                out.print(Text(f"{_time()} {error}", style="bold red"), soft_wrap=True)
            else:
                _show(now, before, factor)
                before = now
            names = ", ".join(str(file) for file in files)
            out.print(Text(f"watching {names}; Ctrl-C ends", style="dim"), soft_wrap=True)
            for _ in _saves(seen):
                break
    except KeyboardInterrupt:
        out.print(Text("stopped"))


def _saves(seen: Mapping[Path, Stamp]) -> Iterator[None]:
    """Yield once when one of the files is no longer as it was seen."""
    from watchfiles import watch as changes

    from workbench.campaign.rerun import stamps

    folders = {parent for file in seen for parent in (file.parent, file.resolve().parent) if parent.is_dir()}
    gone_since: float | None = None
    for _ in changes(
        *(folders or {Path()}), watch_filter=None, debounce=DEBOUNCE_MS, step=STEP_MS, rust_timeout=LOOK_MS,
        yield_on_timeout=True, recursive=False,
    ):  # fmt: skip
        now = stamps(tuple(seen))
        if now == seen:
            continue
        gone = [file for file in seen if now[file] is None and seen[file] is not None]
        if gone and (gone_since is None or time.monotonic() - gone_since < RENAMING_S):
            gone_since = gone_since or time.monotonic()
            continue
        yield


def _show(now: Errors, before: Errors | None, factor: float) -> None:
    from rich.text import Text

    from workbench.commands.change_table import LEGEND, change_table
    from workbench.compare.errors import all_worse, match_errors
    from workbench.terminal import out

    changes = [c for c in match_errors(before.rows if before else (), now.rows) if c.after is not None]
    out.print(change_table(changes, now.joints, factor, alone=before is None))
    if before:
        out.print(Text(LEGEND, style="dim"))
        for line in _moved(before, now):
            out.print(Text(line))
    worse = all_worse(changes, factor)
    for line in worse[:WORSE_SHOWN]:
        out.print(Text(f"worse: {line}", style="red"), soft_wrap=True)
    if len(worse) > WORSE_SHOWN:
        out.print(Text(f"worse: {len(worse) - WORSE_SHOWN} more", style="red"))
    for message in now.messages:
        out.print(Text(message, style="red"), soft_wrap=True)
    out.print(_verdict(now, len(worse)))


def _moved(before: Errors, now: Errors) -> Iterator[str]:
    """Parameters that an edit changed, with the cases where it did not change them in all."""
    moved: dict[tuple[str, float, float], list[str]] = {}
    shared = [case for case in now.parameters if case in before.parameters]
    for case in shared:
        for name, value in now.parameters[case].items():
            old = before.parameters[case].get(name)
            if old is not None and old != value:
                moved.setdefault((name, old, value), []).append(case)
    for (name, old, value), cases in moved.items():
        yield f"{name}: {old!r} -> {value!r}{_among(cases, shared)}"


def _among(cases: Sequence[str], every: Sequence[str]) -> str:
    return "" if len(cases) == len(every) else f" in {', '.join(cases)}"


def _verdict(now: Errors, worse: int) -> object:
    from rich.text import Text

    from workbench.campaign.verdict import FAILURES, PASS

    failed = sum(row.verdict in FAILURES for row in now.rows) + len(now.messages)
    passed = [row.peak_error for row in now.rows if row.verdict == PASS]
    parts = [f"{failed} beyond their bounds"] if failed else []
    if passed:
        parts.append(f"{len(passed)} within their bounds, largest error {max(passed):.2g}")
    if worse:
        parts.append(f"{worse} worse than before")
    style = "bold red" if failed else "bold yellow" if worse else "bold green" if passed else "bold cyan"
    return Text(f"{_time()} {'; '.join(parts) or 'nothing judged'}; {now.seconds:.2f} s", style=style)


def _time() -> str:
    return datetime.now().astimezone().strftime("%H:%M:%S")
