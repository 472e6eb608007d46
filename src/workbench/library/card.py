"""``card.toml`` of a robot of the library: what robot file and model do not say; docs/robots.md lists the keys."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError, model_validator

from workbench.documents import Form, read_toml
from workbench.errors import SpecError
from workbench.schema import Strict

FILE = "card.toml"

Count = Annotated[int, Field(ge=0)]


class MobilitySpec(Strict):
    """Gogu's count: M = joints - r with r = sum of limbs - platform + inside; [GarciaMurillo2016] eq. (1)-(8)."""

    joints: Count
    """freedoms of all joints, a universal joint 2, a spherical one 3"""
    limbs: Annotated[list[Count], Field(min_length=1)]
    """connectivity of each limb, taken alone"""
    platform: Count
    """connectivity of the platform: what all limbs allow it"""
    inside: Count = 0
    """joint freedoms that closed loops inside of limbs take"""
    idle: Count = 0
    """freedoms that move nothing else: the spin of a rod between two spherical joints"""
    note: str = ""

    @property
    def lost(self) -> int:
        """Joint freedoms that lose their independence when the loops close, r."""
        return sum(self.limbs) - self.platform + self.inside

    @property
    def mobility(self) -> int:
        """Freedoms of the robot, idle spins left out."""
        return self.joints - self.lost - self.idle


class Card(Strict):
    """What a robot of the library is."""

    format: Literal[1] = 1
    topology: str
    """limbs by their joints, a driven one followed by ``*``: ``3-R*RR``"""
    kind: Literal["planar", "translational", "spatial", "one freedom"]
    numbers: str
    """where masses and lengths are from"""
    singular: Annotated[list[str], Field(min_length=1)]
    """singular poses, one sentence each"""
    mobility: MobilitySpec
    workspace: bool = True
    """whether its workspace is computed"""
    picture: str = ""
    """file in the folder"""

    @model_validator(mode="after")
    def _moves(self) -> Card:
        if self.mobility.mobility < 1:
            raise ValueError(f"mobility: {self.mobility.mobility} freedoms by this count; allowed: at least 1")
        return self


FORM = Form(Card, sections={"mobility": MobilitySpec})


def read_card(folder: Path) -> Card:
    """Read the card in a robot's folder.

    Raises
    ------
    SpecError
        There is none, or it is wrong: file, key, value and what is allowed.
    """
    path = folder / FILE
    document = read_toml(path, str(path))
    try:
        return Card.model_validate(document)
    except ValidationError as error:
        raise SpecError(f"{path}: {FORM.problem(error, document)}", file=str(path)) from error
