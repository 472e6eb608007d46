"""Parameters into an MJCF file and back, bit by bit, with every other byte left alone."""

from __future__ import annotations

import dataclasses
import math
import os
import re
import stat
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robots import peak_error
from workbench import MujocoReference, load_mechanism
from workbench.errors import ModelError, OutputError, ParameterError, WorkbenchError
from workbench.mjcf.text import Edit, find, numbers_replaced, replace_numbers, scan, tokens
from workbench.robots.assignments import parse_assignment, resolve_changes
from workbench.robots.edit import _tells, edit_file, resolve_for
from workbench.robots.load import LoadedModel, load_model
from workbench.robots.show import show_parameters
from workbench.robots.values import precise, quotient

MODELS = Path(__file__).resolve().parents[1] / "models"
ASYM, PLANAR = MODELS / "asym_2rss_ppap.xml", MODELS / "planar_4rprp.xml"
BOTH = pytest.mark.parametrize("model", [ASYM, PLANAR], ids=lambda path: path.stem)
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
VERIFIED = 1e-10
CLOSED = 1e-12


@lru_cache
def bundled(path: Path) -> LoadedModel:
    return load_model(path)


def random_values(draw: st.DrawFn, path: Path) -> dict[str, float]:
    """New values with all their digits for some parameters, all of them possible robots."""
    loaded = bundled(path)
    assert loaded.description is not None
    assert loaded.values is not None
    infos = loaded.description.table.infos
    chosen = draw(st.lists(st.sampled_from(sorted(infos)), min_size=1, max_size=8, unique=True))
    values = {}
    for name in chosen:
        unit, old = infos[name].unit, loaded.values[name]
        low, high = (0.25, 0.75) if unit == "1" else (0.85 * old, 1.15 * old) if unit == "m" else (0.6 * old, 1.9 * old)
        low, high = (0.0, 2.0) if name == "payload" else (low, high)
        values[name] = draw(st.floats(low, high, allow_nan=False))
    return values


def assert_bit_equal(path: Path, wanted: dict[str, float]) -> None:
    found = load_model(path).values
    assert found is not None
    for name, value in wanted.items():
        assert found[name] == value, f"{name}: asked {value!r}, read {found[name]!r}"


def assert_only_numbers_moved(before: str, after: str, lines: tuple[int, ...]) -> None:
    """Comments and layout stay, and every line that differs holds a changed attribute and nothing else new."""
    assert COMMENT.findall(before) == COMMENT.findall(after)
    old, new = before.split("\n"), after.split("\n")
    assert len(old) == len(new)
    assert tuple(i for i, pair in enumerate(zip(old, new, strict=True), start=1) if pair[0] != pair[1]) == lines
    number = re.compile(r'(?<=["\s])[-+.\deE]+(?=["\s])')
    for line in lines:
        assert number.sub("#", old[line - 1]) == number.sub("#", new[line - 1])


@BOTH
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_values_read_back_bit_equal_and_nothing_else_moves(model: Path, data: st.DataObject, tmp_path: Path) -> None:
    values = random_values(data.draw, model)
    out = tmp_path / "edited.xml"
    result = edit_file(model, [f"{name}={value!r}" for name, value in values.items()], out=out)
    assert_bit_equal(out, values)
    assert_only_numbers_moved(model.read_bytes().decode(), out.read_bytes().decode(), result.lines)
    assert load_mechanism(model, **values).parameters == load_mechanism(out).parameters


@BOTH
@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_closed_form_and_reference_agree_on_the_edited_file(model: Path, data: st.DataObject, tmp_path: Path) -> None:
    values = random_values(data.draw, model)
    out = tmp_path / "edited.xml"
    edit_file(model, [f"{name}={value!r}" for name, value in values.items()], out=out)
    assert max(disagreement(out, out).values()) <= VERIFIED


def disagreement(candidate: Path, reference: Path) -> dict[str, float]:
    """Peak error of the closed form of one file against the reference of another, for both mass models."""
    mech, ref = load_mechanism(candidate), MujocoReference(reference)
    home = load_model(reference).model.key_qpos[0]
    random = np.random.default_rng(5)
    q0 = ref._closer.home[ref._structure.actuated_qpos]
    assert len(home)
    q = q0 + 0.05 * random.uniform(-1, 1, (6, 3)) * [0.5, 1, 1]
    qd, qdd = random.normal(size=(6, 3)), 5 * random.normal(size=(6, 3))
    errors = {}
    for mass_model in ("distributed", "lumped"):
        result = ref.inverse_dynamics(q, qd, qdd, mass_model)
        assert result.closure_residual.max() <= CLOSED
        errors[mass_model] = peak_error(mech.inverse_dynamics(q, qd, qdd, mass_model), result.tau)
    return errors


@BOTH
def test_the_comparison_of_edited_files_can_fail(model: Path, tmp_path: Path) -> None:
    """Twin: against the file before the edit, the errors are far above the bound."""
    out = tmp_path / "edited.xml"
    change = "m2_left*=1.001" if model == ASYM else "m2*=1.001"
    edit_file(model, [change], out=out)
    assert min(disagreement(out, model).values()) > 1e4 * VERIFIED


def test_fractions_need_more_digits_than_a_double_and_get_them() -> None:
    """The stored number is the product k a; for about half of all k, another k has the same product."""
    loaded = bundled(ASYM)
    assert loaded.description is not None
    assert loaded.values is not None
    target = next(t for t in loaded.description.targets if t.reads == "k2_left")
    random = np.random.default_rng(2)
    ambiguous = 0
    for k, a in random.uniform(0.05, 0.95, (400, 2)):
        values = {**loaded.values, "k2_left": float(k), "a2_left": float(a)}
        ambiguous += bool(precise(target, values))
    assert 20 < ambiguous < 380
    k, a = 0.45, 0.3
    assert not precise(target, {**loaded.values, "k2_left": k, "a2_left": a})
    assert quotient(k * a, a) == k


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    k=st.floats(0.0, 1.0, allow_subnormal=False),
    a=st.floats(0.2, 0.45),
    name=st.sampled_from(["k1_left", "k2_right", "k5"]),
)
def test_any_fraction_of_any_length_reads_back(k: float, a: float, name: str, tmp_path: Path) -> None:
    length = "a5" if name == "k5" else name.replace("k", "a")
    out = tmp_path / "fraction.xml"
    if k * a < 1e-300:
        k = 0.0
    edit_file(ASYM, [f"{name}={k!r}", f"{length}={a!r}"], out=out)
    assert_bit_equal(out, {name: k, length: a})


@pytest.mark.parametrize(("newline", "mark"), [("\r\n", ""), ("\n", "\ufeff"), ("\r\n", "\ufeff")])
@BOTH
def test_line_endings_and_byte_order_mark_stay(model: Path, newline: str, mark: str, tmp_path: Path) -> None:
    source, out = tmp_path / "in.xml", tmp_path / "out.xml"
    text = mark + model.read_text().replace("\n", newline)
    source.write_bytes(text.encode())
    name = "L_left" if model == ASYM else "h"
    result = edit_file(source, [f"{name}=0.2125"], out=out)
    after = out.read_bytes().decode()
    assert after.count("\r\n") == text.count("\r\n")
    assert after.startswith(mark or "<")
    assert_only_numbers_moved(text, after, result.lines)
    assert_bit_equal(out, {name: 0.2125})


def test_comments_in_other_scripts_do_not_shift_the_edit(tmp_path: Path) -> None:
    source = tmp_path / "in.xml"
    text = ASYM.read_text().replace("<worldbody>", "<!-- Länge, длина, 長さ, 📏 --><worldbody>")
    source.write_text(text, encoding="utf-8")
    result = edit_file(source, ["a2_left=0.31"], in_place=True)
    assert_only_numbers_moved(text, source.read_text(encoding="utf-8"), result.lines)
    assert "长" not in source.read_text(encoding="utf-8")
    assert_bit_equal(source, {"a2_left": 0.31, "a2_right": 0.3})


def test_numbers_that_keep_their_value_keep_their_digits(tmp_path: Path) -> None:
    """Twenty zeros behind the comma are a user's layout; only the mass centre follows k, not the length."""
    source = tmp_path / "in.xml"
    source.write_text(ASYM.read_text().replace('pos="0 0 0.3"', 'pos="0.000 0 0.3000"'))
    edit_file(source, ["k2=0.4"], in_place=True)
    assert source.read_text().count('pos="0.000 0 0.3000"') == 2


@pytest.mark.parametrize(
    ("token", "after"),
    [("0.4500", "0.4500"), ("4.5e-1", "4.5e-1"), ("0.45000000000000001110223", "0.45"), ("0.46", "0.45")],
)
def test_a_number_that_is_there_keeps_its_spelling_unless_it_says_more_than_a_double(token: str, after: str) -> None:
    text = '<mujoco><worldbody><body name="b"><inertial pos="0 0 0" mass="{0}"/></body></worldbody></mujoco>'
    edits = [Edit("inertial", "b", "mass", 0, 0.45)]
    assert replace_numbers(text.format(token), "m.xml", edits) == text.format(after)


def test_spelling_of_tags_does_not_matter(tmp_path: Path) -> None:
    """Single quotes, attributes over several lines, a joint of the same name in another section."""
    source = tmp_path / "in.xml"
    text = ASYM.read_text()
    text = text.replace(
        '<site name="rod_left_tip" pos="0 0 0.3"/>', "<site\n  name = 'rod_left_tip'\n\tpos = '0\n0   0.3'\n/>"
    )
    source.write_text(text)
    edit_file(source, ["a2_left=0.3125"], in_place=True)
    assert "pos = '0\n0   0.3125'" in source.read_text()


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (["a2=0.31"], {"a2_left": 0.31, "a2_right": 0.31}),
        (["a2_left=0.31", "a2=0.29"], {"a2_left": 0.31, "a2_right": 0.29}),
        (["a2*=2"], {"a2_left": 0.6, "a2_right": 0.6}),
        (["m3+=0.05", "g/=2"], {"m3": 0.5, "g": 9.81 / 2}),
        (["m3-=0.2"], {"m3": 0.45 - 0.2}),
        ([" payload = 1e-1 "], {"payload": 0.1}),
        (["payload=-0"], {"payload": 0.0}),
    ],
)
def test_changes_as_users_write_them(changes: list[str], expected: dict[str, float]) -> None:
    loaded = bundled(ASYM)
    assert loaded.description is not None
    assert loaded.values is not None
    assert resolve_changes(loaded.description.table, loaded.values, changes) == expected
    assert resolve_for(ASYM, changes) == expected
    for name, value in resolve_for(ASYM, changes).items():
        assert math.copysign(1, value) == math.copysign(1, expected[name])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("a2", "no change of a parameter"),
        ("a2=", "no change of a parameter"),
        ("=3", "no change of a parameter"),
        ("a2==3", "not a finite number"),
        ("a2=3mm", "not a finite number"),
        ("a2=1_0", "not a finite number"),
        ("a2=nan", "not a finite number"),
        ("a2=inf", "not a finite number"),
        ("a2=1e999", "not a finite number"),
        ("a2=0x1", "not a finite number"),
        ("a2/=0", "divides by zero"),
        ("a2**=3", "no change of a parameter"),
        ("a3=0.3", "unknown parameter"),
        ("a2=-1", "allowed: > 0"),
        ("k2=1.5", "<= 1"),
        ("m3*=-1", "allowed: > 0"),
        ("a2*=1e300", "allowed"),
    ],
)
def test_wrong_changes_are_one_line(change: str, message: str, tmp_path: Path) -> None:
    out = tmp_path / "out.xml"
    with pytest.raises(WorkbenchError, match=re.escape(message)) as caught:
        edit_file(ASYM, [change], out=out)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_the_same_name_twice_is_refused() -> None:
    with pytest.raises(ParameterError, match="twice"):
        resolve_for(ASYM, ["a2=0.3", "a2*=1.1"])


def test_parse_assignment_names_its_parts() -> None:
    assert dataclasses.astuple(parse_assignment("a2_left*=1.1")) == ("a2_left", "*=", 1.1)


def test_where_a_file_cannot_be_written(tmp_path: Path) -> None:
    source = tmp_path / "m.xml"
    source.write_bytes(ASYM.read_bytes())
    link = tmp_path / "link.xml"
    link.symlink_to(source)
    os.mkfifo(tmp_path / "pipe")
    before = source.read_bytes()
    change = ["a2=0.31"]
    with pytest.raises(OutputError, match="neither"):
        edit_file(source, change)
    with pytest.raises(OutputError, match="both"):
        edit_file(source, change, out=tmp_path / "x.xml", in_place=True)
    with pytest.raises(OutputError, match="directory"):
        edit_file(source, change, out=tmp_path)
    with pytest.raises(OutputError, match="no directory"):
        edit_file(source, change, out=tmp_path / "none" / "x.xml")
    with pytest.raises(OutputError, match="symbolic link"):
        edit_file(link, change, in_place=True)
    with pytest.raises(OutputError, match="symbolic link"):
        edit_file(source, change, out=link)
    with pytest.raises(OutputError, match="no regular file"):
        edit_file(source, change, out=tmp_path / "pipe")
    with pytest.raises(OutputError, match="null"):
        edit_file(source, change, out=tmp_path / "a\0b")
    with pytest.raises(OutputError):
        edit_file(source, change, out=tmp_path / ("x" * 300))
    assert source.read_bytes() == before
    assert {p.name for p in tmp_path.iterdir()} == {"m.xml", "link.xml", "pipe"}


def test_a_bundled_model_is_not_changed_in_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OutputError, match="comes with the workbench"):
        edit_file("models/asym_2rss_ppap.xml", ["a2=0.31"], in_place=True)
    edit_file("models/asym_2rss_ppap.xml", ["a2=0.31"], out="mine.xml")
    assert_bit_equal(Path("mine.xml"), {"a2_left": 0.31})


def test_an_edit_keeps_the_files_permissions_and_leaves_no_other_file(tmp_path: Path) -> None:
    source = tmp_path / "m.xml"
    source.write_bytes(ASYM.read_bytes())
    source.chmod(0o640)
    edit_file(source, ["a2=0.31"], in_place=True)
    assert stat.S_IMODE(source.stat().st_mode) == 0o640
    assert [p.name for p in tmp_path.iterdir()] == ["m.xml"]


def test_a_model_that_changes_numbers_by_itself_is_not_edited_silently(tmp_path: Path) -> None:
    """MuJoCo scales every mass to a total: what is written is not what it compiles."""
    source = tmp_path / "m.xml"
    text = ASYM.read_text().replace('autolimits="true"', 'autolimits="true" settotalmass="20"')
    source.write_text(text)
    with pytest.raises(ModelError, match="reads back as"):
        edit_file(source, ["m3=0.5"], in_place=True)
    with pytest.raises(ModelError, match="reads back as"):
        load_model(source, {"m3": 0.5})
    assert source.read_text() == text


def test_no_change_changes_nothing(tmp_path: Path) -> None:
    out = tmp_path / "out.xml"
    result = edit_file(ASYM, ["a2*=1"], out=out)
    assert result.changes == ()
    assert result.lines == ()
    assert out.read_bytes() == ASYM.read_bytes()


@BOTH
def test_show_lists_every_parameter_where_it_stands(model: Path) -> None:
    rows = show_parameters(model)
    loaded = bundled(model)
    assert loaded.description is not None
    assert loaded.values is not None
    assert [row.name for row in rows] == list(loaded.description.table.infos)
    lines = loaded.text.split("\n")
    elements = scan(loaded.text, "m")
    for row in rows:
        assert row.value == loaded.values[row.name]
        assert row.unit
        assert row.meaning
        assert row.source
        assert row.line is not None
        tag, *name = row.element.replace(" of ", " ").split(" ")
        assert f"<{tag}" in lines[row.line - 1]
        element = find(elements, tag, name[0] if name else "")
        assert element is not None
        attribute, _, index = row.attribute.rstrip("]").partition("[")
        written = float(tokens(loaded.text, element, attribute)[int(index or 0)][2])
        # the row's own rule, worked out with the row's own values, is the number that stands there
        product = eval(row.rule, {}, dict(loaded.values))
        assert written == pytest.approx(product, rel=1e-15)


@pytest.mark.parametrize(
    ("model", "changes", "expected"),
    [
        (ASYM, {"m2": 1e-5}, r"parameter I2_left = 7.5e-08 kg m\^2 \(with m2_left = 1e-05, .*body \"rod_left\""),
        (ASYM, {"a1": 0.001}, r"parameter I1_left = .*body \"arm_left\" .*each at most the sum of the other two"),
        (ASYM, {"I5": 1e-9}, r"parameter I5 = 1e-09 kg m\^2: body \"parallelogram_bar_1\""),
        (PLANAR, {"I2x": 1e-9}, r"parameter I2x = 1e-09 kg m\^2: body \"cylinder_1\" .* 1e-09, 6.056e-05, 1e-09"),
        (ASYM, {"m4": 1e-20}, r"parameter m4 = 1e-20 kg: body \"slider\" .* at least 1e-15"),
        (ASYM, {"m2": 1e5, "a2": 1e5}, r"parameter I2_left = 8.3\d*e\+13 kg m\^2; .* at most 1e\+10"),
        (ASYM, {"a2": 1e300}, r"parameter a2_left = 1e\+300 m; .* at most 1e\+10"),
        (ASYM, {"a2": 10**400}, r"parameter a2_left = inf m"),
    ],
)
def test_bodies_that_cannot_be_name_the_parameter(
    model: Path, changes: dict[str, float], expected: str, tmp_path: Path
) -> None:
    with pytest.raises(ParameterError, match=expected):
        load_model(model, changes)
    if max(changes.values()) < 1e300:
        with pytest.raises(ParameterError, match=expected):
            edit_file(model, [f"{n}={v!r}" for n, v in changes.items()], tmp_path / "edited.xml")
        assert not list(tmp_path.iterdir())


def test_bodies_at_the_limit_are_possible() -> None:
    """Twin: the least transverse inertia beside an axial one of 1e-6 kg m^2, and a payload that does not move alone."""
    assert load_model(ASYM, {"I2": 5e-7, "payload": 0.0}).values["I2_left"] == 5e-7
    with pytest.raises(ParameterError, match="each at most"):
        load_model(ASYM, {"I2": math.nextafter(5e-7, 0)})


def test_huge_values_are_refused_by_the_closed_form_too() -> None:
    for value in (1e300, -1e300, 10**400):
        with pytest.raises(ParameterError, match=r"parameter g = .*at most 1e"):
            load_mechanism(ASYM).with_parameters(g=value)


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (Edit("inertial", "arm", "mass", 0, 1.0), "is missing; MuJoCo computes it from the geoms"),
        (Edit("inertial", "leg", "mass", 0, 1.0), "is missing"),
        (Edit("joint", "arm", "range", 0, 1.0), "is missing"),
        (Edit("geom", "arm", "size", 0, 1.0), "is missing"),  # one of two
        (Edit("geom", "one", "size", 1, 1.0), "size lacks number 2; write it out"),
        (Edit("geom", "one", "pos", 0, 1.0), "pos is not written; write it out"),
    ],
)
def test_what_cannot_be_edited_says_why(edit: Edit, said: str) -> None:
    geoms = '<geom name="one" size="1"/><geom size="1"/>'
    text = f'<mujoco>\n<worldbody><body name="arm">{geoms}</body></worldbody></mujoco>'
    with pytest.raises(ModelError, match=re.escape(said)) as found:
        replace_numbers(text, "m.xml", [edit])
    assert str(found.value).startswith("m.xml:")
    if said == "is missing":
        assert str(found.value).endswith(said)


def test_a_body_is_found_by_its_only_geom() -> None:
    text = '<mujoco><worldbody><body name="arm"><geom size="1 2" mass="3"/></body></worldbody></mujoco>'
    edits = [Edit("geom", "arm", "size", 1, 4.0), Edit("inertial", "arm", "mass", 0, 5.0)]
    assert replace_numbers(text, "m.xml", edits) == text.replace('"1 2"', '"1 4"').replace('"3"', '"5"')


@pytest.mark.parametrize("mark", ["", "<!-- Länge, 长度 -->"])
def test_elements_of_an_edited_text_are_those_that_a_scan_of_it_finds(mark: str) -> None:
    """Numbers that become longer and shorter, before, in and behind elements that hold others."""
    text = mark.join(ASYM.read_text().partition("<worldbody>")).replace(mark, "", 1)
    elements = scan(text, "m")
    named = [e for e in elements if e.tag in ("body", "site") and e.section == "worldbody" and e.name]
    placed = [e for e in named if len(tokens(text, e, "pos")) == 3]
    edits = [Edit(e.tag, e.name, "pos", i % 3, (-1.0) ** i * 1.0 / (i + 3.0)) for i, e in enumerate(placed)]
    edits += [Edit(placed[0].tag, placed[0].name, "pos", 2, 0.0)]
    changed, moved = numbers_replaced(text, "m", edits, elements)
    assert len(placed) > 10
    assert moved == scan(changed, "m")
    # and that is something: without moving them they are others
    assert elements != scan(changed, "m")


@pytest.mark.parametrize(
    ("number", "tells"),
    [
        ("0.2", True),
        ("5.", True),
        ("12", True),
        ("250", True),
        ("100", True),
        ("5", False),
        ("50", False),
        ("0", False),
    ],
)
def test_a_number_in_a_comment_that_is_more_than_a_counter(number: str, tells: bool) -> None:
    assert _tells(number) is tells
