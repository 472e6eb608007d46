"""What models that differ in nothing but numbers use one after the other, since making it takes longer than using it.

A variant of a robot has the same joints, bodies and loops as the one before, and MuJoCo's data and batches serve
either: nothing of one is left where the other looks. What belongs to a model's numbers is never kept here.
"""

from __future__ import annotations

import contextlib
import queue
import weakref
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import mujoco

if TYPE_CHECKING:
    from workbench.reference.engine import Evaluator
    from workbench.reference.structure import Structure
    from workbench.reference.tables import Tables


@dataclass
class Shelf:
    """Things that are taken, used, and put back; safe for threads."""

    evaluators: queue.SimpleQueue[Evaluator] = field(default_factory=queue.SimpleQueue)
    data: queue.SimpleQueue[mujoco.MjData] = field(default_factory=queue.SimpleQueue)
    structure: Structure | None = None
    """of some model of the family: names, tree and closures are those of all"""
    tables: Tables | None = None
    """likewise"""

    @contextlib.contextmanager
    def data_of(self, model: mujoco.MjModel) -> Iterator[mujoco.MjData]:
        """MuJoCo's data, as new, for *model*, which has to be one of the family."""
        try:
            data = self.data.get_nowait()
        except queue.Empty:
            data = mujoco.MjData(model)
        else:
            if len(data.M) == model.nC:
                mujoco.mj_resetData(model, data)
            else:  # bodies that MuJoCo calls simple have a smaller mass matrix
                data = mujoco.MjData(model)
        yield data
        self.data.put(data)


_shelves: weakref.WeakKeyDictionary[object, Shelf] = weakref.WeakKeyDictionary()


def shelf_of(family: object) -> Shelf:
    """The shelf of a family of models (`workbench.robots.load.LoadedModel.family`); None has one for itself."""
    return Shelf() if family is None else _shelves.setdefault(family, Shelf())
