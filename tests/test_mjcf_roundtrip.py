"""Parameters go into the MJCF and come back: the same numbers on both ways, and no other byte of the file touched."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import workbench as wb
from robots import MODEL, random_changes, table_1
from workbench.errors import ModelError, ParameterError
from workbench.robots.load import load_model, load_text

TEXT = MODEL.read_text(encoding="utf-8")
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def values(parameters: Any) -> dict[str, float]:
    return dataclasses.asdict(parameters)


def edited(**changes: float) -> str:
    return load_model(MODEL, changes).text


def changed_lines(one: str, two: str) -> list[tuple[str, str]]:
    pairs = zip(one.splitlines(), two.splitlines(), strict=True)
    return [(before, after) for before, after in pairs if before != after]


# --- numbers ----------------------------------------------------------------------------------------------------------

BASE = table_1()
CHANGES: list[dict[str, float]] = [
    {},
    {"payload": 0.5},
    {"a2": 0.31},
    {"a2_left": 0.31, "a2_right": 0.29},
    {"m1": 0.35, "m2_right": 0.21},
    {"k1_left": 0.45, "k2": 0.55, "k5": 0.4},
    {"a1_left": 0.22, "k1_left": 0.45},
    {"I1": 0.001, "I2_left": 0.003, "I5": 0.002},
    {"a5": 0.3, "a6": 0.12, "a4": 0.09},
    {"L": 0.25, "l_left": 0.08, "g": 1.62},
    {"m3": 0.5, "m4": 0.2, "m5": 0.9, "m6": 0.15},
    {"g": 0.0},
]


def read_back(**changes: float) -> dict[str, float]:
    """What the edited text says, read as any file; what loading with changes gives has to be the same."""
    loaded = load_model(MODEL, changes)
    found = load_text(loaded.text, loaded.file).values
    assert found is not None
    assert loaded.values == found
    return dict(found)


@pytest.mark.parametrize("changes", CHANGES, ids=str)
def test_the_mechanism_and_the_file_give_the_same_robot_bit_for_bit(changes: dict[str, float]) -> None:
    through_file = read_back(**changes)
    assert through_file == values(BASE.with_parameters(**changes).parameters)
    for name, value in changes.items():
        for key in [name] if name in through_file else [f"{name}_left", f"{name}_right"]:
            assert through_file[key] == value or f"{name}_left" in changes


@given(st.integers(0, 2**32 - 1))
def test_random_robots_come_back_to_the_last_bit(seed: int) -> None:
    changes = random_changes(np.random.default_rng(seed))  # numbers of full length
    assert read_back(**changes) == values(BASE.with_parameters(**changes).parameters)


def test_a_robot_moved_by_one_bit_is_another_robot() -> None:
    moved = float(np.nextafter(0.3, 1.0))
    assert read_back(a2=moved)["a2_left"] == moved
    assert read_back(a2=moved) != values(BASE.parameters)


def test_an_edited_file_on_disk_is_the_edited_robot(tmp_path: Path) -> None:
    changes = {"a2_left": 0.31, "m5": 0.7, "payload": 1.25}
    path = tmp_path / "mine.xml"
    path.write_text(edited(**changes), encoding="utf-8")
    assert values(wb.load_mechanism(path).parameters) == values(BASE.with_parameters(**changes).parameters)
    assert load_model(path).text == edited(**changes)
    # and back: the original's numbers, bit for bit
    back = {name: value for name, value in values(BASE.parameters).items() if value != values_of(path)[name]}
    assert values(wb.load_mechanism(path, **back).parameters) == values(BASE.parameters)


def values_of(path: Path) -> dict[str, float]:
    return values(wb.load_mechanism(path).parameters)


def test_both_sides_see_the_same_change() -> None:
    q = np.array([[0.02, 0.7, 0.9], [-0.05, 0.9, 0.6]])
    for changes in ({"a2_left": 0.31}, {"payload": 1.0, "m5": 0.9}, {"a5": 0.3}, {"g": 1.62}):
        mech = wb.load_mechanism(MODEL, **changes)
        res = wb.MujocoReference(MODEL, **changes).inverse_dynamics(q, 3 * q, 20 * q)
        tau = mech.inverse_dynamics(q, 3 * q, 20 * q)
        assert np.abs(tau - res.tau).max() < 1e-12 * np.abs(res.tau).max()
        assert np.abs(BASE.inverse_dynamics(q, 3 * q, 20 * q) - res.tau).max() > 1e-4 * np.abs(res.tau).max()


# --- the text ---------------------------------------------------------------------------------------------------------


def test_no_change_touches_no_byte() -> None:
    assert edited() == TEXT
    assert edited(a2=0.3, payload=0.0, m1_left=0.2) == TEXT


def test_one_mass_changes_one_number() -> None:
    ((before, after),) = changed_lines(TEXT, edited(m3=0.5))
    assert after == before.replace('mass="0.45"', 'mass="0.5"')
    assert "m3 = 0.45 kg, Table 1" in after  # comments are the user's


@pytest.mark.parametrize("changes", [c for c in CHANGES if c], ids=str)
def test_comments_and_layout_stay(changes: dict[str, float]) -> None:
    text = edited(**changes)
    assert re.findall(r"<!--.*?-->", text, re.DOTALL) == re.findall(r"<!--.*?-->", TEXT, re.DOTALL)
    assert NUMBER.sub("0", text) == NUMBER.sub("0", TEXT)
    assert 0 < len(changed_lines(TEXT, text)) < 40


def test_a_length_changes_only_lines_of_its_bar() -> None:
    pairs = changed_lines(TEXT, edited(a2_left=0.31))
    assert len(pairs) == 3
    assert sorted(re.search(r"<(\w+)", after).group(1) for _, after in pairs) == ["geom", "inertial", "site"]  # type: ignore[union-attr]
    for name, attribute in (("rod_left_bar", 'fromto="0 0 0 0 0 0.31"'), ("rod_left_tip", 'pos="0 0 0.31"')):
        assert any(f'name="{name}"' in after and attribute in after for _, after in pairs)


def test_a_file_of_other_layout_is_edited_in_place(tmp_path: Path) -> None:
    """Single quotes, attributes over two lines, tabs, CRLF and a comment that looks like an element."""
    text = TEXT.replace('mass="0.45" diaginertia', "mass='0.450'\n\t   diaginertia")
    text = text.replace(
        "<worldbody>", '<worldbody><!-- <inertial mass="0.45"/> <site name="platform_E" pos="9 9 9"/> -->'
    )
    text = text.replace("\n", "\r\n")
    path = tmp_path / "odd.xml"
    path.write_bytes(text.encode())
    result = load_model(path, {"m3": 0.5}).text
    assert result == text.replace("'0.450'", "'0.5'")
    assert wb.load_mechanism(path, m3=0.5).parameters.m3 == 0.5


def test_a_model_without_geoms_can_be_edited(tmp_path: Path) -> None:
    path = tmp_path / "bare.xml"
    path.write_text(re.sub(r"^\s*<geom name=.*/>\n", "", TEXT, flags=re.MULTILINE), encoding="utf-8")
    assert "rod_left_bar" not in path.read_text(encoding="utf-8")
    assert values(wb.load_mechanism(path, a2=0.31).parameters) == values(BASE.with_parameters(a2=0.31).parameters)


def test_an_edited_model_still_compiles_and_closes() -> None:
    model = mujoco.MjModel.from_xml_string(edited(**random_changes(np.random.default_rng(0))))
    assert model.nv == 13
    assert wb.MujocoReference(MODEL, **random_changes(np.random.default_rng(0))).mobility().mobility == 3


# --- uniform bars -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("load", ["mechanism", "file"])
@pytest.mark.parametrize(("mass", "length", "bar"), [("m1", "a1", "1"), ("m2", "a2", "2")])
def test_a_bar_stays_uniform_unless_its_inertia_is_given(load: str, mass: str, length: str, bar: str) -> None:
    off = {f"k{bar}_left": 0.4, f"I{bar}_left": 0.004}

    def changed(**changes: float) -> dict[str, float]:
        if load == "file":
            return values(wb.load_mechanism(MODEL, **changes).parameters)
        return values(BASE.with_parameters(**changes).parameters)

    before = values(BASE.parameters)
    for name, value in ((mass, 0.5), (length, 0.27)):
        found = changed(**{f"{name}_left": value})
        uniform = found[f"{mass}_left"] * found[f"{length}_left"] ** 2 / 12
        assert found[f"I{bar}_left"] == uniform != before[f"I{bar}_left"]
        assert found[f"k{bar}_left"] == 0.5
        assert found[f"I{bar}_right"] == before[f"I{bar}_right"]
        given_inertia = changed(**{f"{name}_left": value}, **off)
        assert given_inertia[f"I{bar}_left"] == 0.004
        assert given_inertia[f"k{bar}_left"] == 0.4
        given_centre = changed(**{f"{name}_left": value, f"k{bar}_left": 0.4})
        assert given_centre[f"k{bar}_left"] == 0.4
        assert given_centre[f"I{bar}_left"] == uniform
    alone = changed(**{f"k{bar}_left": 0.4})
    assert alone[f"I{bar}_left"] == before[f"I{bar}_left"]


def test_a_bar_that_is_not_uniform_stays_so_while_its_mass_and_length_stay() -> None:
    odd = BASE.with_parameters(k5=0.4, I5=0.009)
    for changes in ({"m3": 1.0}, {"m5": 0.5}, {"a6": 0.2}):
        assert (odd.with_parameters(**changes).parameters.k5, odd.with_parameters(**changes).parameters.I5) == (
            0.4,
            0.009,
        )
    moved = odd.with_parameters(m5=0.6).parameters
    assert (moved.k5, moved.I5) == (0.5, 0.6 * 0.25**2 / 12)
    kept = odd.with_parameters(m5=0.6, I5=0.009).parameters
    assert (kept.k5, kept.I5) == (0.4, 0.009)


# --- refusals ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("call", [BASE.with_parameters, lambda **c: wb.load_mechanism(MODEL, **c)])
@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"a22": 0.3}, 'unknown parameter "a22"; did you mean "a2"'),
        ({"a2": -0.3}, "parameter a2_left = -0.3 m; allowed: > 0"),
        ({"a2": 0.0}, "allowed: > 0"),
        ({"m1_right": -1.0}, "parameter m1_right = -1 kg"),
        ({"payload": float("nan")}, "parameter payload = nan kg"),
        ({"k1": 1.5}, "allowed: >= 0 and <= 1"),
        ({"a2": "0.3"}, "is not a number"),
        ({"a2": True}, "is not a number"),
    ],
)
def test_values_that_are_not_allowed(call: Any, changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(words)) as caught:
        call(**changes)
    assert "\n" not in str(caught.value)


SPOILS = [
    ('<site name="rod_left_tip" pos="0 0 0.3"/>', '<site name="rod_left_tip" pos="0 0.001 0.3"/>', "rod_left_tip"),
    ('<inertial pos="0 -0.1 0" mass="0.2"', '<inertial pos="0.002 -0.1 0" mass="0.2"', "arm_left"),
    ('name="spherical_D" type="ball"', 'name="spherical_D" type="ball" pos="0 0 0.01"', "spherical_D"),
    (
        '<site name="parallelogram_bar_2_tip" pos="0 0 0.25"/>',
        '<site name="parallelogram_bar_2_tip" pos="0 0 0.26"/>',
        "bar_2_tip",
    ),
    ('<site name="platform_F" pos="0 0.1 0"/>', '<site name="platform_X" pos="0 0.1 0"/>', "platform_F"),
]


@pytest.mark.parametrize(("old", "new", "named"), SPOILS)
def test_a_file_that_is_another_robot_is_refused(tmp_path: Path, old: str, new: str, named: str) -> None:
    assert old in TEXT
    path = tmp_path / "other.xml"
    path.write_text(TEXT.replace(old, new), encoding="utf-8")
    with pytest.raises(ModelError, match=re.escape(named)) as caught:
        wb.load_mechanism(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
