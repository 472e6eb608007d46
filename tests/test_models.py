"""The bundled models as artefacts: they compile, their loops close, they simulate without a warning, all has a name."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from workbench.data_files import bundled_directory, bundled_names

MODELS = [bundled_directory("models") / name for name in bundled_names("models")]
KINDS = {
    "nbody": mujoco.mjtObj.mjOBJ_BODY, "njnt": mujoco.mjtObj.mjOBJ_JOINT, "nsite": mujoco.mjtObj.mjOBJ_SITE,
    "ngeom": mujoco.mjtObj.mjOBJ_GEOM, "neq": mujoco.mjtObj.mjOBJ_EQUALITY, "nu": mujoco.mjtObj.mjOBJ_ACTUATOR,
}  # fmt: skip
OPEN_LOOP = 5e-4
"""metres or radians: how far soft constraints may open in a fall of five seconds"""


@pytest.fixture(params=MODELS, ids=lambda path: path.stem)
def path(request: pytest.FixtureRequest) -> Path:
    return request.param


def loop_gap(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    rows = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY.value
    assert rows.sum() >= 9
    return float(np.abs(data.efc_pos[rows]).max())


@pytest.mark.parametrize("start", ["as the file is opened", "home"])
def test_five_seconds_without_a_warning(path: Path, start: str) -> None:
    said: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(said.append)
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        if start == "home":
            mujoco.mj_resetDataKeyframe(model, data, model.key(start).id)
        mujoco.mj_forward(model, data)
        assert loop_gap(model, data) < 1e-12
        moved = data.qpos.copy()
        widest = 0.0
        while data.time < 5.0:
            mujoco.mj_step(model, data)
            widest = max(widest, loop_gap(model, data))
    finally:
        mujoco.set_mju_user_warning(before)
    assert said == []
    assert not np.any(data.warning.number)
    assert widest < OPEN_LOOP
    # gravity moved it, so that the loops had something to hold
    assert np.abs(data.qpos - moved).max() > 0.1


def test_a_loop_that_is_not_closed_is_seen(path: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[0] += 1e-3
    data.qpos[1] += 1e-3
    mujoco.mj_forward(model, data)
    assert loop_gap(model, data) > OPEN_LOOP


def test_everything_has_a_name_and_geoms_weigh_nothing(path: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(path))
    for count, kind in KINDS.items():
        names = [mujoco.mj_id2name(model, kind, index) for index in range(getattr(model, count))]
        assert all(names), (count, names)
    spec = mujoco.MjSpec.from_file(str(path))
    for body in spec.bodies[1:]:
        assert body.explicitinertial, body.name
    for geom in spec.geoms:
        assert geom.contype == geom.conaffinity == 0, geom.name
        assert geom.mass == 0, geom.name


def test_every_number_of_a_paper_names_its_source(path: Path) -> None:
    """A length, mass or inertia in the file stands beside a comment that says where it comes from."""
    text = path.read_text()
    assert "Table" in text
    for line_number, line in enumerate(text.splitlines(), start=1):
        if "<inertial" in line:
            near = "\n".join(text.splitlines()[max(0, line_number - 5) : line_number])
            assert "<!--" in near, f"line {line_number}: {line.strip()}"
