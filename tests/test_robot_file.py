"""Robot files that are wrong: each is refused in one line that names file, key and the way on."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from slider_crank import ROBOT, write_slider
from small_campaign import Workbench
from workbench.errors import SpecError
from workbench.robots.catalogue import robot_beside
from workbench.robots.places import ELEMENT_OF, KINDS, _product, parse_place
from workbench.robots.robot_file import read_robot_file

MISTAKES = {
    "unknown key": ("actuated =", "actuatd =", ("actuatd: unknown key", 'did you mean "actuated"')),
    "unknown key of a parameter": ('unit = "kg"', 'units = "kg"', ("parameters.m1.units: unknown key", '"unit"')),
    "no such place": ('"mass rod"', '"mass rodd"', ("parameters.m2.at", 'no body "rodd"', 'did you mean "rod"')),
    "no such kind": ('"mass rod"', '"masss rod"', ("parameters.m2.at", "unknown place", '"mass"')),
    "no axis": ('"com rod x"', '"com rod"', ("parameters.s2.at", 'allowed: "com BODY x|y|z"')),
    "no such geom": ('"geom rod fromto', '"geom rodd fromto', ("parameters.b.follows", 'no geom "rodd"', '"rod"')),
    "places disagree": (
        '"inertia crank z"', '"inertia crank x"',
        ('"inertia crank x" is 1e-05', "parameter I1", "have to agree", "slider.xml:7"),
    ),
    "out of range": (
        '["mass rod"], allowed = "> 0"', '["mass rod"], allowed = "> 2"',
        ("slider.xml: parameter m2 = 0.6 kg; allowed: > 2",),
    ),
    "range is none": ('["mass rod"], allowed = "> 0"', '["mass rod"], allowed = "positive"', ("m2", '"> 0"')),
    "empty range": ('["mass rod"], allowed = "> 0"', '["mass rod"], allowed = "2 to 1"', ("parameters.m2", "2 and 1")),
    "wrong unit": ('unit = "kg"', 'unit = "g"', ("parameters.m1", 'unit = "g"', '"mass crank" holds kg')),
    "unit of a hinge": ('unit = "N s/m"', 'unit = "N m s/rad"', ("parameters.c", '"damping slide" holds N s/m')),
    "no such coordinate": ('["x"]', '["w"]', ("platform.coordinates", "'w'", "'x'")),
    "out of the plane": ('["x"]', '["y"]', ("platform.coordinates", "coordinate y does not change", "those it has: x")),
    "coordinates too many": (
        'coordinates = ["x"], names = ["stroke"]', 'coordinates = ["x", "z"]', ("platform.coordinates", "1"),
    ),
    "names too many": ('names = ["stroke"]', 'names = ["s", "t"]', ("platform", "2 names for 1 coordinates")),
    "formulas missing": ('["slider.py"]', '["slyder.py"]', ('formulas = "slyder.py"', "no such file")),
    "given twice": ("[[bars]]", 'm1 = { at = ["mass rod"] }\n[[bars]]', ("not valid TOML",)),
    "group of an unknown": ('"m2", "m3"]', '"m2", "m4"]', ("groups.m", 'no parameter "m4"')),
    "group is a parameter": ("m = [", "m1 = [", ("groups.m1", "is a parameter too")),
    "limits of an idle joint": ("limits = { crank", "limits = { slide", ("limits", 'no actuated joint "slide"')),
    "limits upside down": ("[0.3, 1.5]", "[1.5, 0.3]", ("limits.crank", "below the second")),
    "model above": ('"slider.xml"', '"../slider.xml"', ('model = "../slider.xml"', "without ..")),
    "model missing": ('"slider.xml"', '"slyder.xml"', ('model = "slyder.xml"', "no such file")),
    "site and body": ('site = "pin"', 'site = "pin", body = "slider"', ("platform", "either site or body")),
    "no such site": ('site = "pin"', 'site = "pinn"', ("platform.site", 'no site "pinn"', '"pin"')),
    "no such joint": (
        'actuated = ["crank"]', 'actuated = ["crank", "slyde"]', ("actuated", 'no joint "slyde"', '"slide"'),
    ),
    "initial of no joint": ("elbow = -1.2", "elbo = -1.2", ("initial", "elbo", '"elbow"')),
    "bar of no body": ('bodies = ["crank"]', 'bodies = ["crnk"]', ("bars", 'no body "crnk"')),
    "bar of no parameter": ('mass = "m1"', 'mass = "mm"', ("bars[1]", 'no parameter "mm"')),
}  # fmt: skip


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    made = Workbench(tmp_path, monkeypatch, capsys)
    write_slider(tmp_path)
    return made


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_refused_in_one_line(workbench: Workbench, name: str) -> None:
    old, new, said = MISTAKES[name]
    assert ROBOT.count(old) == 1 or name.startswith("limits of"), old
    workbench.write(ROBOT.replace(old, new), "robot.toml")
    done = workbench("run", "slider.toml", "--quick", "--no-pictures", "--out", "out")
    assert done.code == 2, done
    (line,) = done.complaint
    assert "robot.toml" in line or line.startswith("workbench: slider.xml:"), line
    for piece in said:
        assert piece in line
    assert not (workbench.directory / "out").exists()


def test_the_file_itself_is_right(workbench: Workbench) -> None:
    """The twin: every mistake above is one."""
    assert workbench("run", "slider.toml", "--dry-run").code == 0


@pytest.mark.parametrize(
    ("text", "factor", "names"),
    [("k1 * a1", 1.0, ("k1", "a1")), ("+k1*a1", 1.0, ("k1", "a1")), ("- a1", -1.0, ("a1",)),
     ("-0.5 * a1", -0.5, ("a1",))],
)  # fmt: skip
def test_signs_and_factors_of_a_place(text: str, factor: float, names: tuple[str, ...]) -> None:
    assert _product(text, "here") == (factor, names)


@pytest.mark.parametrize("kind", ELEMENT_OF)
def test_a_place_names_what_its_form_says(kind: str) -> None:
    names = [f"n{i}" for i in range(len(KINDS[kind].elements))]
    axes = ["x", "y", "z"] if KINDS[kind].form.endswith("x|y|z") else [""]
    for index, axis in enumerate(axes):
        place = parse_place(" ".join([kind, *names, axis]), "p", "here")
        assert (place.element, place.attribute) == ELEMENT_OF[kind]
        assert (place.name, place.index, place.factor, place.of) == ("\n".join(names), index, 1.0, ("p",))
    for wrong in ([*names, "one more", axes[0]], [*names, *(["w"] if axes[0] else ["x"])], names[1:] + axes[:1]):
        if names or len(wrong) > 1:
            with pytest.raises(SpecError, match=r"^here .*allowed: "):
                parse_place(" ".join([kind, *(f'"{word}"' for word in wrong if word)]), "p", "here")


def test_a_robot_file_beside_a_model_speaks_for_that_model_alone(tmp_path: Path) -> None:
    folder = tmp_path / "robot"
    shutil.copytree(Path(__file__).resolve().parents[1] / "examples" / "fivebar", folder)
    found = robot_beside(folder / "fivebar.xml")
    assert found is not None
    assert found.model.resolve() == (folder / "fivebar.xml").resolve()
    other = folder / "other.xml"
    shutil.copy(folder / "fivebar.xml", other)
    assert robot_beside(other) is None
    (folder / "robot.toml").write_text("format = 1\n", encoding="utf-8")
    with pytest.raises(SpecError, match=r"robot\.toml"):
        robot_beside(folder / "fivebar.xml")
    (folder / "robot.toml").unlink()
    assert robot_beside(folder / "fivebar.xml") is None


def test_robot_files_are_the_same_where_they_say_the_same(tmp_path: Path) -> None:
    folder = tmp_path / "robot"
    shutil.copytree(Path(__file__).resolve().parents[1] / "examples" / "fivebar", folder)
    one, again = read_robot_file(folder / "robot.toml"), read_robot_file(folder / "robot.toml")
    assert one == again
    assert len({one, again}) == 1
    text = (folder / "robot.toml").read_text(encoding="utf-8")
    (folder / "robot.toml").write_text(text.replace('title = "', 'title = "another ', 1), encoding="utf-8")
    other = read_robot_file(folder / "robot.toml")
    assert one != other
    assert one != folder / "robot.toml"
    assert len({one, again, other}) == 2
