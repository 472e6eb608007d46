"""Checks of array arguments at the public surface: the one place that says argument, expected, got."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.errors import ArrayError

FloatArray = NDArray[np.float64]

FLOAT = np.dtype(np.float64)
"""the one object that is the type of nearly all such arrays: to find it again takes a third of a comparison"""


def as_rows(name: str, value: ArrayLike, columns: int = 3) -> FloatArray:
    """Return *value* as a C-contiguous float64 array of shape ``(n, columns)``, its entries not looked at.

    Raises
    ------
    ArrayError
        Wrong shape or not numeric.
    """
    if type(value) is np.ndarray and value.dtype is FLOAT and value.flags.c_contiguous:
        array: FloatArray = value  # the usual case, of one sample again and again
    else:
        array = np.ascontiguousarray(_real(name, value, f"(n, {columns})"))
    shape = array.shape
    if len(shape) != 2 or shape[1] != columns:
        raise ArrayError(f"{name}: expected shape (n, {columns}), got {shape}", argument=name, shape=shape)
    return array


def _real(name: str, value: ArrayLike, shape: str) -> FloatArray:
    try:
        # made real, complex numbers would lose their imaginary part with no more than a warning
        if np.iscomplexobj(value):
            raise ArrayError(f"{name}: expected real numbers of shape {shape}, got complex ones", argument=name)
        return np.asarray(value, dtype=np.float64)
    except ArrayError:
        raise
    except (TypeError, ValueError) as error:
        raise ArrayError(f"{name}: expected numbers of shape {shape}, got {type(value).__name__}") from error


def as_batch(name: str, value: ArrayLike, columns: int = 3) -> FloatArray:
    """Return *value* as a finite, C-contiguous float64 array of shape ``(n, columns)``.

    Parameters
    ----------
    name
        The argument's name, for the message.
    value
        Anything NumPy makes an array of. One sample of shape ``(columns,)`` is refused: batch first, always.
    columns
        The demanded number of columns.

    Raises
    ------
    ArrayError
        Wrong shape, not numeric, or not finite; the message names the first bad sample.
    """
    array = as_rows(name, value, columns)
    finite = np.isfinite(array)
    if not finite.all():
        sample, column = np.argwhere(~finite)[0]
        raise ArrayError(
            f"{name}: sample {sample}, column {column} is {array[sample, column]}; every entry must be finite",
            argument=name,
            sample=int(sample),
        )
    return array


def as_batches(columns: int = 3, **arguments: ArrayLike) -> tuple[FloatArray, ...]:
    """Check several arguments with `as_batch` and that they agree on the number of samples.

    Raises
    ------
    ArrayError
        As `as_batch`, or when the arguments' lengths differ.
    """
    return same_lengths(**{name: as_batch(name, value, columns) for name, value in arguments.items()})


def same_lengths(**arrays: FloatArray) -> tuple[FloatArray, ...]:
    """Return arrays that agree on the number of samples.

    Raises
    ------
    ArrayError
        They do not; the message lists names and lengths.
    """
    found = tuple(arrays.values())
    if any(len(array) != len(found[0]) for array in found):
        lengths = {name: len(array) for name, array in arrays.items()}
        listed = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise ArrayError(f"arguments differ in their number of samples: {listed}", **lengths)
    return found


def as_force(name: str, value: ArrayLike | None, samples: int) -> FloatArray:
    """Return an external force as shape ``(samples, 3)``: None is zero, one vector ``(3,)`` holds for all samples.

    Raises
    ------
    ArrayError
        Any other shape, or entries that are not finite.
    """
    if value is None:
        return np.zeros((samples, 3))
    array = _real(name, value, f"(3,) or ({samples}, 3)")
    if array.shape == (3,):
        array = np.broadcast_to(array, (samples, 3))
    checked = as_batch(name, array)
    if len(checked) != samples:
        raise ArrayError(f"{name}: expected shape (3,) or ({samples}, 3), got {array.shape}", argument=name)
    return checked
