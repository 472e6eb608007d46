"""A robot of a model without a robot file: what the model's own ``<custom>`` and motors say."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import mujoco

from workbench.errors import SpecError
from workbench.mjcf.compile import custom_text
from workbench.robots.description import Description
from workbench.robots.load import LoadedModel
from workbench.robots.robot_file import PlatformSpec, RobotFile, RobotSpec


def robot_of_model(loaded: LoadedModel) -> LoadedModel:
    """Return a loaded model with the description that its own names give; it has no parameters.

    Raises
    ------
    SpecError
        The model does not say which joints are driven or what the platform is.
    """
    model, file = loaded.model, loaded.file
    platform = custom_text(model, "platform_site")
    joints = [
        mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, int(model.actuator_trnid[a, 0])) or ""
        for a in range(model.nu)
        if mujoco.mjtTrn(model.actuator_trntype[a]) == mujoco.mjtTrn.mjTRN_JOINT
    ]
    if platform is None or not joints:
        raise SpecError(
            f"{file}: nothing says which joints are driven and what the platform is; a robot file does (robot.toml with"
            f" actuated and platform, docs/robots.md): workbench new DIR --from {file}",
            file=file,
        )
    stem = Path(file).stem
    spec = RobotSpec(
        name="".join(c if c.isalnum() or c in "_.+-" else "_" for c in stem)[:100] or "robot",
        title=stem.replace("_", " "),
        model=Path(file).name,
        actuated=joints,
        platform=PlatformSpec(site=platform),
        base=custom_text(model, "base_body") or "world",
        lumped=(custom_text(model, "lumped_bodies") or "").split(),
    )
    robot = RobotFile(Path(file), file, spec)
    return dataclasses.replace(loaded, description=Description(robot, (), None, robot.table), values={})
