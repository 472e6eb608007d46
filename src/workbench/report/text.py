"""How numbers, units and user text are written, in HTML and in Markdown."""

from __future__ import annotations

import html
import math
import re

from markupsafe import Markup

PERCENT_FROM = 1e-4
"""From this size on, a verification error is also written in percent."""

WHOLE_PERCENT_FROM = 9.995
"""From this fraction on, a percentage is written in whole numbers and not as a power of ten."""

_MARKDOWN_SPECIAL = re.compile(r"([\\`*_{}\[\]|#~$])")
_NUMBERED = re.compile(r"q(\d+)")
_CONTROL = dict.fromkeys(range(32), " ")
_LINE_START = re.compile(r"^(?:([-+=])(?=[-=\s]|$)|(\d{1,9})([.)])(?=\s|$))")


def scientific(value: float | None) -> str:
    """Write a small error as ``3.21e-16``; None is a dash."""
    if value is None:
        return "–"
    if value == 0 or not math.isfinite(value):
        return "0" if value == 0 else exact(value)
    return f"{value:.2e}"


def error_fraction(value: float) -> str:
    """Write a verification error: scientific, and in percent too where that is readable."""
    text = scientific(value)
    return f"{text} ({percent(value)})" if math.isfinite(value) and abs(value) >= PERCENT_FROM else text


def percent(value: float) -> str:
    """Write a fraction as a percentage with three significant digits."""
    if not math.isfinite(value):
        return exact(value)
    if abs(value) >= WHOLE_PERCENT_FROM:
        return f"{100 * value:.0f} %"
    return f"{100 * value:#.3g}".rstrip(".") + " %"


def exact(value: float | None, digits: int = 4) -> str:
    """Write a number with *digits* significant digits; None is a dash, not-a-number and infinity are words."""
    if value is None:
        return "–"
    if math.isnan(value):
        return "not a number"
    if math.isinf(value):
        return "infinite" if value > 0 else "-infinite"
    return f"{value:.{digits}g}"


def quantity(value: float | None, unit: str, digits: int = 4) -> str:
    """Write a number with its unit; a fraction whose unit is ``%`` becomes a percentage."""
    if value is None:
        return "–"
    return f"{exact(100 * value, digits)} %" if unit == "%" else with_unit(exact(value, digits), unit)


def count(value: int | None) -> str:
    """Write a whole number; None is a dash."""
    return "–" if value is None else str(value)


def pretty_unit(unit: str) -> str:
    """Write ``N m`` as ``N·m`` and ``m/s2`` as ``m/s²``."""
    return re.sub(r"(?<=[a-z])\^?2(?![0-9])", "²", unit.strip()).replace(" ", "·")


def torque_label(joint: str, unit: str) -> str:
    """Name an actuated joint's generalized force: ``τ2 [N·m]`` of q2, ``τ crank [N·m]`` of a joint called crank."""
    return f"{torque_name(joint)} [{pretty_unit(unit)}]"


def torque_name(joint: str) -> str:
    """Name the generalized force of an actuated joint: ``τ2`` of q2, ``τ crank`` of a joint called crank."""
    number = _NUMBERED.fullmatch(joint)
    return f"τ{number[1] if number else ' ' + joint}"


def with_unit(text: str, unit: str) -> str:
    """Append a unit; the units ``1`` and the empty string are not written."""
    return text if unit in ("", "1") else f"{text} {pretty_unit(unit)}"


def escape_markdown(value: object) -> Markup:
    """Return user text as one line of Markdown that shows exactly this text: no markup, no HTML, no table breaks."""
    text = " ".join(str(value).translate(_CONTROL).split())
    text = _MARKDOWN_SPECIAL.sub(r"\\\1", text)
    text = _LINE_START.sub(lambda match: f"\\{match[1]}" if match[1] else f"{match[2]}\\{match[3]}", text)
    return Markup(html.escape(text, quote=False))


def finalize_markdown(value: object) -> Markup:
    """Escape whatever a Markdown template prints, unless it is marked as Markdown already."""
    return value if isinstance(value, Markup) else escape_markdown(value)


def fenced(text: str) -> Markup:
    """Return *text* as a fenced block of Markdown, with a fence longer than any run of backticks in it."""
    longest = max((len(run) for run in re.findall(r"`+", text)), default=0)
    fence = "`" * max(3, longest + 1)
    return Markup(f"{fence}text\n{text}\n{fence}")


def slug(text: str, limit: int = 40) -> str:
    """Return *text* as a piece of a file name or an anchor: lower-case ASCII letters, digits and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")[:limit].strip("-") or "x"
