"""The worked examples: each closed form is round-off away from the reference, and a spoiled one is not."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import workbench as wb
from workbench.campaign.evidence import Effort
from workbench.campaign.run import run_campaign
from workbench.report.frames import RunFrames

EXAMPLES = {
    "fourbar": ("tau[:, None]", "1.000001 * tau[:, None]"),
    "fivebar": ("w**2", "1.0001 * w**2"),
    "delta": ("p.If / p.lz**2", "1.0001 * p.If / p.lz**2"),
    "bricard": ("slope * qdd", "1.0001 * slope * qdd"),
    "orthoglide": ("2 * sin * swing * shear", "-2 * sin * swing * shear"),
    "rrr": ("turn**2 * dot(leg, arm)", "1.0001 * turn**2 * dot(leg, arm)"),
    "prr": ("turn**2 * dot(leg, arm)", "1.0001 * turn**2 * dot(leg, arm)"),
    "tripteron": ("turn**2 * dot(lower, upper)", "1.0001 * turn**2 * dot(lower, upper)"),
}


def run(directory: Path, name: str, code: Path) -> RunFrames:
    out = directory / "out"
    run_campaign(directory / f"{name}.toml", out, effort=Effort(budget=False), candidates=[code])
    return wb.load_run(out)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_holds_and_its_spoiled_twin_does_not(repository: Path, tmp_path: Path, name: str) -> None:
    directory = tmp_path / name
    shutil.copytree(repository / "examples" / name, directory)
    code = directory / f"{name}.py"
    summary = run(directory, name, code).summary
    judged = summary[summary["kind"] == "verification"]
    assert len(judged) > 0
    assert judged["peak_error"].max() < 1e-12
    right, wrong = EXAMPLES[name]
    text = code.read_text()
    assert right in text
    code.write_text(text.replace(right, wrong))
    summary = run(directory, name, code).summary
    assert summary[summary["kind"] == "verification"]["peak_error"].max() > 1e-10


def test_two_points_for_the_legs_of_the_orthoglide_are_a_modelling_error_of_some_percent(
    repository: Path, tmp_path: Path
) -> None:
    directory = tmp_path / "orthoglide"
    shutil.copytree(repository / "examples" / "orthoglide", directory)
    summary = run(directory, "orthoglide", directory / "orthoglide.py").summary
    error = summary[summary["candidate"] == "two_points"]["peak_error"]
    assert 0.005 < error.min() < error.max() < 0.055


def test_codoureys_split_is_a_modelling_error_of_some_percent(repository: Path, tmp_path: Path) -> None:
    directory = tmp_path / "delta"
    shutil.copytree(repository / "examples" / "delta", directory)
    summary = run(directory, "delta", directory / "delta.py").summary
    error = summary[summary["candidate"] == "codourey"]["peak_error"]
    assert 0.02 < error.min() < error.max() < 0.08


ORTHOGLIDE_FAULTS = {
    "fork and yoke do not turn": ("2 * p.Jb, p.If + p.Iy)", "2 * p.Jb, 0.0)"),
    "bars do not spin": ("2 * p.Jb, p.If", "0.0, p.If"),
    "gyroscopic term's sign": ("- slope * swing**2 / 2", "+ slope * swing**2 / 2"),
    "cutting force reversed": ("sum(axis=1) - force", "sum(axis=1) + force"),
    "other branch": ("-(1 + np.sqrt", "-(1 - np.sqrt"),
    "centripetal term": ("dot(leg, slider) - dot(leg_rate, leg_rate)", "dot(leg, slider) + dot(leg_rate, leg_rate)"),
}


@pytest.mark.parametrize("name", ORTHOGLIDE_FAULTS)
def test_each_term_of_the_orthoglide_is_seen(repository: Path, tmp_path: Path, name: str) -> None:
    directory = tmp_path / "orthoglide"
    shutil.copytree(repository / "examples" / "orthoglide", directory)
    right, wrong = ORTHOGLIDE_FAULTS[name]
    code = directory / "orthoglide.py"
    text = code.read_text()
    assert text.count(right) == 1
    code.write_text(text.replace(right, wrong))
    summary = run(directory, "orthoglide", code).summary
    assert (summary[summary["candidate"] == "exact"]["peak_error"] > 1e-10).any()


LIBRARY_FAULTS = {
    "rrr": {
        "external force reversed": ("- (force[:, 0] + 1j * force[:, 2])", "+ (force[:, 0] + 1j * force[:, 2])"),
        "mass centre at the site": ("dot(1j * centre, carried)[:, 0]", "0.0"),
        "bars do not couple": ("cross * joint + (near", "0.0 * joint + (near"),
        "crank's weight": ("p.g * p.l1 / 2", "p.g * p.l1 / 2.001"),
    },
    "prr": {
        "external force reversed": ("- (force[:, 0] + 1j * force[:, 2])", "+ (force[:, 0] + 1j * force[:, 2])"),
        "platform's inertia": ("p.I3 * spin", "1.001 * p.I3 * spin"),
        "slider's weight": ("p.g * RAIL.imag", "p.g * RAIL.real"),
    },
    "tripteron": {
        "external force reversed": ("UP) - force +", "UP) + force +"),
        "limb's plane mirrored": ("np.roll(across.imag, 2, axis=1)", "np.roll(-across.imag, 2, axis=1)"),
        "elbow's branch": ("np.exp(-1j * opening)", "np.exp(1j * opening)"),
        "upper bar's weight": ("p.m1 / 2 * dot", "p.m1 / 2.001 * dot"),
    },
}


@pytest.mark.parametrize(
    ("name", "fault"), [(name, fault) for name, faults in LIBRARY_FAULTS.items() for fault in faults]
)
def test_each_term_of_the_library_is_seen(repository: Path, tmp_path: Path, name: str, fault: str) -> None:
    directory = tmp_path / name
    shutil.copytree(repository / "examples" / name, directory)
    right, wrong = LIBRARY_FAULTS[name][fault]
    code = directory / f"{name}.py"
    text = code.read_text()
    assert text.count(right) == 1
    code.write_text(text.replace(right, wrong))
    summary = run(directory, name, code).summary
    assert (summary[summary["candidate"] == "exact"]["peak_error"] > 1e-10).any()


REDUNDANT = {
    "bricard": (1, 4, 2),
    "orthoglide": (3, 13, 17),
    "rrr": (3, 4, 2),
    "prr": (3, 4, 2),
    "tripteron": (3, 7, 5),
}


@pytest.mark.parametrize("name", REDUNDANT)
def test_redundant_rows_are_counted(repository: Path, tmp_path: Path, name: str) -> None:
    directory = tmp_path / name
    shutil.copytree(repository / "examples" / name, directory)
    for case in run(directory, name, directory / f"{name}.py").manifest.cases.values():
        assert (case.mobility, case.rank, case.redundant_rows) == REDUNDANT[name]
