"""The ``[sweep]`` table of a campaign file; every key is documented in docs/sweeps.md."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.schema import Finite, Strict

MAX_CASES = 1_000_000
"""A sweep with more cases is taken for a slip: a grid grows by a factor with every value that varies."""

Method = Literal["grid", "list", "latin_hypercube", "sobol"]
Positive = Annotated[Finite, Field(gt=0)]


class Vary(Strict):
    """One number that varies: a parameter, a number of the motion, the speed of the whole motion."""

    key: str
    """``parameters.a2_left``, ``motion.frequency[0]``, ``external_force[2]``, ``speed``"""
    values: Annotated[list[Finite], Field(min_length=1)] | None = None
    """the numbers, for ``grid`` and ``list``"""
    low: Finite | None = None
    """of a range"""
    high: Finite | None = None
    """of a range, included"""
    count: Annotated[int, Field(ge=2)] | None = None
    """for grids: number of values from low to high, both included"""
    scale: Literal["linear", "log"] = "linear"
    """how a range is divided: evenly, or by equal factors"""
    relative: bool = False
    """True: the numbers are factors of the value that the key has in the case or the model"""

    @model_validator(mode="after")
    def _values_or_range(self) -> Vary:
        if (self.values is None) == (self.low is None and self.high is None):
            raise ValueError("give either values, or low and high")
        if self.values is None:
            if self.low is None or self.high is None or not self.low < self.high:
                raise ValueError("low and high are both needed, low below high")
            if self.scale == "log" and self.low <= 0:
                raise ValueError("a logarithmic scale needs low above 0")
        return self


class Filter(Strict):
    """Cases that are left out; they are counted and reported, never dropped in silence."""

    inside_workspace: bool = False
    """leave out motions that the closed form cannot follow: out of reach, or through a singular pose"""
    singularity: Positive | None = None
    """leave out motions that come closer to a singular pose than this: least |determinant|, scaled (dimensionless)"""


class SweepSpec(Strict):
    """How one case becomes many, and how they are computed and kept."""

    method: Method
    """every combination; first values of all keys, then second ones; or points that fill the space"""
    samples: Annotated[int, Field(ge=1, le=MAX_CASES)] | None = None
    """for latin_hypercube and sobol: number of cases"""
    seed: Annotated[int, Field(ge=0)] = 0
    """of a sampled sweep; the same seed gives the same cases"""
    vary: Annotated[list[Vary], Field(min_length=1, max_length=100)]
    """what varies"""
    filter: Filter = Field(default_factory=Filter)
    """which cases are left out"""
    keep_series: Literal["failed", "all", "none"] = "failed"
    """of which cases time series are kept on disk"""
    budget: bool = False
    """True: power balance, forward replay and raw mj_inverse for every case, as in campaigns without a sweep"""
    time_limit: Positive = 60.0
    """seconds that one case may take"""
    memory_limit: Annotated[Finite, Field(ge=512, le=1e9)] = 2048.0
    """megabytes of address space that a worker may take beyond its first; MuJoCo reserves more than it uses"""
    retries: Annotated[int, Field(ge=0, le=100)] = 2
    """how often a case is tried again after its worker was killed or it ran out of time"""
    good: list[Positive] = Field(default_factory=lambda: [0.01, 0.02, 0.05])
    """limits of modelling error that sweep.json counts cases below"""

    @property
    def count(self) -> int:
        """Number of cases before filters."""
        if self.method == "grid":
            return math.prod(len(v.values) if v.values is not None else v.count or 0 for v in self.vary)
        if self.method == "list":
            return len(self.vary[0].values or ())
        return self.samples or 0

    @model_validator(mode="after")
    def _method_and_values(self) -> SweepSpec:
        sampled = self.method in ("latin_hypercube", "sobol")
        if sampled != (self.samples is not None):
            raise ValueError(f"method {self.method} {'needs samples' if sampled else 'takes no samples'}")
        keys = [vary.key for vary in self.vary]
        for vary in self.vary:
            if keys.count(vary.key) > 1:
                raise ValueError(f'key "{vary.key}" varies twice')
            if sampled and vary.values is not None:
                raise ValueError(f'key "{vary.key}": method {self.method} needs low and high in place of values')
            if self.method == "list" and (vary.values is None or len(vary.values) != len(self.vary[0].values or ())):
                raise ValueError(f'key "{vary.key}": method list needs values, as many for every key')
            if self.method == "grid" and (vary.values is None) == (vary.count is None):
                raise ValueError(f'key "{vary.key}": method grid needs values, or low, high and count')
            if self.method != "grid" and vary.count is not None:
                raise ValueError(f'key "{vary.key}": count goes with method grid')
        if self.count > MAX_CASES:
            raise ValueError(f"{self.count} cases; allowed: at most {MAX_CASES}")
        return self
