"""``<compiler>`` options that make another robot than the numbers in the file: which bodies, and by how much."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.mjcf.assets import parse
from workbench.mjcf.engine_warnings import engine_warnings
from workbench.mjcf.source import Source

NAMED = 4
SAME = 1e-12

Compiler = Any
"""of a specification"""


def _off(name: str, value: object) -> Callable[[Compiler], None]:
    return lambda compiler: setattr(compiler, name, value)


AUTO = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
OPTIONS: dict[str, tuple[Callable[[Compiler], bool], Callable[[Compiler], None]]] = {
    "inertiafromgeom": (
        lambda c: c.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE,
        _off("inertiafromgeom", AUTO),
    ),
    "balanceinertia": (lambda c: bool(c.balanceinertia), _off("balanceinertia", False)),
    "boundmass": (lambda c: c.boundmass > 0, _off("boundmass", 0.0)),
    "boundinertia": (lambda c: c.boundinertia > 0, _off("boundinertia", 0.0)),
    "settotalmass": (lambda c: c.settotalmass > 0, _off("settotalmass", -1.0)),
}
"""option -> whether a file uses it, and how it is switched off"""


def compiler_changes(source: Source) -> tuple[str, ...]:
    """One line for each option of ``<compiler>`` that changes masses or inertias of *source*."""
    whole = "".join([source.text, *(model.decode() for model in source.models.values())])
    if not any(name in whole for name in OPTIONS):
        return ()
    spec = parse(source)
    used = [name for name, (uses, _) in OPTIONS.items() if uses(spec.compiler)]
    if not used:
        return ()
    with engine_warnings():
        as_is = _bodies(spec.compile())
    notes = []
    for name in used:
        other = parse(source)
        OPTIONS[name][1](other.compiler)
        try:
            reason = ""
            with engine_warnings():
                without = _bodies(other.compile())
        except (ValueError, mujoco.FatalError) as error:
            without = _authored(parse(source), as_is)
            reason = f'; without it MuJoCo says "{" ".join(str(error).split())}"'
        if set(without) != set(as_is):
            notes.append(f"<compiler {name}> makes another robot than the file's numbers: bodies differ")
            continue
        changed = {body: _change(without[body], as_is[body]) for body in as_is}
        changed = {body: share for body, share in changed.items() if share > SAME}
        if changed:
            order = sorted(changed, key=lambda body: -changed[body])
            shown = ", ".join(f"{body} by {100 * changed[body]:.3g} %" for body in order[:NAMED])
            more = f" and {len(order) - NAMED} more" if len(order) > NAMED else ""
            notes.append(
                f"<compiler {name}> makes another robot than the file's numbers: mass or inertia of {shown}{more};"
                f" the workbench counts what MuJoCo compiles{reason}"
            )
    return tuple(notes)


def _authored(spec: mujoco.MjSpec, compiled: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Mass and inertia as they are written, where they are."""
    found = dict(compiled)
    for body in spec.bodies:
        if body.explicitinertial and body.name in found and np.isnan(body.fullinertia).any():
            found[body.name] = np.array([body.mass, *body.inertia])
    return found


def _bodies(model: mujoco.MjModel) -> dict[str, FloatArray]:
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, b) or f"#{b}" for b in range(model.nbody)]
    return {name: np.array([model.body_mass[b], *model.body_inertia[b]]) for b, name in enumerate(names)}


def _change(before: FloatArray, after: FloatArray) -> float:
    """Largest change of mass and of inertia, relative to the larger of both values."""
    whole = [np.maximum(abs(before[:1]), abs(after[:1])).max(), np.maximum(abs(before[1:]), abs(after[1:])).max()]
    gaps = [abs(after[:1] - before[:1]).max(), abs(after[1:] - before[1:]).max()]
    return max(float(gap / size) if size else 0.0 for gap, size in zip(gaps, whole, strict=True))
