"""In which line of the user's file an element stands."""

from __future__ import annotations

import dataclasses
import re

import mujoco

from workbench.errors import ModelError
from workbench.mjcf.assets import parse
from workbench.mjcf.refusal import Refusal, joined
from workbench.mjcf.source import Source
from workbench.mjcf.text import scan

LISTS = {
    "joint": "joints", "geom": "geoms", "body": "bodies", "site": "sites", "actuator": "actuators", "pair": "pairs",
    "tendon": "tendons", "fixed": "tendons", "spatial": "tendons", "equality": "equalities", "connect": "equalities",
    "weld": "equalities", "mesh": "meshes",
}  # fmt: skip
"""tag -> list of a specification"""
LINE = re.compile(r"line (\d+)")


def line_of(source: Source, spec: mujoco.MjSpec, tag: str, name: str) -> int | None:
    """Line of ``<tag name=...>``, from 1; what an include brings stands on the include's. None: not known.

    A name like ``#3`` is the fourth of its kind; of ``option`` and ``flag`` it is the last one's.
    """
    if tag in ("option", "flag", "compiler"):
        found = [number for number, row in enumerate(source.text.split("\n"), start=1) if f"<{tag}" in row]
        return found[-1] if found else None
    elements = list(getattr(spec, LISTS[tag])) if tag in LISTS else []
    if re.fullmatch(r"#\d+", name):
        elements = elements[int(name[1:]) :][:1]
    else:
        elements = [element for element in elements if element.name == name]
    if not elements:
        return None
    match = LINE.search(elements[0].info or "")
    if match:
        return int(match.group(1))
    return _free_line(source, spec, elements[0]) if tag == "joint" else None


def _free_line(source: Source, spec: mujoco.MjSpec, joint: mujoco.MjsJoint) -> int | None:
    """MuJoCo keeps no line of a ``<freejoint>``: it is found by its place among them, else the body's is taken."""
    lines = [element.line for element in scan(source.text, source.file) if element.tag == "freejoint"]
    silent = [other for other in spec.joints if not other.info]
    if len(lines) == len(silent):
        return lines[silent.index(joint)]
    match = LINE.search(joint.parent.info or "")
    return int(match.group(1)) if match else None


def with_lines(error: ModelError, source: Source) -> ModelError:
    """The same error, each of its refusals with its line; an error without refusals is returned as it is."""
    refusals: tuple[Refusal, ...] = error.facts.get("refusals", ())
    if not refusals:
        return error
    spec = parse(source)
    placed = []
    for refusal in refusals:
        line = line_of(source, spec, refusal.tag, refusal.name)
        placed.append(dataclasses.replace(refusal, message=f"line {line}: {refusal.message}") if line else refusal)
    return joined(source.file, placed)
