"""A user's kinematics, and formulas that ask for the platform's motion: held against the reference."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import workbench as wb
from workbench.campaign.run import run_campaign
from workbench.cli import app
from workbench.errors import SpecError

KINEMATICS = """
import numpy as np
import workbench


def parts(p, q):
    crank = p.a * np.exp(1j * q)
    elbow = np.array([p.x1, p.x2]) + crank
    way = elbow[:, 1] - elbow[:, 0]
    meet = elbow.mean(axis=1) + 1j * way / np.abs(way) * np.sqrt(p.b**2 - np.abs(way) ** 2 / 4)
    return crank, meet, meet[:, None] - elbow


@workbench.forward_kinematics
def forward(p, q):
    meet = parts(p, q)[1]
    return np.column_stack([meet.real, meet.imag])


@workbench.inverse_kinematics("two-circles", bound=1e-9)
def inverse(p, x):
    way = (x[:, 0] + 1j * x[:, 1])[:, None] - np.array([p.x1, p.x2])
    turn = np.arccos((p.a**2 + np.abs(way) ** 2 - p.b**2) / (2 * p.a * np.abs(way)))
    return np.angle(way) + turn * np.array([1.0, -1.0])


@workbench.jacobian
def rates(p, q):
    crank, _, distal = parts(p, q)
    one, two = distal[:, 0], distal[:, 1]
    out = np.empty((len(q), 2, 2))
    for j, moved in enumerate((-1j * crank[:, 0], 1j * crank[:, 1])):
        u = (np.conj(1j * two) * moved).imag / (np.conj(1j * two) * 1j * one).imag
        v = 1j * one * u + (1j * crank[:, 0] if j == 0 else 0)
        out[:, 0, j], out[:, 1, j] = v.real, v.imag
    return out
"""


@pytest.fixture
def fivebar(tmp_path: Path, repository: Path) -> Path:
    folder = tmp_path / "fivebar"
    shutil.copytree(repository / "examples" / "fivebar", folder)
    return folder


def checks(folder: Path, text: str) -> tuple[bool, list[dict[str, object]], str]:
    (folder / "kinematics.py").write_text(text)
    outcome = wb_run(folder, folder / "kinematics.py")
    case = outcome.manifest["cases"]["apart"]
    return outcome.passed, case["kinematics_checks"], case["message"] or ""


def wb_run(folder: Path, *files: object):  # type: ignore[no-untyped-def]
    from workbench.campaign.evidence import Effort

    return run_campaign(
        folder / "fivebar.toml",
        folder / "run",
        candidates=files,
        effort=Effort(budget=False),  # type: ignore[arg-type]
    )


def test_right_kinematics_agree_with_the_reference(fivebar: Path) -> None:
    passed, rows, message = checks(fivebar, KINEMATICS)
    assert passed, message
    assert [(row["kind"], row["coordinate"]) for row in rows] == [
        ("forward kinematics", "x"),
        ("forward kinematics", "z"),
        ("inverse kinematics", "q1"),
        ("inverse kinematics", "q2"),
        ("jacobian", "x"),
        ("jacobian", "z"),
    ]
    assert all(row["error"] < 1e-11 and row["verdict"] == "pass" for row in rows), rows  # type: ignore[operator]


@pytest.mark.parametrize(
    ("old", "new", "kind", "coordinates"),
    [
        ("[meet.real, meet.imag]", "[meet.real, 1.0001 * meet.imag]", "forward kinematics", {"z"}),
        ("np.array([1.0, -1.0])", "np.array([-1.0, -1.0])", "inverse kinematics", {"q1"}),
        ("out[:, 1, j] = v.real, v.imag", "out[:, 1, j] = -v.real, v.imag", "jacobian", {"x"}),
    ],
)
def test_wrong_kinematics_fail_where_they_are_wrong(
    fivebar: Path, old: str, new: str, kind: str, coordinates: set[str]
) -> None:
    assert old in KINEMATICS
    passed, rows, message = checks(fivebar, KINEMATICS.replace(old, new))
    assert not passed
    assert {row["coordinate"] for row in rows if row["verdict"] == "fail"} == coordinates
    assert {row["kind"] for row in rows if row["verdict"] == "fail"} == {kind}
    assert kind in message


def test_they_stand_on_the_terminal_and_in_the_report(fivebar: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (fivebar / "kinematics.py").write_text(KINEMATICS)
    monkeypatch.chdir(fivebar)
    arguments = ["run", "fivebar.toml", "--candidates", "kinematics.py", "--quick", "--no-pictures", "--out", "out"]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    assert "kinematics against MuJoCo" in done.output
    assert "Verification of kinematics" in (fivebar / "out" / "report.md").read_text()
    (fivebar / "kinematics.py").write_text(KINEMATICS.replace("meet.imag]", "-meet.imag]"))
    assert CliRunner().invoke(app, arguments).exit_code == 1


def test_a_kinematics_formula_of_a_wrong_shape_is_one_line(fivebar: Path) -> None:
    with pytest.raises(SpecError, match=r"forward kinematics is called as f\(parameters, q\)"):
        checks(fivebar, KINEMATICS.replace("def forward(p, q)", "def forward(p, q, qd)"))
    passed, _, message = checks(
        fivebar, KINEMATICS.replace("return np.column_stack([meet.real, meet.imag])", "return meet.real")
    )
    assert not passed
    assert "samples, then x z" in message


def test_a_formula_may_ask_for_time_and_platform(fivebar: Path) -> None:
    robot = wb.load_robot(fivebar)
    seen: dict[str, np.ndarray] = {}

    def weight(p, q, qd, qdd, t, *, x, xd, omega):  # type: ignore[no-untyped-def]
        """Remembers what it was handed."""
        seen.update(t=t, x=x, xd=xd, omega=omega)
        return np.zeros_like(q)

    run = wb.run(fivebar / "fivebar.toml", [weight], out=fivebar / "run", quick=True)
    series = run.series("apart")
    assert np.array_equal(seen["t"], series["t"])
    assert np.array_equal(seen["x"], series[["x1", "x2", "x3"]].to_numpy())
    assert np.array_equal(seen["omega"], series[["omega_x", "omega_y", "omega_z"]].to_numpy())
    q, qd, qdd = (series[[f"{rate}1", f"{rate}2"]].to_numpy() for rate in ("q", "qd", "qdd"))
    assert np.allclose(robot.reference.inverse_dynamics(q, qd, qdd).xd, seen["xd"], atol=1e-12)


def test_functions_of_a_notebook_are_run(fivebar: Path) -> None:
    def nothing(p, q, qd, qdd):  # type: ignore[no-untyped-def]
        return 0.0 * q

    run = wb.run(fivebar / "fivebar.toml", [nothing, fivebar / "fivebar.py"], out=fivebar / "run", quick=True)
    errors = run.summary.set_index(["candidate", "joint"])["peak_error"]
    assert errors["nothing", "q1"] == 1.0
    assert errors["virtual-work", "q1"] < 1e-12
    assert "fivebar" in repr(run)
    assert "2 pass" in repr(run)
    figure = run.plot("apart")
    drawn = [line for axes in figure.axes for line in axes.get_lines() if len(line.get_xdata()) > 10]
    assert len(drawn) >= 6  # two candidates, a reference on each joint
    assert any(np.allclose(line.get_ydata(), run.series("apart")["cand_virtual-work_q1"]) for line in drawn)


def test_a_sweep_takes_files_only(fivebar: Path) -> None:
    from workbench.campaign.user_candidates import full_names

    with pytest.raises(SpecError, match="give the file"):
        full_names([lambda p, q, qd, qdd: q])
