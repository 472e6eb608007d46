"""MuJoCo's warnings are heard by the thread that caused them, and nobody takes another's handler or filters away."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import mujoco
import numpy as np
import pytest

from workbench.mjcf.engine_warnings import engine_warnings

PENDULUM = "<mujoco><worldbody><body><joint name='j'/><geom size='.1'/></body></worldbody></mujoco>"


@pytest.fixture
def other() -> Iterator[ThreadPoolExecutor]:
    """Another thread, that does one thing after the other as it is told."""
    with ThreadPoolExecutor(1) as thread:
        yield thread


def warn() -> None:
    """Make MuJoCo warn; unheard, it writes a log file."""
    model = mujoco.MjModel.from_xml_string(PENDULUM)
    data = mujoco.MjData(model)
    data.qpos[0] = np.nan
    mujoco.mj_step(model, data)


def test_each_thread_hears_its_own(other: ThreadPoolExecutor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    before = mujoco.get_mju_user_warning()
    with engine_warnings() as mine:
        beside = engine_warnings()
        theirs = other.submit(beside.__enter__).result()
        warn()
        assert (len(mine), len(theirs)) == (1, 0)
        other.submit(warn).result()
        assert (len(mine), len(theirs)) == (1, 1)
        with engine_warnings() as inner:
            warn()
        assert (len(mine), len(inner), len(theirs)) == (1, 1, 1)
    # who came first has gone, the other listens on
    other.submit(warn).result()
    assert len(theirs) == 2
    warn()  # nobody's: heard by all
    assert len(theirs) == 3
    other.submit(beside.__exit__, None, None, None).result()
    assert mujoco.get_mju_user_warning() is before
    assert list(tmp_path.iterdir()) == []


def test_filters_of_another_thread_stay(other: ThreadPoolExecutor) -> None:
    beside = engine_warnings()
    other.submit(beside.__enter__).result()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")
        other.submit(beside.__exit__, None, None, None).result()
        warnings.warn("Glyph 3 is missing", stacklevel=1)  # an error, as in all tests, where the filter is gone
    with pytest.raises(UserWarning, match="Glyph 3"):
        warnings.warn("Glyph 3 is missing", stacklevel=1)


def test_what_compile_says_is_dropped_again_and_again() -> None:
    code = compile("warnings.warn('said by compile')", "compile.py", "exec")
    said = {"warnings": warnings, "__name__": "workbench.mjcf.compile"}
    for _ in range(2):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with pytest.raises(UserWarning, match="said by compile"):
                exec(code, dict(said))
            with engine_warnings():
                exec(code, dict(said))
                with pytest.raises(UserWarning, match="of another"):
                    warnings.warn("of another", stacklevel=1)
