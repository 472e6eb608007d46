"""Many variants of one model: numbers replaced in MuJoCo's specification, which is compiled again and read back.

As a rule a change is written into the file's text, and the text is read as any other: that is what a robot with other
numbers is. Where variants come by the hundred, most of that is the same work again. So a specification is kept, the
numbers of parameters are put into it where the text has them, and it is compiled. Before it is used it is held against
the text: for two sets of numbers in which every parameter moves, and for the file's own after them, both have to
compile to the same model, bit for bit. Where they do not, or where a text leaves open what a number means, variants go
through the text as before. A variant's own text is written when somebody asks for it.
"""

from __future__ import annotations

import dataclasses
import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import WorkbenchError
from workbench.mjcf.compile import compile_spec
from workbench.mjcf.prepared import Prepared, open_source, prepared_for, what_moved
from workbench.mjcf.same_robot import check_same_robot
from workbench.mjcf.setup import Setup, plan, start
from workbench.mjcf.source import Source, read_source
from workbench.mjcf.text import Element, scan, tokens, written
from workbench.robots.number_checks import Products
from workbench.robots.parameters import Target
from workbench.robots.places import WHOLE
from workbench.robots.values import quotient, read_parameters, rewrite, vector

if TYPE_CHECKING:
    from workbench.robots.load import Base, LoadedModel

MANY = 4
"""Variants from which on a specification is kept: making and proving it takes about as long as three."""

TRIALS = ((1.0, 0.013), (-1.0, 0.017))
"""Sign and size of the changes for which specification and text are compared."""

FIELDS = {
    ("body", "pos"): "pos", ("inertial", "pos"): "ipos", ("inertial", "mass"): "mass",
    ("inertial", "diaginertia"): "inertia", ("inertial", "fullinertia"): "fullinertia",
}  # fmt: skip
"""Attributes of the text whose name in the specification is another."""


class Variants:
    """Makes the variants of one base; whichever way, they are the same."""

    def __init__(self) -> None:
        self._asked = 0
        self._kept: _Kept | None = None
        self._lock = threading.Lock()

    def loaded(self, base: Base, wanted: Mapping[str, float]) -> LoadedModel | None:
        """The model with these parameters; None where it has to be made from the text, which can say what is wrong."""
        with self._lock:
            self._asked += 1
            if self._asked == MANY:
                self._kept = _kept(base)
            return None if self._kept is None else self._kept.loaded(base, wanted)


@dataclass(frozen=True)
class _Number:
    """One number in a specification."""

    owner: tuple[str, str]
    """tag and name of the element"""
    element: Any
    field: str
    index: int
    size: int
    """of the field; 0 for a plain number"""


class _Numbers:
    """A specification and the numbers in it that parameters determine."""

    def __init__(self, base: Base, spec: mujoco.MjSpec) -> None:
        described, values = base.loaded.description, base.loaded.values
        assert described is not None
        assert values is not None
        self.spec = spec
        found = [(target, _place(base, spec, target)) for target in described.targets]
        placed = [(target, *place) for target, place in found if place is not None]
        self._names = tuple(described.table.infos)
        self._products = Products([target for target, _, _ in placed], self._names)
        self._signs = np.array([sign for _, _, sign in placed])
        self._was = np.array([values[name] for name in self._names])
        self._fields: list[tuple[Any, str, int, int, bool]] = []
        """element, field, where its vector begins and ends among all numbers, and whether it is a plain number"""
        file: list[FloatArray] = []
        starts: dict[tuple[tuple[str, str], str], int] = {}
        count = 0
        for _, number, _ in placed:
            key = number.owner, number.field
            if key not in starts:
                now = np.atleast_1d(np.array(getattr(number.element, number.field), dtype=np.float64))
                self._fields.append((number.element, number.field, count, count + len(now), not number.size))
                starts[key], count = count, count + len(now)
                file.append(now)
        self._file = np.concatenate([*file, np.zeros(0)])
        """the fields' vectors as the file has them, one after the other"""
        self._places = np.array([starts[n.owner, n.field] + n.index for _, n, _ in placed], dtype=np.int64)
        self._there: FloatArray | None = self._file.copy()
        """what stands in the specification; None where that is not known"""

    def put(self, wanted: Mapping[str, float]) -> None:
        """Replace the numbers; where no parameter of a number changes, it is the file's own."""
        moved = self._products.moved(np.array([wanted[name] for name in self._names]) != self._was)
        now = self._file.copy()
        # of two that move one number the last counts
        now[self._places[moved]] = (self._signs * self._products(wanted))[moved]
        there, self._there = self._there, None
        differs = np.ones(len(now), dtype=np.bool_) if there is None else now.view(np.int64) != there.view(np.int64)
        changed = differs.tolist()
        for element, name, first, end, plain in self._fields:
            if True in changed[first:end]:
                setattr(element, name, float(now[first]) if plain else now[first:end])
        self._there = now


def _place(base: Base, spec: mujoco.MjSpec, target: Target) -> tuple[_Number, float] | None:
    """Where a target's number stands in a specification, and its sign there; None where the file does not write it.

    Raises
    ------
    LookupError
        It is not written where it has to be, or not in plain digits.
    """
    text, elements = base.loaded.text, base.elements
    place = written(text, elements, target.element, target.name, target.attribute)
    found = tokens(text, *place) if place else []
    index, sign = target.index, 1.0
    if index == WHOLE:
        numbers = vector(base.model, target, base.loaded.file)
        index = int(np.argmax(np.abs(numbers)))
        if np.count_nonzero(numbers) != 1:
            raise LookupError(target.words)
        sign = 1.0 if numbers[index] > 0 else -1.0
    if place is None or index >= len(found):
        if target.optional or target.reads is None or target.reads in base.computed:
            return None
        raise LookupError(target.words)
    if "&" in found[index][2]:
        raise LookupError(target.words)
    element, spelt = place
    owner = element.tag, element.body if element.tag == "geom" and not element.name else target.name
    holder = _element(spec, *owner)
    if holder is None:
        raise LookupError(target.words)
    name = FIELDS.get((element.tag, spelt), spelt)
    now = getattr(holder, name)
    size = int(np.size(now)) if np.ndim(now) else 0
    return _Number(owner, holder, name, index, size), sign


def _element(spec: mujoco.MjSpec, tag: str, name: str) -> Any:
    if tag == "option":
        return spec.option
    if tag == "geom":
        return spec.geom(name) or next(iter(spec.body(name).geoms), None)
    return {"body": spec.body, "inertial": spec.body, "site": spec.site, "joint": spec.joint}[tag](name)


class _Kept:
    """Specifications that are compiled again for each variant: of the file, and of what the reference sees of it."""

    def __init__(self, base: Base) -> None:
        prepared = base.loaded.prepared
        assert prepared is not None
        assert base.loaded.description is not None
        self._file = base.loaded.file
        self._preparation = prepared.preparation
        whole = dataclasses.replace(prepared, preparation=None)
        self._user = _Numbers(base, whole.spec())
        self._own = _Numbers(base, prepared.spec()) if prepared.preparation else None
        assert base.checks is not None
        self._checks = base.checks
        self._table = base.loaded.description.table
        self._computed = sorted(base.computed.values(), key=lambda target: len(target.of))

    def compile(self, wanted: Mapping[str, float]) -> tuple[mujoco.MjModel, mujoco.MjModel] | None:
        """The file's model and the reference's; None where the preparation itself is another for these numbers."""
        self._user.put(wanted)
        user = compile_spec(self._user.spec, self._file)
        if self._own is None or self._preparation is None:
            return user, user
        setup = self._preparation.setup
        if dataclasses.replace(plan(user, self._file, setup), qpos=self._preparation.qpos) != self._preparation:
            return None
        self._own.put(wanted)
        model = compile_spec(self._own.spec, self._file)
        if tuple(map(float, start(user, model, self._preparation))) != self._preparation.qpos:
            return None
        check_same_robot(user, model, self._preparation, self._file)
        return user, model

    def values(self, user: mujoco.MjModel, wanted: Mapping[str, float]) -> dict[str, float]:
        """All parameters of a compiled variant, with those that MuJoCo computes."""
        values = dict(wanted)
        for target in self._computed:
            assert target.reads is not None
            numbers = vector(user, target, self._file)
            found = float(np.linalg.norm(numbers)) if target.index == WHOLE else float(numbers[target.index])
            others = math.prod(values[name] for name in target.of if name != target.reads)
            values[target.reads] = quotient(found / target.factor, others) + 0.0
        return values

    def loaded(self, base: Base, wanted: Mapping[str, float]) -> LoadedModel | None:
        """The variant, checked; None where something does not pass."""
        assert base.loaded.values is not None
        if any(wanted[name] != base.loaded.values[name] for name in base.computed):
            return None
        if not self._checks.possible(wanted):
            return None
        try:
            found = self.compile(wanted)
            if found is None:
                return None
            values = self.values(found[0], wanted)
            self._table.check(values)
        except WorkbenchError:
            return None
        user, model = found
        if not self._checks.passed(user, values):
            return None
        text = partial(_text, base, dict(wanted))
        notes = tuple(what_moved(user, self._preparation)) if self._preparation else ()
        prepared = Prepared(partial(_source, base, text), self._preparation, model, user, notes)
        return dataclasses.replace(
            base.loaded, writing=text, model=model, values=values, prepared=prepared, family=self
        )


def _text(base: Base, wanted: Mapping[str, float]) -> str:
    loaded = base.loaded
    assert loaded.description is not None
    assert loaded.values is not None
    return rewrite(base.model, loaded.text, loaded.file, loaded.description, loaded.values, wanted, base.elements)[0]


def _source(base: Base, text: Callable[[], str]) -> Source:
    return read_source(text(), base.loaded.file, base.folder)


def _kept(base: Base) -> _Kept | None:
    """A specification that was shown to compile to what the text compiles to; None where it does not."""
    loaded = base.loaded
    if loaded.description is None or loaded.values is None or loaded.prepared is None or base.checks is None:
        return None
    noted = loaded.prepared.notes[: len(loaded.prepared.notes) - len(_moved(loaded.prepared))]
    if noted or loaded.prepared.source.missing:  # options of the compiler, files that are not read
        return None
    try:
        kept = _Kept(base)
        for sign, size in TRIALS:
            moved = _trial(loaded.values, sign, size)
            wanted = {**moved, **{name: loaded.values[name] for name in base.computed}}
            text, made = _text(base, wanted), kept.compile(wanted)
            elements = scan(text, loaded.file)
            user, model = _by_text(base, text, elements)
            if made is None or not _same(made, (user, model)):
                return None
            read = read_parameters(user, loaded.description, loaded.file, text, elements)
            if base.computed and read != kept.values(made[0], wanted):
                return None
        back = kept.compile(loaded.values)
        return kept if back is not None and _same(back, (base.model, loaded.model)) else None
    except (WorkbenchError, LookupError, ValueError, TypeError, AttributeError):
        return None


def _moved(prepared: Prepared) -> list[str]:
    return what_moved(prepared.user, prepared.preparation) if prepared.preparation else []


def _trial(values: Mapping[str, float], sign: float, size: float) -> dict[str, float]:
    """All parameters moved, each by another part of itself; of a mass and its inertia a body stays possible."""
    return {
        name: value * (1.0 + sign * size / (1.0 + i)) if value else size / (1.0 + i)
        for i, (name, value) in enumerate(values.items())
    }


def _by_text(base: Base, text: str, elements: list[Element]) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    file, setup = base.loaded.file, base.setup
    whole = open_source(text, file, base.folder, elements)
    return whole.user, _prepared(base, whole, file, setup).model


def _prepared(base: Base, whole: Prepared, file: str, setup: Setup | None) -> Prepared:
    assert base.loaded.prepared is not None
    return prepared_for(whole, file, setup) if setup is not None and base.loaded.prepared.preparation else whole


def _same(one: tuple[mujoco.MjModel, ...], other: tuple[mujoco.MjModel, ...]) -> bool:
    return all(np.array_equal(_bytes(a), _bytes(b)) for a, b in zip(one, other, strict=True))


def _bytes(model: mujoco.MjModel) -> FloatArray:
    buffer = np.empty(mujoco.mj_sizeModel(model), dtype=np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer
