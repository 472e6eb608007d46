"""The mutation runner itself: what it plants is what its list of operators says, and its named faults still fit."""

from __future__ import annotations

import ast
import math
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from mutants import __main__ as command
from mutants import modules, short, trial
from mutants.named import EQUIVALENT, NAMED
from mutants.operators import OPERATORS, compiles, mutants_of
from mutants.tree import source_of

EXAMPLE = '''"""1 + 1 in a docstring is left alone."""

LIMIT: float = 0.5


def worst(a, b, out, *, keep=True):
    if a[0] < -b[1:] and keep:
        out[2] = min(a, b) * LIMIT
        raise ValueError(f"{a + b} is not computed")
    out.sort()
    return max(b, a)
'''

PLANTED = {
    "comparison": "if a[0] >= -b[1:] and keep:",
    "arithmetic": "out[2] = min(a, b) / LIMIT",
    "logic": "if a[0] < -b[1:] or keep:",
    "condition": "if (not (a[0] < -b[1:] and keep)):",
    "constant": "LIMIT: float = 100 * 0.5",
    "index": "if a[0] < -b[2:] and keep:",
    "sign": "if a[0] < (b[1:]) and keep:",
    "swapped": "out[2] = max(a, b) * LIMIT",
    "statement": "        pass",
    "return": "return None",
}


def test_every_operator_plants_what_it_says() -> None:
    found = mutants_of(EXAMPLE)
    for operator, line in PLANTED.items():
        lines = [
            part.strip() for one in found if one.operator == operator for part in one.planted(EXAMPLE).splitlines()
        ]
        assert line.strip() in lines, operator
    swapped = mutants_of("f(one, two + 1, three)")
    assert "f(two + 1, one, three)" in [one.planted("f(one, two + 1, three)") for one in swapped]
    assert {one.operator for one in [*found, *swapped]} == set(OPERATORS)


def test_each_fault_is_one_and_texts_are_left_alone() -> None:
    for one in mutants_of(EXAMPLE):
        planted = one.planted(EXAMPLE)
        assert planted != EXAMPLE
        assert compiles(planted)
        assert planted.count("1 + 1 in a docstring") == 1
        assert ("{a + b} is not computed" in planted) or one.operator == "statement"
        assert EXAMPLE[one.start : one.stop] == one.before


def test_characters_beyond_ascii_shift_nothing() -> None:
    text = 'unit = "µ" if a < b else "Ω"\n'
    assert 'unit = "µ" if a >= b else "Ω"\n' in [one.planted(text) for one in mutants_of(text)]


@pytest.mark.parametrize("name", NAMED)
def test_a_named_fault_still_fits_its_module(name: str) -> None:
    text = source_of(NAMED[name].module)
    mutant = NAMED[name].mutant(text)
    ast.parse(mutant.planted(text))


def test_what_counts_as_equivalent_is_a_named_fault_with_a_reason() -> None:
    assert set(EQUIVALENT) <= set(NAMED)
    assert all(len(reason) > 40 for reason in EQUIVALENT.values())


def test_groups_hold_files_and_core_tests_exist(repository: Path) -> None:
    for group in modules.GROUPS:
        assert modules.files_of(group), group
    missing = [name for name in modules.CORE_TESTS if not (repository / modules.test_file(name)).exists()]
    assert not missing


def test_a_short_run_begins_with_what_is_quick_and_leaves_out_what_fails_by_itself(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    without_fault = {
        "a.py": (
            {"a.py::slow": 2.0, "a.py::slowest": 9.0, "a.py::quick": 0.2, "a.py::quicker": 0.1, "a.py::broken": 0.0},
            ["a.py::broken"],
        ),
        "b.py": ({"b.py::quick": 0.05, "b.py::slow": 1.0}, []),
    }
    monkeypatch.setattr(short, "_without_fault", lambda file, uncompiled: without_fault[file])
    tests, total, failing = short.tests_of(("a.py", "b.py"), uncompiled=False, longest=short.LONGEST)
    assert tests == ["a.py::quicker", "a.py::quick", "b.py::quick", "a.py::slow", "b.py::slow"]
    assert total == pytest.approx(3.35)
    assert failing == ["a.py::broken"]


def test_a_fault_that_no_test_could_notice_is_not_tried_and_not_counted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("a fault was planted that nothing could notice")

    monkeypatch.setattr(short, "_without_fault", lambda file, uncompiled: ({f"{file}::test": 1.0}, [f"{file}::test"]))
    monkeypatch.setattr(trial, "trial", never)
    module = "metrics.py"
    planted = [command.Planted("metrics", module, one) for one in mutants_of(source_of(module))[:3]]
    outcome, tried = command._try(planted[0], 60.0, ["tests/test_metrics.py"], [])
    assert (outcome.status, tried) == (trial.BROKEN, 0)
    assert "tests/test_metrics.py::test" in outcome.by
    states = [trial.BROKEN, trial.KILLED, trial.KILLED]
    known: dict[str, dict[str, object]] = {
        one.key: {"status": status} for one, status in zip(planted, states, strict=True)
    }
    assert command._summary(planted, known) == 2  # not 0: nobody knows
    said = capsys.readouterr().out
    assert "metrics: 2 of 2 noticed (100%; of all faults 34% to 100%), 1 not tried" in said
    assert f"not tried: metrics  {module}:{planted[0].mutant.line}" in said
    known[planted[0].key]["status"] = trial.SURVIVED
    assert command._summary(planted, known) == 1


def test_what_survives_a_short_run_has_to_survive_longer_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    durations = {"short.py": {"short.py::quick": 0.1, "short.py::long": 9.0}, "longer.py": {"longer.py::long": 20.0}}
    monkeypatch.setattr(short, "_without_fault", lambda file, uncompiled: (durations[file], []))
    asked: list[tuple[list[str], bool]] = []
    outcomes = {1: trial.Outcome(trial.SURVIVED, "", 1.0), 2: trial.Outcome(trial.KILLED, "longer.py::long", 2.0)}

    def tried(tests: list[str], *_: object, interpreted: bool = False, **__: object) -> trial.Outcome:
        asked.append((tests, interpreted))
        return outcomes[len(asked)]

    monkeypatch.setattr(trial, "trial", tried)
    monkeypatch.setattr(command.tree, "planted", lambda *_: nullcontext())
    monkeypatch.setattr(command.tree, "own_cache", lambda: nullcontext(Path("own")))
    module = "reference/rows.py"
    fault = command.Planted("reference", module, mutants_of(source_of(module))[0])
    outcome, count = command._try(fault, 60.0, ["short.py"], ["longer.py", "short.py"])
    assert asked == [
        (["short.py::quick"], True),
        (["short.py::quick", "longer.py::long", "short.py::long"], False),  # compiled, and whatever it takes
    ]
    assert (outcome.status, outcome.by, outcome.seconds, count) == (trial.KILLED, "longer.py::long", 3.0, 4)
    assert "tests/test_compiled_closure.py" in modules.longer_tests("reference/kinematics.py")
    assert not modules.longer_tests("metrics.py")


def test_the_references_kernels_divide_by_zero_uncompiled_as_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    from types import FunctionType

    from numba.experimental import structref

    from workbench import compiled

    public = {
        name for name, one in vars(compiled).items() if isinstance(one, FunctionType) and not name.startswith("_")
    }
    assert {name for name in public if vars(compiled)[name].__module__ == compiled.__name__} == set(trial.DECORATORS)
    for name in trial.DECORATORS:
        monkeypatch.setattr(compiled, name, getattr(compiled, name))
    for name in ("StructRefProxy", "register", "define_proxy"):
        monkeypatch.setattr(structref, name, getattr(structref, name))
    monkeypatch.setattr("numpy.seterr", lambda **_: None)
    trial.interpret()
    scope = {"math": math, "__name__": "workbench.reference.of_a_test"}
    exec("def kernel(x):\n    return 1.0 / math.sqrt(x)", scope)
    kernel = scope["kernel"]
    assert isinstance(kernel, FunctionType)
    with np.errstate(all="ignore"):
        assert compiled.compiled(kernel) is kernel
        assert kernel(0.0) == math.inf
        assert kernel(4.0) == 0.5
