"""The decorator by which a user's Python file offers its own formulas as candidates.

>>> @candidate("vector-loop", bound=1e-10)
... def vector_loop(p, q, qd, qdd):
...     return p.m * qdd

The file runs only where a command line names it, ``workbench run ... --candidates my_model.py``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar, overload

from workbench.robots.registered import note

Function = TypeVar("Function", bound=Callable[..., Any])

MARK = "__workbench_candidate__"
"""attribute of a function that was registered"""

CLASS_MARK = "__workbench_closed_form__"
"""attribute of a class that was registered"""

Class = TypeVar("Class", bound=type)


def closed_form(kind: Class) -> Class:
    """Register a `ClosedForm`, kinematics and inverse dynamics of the robot of its folder."""
    setattr(kind, CLASS_MARK, True)
    return kind


TORQUE = "torque"
FORWARD, INVERSE, JACOBIAN = "forward kinematics", "inverse kinematics", "jacobian"

KINEMATICS_BOUND = 1e-9
"""Largest error that a kinematics formula may have where its decorator says no other."""


@dataclass(frozen=True)
class Registration:
    """What a user says about a formula."""

    name: str
    reference: str = "distributed"
    bound: float | None = None
    description: str = ""
    source: str = ""
    kind: str = TORQUE


@overload
def candidate(name: Function, /) -> Function: ...
@overload
def candidate(
    name: str | None = None,
    /,
    *,
    reference: str = "distributed",
    bound: float | None = None,
    description: str = "",
    source: str = "",
) -> Callable[[Function], Function]: ...
def candidate(
    name: Any = None,
    /,
    *,
    reference: str = "distributed",
    bound: float | None = None,
    description: str = "",
    source: str = "",
) -> Any:
    """Register a function ``(parameters, q, qd, qdd) -> tau`` as a candidate.

    Arrays are float64, SI, shape ``(n, na)``, in the order of the actuated joints; *parameters* has those of the
    mechanism as attributes. A function with a fifth argument gets the external force ``(n, 3)`` in newtons too. Further
    arguments of these names get the platform's motion in the base body's frame: ``x``, ``xd``, ``xdd``, ``omega``,
    ``alpha``, each ``(n, 3)``, and ``rotation`` ``(n, 3, 3)``; ``t`` gets the times ``(n,)``.

    Parameters
    ----------
    name
        The name that a campaign knows it by; the function's own where none is given.
    reference
        The reference mass model that it is held against where the campaign does not name it.
    bound
        Largest peak error allowed there; None makes it a measured modelling error.
    description, source
        One line each, for the report; the description is the docstring's first line where none is given.
    """
    if callable(name):
        return candidate()(name)

    def register(function: Function) -> Function:
        text = description or (function.__doc__ or "").strip().partition("\n")[0]
        mark = Registration(function.__name__ if name is None else name, reference, bound, text, source)
        setattr(function, MARK, mark)
        note(function, mark.name)
        return function

    return register


def forward_kinematics(name: Any = None, /, *, bound: float = KINEMATICS_BOUND, description: str = "") -> Any:
    """Register a function ``(parameters, q) -> x``, task coordinates ``(n, m)``, to be held against the reference.

    Parameters
    ----------
    name
        The name that the report knows it by; the function's own where none is given.
    bound
        Largest error allowed: of each coordinate over a case, over the largest value of its unit (m or rad) there.
    description
        One line, for the report.
    """
    return _kinematics(FORWARD, name, bound, description)


def inverse_kinematics(name: Any = None, /, *, bound: float = KINEMATICS_BOUND, description: str = "") -> Any:
    """Register a function ``(parameters, x) -> q``, as `forward_kinematics`; the branch is that of the case."""
    return _kinematics(INVERSE, name, bound, description)


def jacobian(name: Any = None, /, *, bound: float = KINEMATICS_BOUND, description: str = "") -> Any:
    """Register a function ``(parameters, q) -> J``, ``(n, m, na)`` with xd = J qd, as `forward_kinematics`.

    The error of a coordinate is that of its row, over the row's largest entry.
    """
    return _kinematics(JACOBIAN, name, bound, description)


def _kinematics(kind: str, name: Any, bound: float, description: str) -> Any:
    if callable(name):
        return _kinematics(kind, None, bound, description)(name)

    def register(function: Function) -> Function:
        text = description or (function.__doc__ or "").strip().partition("\n")[0]
        mark = Registration(function.__name__ if name is None else name, "distributed", bound, text, kind=kind)
        setattr(function, MARK, mark)
        note(function, mark.name)
        return function

    return register
