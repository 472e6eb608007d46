"""What a campaign says about a mechanism that the workbench has no closed form for."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.mjcf.setup import Setup
from workbench.schema import Finite, Strict

Identifier = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,39}$")]


class OwnMechanism(Strict):
    """Keys of a campaign that describe any MJCF; they are absent where the file names one of the built-in robots."""

    actuated: Annotated[list[str], Field(min_length=1)] | None = None
    """joints that are driven, in the order of q and tau"""
    platform_site: str | None = None
    base_body: str | None = None
    """fixed body in whose frame the platform is seen; the world where not said"""
    keyframe: str | None = None
    initial: dict[str, Finite] = Field(default_factory=dict)
    """coordinates of joints, m and rad, from which the loops are closed: they pick the assembly branch"""
    lumped_bodies: list[str] = Field(default_factory=list)
    ignore: list[Literal["contacts", "limits", "springs", "tendons", "free bodies"]] = Field(default_factory=list)
    read: dict[Identifier, str] = Field(default_factory=dict)
    """parameters that are handed to candidates: name -> where the model holds it"""

    @model_validator(mode="after")
    def _whole(self) -> OwnMechanism:
        if (self.actuated is None) != (self.platform_site is None):
            raise ValueError(
                "actuated and platform_site go together: the joints that are driven, the site that is moved"
            )
        if self.actuated is None:
            for key in ("base_body", "keyframe", "initial", "lumped_bodies", "ignore", "read"):
                if getattr(self, key):
                    raise ValueError(f"{key} goes with actuated and platform_site")
        return self

    @property
    def setup(self) -> Setup | None:
        """The same for the reference; None for a built-in robot."""
        if self.actuated is None or self.platform_site is None:
            return None
        return Setup(
            actuated=tuple(self.actuated),
            platform_site=self.platform_site,
            base_body=self.base_body or "world",
            keyframe=self.keyframe or "",
            initial=tuple(self.initial.items()),
            lumped_bodies=tuple(self.lumped_bodies),
            ignore=tuple(self.ignore),
        )
