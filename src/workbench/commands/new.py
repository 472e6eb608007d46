"""``workbench new``: the folder that a robot of one's own begins with, which runs at once."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.language_templates import LANGUAGES
from workbench.errors import OutputError, SpecError

MODEL = """<mujoco model="{name}">
  <!-- Angles in radians, lengths in metres, masses in kilograms. Nothing may touch: contacts are not covered. -->
  <compiler angle="radian"/>
  <option gravity="0 0 -9.81"><flag contact="disable"/></option>
  <worldbody>
{bodies}  </worldbody>
  <equality>
    <!-- each loop is closed by joining two sites -->
{loops}  </equality>
</mujoco>
"""

LOOP = """    <!-- loop {k}: driven bar, coupler, rocker in the plane y = {y}; its far end meets the site ground{k} -->
    <site name="ground{k}" pos="0.5 {y} 0"/>
    <body name="bar{k}" pos="0 {y} 0">
      <joint name="{joint}" axis="0 -1 0"/>
      <geom type="capsule" fromto="0 0 0 0.15 0 0" size="0.01" mass="0.3"/>
      <body name="coupler{k}" pos="0.15 0 0">
        <joint name="elbow{k}" axis="0 -1 0"/>
        <geom type="capsule" fromto="0 0 0 0.45 0 0" size="0.01" mass="0.8"/>
        <site name="platform{k}" pos="0.225 0 0"/>
        <body name="rocker{k}" pos="0.45 0 0">
          <joint name="wrist{k}" axis="0 -1 0"/>
          <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.01" mass="0.5"/>
          <site name="tip{k}" pos="0.3 0 0"/>
        </body>
      </body>
    </body>
"""

ROBOT = """# What {name}.xml cannot say of itself; the documentation of robots has every key.
format = 1
name = "{name}"
title = "{name}"
model = "{name}.xml"
# driven joints, in the order of q and tau
actuated = [{actuated}]
# the site whose motion is recorded; coordinates = ["x", "z"] beside it, as many as the robot has freedoms, and motions
# of the platform and its workspace can be asked for
platform = {{ site = "platform1" }}
# a rough guess (m, rad) from which the loops are closed; it picks the assembly branch
initial = {{ {initial} }}
formulas = ["{name}.py"]

# Numbers of the robot by name: formulas read them as p.a, `workbench model set` and --set change them at all places.
[parameters.a]
at = [{a}]
meaning = "length of the driven bar"
allowed = "> 0"

[parameters.b]
at = [{b}]
meaning = "length of the coupler"
allowed = "> 0"

[parameters.c]
at = [{c}]
meaning = "length of the rocker"
allowed = "> 0"

[parameters.d]
at = [{d}]
meaning = "distance of the ground pivots"
allowed = "> 0"

[parameters.m]
at = [{m}]
meaning = "mass of the driven bar"
allowed = "> 0"

[parameters.mb]
at = [{mb}]
meaning = "mass of the coupler"
allowed = "> 0"

[parameters.mc]
at = [{mc}]
meaning = "mass of the rocker"
allowed = "> 0"

[parameters.g]
at = ["gravity"]

# Each stays one rod of its length when that or its mass is set.
[[bars]]
bodies = [{bars}]
mass = "m"
length = "a"

[[bars]]
bodies = [{couplers}]
mass = "mb"
length = "b"

[[bars]]
bodies = [{rockers}]
mass = "mc"
length = "c"
"""

CAMPAIGN = """# What moves how, and what is compared: workbench run {name}.toml --candidates {name}.py
format = 1
name = "{name}"
title = "{name}"
robot = "robot.toml"

# The formula in {name}.py is a beginning, not yet right: it has no bound. Give it bound = 1e-10 when it should hold.
[[candidate]]
name = "{name}"
reference = "distributed"

[[case]]
name = "first"
[case.motion]
kind = "sine"
offset = [{offset}]
amplitude = [{amplitude}]
frequency = [{frequency}]
stop = 1.0
samples = 101
"""

CANDIDATE = '''"""The formula that is held against MuJoCo: workbench run {name}.toml --candidates {name}.py"""

import numpy as np

import workbench


@workbench.candidate("{name}")
def {function}(p, q, qd, qdd):
    """Torques (n, {count}) from q, qd, qdd (n, {count}), SI; p.m, p.a, p.g are read from the model.

    To begin with: the driven bars alone, as if nothing hung on them.
    """
    return p.m * p.a**2 / 3 * qdd + p.m * p.g * p.a / 2 * np.cos(q)
'''

TEST = '''"""Run by pytest: the model closes and the reference is sound; tighten once the formula is right."""

from pathlib import Path

import workbench
from workbench.campaign.run import run_campaign

HERE = Path(__file__).parent


def test_{function}(tmp_path):
    run_campaign(HERE / "{name}.toml", tmp_path / "run", candidates=[HERE / "{name}.py"])
    run = workbench.load_run(tmp_path / "run")
    case = run.manifest.cases["first"]
    assert case.closure_residual < 1e-12
    assert case.evidence.power_balance["distributed"].relative < 1e-8
    errors = run.summary[run.summary["candidate"] == "{name}"]["peak_error"]
    assert errors.max() < 10.0  # becomes 1e-10
'''

PLACES = {
    "a": ("offset coupler{k} x",),
    "b": ("offset rocker{k} x", "site platform{k} x = 0.5 * b"),
    "c": ("site tip{k} x",),
    "d": ("site ground{k} x",),
    "m": ("mass bar{k}",),
    "mb": ("mass coupler{k}",),
    "mc": ("mass rocker{k}",),
    "bars": ("bar{k}",),
    "couplers": ("coupler{k}",),
    "rockers": ("rocker{k}",),
}
"""What stands in the lists of the robot file, once for each loop."""

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,39}")


def _number(loops: str) -> int:
    if not loops.isdigit() or not 1 <= int(loops) <= 20:
        raise SpecError(f"--loops {loops}; allowed: 1 to 20, or with --from a table of loops")
    return int(loops)


def _from_file(source: Path, directory: Path, loops: str | None, actuated: tuple[str, ...]) -> None:
    """Write the folder of a robot that a file holds."""
    from workbench.commands.from_urdf import from_urdf
    from workbench.commands.import_model import import_model

    if source.suffix.lower() == ".urdf":
        from_urdf(source, directory, Path(loops) if loops else None, actuated)
        return
    if loops is not None:
        raise SpecError(f"--loops {loops}: {source} is no URDF (.urdf); an MJCF holds its loops itself")
    import_model(source, directory, actuated)


def new(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Directory to make; its name names the files.")],
    actuated: Annotated[
        list[str] | None, typer.Option(metavar="JOINT", help="A driven joint; may be repeated. Default: crank.")
    ] = None,
    loops: Annotated[
        str | None,
        typer.Option(
            metavar="NUMBER|FILE",
            help="Closed loops of the sketch, one driven joint each (default: one a joint); with --from, their table.",
        ),
    ] = None,
    language: Annotated[
        str | None,
        typer.Option(
            metavar="octave|c|julia|r|program", help="The formula in this language too. Default: Python alone."
        ),
    ] = None,
    source: Annotated[
        Path | None,
        typer.Option("--from", metavar="FILE", help="A robot's MJCF as it lies, or its URDF, in place of a sketch."),
    ] = None,
) -> None:
    """Write a model with closed loops, its robot file, a campaign, a formula to fill in and a test; they run at once.

    With --from, the robot is a file's: its loops, joints to drive, platform, first guess and a small motion are found.
    A URDF holds a tree: --loops names the table of its loops (.toml, .yaml).
    """
    if source is not None:
        _from_file(source, directory, loops, tuple(actuated or ()))
        return
    if language is not None and language not in LANGUAGES:
        raise SpecError(f"--language {language}; allowed: {', '.join(LANGUAGES)}")
    joints = tuple(actuated or ["crank"])
    count = _number(loops) if loops else len(joints)
    name = directory.name
    for what, value in (("DIR", name), *(("--actuated", joint) for joint in joints)):
        if not NAME.fullmatch(value):
            raise SpecError(f'{what} "{value}"; allowed: letters, digits and _, first a letter, at most 40')
    if len(set(joints)) < len(joints) or any(re.fullmatch(r"(elbow|wrist)\d+", joint) for joint in joints):
        raise SpecError(f"--actuated {' '.join(joints)}: each joint once, and none called elbow1, wrist1 or the like")
    if count != len(joints):
        raise SpecError(
            f"--loops {count} with {len(joints)} driven joint(s); each loop of the sketch has one of its own"
        )
    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        raise OutputError(f"{directory}: exists and is not an empty directory")
    numbers = range(1, count + 1)
    fields = {
        "name": name,
        "function": name,
        "count": count,
        "bodies": "".join(
            LOOP.format(k=k, y=0.1 * (k - 1), joint=joint) for k, joint in zip(numbers, joints, strict=True)
        ),
        "loops": "".join(f'    <connect name="loop{k}" site1="tip{k}" site2="ground{k}"/>\n' for k in numbers),
        "actuated": ", ".join(f'"{joint}"' for joint in joints),
        "initial": ", ".join(
            f"{joint} = 1.0, elbow{k} = -0.5, wrist{k} = -1.5" for k, joint in zip(numbers, joints, strict=True)
        ),
        "offset": ", ".join(["1.0"] * count),
        "amplitude": ", ".join(["0.6"] * count),
        "frequency": ", ".join(f"{3.0 + k}" for k in range(count)),
        **{
            field: ", ".join(f'"{place.format(k=k)}"' for k in numbers for place in places)
            for field, places in PLACES.items()
        },
    }
    directory.mkdir(parents=True, exist_ok=True)
    for file, text in (
        (f"{name}.xml", MODEL), ("robot.toml", ROBOT), (f"{name}.toml", CAMPAIGN), (f"{name}.py", CANDIDATE),
        (f"test_{name}.py", TEST),
    ):  # fmt: skip
        (directory / file).write_text(text.format(**fields), encoding="utf-8")
    typer.echo(f"{directory}: {name}.xml, robot.toml, {name}.toml, {name}.py, test_{name}.py; now\n  cd {directory}")
    typer.echo(f"  workbench run {name}.toml --candidates {name}.py")
    if language is not None:
        pattern, text = LANGUAGES[language]
        file = pattern.format(name=name)
        (directory / file).write_text(text.format(**fields), encoding="utf-8")
        if language == "program":
            (directory / file).chmod(0o755)
        typer.echo(f"  workbench run {name}.toml --candidates {'./' if language == 'program' else ''}{file}")
