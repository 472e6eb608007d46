"""Which robot a campaign is about: a robot file, or what the campaign itself says of an MJCF."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from workbench.robots.robot_file import Identifier, Ignorable, ParameterSpec, PlatformSpec, RobotFile, RobotSpec
from workbench.schema import Finite, Strict


class RobotKeys(Strict):
    """``robot``, or ``model`` with the keys that describe it where it has no robot file of its own."""

    robot: str | None = None
    """folder of a robot or its robot file, beside the campaign; or the name of a robot that comes along"""
    model: str | None = None
    """MJCF file beside the campaign, or one that comes along, in place of *robot*"""
    actuated: Annotated[list[str], Field(min_length=1)] | None = None
    """joints that are driven, in the order of q and tau"""
    platform_site: str | None = None
    """site whose motion is recorded and on which external forces act"""
    platform_body: str | None = None
    """the body whose origin is the platform, in place of a site"""
    fix_base: str | None = None
    """body on a free joint that stands still: the base of a robot that walks"""
    base_body: str | None = None
    """fixed body in whose frame the platform is seen; the world where not said"""
    keyframe: str | None = None
    """pose from which the loops are closed; ``home``, or the model as drawn, where not said"""
    initial: dict[str, Finite] = Field(default_factory=dict)
    """coordinates of joints, m and rad, from which the loops are closed: they pick the assembly branch"""
    lumped_bodies: list[str] = Field(default_factory=list)
    """bars that lose their rotational inertia in the mass model ``lumped``"""
    ignore: list[Ignorable] = Field(default_factory=list)
    """what of the file may be left out without refusal"""
    read: dict[Identifier, str] = Field(default_factory=dict)
    """parameters that are handed to candidates: name -> where the model holds it"""

    @model_validator(mode="after")
    def _whole(self) -> RobotKeys:
        if (self.robot is None) == (self.model is None):
            raise ValueError("give either robot, a robot file or its folder, or model, an MJCF")
        if self.platform_site is not None and self.platform_body is not None:
            raise ValueError("platform_site and platform_body: the platform is one of them")
        if (self.actuated is None) != (self.platform_site is None and self.platform_body is None):
            raise ValueError(
                "actuated and platform_site (or platform_body) go together: the joints that are driven, the site or"
                " body that is moved"
            )
        if self.actuated is None:
            for key in ("fix_base", "base_body", "keyframe", "initial", "lumped_bodies", "ignore", "read"):
                if getattr(self, key):
                    raise ValueError(f"{key} goes with actuated and platform_site")
        elif self.robot is not None:
            raise ValueError("actuated and platform_site stand in the robot file")
        return self

    def own_robot(self, model: Path, campaign: Path) -> RobotFile | None:
        """The robot file that these keys amount to; None where they leave it to the model's own."""
        if self.actuated is None:
            return None
        spec = RobotSpec(
            name="".join(c if c.isalnum() or c in "_.+-" else "_" for c in model.stem).lstrip("_.+-")[:100] or "robot",
            title=model.stem.replace("_", " "),
            model=model.name,
            actuated=list(self.actuated),
            platform=PlatformSpec(site=self.platform_site or "", body=self.platform_body or ""),
            base=self.base_body or "world",
            keyframe=self.keyframe or "",
            initial=dict(self.initial),
            lumped=list(self.lumped_bodies),
            ignore=list(self.ignore),
            fix_base=self.fix_base or "",
            parameters={name: ParameterSpec(at=[text], source=model.name) for name, text in self.read.items()},
        )
        return RobotFile(model, str(campaign), spec, section="read")
