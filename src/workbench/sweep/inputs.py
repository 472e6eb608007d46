"""Files that every case reads: a sweep runs for hours, and somebody may save one of them in the meantime."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from workbench.campaign import provenance
from workbench.campaign.cases import robot_files, tables_of
from workbench.campaign.spec import Campaign


@dataclass(frozen=True)
class _Seen:
    stamp: tuple[int, ...]
    content: str


class Inputs:
    """What the files held when the sweep began.

    Workers read them for every case, and a case's key tells what they held at the beginning. So an answer counts only
    if they have not changed by the time that it arrives.
    """

    def __init__(self, paths: Iterable[Path]) -> None:
        self._seen = {path: _look(path) for path in paths}

    def changed(self) -> Path | None:
        """Return a file whose content is another one now, or None. Looks at the content only where it was written."""
        for path, seen in self._seen.items():
            try:
                if provenance.stamp(path) == seen.stamp:
                    continue
                now = _look(path)
            except OSError:
                return path
            if now.content != seen.content:
                return path
            self._seen[path] = now
        return None


def _look(path: Path) -> _Seen:
    # the stamp first: what is written after it has another one
    return _Seen(provenance.stamp(path), provenance.sha256(path.read_bytes()))


def inputs_of(campaign: Campaign, file: Path, model: Path) -> Inputs:
    """The model with its robot file, and the tables of motions given by them."""
    return Inputs([*robot_files(campaign, file, model), *tables_of(campaign, file)])
