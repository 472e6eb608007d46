"""``[[recorded]]`` of a campaign: torques from elsewhere."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from workbench.campaign.motion_spec import Columns
from workbench.recorded.read import Wanted
from workbench.schema import Finite, Strict

Label = Annotated[str, Field(min_length=1, max_length=60, pattern=r"^[^\x00-\x1f]*\S[^\x00-\x1f]*$")]


def wanted_of(columns: Columns) -> dict[str, Wanted]:
    """Columns as `workbench.recorded.read` takes them."""
    return {
        key: Wanted(value) if isinstance(value, str) else Wanted(value.name, value.unit)
        for key, value in columns.items()
    }


class RecordedSpec(Strict):
    """Torques that were measured or simulated elsewhere, on the motion of a case."""

    label: Label
    """what the tables call it"""
    file: str
    """table beside the campaign: text, ``.mat`` or ``.parquet``"""
    case: str | None = None
    """may be left out where the campaign has one case"""
    columns: Columns = Field(default_factory=dict)
    """where quantities stand, by ``t``, joint or torque; by their own names where not said"""
    offset: Finite | Literal["estimate"] = 0.0
    """time of the case less time of the record, s"""
    reference: str = "distributed"
    """mass model that the torques are held against"""
    bound: Annotated[Finite, Field(gt=0)] | None = None
    """largest peak error; without one nothing fails"""
    description: str = ""
    """for the report"""
