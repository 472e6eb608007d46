"""What campaign and robot files are made of: strict tables, finite numbers, names that may become file names."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

NAME = r"^[A-Za-z0-9][A-Za-z0-9_.+-]{0,99}$"
"""Names of campaigns and cases become file names: letters, digits and ``_ . + -``."""

NAME_RULE = "allowed: letters, digits and _ . + -, first a letter or digit, at most 100 characters"

Finite = Annotated[float, Field(allow_inf_nan=False)]
Vector = Annotated[list[Finite], Field(min_length=1)]
Triple = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Name = Annotated[str, Field(pattern=NAME)]


class Strict(BaseModel):
    """No unknown keys, no silent conversion of text to numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
