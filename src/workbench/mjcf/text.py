"""Edit single numbers in an MJCF text and leave every other byte alone: comments, layout, units, precision.

MuJoCo's own writer drops comments and rounds to six digits, so it is not a way to edit a user's file. Here expat says
where each element starts, and only the tokens of the attributes that have to change are replaced.
"""

from __future__ import annotations

import re
import xml.parsers.expat as expat
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import NamedTuple

from workbench.errors import ModelError
from workbench.mjcf.safety import not_finite, refuse_element

TAG = re.compile(r"""<[^\s/>]+(?:\s+[^\s=/>]+\s*=\s*(?:"[^"]*"|'[^']*'))*\s*/?>""")
ATTRIBUTE = re.compile(r"""([^\s=<>/]+)\s*=\s*(?:"([^"]*)"|'([^']*)')""")
TOKEN = re.compile(r"\S+")
SUSPECT = ("nan", "inf")

SECTIONS = {"option": "option"}
"""Section in which an element that carries parameters stands; ``worldbody`` where not said. Other sections use some of
the same tags for other things: ``joint`` in ``equality``, ``site`` in ``tendon``."""

PLAIN_DIGITS = 17
"""Significant digits that every double fits into; a longer token holds more than the double (`precise`)."""


class Element(NamedTuple):
    """One start tag: its name, the body that holds it, the section it stands in, and where its text lies."""

    tag: str
    name: str
    body: str
    section: str
    start: int
    end: int
    line: int
    close: int = -1
    """where its end tag begins; `end` for a tag that closes itself"""
    stop: int = -1
    """where the element ends"""


@dataclass(frozen=True)
class Edit:
    """One number to be written: ``attribute[index]`` of an element."""

    tag: str
    name: str
    attribute: str
    index: int
    value: float
    token: str = ""
    """its text, where the shortest one does not do"""
    optional: bool = False
    """True: passed over where the file does not write it"""


class Elements(list[Element]):
    """What `scan` found, in the order of the text; not to be changed."""

    @cached_property
    def places(self) -> dict[tuple[str, str, str], Element]:
        """The first element of each tag, section and name (`_called`)."""
        found: dict[tuple[str, str, str], Element] = {}
        for element in self:
            found.setdefault((element.tag, element.section, _called(element)), element)
        return found


def scan(text: str, file: str, included: bool = False) -> Elements:
    """List the start tags of an MJCF text; of one that is *included*, the root may have any name.

    Raises
    ------
    ModelError
        Not well-formed, a document type (entity bombs), a number that is not finite, or anything that
        `workbench.mjcf.safety` refuses.
    """
    raw = text.encode()
    found: list[tuple[str, str, str, str, int, int]] = []
    ends: dict[int, int] = {}
    bodies: list[str] = []
    path: list[tuple[str, int]] = []
    names: set[str] = set()
    suspects: list[tuple[str, str, str, int]] = []
    lower = text.lower()
    suspicious = any(word in lower for word in SUSPECT)
    parser = expat.ParserCreate("utf-8")

    def begin(tag: str, attributes: dict[str, str]) -> None:
        line = parser.CurrentLineNumber
        refuse_element("mujoco" if included and not path else tag, attributes, len(path), len(found), f"{file}:{line}")
        name = attributes.get("name", "")
        path.append((tag, len(found)))
        if tag == "body":
            bodies.append(name)
        if suspicious:
            names.update(attributes.get(key, "") for key in ("name", "class"))
            value = not_finite(attributes)
            if value:
                suspects.append((tag, *value, line))
        section = path[1][0] if len(path) > 1 else ""
        found.append((tag, name, bodies[-1] if bodies else "", section, parser.CurrentByteIndex, line))

    def finish(tag: str) -> None:
        ends[path.pop()[1]] = parser.CurrentByteIndex
        if tag == "body":
            bodies.pop()

    def refuse_doctype(*_: object) -> None:
        line = parser.CurrentLineNumber
        raise ModelError(f"{file}:{line}: a document type declaration is not allowed in a model", file=file)

    parser.StartElementHandler = begin
    parser.EndElementHandler = finish
    parser.StartDoctypeDeclHandler = refuse_doctype
    try:
        parser.Parse(raw, True)
    except expat.ExpatError as error:
        message = expat.errors.messages[error.code]
        raise ModelError(f"{file}:{error.lineno}: not well-formed XML: {message}", file=file) from error
    for tag, key, value, line in suspects:
        if value not in names:  # "inf" may be the name of a material
            raise ModelError(f'{file}:{line}: <{tag} {key}="{value}"> is not finite', file=file, attribute=key)
    return _located(text, raw, found, ends, file)


def _located(
    text: str, raw: bytes, found: list[tuple[str, str, str, str, int, int]], ends: dict[int, int], file: str
) -> Elements:
    """Turn byte offsets into places in the text."""
    at = _places(text, raw, sorted({offset for *_, offset, _ in found} | set(ends.values())))
    elements = Elements()
    for number, (tag, name, body, section, offset, line) in enumerate(found):
        start, close = at(offset), at(ends[number])
        match = TAG.match(text, start)
        if match is None:  # expat accepted it, so this is a form of tag that no MJCF uses
            raise ModelError(f"{file}:{line}: cannot read the tag <{tag}>", file=file)
        end = match.end()
        close, stop = (end, end) if text[end - 2] == "/" else (close, text.index(">", close) + 1)
        elements.append(Element(tag, name, body, section, start, end, line, close, stop))
    return elements


def _places(text: str, raw: bytes, offsets: list[int]) -> Callable[[int], int]:
    """Places in the text of sorted byte offsets."""
    if len(text) == len(raw):
        return int
    places, place, before = {}, 0, 0
    for offset in offsets:
        place += len(raw[before:offset].decode())
        before = offset
        places[offset] = place
    return places.__getitem__


def find(elements: list[Element], tag: str, name: str) -> Element | None:
    """Return the element ``<tag name="...">``; an ``inertial`` is named by its body, an ``option`` by nothing.

    Of several ``option`` elements the last one counts, as in MuJoCo. A geom may be named by the body whose only geom it
    is.
    """
    section = SECTIONS.get(tag, "worldbody")
    if isinstance(elements, Elements) and tag != "option":
        known = elements.places.get((tag, section, name))
        return known or (_only_geom(elements, name) if tag == "geom" and name else None)
    for element in reversed(elements) if tag == "option" else elements:
        if element.tag == tag and element.section == section and _called(element) == name:
            return element
    return _only_geom(elements, name) if tag == "geom" and name else None


def _only_geom(elements: list[Element], body: str) -> Element | None:
    geoms = [e for e in elements if e.tag == "geom" and e.section == "worldbody" and e.body == body]
    return geoms[0] if len(geoms) == 1 else None


def written(text: str, elements: list[Element], tag: str, name: str, attribute: str) -> tuple[Element, str] | None:
    """Where an attribute stands: its element, and the attribute's name there; None where the file does not write it.

    Without an ``<inertial>`` a body's mass is that of its only geom; its inertia may be written as ``fullinertia``.
    """
    found = _written(text, elements, tag, name, attribute)
    return found[:2] if found else None


def numbers_written(text: str, elements: list[Element], tag: str, name: str, attribute: str) -> int:
    """How many numbers stand where `written` finds an attribute; 0 where it finds none."""
    found = _written(text, elements, tag, name, attribute)
    return len(text[slice(*found[2])].split()) if found else 0


def _written(
    text: str, elements: list[Element], tag: str, name: str, attribute: str
) -> tuple[Element, str, tuple[int, int]] | None:
    element = find(elements, tag, name)
    if element is None and (tag, attribute) == ("inertial", "mass"):
        element = _only_geom(elements, name)
    if element is None:
        return None
    for spelt in (attribute, *(["fullinertia"] if attribute == "diaginertia" else [])):
        span = attribute_span(text, element, spelt)
        if span is not None:
            return element, spelt, span
    return None


def find_any(elements: list[Element], tag: str, name: str) -> Element | None:
    """Return the first element of that tag and name, in whatever section, for messages."""
    return next((e for e in elements if e.tag == tag and _called(e) == name), None)


def _called(element: Element) -> str:
    return element.body if element.tag == "inertial" else element.name


def attribute_span(text: str, element: Element, attribute: str) -> tuple[int, int] | None:
    """Where the value of an attribute lies in the text, without its quotes; None where it is missing."""
    if text.find(attribute, element.start, element.end) < 0:
        return None
    for match in ATTRIBUTE.finditer(text, element.start, element.end):
        if match.group(1) == attribute:
            return match.span(2 if match.group(2) is not None else 3)
    return None


def tokens(text: str, element: Element, attribute: str) -> list[tuple[int, int, str]]:
    """The numbers of an attribute as they are written: start, end, token. Empty where it is missing."""
    span = attribute_span(text, element, attribute)
    if span is None:
        return []
    return [(m.start(), m.end(), m.group()) for m in TOKEN.finditer(text, *span)]


def replace_numbers(text: str, file: str, changes: list[Edit], elements: list[Element] | None = None) -> str:
    """Replace numbers in attributes; a number that already has its value keeps its digits.

    Parameters
    ----------
    text, file
        The MJCF and the name under which errors speak of it.
    changes
        What to write. Values are written so that they read back bit-equal.
    elements
        What `scan` found in *text*, where it is known already.

    Raises
    ------
    ModelError
        An element or attribute that is missing, or has too few numbers.
    """
    return numbers_replaced(text, file, changes, scan(text, file) if elements is None else elements)[0]


def numbers_replaced(text: str, file: str, changes: list[Edit], elements: list[Element]) -> tuple[str, Elements]:
    """`replace_numbers`, and what `scan` finds in the new text.

    Only numbers change, so tags, names and lines are those of *elements*, moved along.
    """
    edits: dict[tuple[int, int], str] = {}
    for change in changes:
        place = written(text, elements, change.tag, change.name, change.attribute)
        found = tokens(text, *place) if place else []
        if change.index >= len(found):
            if change.optional:
                continue
            raise _not_written(text, file, change, elements, bool(found))
        start, end, old = found[change.index]
        if "&" in old:
            assert place is not None
            raise ModelError(
                f"{file}:{place[0].line}: {element_label(change.tag, change.name)}: attribute {change.attribute} holds"
                f" the character reference {old}; write plain digits to make it editable",
                file=file,
            )
        if change.token or not _holds(old, change.value):
            edits[start, end] = change.token or number(change.value)
    ordered = sorted(edits.items())
    pieces, last = [], 0
    for (start, end), token in ordered:
        pieces += [text[last:start], token]
        last = end
    return "".join([*pieces, text[last:]]), _moved(elements, ordered)


def _moved(elements: list[Element], edits: list[tuple[tuple[int, int], str]]) -> Elements:
    """Elements of a text in which tokens, which lie inside of tags, are replaced by others."""
    ends = [end for (_, end), _ in edits]
    shifts = [0, *accumulate(len(token) - (end - start) for (start, end), token in edits)]

    def at(place: int) -> int:
        return place + shifts[bisect_right(ends, place)] if place >= 0 else place

    return Elements(
        Element(e.tag, e.name, e.body, e.section, at(e.start), at(e.end), e.line, at(e.close), at(e.stop))
        for e in elements
    )


def _not_written(text: str, file: str, change: Edit, elements: list[Element], some: bool) -> ModelError:
    label = element_label(change.tag, change.name)
    element = find(elements, change.tag, change.name)
    facts = {"file": file, "element": change.name, "attribute": change.attribute}
    if element is None:
        way = ""
        if change.tag == "inertial" and find_any(elements, "body", change.name):
            way = "; MuJoCo computes it from the geoms: write an <inertial> to make it editable"
        return ModelError(f"{file}: {label} is missing{way}", **facts)
    wrong = f"lacks number {change.index + 1}" if some else "is not written"
    return ModelError(
        f"{file}:{element.line}: {label}: {change.attribute} {wrong}; write it out to make it editable", **facts
    )


def _holds(token: str, value: float) -> bool:
    try:
        return float(token) == value and significant_digits(token) <= PLAIN_DIGITS
    except ValueError:
        return False


def element_label(tag: str, name: str) -> str:
    """How messages speak of an element."""
    if tag == "inertial":
        return f'<inertial> of body "{name}"'
    return f'<{tag} name="{name}">' if name else f"<{tag}>"


def significant_digits(token: str) -> int:
    """Number of digits of a decimal number from its first one that is not zero."""
    mantissa = re.split("[eE]", token.lstrip("+-"))[0].replace(".", "")
    return len(mantissa.lstrip("0"))


def number(value: float) -> str:
    """Return the shortest text that reads back bit-equal (zero without a sign)."""
    if value == 0:
        return "0"
    return f"{value:.0f}" if value == int(value) and abs(value) < 1e15 else repr(value)


def attributes_of(text: str, element: Element) -> dict[str, str]:
    """The attributes of a start tag, character references resolved."""
    found: dict[str, str] = {}
    parser = expat.ParserCreate("utf-8")
    parser.StartElementHandler = lambda tag, attributes: found.update(attributes)
    tag = text[element.start : element.end]
    parser.Parse((tag if tag.endswith("/>") else f"{tag[:-1]}/>").encode(), True)
    return found
