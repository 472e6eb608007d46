"""MJCF text to compiled model: find the file, compile it, refuse numbers that no result may depend on."""

from __future__ import annotations

import contextlib
from pathlib import Path

import mujoco
import numpy as np

from workbench.data_files import bundled
from workbench.errors import ModelError, WorkbenchError
from workbench.limits import LARGEST_NUMBER
from workbench.mjcf.engine_warnings import engine_warnings

FINITE = (
    "qpos0", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia", "jnt_pos", "jnt_axis",
    "site_pos", "site_quat", "dof_damping", "dof_armature", "dof_frictionloss", "jnt_stiffness", "eq_data", "key_qpos",
)  # fmt: skip
"""Compiled arrays that every result depends on."""

FINITE_OPTIONS = ("gravity", "wind", "density", "viscosity", "timestep")


def find_model(path: str | Path) -> Path:
    """Return *path*, or the bundled model of that name where no such file exists.

    Raises
    ------
    ModelError
        No such file.
    """
    path = Path(path)
    try:
        if path.is_file():
            return path
        exists = path.exists()
    except (OSError, ValueError) as error:  # a name too long, a null byte, a directory that may not be entered
        raise ModelError(f"{str(path)!r}: {getattr(error, 'strerror', None) or error}", file=str(path)) from error
    if exists:
        kind = "a directory" if path.is_dir() else "no regular file"
        raise ModelError(f"{path}: is {kind}; a model is an XML file", file=str(path))
    if path.parts[:1] == ("models",) and len(path.parts) == 2:
        with contextlib.suppress(WorkbenchError):  # the message below says it better
            return bundled("models", path.name)
    raise ModelError(f"{path}: no such model file", file=str(path))


def compile_spec(spec: mujoco.MjSpec, file: str) -> mujoco.MjModel:
    """Compile a specification.

    Raises
    ------
    ModelError
        MuJoCo's own message, which names the file's line; or a number that is not finite or beyond `LARGEST_NUMBER`.
    """
    try:
        with engine_warnings():
            model = spec.compile()
    except (ValueError, TypeError, MemoryError, mujoco.FatalError) as error:
        raise ModelError(f"{file}: MuJoCo does not compile it: {error}", file=file) from error
    numbers = [(name, getattr(model, name)) for name in FINITE]
    numbers += [(f"option {name}", np.atleast_1d(getattr(model.opt, name))) for name in FINITE_OPTIONS]
    if np.abs(np.concatenate([values.ravel() for _, values in numbers])).max() <= LARGEST_NUMBER:
        return model
    for name, values in numbers:
        if values.size and not np.abs(values).max() <= LARGEST_NUMBER:
            raise ModelError(
                f"{file}: {name} of the compiled model holds {np.abs(values).max():g}; allowed: at most"
                f" {LARGEST_NUMBER:g}",
                file=file,
            )
    return model


def custom_text(model: mujoco.MjModel, name: str) -> str | None:
    """Return the value of ``<custom><text name=...>``, or None."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, name)
    if index < 0:
        return None
    start = model.text_adr[index]
    return bytes(model.text_data[start : start + model.text_size[index] - 1]).decode()
