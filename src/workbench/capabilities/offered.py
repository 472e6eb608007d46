"""A user's candidates beside those of a robot."""

from __future__ import annotations

from collections import ChainMap
from typing import Any

from workbench.robots.closed_form import Candidate


class OfferedCandidates(ChainMap[str, Candidate]):
    """A user's candidates before a robot's own; keeps the list of those that are wrong on purpose."""

    @property
    def on_purpose(self) -> Any:
        """Names of the robot's forms that are wrong on purpose, as its registry has them."""
        return getattr(self.maps[1], "on_purpose", ())
