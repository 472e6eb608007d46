"""``workbench new DIR --from ROBOT.urdf``: the robot's MJCF, its robot file and a campaign that runs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import typer

from workbench.errors import ModelError, MotionError, OutputError, SpecError, WorkbenchError
from workbench.mjcf.loop_table import LoopTable, read_loops
from workbench.mjcf.setup import Setup
from workbench.mjcf.urdf import Imported, import_urdf
from workbench.reference import MujocoReference

MOST_BYTES = 50_000_000
HALVINGS = 8
AMPLITUDE = 0.2
FREQUENCY = 3.0


def from_urdf(source: Path, directory: Path, loops: Path | None, actuated: tuple[str, ...]) -> None:
    """Write the folder, and say what was lost.

    Raises
    ------
    WorkbenchError
        A URDF or loop table that is wrong; a directory that is not empty; no joint to drive.
    """
    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        raise OutputError(f"{directory}: exists and is not an empty directory")
    try:
        if source.stat().st_size > MOST_BYTES:
            raise ModelError(f"{source}: more than {MOST_BYTES} bytes", file=str(source))
        text = source.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ModelError(f"{source}: {getattr(error, 'strerror', None) or error}", file=str(source)) from error
    found = import_urdf(text, str(source), read_loops(loops) if loops else LoopTable())
    driven = actuated or found.actuated
    if not driven:
        raise SpecError(
            f"{source}: no joint to drive; name them by --actuated, or as name_mot in the table of loops; there are"
            f" {', '.join(found.joints)}"
        )
    if not found.sites:
        raise SpecError(f"{source}: no loops; --loops names a table of them (docs/urdf.md)")
    name = directory.name
    directory.mkdir(parents=True, exist_ok=True)
    (directory / f"{name}.xml").write_text(found.text, encoding="utf-8")
    (directory / "robot.toml").write_text(_robot(name, found, driven), encoding="utf-8")
    (directory / f"{name}.toml").write_text(_campaign(directory / f"{name}.xml", name, found, driven), encoding="utf-8")
    typer.echo(f"{directory}: {name}.xml, robot.toml, {name}.toml; masses, mass centres and poses agree with {source}")
    for line in found.lost:
        typer.echo(f"not kept: {line}")
    typer.echo(f"  workbench run {directory / f'{name}.toml'}")


def _robot(name: str, found: Imported, driven: tuple[str, ...]) -> str:
    lines = ["format = 1", f"name = {json.dumps(name)}", f'model = "{name}.xml"']
    lines += ["# driven joints, in the order of q and tau", f"actuated = {json.dumps(list(driven))}"]
    lines += [
        "# the site whose motion is recorded; another one may be meant",
        f'platform = {{ site = "{found.sites[0]}" }}',
    ]
    if found.limited:
        lines += ["# joints' ranges stand in the model; inverse dynamics does not stop at them", 'ignore = ["limits"]']
    return "\n".join(lines) + "\n"


def _campaign(model: Path, name: str, found: Imported, driven: tuple[str, ...]) -> str:
    """A campaign with a small motion that the robot can follow, where one is found."""
    lines = ["format = 1", f"name = {json.dumps(name)}", f"title = {json.dumps(name)}", 'robot = "robot.toml"', ""]
    try:
        reference = MujocoReference(
            model,
            setup=Setup(actuated=driven, platform_site=found.sites[0], ignore=("limits",) if found.limited else ()),
        )
        home, amplitude = reference.home, _amplitude(reference)
    except WorkbenchError as error:
        typer.echo(f"no motion was found: {error}")
        home, amplitude = np.zeros(len(driven)), 0.01
    lines += ["[[case]]", 'name = "small"', "[case.motion]", 'kind = "sine"', f"offset = {home.tolist()}"]
    lines += [
        f"amplitude = {[amplitude] * len(driven)}",
        f"frequency = {[FREQUENCY + k / 2 for k in range(len(driven))]}",
    ]
    return "\n".join([*lines, "stop = 1.0", "samples = 101", ""])


def _amplitude(reference: MujocoReference) -> float:
    """The largest of ever smaller amplitudes that the reference follows.

    Raises
    ------
    MotionError
        Not even the smallest one.
    """
    home = reference.home
    t = np.linspace(0.0, 1.0, 101)[:, None]
    w = FREQUENCY + np.arange(len(home)) / 2
    last: MotionError | None = None
    for halving in range(HALVINGS):
        a = AMPLITUDE * 0.5**halving
        motion = home + a * np.sin(w * t), a * w * np.cos(w * t), -a * w**2 * np.sin(w * t)
        try:
            reference.inverse_dynamics(*motion, along=t[:, 0])
        except MotionError as error:
            last = error
        else:
            return float(a)
    assert last is not None
    raise last
