"""What a model may read beside itself: includes, meshes, attached models, from below its folder and nowhere else."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import mujoco
import numpy as np
import pytest

from workbench.errors import ModelError
from workbench.mjcf.files import MAX_ASSET
from workbench.mjcf.prepared import Prepared, open_source
from workbench.mjcf.source import read_source
from workbench.robots import load

TETRA = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
LARGER = TETRA.replace(b"1 0 0", b"3 0 0")
BODY = '<body name="b"><joint name="j"/><geom type="mesh" mesh="m"/></body>'


def opened(path: Path) -> Prepared:
    return open_source(path.read_text(), str(path), path.parent)


def write(folder: Path, **files: str | bytes) -> Path:
    """Files by name, ``__`` for a slash and ``_xml`` for the suffix; returns the model."""
    for name, content in files.items():
        path = folder / name.replace("__", "/").replace("_", ".")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return folder / "model.xml"


def same_as_mujoco(path: Path) -> None:
    """MuJoCo reads the same files from the disk itself: an oracle for where they are looked for."""
    found, expected = opened(path).model, mujoco.MjModel.from_xml_path(str(path))
    for array in ("body_mass", "body_inertia", "body_pos", "geom_size", "site_pos", "jnt_axis", "mesh_vert"):
        assert np.array_equal(getattr(found, array), getattr(expected, array)), array
    for kind, count in ((mujoco.mjtObj.mjOBJ_BODY, found.nbody), (mujoco.mjtObj.mjOBJ_MESH, found.nmesh)):
        names = [[mujoco.mj_id2name(model, kind, i) for i in range(count)] for model in (found, expected)]
        assert names[0] == names[1]


def test_meshes_of_one_name_in_two_folders_are_two(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        model_xml='<mujoco><compiler meshdir="a"/><asset><mesh name="m" file="m.obj"/><mesh name="n" file="c/m.obj"/>'
        f'</asset><worldbody>{BODY}<body><joint/><geom type="mesh" mesh="n"/></body></worldbody></mujoco>',
        a__m_obj=TETRA,
        a__c__m_obj=LARGER,
    )
    same_as_mujoco(path)
    assert opened(path).model.body_mass[2] > 2 * opened(path).model.body_mass[1]


@pytest.mark.parametrize("compiler", ['assetdir="a"', 'meshdir="a/"', 'meshdir="x" assetdir="a"', 'strippath="true"'])
def test_where_meshes_are_looked_for(tmp_path: Path, compiler: str) -> None:
    files = {"a__m_obj": TETRA, "x__m_obj": LARGER, "m_obj": TETRA}
    name = "q/m.obj" if "strip" in compiler else "m.obj"
    text = f'<mujoco><compiler {compiler}/><asset><mesh file="{name}"/></asset><worldbody>{BODY}</worldbody></mujoco>'
    same_as_mujoco(write(tmp_path, model_xml=text, **files))


def test_includes_stand_where_they_are_named_and_lines_stay(tmp_path: Path) -> None:
    """The second include is looked for beside the main model first, as MuJoCo does."""
    path = write(
        tmp_path,
        model_xml='<mujoco>\n<include file="sub/a.xml"/>\n<worldbody>\n<body><joint/><geom size="1"/>\n</body>\n'
        '</worldbody>\n<include file="sub/d.xml"></include>\n</mujoco>',
        sub__a_xml='<mujocoinclude>\n\n<include file="b.xml"/>\n<default><geom density="7"/></default></mujocoinclude>',
        sub__b_xml='<mujoco><worldbody><site pos="1 0 0"/></worldbody></mujoco>',
        b_xml='<mujoco><worldbody><site pos="2 0 0"/></worldbody></mujoco>',
        sub__d_xml='<!-- </mujoco> --><mujoco><worldbody><site pos="3 0 0"/></worldbody></mujoco ><!-- </mujoco> -->',
    )
    same_as_mujoco(path)
    assert opened(path).model.site_pos[:, 0].tolist() == [2.0, 3.0]
    assert opened(path).source.text.count("\n") == path.read_text().count("\n")
    path.write_text(path.read_text().replace('size="1"', 'size="-1"'))
    with pytest.raises(ModelError, match="line 4"):
        opened(path)


def test_replicate_frame_and_attach_are_as_mujoco_compiles_them(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        model_xml='<mujoco><compiler meshdir="x"/><asset><model name="c" file="sub/child.xml"/></asset><worldbody>'
        '<frame pos="0 0 1" euler="10 0 0"><attach model="c" body="b" prefix="p_"/></frame>'
        '<replicate count="3" offset="1 0 0"><body name="r"><joint/><geom size="1"/></body></replicate></worldbody>'
        "</mujoco>",
        sub__child_xml='<mujoco><compiler meshdir="mm"/><asset><mesh name="m" file="m.obj"/></asset><worldbody>'
        f'<include file="inside.xml"/>{BODY}</worldbody></mujoco>',
        sub__inside_xml='<mujoco><site pos="1 2 3"/></mujoco>',
        sub__mm__m_obj=TETRA,
        x__m_obj=LARGER,
    )  # fmt: skip
    same_as_mujoco(path)


GEOM = '<geom type="mesh" mesh="m" {}/>'
MISSING = (
    '<mujoco>\n<asset>\n<mesh name="m" file="{}"/></asset>'
    '<worldbody><body name="b"><joint/>{}{}</body></worldbody></mujoco>'
)
INERTIAL = '<inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>'


@pytest.mark.parametrize(
    ("inertial", "geom", "weighs"),
    [
        (INERTIAL, "", False),
        ('<geom size="1" mass="2"/>', 'mass="0"', False),
        ('<geom size="1" mass="2"/>', 'density="0"', False),
        ('<geom size="1" mass="2"/>', "", True),
        ('<geom size="1" mass="2"/>', 'mass="1"', True),
    ],
)
@pytest.mark.parametrize("file", ["m.stl", "../m.stl", "/etc/passwd", "C:\\m.stl", "m.exe"])
def test_a_mesh_that_is_not_read_matters_where_mass_comes_from_it(
    tmp_path: Path, inertial: str, geom: str, weighs: bool, file: str
) -> None:
    path = write(tmp_path, model_xml=MISSING.format(file, inertial, GEOM.format(geom)))
    if weighs:
        with pytest.raises(ModelError, match=r'model.xml:3: <mesh .*body "b" has its mass from it') as caught:
            opened(path)
        assert "\n" not in str(caught.value)
    else:
        found = opened(path)
        assert found.model.body_mass[1] == 2.0
        assert "file(s) not read" in found.notes[0]
        assert "model.xml:3" in found.notes[0]


def secret(path: Path) -> None:
    path.write_bytes(TETRA)


def outward(kind: str, place: Path, target: Path) -> None:
    """Put something at *place* that must not be read; *target* lies outside the model's folder."""
    if kind == "link":
        place.symlink_to(target)
    elif kind == "linked folder":
        place.parent.rmdir()
        place.parent.symlink_to(target.parent)
    elif kind == "pipe":
        os.mkfifo(place)
    elif kind == "directory":
        place.mkdir()
    elif kind == "device":
        place.symlink_to("/dev/zero")
    elif kind == "huge":
        with place.open("wb") as stream:
            stream.truncate(MAX_ASSET + 1)
    elif kind == "pointer":
        place.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n")


@pytest.mark.parametrize("kind", ["link", "linked folder", "pipe", "directory", "device", "huge", "pointer"])
def test_what_a_name_leads_to_is_not_read_unless_it_lies_below(tmp_path: Path, kind: str) -> None:
    outside, folder = tmp_path / "outside", tmp_path / "robot"
    (folder / "a").mkdir(parents=True)
    outside.mkdir()
    (outside / "m.obj").write_bytes(TETRA)
    (outside / "m.xml").write_text('<mujoco><worldbody><site name="outside"/></worldbody></mujoco>')
    text = f'<mujoco><asset><mesh name="m" file="a/m.obj"/></asset><worldbody>{BODY}</worldbody></mujoco>'
    outward(kind, folder / "a" / "m.obj", outside / "m.obj")
    with pytest.raises(ModelError, match="has its mass from it") as caught:
        opened(write(folder, model_xml=text))
    assert "\n" not in str(caught.value)
    if kind in ("link", "linked folder", "pipe", "directory"):
        if kind != "linked folder":
            outward(kind, folder / "a" / "m.xml", outside / "m.xml")
        for use in ('<include file="a/m.xml"/>', '<asset><model name="n" file="a/m.xml"/></asset>'):
            with pytest.raises(ModelError, match=r"<(include|model) file="):
                opened(write(folder, model_xml=f"<mujoco>{use}</mujoco>"))


def test_a_link_that_stays_below_is_read(tmp_path: Path) -> None:
    """Twin of the links that lead out."""
    path = write(
        tmp_path,
        model_xml=f'<mujoco><asset><mesh name="m" file="l.obj"/></asset><worldbody>{BODY}</worldbody></mujoco>',
        a__m_obj=TETRA,
    )
    (tmp_path / "l.obj").symlink_to(tmp_path / "a" / "m.obj")
    same_as_mujoco(path)


CYCLES = {
    "a pair": {"a": '<include file="b.xml"/>', "b": '<include file="a.xml"/>'},
    "itself": {"a": '<include file="a.xml"/>', "b": ""},
    "twice": {"a": '<include file="b.xml"/><include file="b.xml"/>', "b": "<option/>"},
    "model of itself": {"a": '<asset><model name="m" file="a.xml"/></asset>', "b": ""},
    "models of each other": {
        "a": '<asset><model name="m" file="b.xml"/></asset>',
        "b": '<asset><model name="m" file="a.xml"/></asset>',
    },
}


@pytest.mark.parametrize("name", CYCLES)
def test_circles_end(tmp_path: Path, name: str) -> None:
    files = {f"{key}_xml": f"<mujoco>{inner}</mujoco>" for key, inner in CYCLES[name].items()}
    starts = '<include file="a.xml"/>', '<asset><model name="x" file="a.xml"/></asset>'
    path = write(tmp_path, model_xml=f"<mujoco>{starts['model' in name]}</mujoco>", **files)
    with pytest.raises(ModelError, match=r"already|itself"):
        opened(path)


def test_many_files_that_include_two_each_end(tmp_path: Path) -> None:
    """Copies through ``<attach>`` count: 3^20 of them are refused before MuJoCo sees one."""
    for level in range(20):
        attached = f'<asset><model name="m" file="{level + 1}.xml"/></asset><worldbody><body name="b">' + "".join(
            f'<attach model="m" body="b" prefix="{i}_"/>' for i in range(3)
        )
        (tmp_path / f"{level}.xml").write_text(f"<mujoco>{attached}</body></worldbody></mujoco>")
    (tmp_path / "20.xml").write_text('<mujoco><worldbody><body name="b"/></worldbody></mujoco>')
    (tmp_path / "model.xml").write_text((tmp_path / "0.xml").read_text())
    with pytest.raises(ModelError, match="more than 20000 elements"):
        opened(tmp_path / "model.xml")


def png(width: int, height: int) -> bytes:
    return (
        b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + b"IHDR" + struct.pack(">II", width, height) + b"\x08\x02\0\0\0"
    )


def test_a_picture_that_would_fill_the_memory_is_not_read(tmp_path: Path) -> None:
    text = (
        '<mujoco><asset><texture name="t" type="2d" file="t.png"/><material name="k" texture="t"/></asset><worldbody>'
        '<body><joint/><geom size="1" material="k"/></body></worldbody></mujoco>'
    )
    for width, height in ((1 << 20, 1 << 20), (4097, 1), (1, 4097)):
        found = opened(write(tmp_path, model_xml=text, t_png=png(width, height)))
        assert found.model.ngeom == 1
        assert f"{width} x {height} pixels" in found.notes[0]


def test_a_text_without_a_folder_reads_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.obj").write_bytes(TETRA)
    (tmp_path / "i.xml").write_text("<mujoco/>")
    source = read_source(
        f'<mujoco><asset><mesh name="m" file="m.obj"/></asset><worldbody>{BODY}</worldbody></mujoco>', "m", None
    )
    assert source.assets == {}
    with pytest.raises(ModelError, match="lies in no folder"):
        read_source('<mujoco><include file="i.xml"/></mujoco>', "m", None)


@pytest.mark.parametrize("name", ["asym_2rss_ppap", "planar_4rprp"])
def test_a_model_that_names_no_other_file_is_read_once(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    load.load_model(name, {"g": 9.5})
    monkeypatch.setattr(load, "_read", lambda *_: pytest.fail("read again"))
    assert load.load_model(name, {"g": 9.6}).values["g"] == 9.6  # type: ignore[index]


def test_a_model_with_an_include_is_read_again(tmp_path: Path) -> None:
    model, part = tmp_path / "model.xml", tmp_path / "part.xml"
    model.write_text('<mujoco><include file="part.xml"/></mujoco>')
    for mass in (1.0, 2.0):
        body = f'<body><joint/><geom size="1" mass="{mass}"/></body>'
        part.write_text(f"<mujocoinclude><worldbody>{body}</worldbody></mujocoinclude>")
        assert load.load_model(model).model.body_mass[1] == mass


def test_what_is_attached_counts_as_often_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workbench.mjcf.source.MAX_ELEMENTS", 60)
    body = f'<body name="b"><joint/><geom size="1"/>{"<site/>" * 12}</body>'
    write(tmp_path, part_xml=f"<mujoco><worldbody>{body}</worldbody></mujoco>")

    def text(times: int) -> str:
        attached = "".join(f'<frame><attach model="p" body="b" prefix="{i}"/></frame>' for i in range(times))
        model = '<asset><model name="p" file="part.xml"/></asset>'
        return f"<mujoco>{model}<worldbody>{attached}</worldbody></mujoco>"

    assert "part.xml" in str(read_source(text(1), "m", tmp_path).files)
    with pytest.raises(ModelError, match=r"m:1: <attach> makes more than 60 elements, copies counted"):
        read_source(text(3), "m", tmp_path)
