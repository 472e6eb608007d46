"""Plain text as LaTeX: every name and sign escaped, keys of the bibliography cited, long names with places to break."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator

_SPECIAL = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "#": r"\#", "%": r"\%", "_": r"\_",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "|": r"\textbar{}", '"': r"\textquotedbl{}", "–": "--", "“": "``", "”": "''", "·": r"$\cdot$", "²": r"$^2$",
    "µ": r"$\mu$", "±": r"$\pm$", "−": r"$-$", "Δ": r"$\Delta$", "τ": r"$\tau$", "q̇": r"$\dot q$", "ẋ": r"$\dot x$",
    "✓": r"$\surd$", "✗": r"$\times$", "⚠": "", "≠": r"$\neq$", "→": r"$\rightarrow$", "×": r"$\times$",
    "≈": r"$\approx$", "≤": r"$\leq$", "≥": r"$\geq$", "…": r"\ldots{}", "°": r"$^\circ$", "≡": r"$\equiv$",
    "π": r"$\pi$", "α": r"$\alpha$", "ω": r"$\omega$", "φ": r"$\varphi$", "\u2019": "'",
}  # fmt: skip
_SIGN = re.compile("|".join(sorted(map(re.escape, _SPECIAL), key=len, reverse=True)))
POWER = re.compile(r"(?<![\w.])(-?\d(?:\.\d+)?)e([+-]\d{2,3})(?!\w)")
_SCRIPTED = re.compile(r"(?<![A-Za-z0-9_])τ(?:_([a-z]+)|(\d+))")
_KEY = re.compile(r"\[([A-Za-z][A-Za-z0-9]*)\]")
_WRITTEN = re.compile("|".join(f"(?:{one.pattern})" for one in (POWER, _SCRIPTED, _KEY)))
"""What is written otherwise than letter by letter."""

LONG_WORD = 16
"""Letters from which on a word without a hyphen may be broken, after every `EVERY`."""
EVERY = 8
BREAK = r"\allowbreak{}"


def latex_text(text: str, keys: Collection[str] = (), breaks: bool = False) -> str:
    """Return *text* so that LaTeX prints it: one line, no commands of its own, powers of ten as such.

    Parameters
    ----------
    keys
        Of the bibliography beside the tables: ``[KEY]`` of one of them becomes a citation.
    breaks
        Whether long names may be broken over lines, after ``_ / . , =`` and within.
    """
    plain = " ".join(text.split())
    written = "".join(_pieces(plain, frozenset(keys), breaks))
    return f"{{}}{written}" if written[:1] in ("[", "*") else written  # after a line break they would be an option


def _pieces(plain: str, keys: Collection[str], breaks: bool) -> Iterator[str]:
    start = 0
    for match in _WRITTEN.finditer(plain):
        power, scripted, key = (one.fullmatch(match[0]) for one in (POWER, _SCRIPTED, _KEY))
        if key and key[1] not in keys:
            continue
        yield _escape(plain[start : match.start()], breaks)
        if key:
            yield f"\\cite{{{key[1]}}}"
        elif power:
            yield f"${power[1]}\\times10^{{{int(power[2])}}}$"
        elif scripted:
            below = f"\\mathrm{{{scripted[1]}}}" if scripted[1] else scripted[2]
            yield f"$\\tau_{{{below}}}$"
        start = match.end()
    yield _escape(plain[start:], breaks)


def _escape(text: str, breaks: bool) -> str:
    if not breaks:
        return _SIGN.sub(lambda match: _SPECIAL[match[0]], text)
    return " ".join(BREAK.join(_escape(part, False) for part in parts_of(word)) for word in text.split(" "))


def parts_of(word: str) -> list[str]:
    """Cut a word where a line may end: after ``_ / , =``, and in long stretches of letters and digits."""
    parts = [part for part in re.split(r"(?<=[_/,=])", word) if part]
    found = []
    for part in parts:
        whole = len(part) <= LONG_WORD or "-" in part[1:-1]
        found += [part] if whole else [part[i : i + EVERY] for i in range(0, len(part), EVERY)]
    return found or [""]
