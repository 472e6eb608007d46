"""The report: it shows what is stored, all of it, safely; and it says so in one line when the store is torn."""

from __future__ import annotations

import base64
import copy
import csv
import hashlib
import html
import json
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from workbench.errors import OutputError
from workbench.metrics import relative_error
from workbench.report import build_report
from workbench.report.cost import cost_table
from workbench.report.load import load_run
from workbench.report.text import error_fraction, escape_markdown, percent, torque_label
from workbench.report.verdict_section import verdict

JOINTS = ("q1", "q2", "q3")
UNITS = ("N", "N m", "N m")
CANDIDATES = {
    "lumped": "lumped",
    "lumped-appendix": "lumped",
    "distributed": "distributed",
    "distributed-rotation": "distributed",
}
PAIRS = [*CANDIDATES.items(), ("lumped", "distributed")]
BOUND = 1e-10
NASTY = '<script>alert("1")</script> | *b* _i_ `c` [x](http://evil.example) $a$ \u4e2d\u6587 \U0001f916 \' & # '

REPLAYS = {
    "reference": ("converges", 0.97, [0.024, 0.012, 0.0061]),
    "lumped": ("stalls", 0.03, [0.274, 0.262, 0.255]),
    "distributed": ("undecided", 0.5, [0.02, 0.015, 0.011]),
}
EVIDENCE = {
    "power_balance": {
        name: {
            "relative": 1.25e-13, "peak_power_w": 109.5, "worst_time_s": 0.75, "differentiation": 9e-13, "samples": 147,
        }
        for name in ("lumped", "distributed")
    },
    "second_engine": {"engine": "pinocchio", "spread": {"distributed": dict.fromkeys(JOINTS, 3.5e-14)}},
    "replay": {
        "start_s": 0.0, "stop_s": 1.0, "note": "replayed 0 to 1 s",
        "candidates": {
            name: {
                "steps_s": [0.001, 0.0005, 0.00025], "peak_error": [[1e-4, e, 1e-4] for e in errors],
                "final_error": [[0.0] * 3] * 3, "order": order, "worst_joint": "q2", "limit": errors[-1],
                "verdict": verdict, "text": f"{verdict} in words", "same_as": "lumped" if name == "distributed" else "",
            }
            for name, (verdict, order, errors) in REPLAYS.items()
        },
    },
}  # fmt: skip
"""What a run writes about the reference itself."""

DRAWING = {
    "links": {"arm": [["body.arm", "joint.elbow"]], "platform": [["body.platform", "site.tip"]]},
    "joints": {
        "q2": {"point": "body.arm", "kind": "hinge", "actuated": True},
        "elbow": {"point": "joint.elbow", "kind": "ball", "actuated": False},
    },
    "platform": "body.platform",
    "up": [0.0, 0.0, -1.0],
}


def arm_angle(t: Any) -> Any:
    """Course of the drawn arm, which turns about x1."""
    return 0.8 * np.sin(2.0 * t)


def points_of(t: Any) -> dict[str, Any]:
    """The arm turns about x1; the platform's two points go their own ways."""
    angle, zero = arm_angle(t), 0.0 * t
    arm = {"body.arm": (zero, zero, zero), "joint.elbow": (zero, 0.2 * np.cos(angle), 0.2 * np.sin(angle))}
    platform = {"body.platform": (zero, zero, 0.3 + 0.05 * np.sin(t)), "site.tip": (zero, 0.1 * np.sin(t), 0.4 + zero)}
    return {
        f"point_{name}_{axis}": place[k] for name, place in (arm | platform).items() for k, axis in enumerate("xyz")
    }


Edit = Callable[[dict[str, Any], list[dict[str, Any]]], None]


def make_run(folder: Path, cases: int = 2, samples: int = 120, edit: Edit | None = None) -> Path:
    """Write a synthetic run directory: sinusoidal torques, round-off errors, and one case that ended in an error."""
    (folder / "series").mkdir(parents=True)
    random = np.random.default_rng(1)
    t = np.linspace(0.1, 5.0, samples)
    rows: list[dict[str, Any]] = []
    records: dict[str, Any] = {}
    for number in range(cases):
        case = f"sim{number + 1}"
        data: dict[str, Any] = {"t": t}
        for k in range(3):
            w = 2.0 + 3 * (k > 0) + number
            data[f"q{k + 1}"] = 0.1 * np.sin(w * t)
            data[f"qd{k + 1}"] = 0.1 * w * np.cos(w * t)
            data[f"qdd{k + 1}"] = -0.1 * w**2 * np.sin(w * t)
            data[f"x{k + 1}"] = 0.2 * np.cos(w * t + k)
            data[f"xd{k + 1}"] = -0.2 * w * np.sin(w * t + k)
            data[f"xdd{k + 1}"] = -0.2 * w**2 * np.cos(w * t + k)
            data[f"reaction_spherical_E_{'xyz'[k]}"] = np.cos(t)
            base = (k + 1) * np.sin(w * t) + 0.3 * k
            data[f"ref_distributed_q{k + 1}"] = base
            data[f"ref_lumped_q{k + 1}"] = base * (1 - 0.03 * np.cos(t))
            for name, model in CANDIDATES.items():
                noise = 1e-15 * random.standard_normal(samples)
                data[f"cand_{name}_q{k + 1}"] = data[f"ref_{model}_q{k + 1}"] + noise
        data |= points_of(t)
        data["closure_residual"] = np.full(samples, 2e-16)
        pd.DataFrame(data).to_parquet(folder / "series" / f"{case}.parquet")
        for name, model in PAIRS:
            for k, joint in enumerate(JOINTS):
                found = relative_error(data[f"cand_{name}_{joint}"], data[f"ref_{model}_{joint}"])
                verification = CANDIDATES[name] == model
                rows.append(
                    {
                        "case": case,
                        "candidate": name,
                        "reference": model,
                        "joint": joint,
                        "peak_error": found.peak_error,
                        "rms_error": found.rms_error,
                        "pointwise_error": found.pointwise_error,
                        "worst_time_s": t[found.worst_index],
                        "bound": BOUND if verification else "",
                        "verdict": "pass" if verification else "measured",
                        "peak_reference": found.peak_reference,
                        "unit": UNITS[k],
                        "pointwise_skipped": found.pointwise_skipped,
                        "kind": "verification" if verification else "modelling",
                    }
                )
        records[case] = {
            "status": "passed",
            "title": f"Simulation {number + 1}",
            "description": "Sinusoids on all joints, started after the jump at rest.",
            "message": None,
            "samples": samples,
            "duration_s": 4.9,
            "parameters": {"payload": 0.5} if number else {},
            "external_force": [0.0, 0.0, 0.0],
            "mobility": 3,
            "rank": 14,
            "constraint_rows": 15,
            "redundant_rows": 1,
            "idle_freedoms": 2,
            "closure_residual": 2.5e-16,
            "velocity_residual": 3.5e-15,
            "acceleration_residual": 4.5e-14,
            "condition": 12.5,
            "peak_speed": 0.5541,
            "peak_acceleration": 3.8621,
            "speed_at_s": 1.25,
            "acceleration_at_s": 2.5,
            "singularity": {"det J_x": {"min": 0.312, "time": 1.5}, "det J_q": {"min": 0.0451, "time": 2.5}},
            "kinematics": {"position": 1.1e-16, "velocity": 2.2e-16, "acceleration": 3.3e-15},
            "peak_reactions": {"spherical_E": 9.2217, "hinge": 6.5822},
            "conditions": [
                {
                    "name": "min q1 > b",
                    "value": 0.7,
                    "relation": ">",
                    "limit": 0.6,
                    "holds": True,
                    "unit": "m",
                    "note": "",
                },
                {
                    "name": "max q3 < b",
                    "value": 0.7,
                    "relation": "<",
                    "limit": 0.6,
                    "holds": False,
                    "unit": "m",
                    "note": "",
                },
            ],
            "evidence": EVIDENCE,
            "drawing": copy.deepcopy(DRAWING),
            "solutions_at_start": [[0.1, 0.2, 0.3], [-0.1, 0.2, 0.3]],
            "warnings": ["det J_q falls to 0.045 at 2.5 s: close to the workspace boundary"] if number else [],
        }
    records["broken"] = {
        "status": "error",
        "title": "A motion that leaves the workspace",
        "description": "",
        "message": "case broken: motion leaves the workspace at t = 0.31 s, joint q2",
    }
    curves = ["cand:lumped", "ref:lumped", "cand:distributed", "ref:distributed"]
    figures = [
        {"id": "fig5", "title": "End effector", "case": "sim1", "kind": "platform", "source": "[Paper2010] Fig. 5"},
        *(
            {"id": f"fig{n}", "title": f"Joint {j}", "case": "sim1", "kind": "torque", "joint": j, "curves": c}
            for n, j, c in [(6, "q1", curves[:2]), (9, "q1", curves), (12, "q2", [curves[0], curves[2]])]
        ),
        {"id": "fig99", "title": "From a case with an error", "case": "broken", "kind": "platform", "source": ""},
        {"id": "fig98", "title": "From a case left out", "case": "absent", "kind": "platform", "source": ""},
        {"id": "over", "title": "Errors over load", "kind": "error_over", "case": None, "cases": ["sim1", "sim2"],
         "abscissa": [1.0, 2.0], "label": "load [kg]", "reference": "distributed", "curves": ["cand:lumped"]},
        {"id": "fig96", "title": "Of a later version", "case": "sim1", "kind": "hologram"},
        {"id": "fig97", "title": "Unknown", "case": "sim1", "kind": "torque", "joint": "q1", "curves": ["cand:nobody"]},
    ]  # fmt: skip
    claims = [
        {"id": "a", "text": "Errors below 0.1 %", "source": "[Paper2010] 4", "kind": "upper", "claimed": 0.001,
         "unit": "%", "measured": 1.7e-15, "holds": True, "note": ""},
        {"id": "b", "text": "Mass models differ by less", "source": "[Paper2010] 4", "kind": "upper", "claimed": 0.02,
         "unit": "%", "measured": 0.030123, "holds": False, "note": "tau1"},
        {"id": "c", "text": "Takes 703 us", "source": "[Paper2010] 4", "kind": "value", "claimed": 703, "within": 5,
         "unit": "us", "measured": None, "holds": None, "note": "another machine"},
    ]  # fmt: skip
    manifest: dict[str, Any] = {
        "format": 1,
        "campaign": "synthetic",
        "title": "A synthetic campaign",
        "description": "Made by a test.",
        "spec_file": "campaigns/synthetic.toml",
        "spec": {"campaign": {"name": "synthetic"}},
        "model": {
            "file": "models/robot.xml",
            "sha256": "ab" * 32,
            "mechanism": "robot",
            "title": "A robot",
            "reference_key": "Paper2010",
        },
        "joints": list(JOINTS),
        "coordinate_units": ["m", "rad", "rad"],
        "force_units": list(UNITS),
        "platform_axes": ["x1", "x2", "x3"],
        "parameters": [
            {"name": "a1", "value": 0.2, "unit": "m", "meaning": "arm length", "source": "[Paper2010] Table 1"},
            {"name": "k1", "value": 0.5, "unit": "1", "meaning": "mass centre", "source": ""},
        ],
        "versions": {"workbench": "0.1.0", "mujoco": "4.0.1"},
        "machine": {"system": "Linux", "processor": "x86_64", "cores": 2},
        "git_commit": "0123abc",
        "command": "workbench run campaigns/synthetic.toml",
        "started": "2030-01-01T00:00:00Z",
        "finished": "2030-01-01T00:00:09Z",
        "seconds": 9.0,
        "status": "passed",
        "candidates": {
            n: {"mass_model": m, "description": f"The {n} form.", "source": "", "cost_us": 6.21}
            for n, m in CANDIDATES.items()
        },
        "claims": claims,
        "figures": figures,
        "cases": records,
    }
    if edit is not None:
        edit(manifest, rows)
    (folder / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    with (folder / "summary.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return folder


def without_error_case(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    del manifest["cases"]["broken"]


class Tables(HTMLParser):
    """Collect tables (as lists of rows of cell texts), tags and ids of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.tables: dict[str, list[list[str]]] = {}
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.current: list[list[str]] | None = None
        self.cell = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(attrs)
        self.tags.append((tag, attributes))
        if tag == "table":
            self.current = self.tables.setdefault(str(attributes["id"]).removeprefix("table-"), [])
        elif tag == "tr" and self.current is not None:
            self.current.append([])
        elif tag in ("td", "th") and self.current is not None:
            self.current[-1].append("")
            self.cell = True

    def handle_endtag(self, tag: str) -> None:
        if tag in ("td", "th"):
            self.cell = False
        elif tag == "table":
            self.current = None

    def handle_data(self, data: str) -> None:
        if self.current is not None and self.cell:
            self.current[-1][-1] += data


def parse(run: Path) -> Tables:
    parser = Tables()
    parser.feed((run / "report.html").read_text(encoding="utf-8"))
    return parser


def markdown_tables(text: str) -> list[list[list[str]]]:
    """Parse pipe tables as GitHub does: a cell ends at a pipe that no backslash escapes."""
    tables: list[list[list[str]]] = []
    inside = False
    for line in text.splitlines():
        if line.startswith("|"):
            if not inside:
                tables.append([])
            cells = re.split(r"(?<!\\)\|", line.strip())[1:-1]
            tables[-1].append([html.unescape(cell.strip()) for cell in cells])
        inside = line.startswith("|")
    return tables


def summary(run: Path) -> list[dict[str, str]]:
    with (run / "summary.csv").open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_run(tmp_path_factory.mktemp("report") / "run")
    build_report(folder)
    return folder


@pytest.mark.usefixtures("undrawn")
def test_files_are_those_returned_and_nothing_else(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run")
    (folder / "figures").mkdir()
    (folder / "figures" / "case-gone-torque-1.svg").write_text("stale")
    (folder / "figures" / "mine.svg").write_text("the user's own")
    written = build_report(folder)
    assert {"report.html", "report.md"} <= {path.name for path in written}
    found = {path for path in folder.rglob("*") if path.is_file()}
    inputs = {folder / "manifest.json", folder / "summary.csv", *(folder / "series").iterdir()}
    assert found == set(written) | inputs | {folder / "figures" / "mine.svg"}


def test_every_number_of_the_summary_stands_in_its_case_table(run: Path) -> None:
    tables = parse(run).tables
    rows = summary(run)
    assert len(rows) == 30
    for row in rows:
        key = [torque_label(row["joint"], row["unit"]), row["candidate"], row["reference"]]
        shown = [r for r in tables[f"case-{row['case']}-{row['kind']}"] if r[:3] == key]
        assert len(shown) == 1
        number = error_fraction if row["kind"] == "verification" else percent
        expected = [number(float(row[key])) for key in ("peak_error", "rms_error", "pointwise_error")]
        assert shown[0][3:6] == expected
        assert shown[0][6] == f"{row['pointwise_skipped']} of 120"
        assert shown[0][7].startswith(f"{float(row['worst_time_s']):.4g}")
        assert shown[0][8].startswith(f"{float(row['peak_reference']):.4g}")


def test_full_precision_stands_behind_the_rounded_numbers(run: Path) -> None:
    values = {attributes.get("data-value") for _, attributes in parse(run).tags}
    for row in summary(run):
        assert {row["peak_error"], row["rms_error"], row["pointwise_error"]} <= values


@pytest.mark.usefixtures("undrawn")
def test_a_spoilt_number_shows(run: Path, tmp_path: Path) -> None:
    columns = ["peak_error", "rms_error", "pointwise_error", "worst_time_s", "peak_reference"]

    def spoil(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        for row, column in zip(rows, columns, strict=False):
            row[column] *= 1.5

    spoilt = make_run(tmp_path / "run", edit=spoil)
    build_report(spoilt)
    before, after = (parse(folder).tables["case-sim1-verification"] for folder in (run, spoilt))
    shown = {"peak_error": 3, "rms_error": 4, "pointwise_error": 5, "worst_time_s": 7, "peak_reference": 8}
    for number, column in enumerate(columns, start=1):
        changed = [k for k, (old, new) in enumerate(zip(before[number], after[number], strict=True)) if old != new]
        assert changed == [shown[column]]
    assert before[6:] == after[6:]
    assert (spoilt / "report.md").read_bytes() != (run / "report.md").read_bytes()


@pytest.mark.usefixtures("undrawn")
def test_worst_rows_come_first(tmp_path: Path) -> None:
    def spoil(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        rows[7] |= {"peak_error": 3e-9, "verdict": "fail"}
        rows[20] |= {"peak_error": float("nan"), "verdict": "fail"}
        manifest["cases"]["sim1"]["status"] = manifest["status"] = "failed"

    folder = make_run(tmp_path / "run", edit=spoil)
    build_report(folder)
    tables = parse(folder).tables
    first, second, third = tables["worst-verification"][1:4]
    assert first[4] == "not a number"
    assert (second[4], second[6]) == ("3.00e-09", "30")
    assert "FAILED" in first[-1]
    assert "FAILED" in second[-1]
    assert "passed" in third[-1]
    modelling = tables["worst-modelling"]
    assert modelling[0][3:] == ["τ1 [N]", "τ2 [N·m]", "τ3 [N·m]", "Verdict"]
    assert len(modelling) == 1 + 2
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert "2 of 24 checks exceed their bound" in text


def test_verdicts_differ_in_words_and_style(tmp_path: Path) -> None:
    def fail(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        without_error_case(manifest, rows)
        rows[0] |= {"peak_error": 1.02, "verdict": "fail"}  # and the manifest still says "passed"

    def disagree(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        without_error_case(manifest, rows)
        manifest["cases"]["sim1"] |= {"status": "failed", "message": "platform velocity by 0.1 of its peak"}

    edits = {"error": None, "failed": fail, "passed": without_error_case, "other": disagree}
    seen = {name: verdict(load_run(make_run(tmp_path / name, edit=edit))) for name, edit in edits.items()}
    keys = {name: status.key for name, (status, _) in seen.items()}
    assert keys == {"error": "error", "failed": "failed", "passed": "passed", "other": "failed"}
    assert len({(status.symbol, status.text) for status, _ in seen.values()}) == 3
    assert seen["passed"][1].startswith("all 24 checks in 2 cases hold their bounds; worst is ")
    assert seen["failed"][1].startswith(
        "1 of 24 checks exceed their bounds (worst is lumped on joint q1 in case sim1: 1.02e+00"
    )
    assert seen["other"][1] == "1 case failed for another reason (sim1)."
    assert seen["error"][1].startswith("1 of 3 cases could not be computed (broken); all 24 checks in 2 cases hold")


@pytest.mark.usefixtures("undrawn")
def test_declared_failures_are_told_from_failures(tmp_path: Path) -> None:
    def declare(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        without_error_case(manifest, rows)
        for row in rows:
            if row["candidate"] == "lumped-appendix":
                row["kind"] = "expected-failure"
                if row["joint"] == "q2":
                    row |= {"peak_error": 1.0234, "verdict": "expected-fail"}

    def miss(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        declare(manifest, rows)
        next(row for row in rows if row["verdict"] == "expected-fail")["verdict"] = "unexpected-pass"

    said = {}
    for name, edit in {"declared": declare, "missed": miss}.items():
        folder = make_run(tmp_path / name, edit=edit)
        build_report(folder)
        tables = parse(folder).tables
        assert len(tables["worst-expected-failure"]) == 1 + 2
        assert tables["worst-expected-failure"][1][4] == "1.02e+00 (102 %)"
        assert len(tables["case-sim1-expected-failure"]) == 1 + 3
        said[name] = re.findall(
            r'<p class="verdict verdict-(\w+)">.*</span> (.*)</p>', (folder / "report.html").read_text()
        )
    ((status, sentence),) = said["declared"]
    assert status == "passed"
    assert sentence.startswith("All 22 checks in 2 cases hold their bounds, and all 2 declared failures show")
    assert said["missed"] == [("failed", "1 of 2 declared failures did not happen.")]


@pytest.mark.usefixtures("undrawn")
def test_a_joint_with_another_normaliser_says_so(tmp_path: Path) -> None:
    def edit(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        for row in rows:
            row["normaliser"] = 0.125 if row["joint"] == "q1" and row["case"] == "sim1" else row["peak_reference"]

    folder = make_run(tmp_path / "run", edit=edit)
    build_report(folder)
    tables = parse(folder).tables
    assert tables["case-sim1-verification"][0][9] == "Normaliser"
    assert tables["case-sim1-verification"][1][9] == "0.125 N"
    assert "Normaliser" not in tables["case-sim2-verification"][0]


def test_the_budget_shows_what_the_reference_is_worth(run: Path) -> None:
    tables = parse(run).tables
    power = tables["case-sim1-budget"]
    assert power[1][:6] == ["lumped", "1.25e-13", "109.5 W", "0.75 s", "9.00e-13", "147"]
    assert power[1][6:9] == ["–"] * 3
    assert power[2][6:9] == ["3.50e-14"] * 3
    assert power[0][6] == "pinocchio, q1"
    replays = tables["case-sim1-replay"]
    assert replays[0][4:7] == ["1 ms", "0.5 ms", "0.25 ms"]
    assert [row[1] for row in replays[1:]] == ["✓ converges", "→ stalls", "? undecided"]
    assert replays[2][3:8] == ["q2 [rad]", "0.274", "0.262", "0.255", "0.255"]
    assert [row[8] for row in replays[2:]] == [
        "stalls in words", "undecided in words; simulated with lumped: the same torques",
    ]  # fmt: skip
    whole = {row[0]: row[1:3] for row in tables["budget"][1:]}
    assert whole["Power balance"] == ["1.25e-13 of peak power", "sim1"]
    assert whole["Second engine"] == ["3.50e-14 of peak torque", "sim1"]
    assert tables["replay"][1][2] == "→ stalls"


@pytest.mark.usefixtures("undrawn")
def test_undecided_rows_and_contrasts_are_neither_passed_nor_failed(tmp_path: Path) -> None:
    def doubt(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        without_error_case(manifest, rows)
        manifest["candidates"]["raw mj_inverse"] = {"mass_model": "distributed"}
        manifest["status"] = manifest["cases"]["sim2"]["status"] = "failed"
        for row in rows:
            row["uncertainty"] = 1e-13
        rows[17] |= {"verdict": "undecided", "uncertainty": 3e-11}
        raw = {"candidate": "raw mj_inverse", "kind": "contrast", "bound": "", "verdict": "measured"}
        rows += [rows[0] | raw | {"joint": joint, "peak_error": 1.0816} for joint in JOINTS]

    folder = make_run(tmp_path / "run", edit=doubt)
    build_report(folder)
    status, sentence = verdict(load_run(folder))
    assert status.key == "undecided"
    assert sentence.startswith("1 of 24 checks are undecided, because")
    assert sentence.endswith("(sim2); the other 23 hold their bounds.")
    tables = parse(folder).tables
    assert [row[3] for row in tables["case-sim1-contrast"][1:]] == ["108 %"] * 3
    assert "raw mj_inverse" not in {row[1] for row in tables["case-sim1-modelling"]}
    heading = tables["case-sim2-verification"][0]
    assert {row[heading.index("Reference's own")] for row in tables["case-sim2-verification"][1:]} == {
        "1.00e-13", "3.00e-11",
    }  # fmt: skip
    assert {row[0]: row[1] for row in tables["budget"]}["Uncertainty over bound"] == "3.00e-01"


def test_numbers_that_are_not_finite_are_words(tmp_path: Path) -> None:
    def edit(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        # what the run stores as null because JSON has no word for it
        manifest["cases"]["sim1"] |= {"condition": None, "kinematics": {"position": None}}
        manifest["cases"]["sim1"]["singularity"]["det J_x"] = {"min": None, "time": None}
        rows[0] |= {
            "peak_error": float("inf"),
            "rms_error": float("inf"),
            "pointwise_error": float("inf"),
            "verdict": "fail",
        }

    folder = make_run(tmp_path / "run", edit=edit)
    build_report(folder)
    tables = parse(folder).tables
    assert tables["case-sim1-verification"][1][3:6] == ["infinite"] * 3
    assert tables["case-sim1-singularity"][1] == ["det J_x", "–", "–"]


def test_error_case_has_its_message_and_no_series(run: Path) -> None:
    text = (run / "report.html").read_text(encoding="utf-8")
    section = text[text.index('<article id="case-broken"') :]
    section = section[: section.index("</article>")]
    assert "motion leaves the workspace at t = 0.31 s" in section
    assert "ERROR, not computed" in section
    assert "<svg" not in section
    assert "<table" not in section


def test_claims_say_in_words_whether_they_hold(run: Path) -> None:
    rows = parse(run).tables["claims"][1:]
    assert [row[4].split(" ", 1)[1] for row in rows] == ["holds", "does not hold", "cannot be decided"]
    assert rows[0][2:4] == ["below 0.1 %", "1.7e-13 %"]
    assert rows[1][3] == "3.012 %"
    assert rows[2][2:4] == ["703 us ± 5 us", "–"]


def test_sections_stand_in_reading_order(run: Path) -> None:
    order = ["verdict", "claims", "worst", "budget", "cases", "figures", "parameters", "reproduce", "limits"]
    found = [attributes["id"] for tag, attributes in parse(run).tags if tag == "section"]
    assert found == order
    titles = re.findall(r"^## (.*)$", (run / "report.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert len(titles) == len(order)


def test_campaign_figures_are_drawn_or_say_why_not(run: Path) -> None:
    names = {path.name for path in (run / "figures").iterdir()}
    assert {f"figure-fig{n}.svg" for n in (5, 6, 9, 12)} | {"figure-over.svg"} <= names
    assert not {f"figure-fig{n}.svg" for n in (96, 97, 98, 99)} & names
    for name in ("report.html", "report.md"):
        text = (run / name).read_text(encoding="utf-8")
        assert text.count("Not drawn: ") == 4


def test_page_loads_nothing_and_its_links_lead_somewhere(run: Path) -> None:
    parser = parse(run)
    ids = [str(attributes["id"]) for _, attributes in parser.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    for tag, attributes in parser.tags:
        assert tag not in ("link", "img", "iframe", "object", "embed")
        for name in ("src", "href", "xlink:href", "clip-path"):
            target = attributes.get(name)
            if target is not None:
                anchor = re.fullmatch(r"(?:#|url\(#)([^)]+)\)?", target)
                assert anchor is not None, target
                assert anchor[1] in ids
    text = (run / "report.html").read_text(encoding="utf-8")
    addresses = set(re.findall(r"https?:[^\s\"';]*", text))
    assert addresses == {"http://www.w3.org/2000/svg"}  # a name of the script, not an address
    assert "@import" not in text
    assert "url(h" not in text


def test_only_the_pages_own_script_may_run(run: Path) -> None:
    text = (run / "report.html").read_text(encoding="utf-8")
    (script,) = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"default-src 'none'; style-src 'unsafe-inline'; img-src data:; script-src 'sha256-{digest}'" in text


def test_plots_tell_the_script_their_scales(run: Path) -> None:
    drawings = {
        str(attributes["aria-label"])[:30]: attributes
        for tag, attributes in parse(run).tags
        if tag == "svg" and "aria-label" in attributes
    }
    panels = json.loads(str(drawings["Case sim1: τ2 in N·m over time"]["data-panels"]))
    assert [panel["log"] for panel in panels] == [False, True]
    assert panels[0]["name"] == "τ2 [N·m]"
    assert panels[0]["curves"] == list(CANDIDATES)
    assert len(panels[1]["curves"]) == len(PAIRS)
    low, high = panels[0]["x"]
    assert low < 0.1 < 5.0 < high
    assert "data-panels" not in drawings["Errors over load: peak error a"]  # its abscissa is no time


def test_the_drawing_moves_as_the_points_do(run: Path) -> None:
    (figure,) = [
        attributes for tag, attributes in parse(run).tags if attributes.get("id") == "plot-case-sim1-mechanism"
    ]
    told = json.loads(str(figure["data-frames"]))
    assert figure["data-case"] == "case-sim1"
    assert told["lines"] == {"driven": [[0, 1]], "platform": [[2, 3]]}
    assert told["joints"] == {"hinge-driven": [0], "ball": [1]}
    places = np.cumsum(np.array(told["places"]), axis=0).reshape(len(told["t"]), 4, 3) / told["scale"]
    view = np.array(told["views"][1])
    frames = places @ view[:, :3].T + view[:, 3]
    t = np.array(told["t"])
    # the arm's length on paper is the same at all times, as it is in the view along its axis
    arm = np.hypot(*(frames[:, 1] - frames[:, 0]).T)
    assert np.ptp(arm) < 0.3
    spoilt = np.hypot(*(frames[:, 3] - frames[:, 0]).T)
    assert np.ptp(spoilt) > 3.0
    angle = np.unwrap(np.arctan2(*(frames[:, 1] - frames[:, 0]).T[::-1]))
    assert np.abs(np.abs(angle - angle[0]) - np.abs(arm_angle(t) - arm_angle(t[0]))).max() < 0.03


def test_a_run_without_points_has_no_drawing(tmp_path: Path) -> None:
    def edit(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        del manifest["cases"]["sim1"]["drawing"]
        manifest["cases"]["sim2"]["drawing"]["links"]["gone"] = [["body.arm", "body.gone"]]

    folder = make_run(tmp_path / "run", edit=edit)
    names = {path.name for path in build_report(folder)}
    assert not [name for name in names if "mechanism" in name]
    assert "case-sim1-reactions.svg" in names


def test_figures_have_alternative_texts(run: Path) -> None:
    drawings = [a for tag, a in parse(run).tags if tag == "svg" and a.get("class") != "shapes"]
    assert len(drawings) == 2 * 9 + 7
    assert all(len(str(attributes["aria-label"])) > 30 for attributes in drawings)
    images = re.findall(r'<img src="([^"]*)" alt="([^"]*)"', (run / "report.md").read_text(encoding="utf-8"))
    assert len(images) == len(drawings)
    for source, alt in images:
        assert (run / source).is_file()
        assert len(alt) > 30
        ElementTree.fromstring((run / source).read_text(encoding="utf-8"))


def test_same_results_same_bytes(run: Path, tmp_path: Path) -> None:
    again = make_run(tmp_path / "elsewhere")
    for path in build_report(again):
        assert path.read_bytes() == (run / path.relative_to(again)).read_bytes(), path.name


def test_user_text_is_shown_as_text(tmp_path: Path) -> None:
    nasty = NASTY + "x" * 300

    def edit(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        manifest["title"] = manifest["description"] = manifest["command"] = nasty
        manifest["parameters"][0]["meaning"] = nasty + "\nnext line"
        manifest["claims"][0] |= {"text": nasty, "note": "```\n" + nasty, "source": nasty}
        manifest["figures"][0] |= {"title": nasty, "source": nasty, "id": nasty}
        manifest["cases"]["sim1"] |= {"title": nasty, "description": nasty, "message": nasty, "warnings": [nasty]}
        manifest["cases"][nasty] = {"status": "error", "message": nasty}
        manifest["candidates"][nasty] = {"mass_model": nasty, "description": nasty, "source": nasty}
        for row in rows:
            if row["candidate"] == "lumped-appendix":
                row["candidate"] = nasty

    folder = make_run(tmp_path / "run", edit=edit)
    build_report(folder)
    page = (folder / "report.html").read_text(encoding="utf-8")
    parser = parse(folder)
    assert not [tag for tag, _ in parser.tags if tag in ("img", "b")]
    assert [tag for tag, _ in parser.tags].count("script") == 1
    assert parser.tables["claims"][1][0] == nasty
    assert page.count("<script") == 1
    note = (folder / "report.md").read_text(encoding="utf-8")
    outside = re.sub(r"^(`{3,})text\n.*?\n\1$", "", note, flags=re.DOTALL | re.MULTILINE)
    assert "<script" not in outside
    outside = re.sub(r'<img src="[^"]*" alt="[^"]*" width="[^"]*">', "", outside)
    assert not re.search(r"(?<!\\)\]\(http", outside)
    for path in (folder / "figures").iterdir():
        ElementTree.fromstring(path.read_text(encoding="utf-8"))
        assert re.fullmatch(r"[a-z0-9-]{1,80}\.svg", path.name)


@pytest.mark.usefixtures("undrawn")
def test_markdown_tables_are_whole(run: Path, tmp_path: Path) -> None:
    def edit(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        manifest["claims"][0]["text"] = "a | b\\| c\nd"

    folder = make_run(tmp_path / "run", edit=edit)
    build_report(folder)
    tables = markdown_tables((folder / "report.md").read_text(encoding="utf-8"))
    page = parse(folder).tables
    assert len(tables) == len(page)
    for table, same in zip(tables, page.values(), strict=True):
        assert len(table) == len(same) + 1
        assert all(len(row) == len(table[0]) for row in table)
    claims = next(table for table in tables if table[0][0] == "Claim")
    assert claims[2][0] == r"a \| b\\\| c d"
    shown = {cell.strip("*") for table in tables for row in table for cell in row}
    for row in summary(folder):
        number = error_fraction if row["kind"] == "verification" else percent
        assert number(float(row["peak_error"])) in shown


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("a|b", r"a\|b"),
        ("<b> & c", "&lt;b&gt; &amp; c"),
        ("1. first", r"1\. first"),
        ("- item", r"\- item"),
        ("-0.5 and 0.25", "-0.5 and 0.25"),
        ("# head\n\nnext", r"\# head next"),
        ("[x](y)", r"\[x\](y)"),
        ("plain text, 3.2e-16", "plain text, 3.2e-16"),
    ],
)
def test_markdown_escaping(text: str, written: str) -> None:
    assert str(escape_markdown(text)) == written


def truncate(name: str) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(data[: len(data) * 2 // 3 + 7])

    return spoil


def remove(name: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).unlink()


def replace(name: str, old: str, new: str) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        text = (folder / name).read_text(encoding="utf-8")
        assert old in text
        (folder / name).write_text(text.replace(old, new), encoding="utf-8")

    return spoil


def drop_column(name: str) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        path = folder / "series" / "sim2.parquet"
        pd.read_parquet(path).drop(columns=[name]).to_parquet(path)

    return spoil


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (remove("manifest.json"), "manifest.json: missing"),
        (remove("summary.csv"), "summary.csv: missing"),
        (remove("series/sim2.parquet"), "sim2.parquet: missing"),
        (truncate("manifest.json"), "manifest.json: not valid JSON"),
        (truncate("summary.csv"), "summary.csv: line"),
        (truncate("series/sim2.parquet"), "sim2.parquet: not a readable Parquet file"),
        (drop_column("x2"), 'column "x2" is missing'),
        (replace("manifest.json", '"format": 1', '"format": 7'), "format 7 is not supported; allowed: 1"),
        (replace("manifest.json", '"force_units"', '"force_unit"'), "key 'force_units': Field required"),
        (replace("manifest.json", '"status": "error"', '"status": "odd"'), "cases.broken.status"),
        (replace("summary.csv", "peak_error", "peek_error"), 'column "peak_error" is missing'),
        (replace("summary.csv", "sim2", "sim9"), "case 'sim9' is not in manifest.json"),
        (replace("summary.csv", ",1e-10,", ",small,"), "bound is 'small'; allowed: a number"),
        (replace("manifest.json", '"sim2"', '"../sim2"'), "is not in manifest.json"),
        (lambda folder: (folder / "figures").write_text("a file"), "the report cannot be written"),
    ],
)  # fmt: skip
@pytest.mark.usefixtures("undrawn")
def test_torn_results_give_one_line(tmp_path: Path, spoil: Callable[[Path], None], said: str) -> None:
    folder = make_run(tmp_path / "run")
    spoil(folder)
    before = sorted(folder.rglob("*"))
    with pytest.raises(OutputError) as caught:
        build_report(folder)
    message = str(caught.value)
    assert said in message
    assert "\n" not in message
    assert sorted(folder.rglob("*")) == before


def test_a_case_name_cannot_lead_out_of_the_directory(tmp_path: Path) -> None:
    def edit(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        manifest["cases"]["../series/sim1"] = manifest["cases"]["sim1"]

    with pytest.raises(OutputError, match="cannot be a file name"):
        build_report(make_run(tmp_path / "run", edit=edit))


def test_a_large_campaign_stays_small(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run", cases=4, samples=500)
    build_report(folder, ["html"])
    assert (folder / "report.html").stat().st_size < 7e5


def test_computing_cost_stands_beside_what_was_printed(tmp_path: Path) -> None:
    def edit(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        first, second = list(manifest["candidates"].values())[:2]
        first |= {"cost_us": 0.5, "printed_cost": {"us": 703.0, "source": "Scilab"}}
        second |= {"cost_us": 0.25}

    table = cost_table(load_run(make_run(tmp_path / "run", cases=1, samples=20, edit=edit)).manifest)
    assert table is not None
    assert [cell.text for cell in table.rows[0][2:]] == ["0.5", "703", "1,400", "Scilab"]
    assert [cell.value for cell in table.rows[0][2:]] == [0.5, 703.0, 1406.0, None]
    assert [cell.text for cell in table.rows[1][2:]] == ["0.25", "", "", ""]

    def unmeasured(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        for record in manifest["candidates"].values():
            del record["cost_us"]

    assert cost_table(load_run(make_run(tmp_path / "other", cases=1, samples=20, edit=unmeasured)).manifest) is None
