"""The mutation runner itself: what it plants is what its list of operators says, and its named faults still fit."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from mutants import modules
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
