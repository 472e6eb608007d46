"""Where in the space of varied numbers the cases of a sweep lie; the same seed gives the same points, bit for bit."""

from __future__ import annotations

import warnings

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.sweep_spec import SweepSpec, Vary


def sweep_values(sweep: SweepSpec) -> FloatArray:
    """Return the varied numbers of every case, ``(cases, keys)``, in case order.

    A grid runs through its last key fastest. Latin hypercube and Sobol points (scrambled) come from `scipy.stats.qmc`.
    """
    if sweep.method == "grid":
        axes = [_axis(vary) for vary in sweep.vary]
        return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)
    if sweep.method == "list":
        return np.array([vary.values for vary in sweep.vary], dtype=np.float64).T
    return np.stack([_scaled(vary, unit) for vary, unit in zip(sweep.vary, _unit_points(sweep).T, strict=True)], axis=1)


def _axis(vary: Vary) -> FloatArray:
    if vary.values is not None:
        return np.array(vary.values, dtype=np.float64)
    return _scaled(vary, np.linspace(0.0, 1.0, vary.count or 0))


def _scaled(vary: Vary, unit: FloatArray) -> FloatArray:
    """Map [0, 1] to the key's range; both ends are met exactly."""
    assert vary.low is not None
    assert vary.high is not None
    if vary.scale == "log":
        found = vary.low * (vary.high / vary.low) ** unit
    else:
        found = vary.low + (vary.high - vary.low) * unit
    return np.clip(found, vary.low, vary.high)


def _unit_points(sweep: SweepSpec) -> FloatArray:
    from scipy.stats import qmc

    kinds = {"latin_hypercube": qmc.LatinHypercube, "sobol": qmc.Sobol}
    with warnings.catch_warnings():
        # scipy advises powers of two for Sobol points; any number is a valid design, only less balanced
        warnings.filterwarnings("ignore", message="The balance properties of Sobol", category=UserWarning)
        points = kinds[sweep.method](d=len(sweep.vary), rng=np.random.default_rng(sweep.seed)).random(sweep.count)
    return np.asarray(points, dtype=np.float64)
