"""The figures that a campaign asks for."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from workbench.schema import Finite, Name, Strict

CANDIDATE_CURVE = "cand:"


class FigureSpec(Strict):
    """A figure: a motion or a torque of one case over time, or the errors of several cases over a number of theirs."""

    id: Name
    """unique"""
    title: str
    """above the figure"""
    kind: Literal["platform", "platform_velocity", "platform_acceleration", "torque", "error_over"]
    """what it shows"""
    case: str | None = None
    """for all kinds but ``error_over``"""
    joint: str | None = None
    """for ``torque``"""
    curves: list[str] = Field(default_factory=list)
    """``cand:CANDIDATE`` and ``ref:MASS_MODEL``, of those that the campaign compares"""
    source: str = ""
    """the paper's own figure"""
    cases: list[str] = Field(default_factory=list)
    """for ``error_over``: the cases, in the order of *abscissa*"""
    abscissa: list[Finite] = Field(default_factory=list)
    """for ``error_over``: one number for each case, rising: a frequency, a load"""
    label: str = ""
    """for ``error_over``: what the numbers are, with their unit"""
    reference: str | None = None
    """for ``error_over``: the reference mass model that the errors are held against"""

    @property
    def needs(self) -> list[str]:
        """The cases that the figure shows."""
        return self.cases if self.case is None else [self.case]

    @model_validator(mode="after")
    def _torque(self) -> FigureSpec:
        if self.kind == "torque" and (self.joint is None or not self.curves):
            raise ValueError("a figure of kind torque needs joint and curves")
        return self

    @model_validator(mode="after")
    def _one_case_or_several(self) -> FigureSpec:
        if self.kind == "error_over":
            self._check_error_over()
        elif self.case is None:
            raise ValueError(f"a figure of kind {self.kind} needs case")
        elif self.cases or self.abscissa or self.label or self.reference:
            raise ValueError("cases, abscissa, label and reference go with kind error_over, and only with it")
        return self

    def _check_error_over(self) -> None:
        if self.case is not None:
            raise ValueError("a figure of kind error_over needs cases in place of case")
        if not (self.curves and self.label and self.reference):
            raise ValueError("a figure of kind error_over needs cases, abscissa, label, reference and curves")
        if len(self.cases) != len(self.abscissa) or len(self.cases) < 2 or len(set(self.cases)) < len(self.cases):
            raise ValueError("a figure of kind error_over needs two cases or more, each once, and a number for each")
        if any(after <= before for before, after in zip(self.abscissa, self.abscissa[1:], strict=False)):
            raise ValueError("the numbers of abscissa have to rise")
        if not all(curve.startswith(CANDIDATE_CURVE) for curve in self.curves):
            raise ValueError(f"the curves of a figure of kind error_over are candidates, {CANDIDATE_CURVE}NAME")

    def among(self, present: set[str]) -> FigureSpec | None:
        """Return the figure for those cases that were computed; None where nothing is left to draw."""
        if self.kind != "error_over":
            return self if self.case in present else None
        kept = [(case, x) for case, x in zip(self.cases, self.abscissa, strict=True) if case in present]
        if len(kept) < 2:
            return None
        return self.model_copy(update={"cases": [case for case, _ in kept], "abscissa": [x for _, x in kept]})
