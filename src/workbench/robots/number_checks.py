"""What a model with other numbers has to pass, looked at for all numbers at once.

The checks themselves, and what they say, stand in `workbench.robots.load.confirm`, `workbench.robots.assumptions` and
`workbench.robots.agreement`. Here arrays are compared by the same bounds; where one number does not pass, or is none,
the caller asks those, which find it again and say so.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import WorkbenchError
from workbench.robots.agreement import AGREE
from workbench.robots.assumptions.rules import ALIGNMENT
from workbench.robots.description import Description
from workbench.robots.inertia import SMALLEST
from workbench.robots.parameters import Target
from workbench.robots.places import WHOLE
from workbench.robots.values import FIELDS, Place, index_of, inertia_matrix, vector

INERTIA = ("inertial", "diaginertia")


class Products:
    """The number that each of some targets has to be, for many sets of parameters; bits as of `Target.number`."""

    def __init__(self, targets: Sequence[Target], names: Sequence[str]) -> None:
        place = {name: i for i, name in enumerate(names)}
        self._names = tuple(names)
        most = max((len(target.of) for target in targets), default=1)
        one = len(self._names)
        self._of = np.full((most, len(targets)), one, dtype=np.int64)
        for column, target in enumerate(targets):
            self._of[: len(target.of), column] = [place[name] for name in target.of]
        self._factors = np.array([target.factor for target in targets])

    def moved(self, changed: np.ndarray) -> np.ndarray:
        """Which numbers ``(k,)`` a change of some parameters ``(names,)`` moves."""
        return np.asarray(np.append(changed, False)[self._of].any(axis=0))

    def __call__(self, values: Mapping[str, float]) -> FloatArray:
        """Numbers ``(k,)``."""
        numbers = np.array([*(values[name] for name in self._names), 1.0])
        product = numbers[self._of[0]]
        for row in self._of[1:]:  # one by one, as `math.prod` does
            product = product * numbers[row]
        found: FloatArray = self._factors * product
        return found


class NumberChecks:
    """The numbers of one robot's models.

    Parameters
    ----------
    model, description, file
        The robot as its files have it.
    computed
        Parameters that MuJoCo computes from others: what they are is read, not confirmed.
    """

    def __init__(
        self, model: mujoco.MjModel, description: Description, file: str, computed: Collection[str] = ()
    ) -> None:
        targets = [t for t in description.targets if t.element != "geom"]
        self.whole = all(t.optional for t in description.targets if t.element == "geom")
        """whether all places are looked at but those that may be left out: a geom's numbers are read from the text"""
        names = tuple(description.table.infos)
        self._targets, self._products = targets, Products(targets, names)
        layout = description.layout
        self._principal = [_body(model, info.name, file) for info in layout.bodies if info.turns] if layout else []
        turned = {_body(model, t.name, file) for t in targets if (t.element, t.attribute) == INERTIA}
        self._inertias = sorted({*turned, *self._principal})
        sources = [self._source(model, target, file) for target in targets]
        self._fields = tuple(dict.fromkeys(field for field, _ in sources))
        self._read = [(field, *self._rows(field, sources)) for field in self._fields]
        self._others_read = [i for i, (field, _) in enumerate(sources) if not field]
        """targets of which no array holds the number as it is"""
        self._exact = np.array([t.reads is not None and t.reads not in computed for t in targets], dtype=np.bool_)
        self._relative = np.array([t.attribute == "diaginertia" for t in targets], dtype=np.bool_)
        self._agreeing = np.array([t.reads is None and not t.optional for t in targets], dtype=np.bool_)
        self._aligned = layout is not None
        self._rest = self._others(model, file) if layout else {}
        down = {t.index for t in targets if (t.element, t.attribute) == ("option", "gravity")} if layout else set()
        self._level = sorted({0, 1, 2} - down) if down and WHOLE not in down else []
        """numbers of gravity that have to be zero"""
        self._moving = self._bodies(model)

    def _source(self, model: mujoco.MjModel, target: Target, file: str) -> tuple[str, int]:
        """Array and place in it, flat; what stands in none is read one by one."""
        if target.element in ("option", "distance") or target.index == WHOLE:
            return "", 0
        if (target.element, target.attribute) == INERTIA:
            return "inertia", 9 * self._inertias.index(_body(model, target.name, file)) + 4 * target.index
        kind, field = FIELDS[target.element, target.attribute]
        tag = "body" if target.element == "inertial" else target.element
        row = index_of(model, kind, tag, target.name, file)
        row = int(model.jnt_dofadr[row]) if field.startswith("dof_") else row
        width = math.prod(getattr(model, field).shape[1:])
        return field, row * width + target.index

    def _rows(self, field: str, sources: Sequence[tuple[str, int]]) -> tuple[np.ndarray, np.ndarray]:
        mine = [i for i, (other, _) in enumerate(sources) if other == field]
        return np.array(mine, dtype=np.int64), np.array([sources[i][1] for i in mine], dtype=np.int64)

    def _others(self, model: mujoco.MjModel, file: str) -> dict[str, np.ndarray]:
        """Numbers of positions of which others are parameters': they have to be zero."""
        held: dict[tuple[str, str, str], list[Target]] = {}
        for target in self._targets:
            if target.attribute == "pos":
                held.setdefault((target.element, target.name, target.attribute), []).append(target)
        found: dict[str, list[int]] = {}
        for (element, _, attribute), targets in held.items():
            field = FIELDS[element, attribute][1]
            first = self._source(model, targets[0], file)[1] - targets[0].index
            free = {0, 1, 2} - {target.index for target in targets}
            found.setdefault(field, []).extend(first + index for index in sorted(free))
        return {field: np.array(places, dtype=np.int64) for field, places in found.items()}

    def _bodies(self, model: mujoco.MjModel) -> list[tuple[FloatArray, list[int], np.ndarray, bool]]:
        """Masses and inertias that parameters change: as they are, which numbers change, by which targets."""
        groups: dict[tuple[str, str], list[int]] = {}
        for column, target in enumerate(self._targets):
            if target.element == "inertial" and target.attribute in ("mass", "diaginertia") and not target.optional:
                groups.setdefault((target.name, target.attribute), []).append(column)
        found = []
        for (body, _), columns in groups.items():
            first = self._targets[columns[0]]
            moves = bool(model.body_dofnum[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, body)] > 0)
            places = [self._targets[column].index for column in columns]
            found.append((vector(model, first, "").copy(), places, np.array(columns), moves))
        return found

    def possible(self, wanted: Mapping[str, float]) -> bool:
        """Whether every body may have the masses and inertias of these parameters; as `refuse_impossible_bodies`."""
        numbers = self._products(wanted)
        for before, places, columns, moves in self._moving:
            before[places] = numbers[columns]
            if moves and not before.min() >= SMALLEST:
                return False
            if len(before) == 3 and not 2.0 * before.max() <= before.sum() * (1.0 - 1e-12):
                return False
        return True

    def read(self, model: mujoco.MjModel) -> dict[Place, float]:
        """The number at each place, but for geoms, which MuJoCo keeps in another form."""
        found = self._numbers(model)[0].tolist()
        return {(t.element, t.name, t.attribute, t.index): found[i] for i, t in enumerate(self._targets)}

    def _numbers(self, model: mujoco.MjModel) -> tuple[FloatArray, FloatArray]:
        """The number at each target ``(k,)``; and the inertias that are looked at, in their bodies' axes, flat."""
        found = np.empty(len(self._targets))
        matrices = np.array([inertia_matrix(model, body) for body in self._inertias]).reshape(-1)
        for field, rows, places in self._read:
            if field:
                found[rows] = (matrices if field == "inertia" else getattr(model, field).reshape(-1))[places]
        for i in self._others_read:
            numbers = vector(model, self._targets[i], "")
            whole = self._targets[i].index == WHOLE
            found[i] = float(np.linalg.norm(numbers)) if whole else numbers[self._targets[i].index]
        return found, matrices

    def passed(self, model: mujoco.MjModel, wanted: Mapping[str, float]) -> bool:
        """Whether *model* holds *wanted* bit for bit, and what the robot's formulas take for granted."""
        expected = self._products(wanted)
        found, matrices = self._numbers(model)
        if not np.array_equal(found[self._exact], expected[self._exact]):
            return False
        size = np.abs(expected)
        scale = np.where(self._relative & (size > 0.0), size, np.maximum(1.0, size))
        gap = np.abs(found - expected)
        if not self._aligned:
            return bool((gap[self._agreeing] <= AGREE * scale[self._agreeing]).all())
        return bool(
            (gap <= ALIGNMENT * scale).all()
            and (np.abs(model.opt.gravity[self._level]) <= ALIGNMENT).all()
            and all(
                (np.abs(getattr(model, f).reshape(-1)[places]) <= ALIGNMENT).all() for f, places in self._rest.items()
            )
            and self._upright(matrices.reshape(-1, 3, 3))
        )

    def _upright(self, matrices: FloatArray) -> bool:
        """Whether bodies that turn have their own axes as principal axes."""
        mine = matrices[[self._inertias.index(body) for body in self._principal]]
        if not len(mine):
            return True
        limit = ALIGNMENT * np.abs(np.diagonal(mine, axis1=1, axis2=2)).max(axis=1)
        off = np.abs(mine[:, [0, 0, 1], [1, 2, 2]]).max(axis=1)
        return bool((off <= limit).all())


def checks_of(
    model: mujoco.MjModel, description: Description, file: str, computed: Collection[str]
) -> NumberChecks | None:
    """Checks of all numbers at once; None where a place is missing, which those can say that look at one by one."""
    try:
        return NumberChecks(model, description, file, computed)
    except (WorkbenchError, LookupError):
        return None


def _body(model: mujoco.MjModel, name: str, file: str) -> int:
    return index_of(model, mujoco.mjtObj.mjOBJ_BODY, "body", name, file)
