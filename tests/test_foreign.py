"""Formulas in other languages give what the Python ones give, and their faults are reported with their own lines."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import workbench as wb
from workbench.campaign.evidence import Effort
from workbench.campaign.foreign_candidates import ForeignCandidate
from workbench.campaign.run import run_campaign
from workbench.campaign.user_candidates import load_candidates
from workbench.errors import CandidateError, SpecError
from workbench.foreign.octave import octave_program

needs_octave = pytest.mark.skipif(octave_program() is None, reason="Octave is not installed (octave-cli)")
needs_cc = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler (cc) is installed")
needs_r = pytest.mark.skipif(shutil.which("Rscript") is None, reason="R is not installed (Rscript)")
LANGUAGES = [
    pytest.param("m", marks=needs_octave),
    pytest.param("c", marks=needs_cc),
    pytest.param("R", marks=needs_r),
]
every = pytest.mark.parametrize("suffix", LANGUAGES)

PLACES = {"asym_2rss_ppap": (0.02, 0.03, 0.4), "planar_4rprp": (0.26, 0.25, 0.3)}

CLOSE = 1e-12
"""The issue's: other languages, the same table."""

Sample = tuple[object, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def samples(name: str, repository: Path) -> Sample:
    """A robot and random poses, rates, accelerations and forces."""
    rng = np.random.default_rng(len(name))
    robot = wb.load_mechanism(repository / "models" / f"{name}.xml")
    x = np.array(PLACES[name]) + 0.02 * rng.uniform(-1.0, 1.0, (40, 3))
    q, qd, qdd = robot.joint_motion(x, rng.normal(size=(40, 3)), 5.0 * rng.normal(size=(40, 3)))
    return robot, q, qd, qdd, 3.0 * rng.normal(size=(40, 3))


@pytest.fixture
def loaded() -> object:
    found: list[ForeignCandidate] = []

    def load(path: Path) -> ForeignCandidate:
        (one,) = load_candidates([path])
        assert isinstance(one, ForeignCandidate)
        found.append(one)
        return one

    yield load
    for one in found:
        one._formula.close()  # type: ignore[attr-defined]


Load = Callable[[Path], ForeignCandidate]


@every
@pytest.mark.parametrize("name", PLACES)
def test_the_papers_formulas_give_what_the_closed_forms_give(
    name: str, suffix: str, repository: Path, tmp_path: Path, loaded: Load
) -> None:
    robot, q, qd, qdd, force = samples(name, repository)
    wanted = robot.inverse_dynamics(q, qd, qdd, external_force=force)  # type: ignore[attr-defined]
    path = repository / "examples" / "languages" / f"{name}.{suffix}"
    formula = loaded(path)
    assert np.abs(formula(robot, q, qd, qdd, force) - wanted).max() < CLOSE * np.abs(wanted).max()
    assert formula.registration.bound == 1e-10
    # twin: one sign of the formula's source spoiled shows
    spoiled = tmp_path / path.name
    shutil.copy(path.with_name("exchange.R"), tmp_path)
    text = path.read_text(encoding="utf-8")
    mistake = {"asym_2rss_ppap": "- common", "planar_4rprp": "- z .* zd" if suffix == "m" else "- z * zd"}[name]
    assert mistake in text
    spoiled.write_text(text.replace(mistake, mistake.replace("-", "+")), encoding="utf-8")
    assert np.abs(loaded(spoiled)(robot, q, qd, qdd, force) - wanted).max() > 1e-3 * np.abs(wanted).max()


@every
def test_a_campaign_shows_the_same_table_for_every_language(suffix: str, repository: Path, tmp_path: Path) -> None:
    folder = repository / "examples" / "languages"
    files = [folder / "rrr.py", folder / f"rrr.{suffix}"]
    run = run_campaign(folder / "rrr.toml", tmp_path / "run", candidates=files, effort=Effort(budget=False))
    assert run.passed
    errors = {name: [r.peak_error for r in run.rows if r.candidate == name] for name in {r.candidate for r in run.rows}}
    python = errors.pop("rrr-python")
    (other,) = errors.values()
    assert len(python) == len(other) == 3
    assert np.abs(np.subtract(python, other)).max() < CLOSE


@needs_octave
@pytest.mark.parametrize(
    ("body", "line", "said"),
    [
        ("x = 1;\n  tau = qdd * undefined_thing;", 3, "undefined_thing"),
        ("tau = qdd *;", 2, "does not parse"),
        ("tau = NaN * qdd;", 1, "not finite"),
        ("tau = qdd(:, 1);", 1, "shape (40, 1)"),
        ("tau = 'no';", 1, "returns char"),
        ("tau = p.no_such * qdd;", 2, "no_such"),
    ],
)
def test_a_fault_in_octave_is_reported_with_its_line(
    body: str, line: int, said: str, repository: Path, tmp_path: Path, loaded: Load
) -> None:
    robot, q, qd, qdd, force = samples("planar_4rprp", repository)
    path = tmp_path / "wrong.m"
    path.write_text(f"function tau = wrong(p, q, qd, qdd)\n  {body}\nend\n", encoding="utf-8")
    with pytest.raises(CandidateError) as error:
        loaded(path)(robot, q, qd, qdd, force)
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    assert f"wrong.m:{line})" in str(error.value), str(error.value)


@needs_r
@pytest.mark.parametrize(
    ("body", "line", "said"),
    [
        ("x <- 1\ntorque <- function(a) {\n  a * undefined_thing\n}\ntorque(2)", 3, "'undefined_thing' not found"),
        ("x <- 1\ny <- nowhere + a_rather_long_name_that_makes_the_message_run_over", 2, "'nowhere' not found"),
        ("x <- 1\ny <- )", 2, "unexpected ')'"),
        ("files <- commandArgs(trailingOnly = TRUE)\nstop('no such branch')", None, "no such branch"),
    ],
)
def test_a_fault_in_r_is_reported_with_its_line(
    body: str, line: int | None, said: str, repository: Path, tmp_path: Path, loaded: Load
) -> None:
    robot, q, qd, qdd, force = samples("planar_4rprp", repository)
    path = tmp_path / 'a "folder"' / "wrong.R"
    path.parent.mkdir()
    path.write_text(body + "\n", encoding="utf-8")
    with pytest.raises(CandidateError) as error:
        loaded(path)(robot, q, qd, qdd, force)
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    assert (f"wrong.R:{line})" if line else "(wrong.R)") in str(error.value), str(error.value)


C_HEAD = (
    '#include <stdlib.h>\nconst char workbench_parameters[] = "a g";\n'
    "int wrong(const double *p, const double *q, const double *qd, const double *qdd, double *tau)\n{\n"
)


@needs_cc
@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("  volatile int *hole = 0;\n  tau[0] = *hole;\n  return 0;", "SIGSEGV"),
        ("  tau[0] = tau[1] = q[0];\n  return 0;", "not finite"),
        ("  return 7;", "returns 7"),
        ("  abort();", "SIGABRT"),
        ("  exit(0);", "exit code 0"),
    ],
)
def test_a_fault_in_c_ends_the_formula_and_nothing_else(
    body: str, said: str, repository: Path, tmp_path: Path, loaded: Load
) -> None:
    robot, q, qd, qdd, force = samples("planar_4rprp", repository)
    path = tmp_path / "wrong.c"
    path.write_text(f"{C_HEAD}{body}\n}}\n", encoding="utf-8")
    formula = loaded(path)
    with pytest.raises(CandidateError) as error:
        formula(robot, q, qd, qdd, force)
    assert said in str(error.value)
    if said == "SIGSEGV" and shutil.which("addr2line") and sys.platform == "linux":
        assert "wrong.c:6)" in str(error.value), str(error.value)
    else:
        assert "wrong.c:3)" in str(error.value), str(error.value)


@needs_cc
def test_c_that_does_not_compile_or_offers_nothing_is_refused(repository: Path, tmp_path: Path, loaded: Load) -> None:
    path = tmp_path / "wrong.c"
    path.write_text(f"{C_HEAD}  tau[0] = undefined;\n  return 0;\n}}\n", encoding="utf-8")
    with pytest.raises(SpecError, match=r"^wrong\.c:5: .undefined. undeclared"):
        load_candidates([path])
    path.write_text("int other(void) { return 0; }\n", encoding="utf-8")
    with pytest.raises(SpecError, match="no function wrong and no wrong_batch in it"):
        load_candidates([path])
    path.write_text("int wrong(void) { return 0; }\n", encoding="utf-8")
    with pytest.raises(SpecError, match="no workbench_parameters in it"):
        load_candidates([path])
    path.write_text(C_HEAD.replace("a g", "a gg") + "  return 0;\n}\n", encoding="utf-8")
    robot, *rest = samples("planar_4rprp", repository)
    with pytest.raises(CandidateError, match='no parameter "gg"'):
        loaded(path)(robot, *rest)  # type: ignore[arg-type]


PROGRAM = """#!{python}
import json, sys
p = json.load(open(sys.argv[1]))["parameters"]
rows = [line.split(",") for line in open(sys.argv[2]).read().split()[1:]]
with open(sys.argv[3], "w") as out:
    print("tau1,tau2,tau3", file=out)
    for row in rows:
        print(",".join(repr(p["m2"] * float(row[6 + k])) for k in range(3)), file=out)
{more}
"""


@pytest.mark.skipif(sys.platform == "win32", reason="programs there have other names")
@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("", ""),
        ("raise ValueError('no')", "ended with exit code 1: ValueError: no"),
        ("open(sys.argv[3], 'a').write('1,2\\n')", "its table: line 42: 2 cells; allowed: 3"),
        ("import os; os.remove(sys.argv[3])", "writes no table"),
    ],
)
def test_any_program_computes_torques(more: str, said: str, repository: Path, tmp_path: Path, loaded: Load) -> None:
    robot, q, qd, qdd, force = samples("planar_4rprp", repository)
    path = tmp_path / "formula"
    path.write_text(PROGRAM.format(python=sys.executable, more=more), encoding="utf-8")
    path.chmod(0o755)
    if not said:
        found = loaded(path)(robot, q, qd, qdd, force)
        assert np.array_equal(found, robot.values["m2"] * qdd)  # type: ignore[attr-defined]
        return
    with pytest.raises(CandidateError) as error:
        loaded(path)(robot, q, qd, qdd, force)
    assert said in str(error.value)


@needs_cc
def test_a_formula_that_never_ends_is_stopped(
    repository: Path, tmp_path: Path, loaded: Load, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("workbench.campaign.foreign_candidates.LIMIT_S", 1.0)
    robot, q, qd, qdd, force = samples("planar_4rprp", repository)
    path = tmp_path / "wrong.c"
    path.write_text(f"{C_HEAD}  for (volatile int k = 0;; k++);\n}}\n", encoding="utf-8")
    with pytest.raises(CandidateError, match="takes more than 1 s"):
        loaded(path)(robot, q, qd, qdd, force)


def test_what_a_comment_says_is_checked(tmp_path: Path) -> None:
    path = tmp_path / "f.c"
    path.write_text("/* workbench: { bond = 1e-3 } */\nint f(void) { return 0; }\n", encoding="utf-8")
    with pytest.raises(SpecError, match=r"f\.c:1: bond = 0\.001; allowed: name, reference, bound"):
        load_candidates([path])


@pytest.mark.parametrize(
    ("suffix", "wrongly"),
    [pytest.param("m", (True,), marks=needs_octave), pytest.param("c", (False, True), marks=needs_cc)],
)  # Octave takes long to start, time and again
def test_a_wrong_term_is_named_by_part_and_parameter(
    suffix: str, wrongly: tuple[bool, ...], repository: Path, tmp_path: Path
) -> None:
    """They are handed the force whether they look at it or not, which is no fault of the kinematics."""
    folder = tmp_path / "rrr"
    shutil.copytree(repository / "examples" / "languages", folder)
    file = folder / f"rrr.{suffix}"
    right = {"m": "p.m1 * p.g * p.l1 / 2", "c": "p[m1] * p[g] * p[l1] / 2"}[suffix]
    text = file.read_text(encoding="utf-8")
    assert text.count(right) == 1
    for twice in wrongly:
        wrong = right.removesuffix(" / 2") if twice else right
        said = "m1: x 2 in weight of tau_q1, tau_q2 and tau_q3" if twice else ""
        file.write_text(text.replace(right, wrong), encoding="utf-8")
        (found,) = wb.diagnose(folder / "rrr.toml", candidates=[file], mend=False)
        sentences = [finding.sentence for finding in found.findings]
        assert len(sentences) == bool(said)
        assert not said or said in sentences[0]
        assert any("external force" in note for note in found.not_covered)
