"""Edited formulas that are replayed give what they give as files; effects that add up are found."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from workbench.diagnosis.combine import groups_alike, sums
from workbench.diagnosis.edits import Edit, edits_of
from workbench.diagnosis.inserts import inserts_of
from workbench.diagnosis.nodes import shifted
from workbench.diagnosis.replay import OutsideError, Tape, same
from workbench.diagnosis.steps import functions_of

CUNNING = """import numpy as np

SCALE = 2.0


def weigh(p, q):
    heavy = np.array(q * p)
    heavy[:, 0] += 1.0
    return heavy.sum(axis=1)


def twice(p, q):
    first = weigh(p, q)
    second = weigh(p, 2 * q)
    kept = np.array(first)
    kept += 1.0
    return first * second * kept


def formula(p, q, qd):
    total = np.zeros(len(q))
    for k in range(3):
        total = total + k * q[:, k]
    rows = [total]
    rows.append(weigh(p, qd))
    out = np.array(total)
    out -= twice(p, q)
    if p > 1:
        more = (lambda x: x + p)(qd[:, 0])
    else:
        more = qd[:, 1]
    a = sum(row * p for row in rows); b = more * a
    return np.stack([out, a, b, more + SCALE], axis=1)
"""


def module_of(text: str) -> dict[str, Any]:
    module = ModuleType("replayed")
    exec(compile(text, "replayed.py", "exec"), module.__dict__)
    return vars(module)


def answer(call: Callable[[], Any]) -> Any:
    with np.errstate(all="ignore"):
        try:
            return np.asarray(call())
        except OutsideError:
            raise
        except Exception as error:
            return type(error)


def test_a_replayed_edit_gives_what_the_edited_file_gives() -> None:
    rng = np.random.default_rng(1)
    q, qd, p = rng.uniform(0.5, 1.5, (5, 3)), rng.uniform(0.5, 1.5, (5, 3)), 1.7
    space = module_of(CUNNING)
    tape = Tape(CUNNING, "replayed.py", space, space["formula"])
    assert np.array_equal(tape.record(p, q, qd), module_of(CUNNING)["formula"](p, q, qd))
    outside, compared = 0, 0
    for edit in edits_of(CUNNING, None, {}):
        wanted = answer(lambda edit=edit: module_of(edit.apply(CUNNING))["formula"](p, q.copy(), qd.copy()))
        try:
            found = answer(lambda edit=edit: tape.replay(edit, p, q, qd))
        except OutsideError:
            outside += 1
            continue
        compared += 1
        if isinstance(wanted, type) or isinstance(found, type):
            assert found is wanted, edit
        else:
            assert np.array_equal(found, wanted, equal_nan=True), edit
    assert compared > 100
    assert 0 < outside < 10, "the constant at the top of the file"
    # nothing of it is left behind
    assert np.array_equal(space["formula"](p, q.copy(), qd.copy()), module_of(CUNNING)["formula"](p, q, qd))


def test_a_replay_that_forgot_what_is_changed_in_place_would_be_seen() -> None:
    """The twin of the test above: with the statements' marks of what they change taken away, it differs."""
    q, qd, p = np.ones((2, 3)), np.full((2, 3), 0.5), 1.7
    space = module_of(CUNNING)
    tape = Tape(CUNNING, "replayed.py", space, space["formula"])
    for function in tape._functions.values():
        for step in function.program.steps if function.program else ():
            object.__setattr__(step, "mutates", frozenset())
    tape.record(p, q, qd)
    wrong = 0
    for edit in edits_of(CUNNING, None, {}):
        wanted = answer(lambda edit=edit: module_of(edit.apply(CUNNING))["formula"](p, q.copy(), qd.copy()))
        try:
            found = answer(lambda edit=edit: tape.replay(edit, p, q, qd))
        except OutsideError:
            continue
        wrong += not (found is wanted or np.array_equal(found, wanted, equal_nan=True))
    assert wrong > 10


@pytest.mark.parametrize("example", ["delta", "rrr", "orthoglide"])
def test_examples_are_replayed_as_they_are(repository: Path, example: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (repository / "examples" / example / f"{example}.py").read_text(encoding="utf-8")
    functions = functions_of(text, "example.py")
    taken = [name for name, function in functions.items() if function.program is not None]
    assert taken, "none could be taken apart"
    for name in taken:
        steps = functions[name].program.steps  # type: ignore[union-attr]
        assert steps[-1].writes == {"__returned__"}
        assert [step.line for step in steps] == sorted(step.line for step in steps)
    assert example not in sys.modules


def test_values_that_are_the_same() -> None:
    array = np.arange(3.0)
    assert same((array, [1.0]), (array.copy(), [1.0]))
    assert not same(array, array + 1e-16 + 1.0)
    assert not same(array, array[:, None])
    assert not same(1, 1.0)
    assert not same(np.array([np.nan]), np.array([np.nan])), "rather run again"
    assert not same(object(), object())


def test_pairs_and_triples_that_add_up_are_found() -> None:
    rng = np.random.default_rng(3)
    effects = rng.normal(size=(300, 60))
    assert sums(effects, effects[17] + effects[200], triples=False) == [(17, 200)]
    assert sums(effects, effects[5] + effects[90] + effects[250], triples=True) == [(5, 90, 250)]
    assert sums(effects, effects[5] + effects[90] + effects[250], triples=False) == []
    assert sums(effects, effects[5] + 1.0001 * effects[90], triples=True) == []
    assert sums(effects, np.zeros(60), triples=True) == []


def test_effects_that_are_alike_stand_together() -> None:
    rng = np.random.default_rng(4)
    effects = rng.normal(size=(6, 20))
    effects[4] = effects[1] * (1 + 1e-12)
    effects[5] = 0.0
    assert sorted(sorted(group) for group in groups_alike(effects)) == [[0], [1, 4], [2], [3]]


def test_an_edit_moves_with_another_before_it() -> None:
    text = "a + b * c"
    first, second = Edit(0, 1, "long", 0, 1), Edit(8, 9, "d", 0, 1)
    moved = shifted(second, first)
    assert moved is not None
    assert moved.apply(first.apply(text)) == "long + b * d"
    assert shifted(first, second) == first
    assert shifted(Edit(4, 9, "x", 0, 1), second) is None


BODY = """def f(p, a, b, c, d):
    one = a * c + b * d
    two = a * d{0}
    return one * two
"""


@pytest.mark.parametrize(
    ("right", "wrong"),
    [(" + b * c", ""), (" - b * c", ""), (" * p.l**2", ""), (" / p.m", "")],
    ids=["term", "negative term", "factor", "divisor"],
)
def test_what_a_statement_lacks_is_put_in_from_what_stands_near(right: str, wrong: str) -> None:
    text = BODY.format(wrong).replace("return one * two", "return one * two * p.m * p.l**2")
    wanted = BODY.format(right).split("\n")[2].strip().removeprefix("two = ")
    values = {
        "a": 2.0,
        "b": 3.0,
        "c": 5.0,
        "d": 7.0,
        "one": 17.0,
        "two": 19.0,
        "p": type("P", (), {"l": 11.0, "m": 13.0}),
    }
    made = [edit.apply(text).split("\n")[2].strip().removeprefix("two = ") for edit in inserts_of(text, 3)]
    assert any(np.isclose(eval(one, {}, values), eval(wanted, {}, values), rtol=1e-12) for one in made)
