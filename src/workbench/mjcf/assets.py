"""A model's specification, with what could not be read taken out where nothing depends on it."""

from __future__ import annotations

import mujoco
import numpy as np

from workbench.errors import ModelError
from workbench.mjcf.source import Missing, Source

FROM_FILE = {"mesh": "meshname", "hfield": "hfieldname"}


def parse(source: Source) -> mujoco.MjSpec:
    """MuJoCo's specification of *source*, anew at every call; geoms whose mesh is missing are not in it.

    Raises
    ------
    ModelError
        MuJoCo's own message, which names the file's line; or a mesh that is missing although mass comes from it.
    """
    try:
        spec = mujoco.MjSpec.from_string(
            source.text, include=dict(source.models) or None, assets=dict(source.assets) or None
        )
        if source.missing:
            _take_out(spec, source)
    except (ValueError, TypeError, MemoryError, mujoco.FatalError) as error:
        raise ModelError(f"{source.file}: MuJoCo does not compile it: {error}", file=source.file) from error
    return spec


def _take_out(spec: mujoco.MjSpec, source: Source) -> None:
    for texture in spec.textures:
        if texture.file in source.missing or any(file in source.missing for file in texture.cubefiles):
            texture.file = ""
            texture.cubefiles = [""] * len(texture.cubefiles)
            texture.builtin = mujoco.mjtBuiltin.mjBUILTIN_FLAT
            texture.width = texture.height = 1
    geoms: set[str] = set()
    for tag, attribute in FROM_FILE.items():
        assets = spec.meshes if tag == "mesh" else spec.hfields
        lost = {asset.name: source.missing[asset.file] for asset in assets if asset.file in source.missing}
        for geom in list(spec.geoms) if lost else ():
            missing = lost.get(getattr(geom, attribute))
            if missing is None:
                continue
            _refuse_mass(spec, geom, missing, source.file)
            if geom.name:
                geoms.add(geom.name)
            spec.delete(geom)
        for asset in list(assets):
            if asset.name in lost:
                spec.delete(asset)
    # what speaks of these geoms: contacts, and sensors, which nothing here reads
    for pair in list(spec.pairs):
        if {pair.geomname1, pair.geomname2} & geoms:
            spec.delete(pair)
    for sensor in list(spec.sensors) if geoms else ():
        if {sensor.objname, sensor.refname} & geoms:
            spec.delete(sensor)


def _refuse_mass(spec: mujoco.MjSpec, geom: mujoco.MjsGeom, missing: Missing, file: str) -> None:
    """Refuse a missing mesh from which a moving body has mass."""
    body = geom.parent
    mode = spec.compiler.inertiafromgeom
    modes = mujoco.mjtInertiaFromGeom
    inferred = mode == modes.mjINERTIAFROMGEOM_TRUE or (
        mode == modes.mjINERTIAFROMGEOM_AUTO and not body.explicitinertial
    )
    first, last = spec.compiler.inertiagrouprange
    weighs = geom.density > 0 if np.isnan(geom.mass) else geom.mass > 0
    if inferred and weighs and first <= geom.group <= last and _moves(spec, body):
        raise ModelError(
            f'{missing.file}: <{missing.tag} file="{missing.name}">: {missing.reason}, and body "{body.name}" has its'
            " mass from it; put the file below the model's folder, or write the body's <inertial>",
            file=file,
            element=missing.tag,
        )


def _moves(spec: mujoco.MjSpec, body: mujoco.MjsBody) -> bool:
    while body is not None and body != spec.worldbody:
        if body.joints:
            return True
        body = body.parent
    return False
