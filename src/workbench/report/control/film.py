"""The stored film of a study: what each model makes of the motion at the point where the models differ most."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Annotated

from pydantic import Field

from workbench.control.names import TRACKING
from workbench.errors import OutputError
from workbench.records import Record, read_record
from workbench.report.control.load import Place, StudyRun
from workbench.report.pictures import FOLDER, MOST_FRAMES, MOST_PIXELS, address, webp
from workbench.report.section import Section

FORMAT_VERSION = 1
OTHER_RUNS = "the stored film shows runs that were computed anew since"
TITLE = "The robot in motion, its error enlarged"


class TakeRecord(Record):
    """One model's film."""

    run: int
    key: str
    model: str
    rms: float
    peak: float
    still: Annotated[str, Field(pattern=r"^tracking-[0-9]-still\.webp$")]
    sheet: Annotated[str, Field(pattern=r"^tracking-[0-9]\.webp$")]


class TrackingRecord(Record):
    """tracking.json."""

    note: str = ""
    """why there is no film; empty where there is one"""
    case: str = ""
    controller: str = ""
    speed: float = 1.0
    rate: float = 1.0
    rate_asked: str = ""
    bandwidth: float = 1.0
    enlarged: float = 1.0
    worst: float = 0.0
    takes: Annotated[tuple[TakeRecord, ...], Field(max_length=9)] = ()
    columns: Annotated[int, Field(ge=1, le=MOST_PIXELS)] = 1
    width: Annotated[int, Field(ge=1, le=MOST_PIXELS)] = 1
    height: Annotated[int, Field(ge=1, le=MOST_PIXELS)] = 1
    times: Annotated[tuple[float, ...], Field(max_length=MOST_FRAMES)] = ()


@dataclass(frozen=True)
class Shot:
    """One model's film with its caption."""

    name: str
    """controller and model"""
    caption: str
    """what it costs"""
    alt: str
    still_file: str
    still: bytes = field(repr=False)
    sheet: bytes = field(repr=False)

    @property
    def address(self) -> str:
        """The sheet of frames as an address that loads nothing."""
        return address(self.sheet)


def film_section(run: StudyRun) -> Section | None:
    """The section with the film; None where the study was told to make none.

    Raises
    ------
    OutputError
        The record is torn or of another format; a picture is missing, not WebP, or too large for a page.
    """
    path = run.directory / FOLDER / TRACKING
    if not os.path.lexists(path):
        return None
    record = read_record(path, TrackingRecord, FORMAT_VERSION)
    kept = {row["index"]: row["key"] for row in run.runs}
    note = record.note
    if not note and any(kept.get(take.run) != take.key for take in record.takes):
        note = OTHER_RUNS
    if note:
        return _section(f"No film: {note}.", record, ())
    if not record.takes or not record.times:
        raise OutputError(f"{path}: {len(record.takes)} films of {len(record.times)} frames; needed: one and more")
    shots = []
    for take in record.takes:
        place = Place(
            record.case, record.controller, take.model, record.speed, record.rate, record.rate_asked, record.bandwidth
        )
        shots.append(
            Shot(
                place.name,
                f"the platform is off by {1e3 * take.rms:.3g} mm (rms), {1e3 * take.peak:.3g} mm at most",
                f"The robot with {place.name} as MuJoCo renders it, its error enlarged, over where it should be",
                f"{FOLDER}/{take.still}",
                webp(run.directory / FOLDER / take.still),
                webp(run.directory / FOLDER / take.sheet),
            )
        )
    at = f"{record.case} at {record.speed:g} times its speed, {record.rate:g} Hz, bandwidth {record.bandwidth:g} Hz"
    drawn = (
        f"Joint errors are drawn {record.enlarged:g} times as large as they are"
        if record.enlarged > 1.0
        else "Joint errors are drawn as they are"
    )
    apart = "where the models are farthest apart" if len(shots) > 1 else "the largest error of the study"
    said = f"{at}: {apart}. {drawn}, loops closed; the pale robot stands where it should be."
    return _section(said, record, tuple(shots))


def _section(said: str, record: TrackingRecord, shots: tuple[Shot, ...]) -> Section:
    times = record.times or (0.0,)
    context = {
        "paragraphs": [said],
        "shots": shots,
        "film": record,
        "frames": " ".join(f"{time:g}" for time in times),
        "range": f"{times[0]:g} {times[-1]:g} {record.worst:g}",
    }
    return Section("film", TITLE, "tracking", context)
