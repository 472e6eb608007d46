"""The closed forms of the asymmetric 2RSS+PPaP robot by name: those that hold, and those that are wrong on purpose.

Forms that hold equal the reference under their mass model. The others are there to be measured: the formulas of
[Almeida2010] with their misprints (docs/derivations/asym_2rss_ppap.md, section 7), and bars replaced by other masses
than they have (docs/mass-models.md).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from workbench.arrays import FloatArray
from workbench.errors import ParameterError
from workbench.robots.asym_2rss_ppap import literal
from workbench.robots.asym_2rss_ppap.literal import Misprint
from workbench.robots.closed_form import Candidate
from workbench.robots.mass_models import MASS_MODELS, MassModel, mass_model

MISPRINT_NAMES = {
    Misprint.JQ33_SIGN: "jq33",
    Misprint.K1_M2_QUARTER: "k1",
    Misprint.F2_JXQ33: "f2",
    Misprint.TWO_M5: "m5",
    Misprint.BD_GRAVITY_MISSING: "bd-weight",
    Misprint.PLATFORM_GRAVITY_MISSING: "platform-weight",
    Misprint.BD_ROTATION_Q2: "bd-q2",
}
"""Each misprint as candidates' names spell it."""


class Candidates(Mapping[str, Candidate]):
    """Closed forms by name. Iteration lists those that hold; names that are wrong on purpose are found all the same.

    So whoever walks through the candidates meets no misprint unasked; `on_purpose` lists those that are.
    """

    def __init__(self, holding: tuple[Candidate, ...], on_purpose: tuple[Candidate, ...]) -> None:
        self._holding = {candidate.name: candidate for candidate in holding}
        self.on_purpose: Mapping[str, Candidate] = {candidate.name: candidate for candidate in on_purpose}

    def __getitem__(self, name: str) -> Candidate:
        if name in self._holding:
            return self._holding[name]
        if name in self.on_purpose:
            return self.on_purpose[name]
        try:
            return _of_mass_model(mass_model(name))  # end masses in any ratio
        except ParameterError as error:
            raise KeyError(name) from error

    def __iter__(self) -> Iterator[str]:
        return iter(self._holding)

    def __len__(self) -> int:
        return len(self._holding)


def _of_mass_model(model: MassModel) -> Candidate:
    def torques(mech: Any, q: FloatArray, qd: FloatArray, qdd: FloatArray, force: FloatArray) -> FloatArray:
        tau: FloatArray = mech.torques(q, qd, qdd, model.name, force) + mech.friction(q, qd, qdd)
        return tau

    return Candidate(
        name=model.name,
        mass_model=model.name,
        function=torques,
        description=f"virtual work in end-point coordinates, {model.description}",
        source=model.source or "docs/derivations/asym_2rss_ppap.md",
    )


def _literal(
    name: str,
    mass_model: str,
    function: Any,
    description: str,
    source: str,
    misprints: frozenset[Misprint] = literal.REPAIRED,
) -> Candidate:
    def torques(mech: Any, q: FloatArray, qd: FloatArray, qdd: FloatArray, external_force: FloatArray) -> FloatArray:
        result: FloatArray = function(
            mech.parameters,
            q,
            qd,
            qdd,
            *mech.platform_motion(q, qd, qdd),
            external_force=external_force,
            misprints=misprints,
        )
        friction: FloatArray = mech.friction(q, qd, qdd)
        return result + friction

    return Candidate(name, mass_model, torques, description, source)


def _misprinted(
    name: str, mass_model: str, function: Any, source: str, printed: frozenset[Misprint]
) -> list[Candidate]:
    """Return a form as printed, and for each of its misprints the form with that one alone mended and alone kept.

    ``NAME-as-printed``, ``NAME-as-printed-but-MISPRINT``, ``NAME-only-MISPRINT``.
    """

    def form(suffix: str, description: str, misprints: frozenset[Misprint]) -> Candidate:
        return _literal(f"{name}-{suffix}", mass_model, function, description, source, misprints)

    forms = [form("as-printed", f"as printed, with {len(printed)} misprints", printed)]
    for misprint, spelt in MISPRINT_NAMES.items():
        if misprint in printed:
            forms.append(
                form(f"as-printed-but-{spelt}", f"as printed, but mended: {misprint.value}", printed - {misprint})
            )
            forms.append(form(f"only-{spelt}", f"mended, but for {misprint.value}", frozenset({misprint})))
    return forms


_APPENDIX = ("lumped", literal.lumped_appendix, "[Almeida2010] appendix")
_EQUATION_4 = ("lumped", literal.lumped_equation4, "[Almeida2010] eq. (3)-(6)")
_ROTATION = ("distributed", literal.distributed_rotation, "[Almeida2010] eq. (4)-(15)")

CANDIDATES = Candidates(
    holding=(
        *(_of_mass_model(MASS_MODELS[name]) for name in ("lumped", "distributed")),
        _literal("lumped-appendix", *_APPENDIX[:2], "K1 to K6 of the appendix, repaired", _APPENDIX[2]),
        _literal("equation4", *_EQUATION_4[:2], "the sum of virtual works, repaired", _EQUATION_4[2]),
        _literal("distributed-rotation", *_ROTATION[:2], "rotation matrices and angular accelerations", _ROTATION[2]),
    ),
    on_purpose=(
        *(_of_mass_model(model) for name, model in MASS_MODELS.items() if name not in ("lumped", "distributed")),
        *_misprinted("lumped", *_APPENDIX, literal.APPENDIX_AS_PRINTED),
        *_misprinted("equation4", *_EQUATION_4, literal.EQUATION4_AS_PRINTED),
        *_misprinted("distributed", *_ROTATION, literal.DISTRIBUTED_AS_PRINTED),
    ),
)
"""What a campaign may name for this robot, besides ``end-masses-R`` for any share R of the rods' mass at the elbow."""
