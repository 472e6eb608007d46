"""Controllers of a user's own: functions of a Python file, called at every tick under the supervision of formulas.

.. code-block:: python

    import workbench as wb

    @wb.controller(name="pid")
    def pid(parameters, sample):
        e = sample.q_desired - sample.q
        sample.memory["sum"] = sample.memory.get("sum", 0.0) + e * sample.period
        return sample.mass * (sample.kp * e + 20.0 * sample.memory["sum"])
"""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.bounded_call import UnrulyError, bounded, said
from workbench.campaign.control_spec import BUILT_IN
from workbench.campaign.formula_files import Siblings, files_of, load_module
from workbench.control.controllers import Gains, Law, Model
from workbench.control.sampling import Desired
from workbench.errors import CandidateError, SpecError
from workbench.robots.registered import note, refuse_lost

MARK = "__workbench_controller__"
LOADING_LIMIT_S = 60.0
LIMIT_S = 10.0
"""Longest time of one tick."""


@dataclass
class Sample:
    """What a controller is told at a tick; arrays ``(na,)``, SI, not to be written to."""

    t: float
    q: FloatArray
    """measured"""
    qd: FloatArray
    q_desired: FloatArray
    qd_desired: FloatArray
    qdd_desired: FloatArray
    kp: float
    """1/s^2, from the bandwidth"""
    kd: float
    """1/s"""
    mass: FloatArray
    """diagonal of the mass matrix at home"""
    period: float
    """s"""
    model: Callable[[FloatArray, FloatArray, FloatArray], FloatArray] | None
    """torques ``(na,)`` of the formula; None where the study has none"""
    memory: dict[str, Any] = field(default_factory=dict)
    """empty at a run's beginning, kept from tick to tick"""


def controller(name: str | None = None) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Mark a function ``(parameters, sample) -> tau (na,)`` as a controller, under its own name or another."""

    def mark(function: Callable[..., Any]) -> Callable[..., Any]:
        setattr(function, MARK, name or function.__name__)
        note(function, name or function.__name__)
        return function

    return mark


@dataclass(frozen=True)
class UserController:
    """A user's function, judged on what it returns."""

    name: str
    function: Callable[..., Any]
    file: Path
    line: int
    siblings: Siblings | None

    @property
    def files(self) -> tuple[Path, ...]:
        """The file and those beside it that it has imported."""
        return files_of(self.file, self.siblings)

    def law(
        self, parameters: Any, joints: tuple[str, ...], model: Model | None, gains: Gains, desired: Desired, rate: float
    ) -> Law:
        """The function as a law on a motion; a fault of it is a `CandidateError` with file, line and time."""
        memory: dict[str, Any] = {}
        one = None if model is None else lambda q, qd, qdd: np.array(model.one(_own(q), _own(qd), _own(qdd)))

        def called(k: int, q: FloatArray, qd: FloatArray) -> FloatArray:
            sample = Sample(
                float(desired.t[k]), _sealed(q), _sealed(qd), _sealed(desired.q[k]), _sealed(desired.rates[k]),
                _sealed(desired.qdd[k]), gains.kp, gains.kd, _sealed(gains.mass), 1.0 / rate, one, memory,
            )  # fmt: skip
            try:
                found = bounded(lambda: self._call(parameters, sample), LIMIT_S)
            except UnrulyError as trouble:
                raise self._fault(str(trouble), sample.t, trouble.error) from trouble.error
            if found.shape != q.shape or found.dtype.kind not in "fiu":
                raise self._fault(
                    f"returns {found.dtype} of shape {found.shape}; expected {len(q)} numbers: {' '.join(joints)}",
                    sample.t,
                )
            tau = np.asarray(found, dtype=np.float64)
            if not np.isfinite(tau).all():
                joint = int(np.argmax(~np.isfinite(tau)))
                raise self._fault(f"returns {tau[joint]} for joint {joints[joint]}", sample.t)
            return tau

        return called

    def _call(self, parameters: Any, sample: Sample) -> np.ndarray[Any, Any]:
        if self.siblings is None:
            return np.asarray(self.function(parameters, sample))
        with self.siblings.visible():
            return np.asarray(self.function(parameters, sample))

    def _fault(self, what: str, time: float, error: BaseException | None = None) -> CandidateError:
        line = self.line
        for frame in traceback.extract_tb(error.__traceback__) if error else ():
            if Path(frame.filename) == self.file and frame.lineno:
                line = frame.lineno
        return CandidateError(
            f'controller "{self.name}" ({self.file.name}:{line}) {what}, at t = {time:.6g} s',
            candidate=self.name, line=f"{self.file.name}:{line}", time=time,
        )  # fmt: skip


def _own(values: Any) -> FloatArray:
    return np.array(values, dtype=np.float64)


def _sealed(values: FloatArray) -> FloatArray:
    copy = np.array(values, dtype=np.float64)
    copy.flags.writeable = False
    return copy


def load_controllers(names: Iterable[str | Path]) -> tuple[UserController, ...]:
    """Load the controllers of Python files.

    Raises
    ------
    SpecError
        No such file; it does not run; nothing is marked in it; a name that stands twice or is the package's own.
    """
    found: list[UserController] = []
    for name in names:
        module, siblings = load_module(str(name), LOADING_LIMIT_S)
        refuse_lost(module, "controller", str(name))
        marked = {}
        for value in vars(module).values():
            mark = getattr(value, MARK, None) if inspect.isfunction(value) else None
            if mark is not None:
                marked[id(value)] = (mark, value)
        if not marked:
            raise SpecError(
                f"{name}: no controller is registered in it; mark a function with @workbench.controller()",
                file=str(name),
            )
        for mark, function in marked.values():
            if not isinstance(mark, str) or not 0 < len(mark) <= 60:
                raise SpecError(f"{name}: controller name {said(mark)}; allowed: a text of 1 to 60 characters")
            if mark in BUILT_IN or mark in [one.name for one in found]:
                raise SpecError(f'{name}: there is a controller "{mark}" already; choose another name')
            code = inspect.unwrap(function).__code__
            found.append(UserController(mark, function, Path(code.co_filename), code.co_firstlineno, siblings))
    return tuple(found)
