"""Bad inputs of every kind.

A case is a name, files to be written beside `GOOD`, the command line, and a word that its one line must hold.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from judged_call import Bad, Content
from small_campaign import CANDIDATES, CASE, HEAD
from sweep_campaign import SWEEP

# --- campaigns --------------------------------------------------------------------------------------------------------

SMALL = HEAD + CANDIDATES + CASE
HUGE = "9" * 5000
RUN = ("run", "bad.toml", "--quick", "--no-pictures", "--out", "out")
NUMBER = {
    "text": '"x"', "true": "true", "nan": "nan", "inf": "inf", "-inf": "-inf", "5000 digits": HUGE, "list": "[[]]",
    "table": "{}", "date": "1979-05-27", "400 digits": "1" + "0" * 400, "empty list": "[]", "1e308": "1e308",
}  # fmt: skip
TEXT = {"number": "1", "true": "true", "list": "[]", "table": "{}", "date": "1979-05-27", "5000 digits": HUGE,
        "surrogate": '"\\uD800"', "nan": "nan"}  # fmt: skip
NUMBERS = ("format = 1", "bound = 1e-10", "offset = [0.02, 0.75, 0.85]", "terms = [[[0.06, 4.0, 0.3]], [[0.3, 6.0]], [[0.28, 5.0, 2.6]]]",
           "stop = 1.0", "samples = 21")  # fmt: skip
TEXTS = ('name = "small"', 'title = "A small campaign"', 'model = "models/asym_2rss_ppap.xml"', 'name = "lumped"',
         'reference = "lumped"', 'name = "first"', 'kind = "multi_sine"')  # fmt: skip


def fifo(path: Path) -> None:
    os.mkfifo(path)


def directory(path: Path) -> None:
    path.mkdir()


def itself(path: Path) -> None:
    path.symlink_to(path.name)


def campaigns() -> Iterator[Bad]:
    for lines, values in ((NUMBERS, NUMBER), (TEXTS, TEXT)):
        for line in lines:
            key = line.partition(" =")[0]
            for what, value in values.items():
                text = SMALL.replace(line, f"{key} = {value}", 1)
                yield Bad(f"campaign: {line[:24]} is {what}", RUN, {"bad.toml": text}, "bad.toml")
    for what, content in {
        "a pipe": fifo, "a directory": directory, "a link to itself": itself, "empty": "", "binary": b"\x00\xff\xfe",
        "UTF-16": SMALL.encode("utf-16"), "deep lists": "a = " + "[" * 100_000, "deep tables": "[" + ".".join("a" * 20_000) + "]",
        "20 MB": "#" * 20_000_000, "a NUL": SMALL + "\0", "two heads": SMALL + "\nformat = 1\n", "no case": HEAD + CANDIDATES,
        "no candidate": HEAD + CASE, "unknown key": "nonsense = 1\n" + SMALL, "twice the case": SMALL + CASE,
        "100000 tables": SMALL + "[[x]]\n" * 100_000, "CR": SMALL.replace("\n", "\r\r") + "=",
    }.items():  # fmt: skip
        yield Bad(f"campaign is {what}", RUN, {"bad.toml": content}, "bad.toml")
    changes: dict[str, tuple[str, str]] = {
        "bound 0": ("bound = 1e-10", "bound = 0.0"), "bound negative": ("bound = 1e-10", "bound = -1e-10"),
        "no samples": ("samples = 21", ""), "samples 0": ("samples = 21", "samples = 0"), "samples 1e9": ("samples = 21", "samples = 1000000000"),
        "samples and rate": ("samples = 21", "samples = 21\nrate = 10.0"), "rate negative": ("samples = 21", "rate = -10.0"),
        "rate tiny": ("samples = 21", "rate = 1e-300"), "rate huge": ("samples = 21", "rate = 1e300"),
        "stop before start": ("stop = 1.0", "stop = -1.0"), "stop huge": ("stop = 1.0", "stop = 1e300"),
        "two joints": ("offset = [0.02, 0.75, 0.85]", "offset = [0.02, 0.75]"),
        "out of reach": ("offset = [0.02, 0.75, 0.85]", "offset = [9.0, 0.75, 0.85]"),
        "1e300 rad": ("offset = [0.02, 0.75, 0.85]", "offset = [0.02, 1e300, 0.85]"),
        "200000 terms": ("terms = [[[0.06, 4.0, 0.3]]", "terms = [[" + "[1e-9, 4.0, 0.3]," * 200_000 + "]"),
        "term of one": ("[0.3, 6.0]", "[0.3]"), "term of four": ("[0.3, 6.0]", "[0.3, 6.0, 1.0, 1.0]"),
        "frequency 1e308": ("[0.3, 6.0]", "[0.3, 1e308]"), "amplitude 1e308": ("[0.3, 6.0]", "[1e308, 6.0]"),
        "frequency 1e20": ("[0.3, 6.0]", "[0.3, 1e20]"),
        "name with slash": ('name = "first"', 'name = "a/b"'), "name dots": ('name = "first"', 'name = ".."'),
        "name long": ('name = "first"', f'name = "{"a" * 5000}"'), "name NUL": ('name = "first"', 'name = "a\\u0000b"'),
        "name newline": ('name = "first"', 'name = "a\\nb"'), "name empty": ('name = "first"', 'name = ""'),
        "campaign NUL": ('name = "small"', 'name = "a\\u0000"'), "campaign up": ('name = "small"', 'name = "../up"'),
        "model NUL": ("models/asym_2rss_ppap.xml", "a\\u0000.xml"), "model up": ("models/asym_2rss_ppap.xml", "../../../etc/passwd"),
        "model absolute": ("models/asym_2rss_ppap.xml", "/etc/passwd"), "model long": ("models/asym_2rss_ppap.xml", "a" * 5000),
        "model missing": ("models/asym_2rss_ppap.xml", "missing.xml"), "model empty": ("models/asym_2rss_ppap.xml", ""),
        "model is directory": ("models/asym_2rss_ppap.xml", "."), "model emoji": ("models/asym_2rss_ppap.xml", "\U0001f600.xml"),
        "candidate unknown": ('name = "lumped"', 'name = "nobody"'), "reference unknown": ('reference = "lumped"', 'reference = "nobody"'),
        "kind unknown": ('kind = "multi_sine"', 'kind = "nonsense"'),
        "parameter unknown": ("[case.motion]", "parameters = { nobody = 1.0 }\n[case.motion]"),
        "parameter true": ("[case.motion]", "parameters = { payload = true }\n[case.motion]"),
        "parameter negative": ("[case.motion]", "parameters = { m1 = -1.0 }\n[case.motion]"),
        "parameter 1e300": ("[case.motion]", "parameters = { m1 = 1e300 }\n[case.motion]"),
        "parameter of 1e-300": ("[case.motion]", "parameters = { a2 = 1e-300 }\n[case.motion]"),
        "parameter surrogate": ("[case.motion]", 'parameters = { "\\uDFFF" = 1.0 }\n[case.motion]'),
        "force of two": ("[case.motion]", "external_force = [1.0, 2.0]\n[case.motion]"),
        "force 1e308": ("[case.motion]", "external_force = [1e308, 1e308, 1e308]\n[case.motion]"),
        "claim nonsense": ("[[case]]", "[[claim]]\nid = 1\n[[case]]"),
        "figure nonsense": ("[[case]]", '[[figure]]\nid = "f"\nkind = "nobody"\n[[case]]'),
        "csv missing": ('kind = "multi_sine"', 'kind = "csv"\nfile = "no.csv"'),
    }  # fmt: skip
    for what, (old, new) in changes.items():
        assert old in SMALL, old
        yield Bad(f"campaign: {what}", RUN, {"bad.toml": SMALL.replace(old, new, 1)}, "bad.toml")
    sweeps: dict[str, tuple[str, str]] = {
        "samples 0": ("samples = 40", "samples = 0"), "samples huge": ("samples = 40", f"samples = {HUGE}"),
        "samples 1e12": ("samples = 40", "samples = 1000000000000"), "seed negative": ("seed = 3", "seed = -3"),
        "seed huge": ("seed = 3", f"seed = {HUGE}"), "method": ('"sobol"', '"nobody"'), "key": ("parameters.a2", "parameters.nobody"),
        "key NUL": ("parameters.a2", "parameters.\\u0000"), "low above high": ("low = 0.8", "low = 8.0"), "log of zero": ("low = 0.25", "low = 0.0"),
        "nan": ("low = 0.8", "low = nan"), "true": ("low = 0.8", "low = true"), "inf": ("high = 1.2", "high = inf"),
        "time limit": ("time_limit = 20.0", "time_limit = -1.0"), "time limit nan": ("time_limit = 20.0", "time_limit = nan"),
        "filter": ("inside_workspace = true", "inside_workspace = 3"), "filter unknown": ("inside_workspace = true", "nobody = true"),
        "nothing varies": ("[[sweep.vary]]", "[[sweep.nobody]]"), "retries": ("time_limit = 20.0", "retries = 100000000000"),
        "memory": ("time_limit = 20.0", "memory_limit = -5.0"), "twice": ("parameters.payload", "parameters.a2"),
    }  # fmt: skip
    for what, (old, new) in sweeps.items():
        assert old in SWEEP, old
        yield Bad(f"sweep: {what}", ("run", "bad.toml", "--quick", "--jobs", "1", "--out", "out"),
                  {"bad.toml": SWEEP.replace(old, new, 1)}, "bad.toml")  # fmt: skip


# --- motions ----------------------------------------------------------------------------------------------------------

TABLE = "t,q1,q2,q3\n" + "".join(f"{k / 20},0.02,{0.75 + 0.001 * k * k},0.85\n" for k in range(21))
CSV = (
    HEAD
    + CANDIDATES
    + '\n[[case]]\nname = "first"\n[case.motion]\nkind = "csv"\nfile = "bad.csv"\nstart = 0.0\nstop = 1.0\nsamples = 21\n'
)


def motions() -> Iterator[Bad]:
    contents: dict[str, Content] = {
        "a pipe": fifo, "a directory": directory, "a link to itself": itself, "empty": "", "only a head": "t,q1,q2,q3\n",
        "binary": bytes(range(256)), "UTF-16": TABLE.encode("utf-16"), "nan": TABLE.replace("0.85", "nan", 3),
        "inf": TABLE.replace("0.85", "inf", 1), "text": TABLE.replace("0.85", "abc", 1), "5000 digits": TABLE.replace("0.85", HUGE, 1),
        "NUL": TABLE.replace("0.85", "0\0", 1), "twice the time": TABLE.replace("0.05,", "0.0,", 1), "backwards": TABLE.replace("1.0,", "0.1,", 1),
        "missing column": TABLE.replace("q3", "q4"), "twice a column": TABLE.replace("q3", "q2"), "ragged": TABLE + "1,2\n",
        "one sample": "t,q1,q2,q3\n0,0.02,0.75,0.85\n", "field beyond the limit": TABLE.replace("0.85", "0." + "8" * 200_000, 1),
        "unclosed quote": TABLE.replace("0.85", '"0.85', 1), "too short": TABLE.replace("\n1.0,", "\n0.99,"), "1e300": TABLE.replace("0.85", "1e300", 1),
        "out of reach": TABLE.replace(",0.02,", ",9.0,"), "1_000": TABLE.replace("0.85", "1_0", 1), "half derivatives": TABLE.replace("q3", "q3,qd1", 1),
        "a million columns": ",".join(f"c{k}" for k in range(200_000)) + "\n", "surrogate bytes": TABLE.encode() + b"\xed\xa0\x80",
        "300000 lines": "t,q1,q2,q3\n" + "".join(f"{k},0,0.75,0.85\n" for k in range(300_000)),
    }  # fmt: skip
    for what, content in contents.items():
        yield Bad(f"motion: {what}", RUN, {"bad.toml": CSV, "bad.csv": content}, "bad")
    for what, name in {"NUL": "a\\u0000.csv", "up": "../../../etc/passwd", "absolute": "/etc/passwd", "long": "a" * 5000, "empty": "",
                       "a device": "/dev/zero"}.items():  # fmt: skip
        yield Bad(f"motion file: {what}", RUN, {"bad.toml": CSV.replace("bad.csv", name)}, "bad.toml")


# --- models -----------------------------------------------------------------------------------------------------------


def models(model: str) -> Iterator[Bad]:
    chain = (
        "".join(f'<body><joint name="j{k}" axis="0 0 1"/><geom size=".01" mass="1"/>' for k in range(90))
        + "</body>" * 90
    )
    many = "".join(f'<body><joint name="j{k}"/><geom size=".01"/></body>' for k in range(3000))
    contents: dict[str, Content] = {
        "a pipe": fifo, "a directory": directory, "a link to itself": itself, "empty": "", "no XML": "hello", "binary": bytes(range(256)),
        "UTF-16": model.encode("utf-16"), "cut": model[: len(model) // 2], "deep": "<mujoco>" + "<a>" * 100_000, "20 MB": " " * 20_000_000,
        "entities": '<!DOCTYPE a [<!ENTITY b "' + "x" * 1000 + '"><!ENTITY c "' + "&b;" * 1000 + '">]><mujoco>&c;</mujoco>', "NUL": model.replace("mass", "m\0ss", 1),
        "include": model.replace("<worldbody>", '<include file="/etc/passwd"/><worldbody>'), "another root": "<robot/>", "two roots": model + model,
        "nan": model.replace('mass="', 'mass="nan ', 1), "5000 digits": model.replace('mass="', f'mass="{HUGE}', 1),
        "1e308": model.replace('mass="', 'mass="1e308', 1), "unknown tag": model.replace("<worldbody>", "<nobody/><worldbody>"),
        "unknown attribute": model.replace("<worldbody>", '<worldbody nobody="1">'), "plugin": model.replace("<worldbody>", '<extension><plugin plugin="x"/></extension><worldbody>'),
        "mechanism unknown": re.sub(r'(name="mechanism"\s+data=")\w+', r"\1nobody", model), "no sites": re.sub(r"<site [^>]*/>", "", model),
        "no equality": re.sub(r"<equality>.*?</equality>", "", model, flags=re.S), "no joints": re.sub(r"<joint [^>]*/>", "", model),
        "surrogate": model.encode() + b"\xed\xa0\x80", "a tag of 1 MB": "<mujoco><" + "a" * 1_000_000 + "/></mujoco>",
    }  # fmt: skip
    for what, content in contents.items():
        for command in (("model", "show", "bad.xml"), ("model", "set", "bad.xml", "m1=1.0", "--out", "out.xml"), ("workspace", "bad.xml", "--out", "out"),
                        ("run", "good.toml", "--model", "bad.xml", "--quick", "--no-pictures", "--out", "out")):  # fmt: skip
            yield Bad(
                f"model: {what}: {' '.join(command[:2])}", command, {"bad.xml": content, "good.toml": SMALL}, "bad.xml"
            )
        yield Bad(f"model: {what}: check", ("model", "check", "bad.xml"), {"bad.xml": content}, codes=(1, 2))
    for what, body in {"3000 joints": many, "90 joints in a row": chain}.items():
        files = {"bad.xml": f"<mujoco><worldbody>{body}</worldbody></mujoco>", "good.toml": SMALL}
        yield Bad(
            f"model: {what}: run",
            ("run", "good.toml", "--model", "bad.xml", "--quick", "--out", "out"),
            files,
            "bad.xml",
        )
        check = ("model", "check", "bad.xml")
        yield Bad(f"model: {what}: check", check, files, codes=(2,) if body is many else (0, 1, 2))


# --- formulas ---------------------------------------------------------------------------------------------------------

BEFORE = "import functools\nimport numpy as np\nimport workbench\n"
MINE = '@workbench.candidate("mine", reference="distributed")\n'


def function(body: str, head: str = MINE, arguments: str = "p, q, qd, qdd") -> str:
    return f"{BEFORE}{head}def mine({arguments}):\n    {body}\n"


def formulas() -> Iterator[Bad]:
    run = (*RUN, "--candidates", "bad.py")
    liar = (
        BEFORE
        + "class Liar:\n    def __init__(self, q): self.shape, self.dtype, self.ndim = q.shape, q.dtype, 2\n"
        + "    def __array__(self, dtype=None, copy=None): return {}\n"
        + MINE
        + "def mine(p, q, qd, qdd): return Liar(q)\n"
    )
    sub = BEFORE + "class Own(np.ndarray):\n    {}\n" + MINE + "def mine(p, q, qd, qdd): return (0 * q).view(Own)\n"
    contents: dict[str, Content] = {
        "a pipe": fifo, "a directory": directory, "a link to itself": itself, "empty": "", "binary": bytes(range(256)), "a NUL": BEFORE + "\0",
        "UTF-16": function("return q").encode("utf-16"), "syntax": "def (:\n", "raises": "1 / 0\n",
        "exits": "raise SystemExit(0)\n", "exits at once": "import sys; sys.exit(5)\n", "deep": "a = " + "(" * 5000 + ")" * 5000,
        "deep sum": "a = " + "+".join("1" * 50_000), "5000 digits": f"a = {HUGE}\n", "20 MB": "#" * 20_000_000, "recursion": "def f(): f()\nf()\n",
        "keyboard": "raise KeyboardInterrupt\n", "base exception": "raise BaseException('x')\n", "generator exit": "raise GeneratorExit\n",
        "huge message": "raise ValueError('x' * 10_000_000)\n", "message raises": "class E(Exception):\n    def __str__(self): raise ValueError\nraise E\n",
        "bound true": function("return q", '@workbench.candidate("mine", bound=True)\n'), "bound nan": function("return q", '@workbench.candidate("mine", bound=float("nan"))\n'),
        "bound text": function("return q", '@workbench.candidate("mine", bound="x")\n'), "bound huge": function("return q", '@workbench.candidate("mine", bound=10**5000)\n'),
        "bound 0": function("return q", '@workbench.candidate("mine", bound=0)\n'), "bound inf": function("return q", '@workbench.candidate("mine", bound=float("inf"))\n'),
        "name slash": function("return q", '@workbench.candidate("a/b")\n'), "name number": function("return q", "@workbench.candidate(3)\n"),
        "name surrogate": function("return q", '@workbench.candidate("\\udfff")\n'), "name long": function("return q", '@workbench.candidate("a" * 10000)\n'),
        "name taken": function("return q", '@workbench.candidate("lumped")\n'), "name NUL": function("return q", '@workbench.candidate("a\\0")\n'),
        "reference unknown": function("return q", '@workbench.candidate("mine", reference="nobody")\n'), "reference number": function("return q", '@workbench.candidate("mine", reference=3)\n'),
        "description number": function("return q", '@workbench.candidate("mine", description=7)\n'), "source object": function("return q", '@workbench.candidate("mine", source=object())\n'), "three arguments": function("return q", arguments="p, q, qd"), "six arguments": function("return q", arguments="a, b, c, d, e, f"),
        "keyword": function("return q", arguments="p, q, qd, qdd, *, k"), "none": function("return None"), "text": function("return 'x'"), "wrong shape": function("return q[:, :2]"),
        "scalar": function("return 1.0"), "nan": function("return q * np.nan"), "inf": function("return q + np.inf"), "complex": function("return q + 1j"), "objects": function("return np.array([[object()] * 3] * len(q))"),
        "ragged": function("return [[1], [2, 3]]"), "generator": function("yield q"), "coroutine": BEFORE + MINE + "async def mine(p, q, qd, qdd): return q\n", "raises in call": function("1 / 0"),
        "exits in call": function("raise SystemExit(0)"), "keyboard in call": function("raise BaseException('x')"), "recursion in call": function("return mine(p, q, qd, qdd)"),
        "writes": function("q[:] = 0; return q"), "memory": function("return np.zeros((10**6, 10**6))"), "lots of memory": function("return np.ones((30_000, 30_000))"),
        "huge message in call": function("raise ValueError('x' * 300_000_000)"), "message raises in call": "class E(Exception):\n    def __str__(self): raise ValueError\n" + function("raise E"),
        "wrong attribute": function("return p.nobody * q"), "dict": function("return {}"), "set": function("return {1, 2}"), "5000 digits in call": function("return [[10**5000] * 3] * len(q)"),
        "liar raises": liar.format("1 / 0"), "liar of another shape": liar.format("np.zeros((2, 2))"), "liar of objects": liar.format("[1]"), "liar that exits": liar.format("exec('raise SystemExit(0)')"),
        "subclass that finalizes badly": sub.format("def __array_finalize__(self, o): raise RuntimeError('x')"), "len lies": BEFORE + "class L(list):\n    def __len__(self): return 10**9\n" + MINE + "def mine(p, q, qd, qdd): return L([[0.0] * 3])\n",
        "endless sequence": BEFORE + "class S:\n    def __len__(self): return 10**12\n    def __getitem__(self, k): return 0.0\n" + MINE + "def mine(p, q, qd, qdd): return S()\n",
        "class": BEFORE + '@workbench.candidate("mine")\nclass Mine:\n    pass\n', "partial": BEFORE + 'mine = workbench.candidate("mine")(functools.partial(print))\n',
        "callable object": BEFORE + "class C:\n    def __call__(self): pass\n" + 'mine = workbench.candidate("mine")(C())\n', "builtin": BEFORE + 'mine = workbench.candidate("mine")(len)\n',
        "ufunc": BEFORE + 'mine = workbench.candidate("mine")(np.add)\n', "wraps itself": BEFORE + "def f(p, q, qd, qdd): return q\nf.__wrapped__ = f\n" + 'mine = workbench.candidate("mine")(f)\n',
        "signature lies": BEFORE + "def f(p, q, qd, qdd): return q\nf.__signature__ = 3\n" + 'mine = workbench.candidate("mine")(f)\n', "no candidate": BEFORE,
        "getattr raises": BEFORE + "class C:\n    def __call__(self): pass\n    def __getattr__(self, n): raise RuntimeError('x')\nc = C()\n",
        "no such name": BEFORE + "x = workbench.nobody\n",
    }  # fmt: skip
    for what, content in contents.items():
        # what goes wrong in a call is the formula's result: the run goes on, and its verdict says so
        called = "def mine(p, q, qd, qdd)" in content if isinstance(content, str) else False
        at_load = what in ("raises", "bound true") or any(
            word in what for word in ("bound", "name ", "reference", "twice", "coroutine")
        )
        codes = (2, 130) if what == "keyboard" else (1, 2) if called and not at_load else (2,)
        yield Bad(
            f"formula: {what}",
            run,
            {"bad.toml": SMALL, "bad.py": content},
            "" if "reference unknown" in what else "bad.py",
            codes,
        )


# --- options ----------------------------------------------------------------------------------------------------------


def options() -> Iterator[Bad]:
    robot = "models/asym_2rss_ppap.xml"
    good = {"good.toml": SMALL, "sweep.toml": SWEEP}
    run = ("run", "good.toml", "--quick", "--no-pictures", "--out", "out")
    for value in ("nobody=1", "a2", "a2=", "a2=x", "a2=nan", "a2=inf", "a2=1e999", f"a2={HUGE}", "=1", "a2=0", "a2=-1", "a2*=nan", "a2/=0", "a2=1_0", "a2=0x1", "\udcff=1",
                  "a2=\udcff", "a" * 100_000 + "=1", "a2==1", "a2+=1e300", "m1=1e300", ""):  # fmt: skip
        yield Bad(f"--set {value[:20]!a}", (*run, "--set", value), good)
        yield Bad(f"model set {value[:20]!a}", ("model", "set", robot, value, "--out", "out.xml"), good)
        yield Bad(f"workspace --set {value[:20]!a}", ("workspace", robot, "--set", value, "--out", "out"), good)
    for value in ("0", "-1", "nan", "inf", "x", "1e-9", "1e9", HUGE, ""):
        yield Bad(f"--grid {value[:20]}", ("workspace", robot, f"--grid={value}", "--out", "out"), good)
    for value in (
        "q1",
        "q1=",
        "q1=1",
        "q1=1:0",
        "q1=nan:1",
        "q1=0:inf",
        "nobody=0:1",
        "q1=0:1:2",
        "=0:1",
        "q1=9:10",
        "\udcff=0:1",
    ):
        yield Bad(f"--limit {value!a}", ("workspace", robot, "--limit", value, "--out", "out"), good)
    for name, values in {"--only": ("nobody", "", "\udcff", "a" * 100_000), "--engines": ("nobody", "", "mujoco,", "pinocchio", "\udcff"),
                         "--model": ("missing.xml", "", "a\0b", "/dev/null", "/dev/zero", "\udcff.xml", "a" * 5000), "--candidates": ("missing.py", "", "a\0b", "/dev/zero", "\udcff.py", "a" * 5000),
                         "--out": ("/dev/null", "a\0b", "a" * 5000, "good.toml", ".", "/proc/x", "good.toml/x")}.items():  # fmt: skip
        for value in values:
            yield Bad(
                f"run {name} {value[:20]!a}",
                (
                    "run",
                    "good.toml",
                    "--quick",
                    "--no-pictures",
                    *(() if name == "--out" else ("--out", "out")),
                    name,
                    value,
                ),
                good,
            )
    for value in ("0", "-1", "x", "1.5", HUGE):
        yield Bad(f"--jobs {value[:20]}", ("run", "sweep.toml", f"--jobs={value}", "--out", "out", "--dry-run"), good)
    for value in (
        "x",
        "tcp://",
        "tcp://nowhere.invalid:1",
        "tcp://127.0.0.1:1",
        "tls://127.0.0.1:1",
        "tcp://127.0.0.1:99999999",
        "ucx://a:1",
        "inproc://x",
        "http://a",
        "\udcff",
        "tcp://[::1",
        "wss://127.0.0.1:1",
    ):
        yield Bad(
            f"--scheduler {value!a}",
            ("run", "sweep.toml", "--quick", "--out", "out", f"--scheduler={value}"),
            good,
            "scheduler",
        )
    for value in ("0x0", "x", "640", "640x", "-1x5", "99999x99999", "1x1", HUGE + "x1", "640x480x2"):
        yield Bad(f"--size {value[:20]}", ("model", "render", robot, "--out", "a.png", f"--size={value}"), good, "")
    for name, values in {"--fps": ("0", "-1", "nan", "inf", "1e-300", "x"), "--speed": ("0", "-1", "nan", "inf", "1e300", "x"), "--start": ("nan", "inf", "-5", "99", "x"),
                         "--stop": ("nan", "inf", "-5", "99", "x"), "--case": ("nobody", "", "\udcff"), "--camera": ("nobody", "", "\udcff")}.items():  # fmt: skip
        for value in values:
            yield Bad(
                f"render {name} {value!a}",
                ("model", "render", robot, "--out", "a.gif", "--campaign", "good.toml", f"{name}={value}"),
                good,
                "",
            )
    for value in ("a.bmp", "a", "", "a\0.png", "missing/a.png", ".", "/dev/null/a.png", "a" * 5000 + ".png", "a.gif"):
        yield Bad(f"render --out {value[:20]!a}", ("model", "render", robot, "--out", value), good, "")
    for value in ("0", "-1", "nan", "inf", "x", "0.5"):
        yield Bad(f"compare --factor {value}", ("compare", "run", "run", f"--factor={value}"), {}, "factor")
        yield Bad(f"watch --factor {value}", ("watch", "good.toml", f"--factor={value}"), good, "factor")
    for value in ("-1", "nan", "inf", "x"):
        yield Bad(f"compare --floor {value}", ("compare", "run", "run", f"--floor={value}"), {}, "floor")
    for value in ("nobody", "", "\udcff", "HTML", "a\0"):
        yield Bad(f"report --format {value!a}", ("report", "run", f"--format={value}"), {}, "format")
        yield Bad(f"report --style {value!a}", ("report", "run", f"--style={value}"), {}, "style")
    for command in ("report", "status", "compare"):
        for place in ("nowhere", "", "good.toml", "/dev/null", "a\0b", "\udcff", "a" * 5000, "."):
            if (command, place) == ("compare", "good.toml"):
                continue  # a campaign is computed for the comparison
            yield Bad(f"{command} {place[:20]!a}", (command, place, *(("run",) if command == "compare" else ())), good)
    for value in ("", "..", "a\0b", "\udcff", "a" * 5000, "-"):
        yield Bad(f"new {value[:20]!a}", ("new", "--", value), good, "")
    for arguments in (("run",), ("rum",), ("run", "a", "b"), ("run", "good.toml", "--nobody"), ("model",), ("model", "nobody"), ("compare", "run"), ("status",), ("report",), ("workspace",),
                      ("run", "nobody"), ("run", ""), ("run", "\udcff.toml"), ("run", "a\0b"), ("run", "/dev/zero"), ("run", "/dev/null"), ("run", "/proc/self/mem"), ("watch", "nobody.toml"), ("watch",),
                      ("model", "set", robot), ("model", "set", robot, "a2=0.3"), ("model", "set", robot, "a2=0.3", "--out", "x.xml", "--in-place"), ("model", "set", robot, "a2=0.3", "--in-place"),
                      ("model", "set", robot, "a2=0.3", "--out", "/dev/null"), ("model", "set", robot, "a2=0.3", "--out", "no/x.xml"), ("model", "set", robot, "a2=0.3", "--out", "a\0b"),
                      ("model", "check", robot, "--campaign", "nobody.toml"), ("run", "good.toml", "--dry-run", "--set", "a2*=2"), ("run", "sweep.toml", "--set", "a2*=2")):  # fmt: skip
        yield Bad(
            f"usage: {' '.join(arguments)[:50]!a}",
            arguments,
            good,
            codes=(0, 2) if arguments in (("model",), ("run",)) else (2,),
        )


def all_bad(model: str) -> list[Bad]:
    return [*campaigns(), *motions(), *models(model), *formulas(), *options()]
