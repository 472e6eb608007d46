"""A studio without its page: what is set, followed, refused, undone, compared, and made reproducible."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from workbench.campaign.cases import resolve_cases
from workbench.campaign.compare import compute_case
from workbench.campaign.spec import Campaign, CaseSpec, load_campaign
from workbench.capabilities.load import load_robot
from workbench.errors import OutputError, ParameterError, SpecError
from workbench.studio import words
from workbench.studio.knobs import knobs_of
from workbench.studio.motions import SAMPLES, scaled, scaled_spec, thinned_spec
from workbench.studio.outcome import ERRORS_ONLY, compute
from workbench.studio.reachable import reach_of
from workbench.studio.reproduce import (
    campaign_case,
    csv_of,
    grouped,
    model_changes,
    model_diff,
    set_command,
    write_copy,
)
from workbench.studio.session import NOTHING, STEP, Session
from workbench.studio.slices import planes_of, slice_of
from workbench.studio.state import History, State
from workbench.studio.subject import Subject, open_subject

REPOSITORY = Path(__file__).resolve().parents[1]
DELTA = REPOSITORY / "examples" / "delta"
CASE = "pick_and_place"
"""of the first paper's campaign: a motion of the platform, which longer arms can follow"""


@pytest.fixture(scope="module")
def paper() -> Subject:
    return open_subject("asym_2rss_ppap")


@pytest.fixture(scope="module")
def delta() -> Subject:
    return open_subject(str(DELTA), candidates=[str(DELTA / "delta.py")])


@pytest.fixture
def session(paper: Subject) -> Session:
    return Session(paper, CASE)


# what is shown is what a campaign computes


def test_the_page_shows_the_numbers_of_a_campaign_with_the_same_settings(session: Session) -> None:
    session.set("a1", 0.23)
    session.set("m2", 0.15)
    session.set("payload", 1.0)
    shown = session.compute()
    assert shown is not None
    campaign, file = load_campaign("almeida_2010")
    thin = campaign.model_copy(update={"case": [thinned_spec(next(c for c in campaign.case if c.name == CASE))]})
    settings = {"a1": 0.23, "m2": 0.15, "payload": 1.0}
    case = resolve_cases(thin, file, settings=settings)[0]
    run = compute_case(thin, case, ERRORS_ONLY)
    for joint, name in enumerate(case.robot.joints):
        np.testing.assert_array_equal(shown.references["distributed"][:, joint], run.series[f"ref_distributed_{name}"])
        np.testing.assert_array_equal(shown.formulas["lumped"][:, joint], run.series[f"cand_lumped_{name}"])
    assert [(r.candidate, r.joint, r.peak_error) for r in shown.rows] == [
        (r.candidate, r.joint, r.peak_error) for r in run.rows
    ]
    spoiled = resolve_cases(thin, file, settings=settings | {"m2": 0.3})[0]
    other = compute_case(thin, spoiled, ERRORS_ONLY)
    assert np.abs(shown.formulas["lumped"][:, 0] - other.series["cand_lumped_q1"]).max() > 0.01


def test_a_bar_follows_its_mass_and_length_unless_its_inertia_is_set(session: Session) -> None:
    session.set("m2", 0.6)
    assert session.values()["I2_left"] == pytest.approx(0.6 * 0.3**2 / 12, rel=1e-15)
    session.set("I2", 1e-3)
    session.set("m2", 0.7)
    assert session.values()["I2_left"] == 1e-3
    session.reset("I2")
    assert session.values()["I2_left"] == pytest.approx(0.7 * 0.3**2 / 12, rel=1e-15)


def test_an_inertia_that_is_set_with_its_mass_is_what_was_set(session: Session) -> None:
    own = session.values()["I2_left"]
    session.set_many({"I2": own, "m2": 0.6})
    assert session.values()["I2_left"] == own
    assert session.values()["m2_left"] == 0.6


def test_setting_what_the_case_has_is_no_change(session: Session) -> None:
    session.set("a1", 0.21)
    session.set("a1", 0.2)
    assert session.wanted.changes == {}
    assert not session.wanted.changed


# what is refused, and the last good state


def test_what_is_out_of_reach_is_said_and_the_last_good_state_stays(session: Session) -> None:
    good = session.good
    session.set("a2", 0.16)
    assert session.compute() is None
    assert session.problem is not None
    assert "out of reach" in session.problem
    assert session.good is good
    assert session.stale
    assert "last state that works" in words.head(session)
    session.history.undo()
    assert session.compute() is not None
    assert session.problem is None
    assert not session.stale


@pytest.mark.parametrize(("name", "value"), [("a1", -0.1), ("a1", float("nan")), ("a3", 0.1)])
def test_a_value_that_may_not_be_is_refused_before_it_is_asked_for(session: Session, name: str, value: float) -> None:
    before = session.wanted
    with pytest.raises(ParameterError, match=name):
        session.set(name, value)
    assert session.wanted is before


def test_an_unknown_case_is_refused(paper: Subject) -> None:
    with pytest.raises(ParameterError, match="did you mean"):
        Session(paper, "simulation_l")


def test_factors_on_the_motion_have_limits(session: Session) -> None:
    with pytest.raises(ParameterError, match=r"0\.05 to 20"):
        session.move(speed=0.0)


# undo


def test_a_drag_is_one_step_back() -> None:
    history = History(State("one"))
    for value in (1.0, 2.0, 3.0):
        history.change("a", changes={"a": value})
    history.settle()
    history.change("a", changes={"a": 4.0})
    assert history.undo().changes == {"a": 3.0}
    assert history.undo() == State("one")
    assert history.undo() == State("one")
    assert history.redo().changes == {"a": 3.0}
    history.change(None, changes={"b": 1.0})
    assert history.after is None


def test_back_to_the_file_can_be_undone(session: Session) -> None:
    session.set("m2", 0.5)
    session.move(speed=2.0)
    session.back_to_file()
    assert not session.wanted.changed
    assert session.history.undo().changes == {"m2_left": 0.5, "m2_right": 0.5}
    assert session.wanted.speed == 2.0


# what it is compared with


def test_the_ghost_is_the_file_s_robot_on_the_same_motion(session: Session) -> None:
    session.move(speed=2.0)
    session.set("m3", 0.9)
    session.compute()
    ghost = session.baseline()
    assert ghost is not None
    assert ghost.state.changes == {}
    assert ghost.state.speed == 2.0
    np.testing.assert_array_equal(ghost.t, session.good.t)
    assert ghost.peak_torques()[1].value < session.good.peak_torques()[1].value
    session.against = STEP
    before = session.baseline()
    assert before is not None
    assert before.state == session.history.before
    session.against = NOTHING
    assert session.baseline() is None


# motions


@pytest.mark.parametrize("case", ["simulation_1", "unequal_arms", CASE])
def test_a_motion_twice_as_fast_passes_the_same_places(paper: Subject, case: str) -> None:
    state = Session(paper, case).wanted
    slow, fast = (compute(paper, State(case, speed=speed, rows=state.rows)) for speed in (1.0, 2.0))
    q = slow.case.motion.q
    np.testing.assert_allclose(fast.case.motion.q, q, atol=1e-12 + 1e-9 * np.abs(q).max())
    np.testing.assert_allclose(2.0 * fast.t, slow.t, atol=1e-12)
    qd = slow.case.motion.qd
    np.testing.assert_allclose(fast.case.motion.qd, 2 * qd, atol=1e-9 * np.abs(qd).max())
    qdd = slow.case.motion.qdd
    np.testing.assert_allclose(fast.case.motion.qdd, 4 * qdd, atol=1e-8 * np.abs(qdd).max())


def test_a_table_is_scaled_about_its_first_sample() -> None:
    from workbench.motion import JointMotion

    t = np.linspace(0.0, 1.0, 801)
    motion = JointMotion(t, np.sin(t)[:, None] + 1, np.cos(t)[:, None], -np.sin(t)[:, None])
    found = scaled(motion, 0.5, 2.0)
    assert isinstance(found, JointMotion)
    assert len(found.t) == 267
    np.testing.assert_allclose(found.q[:, 0], 1 + 0.5 * np.sin(2 * found.t), atol=1e-14)
    np.testing.assert_allclose(found.qd[:, 0], np.cos(2 * found.t), atol=1e-14)
    np.testing.assert_allclose(found.qdd[:, 0], -2 * np.sin(2 * found.t), atol=1e-14)


def test_samples_are_thinned_over_the_same_time(session: Session) -> None:
    assert len(session.good.t) == SAMPLES
    assert session.good.whole == 401
    assert f"{SAMPLES} of the case&#x27;s 401 samples" in words.head(session)


# sliders


def test_sliders_hold_the_value_and_stay_within_what_is_allowed() -> None:
    for robot in (load_robot("asym_2rss_ppap"), load_robot("planar_4rprp"), load_robot(DELTA)):
        values, infos = robot.values, robot.description.table.infos
        knobs = knobs_of(robot)
        assert {name for knob in knobs for name in knob.members} == set(infos)
        for knob in knobs:
            assert knob.low <= knob.value(values) <= knob.high, knob
            assert knob.low < knob.high
            for name in knob.members:
                info = infos[name]
                assert knob.low > info.minimum or (info.minimum_allowed and knob.low == info.minimum), knob
        bodies = {knob.name: knob.body for knob in knobs}
        assert bodies["g"] == "world"


def test_a_length_belongs_to_the_body_that_is_so_long() -> None:
    bodies = {knob.name: knob.body for knob in knobs_of(load_robot("asym_2rss_ppap"))}
    assert bodies["a1"] == bodies["m1"] == "arm"
    assert bodies["a2"] == bodies["m2"] == "rod"


def test_the_reach_of_a_slider_ends_where_the_motion_leaves_the_robot(session: Session) -> None:
    low, high = session.reach("a2")
    knob = session.knob("a2")
    assert knob.low < low < 0.3 < high <= knob.high
    session.set("a2", low)
    assert session.compute() is not None, session.problem
    session.set("a2", low - 0.06 * (0.3 - knob.low))
    assert session.compute() is None
    assert session.reach("m2") == (session.knob("m2").low, session.knob("m2").high)


def test_the_search_for_reach_stops_when_asked() -> None:
    tried = []

    def feasible(value: float) -> bool:
        tried.append(value)
        return value < 0.7

    low, high = reach_of(0.5, 0.0, 1.0, feasible)
    assert low == 0.0
    assert 0.69 < high < 0.7
    tried.clear()
    assert reach_of(0.5, 0.0, 1.0, feasible, lambda: True) == (0.5, 0.5)
    assert tried == []


# reproducible


def test_the_command_says_the_same_robot(session: Session) -> None:
    session.set("a1", 0.23)
    session.set("m2_left", 0.15)
    session.compute()
    command = set_command(session)
    assert command == f"workbench run almeida_2010 --only {CASE} --set a1=0.23 --set m2_left=0.15"
    session.move(speed=2.0)
    session.compute()
    with pytest.raises(OutputError, match="motion was changed"):
        set_command(session)


def test_the_case_gives_the_same_torques(session: Session) -> None:
    session.set("a1", 0.23)
    session.move(speed=1.5, amplitude=0.8)
    shown = session.compute()
    assert shown is not None
    text, files = campaign_case(session, "found")
    assert files == {}
    document = tomllib.loads(text)["case"][0]
    case = CaseSpec.model_validate(document)
    campaign, file = load_campaign("almeida_2010")
    grown = campaign.model_copy(update={"case": [thinned_spec(case)], "claim": [], "figure": []})
    run = compute_case(grown, resolve_cases(grown, file)[0], ERRORS_ONLY)
    np.testing.assert_array_equal(run.series["ref_distributed_q2"], shown.references["distributed"][:, 1])
    assert 'title = "pick_and_place with a1 = 0.23' in text


def test_a_table_s_case_brings_its_table(tmp_path: Path) -> None:
    campaign = (DELTA / "delta.toml").read_text(encoding="utf-8").replace("robot.toml", "delta/robot.toml")
    folder = tmp_path / "delta"
    folder.mkdir()
    for file in ("delta.xml", "delta.py", "robot.toml"):
        (folder / file).write_bytes((DELTA / file).read_bytes())
    t = np.linspace(0.0, 1.0, 101)
    rows = np.column_stack([t, 0.2 + 0.2 * np.sin(2 * t), 0.3 + 0.2 * np.sin(3 * t), 0.25 + 0.2 * np.sin(t)])
    np.savetxt(tmp_path / "m.csv", rows, delimiter=",", header="t,q1,q2,q3", comments="", fmt="%.17g")
    head = campaign.partition("[[case]]")[0]
    (tmp_path / "c.toml").write_text(
        head + '[[case]]\nname = "t"\nmotion = { kind = "csv", file = "m.csv" }\n', encoding="utf-8"
    )
    session = Session(open_subject(str(tmp_path / "c.toml")))
    session.move(speed=2.0, amplitude=0.5)
    shown = session.compute()
    assert shown is not None
    text, files = campaign_case(session, "found")
    for name, content in files.items():
        (tmp_path / name).write_text(content, encoding="utf-8")
    (tmp_path / "d.toml").write_text(head + text, encoding="utf-8")
    again = Session(open_subject(str(tmp_path / "d.toml")))
    np.testing.assert_allclose(again.good.tau, shown.tau, atol=1e-12)


def test_groups_stand_for_equal_members() -> None:
    table = load_robot("asym_2rss_ppap").description.table
    assert grouped(table, {"m3": 1.0, "a1_left": 0.2, "a1_right": 0.2}) == {"m3": 1.0, "a1": 0.2}
    assert grouped(table, {"a1_left": 0.2, "a1_right": 0.3}) == {"a1_left": 0.2, "a1_right": 0.3}
    assert grouped(table, {"a1_left": 0.2}) == {"a1_left": 0.2}


def test_a_copy_holds_what_was_shown_and_replaces_nothing(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OutputError, match="nothing is changed"):
        write_copy(Session(session.subject, "simulation_1"), "copy.xml")
    session.set("a1", 0.23)
    session.set("m2", 0.15)
    session.compute()
    # the case has a payload of its own
    assert model_changes(session) == ["payload=0.5", "a1=0.23", "m2=0.15"]
    assert 'fromto="0 0 0 0 -0.23 0"' in model_diff(session)
    original = session.subject.model.read_bytes()
    written = write_copy(session, "copy.xml")
    assert session.subject.model.read_bytes() == original
    robot = load_robot(written)
    assert robot.values == session.good.case.robot.values
    for name in ("copy.xml", "../copy.xml", "sub/copy.xml", "copy.toml", ".xml", "", str(tmp_path / "x.xml")):
        with pytest.raises(OutputError):
            write_copy(session, name)
    assert [path.name for path in tmp_path.iterdir()] == ["copy.xml"]


def test_the_table_holds_what_is_drawn(session: Session) -> None:
    lines = csv_of(session.good).splitlines()
    header = lines[0].split(",")
    assert len(lines) == SAMPLES + 1
    column = header.index("tau_q2 MuJoCo lumped")
    assert [float(line.split(",")[column]) for line in lines[1:]] == session.good.references["lumped"][:, 1].tolist()
    assert len(set(header)) == len(header)


# what is said


def test_the_paper_s_claims_are_not_about_a_changed_robot(session: Session) -> None:
    assert "claims are judged by workbench run" in words.head(session)
    session.set("m2", 0.15)
    session.compute()
    assert "claims are not about this robot" in words.head(session)
    assert "m2 from 0.3 to 0.15 kg" in words.head(session)
    session.back_to_file()
    session.move(speed=2.0)
    session.compute()
    assert "claims are not about this motion" in words.head(session)
    assert "motion 2 times as fast" in words.head(session)


def test_the_command_line_changes_the_robot_too() -> None:
    session = Session(open_subject("almeida_2010", settings={"m2": 0.2}), CASE)
    assert "claims are not about this robot" in words.head(session)
    assert session.values()["m2_left"] == 0.2


def test_verdicts_say_bound_and_measure(session: Session) -> None:
    said = words.verdict(session)
    assert "within 1e-10" in said
    assert "measured" in said
    assert "beyond" not in said


def test_what_is_wrong_on_purpose_is_not_held_before_it_is_asked_for() -> None:
    subject = open_subject("planar_4rprp")
    session = Session(subject)
    declared = [i for i, row in enumerate(subject.campaign.candidate) if row.expect_fail]
    assert declared
    assert not set(declared) & set(session.wanted.rows)
    session.hold((declared[0],))
    session.compute()
    assert "as the campaign declares" in words.verdict(session)


def test_change_of_peaks_is_against_the_file(session: Session) -> None:
    session.set("payload", 1.0)
    session.compute()
    other = session.baseline()
    assert other is not None
    now, before = session.good.peak_torques()[1].value, other.peak_torques()[1].value
    assert f"{100 * (now / before - 1):+.1f} %" in words.peaks(session, other)


def test_the_worst_moment_is_a_peak(session: Session) -> None:
    tau, sample = np.abs(session.good.tau), session.good.worst_moment()
    assert any(tau[sample, joint] == tau[:, joint].max() for joint in range(3))


# what can be opened


def test_a_robot_without_a_campaign_moves_about_home(tmp_path: Path) -> None:
    for file in ("delta.xml", "delta.py", "robot.toml"):
        (tmp_path / file).write_bytes((DELTA / file).read_bytes())
    session = Session(open_subject(str(tmp_path)))
    assert not session.subject.has_campaign
    session.set("ma", 0.5)
    assert session.compute() is not None
    with pytest.raises(OutputError, match="no campaign"):
        set_command(session)
    text, _ = campaign_case(session, "found")
    (tmp_path / "c.toml").write_text(text, encoding="utf-8")
    again = Session(open_subject(str(tmp_path / "c.toml")))
    np.testing.assert_allclose(again.good.tau, session.good.tau, atol=1e-12)
    assert Campaign.model_validate(tomllib.loads(text)).case[0].name == "found"


def test_formulas_of_a_user_are_held(delta: Subject) -> None:
    session = Session(delta)
    assert {row.candidate for row in session.good.rows} == {"exact", "codourey"}
    session.set("mf", 0.5)
    assert session.compute() is not None
    errors = {row.candidate: row.peak_error for row in session.good.rows}
    assert errors["exact"] < 1e-10 < 1e-3 < errors["codourey"]


def test_a_run_is_opened_with_its_parameters(tmp_path: Path) -> None:
    out = tmp_path / "run"
    command = [sys.executable, "-m", "workbench.cli", "run", str(DELTA / "delta.toml"), "--only", "slow", "--quick"]
    done = subprocess.run(
        [*command, "--no-pictures", "--set", "mp=0.7", "--out", str(out)], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 4, done.stderr  # nothing judged: no formula was given
    # beside the run there is no campaign, so the studio has to be started where it is
    with pytest.raises(OutputError, match=r"delta\.toml"):
        open_subject(str(out))
    for file in ("delta.toml", "delta.xml", "delta.py", "robot.toml"):
        (tmp_path / file).write_bytes((DELTA / file).read_bytes())
    session = Session(open_subject(str(out)))
    assert session.wanted.case == "slow"
    assert session.values()["mp"] == 0.7
    assert session.subject.run is not None
    assert session.subject.run.same_model
    assert f"As run in {out}" in words.head(session)
    assert set_command(session).endswith("--only slow --set mp=0.7")


def test_a_broken_file_keeps_the_last_good_state(tmp_path: Path) -> None:
    for file in ("delta.toml", "delta.xml", "delta.py", "robot.toml"):
        (tmp_path / file).write_bytes((DELTA / file).read_bytes())
    session = Session(open_subject(str(tmp_path)))
    session.set("mp", 0.7)
    session.compute()
    good = session.good
    assert not session.edited()
    model = tmp_path / "delta.xml"
    text = model.read_text(encoding="utf-8")
    model.write_text(text.replace("<body", "<bdy", 1) + " ", encoding="utf-8")
    assert session.edited()
    assert session.read_again() is not None
    assert session.good is good
    assert "delta.xml" in words.head(session)
    assert not session.edited()
    model.write_text(text.replace('mass="0.25"', 'mass="0.26"'), encoding="utf-8")
    assert session.edited()
    assert session.read_again() is None
    assert session.problem is None
    assert session.values()["mf"] == 0.26
    assert session.values()["mp"] == 0.7


def test_nothing_else_is_opened(tmp_path: Path) -> None:
    with pytest.raises(SpecError):
        open_subject(str(REPOSITORY / "campaigns" / "almeida_2010.toml"), candidates=["no_such_file.py"])
    (tmp_path / "manifest.json").write_text("[]", encoding="utf-8")
    with pytest.raises(OutputError, match="opens no sweeps"):
        open_subject(str(tmp_path))


# beyond the motion


def test_a_slice_holds_what_can_be_reached(session: Session) -> None:
    robot, good = session.robot(), session.good
    assert planes_of(robot) == ("x y", "x z", "y z")
    found = slice_of(robot, good.case.x[0], good.result.x[0], "y z")
    assert len(found.x) > 100
    np.testing.assert_allclose(found.x[:, 0], good.case.x[0, 0])
    assert robot.reach(found.x).reachable.all()
    assert ((found.colours >= 0) & (found.colours <= 1)).all()
    with pytest.raises(ParameterError, match="x z"):
        slice_of(robot, good.case.x[0], good.result.x[0], "x x")


def test_the_robot_follows_a_target_where_it_can(session: Session) -> None:
    robot, x = session.robot(), session.good.case.x[0] + [0.01, 0.02, -0.02]
    qpos = session.target(x)
    q = qpos[robot.reference.structure.actuated_qpos]
    np.testing.assert_allclose(robot.forward_kinematics(q), x, atol=1e-10)
    from workbench.errors import MotionError

    with pytest.raises(MotionError, match="reach"):
        session.target(x + np.array([0.0, 0.0, 5.0]))


def test_scaling_leaves_an_unscaled_case_alone(paper: Subject) -> None:
    for case in paper.campaign.case:
        assert scaled_spec(case, 1.0, 1.0) is case
