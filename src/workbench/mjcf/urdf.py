"""From a URDF with a table of its loops to an MJCF that holds the same robot.

The tree is read by MuJoCo's own URDF reader; written is what it compiled, with all digits, and the loops as equalities.
Shapes are left out, since inertias do not come from them here. What else is lost is named.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass, field

import mujoco

from workbench.errors import ModelError, did_you_mean
from workbench.mjcf.assets import parse
from workbench.mjcf.compile import compile_spec
from workbench.mjcf.loop_table import LoopTable
from workbench.mjcf.source import Source
from workbench.mjcf.urdf_writer import Writer, same_robot

SHAPES = ("visual", "collision", "material")
LOST = {
    "transmission": "transmissions",
    "gazebo": "extensions for Gazebo",
    "ros2_control": "ros2_control",
    "safety_controller": "safety controllers",
    "calibration": "calibrations",
}


@dataclass(frozen=True)
class Imported:
    """A URDF as MJCF."""

    text: str = field(repr=False)
    actuated: tuple[str, ...]
    """that the loop table names"""
    joints: tuple[str, ...]
    """hinges and slides, in MuJoCo's order"""
    sites: tuple[str, ...]
    """at the frames of the loops"""
    lost: tuple[str, ...]
    """what the MJCF does not hold, one line each"""
    limited: bool
    """whether joints have ranges; the MJCF keeps them"""


def import_urdf(text: str, file: str, table: LoopTable) -> Imported:
    """Turn a URDF into an MJCF.

    Parameters
    ----------
    text, file
        The URDF, and its name for messages.
    table
        Its loops.

    Raises
    ------
    ModelError
        Not a URDF that MuJoCo reads; a loop with a frame that is not there; a round trip that does not agree.
    """
    root = _parsed(text, file)
    changed = dict(table.changed)
    links = [link.get("name", "") for link in root.iter("link")]
    frames = {name: name for name in links}
    mimics: list[tuple[str, str, float, float]] = []
    for joint in root.findall("joint"):
        child = joint.find("child")
        name = joint.get("name", "")
        if child is not None:
            frames.setdefault(name, child.get("link", ""))
        mimic = joint.find("mimic")
        if mimic is not None:
            factor, offset = float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0"))
            mimics.append((name, mimic.get("joint", ""), factor, offset))
            joint.remove(mimic)
        if name in changed:
            joint.set("type", {"FIXED": "fixed", "SPHERICAL": "floating"}[changed[name]])
    for wanted in changed:
        if wanted not in frames or wanted in links:
            raise ModelError(f'{file}: joint_name: no joint "{wanted}"{did_you_mean(wanted, frames)}', file=file)
    massless = _massless(root)
    lost = tuple(_lost(root))
    model = _compiled(root, file)
    spherical = {name for name, kind in changed.items() if kind == "SPHERICAL"}
    writer = Writer(model, spherical, massless, file)
    written = writer.text(root.get("name", "robot"), table.loops, frames, mimics)
    same_robot(model, compile_spec(parse(Source(file, written)), file), massless, file)
    joints = tuple(
        model.joint(j).name for j in range(model.njnt) if model.jnt_type[j] >= mujoco.mjtJoint.mjJNT_SLIDE.value
    )
    for driven in table.actuated:
        if driven not in joints:
            raise ModelError(f'{file}: name_mot: no hinge or slide "{driven}"{did_you_mean(driven, joints)}', file=file)
    limited = bool(model.jnt_limited.any())
    sites = tuple(f"loop{k + 1}_{side}" for k in range(len(table.loops)) for side in "ab")
    return Imported(written, table.actuated, joints, sites, lost, limited)


def _parsed(text: str, file: str) -> ET.Element:
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ModelError(f"{file}: a document type with entities; allowed: plain XML", file=file)
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        line, column = error.position
        raise ModelError(f"{file}: line {line}, column {column}: no XML: {error.msg}", file=file, line=line) from error
    if root.tag != "robot":
        raise ModelError(f"{file}: root is <{root.tag}>; a URDF's is <robot>", file=file)
    if any("xacro" in element.tag for element in root.iter()):
        raise ModelError(f"{file}: xacro macros; allowed: a URDF (run xacro first)", file=file)
    return root


def _lost(root: ET.Element) -> Iterator[str]:
    """Take out what the model does not hold, and say so."""
    counts: dict[str, int] = {}
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in SHAPES or child.tag in LOST:
                parent.remove(child)
                counts[child.tag] = counts.get(child.tag, 0) + 1
    shapes = sum(counts.get(tag, 0) for tag in ("visual", "collision"))
    if shapes:
        yield f"{shapes} shapes (visual and collision): inertias do not come from them, and nothing may touch"
    for tag, words in LOST.items():
        if tag in counts:
            yield f"{counts[tag]} {words}"
    limits = [limit for limit in root.iter("limit") if limit.get("effort") or limit.get("velocity")]
    if limits:
        yield f"limits of effort and speed of {len(limits)} joints: inverse dynamics has no use for them"


def _massless(root: ET.Element) -> frozenset[str]:
    """Links that move and weigh nothing, such as those between the hinges of a universal joint.

    They are given a mass for MuJoCo's reader, which refuses them, and go into the link behind them when written.
    """
    weight = {}
    for link in root.findall("link"):
        mass = link.find("inertial/mass")
        weight[link.get("name", "")] = float(mass.get("value", "0")) if mass is not None else 0.0
    moved, welded = set[str](), list[tuple[str, str]]()
    for joint in root.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is None or child is None:
            continue
        if joint.get("type") == "fixed":
            welded.append((parent.get("link", ""), child.get("link", "")))
        else:
            moved.add(child.get("link", ""))
    for _ in welded:  # what is welded on counts
        for above, below in welded:
            weight[above] = max(weight.get(above, 0.0), weight.get(below, 0.0))
    found = frozenset(name for name in moved if weight.get(name, 0.0) == 0.0)
    for link in root.findall("link"):
        if link.get("name") in found:
            for old in link.findall("inertial"):
                link.remove(old)
            inertial = ET.SubElement(link, "inertial")
            ET.SubElement(inertial, "mass", value="1")
            ET.SubElement(inertial, "inertia", ixx="1", iyy="1", izz="1", ixy="0", ixz="0", iyz="0")
    return found


def _compiled(root: ET.Element, file: str) -> mujoco.MjModel:
    for old in root.findall("mujoco"):
        root.remove(old)
    options = ET.SubElement(ET.SubElement(root, "mujoco"), "compiler")
    for key, value in (("fusestatic", "false"), ("discardvisual", "true"), ("balanceinertia", "false")):
        options.set(key, value)
    return compile_spec(parse(Source(file, ET.tostring(root, encoding="unicode"))), file)
