"""Equations as the repository writes them, ``tau = J^T P + m5 k5^2 qdd1/2``, as TeX for the site.

The pages keep plain text, which a terminal shows too. What this cannot read with certainty stays a block of text:
nothing is guessed. The notation is that of docs/notation.md: ``qd2`` is a rate of the coordinate q2, ``dx`` a small
displacement, ``a1_left`` a length with an index, ``u.w`` and ``u x w`` products of vectors, ``[[a, b], [c, d]]`` a
matrix, ``iu`` the imaginary unit times u.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

GREEK = (
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "lambda", "mu", "nu", "xi", "pi",
    "rho", "sigma", "tau", "phi", "chi", "psi", "omega", "Gamma", "Delta", "Theta", "Lambda", "Xi", "Pi", "Sigma",
    "Phi", "Psi", "Omega",
)  # fmt: skip
FUNCTIONS = {
    "cos": r"\cos", "sin": r"\sin", "tan": r"\tan", "acos": r"\arccos", "asin": r"\arcsin", "exp": r"\exp",
    "log": r"\log", "det": r"\det", "max": r"\max", "min": r"\min", "integral": r"\int", "sum": r"\sum",
} | {name: rf"\operatorname{{{name}}}" for name in ("atan2", "sign", "rank", "pinv", "diag", "Re", "conj")}  # fmt: skip
OVER_ALL = (r"\int", r"\sum")
"""What stands before a fraction and not in it."""

MOVES = (*"qxyzrhtslpuvwgnCDPEF", *GREEK)
"""What ``d`` and ``dd`` behind it make a rate; behind others, ``md``, it is an index."""

SIGNS = {
    "+-": r"\pm", "-+": r"\mp", "<=": r"\le", ">=": r"\ge", "=:": r"=\!:", ":=": r":\!=", "->": r"\to", "~": r"\approx",
    "+": "+", "-": "-", "=": "=", "<": "<", ">": ">", ",": ",", ";": ";", ":": ":",
}  # fmt: skip
WORDS = ("as", "of", "on", "at", "is", "if", "to", "or", "by", "in", "no", "an", "we", "it", "for")
"""Short words that are no product of two letters."""

TOKEN = re.compile(
    r"(?P<gap> *)(?:(?P<size>\d+x\d+)|(?P<number>\d+(?:\.\d+)?(?:e-?\d+)?)|(?P<name>[A-Za-z]+\d*'*(?:_[A-Za-z0-9]+)*'*)"
    r"|(?P<sign>\+-|-\+|<=|>=|=:|:=|->|[-+*/^=<>,;:.~()\[\]{}|]))"
)
WORD = re.compile(r"^\{*\\text\{")
RELATION = re.compile(r"(?<= )(?:=(?:\\!:)?|:\\!=|<|>|\\le|\\ge|\\approx)(?= )")
WIDE = 3
"""So many blanks between two parts of a line keep them apart."""


class UnreadableError(Exception):
    """No equation that can be read with certainty."""


@dataclass(frozen=True)
class Token:
    """A piece of a line, and the blanks before it."""

    kind: str
    text: str
    gap: int


def equations(block: str) -> str:
    """TeX of a block, one row for each equation, aligned at its first relation.

    Raises
    ------
    UnreadableError
        Something in it cannot be read with certainty.
    """
    rows = [Reader(line).tex() for line in _whole_lines(block)]
    if not any(RELATION.search(row) or re.search(r"\\frac|\\int|\^", row) for row in rows):
        raise UnreadableError("no relation")
    if len(rows) == 1:
        return rows[0]
    aligned = [RELATION.sub(r" &\g<0>", row, count=1).replace("  &", " &") for row in rows]
    aligned = [
        row if "&" in re.sub(r"\\begin\{bmatrix\}.*?\\end\{bmatrix\}", "", row) else rf"&\quad {row}" for row in aligned
    ]
    return "\\begin{aligned}\n" + " \\\\\n".join(aligned) + "\n\\end{aligned}"


def _whole_lines(block: str) -> list[str]:
    """Lines of a block; those that a bracket holds together are one."""
    lines: list[str] = []
    for line in block.splitlines():
        if not line.strip():
            continue
        if lines and _depth(lines[-1]) > 0:
            lines[-1] += " " + line.strip()
        else:
            lines.append(line.strip())
    return lines


def _depth(text: str) -> int:
    return sum(text.count(sign) for sign in "([{") - sum(text.count(sign) for sign in ")]}")


class Reader:
    """Reads a line from left to right; *parts* of the open group are TeX, with the text of the sign where it is one."""

    def __init__(self, line: str) -> None:
        self.tokens = _tokens(line)
        self.at = 0

    def tex(self) -> str:
        """TeX of the whole line."""
        text = self.group("")
        if self.at < len(self.tokens):
            raise UnreadableError(f"{self.tokens[self.at].text} closes nothing")
        return text

    @property
    def next(self) -> Token | None:
        """The token that is read next; None at the end."""
        return self.tokens[self.at] if self.at < len(self.tokens) else None

    def take(self) -> Token:
        """Go past the next token and give it."""
        if self.next is None:
            raise UnreadableError("ends too early")
        self.at += 1
        return self.tokens[self.at - 1]

    def group(self, closing: str) -> str:
        """TeX up to the *closing* sign, which is taken; up to the end of the line where that is empty."""
        parts: list[tuple[str, str]] = []  # TeX, and the sign that it is or ""
        while (token := self.next) is not None and token.text != closing:
            if token.text in (")", "]", "}"):
                raise UnreadableError(f"{token.text} closes nothing")
            if token.gap >= WIDE and parts and not closing:
                parts.append((r"\qquad", ","))
            if token.text == "/":
                self._fraction(parts)
            elif token.text == "." and self._is_product(parts):
                self.take()
                parts.append((r"\cdot", ""))
            elif token.kind == "sign" and token.text in SIGNS:
                self.take()
                parts.append((SIGNS[token.text], token.text))
            elif token.text == "x" and self._is_cross(parts):
                self.take()
                parts.append((r"\times", ""))
            elif token.text == ".":
                self.take()
                parts.append((".", ","))
            else:
                parts.append((self.factor(), ""))
        if closing:
            self.take()
        return _joined(parts)

    def _is_product(self, parts: list[tuple[str, str]]) -> bool:
        after = self.tokens[self.at + 1] if self.at + 1 < len(self.tokens) else None
        return bool(parts) and not parts[-1][1] and after is not None and after.text not in SIGNS and after.gap < WIDE

    def _is_cross(self, parts: list[tuple[str, str]]) -> bool:
        """Whether this x stands between two vectors: blanks on both sides, a factor before and behind."""
        after = self.tokens[self.at + 1] if self.at + 1 < len(self.tokens) else None
        before = bool(parts) and not parts[-1][1] and parts[-1][0] != r"\cdot"
        here = self.tokens[self.at]
        return (
            before
            and here.gap == 1
            and after is not None
            and after.gap == 1
            and (after.kind == "name" or after.text == "(")
        )

    def _fraction(self, parts: list[tuple[str, str]]) -> None:
        """``a b / c`` has the product above the line, ``a b/c`` the last factor."""
        sign = self.take()
        start = len(parts)
        while start and not parts[start - 1][1] and (sign.gap or start == len(parts)):
            if parts[start - 1][0] in OVER_ALL:
                break
            start -= 1
        above = parts[start:]
        if not above:
            raise UnreadableError("nothing above a fraction's line")
        below = self.factor()
        if below in FUNCTIONS.values():  # of one argument, as in ``1 / cos b``
            below += f" {self.factor()}"
        if self._goes_on(sign):
            raise UnreadableError("a product behind a fraction")
        numerator = _bare(above[0][0]) if len(above) == 1 else _joined(above)
        parts[start:] = [(rf"\frac{{{numerator}}}{{{_bare(below)}}}", "")]

    def _goes_on(self, sign: Token) -> bool:
        """Whether what stands behind a denominator may belong to it: ``a / b c``, ``a/b.c``."""
        after = self.next
        if after is None or after.gap >= WIDE or (after.text == "." and self.at + 1 == len(self.tokens)):
            return False
        if not sign.gap:
            return after.text == "." and not after.gap
        return after.kind != "sign" or after.text in ("(", "[", ".", "/")

    def factor(self) -> str:
        """TeX of a number, a name, a group in brackets or a function, with what stands at its top right."""
        token = self.take()
        if token.kind == "number":
            text = _number(token.text)
        elif token.kind == "size":
            text = token.text.replace("x", r" \times ")
        elif token.kind == "name":
            text = self._named(token.text)
        elif token.text == "(":
            text = self._star() or _bracketed("(", self.group(")"), ")")
        elif token.text == "[":
            rows = self.next is not None and self.next.text == "["
            text = self._matrix() if rows else _bracketed("[", self.group("]"), "]")
        elif token.text == "{":
            text = _bracketed(r"\{", self.group("}"), r"\}")
        elif token.text == "|":
            text = _bracketed(r"\lvert", self.group("|"), r"\rvert")
        else:
            raise UnreadableError(f"no factor begins with {token.text}")
        while self.next is not None and self.next.text == "^":
            self.take()
            text = rf"{{{text}}}^{{{self._exponent()}}}"
        return text

    def _star(self) -> str:
        """``(*)``, the mark of an equation."""
        if [token.text for token in self.tokens[self.at : self.at + 2]] == ["*", ")"]:
            self.at += 2
            return r"(\ast)"
        return ""

    def _exponent(self) -> str:
        sign = "-" if self.next is not None and self.next.text == "-" and self.take() else ""
        token = self.next
        if token is not None and token.text == "T":
            self.take()
            return rf"{sign}\top"
        return sign + _bare(self.factor())

    def _named(self, name: str) -> str:
        opens = self.next is not None and self.next.text == "(" and self.next.gap == 0
        if name == "sqrt" and opens:
            self.take()
            return rf"\sqrt{{{self.group(')')}}}"
        return FUNCTIONS.get(name) or _name(name)

    def _matrix(self) -> str:
        rows = []
        while True:
            if self.take().text != "[":
                raise UnreadableError("a matrix has rows in brackets")
            rows.append(self._row())
            sign = self.take().text
            if sign == "]":
                return "\\begin{bmatrix} " + r" \\ ".join(rows) + " \\end{bmatrix}"
            if sign != ",":
                raise UnreadableError("rows of a matrix are parted by commas")

    def _row(self) -> str:
        cells, depth = [], 0
        text = self.group("]")
        cell = ""
        for part in text.split(" "):
            depth += _opened(part)
            if part == "," and not depth:
                cells.append(cell)
                cell = ""
            else:
                cell += f" {part}"
        return " & ".join(one.strip() for one in [*cells, cell])


def _tokens(line: str) -> list[Token]:
    found, at = [], 0
    while at < len(line.rstrip()):
        match = TOKEN.match(line, at)
        if not match:
            raise UnreadableError(f"{line[at:].strip()[:1]} has no meaning")
        kind = str(match.lastgroup)
        found.append(Token(kind, match[kind], len(match["gap"])))
        at = match.end()
    return found


def _joined(parts: list[tuple[str, str]]) -> str:
    """TeX of parts in a row, words apart from their neighbours."""
    text = ""
    for number, (tex, sign) in enumerate(parts):
        before, its_sign = parts[number - 1] if number else ("", ",")
        argument = number > 1 and parts[number - 2][0] in FUNCTIONS.values()
        apart = ""
        if not sign and not its_sign:
            if WORD.match(tex) or WORD.match(before):
                apart = r"\; "
            elif (
                argument
                or tex in FUNCTIONS.values()
                or (before in FUNCTIONS.values() and not re.match(r"(\\left)?\(", tex))
            ):
                apart = r"\, "
        text += f"{' ' if text else ''}{apart}{tex}"
    return text


def _bracketed(opening: str, inner: str, closing: str) -> str:
    """A group; its brackets grow where something in it is tall."""
    tall = any(sign in inner for sign in (r"\frac", r"\sqrt", r"\begin", r"\int", r"\sum"))
    return rf"\left{opening} {inner} \right{closing}" if tall else f"{opening} {inner} {closing}"


def _opened(part: str) -> int:
    """How many round brackets a piece of TeX opens and does not close."""
    return part.count("(") - part.count(")")


def _bare(text: str) -> str:
    """TeX without the round brackets around all of it, where a line or a place says the same."""
    begins = re.match(r"(?:\\left)?\( ", text)
    ends = re.search(r" (?:\\right)?\)$", text)
    if not begins or not ends:
        return text
    depth = 0
    for part in text.split(" ")[:-1]:
        depth += _opened(part)
        if depth == 0:
            return text
    return text[begins.end() : ends.start()]


def _number(text: str) -> str:
    mantissa, e, exponent = text.partition("e")
    return rf"{mantissa} \cdot 10^{{{exponent}}}" if e else text


def _name(name: str) -> str:
    """``qdd2`` -> two dots over q, index 2; ``a1_left``; ``dx_E``; ``Px``; longer names upright, as words are."""
    primes = name.count("'")
    stem, *indices = name.replace("'", "").split("_")
    letters = stem.rstrip("0123456789")
    digits = stem[len(letters) :]
    text, index = _letters(letters)
    if not text:
        return r"\text{" + name.rstrip("'") + "}" + "'" * primes
    below = [part for part in (index, digits, *map(_index, indices)) if part]
    return text + (f"_{{{','.join(below)}}}" if below else "") + "'" * primes


def _letters(letters: str) -> tuple[str, str]:
    """TeX of the letters of a name, and the index that they hold; nothing for a word."""
    if len(letters) == 1:
        return letters, ""
    if letters in GREEK:
        return rf"\{letters}", ""
    for suffix, accent in (("dd", "ddot"), ("d", "dot")):
        base = letters.removesuffix(suffix)
        if letters.endswith(suffix) and base in MOVES:
            return rf"\{accent}{{{_letters(base)[0]}}}", ""
    base = letters.removeprefix("d")
    if letters.startswith("d") and (len(base) == 1 or base in GREEK):
        return rf"\mathrm{{d}}{_letters(base)[0]}" if len(base) == 1 else rf"\mathrm{{d}}\{base}", ""
    if len(letters) == 2 and letters[0] == "i" and letters not in WORDS:
        return rf"i {letters[1]}", ""
    if len(letters) == 2 and letters not in WORDS:
        return letters[0], letters[1]
    return "", ""


def _index(index: str) -> str:
    return index if len(index) <= 2 else rf"\mathrm{{{index}}}"
