"""What a campaign says about an MJCF that says nothing itself: which joints are driven, what moves, where it begins.

The answers are written into the text (in memory) as the elements that the workbench's own models carry, so that the
reference, the replay and a second engine all see one and the same model. Line numbers stay those of the user's file.
"""

from __future__ import annotations

import xml.parsers.expat as expat
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.errors import ModelError, did_you_mean
from workbench.mjcf.compile import custom_text
from workbench.mjcf.text import scan

IGNORABLE = ("contacts", "limits", "springs", "tendons", "free bodies")
"""What a campaign may leave out of account; none of it is covered otherwise."""

TURN = 2.0 * np.pi
"""A hinge that begins further than one turn from zero was written in degrees."""

Compile = Callable[[str, str], mujoco.MjModel]

OWN_TEXTS = ("mechanism", "base_body", "platform_site", "lumped_bodies")


@dataclass(frozen=True)
class Setup:
    """Which joints of an MJCF are driven, which site is the platform, and how the loops are first closed."""

    actuated: tuple[str, ...]
    """hinge and slide joints, in the order of q and tau"""
    platform_site: str
    base_body: str = "world"
    """the fixed body in whose frame platform positions and forces are given"""
    keyframe: str = ""
    """keyframe from which the loops are closed; empty: the one called ``home``, or the model as drawn"""
    initial: tuple[tuple[str, float], ...] = ()
    """coordinates (m, rad) of joints, over those of the keyframe: they pick the assembly branch"""
    lumped_bodies: tuple[str, ...] = ()
    """bars that lose their rotational inertia in the lumped mass model"""
    ignore: tuple[str, ...] = ()
    """what of `IGNORABLE` is left out of account"""


def says_it_itself(model: mujoco.MjModel, setup: Setup) -> bool:
    """Whether a model holds the set-up already, as the workbench's own do: then it is taken as it is."""
    if setup.ignore or setup.initial or setup.keyframe:
        return False
    texts = {"base_body": setup.base_body, "platform_site": setup.platform_site}
    if any(custom_text(model, name) != value for name, value in texts.items()):
        return False
    if set((custom_text(model, "lumped_bodies") or "").split()) != set(setup.lumped_bodies):
        return False
    joints = mujoco.mjtObj.mjOBJ_JOINT
    on_joints = all(kind == mujoco.mjtTrn.mjTRN_JOINT for kind in map(mujoco.mjtTrn, model.actuator_trntype))
    driven = [mujoco.mj_id2name(model, joints, int(index)) for index in model.actuator_trnid[:, 0]]
    return on_joints and tuple(driven) == setup.actuated


def prepare(text: str, file: str, setup: Setup, compiled: Compile) -> str:
    """Return the MJCF text with the set-up written into it.

    Parameters
    ----------
    text, file
        The MJCF and the name under which errors speak of it.
    setup
        What the campaign says.
    compiled
        Compiles a text, `workbench.mjcf.compile_text`.

    Raises
    ------
    ModelError
        A name that the model does not have, with the nearest one; a joint that cannot be driven; an angle in degrees.
    """
    scan(text, file)
    model = compiled(text, file)
    _check_names(model, file, setup)
    for what in setup.ignore:
        if what not in IGNORABLE:
            raise ModelError(f'{file}: ignore "{what}"{did_you_mean(what, IGNORABLE)}', file=file)
    if "free bodies" in setup.ignore:
        _refuse_held(model, file)
    # actuators go with their sensors; keyframes hold one number per coordinate and actuator, so they go too
    stripped = _blank(text, _unwanted(setup))
    bare = compiled(stripped, file)
    qpos = _start(model, bare, file, setup)
    end = stripped.rindex("</mujoco>")
    return stripped[:end] + _elements(setup, qpos) + stripped[end:]


def _names(model: mujoco.MjModel, kind: mujoco.mjtObj, count: int) -> list[str]:
    return [mujoco.mj_id2name(model, kind, i) or "" for i in range(count)]


def _check_names(model: mujoco.MjModel, file: str, setup: Setup) -> None:
    obj = mujoco.mjtObj
    joints = _names(model, obj.mjOBJ_JOINT, model.njnt)
    bodies = _names(model, obj.mjOBJ_BODY, model.nbody)
    asked = [("actuated", "joint", name, joints) for name in setup.actuated]
    asked += [("platform_site", "site", setup.platform_site, _names(model, obj.mjOBJ_SITE, model.nsite))]
    asked += [("base_body", "body", setup.base_body, bodies)]
    asked += [("lumped_bodies", "body", name, bodies) for name in setup.lumped_bodies]
    asked += [("initial", "joint", name, joints) for name, _ in setup.initial]
    if setup.keyframe:
        asked += [("keyframe", "keyframe", setup.keyframe, _names(model, obj.mjOBJ_KEY, model.nkey))]
    for key, what, name, known in asked:
        if name not in known:
            valid = [n for n in known if n]
            hint = did_you_mean(name, valid) or f"; it names no {what}"
            raise ModelError(f'{file}: {key} = "{name}": no such {what}{hint}', file=file, key=key, value=name)
    for name in (*setup.actuated, *(joint for joint, _ in setup.initial)):
        kind = mujoco.mjtJoint(model.jnt_type[joints.index(name)])
        if kind not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
            shown = kind.name.removeprefix("mjJNT_").lower()
            raise ModelError(f'{file}: joint "{name}" is a {shown} joint; allowed: a hinge or a slide', file=file)
    for name in setup.actuated:
        if setup.actuated.count(name) > 1:
            raise ModelError(f'{file}: actuated names joint "{name}" twice', file=file, joint=name)
    for name, value in setup.initial:
        hinge = mujoco.mjtJoint(model.jnt_type[joints.index(name)]) == mujoco.mjtJoint.mjJNT_HINGE
        if hinge and abs(value) > TURN:
            raise ModelError(
                f'{file}: initial: joint "{name}" = {value:g} rad is more than a turn; angles are in radians'
                f" ({value:g} degrees are {np.radians(value):.6g} rad)",
                file=file,
                joint=name,
            )


def _refuse_held(model: mujoco.MjModel, file: str) -> None:
    """A free body that a loop holds is a part of the mechanism; fixed where it stands, it would hold the mechanism."""
    for eq in range(model.neq):
        sites = mujoco.mjtObj(model.eq_objtype[eq]) == mujoco.mjtObj.mjOBJ_SITE
        for index in (int(model.eq_obj1id[eq]), int(model.eq_obj2id[eq])) if sites else ():
            root = int(model.body_rootid[model.site_bodyid[index]])
            joint = int(model.body_jntadr[root])
            if joint >= 0 and mujoco.mjtJoint(model.jnt_type[joint]) == mujoco.mjtJoint.mjJNT_FREE:
                name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint) or f"#{joint}"
                raise ModelError(
                    f'{file}: joint "{name}" is free and a loop holds its body, so it cannot be ignored; hang the body'
                    " on one link by a joint and close the other loops",
                    file=file,
                    joint=name,
                )


def _unwanted(setup: Setup) -> Callable[[str, str, Mapping[str, str]], bool]:
    """Which elements do not go into the prepared text: parent's tag, own tag, attributes -> whether."""
    sections = {"actuator", "sensor", "keyframe", *(["tendon"] if "tendons" in setup.ignore else [])}

    def unwanted(parent: str, tag: str, attributes: Mapping[str, str]) -> bool:
        if parent == "mujoco":
            return tag in sections
        if parent == "custom" and tag == "text":
            return attributes.get("name") in OWN_TEXTS
        if parent == "equality" and tag == "tendon":
            return "tendons" in setup.ignore
        free = tag == "freejoint" or (tag == "joint" and attributes.get("type") == "free")
        return free and "free bodies" in setup.ignore

    return unwanted


def _blank(text: str, unwanted: Callable[[str, str, Mapping[str, str]], bool]) -> str:
    """Put spaces in place of elements, so that lines keep their numbers."""
    raw = bytearray(text.encode())
    spans: list[tuple[int, int]] = []
    path: list[tuple[str, int]] = []
    parser = expat.ParserCreate("utf-8")

    def begin(tag: str, attributes: dict[str, str]) -> None:
        out = unwanted(path[-1][0] if path else "", tag, attributes)
        path.append((tag, parser.CurrentByteIndex if out else -1))

    def finish(tag: str) -> None:
        start = path.pop()[1]
        if start >= 0:
            spans.append((start, raw.index(b">", parser.CurrentByteIndex) + 1))

    parser.StartElementHandler = begin
    parser.EndElementHandler = finish
    parser.Parse(bytes(raw), True)
    for start, end in spans:
        raw[start:end] = bytes(byte if byte in b"\r\n" else ord(" ") for byte in raw[start:end])
    return raw.decode()


def _start(model: mujoco.MjModel, bare: mujoco.MjModel, file: str, setup: Setup) -> np.ndarray:
    """Coordinates ``(nq,)`` of *bare* from which the loops are closed."""
    key = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, setup.keyframe or "home")
    before = model.key_qpos[key] if key >= 0 else model.qpos0
    qpos = np.array(bare.qpos0)
    kept = [j for j in range(model.njnt) if bare.njnt == model.njnt or model.jnt_type[j] != mujoco.mjtJoint.mjJNT_FREE]
    for new, old in enumerate(kept):
        size = 4 if bare.jnt_type[new] == mujoco.mjtJoint.mjJNT_BALL else 1
        if bare.jnt_type[new] == mujoco.mjtJoint.mjJNT_FREE:
            size = 7
        a, b = int(bare.jnt_qposadr[new]), int(model.jnt_qposadr[old])
        qpos[a : a + size] = before[b : b + size]
    for name, value in setup.initial:
        joint = mujoco.mj_name2id(bare, mujoco.mjtObj.mjOBJ_JOINT, name)
        qpos[bare.jnt_qposadr[joint]] = value
    return qpos


def _elements(setup: Setup, qpos: np.ndarray) -> str:
    texts = {"base_body": setup.base_body, "platform_site": setup.platform_site}
    if setup.lumped_bodies:
        texts["lumped_bodies"] = " ".join(setup.lumped_bodies)
    flags = {"contacts": "contact", "limits": "limit", "springs": "spring"}
    off = "".join(f' {flags[what]}="disable"' for what in setup.ignore if what in flags)
    option = f"<option><flag{off}/></option>" if off else ""
    custom = "".join(f'<text name="{name}" data="{value}"/>' for name, value in texts.items())
    motors = "".join(f'<motor joint="{name}"/>' for name in setup.actuated)
    home = " ".join(repr(float(value)) for value in qpos)
    keyframe = f'<keyframe><key name="home" qpos="{home}"/></keyframe>' if len(qpos) else ""
    return f"{option}<custom>{custom}</custom><actuator>{motors}</actuator>{keyframe}"
