"""Hostile and broken model files: one line each, nothing read, written, run or waited for."""

# ruff: noqa: E501 - one hostile file to a line, where it fits
from __future__ import annotations

import os
import random
import socket
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

import pytest

from workbench import MujocoReference, load_mechanism
from workbench.errors import ModelError, WorkbenchError
from workbench.mjcf.files import MAX_BYTES, UnreadableError, read_bytes
from workbench.mjcf.safety import MAX_DEPTH, MAX_ELEMENTS, _memory, refuse_element
from workbench.reference.check import check_model
from workbench.robots.edit import edit_file
from workbench.robots.load import load_model, open_model
from workbench.robots.show import show_parameters

ASYM = Path(__file__).resolve().parents[1] / "models" / "asym_2rss_ppap.xml"
TEXT = ASYM.read_text()
QUICK = 5.0
"""Seconds; a bomb that goes off takes far longer, or all the memory."""

BOMB = '<!DOCTYPE a [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;">]>'
OUTSIDE = '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/hostname">]>'


def inside(section: str, extra: str) -> str:
    """The bundled model with something more at the start of a section."""
    start = f"<{section}>"
    assert start in TEXT
    return TEXT.replace(start, f"{start}{extra}", 1)


HOSTILE: dict[str, tuple[str, str]] = {
    "include, missing": (inside("worldbody", '<include file="other.xml"/>'), "no such file"),
    "include, absolute": (inside("asset", '<include file="/etc/passwd"/>'), "an absolute path"),
    "include, above": (inside("asset", '<include file="../other.xml"/>'), "outside the model's own folder"),
    "include of itself": (inside("worldbody", '<include file="model.xml"/>'), "model.xml"),
    "include without a name": (inside("worldbody", "<include/>"), "no file is named"),
    "mesh that weighs": (inside("worldbody", '<body><joint/><geom type="mesh" mesh="m"/></body>').replace("<asset>", '<asset><mesh name="m" file="../m.stl"/>'), "has its mass from it"),
    "mesh of a device": (inside("worldbody", '<body><joint/><geom type="mesh" mesh="m"/></body>').replace("<asset>", '<asset><mesh name="m" file="/dev/zero"/>'), "an absolute path"),
    "model in a model": (inside("asset", '<model name="m" file="m.xml"/>'), "no such file"),
    "model, absolute": (inside("asset", '<model name="m" file="/etc/passwd"/>'), "an absolute path"),
    "attach from nothing": (inside("worldbody", '<attach model="m" body="b" prefix="p"/>'), "attach"),
    "file where none is read": (inside("worldbody", '<site file="x"/>'), "reads another file"),
    "replicate bomb": (inside("worldbody", '<replicate count="100000" sep="1 0 0"><geom size="1"/></replicate>'), "<geom> makes more than 20000"),
    "nested replicate bomb": (inside("worldbody", '<replicate count="200" sep="1 0 0"><replicate count="200"><geom size="1"/></replicate></replicate>'), "makes more than 20000"),
    "skin": (inside("asset", '<skin name="s" file="s.skn"/>'), "deformable"),
    "plugin": (inside("actuator", '<plugin joint="q1" plugin="mujoco.pid"/>'), "loads code"),
    "extension": (TEXT.replace("<option", '<extension><plugin plugin="mujoco.sdf.gear"/></extension><option', 1), "loads code"),
    "urdf": ('<robot name="r"><link name="l"/></robot>', "begins with <mujoco>"),
    "urdf mesh": ('<robot><link name="l"><visual><geometry><mesh filename="/etc/passwd"/></geometry></visual></link></robot>',
                  "begins with <mujoco>"),
    "entity bomb": (BOMB + TEXT.replace("asym_2rss_ppap", "&c;", 1), "document type"),
    "external entity": (OUTSIDE + TEXT.replace('model="asym_2rss_ppap"', 'model="&x;"'), "document type"),
    "bare doctype": ("<!DOCTYPE mujoco>" + TEXT, "document type"),
    "deep nesting": (inside("worldbody", "<body>" * 5000 + "</body>" * 5000), "nest deeper"),
    "deep nesting never closed": ("<mujoco>" + "<body>" * 1_000_000, "nest deeper"),
    "many elements": (inside("worldbody", '<site pos="0 0 0"/>' * (MAX_ELEMENTS + 1)), "more than"),
    "composite bomb": (inside("worldbody", '<composite type="cable" count="1000000 1 1" size="1"/>'), "<composite>"),
    "flex bomb": (inside("worldbody", '<flexcomp name="f" count="999 999 999" dim="3"/>'), "<flexcomp>"),
    "texture bomb": (inside("asset", '<texture type="2d" builtin="flat" width="100000" height="100000"/>'), "at most 4096"),
    "height field bomb": (inside("asset", '<hfield name="h" nrow="99999" ncol="99999" size="1 1 1 1"/>'), "at most 4096"),
    "mesh bomb": (inside("asset", '<mesh name="m" builtin="supersphere" params="99999 1 1"/>'), "at most 256"),
    "numeric bomb": (inside("custom", '<numeric name="n" size="2000000000"/>'), "at most 1000000"),
    "memory bomb": (TEXT.replace("<option", '<size memory="900G"/><option', 1), "at most 1G"),
    "memory bomb in bytes": (TEXT.replace("<option", '<size memory="99999999999"/><option', 1), "at most 1G"),
    "user data bomb": (TEXT.replace("<option", '<size nuserdata="2000000000"/><option', 1), "at most 1000000"),
    "user numbers bomb": (TEXT.replace("<option", '<size nuser_body="100000000"/><option', 1), "at most 1000"),
    "picture of too many samples": (TEXT.replace("<option", '<visual><quality offsamples="65"/></visual><option', 1), "at most 64"),
    "NaN": (TEXT.replace('name="rod_left_tip" pos="0 0 0.3"', 'name="rod_left_tip" pos="nan 0 0.3"'), "is not finite"),
    "infinity": (TEXT.replace('mass="0.45"', 'mass="inf"'), "is not finite"),
    "minus Infinity": (TEXT.replace('gravity="0 0 -9.81"', 'gravity="0 0 -Infinity"'), "is not finite"),
    "overflow": (TEXT.replace('mass="0.45"', 'mass="1e999"'), "too large"),
    "huge mass": (TEXT.replace('mass="0.45"', 'mass="1e300"'), "at most 1e+10"),
    "huge gravity": (TEXT.replace('gravity="0 0 -9.81"', 'gravity="0 0 -1e300"'), "at most 1e+10"),
    "comma for a point": (TEXT.replace('mass="0.45"', 'mass="0,45"'), "mass"),
    "negative mass": (TEXT.replace('mass="0.45"', 'mass="-0.45"'), "mass"),
    "null byte": (TEXT.replace("<option", "\0<option", 1), "not well-formed"),
    "null byte in a value": (TEXT.replace('mass="0.45"', 'mass="0.4\0005"'), "not well-formed"),
    "null reference": (TEXT.replace('mass="0.45"', 'mass="&#0;0.45"'), "not well-formed"),
    "empty": ("", "not well-formed"),
    "blank": (" \n", "not well-formed"),
    "no XML": ("hello", "not well-formed"),
    "cut off": (TEXT[: len(TEXT) // 2], "not well-formed"),
    "twice": (TEXT + TEXT, "not well-formed"),
    "attribute twice": (TEXT.replace('mass="0.45"', 'mass="0.45" mass="0.5"'), "duplicate attribute"),
    "unknown mechanism": (TEXT.replace('data="asym_2rss_ppap"', 'data="asym_2rss_ppa"'), 'did you mean "asym_2rss_ppap"'),
    "unknown element": (inside("worldbody", "<wheel/>"), "wheel"),
    "escape sequence in a name": (TEXT.replace('name="platform_E"', 'name="&#10;x&#9;y"'), "platform_E"),
}  # fmt: skip


@pytest.fixture
def untouched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A current directory in which nothing may appear; MuJoCo writes its log into it when left alone."""
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_models_are_one_line(
    name: str, tmp_path: Path, untouched: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    text, expected = HOSTILE[name]
    path = tmp_path / "model.xml"
    path.write_text(text, encoding="utf-8")
    start = perf_counter()
    with pytest.raises(ModelError) as caught:
        load_model(path)
    message = str(caught.value)
    assert expected in message
    assert str(path) in message
    assert "\n" not in message
    assert "\x1b" not in message
    assert len(message) < 500
    assert perf_counter() - start < QUICK
    for reader in (load_mechanism, MujocoReference, show_parameters):
        with pytest.raises(WorkbenchError) as again:
            reader(path)
        assert str(again.value) == message
    with pytest.raises(WorkbenchError) as again:
        edit_file(path, ["a2=0.31"], in_place=True)
    assert str(again.value) == message
    assert path.read_text(encoding="utf-8") == text
    assert list(untouched.iterdir()) == []
    output = capfd.readouterr()
    assert output.out + output.err == ""


def test_a_refused_reference_to_another_file_names_its_line(tmp_path: Path) -> None:
    path = tmp_path / "model.xml"
    path.write_text(HOSTILE["include, above"][0])
    line = next(i for i, row in enumerate(path.read_text().split("\n"), start=1) if "../other.xml" in row)
    with pytest.raises(ModelError, match=f'model.xml:{line}: <include file="../other.xml">: lies outside'):
        load_model(path)


def test_words_that_look_like_numbers_are_names(tmp_path: Path) -> None:
    """Twin of the refusal: a material called nan, and "inf" in a text."""
    path = tmp_path / "model.xml"
    text = TEXT.replace('"rail"', '"nan"').replace("<custom>", '<custom><text name="note" data="inf"/>')
    path.write_text(text.replace('class="visual"', 'class="inf"'))
    assert load_model(path).closed_form is not None


def test_limits_leave_room(tmp_path: Path) -> None:
    """Twin of the bombs: what a large but honest model holds is accepted."""
    path = tmp_path / "model.xml"
    many = '<site pos="0 0 0"/>' * 2000
    deep = "<body>" * (MAX_DEPTH - 10) + "</body>" * (MAX_DEPTH - 10)
    texture = '<texture name="t" type="2d" builtin="checker" width="1024" height="1024"/>'
    text = inside("worldbody", many + deep).replace("<asset>", "<asset>" + texture)
    path.write_text(text.replace("<option", '<size memory="100M"/><option', 1))
    assert load_model(path).closed_form is not None


@pytest.mark.parametrize(("power", "unit"), list(enumerate(["", "K", "M", "G", "T", "P", "E"])))
def test_memory_is_counted_in_its_unit_and_limited_to_the_byte(power: int, unit: str) -> None:
    assert {_memory(f"3{unit}"), _memory(f"3{unit.lower()}")} == {3.0 * 1024**power}
    most = 2**30 // 1024**power

    def ask(count: int) -> None:
        refuse_element("size", {"memory": f"{count}{unit}"}, 2, 2, "model.xml:3")

    if most:
        ask(most)
    with pytest.raises(ModelError, match=rf'model.xml:3: <size memory="{most + 1}{unit}">; allowed: at most 1G'):
        ask(most + 1)


def make_directory(path: Path) -> None:
    path.mkdir()


def make_socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as server:
        os.chdir(path.parent)
        server.bind(path.name)


def make_large(path: Path) -> None:
    with path.open("wb") as stream:
        stream.truncate(MAX_BYTES + 1)


def make_link_to(target: str) -> Callable[[Path], None]:
    return lambda path: path.symlink_to(target)


PLACES: dict[str, tuple[Callable[[Path], None], str]] = {
    "directory": (make_directory, "is a directory"),
    "pipe": (os.mkfifo, "no regular file"),
    "socket": (make_socket, "no regular file"),
    "large": (make_large, "at most"),
    "missing": (lambda path: None, "no such model file"),
    "dangling link": (make_link_to("nowhere.xml"), "no such model file"),
    "link to itself": (make_link_to("model.xml"), "model"),
    "link to a directory": (make_link_to("/"), "is a directory"),
    "link to a device": (make_link_to("/dev/zero"), "no regular file"),
    "link to a secret": (make_link_to("/etc/passwd"), "not well-formed"),
    "not UTF-8": (lambda path: path.write_bytes(TEXT.encode("utf-16")) and None, "not UTF-8"),
    "Latin-1": (lambda path: path.write_bytes(TEXT.replace("home pose", "Länge", 1).encode("latin-1")) and None, "not UTF-8"),
    "random bytes": (lambda path: path.write_bytes(random.Random(1).randbytes(5000)) and None, "not UTF-8"),
}  # fmt: skip


@pytest.mark.parametrize("name", PLACES)
def test_what_is_no_model_file_is_one_line(name: str, tmp_path: Path, untouched: Path) -> None:
    make, expected = PLACES[name]
    path = tmp_path / "model.xml"
    make(path)
    start = perf_counter()
    for reader in (load_model, open_model, check_model, show_parameters):
        with pytest.raises(ModelError) as caught:
            reader(path)
        assert expected in str(caught.value)
        assert "\n" not in str(caught.value)
        assert "root:" not in str(caught.value)
    assert perf_counter() - start < QUICK
    assert list(untouched.iterdir()) == []


def test_a_file_that_the_system_does_not_open_says_why(tmp_path: Path) -> None:
    with pytest.raises(UnreadableError, match=r"^No such file or directory$"):
        read_bytes(tmp_path / "absent.stl", 100)


@pytest.mark.parametrize("name", ["a\0b.xml", "x" * 5000, "", ".", "/", "model.xml/more.xml", "\ud800.xml"])
def test_impossible_names_are_one_line(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.xml").write_text(TEXT)
    with pytest.raises(ModelError) as caught:
        load_model(name)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["models/../pyproject.toml", "models/../../etc/passwd", "models/none.xml", "models/"])
def test_a_bundled_name_does_not_lead_elsewhere(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ModelError, match=r"no such (robot or )?model file"):
        load_model(name)


def test_a_link_to_a_model_is_read(tmp_path: Path) -> None:
    link = tmp_path / "link.xml"
    link.symlink_to(ASYM)
    assert load_mechanism(link).parameters == load_mechanism(ASYM).parameters


def test_damaged_models_never_end_in_a_traceback(tmp_path: Path, untouched: Path) -> None:
    """Three hundred models with bytes cut, doubled, swapped for others: each loads or is refused in one line."""
    dice = random.Random(3)
    path = tmp_path / "model.xml"
    start = TEXT.index("<mujoco")
    refused = []
    for _ in range(300):
        raw = bytearray(TEXT.encode())
        for _ in range(dice.randint(1, 4)):
            place = dice.randrange(start, len(raw))
            length = dice.choice([1, 1, 2, 10, 60])
            kind = dice.randrange(4)
            if kind == 0:
                del raw[place : place + length]
            elif kind == 1:
                raw[place:place] = raw[place : place + length]
            elif kind == 2:
                raw[place] = dice.choice(b'0123456789<>"/=- e.\0&\xff')
            else:
                other = dice.randrange(start, len(raw))
                raw[place : place + length] = raw[other : other + length]
        path.write_bytes(raw)
        try:
            load_model(path)
        except WorkbenchError as error:
            refused.append(str(error))
    assert 200 < len(refused) < 300
    assert not any("\n" in message for message in refused)
    assert list(untouched.iterdir()) == []


def test_numbers_put_anywhere_never_end_in_a_traceback(tmp_path: Path, untouched: Path) -> None:
    """A hundred models and more with one or two numbers replaced by extreme ones; `check` lists or refuses, in one line."""
    import re

    dice = random.Random(5)
    path = tmp_path / "model.xml"
    spans = [m.span() for m in re.finditer(r'(?<=[" ])-?[\d.]+(?=[" ])', TEXT)]
    values = ["0", "-1", "1e-300", "1e10", "-1e10", "1e9", "3", "1e-12", "9999999", "0.5", "1e308", "-0"]
    lines = []
    for _ in range(120):
        text = TEXT
        for begin, end in sorted(dice.sample(spans, dice.randint(1, 2)), reverse=True):
            text = text[:begin] + dice.choice(values) + text[end:]
        path.write_text(text)
        try:
            lines += check_model(path, ranges=False).broken
        except WorkbenchError as error:
            lines.append(str(error))
    assert len(lines) > 50
    assert not any("\n" in line for line in lines)
    assert list(untouched.iterdir()) == []
