"""Every parameter of a model as a user wants to see it: value, unit, meaning, source, and the place in the MJCF."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from workbench.errors import ModelError
from workbench.mjcf.text import find, scan
from workbench.robots import MECHANISMS
from workbench.robots.load import load_model
from workbench.robots.parameters import Target, stored_names

SCALARS = ("mass", "damping", "frictionloss", "armature")
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
    """where the value of the bundled model comes from"""
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


def show_parameters(path: str | Path) -> list[ParameterRow]:
    """List the parameters of a model in the order of the mechanism's table.

    Parameters
    ----------
    path
        An MJCF file that names its mechanism, or ``models/NAME.xml`` of those that come along.

    Raises
    ------
    ModelError, ParameterError
        See `workbench.robots.load.load_model`; or the model names no mechanism.
    """
    loaded = load_model(path)
    if loaded.kind is None or loaded.values is None:
        raise ModelError(
            f'{path}: <custom> has no <text name="mechanism">; valid: {", ".join(MECHANISMS)}', file=str(path)
        )
    elements = scan(loaded.text, loaded.file)
    read_from = {target.reads: target for target in loaded.kind.targets if target.reads}
    rows = []
    for name, info in stored_names(loaded.kind.parameter_table).items():
        target = read_from[name]
        element = find(elements, target.element, target.name)
        rows.append(
            ParameterRow(
                name=name,
                value=loaded.values[name],
                unit=info.unit,
                meaning=info.meaning,
                source=info.source,
                element=_element(target),
                attribute=target.attribute if target.attribute in SCALARS else f"{target.attribute}[{target.index}]",
                rule=_rule(target),
                line=element.line if element else None,
                places=sum(name in other.of for other in loaded.kind.targets),
            )
        )
    return rows


def _element(target: Target) -> str:
    if target.element == "inertial":
        return f"inertial of {target.name}"
    return f"{target.element} {target.name}".rstrip()


def _rule(target: Target) -> str:
    product = " * ".join(target.of)
    if target.factor in (1.0, -1.0):
        return product if target.factor > 0 else f"-{product}"
    return f"{target.factor:g} * {product}"
