"""What a diagnosis says: findings, the table of parts, suggestions, and what could not be looked at."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from fractions import Fraction
from typing import Any

from workbench.diagnosis.entries import NONE_MARK, RIGHT_MARK, UNKNOWN_MARK, WRONG_MARK, Entry, show_ratio
from workbench.diagnosis.parts import ODD, REST, Part

KINEMATICS, DYNAMICS, FRICTION, FORCE, STRUCTURE, NUMERIC, PARAMETER, FAILURE = (
    "kinematics", "dynamics", "friction", "external force", "structure", "numeric", "parameter", "failure",
)  # fmt: skip


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong."""

    kind: str
    sentence: str
    joints: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()
    bodies: tuple[str, ...] = ()
    ratio: str = ""
    """formula / reference: ``x -1``, ``x 1/2``, ``missing``; empty where it is not the same everywhere"""
    weight: float = math.nan
    """largest error over the largest part of the joint's torque"""


@dataclass(frozen=True)
class Suggestion:
    """An edit of the formula's source that brings parts to round-off."""

    file: str
    line: int
    before: str
    after: str
    what: str
    """the kind of edit, in words"""
    mends: int
    """entries that become right"""
    left: int
    """entries that stay wrong"""
    step: int = 1
    """mistakes are mended one after the other: first, second ..."""
    path: str = field(default="", repr=False)
    text: str = field(default="", repr=False)
    """the whole file with this edit and those of the steps before it"""

    @property
    def diff(self) -> str:
        """The edit as a diff with file and line."""
        return f"{self.file}:{self.line}\n- {self.before.strip()}\n+ {self.after.strip()}"


@dataclass(frozen=True)
class Diagnosis:
    """What is wrong with one formula; empty `findings` where nothing is."""

    title: str
    candidate: str
    joints: tuple[str, ...]
    findings: tuple[Finding, ...]
    entries: tuple[Entry, ...] = field(repr=False)
    suggestions: tuple[Suggestion, ...] = ()
    not_covered: tuple[str, ...] = ()
    """what could not be looked at, and why"""
    mend_notes: tuple[str, ...] = ()
    """what there is to say about the search for a mend"""
    poses: int = 0
    states: int = 0
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def right(self) -> bool:
        """Whether nothing wrong was found."""
        return not self.findings

    @property
    def wrong(self) -> tuple[Entry, ...]:
        """Joints of parts that are wrong."""
        return tuple(entry for entry in self.entries if entry.status == WRONG_MARK)

    @property
    def digits(self) -> int:
        """Digits to which the worst of the right entries agrees."""
        return min((e.digits for e in self.entries if e.status == RIGHT_MARK), default=0)

    def __repr__(self) -> str:
        lines = [f"Diagnosis of {self.title}:"]
        if self.right:
            lines.append(f"  nothing wrong: every part agrees to {self.digits} digits in {self.states} states")
        lines += [f"  {number}. {finding.sentence}" for number, finding in enumerate(self.findings, start=1)]
        lines += [
            f"  mend {s.step}: {s.file}:{s.line}  {s.before.strip()}  ->  {s.after.strip()}" for s in self.suggestions
        ]
        lines += [f"  not looked at: {text}" for text in self.not_covered]
        return "\n".join(lines)

    def table(self) -> list[tuple[str, list[str]]]:
        """Rows of the table of parts: label, and for each joint its mark; rows with nothing in them are left out."""
        rows: dict[Part, list[str]] = {}
        for entry in self.entries:
            rows.setdefault(entry.part, [""] * len(self.joints))[entry.joint] = mark(entry)
        return [
            (part.label(self.joints), marks)
            for part, marks in rows.items()
            if any(marks) and (part.kind not in (ODD, REST) or any("right" not in m for m in marks if m))
        ]

    def as_data(self) -> dict[str, Any]:
        """The same as plain data for JSON."""
        return {
            "format": 1,
            "title": self.title,
            "candidate": self.candidate,
            "joints": list(self.joints),
            "right": self.right,
            "findings": [{k: _plain(v) for k, v in asdict(f).items()} for f in self.findings],
            "entries": [
                {
                    "part": entry.part.label(self.joints),
                    "joint": self.joints[entry.joint],
                    "status": entry.status,
                    "error": _plain(entry.error),
                    "weight": _plain(entry.weight),
                    "ratio": None if entry.ratio is None else float(entry.ratio),
                }
                for entry in self.entries
            ],
            "suggestions": [
                {k: v for k, v in asdict(s).items() if k not in ("text", "path")} | {"diff": s.diff}
                for s in self.suggestions
            ],
            "mend_notes": list(self.mend_notes),
            "not_covered": list(self.not_covered),
            "poses": self.poses,
            "states": self.states,
            "seconds": dict(self.seconds),
        }


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return list(value) if isinstance(value, tuple) else value


def mark(entry: Entry) -> str:
    """What the table shows of one entry."""
    if entry.status == NONE_MARK:
        return ""
    if entry.status == UNKNOWN_MARK:
        return "?"
    if entry.status == RIGHT_MARK:
        return f"right, {entry.digits} digits"
    if entry.part.kind in (ODD, REST):
        return "there"
    shown = show_ratio(entry.ratio)
    if isinstance(entry.ratio, Fraction) and shown:
        return f"WRONG {shown}"
    return f"WRONG by {percent(entry.error)}"


def percent(error: float) -> str:
    """Write a relative error as a percentage where that says something."""
    return f"{100 * error:.3g} %" if error >= 1e-4 else f"{error:.1e}"
