"""Small random mechanisms with closed loops, as MJCF: trees of hinge, slide, ball and free joints, and what files hold.

Every loop is closed in the initial pose by construction: sites, anchors and polynomials are placed where the tree
stands. The actuated joints are chosen by the null space of MuJoCo's own `efc_J`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from scipy.linalg import qr

from nullspace_oracle import NullSpaceOracle

Rng = np.random.Generator
WORST_CONDITION = 30.0
"""Of the choice of actuators: worse ones are near a singular pose, where no two programs agree to nine digits."""


@dataclass(frozen=True)
class RandomMechanism:
    """One mechanism."""

    text: str
    actuated: list[str]
    spins: list[tuple[str, tuple[str, list[float]], tuple[str, list[float]]]]
    features: set[str]


@dataclass
class Draft:
    """A mechanism being drawn."""

    rng: Rng
    bodies: list[str] = field(default_factory=list)
    """names; the nesting is in ``parents``"""
    parents: dict[str, str] = field(default_factory=dict)
    heads: dict[str, str] = field(default_factory=dict)
    insides: dict[str, list[str]] = field(default_factory=dict)
    world: list[str] = field(default_factory=list)
    joints: list[str] = field(default_factory=list)
    """names of hinges and slides"""
    equalities: list[str] = field(default_factory=list)
    tendons: list[str] = field(default_factory=list)
    spins: list[tuple[str, tuple[str, list[float]], tuple[str, list[float]]]] = field(default_factory=list)
    features: set[str] = field(default_factory=set)
    framed: set[str] = field(default_factory=set)

    def chance(self, probability: float) -> bool:
        return bool(self.rng.random() < probability)


def numbers(values: object) -> str:
    return " ".join(repr(float(v)) for v in np.atleast_1d(np.asarray(values, dtype=float)))


def inertial(rng: Rng) -> str:
    principal = rng.uniform(0.002, 0.02, 3)
    principal[2] = rng.uniform(abs(principal[0] - principal[1]) + 1e-4, principal[0] + principal[1])
    return (
        f'<inertial pos="{numbers(rng.normal(0, 0.05, 3))}" quat="{numbers(unit(rng, 4))}"'
        f' mass="{rng.uniform(0.2, 2)!r}" diaginertia="{numbers(principal)}"/>'
    )


def unit(rng: Rng, size: int) -> np.ndarray:
    vector = rng.normal(size=size)
    return vector / np.linalg.norm(vector)


def joint(draft: Draft, name: str, kind: str) -> str:
    rng = draft.rng
    out = f'<joint name="{name}" type="{kind}"'
    if kind != "ball":
        out += f' axis="{numbers(unit(rng, 3))}"'
        draft.joints.append(name)
    if draft.chance(0.5) and kind != "slide":
        out += f' pos="{numbers(rng.normal(0, 0.05, 3))}"'
    for attribute, size, probability in (
        ("damping", 1, 0.3), ("frictionloss", 1, 0.3), ("armature", 1, 0.2), ("stiffness", 1, 0.2),
    ):  # fmt: skip
        if draft.chance(probability):
            values = rng.uniform(0.05, 0.5, size)
            if attribute in ("damping", "stiffness") and draft.chance(0.3):
                values = rng.uniform(0.05, 0.3, 3)
            out += f' {attribute}="{numbers(values)}"'
            draft.features.add(attribute if len(values) == 1 else f"polynomial {attribute}")
    if "stiffness" in out and kind != "ball":
        out += f' springref="{rng.normal(0, 0.3)!r}"'
    if kind in ("hinge", "slide") and draft.chance(0.3):
        out += f' ref="{rng.normal(0, 0.3)!r}"'
        draft.features.add("ref")
    draft.features.add(kind)
    return out + "/>"


def add_body(draft: Draft, parent: str, kind: str) -> str:
    rng, name = draft.rng, f"b{len(draft.bodies)}"
    place = f'pos="{numbers(rng.normal(0, 0.25, 3))}" quat="{numbers(unit(rng, 4))}"'
    if kind == "free":
        head = f'<body name="{name}" {place}><freejoint name="j_{name}"/>'
        draft.features.add("free")
    else:
        head = f'<body name="{name}" {place}>{joint(draft, "j_" + name, kind)}'
    extra = inertial(rng)
    if draft.chance(0.1):
        head = head.replace("<body ", f'<body gravcomp="{rng.uniform(0, 1)!r}" ', 1)
        draft.features.add("gravcomp")
    draft.bodies.append(name)
    draft.parents[name] = parent
    draft.heads[name] = head
    draft.insides[name] = [extra]
    if draft.chance(0.2):
        draft.framed.add(name)
        draft.features.add("frame")
    return name


def write(draft: Draft, option: str = "", actuator: str = "", head: str = "") -> str:
    def body(name: str) -> str:
        children = "".join(body(child) for child in draft.bodies if draft.parents[child] == name)
        text = draft.heads[name] + "".join(draft.insides[name]) + children + "</body>"
        return f'<frame pos="0.1 -0.05 0.02" euler="0.1 0.2 0.3">{text}</frame>' if name in draft.framed else text

    tree = "".join(body(name) for name in draft.bodies if draft.parents[name] == "world")
    tendon = f"<tendon>{''.join(draft.tendons)}</tendon>" if draft.tendons else ""
    return (
        f'<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81" {option}><flag contact="disable"/></option>'
        f"{head}"
        f"<worldbody>{''.join(draft.world)}{tree}</worldbody>{tendon}<equality>{''.join(draft.equalities)}</equality>"
        f"{actuator}</mujoco>"
    )


def poses(draft: Draft) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(write(draft))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def local(model: mujoco.MjModel, data: mujoco.MjData, name: str, point: np.ndarray) -> np.ndarray:
    body = model.body(name).id
    return data.xmat[body].reshape(3, 3).T @ (point - data.xpos[body])


def add_loop(draft: Draft, kind: str, one: str, two: str) -> None:
    """Close a loop between two bodies (or a body and the world) where they stand."""
    rng, (model, data) = draft.rng, poses(draft)
    count = len(draft.equalities)
    point = data.xpos[model.body(one).id] + rng.normal(0, 0.15, 3)
    if draft.chance(0.5):
        anchor = numbers(local(model, data, one if kind == "connect" else two, point))
        second = "" if two == "world" and draft.chance(0.5) and kind == "connect" else f' body2="{two}"'
        scale = ' torquescale="0"' if kind == "weld" and draft.chance(0.2) else ""
        if scale:
            draft.features.add("torquescale 0")
        draft.equalities.append(f'<{kind} name="e{count}" body1="{one}"{second} anchor="{anchor}"{scale}/>')
        draft.features.add(f"{kind} by bodies")
        return
    turn = unit(rng, 4)
    for end, name in ((1, one), (2, two)):
        back, whole = np.zeros(4), np.zeros(4)
        mujoco.mju_negQuat(back, data.xquat[model.body(name).id])
        mujoco.mju_mulQuat(whole, back, turn)
        site = f'<site name="s{count}_{end}" pos="{numbers(local(model, data, name, point))}" quat="{numbers(whole)}"/>'
        (draft.world if name == "world" else draft.insides[name]).append(site)
    draft.equalities.append(f'<{kind} name="e{count}" site1="s{count}_1" site2="s{count}_2"/>')
    draft.features.add(f"{kind} by sites")


def add_rod(draft: Draft, one: str, two: str) -> None:
    """A body of revolution on a ball joint at *one*, connected to *two* where that stands."""
    rng, name = draft.rng, f"b{len(draft.bodies)}"
    model, data = poses(draft)
    start = rng.normal(0, 0.1, 3)
    body = model.body(one).id
    begin = data.xpos[body] + data.xmat[body].reshape(3, 3) @ start
    end = data.xpos[model.body(two).id] + rng.normal(0, 0.1, 3)
    along = data.xmat[body].reshape(3, 3).T @ (end - begin)
    draft.bodies.append(name)
    draft.parents[name] = one
    draft.heads[name] = f'<body name="{name}" pos="{numbers(start)}"><joint name="j_{name}" type="ball"/>'
    draft.insides[name] = [f'<geom type="capsule" fromto="0 0 0 {numbers(along)}" size="0.01" mass="0.3"/>']
    count = len(draft.equalities)
    if draft.chance(0.5):
        draft.equalities.append(f'<connect name="e{count}" body1="{name}" body2="{two}" anchor="{numbers(along)}"/>')
    else:
        draft.insides[name].append(f'<site name="s{count}_1" pos="{numbers(along)}"/>')
        site = f'<site name="s{count}_2" pos="{numbers(local(model, data, two, end))}"/>'
        (draft.world if two == "world" else draft.insides[two]).append(site)
        draft.equalities.append(f'<connect name="e{count}" site1="s{count}_1" site2="s{count}_2"/>')
    draft.spins.append((name, (name, [0.0, 0.0, 0.0]), (name, along.tolist())))
    draft.features.add("rod")


def add_coupling(draft: Draft) -> None:
    """A polynomial between two joints, or between two fixed tendons."""
    rng = draft.rng
    if len(draft.joints) < 3:
        return
    count = len(draft.equalities)
    one, two, three = (draft.joints[i] for i in rng.permutation(len(draft.joints))[:3])
    bend = numbers([0.0, rng.uniform(0.5, 1.5), *rng.normal(0, 0.3, 3)])
    if draft.chance(0.5):
        draft.equalities.append(f'<joint name="e{count}" joint1="{one}" joint2="{two}" polycoef="{bend}"/>')
        draft.features.add("joint equality")
        return
    extra = ' stiffness="0.4" damping="0.2"' if draft.chance(0.5) else ""
    extra += ' frictionloss="0.3"' if draft.chance(0.3) else ""
    draft.tendons.append(
        f'<fixed name="t{count}"{extra}><joint joint="{one}" coef="1.3"/><joint joint="{two}" coef="-0.4"/></fixed>'
        f'<fixed name="u{count}"><joint joint="{three}" coef="0.8"/></fixed>'
    )
    draft.equalities.append(f'<tendon name="e{count}" tendon1="t{count}" tendon2="u{count}" polycoef="{bend}"/>')
    draft.features.add("tendon equality")


def draw(seed: int) -> RandomMechanism | None:
    """Draw one mechanism; None where this one has no freedom, or none that hinges and slides can drive."""
    draft = Draft(rng := np.random.default_rng(seed))
    for _ in range(int(rng.integers(3, 7))):
        parent = "world" if not draft.bodies or draft.chance(0.3) else str(rng.choice(draft.bodies))
        kinds = ["hinge", "hinge", "hinge", "slide", "ball"]
        add_body(draft, parent, str(rng.choice(kinds)))
    if draft.chance(0.3):
        add_body(draft, "world", "free")
    ends = [*draft.bodies, "world"]
    if draft.chance(0.4):
        one, two = (str(name) for name in rng.permutation(ends)[:2])
        if one != "world":
            add_rod(draft, one, two)
    if draft.chance(0.4):
        add_coupling(draft)
    platform = str(rng.choice([b for b in draft.bodies if b not in {s[0] for s in draft.spins}]))
    draft.insides[platform].append(f'<site name="platform" pos="{numbers(rng.normal(0, 0.1, 3))}"/>')
    plain = [name for name in draft.bodies if name not in {s[0] for s in draft.spins}]
    for _ in range(12):
        found = actuators(draft)
        if found is not None:
            break
        two = str(rng.choice([*plain, "world"]))
        others = [name for name in plain if name != two]
        if others:
            add_loop(draft, "connect" if draft.chance(0.7) else "weld", str(rng.choice(others)), two)
    if found is None or not draft.equalities:
        return None
    option = ""
    if draft.chance(0.2) and not draft.spins:  # on a rod it depends on a spin that nothing determines
        option = 'density="50" viscosity="0.3"'
        draft.features.add("fluid")
    motors = []
    for name in found:
        extra = ""
        if draft.chance(0.3):
            extra = ' gear="3" armature="0.02" damping="0.05"'
            draft.features.add("actuator armature")
        motors.append(f'<motor joint="{name}"{extra}/>')
    head = '<default><joint damping="0.03"/></default>' if draft.chance(0.3) and not draft.spins else ""
    custom = '<custom><text name="base_body" data="world"/><text name="platform_site" data="platform"/></custom>'
    text = write(draft, option, f"<actuator>{''.join(motors)}</actuator>", head + custom)
    return RandomMechanism(text, found, draft.spins, draft.features)


def actuators(draft: Draft) -> list[str] | None:
    """Joints that drive the mechanism as it is: as many as its freedoms, one to three; None where there are none."""
    if not draft.joints:
        return None
    oracle = NullSpaceOracle(write(draft), [], draft.spins)
    jacobian, residual = oracle.rows(oracle.model.qpos0, np.zeros(oracle.model.nv))
    if np.abs(residual).max(initial=0.0) > 1e-9:
        return None
    values, vectors = np.linalg.svd(jacobian, full_matrices=True)[1:]
    kept = int(np.count_nonzero(values > 1e-8 * max(values, default=1.0)))
    basis = vectors[kept:].T
    if not 1 <= basis.shape[1] <= 3:
        return None
    dofs = [int(oracle.model.jnt_dofadr[oracle.model.joint(name).id]) for name in draft.joints]
    order = qr(basis[dofs].T, pivoting=True, mode="r")[1][: basis.shape[1]]
    chosen = sorted(int(i) for i in order)
    if len(chosen) < basis.shape[1] or np.linalg.cond(basis[[dofs[i] for i in chosen]]) > WORST_CONDITION:
        return None
    w = basis @ np.linalg.inv(basis[[dofs[i] for i in chosen]])
    return [draft.joints[i] for i in chosen] if np.abs(w).max() < WORST_CONDITION else None
