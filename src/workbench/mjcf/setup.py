"""What a campaign says about an MJCF that says nothing itself: which joints are driven, what moves, where it begins.

The answers are put into MuJoCo's own specification of the file, never into its text, as the elements that the
workbench's own models carry, so that the reference, the replay and a second engine all see one and the same model.
`workbench.mjcf.same_robot` then holds the compiled result against the user's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, did_you_mean
from workbench.mjcf.actuators import actuator_effects
from workbench.mjcf.compile import custom_text
from workbench.mjcf.free_joints import FreeJoints, free_joints, split_free_joint
from workbench.mjcf.refusal import joined

IGNORABLE = ("contacts", "limits", "springs", "tendons", "free bodies")
"""What a campaign may leave out of account."""

LEFT_OUT = ("contact", "limit")
"""What is always left out, and looked at along the motion (`workbench.reference.crossings`)."""

TURN = 2.0 * np.pi
"""A hinge that begins further than one turn from zero was written in degrees."""

OWN_TEXTS = ("mechanism", "base_body", "platform_site", "lumped_bodies")
PLATFORM = "workbench_platform"
"""the site that stands at the origin of a body which is the platform"""


@dataclass(frozen=True)
class Setup:
    """Which joints of an MJCF are driven, what is the platform, and how the loops are first closed."""

    actuated: tuple[str, ...]
    """hinge and slide joints, in the order of q and tau"""
    platform_site: str = ""
    platform_body: str = ""
    """the body whose origin is the platform, where there is no site"""
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
    fix_base: str = ""
    """body on a free joint that stands still: the base of a robot that walks or flies"""


def says_it_itself(model: mujoco.MjModel, setup: Setup) -> bool:
    """Whether a model holds the set-up already, as the workbench's own do: then it is taken as it is."""
    if setup.ignore or setup.initial or setup.keyframe or setup.platform_body or setup.fix_base:
        return False
    if _left_out_by_preparation(model):
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


def _left_out_by_preparation(model: mujoco.MjModel) -> bool:
    """Whether a model has contacts or limits that are not switched off in it."""
    off = model.opt.disableflags
    colliding = model.npair or (model.geom_contype | model.geom_conaffinity).any()
    contact = not off & mujoco.mjtDisableBit.mjDSBL_CONTACT and colliding
    limits = (model.jnt_limited, model.tendon_limited)
    limit = not off & mujoco.mjtDisableBit.mjDSBL_LIMIT and any(values.any() for values in limits)
    return bool(contact or limit)


@dataclass(frozen=True)
class Preparation:
    """What has to be done to a specification: worked out once, on the user's compiled model, and applied to copies."""

    setup: Setup
    free: FreeJoints
    armature: tuple[tuple[int, float], ...]
    """joint -> what the file's actuators add, kg or kg m^2"""
    damping: tuple[tuple[int, tuple[float, ...]], ...]
    qpos: tuple[float, ...] = ()
    """home of the prepared model"""

    def apply(self, spec: mujoco.MjSpec) -> mujoco.MjSpec:
        """Change *spec*, a fresh one of the user's file, and return it."""
        setup = self.setup
        joints, bodies = list(spec.joints), list(spec.bodies)
        for joint, more in self.armature:
            joints[joint].armature += more
        for joint, losses in self.damping:
            joints[joint].damping = np.array(joints[joint].damping) + losses
        # tuples and sensors may speak of actuators; keyframes hold one number per coordinate and actuator
        for elements in (spec.sensors, spec.tuples, spec.keys, spec.actuators):
            for element in list(elements):
                spec.delete(element)
        if "tendons" in setup.ignore:
            for equality in list(spec.equalities):
                if equality.type == mujoco.mjtEq.mjEQ_TENDON:
                    spec.delete(equality)
            for tendon in list(spec.tendons):
                spec.delete(tendon)
        for index in (*self.free.fixed, *(split.joint for split in self.free.split)):
            split = next((s for s in self.free.split if s.joint == index), None)
            if split:
                split_free_joint(bodies[split.body], joints[index], split)
            spec.delete(joints[index])
        flags = (*LEFT_OUT, *(what for what in ("spring",) if f"{what}s" in setup.ignore))
        for flag in flags:
            spec.option.disableflags |= getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}").value
        self._name(spec, bodies)
        for name in setup.actuated:
            _motor(spec, name)
        if self.qpos:
            spec.add_key(name="home", qpos=list(self.qpos))
        return spec

    def _name(self, spec: mujoco.MjSpec, bodies: list[mujoco.MjsBody]) -> None:
        setup = self.setup
        site = setup.platform_site
        if setup.platform_body:
            site = PLATFORM
            next(body for body in bodies if body.name == setup.platform_body).add_site(name=PLATFORM)
        texts = {"base_body": setup.base_body, "platform_site": site}
        if setup.lumped_bodies:
            texts["lumped_bodies"] = " ".join(setup.lumped_bodies)
        for text in list(spec.texts):
            if text.name in OWN_TEXTS:
                spec.delete(text)
        for name, value in texts.items():
            added = spec.add_text()
            added.name, added.data = name, value


def _motor(spec: mujoco.MjSpec, joint: str) -> None:
    """Add a motor; nothing that acts on a joint is left to the defaults of the file."""
    limited = mujoco.mjtLimited.mjLIMITED_FALSE
    motor = spec.add_actuator()
    motor.set_to_motor()
    motor.trntype, motor.target, motor.gear = mujoco.mjtTrn.mjTRN_JOINT, joint, [1.0, 0, 0, 0, 0, 0]
    motor.gainprm, motor.biasprm = [1.0] + [0.0] * 9, [0.0] * 10
    motor.gaintype, motor.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_NONE
    motor.dyntype, motor.dynprm, motor.actdim = mujoco.mjtDyn.mjDYN_NONE, [1.0] + [0.0] * 9, -1
    motor.ctrllimited = motor.forcelimited = motor.actlimited = limited
    for limits in ("ctrlrange", "forcerange", "actrange", "lengthrange", "velrange", "ffrange"):
        setattr(motor, limits, [0.0, 0.0])
    motor.armature, motor.damping, motor.delay, motor.nsample = 0.0, [0.0] * 3, 0.0, 0
    motor.inheritrange, motor.actearly, motor.group = 0.0, False, 0


def plan(model: mujoco.MjModel, file: str, setup: Setup) -> Preparation:
    """Work out what *setup* means for the user's compiled *model*.

    Raises
    ------
    ModelError
        A name that the model does not have, with the nearest one; a joint that cannot be driven; an angle in degrees;
        an actuator whose rotor no joint can stand for.
    """
    setup = _platform(model, setup)
    _check_names(model, file, setup)
    for what in setup.ignore:
        if what not in IGNORABLE:
            raise ModelError(f'{file}: ignore "{what}"{did_you_mean(what, IGNORABLE)}', file=file)
    effects = actuator_effects(model)
    if effects.refusals:
        raise joined(file, effects.refusals)
    free = free_joints(model, file, fix_base=setup.fix_base, rest="free bodies" in setup.ignore)
    armature = tuple((joint, float(value)) for joint, value in effects.armature.items())
    damping = tuple((joint, tuple(map(float, value))) for joint, value in effects.damping.items())
    return Preparation(setup, free, armature, damping)


def _platform(model: mujoco.MjModel, setup: Setup) -> Setup:
    """A platform that no site has the name of may be a body."""
    name, obj = setup.platform_site, mujoco.mjtObj
    named = [bool(name) and mujoco.mj_name2id(model, kind, name) >= 0 for kind in (obj.mjOBJ_SITE, obj.mjOBJ_BODY)]
    return replace(setup, platform_site="", platform_body=name) if named == [False, True] else setup


def start(model: mujoco.MjModel, bare: mujoco.MjModel, preparation: Preparation) -> FloatArray:
    """Coordinates ``(nq,)`` of the prepared model *bare* from which the loops are closed."""
    setup = preparation.setup
    key = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, setup.keyframe or "home")
    before = model.key_qpos[key] if key >= 0 else model.qpos0
    qpos = preparation.free.carried(model, bare, np.array(before))
    for name, value in setup.initial:
        joint = mujoco.mj_name2id(bare, mujoco.mjtObj.mjOBJ_JOINT, name)
        qpos[bare.jnt_qposadr[joint]] = value
    return qpos


def _names(model: mujoco.MjModel, kind: mujoco.mjtObj, count: int) -> list[str]:
    return [mujoco.mj_id2name(model, kind, i) or "" for i in range(count)]


def _check_names(model: mujoco.MjModel, file: str, setup: Setup) -> None:
    obj = mujoco.mjtObj
    joints = _names(model, obj.mjOBJ_JOINT, model.njnt)
    bodies = _names(model, obj.mjOBJ_BODY, model.nbody)
    asked = [("actuated", "joint", name, joints) for name in setup.actuated]
    if bool(setup.platform_site) == bool(setup.platform_body):
        raise ModelError(
            f"{file}: the platform is a site or a body: give one of platform_site, platform_body", file=file
        )
    if setup.platform_site:
        asked += [("platform_site", "site", setup.platform_site, _names(model, obj.mjOBJ_SITE, model.nsite))]
    asked += [("platform_body", "body", name, bodies) for name in (setup.platform_body,) if name]
    asked += [("fix_base", "body", name, bodies) for name in (setup.fix_base,) if name]
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
    for name in setup.lumped_bodies:
        if len(name.split()) > 1:
            raise ModelError(f'{file}: lumped_bodies: body "{name}" has a blank in its name; rename it', file=file)
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
