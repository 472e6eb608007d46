"""Diagnosis: mistakes that are planted are named; what is right is called right."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import workbench as wb
from small_campaign import Workbench
from workbench.diagnosis.edits import Edit
from workbench.diagnosis.entries import WRONG_MARK, Entry, floors_of, ratio_of, simple
from workbench.diagnosis.examine import diagnose_subject
from workbench.diagnosis.paper import lines_run, make_paper, splitting_of
from workbench.diagnosis.parts import INERTIA, VELOCITY, WEIGHT, Part, take_apart
from workbench.diagnosis.probes import ask, choose_poses, make_plan
from workbench.diagnosis.result import Diagnosis
from workbench.diagnosis.search import search_mends
from workbench.diagnosis.surface import subjects, write_mended
from workbench.diagnosis.trial import FIRST, Looks, Setup, Task, code_of

EXAMPLES = ("delta", "fourbar", "fivebar", "bricard", "orthoglide")


def spoiled(repository: Path, folder: Path, example: str, old: str, new: str) -> tuple[Path, Path]:
    """Campaign and formula of an example, with one place of the formula changed."""
    home = repository / "examples" / example
    text = (home / f"{example}.py").read_text(encoding="utf-8")
    assert text.count(old) == 1, old
    path = folder / f"{example}.py"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return home / f"{example}.toml", path


def diagnosed(campaign: Path, formula: Path, candidate: str | None = None) -> Diagnosis:
    (found,) = wb.diagnose(campaign, candidates=[formula], candidate=candidate, mend=False)
    return found


def wrong_entries(found: Diagnosis) -> set[tuple[str, str]]:
    return {(e.part.label(found.joints), found.joints[e.joint]) for e in found.wrong}


@pytest.mark.parametrize("example", EXAMPLES)
def test_right_formulas_have_no_findings(repository: Path, example: str) -> None:
    home = repository / "examples" / example
    for subject in subjects(home / f"{example}.toml", candidates=[home / f"{example}.py"]):
        if subject.candidate in ("codourey", "two_points"):
            continue  # these are measured for what they leave out
        found, _ = diagnose_subject(subject)
        assert found.right, found
        assert found.digits >= 9


def test_a_weight_with_a_lost_factor_is_named_by_mass(repository: Path, tmp_path: Path) -> None:
    places = spoiled(repository, tmp_path, "delta", "p.ma / 2 * (tangent @ weight)", "p.ma * (tangent @ weight)")
    found = diagnosed(*places, "exact")
    assert wrong_entries(found) == {("weight", joint) for joint in ("q1", "q2", "q3")}
    (finding,) = (f for f in found.findings if f.parameters)
    assert finding.parameters == ("ma",)
    assert finding.ratio == "x 2"
    assert "weight" in finding.sentence


def test_a_wrong_inertia_is_named_by_inertia_and_column(repository: Path, tmp_path: Path) -> None:
    places = spoiled(repository, tmp_path, "delta", "(p.Ia + p.ma * p.a**2 / 4)", "(-p.Ia + p.ma * p.a**2 / 4)")
    found = diagnosed(*places, "exact")
    assert wrong_entries(found) == {("q1''", "q1"), ("q2''", "q2"), ("q3''", "q3")}
    assert {name for f in found.findings for name in f.parameters} == {"Ia"}
    assert any(f.ratio == "x -1" for f in found.findings)


def test_a_lost_sign_in_the_velocity_terms_is_there_and_nowhere_else(repository: Path, tmp_path: Path) -> None:
    old = "elbow_acceleration = tangent * qdd[..., None] + normal"
    places = spoiled(repository, tmp_path, "delta", old, old.replace("+ normal", "- normal"))
    found = diagnosed(*places, "exact")
    assert wrong_entries(found)
    assert all("^2" in part for part, _ in wrong_entries(found))
    # and the formula alone shows it, without a reference
    assert any("Mdot - 2 C" in f.sentence for f in found.findings)


def test_kinematics_come_first(repository: Path, tmp_path: Path) -> None:
    old = "xdd = np.linalg.solve(leg, dot(leg, slider)"
    places = spoiled(
        repository,
        tmp_path,
        "orthoglide",
        "np.linalg.solve(leg, dot(leg, SLIDE) *",
        "np.linalg.solve(leg, dot(leg, -SLIDE) *",
    )
    assert old in places[1].read_text()
    found = diagnosed(*places, "exact")
    assert found.findings[0].kind == "kinematics"
    assert found.findings[0].joints == ("q1", "q2", "q3")
    assert "x -1" in found.findings[0].sentence


def test_numbers_that_are_equal_in_this_robot_are_told_apart(repository: Path, tmp_path: Path) -> None:
    """Both cranks of the five-bar weigh the same: only varying their masses tells a wrong name."""
    places = spoiled(repository, tmp_path, "fivebar", "((p.m1, p.m2)[limb]", "((p.m1, p.m1)[limb]")
    found = diagnosed(*places)
    assert not found.right
    assert "m1" in {name for f in found.findings for name in f.parameters}
    assert not found.wrong  # with this robot's own numbers nothing shows


def test_a_parameter_that_is_never_read_is_said_to_be_missing(repository: Path, tmp_path: Path) -> None:
    found = diagnosed(
        *spoiled(repository, tmp_path, "delta", "force = p.mp * (x + weight) + at", "force = at"), "exact"
    )
    assert {name for f in found.findings for name in f.parameters} == {"mp"}
    assert all(f.ratio == "missing" for f in found.findings if f.parameters)


def test_single_precision_is_noise_and_no_wrong_term(repository: Path, tmp_path: Path) -> None:
    old = "    return arm + (tangent * at_elbow)"
    new = "    arm = arm.astype(np.float32).astype(float)\n" + old
    found = diagnosed(*spoiled(repository, tmp_path, "delta", old, new), "exact")
    assert not [f for f in found.findings if f.kind == "dynamics"], found
    assert any("noisy" in note for note in found.not_covered)


def test_rounded_constants_are_said_to_be_numbers(repository: Path, tmp_path: Path) -> None:
    found = diagnosed(*spoiled(repository, tmp_path, "delta", "p.ma / 2 * (", "p.ma * 0.49999 * ("), "exact")
    assert not found.right
    # one factor alone is off by 2e-5: the parameter is named, or it is called a matter of digits; never silence
    assert found.findings[0].kind in ("numeric", "dynamics")


def test_a_formula_that_fails_at_rest_is_diagnosed_from_motion(repository: Path, tmp_path: Path) -> None:
    old = "    return arm + (tangent * at_elbow)"
    new = "    arm = arm + 0 * np.where((qd == 0).all(axis=1), np.nan, 0)[:, None]\n" + old
    found = diagnosed(*spoiled(repository, tmp_path, "delta", old, new), "exact")
    assert found.findings[0].kind == "failure"
    assert "at rest" in found.findings[0].sentence
    # what it answers in motion is all right, the weight too
    assert not found.wrong
    weight = [e for e in found.entries if e.part == Part(WEIGHT)]
    assert {e.status for e in weight} == {"right"}


def test_a_formula_without_parameters_says_so(repository: Path, tmp_path: Path) -> None:
    path = tmp_path / "own.py"
    path.write_text(
        "import numpy as np\nimport workbench\n\n\n@workbench.candidate('own', bound=1e-9)\n"
        "def own(p, q, qd, qdd):\n    return 0.3 * qdd + np.cos(q)\n"
    )
    found = diagnosed(repository / "examples" / "delta" / "delta.toml", path)
    assert not found.right
    assert any("reads no parameters" in note for note in found.not_covered)


def test_ratios_are_simple_fractions() -> None:
    wanted = np.array([1.0, -2.0, 3.0])
    assert ratio_of(-wanted / 2, wanted) == -0.5
    assert ratio_of(0 * wanted, wanted) == 0
    assert ratio_of(wanted + np.array([0.1, 0.0, 0.0]), wanted) is None
    assert str(simple(0.75)) == "3/4"
    assert isinstance(simple(0.7512345), float)


def test_take_apart_gives_back_what_a_polynomial_is_made_of(repository: Path) -> None:
    home = repository / "examples" / "delta"
    subject = subjects(home / "delta.toml", candidates=[home / "delta.py"], candidate="exact")[0]
    plan = make_plan(subject, choose_poses(subject, 4))
    _, qd, qdd, _ = plan.flat()
    rng = np.random.default_rng(1)
    mass, weight, product = rng.normal(size=(3, 3)), rng.normal(size=3), rng.normal(size=3)
    tau = qdd @ mass.T + weight + (qd[:, 0] * qd[:, 1])[:, None] * product
    parts = take_apart(plan, tau.reshape(plan.q.shape), False)
    assert np.allclose(parts[Part(WEIGHT)], weight)
    assert np.allclose(parts[Part(INERTIA, (1,))], mass[:, 1] * plan.accelerations[1])
    assert np.allclose(parts[Part(VELOCITY, (0, 1))], product * plan.rates[0] * plan.rates[1])
    assert np.abs(parts[Part(VELOCITY, (0, 0))]).max() < 1e-9
    # what is cubic in a rate shows as what no mechanism has
    odd = take_apart(plan, (tau + qd**3).reshape(plan.q.shape), False)
    assert max(np.abs(v).max() for p, v in odd.items() if p.kind == "remainder") > 1e-3
    # the search's matrix splits alike
    matrix = splitting_of(plan, False)
    rows = np.einsum("pk,ksn->psn", matrix, tau.reshape(plan.q.shape))
    assert np.allclose(rows[0], weight)
    assert np.abs(rows[-1]).max() < 1e-9


def test_poses_are_no_special_ones(repository: Path) -> None:
    """In simulation 1 of the paper q2 = q3 at all times; the diagnosis does not stay there."""
    subject = subjects(repository / "campaigns" / "almeida_2010.toml", candidate="lumped-appendix")[0]
    assert np.abs(subject.case.motion.q[:, 1] - subject.case.motion.q[:, 2]).max() < 1e-12
    poses = choose_poses(subject, 12)
    assert np.abs(poses[:, 1] - poses[:, 2]).min() > 1e-4
    assert np.array_equal(poses, choose_poses(subject, 12))


def test_misprints_are_named_joint_by_joint(repository: Path) -> None:
    campaign = repository / "campaigns" / "almeida_2010.toml"
    (found,) = wb.diagnose(
        campaign, candidates=[repository / "examples" / "misprints" / "appendix_as_printed.py"], mend=False
    )
    first = found.findings[0]
    assert first.kind == "kinematics"
    assert "entry 3 of J_q" in first.sentence
    assert ("q1''", "q1") in wrong_entries(found)


def test_an_edit_that_mends_everything_scores_complete(repository: Path, tmp_path: Path) -> None:
    campaign, path = spoiled(repository, tmp_path, "delta", "p.ma / 2 * (", "p.ma * (")
    subject = subjects(campaign, candidates=[path], candidate="exact")[0]
    _, seen = diagnose_subject(subject)
    paper = make_paper(subject, seen)
    wrong = path.read_text()
    right = (repository / "examples" / "delta" / "delta.py").read_text()
    work = Setup(paper)()
    before, after, broken = work(Task((wrong, right, "def broken(:")))
    endless = work(Task(("while True: pass",), FIRST))[0]
    assert before is not None
    assert after is not None
    assert after.complete
    assert not before.complete
    assert after.right > before.right
    assert broken is None
    assert endless is None
    lines = lines_run(subject, seen.plan)
    assert lines is not None
    assert len(lines) > 20


def test_edits_are_looked_at_as_files_where_two_names_share_one_array(repository: Path, tmp_path: Path) -> None:
    """Statement by statement, with copies, such a formula gives something else: that is noticed, and not used."""
    old = "    return arm + (tangent * at_elbow)"
    campaign, path = spoiled(repository, tmp_path, "delta", old, "    same = arm\n    same *= 0.5\n" + old)
    subject = subjects(campaign, candidates=[path], candidate="exact")[0]
    _, seen = diagnose_subject(subject)
    paper, text = make_paper(subject, seen), path.read_text()
    exam = replace(paper.exams[0], values=SimpleNamespace(**vars(subject.values({}))))
    looks = Looks(replace(paper, exams=(exam,)))
    assert looks.recorded(text) is None
    place = text.index("0.5")
    found = looks.score(text, Edit(place, place + 3, "1.0", 0, 1))
    assert found is not None
    assert found.base.all()
    plain = looks.recorded((repository / "examples" / "delta" / "delta.py").read_text())
    assert plain is not None


@pytest.mark.long
def test_the_search_finds_the_lost_factor(repository: Path, tmp_path: Path) -> None:
    campaign, path = spoiled(repository, tmp_path, "delta", "+ p.ma / 2 * (tangent", "- p.ma / 2 * (tangent")
    subject = subjects(campaign, candidates=[path], candidate="exact")[0]
    _, seen = diagnose_subject(subject)
    found, notes = search_mends(subject, seen, 600.0, 2)
    assert found, notes
    assert found[0].left == 0
    assert found[0].after.strip() in (repository / "examples" / "delta" / "delta.py").read_text()


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


def test_the_command_line_says_and_counts_findings(repository: Path, tmp_path: Path, workbench: Workbench) -> None:
    campaign, path = spoiled(repository, tmp_path, "delta", "p.ma / 2 * (", "p.ma * (")
    call = ("diagnose", campaign, "--candidates", path, "--candidate", "exact", "--no-mend", "--json", "found.json")
    done = workbench(*call)
    assert done.code == 1
    assert "ma: x 2 in weight" in " ".join(done.out.split())
    data = json.loads((tmp_path / "found.json").read_text())
    os.mkfifo(tmp_path / "pipe")  # a device or a pipe is not replaced: as root this took /dev/null from the system
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)  # who writes into it does not wait for ever
    for option in ("--json", "--apply"):
        done = workbench("diagnose", campaign, "--candidates", path, option, "pipe")
        assert (done.code, "pipe: is no regular file; name a file" in done.err) == (2, True), done
    assert os.read(reader, 1) == b""
    os.close(reader)
    assert (tmp_path / "pipe").is_fifo()
    assert data["format"] == 1
    assert data["diagnoses"][0]["findings"][0]["parameters"] == ["ma"]
    right = repository / "examples" / "delta" / "delta.py"
    done = workbench("diagnose", campaign, "--candidates", right, "--candidate", "exact")
    assert done.code == 0
    assert "Nothing is wrong" in done.out
    assert workbench("diagnose", campaign, "--candidates", right, "--candidate", "exakt").code == 2


def test_a_failing_run_says_what_is_wrong(repository: Path, tmp_path: Path, workbench: Workbench) -> None:
    campaign, path = spoiled(repository, tmp_path, "fourbar", "+ 1j * p.g)", "- 1j * p.g)")
    done = workbench("run", campaign, "--candidates", path, "--quick", "--out", "out", "--only", "slow")
    assert done.code == 1
    assert "weight in tau_crank: x -1" in " ".join(done.out.split())
    assert "workbench diagnose" in done.out
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["diagnosis"]["loop-vector"]["findings"]


def test_terms_add_up_to_the_torque(repository: Path) -> None:
    frame = wb.terms(repository / "examples" / "fourbar" / "fourbar.toml", case="slow")
    total = frame.groupby(["t", "joint"], sort=True)["torque"].sum()
    subject = subjects(
        repository / "examples" / "fourbar" / "fourbar.toml",
        candidates=[repository / "examples" / "fourbar" / "fourbar.py"],
    )[0]
    motion = subject.case.motion
    tau = subject.torques_of_reference(motion.q, motion.qd, motion.qdd, np.zeros((len(motion.t), 3)), {})
    assert np.abs(total.to_numpy() - tau[:, 0]).max() < 1e-12 * np.abs(tau).max()
    assert set(frame["part"]) >= {"weight", "acceleration", "velocity"}
    assert frame.attrs["units"]["torque"] == {"crank": "N m"}


def test_entries_know_their_digits() -> None:
    assert Entry(Part(WEIGHT), 0, WRONG_MARK, 1e-3, 1.0, None).digits == 3
    assert floors_of({Part(WEIGHT): np.array([[1.0, -2.0]])}).tolist() == [1.0, 2.0]


def test_apply_writes_a_copy_that_is_right_and_never_the_file_itself(
    repository: Path, tmp_path: Path, workbench: Workbench, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign, path = spoiled(repository, tmp_path, "fourbar", "+ 1j * p.g)", "- 1j * p.g)")
    wrong, copy = path.read_text(encoding="utf-8"), tmp_path / "mended.py"
    found: list[Diagnosis] = []

    def kept(diagnosis: Diagnosis, to: Path) -> None:
        found.append(diagnosis)
        write_mended(diagnosis, to)

    monkeypatch.setattr("workbench.diagnosis.surface.write_mended", kept)
    done = workbench("diagnose", campaign, "--candidates", path, "--jobs", "1", "--apply", copy)
    assert done.code == 1  # the formula that was asked about is as wrong as before
    assert "mended copy" in done.out
    assert path.read_text(encoding="utf-8") == wrong
    right = (repository / "examples" / "fourbar" / "fourbar.py").read_text(encoding="utf-8")
    assert copy.read_text(encoding="utf-8") == right
    (diagnosis,) = found
    with pytest.raises(wb.WorkbenchError, match="own file"):
        write_mended(diagnosis, path)
    assert path.read_text(encoding="utf-8") == wrong
    # of a right formula there is nothing to apply
    other = tmp_path / "other.py"
    done = workbench("diagnose", campaign, "--candidates", copy, "--apply", other)
    assert done.code == 2
    assert not other.exists()


def test_an_iteration_that_does_not_converge_is_said_first(repository: Path, tmp_path: Path) -> None:
    home = repository / "examples" / "rrr"
    text = (home / "rrr.py").read_text(encoding="utf-8")
    path = tmp_path / "rrr.py"
    path.write_text(text.replace("- p.l2**2)", "+ p.l2**2)"), encoding="utf-8")
    found = diagnosed(home / "rrr.toml", path, "exact")
    first = found.findings[0]
    assert first.kind == "kinematics"
    assert "does not converge" in " ".join([first.sentence, *found.not_covered])
    assert ("weight", "q1") in wrong_entries(found)
    path.write_text(text, encoding="utf-8")
    assert diagnosed(home / "rrr.toml", path, "exact").right


def test_a_wrong_mass_is_named_through_single_precision(repository: Path, tmp_path: Path) -> None:
    text = (repository / "examples" / "delta" / "delta.py").read_text(encoding="utf-8")
    text = text.replace("force = p.mp *", "force = 1.2 * p.mp *")
    old = "    return arm + (tangent * at_elbow)"
    path = tmp_path / "delta.py"
    path.write_text(text.replace(old, "    arm = arm.astype(np.float32).astype(float)\n" + old), encoding="utf-8")
    found = diagnosed(repository / "examples" / "delta" / "delta.toml", path, "exact")
    (finding,) = found.findings
    assert finding.parameters == ("mp",)
    assert finding.ratio == "x 6/5"
    assert any("noisy" in note for note in found.not_covered)


def test_parts_are_told_apart_where_no_state_at_rest_is_answered(repository: Path, tmp_path: Path) -> None:
    """Six columns, of accelerations and of the force, come from states with everything at once."""
    home = repository / "examples" / "orthoglide"
    text = (home / "orthoglide.py").read_text(encoding="utf-8")
    old = "    near, far, cross = masses\n"
    assert text.count(old) == 1
    text = text.replace(
        old, old + "    if (np.abs(qd).sum(axis=1) == 0).any():\n        raise ZeroDivisionError('no rate')\n"
    )
    path = tmp_path / "orthoglide.py"
    path.write_text(text.replace("moved = (p.mp + 3", "moved = (2 * p.mp + 3"), encoding="utf-8")
    found = diagnosed(home / "orthoglide.toml", path, "exact")
    failing, wrong = found.findings
    assert failing.kind == "failure"
    assert "ZeroDivisionError" in failing.sentence
    assert wrong.parameters == ("mp",)
    assert wrong.ratio == "x 2"
    assert {"q1''", "q2''", "q3''"} <= set(wrong.parts)
    forces = [e for e in found.entries if e.part.kind == "external force"]
    assert {e.status for e in forces} <= {"right", "none"}
    assert any("states at rest" in note for note in found.not_covered)


def test_a_number_in_place_of_a_parameter_names_the_parameter(repository: Path, tmp_path: Path) -> None:
    found = diagnosed(*spoiled(repository, tmp_path, "delta", "force = p.mp * (x", "force = 1.0 * (x"), "exact")
    (finding,) = found.findings
    assert finding.parameters == ("mp",)
    assert finding.ratio == "x 5/2"


def test_poses_and_probes_at_which_a_formula_fails_stay_unknown(repository: Path) -> None:
    home = repository / "examples" / "delta"
    subject = subjects(home / "delta.toml", candidates=[home / "delta.py"], candidate="exact")[0]
    plan = make_plan(subject, choose_poses(subject, 5))
    bad, calls = plan.poses[2], []

    def torques(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, force: np.ndarray) -> np.ndarray:
        calls.append(len(q))
        if (q == bad).all(axis=1).any():
            raise wb.WorkbenchError("not here")
        if (np.abs(qdd).sum(axis=1) > 0).any() and (qd == 0).all(axis=1).any():
            raise wb.WorkbenchError("not at rest")
        return q + qdd

    tau, failures = ask(plan, torques)
    accelerating = [label[0] == "acceleration" for label in plan.labels]
    known = np.isfinite(tau).all(axis=2)
    assert not known[:, 2].any()
    assert not known[accelerating].any()
    assert known[~np.array(accelerating)][:, [0, 1, 3, 4]].all()
    assert set(failures.values()) == {"not here"}  # what each probe says first
    assert len(calls) < 2 * plan.q.shape[0] * plan.q.shape[1]
    whole, none = ask(plan, lambda q, qd, qdd, force: q + qdd)
    assert np.isfinite(whole).all()
    assert not none


def test_sources_compiled_statement_by_statement_are_the_same() -> None:
    text = (
        '"""Text\nat the margin."""\nimport math\n\nif math.pi > 3:\n    A = 2\nelse:\n    A = 3\n\n\n'
        "def double(f):\n    return lambda x: 2 * f(x)\n\n\n@double\ndef one(x):\n    return A * x\n\n\n"
        "B = [\n    1,\n]\n"
    )
    plain = text.replace('"""Text\nat the margin."""\n', "").replace("else:\n    A = 3\n", "")
    for source in (text, plain):
        space: dict[str, object] = {}
        for code in code_of(source, "file.py"):
            exec(code, space)
        assert space["one"](3) == 12  # type: ignore[operator]
        assert space["B"] == [1]
    assert len(code_of(plain, "file.py")) > 3
    first = code_of(plain, "file.py")
    second = code_of(plain.replace("A * x", "A + x"), "file.py")
    assert [a is b for a, b in zip(first, second, strict=True)].count(False) == 1
    with pytest.raises(SyntaxError):
        code_of("def broken(:", "file.py")


@pytest.mark.slow
@pytest.mark.parametrize(
    "mistakes",
    [
        {"(p.R - p.r + p.a * cos)": "(p.R + p.r + p.a * cos)", "centre[:, 0] + middle -": "centre[:, 0] - middle -"},
        {"p.Ia + p.ma * p.a**2 / 4": "p.Ia - p.ma * p.a**2 / 4", "cross * elbow + (far": "cross * elbow - (far"},
    ],
    ids=["each spoils everything", "in parts of their own"],
)
def test_mistakes_are_put_back_one_after_the_other(repository: Path, tmp_path: Path, mistakes: dict[str, str]) -> None:
    home, path = repository / "examples" / "delta", tmp_path / "delta.py"
    text = (home / "delta.py").read_text(encoding="utf-8")
    for right, wrong in mistakes.items():
        assert text.count(right) == 1
        text = text.replace(right, wrong)
    path.write_text(text, encoding="utf-8")
    subject = subjects(home / "delta.toml", candidates=[path], candidate="exact")[0]
    _, seen = diagnose_subject(subject)
    found, notes = search_mends(subject, seen, 600.0, 1)
    steps = sorted({s.step for s in found})
    assert steps == list(range(1, len(mistakes) + 1)), notes
    assert found[-1].left == 0
    mended = tmp_path / "mended.py"
    mended.write_text(next(s for s in found if s.step == steps[-1]).text, encoding="utf-8")
    assert diagnosed(home / "delta.toml", mended, "exact").right
