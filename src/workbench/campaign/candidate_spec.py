"""``[[candidate]]`` of a campaign: which formula is held against which reference, and what it has to keep."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field, model_validator

from workbench.schema import Finite, Strict

if TYPE_CHECKING:
    from workbench.campaign.spec import CaseSpec


LARGEST_BOUND = 1e6
"""Relative errors beyond this are no bounds."""


class PrintedCost(Strict):
    """What a formula's authors printed of its computing cost: microseconds per sample, beside what is measured."""

    us: Annotated[Finite, Field(gt=0)]
    """microseconds per sample"""
    source: str = ""
    """where it is printed, and on which machine it was measured"""


class CandidateSpec(Strict):
    """A closed form, the reference mass model it is held against, and the bound on its peak error.

    Without a bound the row is a measured modelling error and has no verdict.
    """

    name: str
    """a formula of the robot, or one that ``--candidates`` brings"""
    reference: str
    """mass model of MuJoCo's side: ``distributed``, the model as it is, or ``lumped``"""
    bound: Annotated[Finite, Field(gt=0, le=LARGEST_BOUND)] | None = None
    """largest ``peak_error`` allowed on each joint; without it the row is measured and not judged"""
    expect_fail: dict[str, Annotated[list[str], Field(min_length=1)]] = Field(default_factory=dict)
    """case -> joints whose error has to exceed the bound there; joints that are not named have to keep it"""
    printed_cost: PrintedCost | None = None
    """what its authors printed of its cost, shown beside what is measured"""

    @model_validator(mode="after")
    def _failure_of_what(self) -> CandidateSpec:
        if self.expect_fail and self.bound is None:
            raise ValueError("expect_fail needs a bound that can fail")
        return self

    def in_case(self, case: CaseSpec, joint: str) -> CandidateSpec:
        """Return the candidate with the bound that holds for a joint of a case."""
        if self.bound is None or joint not in case.bounds:
            return self
        return self.model_copy(update={"bound": case.bounds[joint]})
