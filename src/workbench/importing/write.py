"""Write a proposal down: the campaign as text, and a folder with the model and all that it reads."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

from workbench.errors import OutputError
from workbench.importing.proposal import STOP_S, Proposal

SAMPLES = 101


def campaign_text(found: Proposal, name: str, model: str) -> str:
    """The campaign of a proposal; *model* is the path of the MJCF as the campaign sees it."""
    setup = found.setup
    lines = [f"# {_one_line(note)}" for note in found.notes]
    lines += ["format = 1", f"name = {_text(name)}", f"title = {_text(name)}", f"model = {_text(model)}"]
    lines += ["# driven joints, in the order of q and tau", f"actuated = {_list(setup.actuated)}"]
    if setup.platform_site:
        lines += ["# the site whose motion is recorded", f"platform_site = {_text(setup.platform_site)}"]
    else:
        lines += ["# the body whose motion is recorded", f"platform_body = {_text(setup.platform_body)}"]
    if setup.fix_base:
        lines += [f"fix_base = {_text(setup.fix_base)}"]
    if setup.ignore:
        lines += [f"ignore = {_list(setup.ignore)}"]
    if setup.initial:
        inside = ", ".join(f"{_text(joint)} = {value!r}" for joint, value in setup.initial)
        lines += ["# where the loops are closed (m, rad); it picks the assembly branch", f"initial = {{ {inside} }}"]
    lines += ["", "# numbers for a formula, read from the compiled model", "[read]"]
    lines += [f"{key} = {_text(place)}" for key, place in found.parameters]
    if found.motion:
        motion = found.motion
        lines += ["", "[[case]]", 'name = "small"', "[case.motion]", 'kind = "sine"']
        lines += [f"offset = {list(motion.offset)}", f"amplitude = {list(motion.amplitude)}"]
        lines += [f"frequency = {list(motion.frequency)}", f"stop = {STOP_S}", f"samples = {SAMPLES}"]
    return "\n".join(lines) + "\n"


def write_folder(found: Proposal, directory: Path) -> Path:
    """Copy the model with all that it reads into *directory* and write its campaign; returns the campaign's path.

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
        campaign.write_text(campaign_text(found, directory.name, found.model.name), encoding="utf-8")
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
