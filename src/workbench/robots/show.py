"""Every parameter of a model as a user wants to see it: value, unit, meaning, source, and the place in the MJCF."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from workbench.mjcf.text import find, scan, written
from workbench.robots.load import no_parameters, read_base
from workbench.robots.parameters import Target
from workbench.robots.published import source_of

SCALARS = ("mass", "damping", "frictionloss", "armature", "stiffness", "density")
"""Attributes that hold one number."""


@dataclass(frozen=True)
class ParameterRow:
    """One parameter of a model."""

    name: str
    value: float
    """SI, as the compiled model holds it"""
    unit: str
    meaning: str
    source: str
    """where the value comes from"""
    element: str
    """MJCF element that it is read from: ``inertial of rod_left``"""
    attribute: str
    """attribute and number: ``pos[2]``; the attribute alone where it has one number"""
    rule: str
    """what the number is in terms of parameters: ``k2_left * a2_left``"""
    line: int | None
    """line of the element in the file"""
    places: int
    """how many numbers of the MJCF follow from the parameter, visible geoms included"""
    settable: bool = True
    """False: MuJoCo computes it from other numbers of the file"""


def show_parameters(path: str | Path) -> list[ParameterRow]:
    """List the parameters of a robot in the order of its robot file.

    Parameters
    ----------
    path
        A robot: folder, robot file, MJCF, or the name of one that comes along.

    Raises
    ------
    ModelError, ParameterError
        See `workbench.robots.load.load_model`; or no robot file goes with the model.
    """
    base = read_base(path)
    loaded = base.loaded
    if loaded.description is None or loaded.values is None:
        raise no_parameters(loaded.file)
    elements = scan(loaded.text, loaded.file)
    targets = loaded.description.targets
    read_from = {target.reads: target for target in targets if target.reads}
    rows = []
    for name, info in loaded.description.table.infos.items():
        target = read_from[name]
        place = written(loaded.text, elements, target.element, target.name, target.attribute)
        element = place[0] if place else find(elements, target.element, target.name)
        rows.append(
            ParameterRow(
                name=name,
                value=loaded.values[name],
                unit=info.unit,
                meaning=info.meaning,
                source=source_of(loaded.description, name, loaded.values[name]),
                element=_element(target, place[0].tag if place else target.element),
                attribute=_attribute(target, place[1] if place else target.attribute),
                rule=_rule(target),
                line=element.line if element else None,
                places=sum(name in other.of for other in targets),
                settable=name not in base.computed,
            )
        )
    return rows


def _attribute(target: Target, attribute: str) -> str:
    if attribute in SCALARS or target.element == "distance" or target.index < 0:
        return attribute
    return f"{attribute}[{target.index}]"


def _element(target: Target, tag: str) -> str:
    if target.element == "inertial":
        return f"{tag} of {target.name}"
    if target.element == "distance":
        return f"distance {' '.join(target.name.split())}"
    return f"{target.element} {target.name}".rstrip()


def _rule(target: Target) -> str:
    product = " * ".join(target.of)
    if target.factor in (1.0, -1.0):
        return product if target.factor > 0 else f"-{product}"
    return f"{target.factor:g} * {product}"
