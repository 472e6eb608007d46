"""Edit single numbers in an MJCF text and leave every other byte alone: comments, layout, units, precision.

MuJoCo's own writer drops comments and rounds to six digits, so it is not a way to edit a user's file. Here expat says
where each element starts, and only the tokens of the attributes that have to change are replaced.
"""

from __future__ import annotations

import re
import xml.parsers.expat as expat
from dataclasses import dataclass

from workbench.errors import ModelError

TAG = re.compile(r"""<[^\s/>]+(?:\s+[^\s=/>]+\s*=\s*(?:"[^"]*"|'[^']*'))*\s*/?>""")
ATTRIBUTE = re.compile(r"""([^\s=<>/]+)\s*=\s*(?:"([^"]*)"|'([^']*)')""")
OUTSIDE = ("file", "fileright", "fileup", "fileleft", "filedown", "filefront", "fileback", "assetdir", "meshdir",
           "texturedir")  # fmt: skip
"""attributes that make MuJoCo open another file"""


@dataclass(frozen=True)
class Element:
    """One start tag: its name, the body that holds it, and where its text lies."""

    tag: str
    name: str
    body: str
    start: int
    end: int
    line: int


def scan(text: str, file: str) -> list[Element]:
    """List the start tags of an MJCF text.

    Raises
    ------
    ModelError
        Not well-formed, a document type (entity bombs), or a reference to another file.
    """
    raw = text.encode()
    starts: list[tuple[str, int, int, str]] = []
    bodies: list[str] = []
    parser = expat.ParserCreate("utf-8")

    def begin(tag: str, attributes: dict[str, str]) -> None:
        line = parser.CurrentLineNumber
        if tag == "include":
            raise ModelError(f"{file}:{line}: <include> reads another file; put the whole model in one file", file=file)
        for key in attributes:
            if key in OUTSIDE:
                raise ModelError(f'{file}:{line}: <{tag} {key}="{attributes[key]}"> reads another file', file=file)
        if tag == "body":
            bodies.append(attributes.get("name", ""))
        starts.append((tag, parser.CurrentByteIndex, line, bodies[-1] if bodies else ""))

    def finish(tag: str) -> None:
        if tag == "body":
            bodies.pop()

    def refuse_doctype(*_: object) -> None:
        raise ModelError(f"{file}: a document type declaration is not allowed in a model", file=file)

    parser.StartElementHandler = begin
    parser.EndElementHandler = finish
    parser.StartDoctypeDeclHandler = refuse_doctype
    try:
        parser.Parse(raw, True)
    except expat.ExpatError as error:
        message = expat.errors.messages[error.code]
        raise ModelError(f"{file}:{error.lineno}: not well-formed XML: {message}", file=file) from error
    elements = []
    for tag, offset, line, body in starts:
        start = len(raw[:offset].decode())
        match = TAG.match(text, start)
        if match is None:  # expat accepted it, so this is a form of tag that no MJCF uses
            raise ModelError(f"{file}:{line}: cannot read the tag <{tag}>", file=file)
        name = dict(_attributes(match.group())).get("name", "")
        elements.append(Element(tag, name, body, start, match.end(), line))
    return elements


def _attributes(tag_text: str) -> list[tuple[str, str]]:
    return [(m.group(1), m.group(2) if m.group(2) is not None else m.group(3)) for m in ATTRIBUTE.finditer(tag_text)]


def find(elements: list[Element], tag: str, name: str) -> Element | None:
    """Return the element ``<tag name="...">``; an ``inertial`` is named by its body, an ``option`` by nothing."""
    for element in elements:
        if element.tag == tag and (element.body if tag == "inertial" else element.name) == name:
            return element
    return None


def replace_numbers(text: str, file: str, changes: list[tuple[str, str, str, int, float]]) -> str:
    """Replace numbers in attributes.

    Parameters
    ----------
    text, file
        The MJCF and the name under which errors speak of it.
    changes
        ``(tag, element name, attribute, index, value)``; a geom that is not there is passed over, since geoms are for
        the eye only. Values are written so that they read back bit-equal.

    Raises
    ------
    ModelError
        An element or attribute that is missing, or has too few numbers.
    """
    elements = scan(text, file)
    edits: list[tuple[int, int, str]] = []
    for tag, name, attribute, index, value in changes:
        element = find(elements, tag, name)
        label = f'<{tag} name="{name}">' if tag != "inertial" else f'<inertial> of body "{name}"'
        if element is None:
            if tag == "geom":
                continue
            raise ModelError(f"{file}: {label} is missing", file=file, element=name)
        for match in ATTRIBUTE.finditer(text, element.start, element.end):
            if match.group(1) == attribute:
                group = 2 if match.group(2) is not None else 3
                tokens = list(re.finditer(r"\S+", match.group(group)))
                break
        else:
            if tag == "geom":
                continue
            raise ModelError(f"{file}:{element.line}: {label} has no attribute {attribute}", file=file, element=name)
        if index >= len(tokens):
            raise ModelError(
                f"{file}:{element.line}: {label} {attribute} has {len(tokens)} number(s), number {index + 1} is needed",
                file=file,
                element=name,
            )
        offset = match.start(group)
        edits.append((offset + tokens[index].start(), offset + tokens[index].end(), number(value)))
    for start, end, token in sorted(edits, reverse=True):
        text = text[:start] + token + text[end:]
    return text


def number(value: float) -> str:
    """Return the shortest text that reads back bit-equal."""
    return f"{value:.0f}" if value == int(value) and abs(value) < 1e15 else repr(value)
