"""The page of the Python interface: every public name, documented by its docstring."""

from __future__ import annotations

import inspect
from pathlib import Path

import workbench

HEAD = """# Python

What `import workbench as wb` offers, from its docstrings. Arrays are float64, SI, batch first; names, units and frames
are those of [notation](../docs/notation.md). Names that begin with an underscore, and modules that no page names, may
change without notice.

"""

FURTHER = {
    "workbench.report.frames.RunFrames": "what `load_run` gives",
    "workbench.reference.result.ReferenceResult": "what `MujocoReference.inverse_dynamics` gives",
    "workbench.reference.power.power_balance": "evidence: the power of the torques against the change of energy",
    "workbench.reference.replay.replay": "evidence: the torques drive the model forward",
    "workbench.reference.raw_inverse.raw_mj_inverse": "what MuJoCo's inverse says without the projection",
}
"""Further names that pages speak of."""


def page(repository: Path) -> str:
    """Give the page, functions before classes, each under a heading of its own."""
    public = [name for name in workbench.__all__ if name not in ("__version__", "load_mechanism")]
    text = HEAD
    for name in sorted(public, key=lambda name: (inspect.isclass(getattr(workbench, name)), name)):
        text += _entry(f"workbench.{name}", getattr(workbench, name), f"workbench.{name}")
    text += "## Further\n\n"
    for path, meaning in FURTHER.items():
        module, _, name = path.rpartition(".")
        found = getattr(__import__(module, fromlist=[name]), name)
        text += _entry(path, found, name, level=3, meaning=meaning)
    return text


def _entry(path: str, found: object, title: str, level: int = 2, meaning: str = "") -> str:
    kind = "class" if inspect.isclass(found) else "function"
    members = "   :members:\n   :show-inheritance:\n" if kind == "class" else ""
    said = f"{meaning[0].upper()}{meaning[1:]}.\n\n" if meaning else ""
    return f"{'#' * level} {title}\n\n{said}```{{eval-rst}}\n.. auto{kind}:: {path}\n{members}```\n\n"
