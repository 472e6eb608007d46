"""Ways to replace a straight bar by point masses, each as a constant matrix in the bar's end-point coordinates.

A bar from P (proximal) to D (distal) that does not spin about its axis enters virtual work through three moments of
its mass over the fraction z of its length, integral (1-z)^2 dm, integral z (1-z) dm, integral z^2 dm, and through the
weights at its ends. A mass model is nothing but other values for these five numbers, so it costs nothing at run time.
Which of them are right, and what the others cost, stands in docs/mass-models.md.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from workbench.errors import ParameterError, did_you_mean

CODOUREY_RATIO = 2 / 3
"""Share of a rod's mass at the elbow by [Codourey1996]; the rest goes to the platform."""

END_MASSES = "end-masses-"
_RATIO = re.compile(rf"{END_MASSES}([01]|[01]?\.\d{{1,6}})")


@dataclass(frozen=True)
class Bar:
    """A straight bar with its mass on its axis, SI."""

    mass: float
    inertia: float
    """transverse, about the mass centre"""
    length: float
    fraction: float
    """of the mass centre, from the proximal end"""


@dataclass(frozen=True)
class PointMass:
    """A mass in kilograms at a fraction of the bar's length from its proximal end."""

    mass: float
    fraction: float


@dataclass(frozen=True)
class EndPointMasses:
    """What a bar weighs at its ends: entries of its matrix and its first moments, all in kilograms."""

    proximal: float
    """coefficient of proximal acceleration in the force at the proximal end"""
    coupling: float
    """coefficient of either end's acceleration in the force at the other"""
    distal: float
    weight_proximal: float
    weight_distal: float


BarModel = Callable[[Bar], EndPointMasses]


def distributed(bar: Bar, inertia_factor: float = 1.0) -> EndPointMasses:
    """Return the bar as it is: mass, mass centre and transverse inertia.

    *inertia_factor* multiplies the inertia.
    """
    m, k, turning = bar.mass, bar.fraction, inertia_factor * bar.inertia / bar.length**2
    return EndPointMasses(m * (1 - k) ** 2 + turning, m * k * (1 - k) - turning, m * k**2 + turning, m * (1 - k), m * k)


def lumped(bar: Bar) -> EndPointMasses:
    """Return all mass at the mass centre; [Almeida2010] section 3.1."""
    return distributed(bar, inertia_factor=0.0)


def end_masses(proximal_share: float) -> BarModel:
    """Return the rule that moves a share of a bar's mass to its proximal end and the rest to its distal end.

    The rule of [Codourey1996] is 2/3. Mass is kept; mass centre and inertia are not, but for a bar that has them so.

    Raises
    ------
    ParameterError
        The share is outside 0..1.
    """
    if not 0.0 <= proximal_share <= 1.0:
        raise ParameterError(f"share of a rod's mass at the elbow = {proximal_share:g}; allowed: 0 to 1")

    def rule(bar: Bar) -> EndPointMasses:
        points = (PointMass(bar.mass * proximal_share, 0.0), PointMass(bar.mass * (1 - proximal_share), 1.0))
        return of_points(points)

    return rule


def three_masses(bar: Bar) -> tuple[PointMass, PointMass, PointMass]:
    """Return masses at both ends and at the mass centre with the bar's mass, mass centre and transverse inertia.

    With J = inertia / length^2 and the mass centre at k they are J/k, m - J/(k (1-k)) and J/(1-k): for a uniform bar
    m/6, 2m/3 and m/6. None is negative as long as J <= m k (1-k), which every bar whose mass lies between its ends
    obeys, because integral z (1-z) dm is not negative there.

    Raises
    ------
    ParameterError
        The bar has more inertia than mass between its ends can have.
    """
    m, k, turning = bar.mass, bar.fraction, bar.inertia / bar.length**2
    room = m * k * (1 - k)
    # a rounding error over the limit is a bar with all its mass at its ends
    if turning > room * (1 + 1e-12):
        raise ParameterError(
            f"equimomental masses: inertia {bar.inertia:g} kg m^2 of a bar of {m:g} kg and {bar.length:g} m, mass"
            f" centre at {k:g} of its length; allowed: <= {room * bar.length**2:g} kg m^2, all mass at its ends"
        )
    if turning == 0.0:
        return PointMass(0.0, 0.0), PointMass(m, k), PointMass(0.0, 1.0)
    return PointMass(turning / k, 0.0), PointMass(m - turning / (k * (1 - k)), k), PointMass(turning / (1 - k), 1.0)


def equimomental(bar: Bar) -> EndPointMasses:
    """Return the bar as `three_masses`: equal to `distributed` but for rounding."""
    return of_points(three_masses(bar))


def of_points(points: Iterable[PointMass]) -> EndPointMasses:
    """Return what any set of point masses on a bar's axis weighs at its ends."""
    listed = tuple(points)
    return EndPointMasses(
        proximal=sum(p.mass * (1 - p.fraction) ** 2 for p in listed),
        coupling=sum(p.mass * p.fraction * (1 - p.fraction) for p in listed),
        distal=sum(p.mass * p.fraction**2 for p in listed),
        weight_proximal=sum(p.mass * (1 - p.fraction) for p in listed),
        weight_distal=sum(p.mass * p.fraction for p in listed),
    )


@dataclass(frozen=True)
class MassModel:
    """Which rule each kind of bar follows: rods, and bars that swing about a fixed or a sliding axis."""

    name: str
    rods: BarModel
    others: BarModel
    description: str
    source: str = ""


MASS_MODELS: dict[str, MassModel] = {
    model.name: model
    for model in (
        MassModel("distributed", distributed, distributed, "distributed masses"),
        MassModel("lumped", lumped, lumped, "lumped masses", "[Almeida2010] section 3.1"),
        MassModel("lumped-rods", lumped, distributed, "rods lumped at their mass centres, other bars distributed"),
        MassModel(
            "codourey", end_masses(CODOUREY_RATIO), distributed,
            "rods as two end masses, 2/3 at the elbow, other bars distributed", "[Codourey1996]",
        ),
        MassModel("equimomental", equimomental, equimomental, "every bar as three masses, at its ends and mass centre"),
    )
}  # fmt: skip
"""Every model but the family ``end-masses-R``, which `mass_model` makes for any R."""


def mass_model(name: str) -> MassModel:
    """Return a mass model by name: one of `MASS_MODELS`, or ``end-masses-R`` with the share R at the elbow, 0 to 1.

    Raises
    ------
    ParameterError
        Unknown name, or R outside 0..1.
    """
    if name in MASS_MODELS:
        return MASS_MODELS[name]
    if _RATIO.fullmatch(name):
        share = float(name.removeprefix(END_MASSES))
        what = f"rods as two end masses, {share:g} of the mass at the elbow, other bars distributed"
        return MassModel(name, end_masses(share), distributed, what, "after [Codourey1996]")
    valid = (*MASS_MODELS, f"{END_MASSES}0.50")
    raise ParameterError(f'unknown mass model "{name}"{did_you_mean(name, valid)}', mass_model=name)
