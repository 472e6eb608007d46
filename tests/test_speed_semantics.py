"""What speed may not change: the same bits alone, in a batch and over threads; NaN stays NaN; first use and caches."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

import workbench as wb
from workbench.capabilities.robot import Robot
from workbench.compiled import KERNEL_FILES
from workbench.errors import ArrayError, MotionError, ParameterError
from workbench.robots import kernel_call
from workbench.robots.asym_2rss_ppap import kernel as asym_kernel
from workbench.robots.blocks import BLOCK
from workbench.robots.kernel_call import SAMPLES_PER_THREAD
from workbench.robots.planar_4rprp import kernel as planar_kernel
from workbench.robots.sine_cosine import HALF_PI_HIGH, HALF_PI_MIDDLE, LARGEST_ANGLE, sine_cosine

REPOSITORY = Path(__file__).resolve().parents[1]
BENCHMARKS = REPOSITORY / "benchmarks"
PLACES = {"asym_2rss_ppap": (0.02, 0.03, 0.40), "planar_4rprp": (0.26, 0.25, 0.30)}
KERNELS = {"asym_2rss_ppap": asym_kernel, "planar_4rprp": planar_kernel}
SAMPLES = BLOCK + 37
"""A full block and one that is not, with a remainder that fills no vector."""

both_robots = pytest.mark.parametrize("robot", sorted(PLACES))


def mechanism_of(robot: str, **parameters: float) -> Robot:
    return wb.load_mechanism(REPOSITORY / "models" / f"{robot}.xml", **parameters)


def state(mechanism: Robot, samples: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    x = np.array(PLACES[mechanism.name]) + random.uniform(-0.03, 0.03, (samples, 3))
    return mechanism.inverse_kinematics(x), random.normal(size=(samples, 3)), 10 * random.normal(size=(samples, 3))


# --- the same bits ----------------------------------------------------------------------------------------------------


@both_robots
@pytest.mark.parametrize("mass_model", ["distributed", "lumped"])
def test_alone_in_a_batch_and_in_a_control_loop(robot: str, mass_model: str) -> None:
    mechanism = mechanism_of(robot)
    q, qd, qdd = state(mechanism, SAMPLES)
    force = np.array([1.0, -2.0, 3.0])
    together = mechanism.inverse_dynamics(q, qd, qdd, mass_model, force)
    kernel, out = mechanism.kernel(mass_model), np.empty(3)
    for i in range(SAMPLES):
        one = slice(i, i + 1)
        alone = mechanism.inverse_dynamics(q[one], qd[one], qdd[one], mass_model, force)
        assert np.array_equal(alone[0], together[i])
        assert kernel(q[i], qd[i], qdd[i], force, out) is out
        assert np.array_equal(out, together[i])
    nudged = mechanism.inverse_dynamics(np.nextafter(q, np.inf), qd, qdd, mass_model, force)
    assert not np.array_equal(nudged, together)


@both_robots
def test_one_force_for_all_is_the_same_force_for_each(robot: str) -> None:
    mechanism = mechanism_of(robot)
    q, qd, qdd = state(mechanism, SAMPLES)
    force = np.array([3.0, 1.0, -4.0])
    each = mechanism.inverse_dynamics(q, qd, qdd, external_force=np.tile(force, (SAMPLES, 1)))
    assert np.array_equal(mechanism.inverse_dynamics(q, qd, qdd, external_force=force), each)
    assert np.array_equal(mechanism.torques(q, qd, qdd, "distributed", force[None]), each)
    assert not np.array_equal(mechanism.inverse_dynamics(q, qd, qdd), each)


@both_robots
@pytest.mark.parametrize("threads", [2, 3, 8])
def test_closed_forms_over_threads(robot: str, threads: int) -> None:
    mechanism = mechanism_of(robot)
    # enough for as many threads as asked for, and no multiple of anything
    q, qd, qdd = state(mechanism, threads * SAMPLES_PER_THREAD + 101)
    force = np.random.default_rng(1).normal(size=q.shape)
    one = mechanism.inverse_dynamics(q, qd, qdd, external_force=force)
    assert np.array_equal(mechanism.inverse_dynamics(q, qd, qdd, external_force=force, threads=threads), one)
    q[-1, 1] = np.nan
    with pytest.raises(ArrayError, match=f"sample {len(q) - 1}, column 1 is nan"):
        mechanism.inverse_dynamics(q, qd, qdd, external_force=force, threads=threads)


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
def test_as_many_threads_take_part_as_are_asked_for(monkeypatch: pytest.MonkeyPatch, threads: int) -> None:
    """The same bits come of one thread: that others take part shows in nothing but time."""
    asked: list[int] = []

    class Pool:
        def submit(self, share: Any) -> Any:
            asked.append(share())
            return SimpleNamespace(result=lambda found=asked[-1]: found)

    def pool(workers: int) -> Pool:
        assert workers == threads - 1
        return Pool()

    def kernel(c: Any, q: Any, qd: Any, qdd: Any, force: Any, tau: Any) -> int:
        tau[:] = q + force
        return len(q)

    monkeypatch.setattr(kernel_call, "_pool", pool)
    monkeypatch.setattr(kernel_call, "_ready", lambda kernel, dimensions: None)
    q = np.arange(3.0 * threads * SAMPLES_PER_THREAD).reshape(-1, 3)
    for force in (np.ones((1, 3)), q):
        asked.clear()
        tau = np.zeros_like(q)
        assert kernel_call.fill_torques(kernel, np.zeros(1), q, q, q, force, tau, threads) == len(q)
        assert len(asked) == threads - 1
        assert np.array_equal(tau, q + force)


@both_robots
def test_the_reference_over_threads(robot: str) -> None:
    path = REPOSITORY / "models" / f"{robot}.xml"
    mechanism = mechanism_of(robot)
    q, qd, qdd = state(mechanism, 2000)
    one = wb.MujocoReference(path).inverse_dynamics(q, qd, qdd, external_force=[1.0, 2.0, 3.0])
    for threads in (2, 3):
        more = wb.MujocoReference(path, threads=threads).inverse_dynamics(q, qd, qdd, external_force=[1.0, 2.0, 3.0])
        for name in ("tau", "x", "xd", "xdd", "qpos", "qvel", "qacc", "energy", "closure_residual", "condition"):
            assert np.array_equal(getattr(one, name), getattr(more, name)), name
        assert all(np.array_equal(one.reactions[name], more.reactions[name]) for name in one.reactions)
    q[0, 0] = np.nextafter(q[0, 0], 1.0)
    assert not np.array_equal(wb.MujocoReference(path).inverse_dynamics(q, qd, qdd).tau, one.tau)


@pytest.mark.parametrize("threads", [0, -1, 1000])
def test_a_number_of_threads_that_makes_no_sense(threads: int) -> None:
    mechanism = mechanism_of("planar_4rprp")
    with pytest.raises(ParameterError, match=f"threads = {threads}; allowed: 1 to "):
        mechanism.inverse_dynamics(*state(mechanism, 3), threads=threads)
    with pytest.raises(ParameterError, match=f"threads = {threads}; allowed: 1 to "):
        wb.MujocoReference(REPOSITORY / "models/planar_4rprp.xml", threads=threads)


@both_robots
def test_what_a_reference_returned_is_the_callers(robot: str) -> None:
    mechanism = mechanism_of(robot)
    reference = wb.MujocoReference(REPOSITORY / "models" / f"{robot}.xml")
    q, qd, qdd = state(mechanism, 5)
    first = reference.inverse_dynamics(q, qd, qdd)
    kept = first.tau.copy()
    for spoiled in (first.qpos, first.closure_residual, first.condition, first.tau):
        spoiled[:] = np.nan
    first.rank[:] = 0
    assert np.array_equal(reference.inverse_dynamics(q, qd, qdd).tau, kept)


# --- numbers that are none --------------------------------------------------------------------------------------------


@both_robots
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_never_becomes_a_number(robot: str, bad: float) -> None:
    mechanism, kernel = mechanism_of(robot), KERNELS[robot]
    constants = kernel.pack(mechanism.parameters)
    clean = [*state(mechanism, SAMPLES), np.random.default_rng(2).normal(size=(SAMPLES, 3))]
    good = np.empty((SAMPLES, 3))
    assert kernel.torques_batch(constants, *clean, good) == 0
    for which in range(4):
        for column in range(3):
            # the first of a vector, inside one, in the remainder of a block
            for sample in (0, 13, SAMPLES - 1):
                arrays = [array.copy() for array in clean]
                arrays[which][sample, column] = bad
                tau = np.zeros((SAMPLES, 3))
                assert kernel.torques_batch(constants, *arrays, tau) == 1
                assert not np.isfinite(tau[sample]).all()
                others = np.arange(SAMPLES) != sample
                assert np.array_equal(tau[others], good[others])
                assert not kernel.torques_single(constants, *(array[sample] for array in arrays), np.zeros(3))


@both_robots
def test_bad_entries_are_named_as_ever(robot: str) -> None:
    mechanism = mechanism_of(robot)
    names = ("q", "qd", "qdd", "external_force")
    for which, name in enumerate(names):
        arrays = [*state(mechanism, 9), np.zeros((9, 3))]
        arrays[which][4, 2] = np.inf
        with pytest.raises(ArrayError, match=f"^{name}: sample 4, column 2 is inf; every entry must be finite"):
            mechanism.inverse_dynamics(*arrays[:3], external_force=arrays[3])
    q, qd, qdd = state(mechanism, 9)
    with pytest.raises(ArrayError, match="arguments differ in their number of samples: q 9, qd 8, qdd 9"):
        mechanism.inverse_dynamics(q, qd[:8], qdd)


@both_robots
def test_a_pose_out_of_reach_among_good_ones_is_named(robot: str) -> None:
    mechanism = mechanism_of(robot)
    q, qd, qdd = state(mechanism, 3 * SAMPLES_PER_THREAD)
    q[-3, 0] = 5.0
    for threads in (1, 3):
        with pytest.raises(MotionError, match=f"^sample {len(q) - 3}, joint q1"):
            mechanism.inverse_dynamics(q, qd, qdd, threads=threads)


def test_a_singular_pose_of_the_planar_robot_is_refused() -> None:
    # Py = 0: limbs 1 and 3 in line along z
    mechanism = mechanism_of("planar_4rprp")
    q, still = np.array([[0.3, 0.3, 0.3 + 1e-15]]), np.zeros((1, 3))
    with pytest.raises(MotionError, match=r"^sample 0, joint "):
        mechanism.inverse_dynamics(q, still, still)
    with pytest.raises(MotionError, match=r"^sample 0, joint "):
        mechanism.kernel()(q[0], still[0], still[0])


def test_an_angle_beyond_all_reason_is_refused() -> None:
    mechanism = mechanism_of("asym_2rss_ppap")
    q, still = np.array([[0.0, 0.8, 0.8]]), np.zeros((1, 3))
    turns = 2 * np.pi * np.floor(LARGEST_ANGLE / (2 * np.pi) - 1)
    far = mechanism.inverse_dynamics(q + np.array([0.0, turns, turns]), still, still)
    assert np.abs(far - mechanism.inverse_dynamics(q, still, still)).max() < 1e-7
    with pytest.raises(MotionError, match=r"sample 0, joint q2, q3: an angle exceeds 1e\+06 rad"):
        mechanism.inverse_dynamics(q + np.array([0.0, 1.1 * LARGEST_ANGLE, 0.0]), still, still)


# --- sine and cosine --------------------------------------------------------------------------------------------------

ROUNDING = 2.5e-16


def angles() -> np.ndarray:
    random = np.random.default_rng(0)
    quarters = np.pi / 2 * np.arange(-2000, 2000)
    wide = random.uniform(-1, 1, 20000) * 10.0 ** random.uniform(-10, 6, 20000)
    return np.concatenate([wide, quarters, np.nextafter(quarters, 9e9), [0.0, -0.0, LARGEST_ANGLE, -LARGEST_ANGLE]])


def test_sine_and_cosine_against_the_c_library_and_addition() -> None:
    theta = angles()
    found = np.array([sine_cosine(angle) for angle in theta])
    assert np.abs(found[:, 0] - np.sin(theta)).max() < ROUNDING
    assert np.abs(found[:, 1] - np.cos(theta)).max() < ROUNDING
    assert np.abs(found[:, 0] ** 2 + found[:, 1] ** 2 - 1).max() < 2 * ROUNDING
    # the second oracle: sin(a + b) from sines and cosines of halves, which are exact to halve
    half = np.array([sine_cosine(angle / 2) for angle in theta])
    assert np.abs(2 * half[:, 0] * half[:, 1] - found[:, 0]).max() < 4 * ROUNDING
    # without the third part of pi/2 large angles are off
    short = theta - np.rint(theta * 2 / np.pi) * HALF_PI_HIGH - np.rint(theta * 2 / np.pi) * HALF_PI_MIDDLE
    quarter = np.rint(theta * 2 / np.pi).astype(int) % 4
    spoiled = np.choose(quarter, [np.sin(short), np.cos(short), -np.sin(short), -np.cos(short)])
    assert np.abs(spoiled - np.sin(theta)).max() > ROUNDING


def test_no_sine_of_what_is_no_angle() -> None:
    for angle in (np.nan, np.inf, -np.inf, 1.001 * LARGEST_ANGLE):
        assert np.isnan(sine_cosine(angle)).all()


# --- the prepared callable --------------------------------------------------------------------------------------------

FRICTION = {
    "asym_2rss_ppap": {"damping_q1": 12.0, "coulomb_q2": 0.3, "damping_slide": 2.0},
    "planar_4rprp": {"damping_q1": 12.0, "coulomb_q2": 3.0, "damping_slide": 2.0},
}


@both_robots
def test_friction_is_in_the_prepared_callable(robot: str) -> None:
    smooth, rough = mechanism_of(robot), mechanism_of(robot, **FRICTION[robot])
    q, qd, qdd = state(rough, 4)
    want = rough.inverse_dynamics(q, qd, qdd)
    kernel, without = rough.kernel(), smooth.kernel()
    for i in range(4):
        assert np.array_equal(kernel(q[i], qd[i], qdd[i]), want[i])
        assert np.abs(without(q[i], qd[i], qdd[i]) - want[i]).max() > 0.1


@both_robots
def test_torques_may_be_written_over_an_argument(robot: str) -> None:
    for changes in ({}, FRICTION[robot]):
        mechanism = mechanism_of(robot, **changes)
        kernel = mechanism.kernel()
        state_and_force = [array[0] for array in state(mechanism, 1)] + [np.array([1.0, -2.0, 3.0])]
        want = kernel(*state_and_force)
        for i in range(4):
            arguments = [array.copy() for array in state_and_force]
            assert np.array_equal(kernel(*arguments, arguments[i]), want)


@both_robots
def test_complex_numbers_and_texts_are_refused(robot: str) -> None:
    mechanism = mechanism_of(robot)
    kernel = mechanism.kernel()
    q, qd, qdd = (array[0] for array in state(mechanism, 1))
    force = np.zeros(3)
    for place, name in enumerate(("q", "qd", "qdd", "external_force")):
        for wrong, said in ((1j, f"{name}: expected real numbers"), ("a", f"{name}: expected numbers")):
            arguments: list[Any] = [q, qd, qdd, force]
            arguments[place] = [wrong] * 3
            with pytest.raises(ArrayError, match=said):
                kernel(*arguments)
            batch = [np.array([values]) for values in arguments[:3]]
            with pytest.raises(ArrayError, match=said):
                mechanism.inverse_dynamics(*batch, external_force=arguments[3])


@both_robots
def test_other_arrays_are_converted_and_never_compiled_for(robot: str) -> None:
    mechanism = mechanism_of(robot)
    kernel = mechanism.kernel()
    q, qd, qdd = (array[0] for array in state(mechanism, 1))
    want = kernel(q, qd, qdd)
    frozen = q.copy()
    frozen.flags.writeable = False
    for other in (frozen, list(q), np.repeat(q, 2)[::2], q.astype(np.longdouble)):
        assert np.array_equal(kernel(other, qd, qdd), want)
    out = np.zeros(6)
    assert np.array_equal(kernel(q, qd, qdd, out=out[::2]), want)
    assert np.array_equal(out[::2], want)
    assert len(KERNELS[robot].torques_single.signatures) == 1
    for frozen_batch in (frozen[None], np.asfortranarray(np.tile(q, (2, 1)))):
        rates = np.tile(qd, (len(frozen_batch), 1)), np.tile(qdd, (len(frozen_batch), 1))
        assert np.array_equal(mechanism.inverse_dynamics(frozen_batch, *rates)[-1], want)
    assert len(KERNELS[robot].torques_batch.signatures) == 1


@both_robots
def test_the_prepared_callable_refuses_as_the_method_does(robot: str) -> None:
    mechanism = mechanism_of(robot)
    kernel = mechanism.kernel()
    q, qd, qdd = (array[0] for array in state(mechanism, 1))
    with pytest.raises(ArrayError, match=r"^qd: expected shape \(n, 3\), got \(1, 2\)"):
        kernel(q, qd[:2], qdd)
    with pytest.raises(ArrayError, match=r"^out: expected shape"):
        kernel(q, qd, qdd, out=np.empty(4))
    with pytest.raises(ArrayError, match=r"^qdd: sample 0, column 1 is nan"):
        kernel(q, qd, np.array([0.0, np.nan, 0.0]))
    far = np.array([9.0, 0.4, 0.4])
    with pytest.raises(MotionError, match=r"^sample 0, joint q1") as refused:
        mechanism.inverse_dynamics(far[None], qd[None], qdd[None])
    with pytest.raises(MotionError) as one:
        kernel(far, qd, qdd)
    assert str(one.value) == str(refused.value)
    with pytest.raises(ParameterError, match='unknown mass model "lumpy"; did you mean "lumped"'):
        mechanism.kernel("lumpy")


@both_robots
def test_a_control_loop_allocates_no_arrays(robot: str) -> None:
    mechanism = mechanism_of(robot)
    kernel, out = mechanism.kernel(), np.empty(3)
    q, qd, qdd = (array[0] for array in state(mechanism, 1))
    kernel(q, qd, qdd, None, out)

    def blocks_after(calls: int, target: np.ndarray | None) -> int:
        before = sys.getallocatedblocks()
        kept = [kernel(q, qd, qdd, None, target) for _ in range(calls)]
        return sys.getallocatedblocks() - before + 0 * len(kept)

    assert blocks_after(1000, out) < 100
    assert blocks_after(1000, None) >= 1000


# --- first use and caches ---------------------------------------------------------------------------------------------

USE = """
import sys
from workbench.notices import subscribers
subscribers.append(lambda notice: print("NOTICE", notice))
import numpy as np
import workbench
robot = workbench.load_mechanism(sys.argv[1])
still = np.zeros((2, 3))
print("TAU", robot.inverse_dynamics(np.full((2, 3), 0.4), still, still)[0].tolist())
"""


@pytest.fixture
def read_only_package(tmp_path: Path) -> Path:
    """A copy of the package that cannot hold caches: a file stands where their directories would be."""
    package = tmp_path / "site" / "workbench"
    shutil.copytree(REPOSITORY / "src" / "workbench", package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(REPOSITORY / "models", package / "data" / "models")
    for directory in [package, *(path for path in package.rglob("*") if path.is_dir())]:
        (directory / "__pycache__").write_text("not a directory")
    return package


def use(package: Path, cache: Path) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", USE, str(REPOSITORY / "models/planar_4rprp.xml")],
        capture_output=True, text=True, timeout=300, check=False,
        env={k: v for k, v in os.environ.items() if not k.startswith("NUMBA")}
        | {"PYTHONPATH": str(package.parent), "XDG_CACHE_HOME": str(cache), "HOME": str(cache)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.slow
def test_a_read_only_installation_keeps_its_kernels_in_the_users_cache(read_only_package: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()
    first = use(read_only_package, cache)
    assert [line.split()[0] for line in first] == ["NOTICE", "TAU"]
    assert f"(kept in {cache}" in first[0]
    assert list(cache.rglob("*.nbc"))
    second = use(read_only_package, cache)
    assert second == first[1:]
    # a kernel is made of other files too, and does not outlive a change in them
    blocks = read_only_package / "robots/sine_cosine.py"
    blocks.write_text(blocks.read_text() + "\n# changed\n")
    assert [line.split()[0] for line in use(read_only_package, cache)] == ["NOTICE", "TAU"]


@pytest.mark.slow
def test_where_nothing_can_be_written_it_works_and_says_so(read_only_package: Path, tmp_path: Path) -> None:
    nowhere = tmp_path / "file"
    nowhere.write_text("not a directory")
    notice, tau = use(read_only_package, nowhere)
    assert "not kept: no writable cache directory; set NUMBA_CACHE_DIR" in notice
    assert tau.startswith("TAU")


def test_what_numba_makes_by_itself_is_no_first_use_and_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """The constructor of a structure of arrays is a function of no module: whoever compiles one saw a traceback."""
    from numba.core import event

    from workbench import compiled

    listening: list[Any] = []
    monkeypatch.setattr(event, "register", lambda kind, listener: listening.append(listener))
    said: list[str] = []
    monkeypatch.setattr(compiled, "tell", said.append)
    compiled._announce()
    for module in (None, "of_a_user", "workbench.reference.rows", "workbench.reference.rows"):
        kernel = FunctionType((lambda: None).__code__, {"__name__": module})
        kernel.__module__ = module  # type: ignore[assignment]
        listening[0].on_start(SimpleNamespace(data={"dispatcher": SimpleNamespace(py_func=kernel)}))
    listening[0].on_start(SimpleNamespace(data={}))
    assert len(said) == 1
    assert said[0].startswith("compiling numerical kernels for this machine, once")


def test_every_kernel_is_compiled_by_the_one_decorator() -> None:
    root = REPOSITORY / "src" / "workbench"
    using = {path.relative_to(root).as_posix(): path.read_text(encoding="utf-8") for path in root.rglob("*.py")}
    assert [name for name, text in using.items() if "njit" in text] == ["compiled.py"]
    kernels = {name for name, text in using.items() if "@compiled\n" in text or "@inlined\n" in text}
    assert kernels <= set(KERNEL_FILES)
    assert set(KERNEL_FILES) <= set(using)


def test_help_loads_nothing_heavy() -> None:
    code = (
        "import sys, workbench.cli\n"
        "code = workbench.cli._run(['--help'])\n"
        "heavy = ('numpy', 'numba', 'mujoco', 'scipy', 'pandas', 'matplotlib')\n"
        "print('LOADED', [name for name in heavy if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.splitlines()[-1] == "LOADED []"


# --- the benchmarks ---------------------------------------------------------------------------------------------------


def benchmark(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"benchmark_{name}", BENCHMARKS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.skipif(shutil.which("gcc") is None and shutil.which("cc") is None, reason="no C compiler")
def test_the_floor_computes_what_the_kernels_compute(tmp_path: Path) -> None:
    compiled = benchmark("floor").build(tmp_path)
    assert compiled is not None
    for robot in PLACES:
        mechanism = mechanism_of(robot)
        constants = KERNELS[robot].pack(mechanism.parameters)
        arrays = [*state(mechanism, SAMPLES), np.random.default_rng(5).normal(size=(SAMPLES, 3))]
        want = mechanism.inverse_dynamics(*arrays[:3], external_force=arrays[3])
        for vector in (False, True):
            tau = np.zeros((SAMPLES, 3))
            compiled.call(robot, vector, constants, *arrays, tau)()
            assert np.abs(tau - want).max() < 1e-12 * np.abs(want).max()


def test_ratios_are_medians_over_rounds() -> None:
    rounds = benchmark("timing").Rounds({"one": [1.0, 2.0, 30.0], "other": [2.0, 4.0, 10.0]})
    assert rounds.ratio("one", "other") == 0.5
    assert rounds.median_s("one") == 2.0


def test_two_results_are_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch) -> None:  # type: ignore[no-untyped-def]
    def result(name: str, value: float) -> str:
        machine = {"cpu": "x", "cores": 2, "python": "3", "packages": {}}
        row = {"robot": "r", "what": "a : b", "value": value}
        path = tmp_path / name
        path.write_text(json.dumps({"format": 1, "machine": machine, "ratios": [row], "times": []}))
        return str(path)

    compare = benchmark("compare")
    monkeypatch.setattr(sys, "argv", ["compare", result("a", 2.0), result("b", 3.0)])
    assert compare.main() == 0
    assert "1.500 *" in capsys.readouterr().out
    (tmp_path / "c").write_text("{}")
    with pytest.raises(SystemExit, match="no benchmark result"):
        compare.load(str(tmp_path / "c"))


@both_robots
@pytest.mark.parametrize("joint", range(3))
def test_one_torque_that_is_not_finite_is_enough_to_refuse_a_sample(robot: str, joint: int) -> None:
    mechanism = mechanism_of(robot).closed_form
    q, qd, qdd = state(mechanism_of(robot), 3)
    tau = np.ones((3, 3))
    mechanism._refuse_torques(q, qd, qdd, tau)
    tau[1, joint] = np.inf
    with pytest.raises(MotionError, match=r"^sample 1, .*overflow"):
        mechanism._refuse_torques(q, qd, qdd, tau)
