"""An MJCF with everything that it reads: includes put in their places, meshes and pictures as bytes.

The files are read here, each checked to lie below the model's folder, and MuJoCo is handed contents only, under names
that no disk holds. Whatever an included file brings stands on the line of its ``<include>``, so that line numbers stay
those of the user's file.

A mesh or picture that is not read is no error by itself: it matters where a mass comes from it, and then the body is
refused (`workbench.mjcf.assets`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from workbench.errors import ModelError
from workbench.mjcf.files import MAX_ASSETS, UnreadableError, below, read_asset, read_text
from workbench.mjcf.safety import MAX_ELEMENTS, number_in
from workbench.mjcf.text import Element, attribute_span, attributes_of, scan

ASSETS = ("mesh", "texture", "hfield")
DEEPEST = 20
"""files inside files"""


@dataclass(frozen=True)
class Missing:
    """A file that a model names and that is not read."""

    file: str
    """the model's own name and the line, ``file:line``"""
    tag: str
    name: str
    """as it is written"""
    reason: str


@dataclass(frozen=True)
class Source:
    """A model as it is handed to MuJoCo: no name of a file of this disk is left in it."""

    file: str
    text: str
    """includes put in; as many lines as the user's file"""
    models: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    """models from which ``<attach>`` takes"""
    assets: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    missing: Mapping[str, Missing] = field(default_factory=dict)
    files: tuple[Path, ...] = ()
    """what was read beside the model itself"""


def read_source(text: str, file: str, folder: Path | None, elements: list[Element] | None = None) -> Source:
    """Put together what a model reads.

    Parameters
    ----------
    text, file
        The MJCF and the name under which errors speak of it.
    folder
        The directory of the model; nothing outside is read. None: nothing is read at all.
    elements
        What `workbench.mjcf.text.scan` found in *text*, where it is known already.

    Raises
    ------
    ModelError
        Not safe (`workbench.mjcf.safety`); an include or a model that cannot be read, with its line; more elements than
        allowed, counted with all copies.
    """
    reader = _Reader(folder)
    flat = reader.document(text, file, folder or Path(), (), elements)
    return Source(
        file,
        flat,
        reader.models,
        reader.assets,
        reader.missing,
        tuple(reader.files),
    )


class _Reader:
    def __init__(self, folder: Path | None) -> None:
        self.root = folder
        self.models: dict[str, bytes] = {}
        self.sizes: dict[str, int] = {}
        """of a model by its key: elements with all copies"""
        self.assets: dict[str, bytes] = {}
        self.missing: dict[str, Missing] = {}
        self.files: list[Path] = []
        self.keys: dict[Path, str] = {}
        self.elements = 0

    def document(
        self, text: str, file: str, folder: Path, stack: tuple[Path, ...], elements: list[Element] | None = None
    ) -> str:
        """A whole model, also one that another attaches from: includes put in, names of files replaced."""
        if len(stack) > DEEPEST:
            raise ModelError(f"{file}: models inside models, deeper than {DEEPEST}", file=file)
        elements = scan(text, file) if elements is None else elements
        if any(element.tag == "include" for element in elements):
            text = self._expanded(text, elements, file, folder, folder, stack, set())
            elements = scan(text, file)
        return self._named(text, elements, file, folder, stack)

    def _expanded(
        self,
        text: str,
        elements: list[Element],
        file: str,
        folder: Path,
        own: Path,
        stack: tuple[Path, ...],
        included: set[Path],
    ) -> str:
        """Put in what ``<include>`` names: as MuJoCo does, seen from the main model's folder, else from the file's."""
        pieces, last = [], 0
        for element in elements:
            if element.tag != "include" or element.start < last:
                continue
            where, name = f"{file}:{element.line}", attributes_of(text, element).get("file", "")
            try:
                path = self._path(folder, own, name)
                inner = read_text(path)
            except (UnreadableError, ModelError) as error:
                raise ModelError(f'{where}: <include file="{name}">: {error}', file=file) from error
            if path in included or path in stack:
                raise ModelError(f'{where}: <include file="{name}">: is included already', file=file)
            if len(stack) > DEEPEST:
                raise ModelError(f"{where}: files inside files, deeper than {DEEPEST}", file=file)
            included.add(path)
            self.files.append(path)
            found = scan(inner, str(path), included=True)
            self._count(len(found), where)
            if any(other.tag == "include" for other in found):
                inner = self._expanded(inner, found, str(path), folder, path.parent, (*stack, path), included)
                found = scan(inner, str(path), included=True)
            content = inner[found[0].end : found[0].close]
            pieces += [text[last : element.start], " ".join(content.splitlines())]
            last = element.stop
        return "".join([*pieces, text[last:]])

    def _path(self, folder: Path, own: Path, name: str) -> Path:
        if self.root is None:
            raise UnreadableError("this text lies in no folder, so nothing is read beside it")
        if not name:
            raise UnreadableError("no file is named")
        try:
            return below(self.root, folder, name)
        except UnreadableError:
            if own == folder:
                raise
            return below(self.root, own, name)

    def _count(self, more: int, where: str) -> None:
        self.elements += more
        if self.elements > MAX_ELEMENTS:
            raise ModelError(f"{where}: more than {MAX_ELEMENTS} elements, included ones counted")

    def _named(self, text: str, elements: list[Element], file: str, folder: Path, stack: tuple[Path, ...]) -> str:
        """Read what the model names, and put a name of our own in place of each file's."""
        where = _directories(text, elements)
        edits: list[tuple[int, int, str]] = []
        children: dict[str, str] = {}
        for element in elements:
            at = f"{file}:{element.line}"
            if element.tag == "compiler":
                edits += [_value(text, element, key, "") for key in attributes_of(text, element) if key.endswith("dir")]
            elif element.tag == "model":
                name = attributes_of(text, element).get("file", "")
                key = self._model(name, at, folder, stack)
                children[attributes_of(text, element).get("name") or PurePosixPath(name).stem] = key
                edits += self._renamed(text, element, "file", key, name)
            elif element.tag in ASSETS:
                for attribute, name in attributes_of(text, element).items():
                    if attribute.startswith("file"):
                        key = self._asset(element, name, attributes_of(text, element), where, at, folder)
                        edits += self._renamed(text, element, attribute, key, name)
        self._count_copies(text, elements, children, file)
        for start, end, new in sorted(edits, reverse=True):
            text = text[:start] + new + text[end:]
        return text

    def _renamed(self, text: str, element: Element, attribute: str, key: str, name: str) -> list[tuple[int, int, str]]:
        edits = [_value(text, element, attribute, key)]
        # an element without a name is called like its file
        if attribute == "file" and "name" not in attributes_of(text, element):
            from xml.sax.saxutils import quoteattr  # loads what reads from the web

            place = element.start + 1 + len(element.tag)
            edits.append((place, place, f" name={quoteattr(PurePosixPath(name.replace(chr(92), '/')).stem)}"))
        return edits

    def _model(self, name: str, where: str, folder: Path, stack: tuple[Path, ...]) -> str:
        try:
            path = self._path(folder, folder, name)
            if path in stack:
                raise UnreadableError("attaches from itself")
            if path in self.keys:
                return self.keys[path]
            text = read_text(path)
        except (UnreadableError, ModelError) as error:
            raise ModelError(f'{where}: <model file="{name}">: {error}') from error
        before = self.elements
        flat = self.document(text, str(path), path.parent, (*stack, path))
        key = f"workbench_{len(self.keys):04d}.xml"
        self.keys[path] = key
        self.models[key] = flat.encode()
        self.sizes.setdefault(key, self.elements - before)
        self.files.append(path)
        return key

    def _asset(
        self,
        element: Element,
        name: str,
        attributes: Mapping[str, str],
        directories: Mapping[str, str],
        where: str,
        folder: Path,
    ) -> str:
        suffix = PurePosixPath(name.replace("\\", "/")).suffix.lower()
        try:
            if directories["strippath"] == "true":
                name = PurePosixPath(name.replace("\\", "/")).name
            path = self._path(folder / directories[element.tag].replace("\\", "/"), folder, name)
            if path in self.keys:
                return self.keys[path]
            found = read_asset(path, element.tag, attributes.get("content_type", ""))
            if sum(map(len, self.assets.values())) + len(found) > MAX_ASSETS:
                raise UnreadableError(f"with it, the model would read more than {MAX_ASSETS} bytes")
        except UnreadableError as error:
            key = f"workbench_missing_{len(self.missing):04d}{suffix if suffix.isascii() else ''}"
            self.missing[key] = Missing(where, element.tag, name, str(error))
            return key
        key = self.keys[path] = f"workbench_{len(self.keys):04d}{suffix}"
        self.assets[key] = found
        self.files.append(path)
        return key

    def _count_copies(self, text: str, elements: list[Element], children: Mapping[str, str], file: str) -> None:
        """Refuse more elements than allowed, each counted as often as ``<replicate>`` and ``<attach>`` copy it."""
        around: list[tuple[int, int]] = []
        total = 0
        for element in elements:
            while around and element.start >= around[-1][0]:
                around.pop()
            times = around[-1][1] if around else 1
            total += times
            attributes = attributes_of(text, element) if element.tag in ("replicate", "attach") else {}
            if element.tag == "replicate":
                around.append((element.stop, times * max(1, int(min(number_in(attributes.get("count", "1")), 1e9)))))
            elif element.tag == "attach":
                total += times * self.sizes.get(children.get(attributes.get("model", ""), ""), 1)
            if total > MAX_ELEMENTS:
                raise ModelError(
                    f"{file}:{element.line}: <{element.tag}> makes more than {MAX_ELEMENTS} elements, copies counted",
                    file=file,
                )
        self._count(total, file)


def _directories(text: str, elements: list[Element]) -> dict[str, str]:
    """Where the files of each tag lie, and whether only their last name counts."""
    found: dict[str, str] = {}
    for element in elements:
        if element.tag == "compiler":
            found |= attributes_of(text, element)
    both = found.get("assetdir", "")
    mesh = found.get("meshdir", both)
    return {
        "mesh": mesh,
        "hfield": mesh,
        "texture": found.get("texturedir", both),
        "strippath": found.get("strippath", "false"),
    }


def _value(text: str, element: Element, attribute: str, new: str) -> tuple[int, int, str]:
    span = attribute_span(text, element, attribute)
    assert span is not None
    return (*span, new)
