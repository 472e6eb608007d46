"""Write a proposal down: the robot file and the campaign as text, and a folder with the model and all it reads."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

from workbench.errors import OutputError
from workbench.importing.proposal import STOP_S, Proposal
from workbench.robots.robot_file import FILE

SAMPLES = 101


def robot_text(found: Proposal, name: str) -> str:
    """The robot file of a proposal."""
    setup = found.setup
    lines = [f"# {_one_line(note)}" for note in found.notes]
    lines += ["# every key is explained in docs/robots.md", "format = 1", f"name = {_text(name)}"]
    lines += [f"title = {_text(name)}", f"model = {_text(found.model.name)}"]
    lines += ["# driven joints, in the order of q and tau", f"actuated = {_list(setup.actuated)}"]
    if setup.fix_base:
        lines += ["# this body stands still where it is drawn", f"fix_base = {_text(setup.fix_base)}"]
    if setup.ignore:
        lines += [f"ignore = {_list(setup.ignore)}"]
    if setup.initial:
        inside = ", ".join(f"{_text(joint)} = {value!r}" for joint, value in setup.initial)
        lines += ["# where the loops are closed (m, rad); it picks the assembly branch", f"initial = {{ {inside} }}"]
    lines += ["", "# what moves; coordinates: add rx, ry, rz where it turns", "[platform]"]
    lines += [f"site = {_text(setup.platform_site)}" if setup.platform_site else f"body = {_text(setup.platform_body)}"]
    lines += ["", "# numbers that can be set, swept, and that formulas read as p.NAME", "[parameters]"]
    lines += [f"{key}.at = [{_text(place)}]" for key, place in found.parameters]
    return "\n".join(lines) + "\n"


def campaign_text(found: Proposal, name: str, robot: str) -> str:
    """The campaign of a proposal; *robot* is the path of the robot file as the campaign sees it."""
    lines = ["format = 1", f"name = {_text(name)}", f"title = {_text(name)}", f"robot = {_text(robot)}"]
    if found.motion:
        motion = found.motion
        lines += ["", "[[case]]", 'name = "small"', "[case.motion]", 'kind = "sine"']
        lines += [f"offset = {list(motion.offset)}", f"amplitude = {list(motion.amplitude)}"]
        lines += [f"frequency = {list(motion.frequency)}", f"stop = {STOP_S}", f"samples = {SAMPLES}"]
    return "\n".join(lines) + "\n"


def write_folder(found: Proposal, directory: Path) -> Path:
    """Copy the model with all that it reads into *directory*, write its robot file and campaign; returns the latter.

    Raises
    ------
    OutputError
        The directory is not empty, or cannot be written.
    """
    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        raise OutputError(f"{directory}: exists and is not an empty directory")
    root = found.model.parent
    try:
        for path in (found.model, *found.prepared.source.files):
            target = directory / os.path.relpath(path, root)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)
        campaign = directory / f"{directory.name}.toml"
        (directory / FILE).write_text(robot_text(found, directory.name), encoding="utf-8")
        campaign.write_text(campaign_text(found, directory.name, FILE), encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{directory}: {error.strerror or error}") from error
    return campaign


def _one_line(text: str) -> str:
    """Without what a comment may not hold: line ends and control characters of names."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)


def _list(values: tuple[str, ...]) -> str:
    return f"[{', '.join(map(_text, values))}]"
