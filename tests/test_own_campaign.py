"""A campaign with a mechanism and formulas of the user's own: what runs, what fails alone, what a message says."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import workbench as wb
from own_mechanisms import CAMPAIGN, FOURBAR
from small_campaign import SMALL, Done, Workbench
from workbench.campaign import formula_files, user_candidates
from workbench.errors import OutputError, SpecError
from workbench.report.evidence import evidence_table

MODEL = """
import workbench
import numpy as np
"""


Robot: Any = SimpleNamespace(parameters=None, joints=("crank",))


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    made = Workbench(tmp_path, monkeypatch, capsys)
    made.write(FOURBAR, "fourbar.xml")
    return made


def run(workbench: Workbench, code: str | None, campaign: str = CAMPAIGN, *options: str) -> Done:
    extra: tuple[str, ...] = ()
    if code is not None:
        extra = ("--candidates", workbench.write(MODEL + code, "mine.py"))
    return workbench.run(campaign, "--out", "out", "--quick", *extra, *options)


def test_the_reference_alone(workbench: Workbench) -> None:
    workbench.gather_evidence()
    done = workbench.run(CAMPAIGN, "--out", "out")
    assert done.code == 4, done.err  # nothing is judged
    found = wb.load_run("out")
    case = found.manifest.cases["turn"]
    assert case.mobility == 1
    assert case.kinematics == {}
    # the platform's motion is the reference's own: held against itself it would say nothing
    rows = {row[0].text: row[1].text for row in evidence_table(case, "turn").rows}
    assert rows["Kinematics"] == "not compared"
    assert case.evidence.power_balance["distributed"].relative < 1e-9
    assert {row.candidate for row in found.summary.itertuples()} == {"raw mj_inverse"}
    assert found.parameters()["value"].tolist() == [0.3, 0.15, 9.81]


def test_units_travel_with_the_frames(workbench: Workbench) -> None:
    run(workbench, "@workbench.candidate\ndef mine(p, q, qd, qdd):\n    return qdd * p.m1\n")
    found = wb.load_run("out")
    series = found.series("turn")
    units = series.attrs["units"]
    assert units["qd1"] == "rad/s"
    assert units["ref_distributed_crank"] == "N m"
    assert units["cand_mine_crank"] == "N m"
    assert set(units) == set(series.columns)
    torques = found.torques("turn")
    mine = torques[torques["name"] == "mine"]
    assert np.array_equal(mine["value"], 0.3 * series["qdd1"])
    assert found.summary.attrs["units"]["peak_reference"] == {"crank": "N m"}
    with pytest.raises(OutputError, match='no case "turm"; did you mean "turn"'):
        found.series("turm")


THREADS = """
import io, os, workbench as wb
from pyarrow.parquet import read_table
count = lambda: len(os.listdir("/proc/self/task"))
run = wb.load_run("out")
before = count()
run.series("turn")
after = count()
read_table(io.BytesIO(open("out/series/turn.parquet", "rb").read()))
print(after - before, count() - after)
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="no way to count threads")
def test_reading_leaves_no_threads_behind(workbench: Workbench) -> None:
    """Threads of Arrow that hold on to a Python file abort an interpreter that ends soon after."""
    run(workbench, None)
    done = subprocess.run([sys.executable, "-c", THREADS], capture_output=True, text=True)
    ours, plain = map(int, done.stdout.split())
    assert ours == 0
    assert plain > 0  # twin: the plain way leaves some


FAULTS = {
    "raises": ("    return p.nope * q", '(mine.py:7) AttributeError: no parameter "nope"; valid: a1, g, m1'),
    "wrong shape": ("    return q[:, 0]", "(mine.py:4) returns an array of shape (41,); expected (41, 1)"),
    "not finite": ("    return np.where(q > 1.2, np.nan, q)", "(mine.py:4) returns nan for sample"),
    "leaves": ("    raise SystemExit(0)", "(mine.py:7) SystemExit: 0"),
    "text": ("    return 'q'", "(mine.py:4) returns str; expected numbers"),
    "complex": ("    return q * 1j", "(mine.py:4) returns complex"),
    "masked": ("    return np.ma.array(0 * q, mask=q > 1.2)", "masked entries; expected a number in each"),
    "truths": ("    return q > 0", "(mine.py:4) returns an array of bool; expected numbers"),
    "beyond doubles": ("    return q.astype(np.longdouble) * np.longdouble('1e400')", "returns inf for sample 0"),
    "writes": ("    q[0] = 0.0\n    return q", "(mine.py:7) ValueError: assignment destination is read-only"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_names_the_users_own_line_and_others_go_on(workbench: Workbench, name: str) -> None:
    body, message = FAULTS[name]
    code = f"@workbench.candidate\ndef bad(p, q, qd, qdd):\n    '''Wrong.'''\n{body}\n"
    done = run(workbench, code + "@workbench.candidate('fine')\ndef fine(p, q, qd, qdd):\n    return 0 * q\n")
    found = wb.load_run("out")
    verdicts = {row.candidate: row.verdict for row in found.summary.itertuples()}
    assert done.code == 1
    assert verdicts == {"bad": "fail", "fine": "measured"}
    # one line of the user's code is cut by the terminal's width, so ask the manifest
    assert message in (found.manifest.cases["turn"].message or ""), found.manifest.cases["turn"].message


def test_a_slow_one_is_named_and_an_endless_one_stopped(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    code = "import time\n@workbench.candidate\ndef slow(p, q, qd, qdd):\n    time.sleep(0.1)\n    return q\n"
    run(workbench, code)
    assert "is slow" in wb.load_run("out").manifest.cases["turn"].warnings[0]
    monkeypatch.setattr(user_candidates, "LIMIT_S", 0.5)
    done = run(workbench, "@workbench.candidate\ndef endless(p, q, qd, qdd):\n    while True:\n        p.m1\n")
    message = wb.load_run("out").manifest.cases["turn"].message
    assert done.code == 1
    assert message is not None
    assert "takes more than 0.5 s for 41 samples" in message
    assert "mine.py:6" in message or "mine.py:7" in message


def test_a_formula_runs_only_when_the_command_line_names_its_file(workbench: Workbench) -> None:
    code = "open('ran', 'w').close()\n@workbench.candidate\ndef mine(p, q, qd, qdd):\n    return q\n"
    workbench.write(MODEL + code, "mine.py")
    campaign = CAMPAIGN.replace("[[case]]", '[[candidate]]\nname = "mine"\nreference = "distributed"\n[[case]]')
    done = run(workbench, None, campaign)
    assert done.code == 2
    assert "--candidates FILE" in done.err
    assert not Path("ran").exists()
    assert run(workbench, code, campaign).code == 4
    assert Path("ran").exists()


def test_formulas_for_a_built_in_robot_get_its_parameters_and_the_force(workbench: Workbench) -> None:
    code = (
        "@workbench.candidate('mine', bound=1e-10)\ndef mine(p, q, qd, qdd, f):\n"
        "    from workbench.robots.asym_2rss_ppap.closed_form import Asym2rssPpap\n"
        "    return Asym2rssPpap(p).inverse_dynamics(q, qd, qdd, 'distributed', f)\n"
    )
    assert run(workbench, code, SMALL).code == 0
    assert run(workbench, code.replace("f)\n", "-f)\n").replace("qdd, -f)", "qdd, f)"), SMALL).code == 1


def test_a_file_of_formulas_is_read_as_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    monkeypatch.setattr(sys, "pycache_prefix", None)
    code = tmp_path / "mine.py"
    text = "import workbench\n@workbench.candidate\ndef mine(p, q, qd, qdd):\n    return q + qd\n"
    for sign, expected in (("+", 3.0), ("-", -1.0)):
        # as long as before, and saved in the same second: a compiled file beside it would be taken for this one
        code.write_text(text.replace("q + qd", f"q {sign} qd"))
        os.utime(code, (1e9, 1e9))
        (found,) = user_candidates.load_candidates([code])
        one = np.ones((1, 1))
        assert found(Robot, one, 2 * one, one, one) == expected
    assert [file.name for file in tmp_path.iterdir()] == ["mine.py"]


COMPLAINTS = {
    "no such file": ("absent.py", None, "absent.py: no such Python file, nor an installed entry point"),
    "not python": ("fourbar.xml", None, "candidates stand in a file .py, .m, .c"),
    "nothing registered": ("empty.py", "x = 1\n", "empty.py: no candidate is registered in it"),
    "syntax": ("bad.py", "def f(:\n", "bad.py:1: invalid syntax"),
    "fails on import": ("bad.py", "\n\n1 / 0\n", "bad.py:3: ZeroDivisionError"),
    "leaves on import": ("bad.py", "import sys\nsys.exit(0)\n", "bad.py:2: SystemExit: 0"),
    "signature": (
        "bad.py",
        "import workbench\n@workbench.candidate\ndef f(q):\n    return q\n",
        "bad.py:2: a candidate is called as f(parameters, q, qd, qdd)",
    ),
    "twice": (
        "bad.py",
        "import workbench\n@workbench.candidate('a')\ndef f(p, q, qd, qdd): ...\n"
        "@workbench.candidate('a')\ndef g(p, q, qd, qdd): ...\n",
        'candidate "a" is registered twice',
    ),
    "the same function twice": (
        "bad.py",
        "import workbench\n@workbench.candidate('a')\ndef f(p, q, qd, qdd): ...\n"
        "@workbench.candidate('b')\ndef f(p, q, qd, qdd): ...\n",
        'bad.py:2: candidate "a" is registered and lost: its function f is defined again',
    ),
    "inside another function": (
        "bad.py",
        "import workbench\ndef make():\n    @workbench.forward_kinematics\n    def f(p, q): ...\nmake()\n",
        'bad.py:3: candidate "f" is registered and lost',
    ),
    "bound": (
        "bad.py",
        "import workbench\n@workbench.candidate('a', bound=-1)\ndef f(p, q, qd, qdd): ...\n",
        "bound = -1; allowed: a number > 0",
    ),
}


@pytest.mark.parametrize("name", COMPLAINTS)
def test_a_file_of_formulas_that_cannot_be_used_is_one_line(workbench: Workbench, name: str) -> None:
    file, text, message = COMPLAINTS[name]
    if text is not None:
        workbench.write(text, file)
    done = run(workbench, None, CAMPAIGN, "--candidates", file)
    assert done.code == 2
    assert len(done.complaint) == 1
    assert message in done.err
    assert not Path("out").exists()


SPEC = {
    "platform missing": (
        ('platform_site = "coupler"\n', ""),
        "actuated and platform_site (or platform_body) go together",
    ),
    "neither": (
        ('actuated = ["crank"]\nplatform_site = "coupler"\n', ""),
        "initial goes with actuated and platform_site",
    ),
    "parameter that no formula can name": (("m1 =", "lambda ="), "read.lambda: formulas read p.NAME"),
    "unknown quantity": (('"mass crank"', '"mas crank"'), 'read.m1 "mas crank": unknown place; did you mean "mass"?'),
    "unknown body": (('"mass crank"', '"mass crnk"'), 'no body "crnk"; did you mean "crank"?'),
    "form": (('"offset coupler x"', '"offset coupler"'), 'allowed: "offset BODY x|y|z"'),
    "axis": (('"offset coupler x"', '"offset coupler w"'), 'axis "w"; allowed: x, y, z'),
    "parameter out of range": (("[read]", "[parameters]\nm1 = -1.0\n[read]"), "allowed for a body that moves"),
    "computed parameter": (
        ('g = "gravity"\n', 'I1 = "inertia crank y"\n[parameters]\nI1 = 1.0\n'),
        "is computed by MuJoCo and stands nowhere in the file",
    ),
    "ignore": (("[read]", "[read]\n"), None),
}


@pytest.mark.parametrize("name", [name for name, entry in SPEC.items() if entry[1]])
def test_a_campaign_that_cannot_be_used_is_one_line(workbench: Workbench, name: str) -> None:
    (old, new), message = SPEC[name]
    assert old in CAMPAIGN
    done = run(workbench, None, CAMPAIGN.replace(old, new))
    assert done.code == 2
    assert len(done.complaint) == 1
    assert str(message) in done.err


def test_entry_points_are_known_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    class Entry:
        name = "their-model"

        @staticmethod
        def load() -> object:
            raise RuntimeError("of theirs")

    monkeypatch.setattr(formula_files, "entry_points", lambda group: [Entry] if group == formula_files.GROUP else [])
    with pytest.raises(SpecError, match="their-model: RuntimeError: of theirs"):
        user_candidates.load_candidates(["their-model"])
    with pytest.raises(SpecError, match='did you mean "their-model"'):
        user_candidates.load_candidates(["their-modle"])


def test_model_check_of_an_own_mechanism_takes_what_the_campaign_says(workbench: Workbench) -> None:
    campaign = workbench.write(CAMPAIGN)
    alone = workbench("model", "check", "fourbar.xml")
    assert alone.code == 0
    assert 'actuated = ["crank"]' in alone.out  # proposed
    done = workbench("model", "check", "fourbar.xml", "--campaign", campaign)
    assert done.code == 0, done
    assert "1 = 3 joint freedoms - rank 2" in done.out
    assert "range of crank" in done.out
    more = workbench.write(CAMPAIGN.replace('actuated = ["crank"]', 'actuated = ["crank", "elbow"]'), "more.toml")
    redundant = workbench("model", "check", "fourbar.xml", "--campaign", more)
    assert redundant.code == 0, redundant
    assert "range of" not in redundant.out  # with the elbow held the crank cannot move
    open_loop = workbench.write(FOURBAR.replace("<equality>", "<!--").replace("</equality>", "-->"), "open.xml")
    loose = workbench("model", "check", open_loop, "--campaign", campaign)
    assert loose.code == 1
    assert "mobility 3, but 1 actuators" in loose.out
    lock = '<joint joint1="elbow" joint2="crank" polycoef="-1.5 1 0 0 0"/></equality>'
    locked = workbench(
        "model", "check", workbench.write(FOURBAR.replace("</equality>", lock), "locked.xml"), "--campaign", campaign
    )
    assert locked.code == 1
    assert "the loops leave no freedom" in locked.out


def test_a_model_in_millimetres_is_noticed(workbench: Workbench) -> None:
    assert "millimetres" not in run(workbench, None).out
    workbench.write(FOURBAR.replace('name="coupler" pos="0.2 0 0.05"', 'name="coupler" pos="200 0 50"'), "fourbar.xml")
    assert 'site "coupler" lies 206.155 m from where it hangs' in " ".join(run(workbench, None).out.split())


SAYS = """
class Text(str):
    def __str__(self): raise ValueError("lies")
    __repr__ = __str__

class Number(float):
    def __gt__(self, other): raise ValueError("lies")
    __lt__ = __le__ = __ge__ = __gt__
"""


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("Text('mine')", "candidate name"),
        ("'mine', reference=Text('distributed')", "reference is Text; allowed: a text"),
        ("'mine', description=Text('x')", "description is Text; allowed: a text"),
        ("'mine', description='x' * 10_001", "description has 10001 characters; allowed: 10000"),
        ("'mine', source='x' * 10_001", "source has 10001 characters"),
        ("'mine', bound=Number(1.0)", "allowed: a number > 0"),
        ("'mine', bound=True", "allowed: a number > 0"),
        ("'mine', bound=np.float64(-1.0)", "allowed: a number > 0"),
    ],
)
def test_what_a_formula_says_of_itself_is_plain(workbench: Workbench, given: str, said: str) -> None:
    done = run(workbench, f"{SAYS}\n@workbench.candidate({given})\ndef mine(p, q, qd, qdd):\n    return q\n")
    assert (done.code, len(done.complaint)) == (2, 1)
    assert said in done.complaint[0]
    assert "mine.py:" in done.complaint[0]


def test_a_bound_may_be_a_number_of_numpy(workbench: Workbench) -> None:
    code = "\n@workbench.candidate('mine', bound=np.float64(1e-3))\ndef mine(p, q, qd, qdd):\n    return q\n"
    assert run(workbench, code).code == 1  # and it is judged by it
