"""What a user's formula asks for: read off its arguments."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any

from workbench.campaign.bounded_call import said
from workbench.errors import SpecError
from workbench.robots.registration import INVERSE, TORQUE

MOTION = ("t", "x", "xd", "xdd", "rotation", "omega", "alpha")
"""Names of arguments, behind the first four, that get the time and the platform's motion."""


@dataclass(frozen=True)
class Wants:
    """What a formula is called with beside parameters, q, qd, qdd."""

    force: bool
    """the external force, as its fifth argument"""
    motion: tuple[str, ...]
    """of `MOTION`, by name"""


def wants_of(function: Any, kind: str, where: str) -> Wants:
    """Read what *function* asks for.

    Raises
    ------
    SpecError
        It cannot be called as a formula of its kind is.
    """
    try:
        signature = inspect.signature(function)
    except Exception as error:
        raise SpecError(f"{where}: what it is called with cannot be told: {said(error)}") from error
    if inspect.iscoroutinefunction(function) or inspect.isgeneratorfunction(inspect.unwrap(function)):
        raise SpecError(f"{where}: a candidate returns its torques; this one is called in pieces (async or yield)")
    parameters = list(signature.parameters.values())
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    own = 4 if kind == TORQUE else 2
    named = [p for p in parameters[own:] if p.name in MOTION and p.kind is not p.POSITIONAL_ONLY] if own == 4 else []
    rest = [p for p in parameters if p not in named]
    taken = [p for p in rest if p.kind in kinds]
    needed = [p for p in taken if p.default is p.empty]
    most = 5 if kind == TORQUE else 2
    got = f"got {said(getattr(function, '__name__', 'f'))}{said(signature)}"
    if len(needed) > most or len(taken) < own or any(p.kind is p.KEYWORD_ONLY and p.default is p.empty for p in rest):
        if kind != TORQUE:
            called = "f(parameters, x)" if kind == INVERSE else "f(parameters, q)"
            raise SpecError(f"{where}: {kind} is called as {called}, {got}")
        raise SpecError(
            f"{where}: a candidate is called as f(parameters, q, qd, qdd) or f(parameters, q, qd, qdd, external_force),"
            f" behind these any of {', '.join(MOTION)} by name, {got}"
        )
    return Wants(kind == TORQUE and len(taken) >= 5, tuple(p.name for p in named))
