"""The workbench's one family of errors.

Every message is one line: what is wrong, where (file, key, case, time, joint), the value found and what is allowed.
The same facts are kept as attributes, so that a program can read them without parsing the text.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any


class WorkbenchError(Exception):
    """Base of everything the workbench raises on purpose; the command line turns it into one line and exit code 2.

    Parameters
    ----------
    message
        One line: what, where, value, limit.
    **facts
        The data behind the message (file, key, case, time, joint, value, limit ...), readable as ``error.facts``.
    """

    def __init__(self, message: str, **facts: Any) -> None:
        super().__init__(" ".join(message.split()))
        self.facts = facts


class SpecError(WorkbenchError):
    """A campaign file is missing, malformed, or asks for something that does not exist."""


class ModelError(WorkbenchError):
    """An MJCF file does not compile, cannot be assembled, or breaks an assumption of the comparison."""


class ParameterError(WorkbenchError):
    """A parameter is unknown or has a value that it may not have."""


class MotionError(WorkbenchError):
    """A motion leaves the workspace, meets a singular pose, or is not finite."""


class OutputError(WorkbenchError):
    """Results cannot be written, or stored results cannot be read."""


class CandidateError(WorkbenchError):
    """A user's formula raises, takes too long, or returns something that is no torque."""


class MissingExtraError(WorkbenchError):
    """An optional dependency is needed and not installed."""


class ArrayError(WorkbenchError, ValueError):
    """An array argument has the wrong shape, type or values."""


def did_you_mean(name: str, valid: Iterable[str]) -> str:
    """Return ``; did you mean "x"?`` or, where nothing is near, the list of valid names."""
    names = sorted(valid)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    if near:
        return f'; did you mean "{near[0]}"?'
    return f"; valid: {', '.join(names)}" if names else ""
