"""Calling a compiled closed form: a batch over threads, or one sample of a control loop.

A kernel exists for one set of argument types only. Whatever else a caller brings is converted, because compiling for it
would stop a control loop for seconds.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Protocol

import numpy as np

from workbench.arrays import FloatArray, as_batch, as_batches
from workbench.compiled import NumbaError, float64, types
from workbench.errors import ParameterError
from workbench.robots.blocks import BLOCK

SAMPLES_PER_THREAD = 2048
"""Fewer are not worth waking a thread for: they take some 20 us."""

LARGEST_PIECE = 256 * BLOCK
"""samples that a thread takes at a time; some 400 us"""

MOST_THREADS = 256


class TorqueKernel(Protocol):
    """Inverse dynamics of one sample, as `Mechanism.kernel` returns it."""

    def __call__(
        self,
        q: FloatArray,
        qd: FloatArray,
        qdd: FloatArray,
        external_force: FloatArray | None = None,
        out: FloatArray | None = None,
    ) -> FloatArray:
        """Return tau ``(3,)`` for one sample; with *out* nothing is allocated."""


def fill_torques(
    kernel: Any,
    constants: FloatArray,
    q: FloatArray,
    qd: FloatArray,
    qdd: FloatArray,
    force: FloatArray,
    tau: FloatArray,
    threads: int = 1,
) -> int:
    """Fill tau ``(n, 3)``; the same bits for any number of threads.

    Parameters
    ----------
    kernel
        A mechanism's ``torques_batch``.
    constants
        From the mechanism's ``pack``.
    q, qd, qdd, tau
        ``(n, 3)``, C-contiguous; force ``(n, 3)`` or ``(1, 3)``, one for all samples.
    threads
        At most so many threads.

    Returns
    -------
    int
        How many samples have no finite torques though all inputs are finite.

    Raises
    ------
    ArrayError
        An input is not finite. Arithmetic carries NaN through to the torques, so inputs are looked at only then.
    """
    _ready(kernel, 2)
    n = len(q)
    workers = 1 if checked_threads(threads) == 1 else min(threads, n // SAMPLES_PER_THREAD)
    if workers <= 1:
        bad = kernel(constants, q, qd, qdd, force, tau)
    else:
        size = min(LARGEST_PIECE, BLOCK * -(-n // (workers * BLOCK)))
        pieces = iter(range(0, n, size))

        def share() -> int:
            found = 0
            # threads take pieces as they get ready for them, so that one that is held up holds up no other
            for first in pieces:
                here = slice(first, first + size)
                some = force if len(force) == 1 else force[here]
                found += kernel(constants, q[here], qd[here], qdd[here], some, tau[here])
            return found

        others = [_pool(workers - 1).submit(share) for _ in range(workers - 1)]
        bad = share() + sum(other.result() for other in others)
    if bad:
        as_batches(q=q, qd=qd, qdd=qdd)
        as_batch("external_force", force)
    return int(bad)


def checked_threads(threads: int) -> int:
    """Return a number of threads as given.

    Raises
    ------
    ParameterError
        It is not between 1 and `MOST_THREADS`.
    """
    if not 1 <= threads <= MOST_THREADS:
        raise ParameterError(f"threads = {threads}; allowed: 1 to {MOST_THREADS}", value=threads)
    return threads


Refusal = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], None]
Friction = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]


def one_sample(kernel: Any, constants: FloatArray, refuse: Refusal, friction: Friction | None) -> TorqueKernel:
    """Prepare a mechanism's ``torques_single`` for a control loop.

    Parameters
    ----------
    kernel
        The compiled function; it is compiled, or loaded, here and not at the first sample.
    constants
        From the mechanism's ``pack``.
    refuse
        Called with q, qd, qdd ``(1, 3)`` and the force ``(1, 3)`` when a sample has no finite torques; raises.
    friction
        Called with q, qd, qdd ``(1, 3)``: what is added; None adds nothing.
    """
    _ready(kernel, 1)
    still = np.zeros(3)

    def torque(
        q: FloatArray,
        qd: FloatArray,
        qdd: FloatArray,
        external_force: FloatArray | None = None,
        out: FloatArray | None = None,
    ) -> FloatArray:
        tau = np.empty(3) if out is None else out
        force = still if external_force is None else external_force
        # copies: out may be one of the arguments
        state = None if friction is None else (_row(q), _row(qd), _row(qdd))
        try:
            done = kernel(constants, q, qd, qdd, force, tau)
        except (TypeError, NumbaError):
            # lists, other number types (of which older numba knows not all by name), strided views
            given = as_batches(q=[q], qd=[qd], qdd=[qdd], external_force=[force])
            found = np.empty(3)
            done = kernel(constants, *(array[0] for array in given), found)
            tau[:] = found
        if not done:
            given = as_batches(q=[q], qd=[qd], qdd=[qdd], external_force=[force])
            as_batch("out", _row(np.zeros_like(tau)))
            refuse(*given)
        if friction is not None and state is not None:
            tau += friction(*state)[0]
        return tau

    # the first call of a compiled function looks up how to convert its arguments
    kernel(constants, still, still, still, still, np.empty(3))
    return torque


def _row(values: Any) -> FloatArray:
    row: FloatArray = np.array(values, dtype=np.float64)[None]
    return row


_compiled: set[int] = set()


def _ready(kernel: Any, dimensions: int) -> None:
    """Compile or load the one version of a kernel there is: inputs may be read-only, all arrays are C-contiguous."""
    if id(kernel) in _compiled:
        return
    given = types.Array(float64, dimensions, "C", readonly=True)
    kernel.compile((types.Array(float64, 1, "C", readonly=True), *[given] * 4, types.Array(float64, dimensions, "C")))
    kernel.disable_compile()
    _compiled.add(id(kernel))


_pools: dict[tuple[int, int], ThreadPoolExecutor] = {}


def _pool(workers: int) -> ThreadPoolExecutor:
    # a forked process inherits the table, but not the threads
    key = os.getpid(), workers
    if key not in _pools:
        _pools[key] = ThreadPoolExecutor(workers, thread_name_prefix="workbench")
    return _pools[key]
