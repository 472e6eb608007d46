"""What a formula in another language did wrong, with the line of its own file where that is known."""

from __future__ import annotations


class ForeignError(Exception):
    """One line of what went wrong; *line* is the user's own, None where nobody can tell."""

    def __init__(self, what: str, line: int | None = None) -> None:
        super().__init__(" ".join(what.split()))
        self.line = line
