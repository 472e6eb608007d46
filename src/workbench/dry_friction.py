"""The sign of dry friction, once, for closed forms and references alike.

Coulomb friction opposes motion with a constant force. At rest it is whatever holds the joint, anything from minus to
plus that constant, and inverse dynamics cannot say which: a convention is needed, and both sides of a comparison need
the same.
"""

from __future__ import annotations

import numpy as np

from workbench.arrays import FloatArray

REST_SPEED = 1e-9
"""Metres or radians per second: a joint this slow counts as resting, and its dry friction as zero, the middle of what
it may be. A sample at a reversal misses zero speed by rounding, 1e-13 and less; a joint at this speed moves by a
nanometre in a second."""


def at_rest(qd: FloatArray) -> np.ndarray:
    """Tell which joints count as resting, same shape as *qd* (m/s or rad/s)."""
    resting: np.ndarray = np.abs(qd) <= REST_SPEED
    return resting


def direction(qd: FloatArray) -> FloatArray:
    """Return 1 for joints that move forwards, -1 backwards, 0 at rest; same shape as *qd* (m/s or rad/s)."""
    result: FloatArray = np.where(at_rest(qd), 0.0, np.sign(qd))
    return result
