"""What every test may lean on: no display, repeatable property tests, the repository's root."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

os.environ.setdefault("MPLBACKEND", "Agg")

# A script that starts the tests in the background hands them ignored signals, which their children would inherit: tests
# that interrupt one would wait for ever. A handler of ours is the default again in a child.
for _name in ("SIGINT", "SIGHUP", "SIGQUIT"):
    _signal = getattr(signal, _name, None)
    if _signal is not None and signal.getsignal(_signal) is signal.SIG_IGN:
        signal.signal(_signal, signal.default_int_handler)

# Compiling a kernel makes the first example slow, so no deadline and no complaint of slow drawing, which is the
# machine's load; the same examples each time, so no flaky runs.
settings.register_profile("workbench", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("workbench")


@pytest.fixture(scope="session")
def repository() -> Path:
    """The root of the source checkout."""
    return Path(__file__).resolve().parents[1]


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures of reports stay empty: for tests of words and tables, as drawing takes seven eighths of the time."""
    from workbench.report.plot import Plot
    from workbench.report.svg import new_figure, svg_of

    monkeypatch.setattr(Plot, "drawn", lambda plot, size: svg_of(new_figure(*size), plot.key))


@pytest.fixture
def inline_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sweeps and studies compute in this process: a worker takes seconds to start, and is the subject of few tests."""
    from inline_pool import Inline

    monkeypatch.setattr("workbench.sweep.computing.Supervisor", Inline)


@pytest.fixture(scope="session")
def warm_kernels(repository: Path) -> None:
    """Both robots' kernels compiled and kept: a first use says so on stderr, where some tests look at every line."""
    import numpy as np

    import workbench as wb

    for robot, x in {"asym_2rss_ppap": (0.0, 0.0, 0.4), "planar_4rprp": (0.26, 0.25, 0.3)}.items():
        reference = wb.MujocoReference(repository / "models" / f"{robot}.xml")
        mechanism = wb.load_mechanism(repository / "models" / f"{robot}.xml")
        q, still = mechanism.inverse_kinematics(np.tile(x, (30, 1))), np.zeros((30, 3))
        mechanism.platform_motion(q, still, still)
        mechanism.inverse_dynamics(q, still, still)
        reference.inverse_dynamics(q, still, still)
