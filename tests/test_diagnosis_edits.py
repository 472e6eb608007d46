"""Small edits of a source: each kind of mistake can be undone by one, and nothing but its place changes."""

from __future__ import annotations

import ast

import pytest

from workbench.diagnosis.edits import Edit, alike, edits_of

GROUPS = {"m1": ["m2"], "m2": ["m1"], "a": ["b"], "b": ["a"]}

BODY = """import numpy as np


def f(p, q2, q3):
    s2, s3 = np.sin(q2), np.sin(q3)
    return {0}
"""

PLANTED = {
    "sign": ("p.m1 * s2 - p.m2 * s3", "p.m1 * s2 + p.m2 * s3"),
    "factor twice": ("p.m1 / 2 * s2", "p.m1 / 4 * s2"),
    "factor in front": ("2 * p.m1 * s2", "p.m1 * s2"),
    "sine": ("p.m1 * np.cos(q2)", "p.m1 * np.sin(q2)"),
    "index": ("q2[:, 1] * s2", "q2[:, 0] * s2"),
    "name": ("p.m1 * s2", "p.m1 * s3"),
    "parameter": ("p.m1 * s2", "p.m2 * s2"),
    "exponent": ("p.a**2 * s2", "p.a**3 * s2"),
    "exponent gone": ("p.a * s2", "p.a**2 * s2"),
    "square gone": ("p.a**2 * s2", "p.a * s2"),
    "quotient": ("p.m1 * s2 / p.a", "p.m1 * s2 * p.a"),
    "term too many": ("p.m1 * s2", "p.m1 * s2 + s3"),
    "minus in front": ("-p.m1 * s2 + s3", "p.m1 * s2 + s3"),
    "minus too many": ("p.m1 * s2 + s3", "-p.m1 * s2 + s3"),
    "order of a cross product": ("np.cross(q2, q3)", "np.cross(q3, q2)"),
}


def same(one: str, other: str) -> bool:
    return ast.dump(ast.parse(one)) == ast.dump(ast.parse(other))


@pytest.mark.parametrize(("right", "wrong"), PLANTED.values(), ids=PLANTED)
def test_each_mistake_is_undone_by_an_edit(right: str, wrong: str) -> None:
    text, wanted = BODY.format(wrong), BODY.format(right)
    made = [edit.apply(text) for edit in edits_of(text, None, GROUPS)]
    assert any(same(one, wanted) for one in made)


def test_every_edit_is_python_and_changes_something() -> None:
    text = BODY.format("(p.m1 + p.m2) * (s2**2 - 3 * s3) / p.a - np.cross(q2, -q3)[:, 0]  # a + b")
    edits = edits_of(text, None, GROUPS)
    assert len(edits) > 60
    for edit in edits:
        made = edit.apply(text)
        assert not same(made, text), edit
        assert made.endswith("# a + b\n"), "comments and formatting stay"


def test_only_lines_that_ran_are_edited() -> None:
    text = BODY.format("p.m1 * s2")
    assert {edit.line for edit in edits_of(text, [6], GROUPS)} == {6}
    assert {edit.line for edit in edits_of(text, None, GROUPS)} == {5, 6}


def test_places_in_texts_with_other_letters() -> None:
    text = BODY.format("p.m1 * s2 + p.m2").replace("return", 'é = "ü" ; return')
    made = [edit.apply(text) for edit in edits_of(text, None, GROUPS)]
    assert any("p.m1 * s2 - p.m2" in one for one in made)


def test_a_missing_parameter_brings_terms_like_those_there_are() -> None:
    text = BODY.format("p.m1 * s2 + p.a")
    made = [edit.apply(text) for edit in edits_of(text, None, GROUPS, missing=frozenset({"m2"}))]
    assert any("p.m1 * s2 + p.a + p.m2 * s3" in one for one in made)
    assert not any("p.m2 * s3" in edit.apply(text) for edit in edits_of(text, None, GROUPS))


def test_an_edit_knows_its_place_whatever_happens_above() -> None:
    text = BODY.format("p.m1 * s2")
    edit = Edit(text.index("p.m1"), text.index("p.m1") + 4, "p.m2", 0, 6)
    moved = text.replace("np.sin(q2)", "-np.sin(q2)")
    later = Edit(moved.index("p.m1"), moved.index("p.m1") + 4, "p.m2", 0, 6)
    assert edit.place(text) == later.place(moved)


@pytest.mark.parametrize(("one", "other"), [("q2", "q3"), ("xd", "xdd"), ("m_left", "m_right"), ("sin_u", "cos_u")])
def test_names_that_are_alike(one: str, other: str) -> None:
    assert alike(one, other)
    assert alike(other, one)


@pytest.mark.parametrize(("one", "other"), [("q2", "tau"), ("mass", "inertia"), ("x", "x")])
def test_names_that_are_not(one: str, other: str) -> None:
    assert not alike(one, other)
