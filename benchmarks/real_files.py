"""Run MJCF files as they lie and hold their torques against an oracle: python benchmarks/real_files.py ROOT FILE ...

Each FILE, a path below ROOT, is given to `workbench new --from` and its proposal is run; torques of the small motion
are compared with `dense_oracle`. Prints one row of Markdown a file; docs/real-files.md holds such a table.
"""

from __future__ import annotations

import re
import sys
import time
from pathlib import Path

import mujoco
import numpy as np
from dense_oracle import DenseOracle

from workbench.errors import WorkbenchError
from workbench.importing.proposal import SAMPLES, STOP_S, Proposal, propose, sine
from workbench.mjcf.free_joints import user_qpos
from workbench.reference import MujocoReference

LOOKED_AT = 12


def features(text: str, model: mujoco.MjModel) -> str:
    """What of a file makes it hard, in a few words."""
    kinds = [mujoco.mjtEq(kind).name[5:].lower() for kind in model.eq_type]
    found = [f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds)]
    tags = ("include", "mesh", "texture", "hfield", "attach", "replicate", "frame", "tendon", "freejoint")
    found += [tag for tag in tags if re.search(rf"<{tag}\b", text)]
    for name, values in (("friction", model.dof_frictionloss), ("spring", model.jnt_stiffness),
                         ("limits", model.jnt_limited), ("rotor", model.actuator_armature)):  # fmt: skip
        found += [name] if np.any(values) else []
    return ", ".join(found)


def compare(found: Proposal, path: Path) -> tuple[float, float, float]:
    """Largest error of a joint's torque over its peak, spins of rods at rest and free; how far the loops are open."""
    assert found.motion is not None
    motion, t = found.motion, np.linspace(0.0, STOP_S, SAMPLES)
    q, qd, qdd = sine(t, *(np.array(part) for part in (motion.offset, motion.amplitude, motion.frequency)))
    reference = MujocoReference(path, setup=found.setup)
    result = reference.inverse_dynamics(q, qd, qdd)
    prepared = reference.loaded.prepared
    assert prepared is not None
    assert prepared.preparation is not None
    free = prepared.preparation.free
    try:
        user = mujoco.MjModel.from_xml_path(str(path))
    except ValueError:  # meshes that are missing
        user = prepared.user
    still = [user.body(int(user.jnt_bodyid[joint])).name for joint in free.fixed]
    driven, named = list(found.setup.actuated), [name for name in still if name]
    held, loose = (DenseOracle(user, driven, named, rest) for rest in (True, False))
    chosen = np.linspace(0, len(t) - 1, LOOKED_AT).astype(int)
    tau, opened = np.zeros((2, LOOKED_AT, q.shape[1])), 0.0
    for row, sample in enumerate(chosen):
        qpos = user_qpos(user, prepared.model, free, result.qpos[sample])
        qvel = np.zeros(user.nv)
        new = 0
        for joint in range(user.njnt):
            if joint in free.fixed:
                continue
            width = {0: 6, 1: 3}.get(int(user.jnt_type[joint]), 1)
            d = int(prepared.model.jnt_dofadr[new])
            qvel[user.jnt_dofadr[joint] : user.jnt_dofadr[joint] + width] = result.qvel[sample, d : d + width]
            new += 4 if any(split.joint == joint for split in free.split) else 1
        tau[0, row], off, broken = held.torques(qpos, qvel, qdd[sample])
        tau[1, row] = loose.torques(qpos, qvel, qdd[sample])[0]
        opened = max(opened, off, broken)
    peak = np.abs(result.tau).max(axis=0)
    peak = np.maximum(peak, 1e-6 * peak.max())
    errors = (np.abs(tau - result.tau[chosen]).max(axis=1) / peak).max(axis=1)
    return float(errors[0]), float(errors[1]), opened


def main(root: Path, names: list[str]) -> None:
    """Print the table."""
    print(
        "| file | features | bodies, freedoms | result | error | spins free | open by | s |\n"
        "|---|---|---|---|---|---|---|---|"
    )
    for name in names:
        path = root / name
        begin = time.perf_counter()
        try:
            found = propose(path)
            text = "".join([found.prepared.source.text, *(m.decode() for m in found.prepared.source.models.values())])
            text += path.read_text(encoding="utf-8")
            row = [features(text, found.prepared.user), f"{found.survey.bodies}, {found.survey.mobility}"]
            if found.problem:
                row += [found.problem.replace(str(path), "").strip(": ").replace("|", "/"), "", "", ""]
            else:
                error, free, opened = compare(found, path)
                row += [f"runs, {len(found.setup.actuated)} driven", f"{error:.1e}", f"{free:.1e}", f"{opened:.1e}"]
        except WorkbenchError as error:
            row = ["", "", str(error).replace(str(path), "").replace(str(root), "").replace("|", "/"), "", "", ""]
        seconds = time.perf_counter() - begin
        print(f"| {name} | {' | '.join(row)} | {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
