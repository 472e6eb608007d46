"""Bad inputs of every kind end in exit code 2 and one line that names file and place; none hangs or takes all memory.

The table is in `bad_inputs` and `bad_runs`; a worker that is watched calls the command line with each. One in
twenty-four is tried with the other tests, a third with the slow ones, the rest with the long ones.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import pytest

from bad_inputs import SMALL, all_bad
from bad_runs import bad_runs
from judged_call import HANGS_S, LARGEST_MB, Answer, Bad, lay, prepare
from stored_pictures import store_pictures
from workbench.sweep.supervisor import Lost, Supervisor

pytestmark = [
    pytest.mark.skipif(os.name != "posix", reason="pipes and limits of memory are POSIX"),
    pytest.mark.usefixtures("warm_kernels"),
]
EVERY = 24
SLOWLY = (1, 5, 8, 9, 13, 16, 17, 21)


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("good")
    (place / "good.toml").write_text(SMALL)
    command = [sys.executable, "-P", "-m", "workbench", "run", "good.toml", "--quick", "--no-pictures", "--out", "run"]
    subprocess.run(command, cwd=place, check=True, capture_output=True, timeout=300)
    store_pictures(place / "run", case="first")
    return place / "run"


@pytest.fixture(scope="module")
def table(good: Path, repository: Path) -> list[Bad]:
    return [*all_bad((repository / "models/asym_2rss_ppap.xml").read_text(encoding="utf-8")), *bad_runs(good)]


def faults(cases: Sequence[Bad], good: Path, root: Path) -> list[str]:
    """Try the cases one after the other; say what is wrong with the answers, and print what they took."""
    tasks = []
    for number, case in enumerate(cases):
        place = root / str(number)
        place.mkdir()
        for name in {"run", "good"} & set(case.arguments[1:]):
            shutil.copytree(good, place / name)
        lay(place, case.files)
        tasks.append((number, (str(place), case.arguments)))
    found, answers = [], {}
    setup = partial(prepare, Path(__file__).resolve().parents[1])
    supervisor = Supervisor(1, setup, HANGS_S + 30.0, 3 * LARGEST_MB, 0)
    try:
        for number, answer in supervisor.run(iter(tasks)):
            case = cases[number]
            fault = answer.reason if isinstance(answer, Lost) else answer.fault(case)
            left = [path.name for path in (root / str(number)).glob("out*")]
            if not fault and left and isinstance(answer, Answer) and answer.code == 2:
                fault = f"leaves {left}"
            if fault:
                found.append(f"{case.name}: {fault}")
                print(f"\n{found[-1]}", flush=True)
            if isinstance(answer, Answer):
                answers[case] = answer
            shutil.rmtree(root / str(number), ignore_errors=True)
    finally:
        supervisor.close()
    print(figures(answers))
    return found


def figures(answers: Mapping[Bad, Answer]) -> str:
    """How many ended how, by kind, and what took most."""
    lines = []
    kinds = {case: case.name.partition(":")[0].split()[0] for case in answers}
    for kind in dict.fromkeys(kinds.values()):
        codes = Counter(answer.code for case, answer in answers.items() if kinds[case] == kind)
        lines.append(f"{kind:12} {codes.total():4}  " + ", ".join(f"exit {c}: {n}" for c, n in sorted(codes.items())))
    for what, most in (("seconds", lambda a: a.seconds), ("megabytes", lambda a: a.megabytes)):
        worst = sorted(answers, key=lambda case: most(answers[case]), reverse=True)[:3]
        lines.append(f"most {what}: " + "; ".join(f"{most(answers[case]):.1f} ({case.name[:60]!a})" for case in worst))
    return "\n".join(lines)


def test_there_are_many_of_every_kind(table: list[Bad]) -> None:
    assert len(table) > 900
    assert len({case.name for case in table}) > 850
    assert sum(case.codes == (2,) for case in table) > 500
    kinds = ("campaign", "sweep", "motion", "model", "formula", "run: manifest", "run: summary", "--", "usage")
    assert all(sum(case.name.startswith(kind) for case in table) >= 15 for kind in kinds)


def test_one_in_so_many_gives_one_line(table: list[Bad], good: Path, tmp_path: Path) -> None:
    assert faults(table[::EVERY], good, tmp_path) == []


@pytest.mark.slow
def test_more_give_one_line(table: list[Bad], good: Path, tmp_path: Path) -> None:
    assert faults([case for n, case in enumerate(table) if n % EVERY in SLOWLY], good, tmp_path) == []


@pytest.mark.long
def test_each_gives_one_line(table: list[Bad], good: Path, tmp_path: Path) -> None:
    assert faults([case for n, case in enumerate(table) if n % EVERY not in (0, *SLOWLY)], good, tmp_path) == []


def test_the_judge_sees_every_fault() -> None:
    bad = Bad("x", ("run",), {}, "bad.toml")
    line = "workbench: bad.toml: no\n"
    fine = Answer(2, "", line, 1.0, 100.0)
    assert fine.fault(bad) == ""
    for code, err, seconds, megabytes in (
        (0, line, 1.0, 100.0), (-9, line, 1.0, 100.0), (3, line, 1.0, 100.0),
        (2, line + line, 1.0, 100.0), (2, "", 1.0, 100.0), (2, "workbench: other.toml\n", 1.0, 100.0),
        (2, line, 61.0, 100.0), (2, line, 1.0, 9000.0),
        (2, "Traceback (most recent call last)\n", 1.0, 100.0), (2, "workbench: bad.toml: " + "x" * 2000, 1.0, 100.0),
    ):  # fmt: skip
        assert Answer(code, "", err, seconds, megabytes).fault(bad)
