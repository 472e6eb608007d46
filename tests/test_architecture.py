"""Imports go one way, downwards; and a few more rules of the house that a machine can check.

Each rule has a twin: a planted violation in a temporary tree that the checker must find.
"""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

PACKAGE = "workbench"
MAX_LINES = 400

LAYERS: tuple[tuple[str, ...], ...] = (
    ("__main__", "cli", "commands", "console", "terminal"),
    ("studio",),
    ("report", "compare", "rendering"),
    ("control",),
    ("sweep", "diagnosis", "importing", "library"),
    ("campaign", "workspace"),
    ("capabilities",),
    ("recorded",),
    ("reference",),
    ("robots",),
    ("mjcf",),
    (
        "motion",
        "delimited",
        "foreign",
        "hints",
        "metrics",
        "demand",
        "dry_friction",
        "staging",
        "compiled",
        "notices",
        "arrays",
        "errors",
        "data_files",
        "limits",
        "no_exit",
        "processes",
        "drawing_process",
        "reading",
        "parquet_columns",
        "output_file",
        "records",
        "file_lock",
        "scratch",
        "shielded",
        "plotting",
        "schema",
        "documents",
        "_version",
    ),
)
"""Top to bottom; a module may import its own layer and those below. The package's own __init__ may import any."""

ENGINE_LAYERS = ("mjcf", "robots", "reference", "capabilities", "rendering")
"""The only places that may import mujoco; rendering, since MuJoCo draws the models."""

CLOSED_FORMS = tuple(
    f"{PACKAGE}.robots.{path.parent.name}"
    for path in sorted((Path(__file__).resolve().parents[1] / "src" / PACKAGE / "robots").glob("*/robot.toml"))
)
"""Folders of robots: their formulas know neither the engine nor files, and nothing above knows one by name."""

HEAVY = ("mujoco", "numba", "pandas", "matplotlib", "scipy", "pinocchio")
"""What `import workbench` must not load."""


def layer_of(module: str) -> str | None:
    """Name of the layer of a dotted module; None for the package itself."""
    parts = module.split(".")
    if len(parts) == 1:
        return None
    return parts[1]


def is_closed_form(module: str) -> bool:
    return module.startswith(CLOSED_FORMS)


def rank(layer: str) -> int | None:
    return next((index for index, names in enumerate(LAYERS) if layer in names), None)


def module_name(path: Path, root: Path) -> str:
    parts = (PACKAGE, *path.relative_to(root).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported_modules(path: Path, root: Path) -> Iterator[tuple[int, str]]:
    """Line and absolute dotted name of each import, wherever it stands in the file, importlib's with a literal too."""
    module = module_name(path, root)
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            source = node.module or ""
            if node.level:
                parents = package.split(".")[: len(package.split(".")) - node.level + 1]
                source = ".".join([*parents, source]) if source else ".".join(parents)
            for alias in node.names:
                inner = root.joinpath(*source.split(".")[1:], alias.name)
                is_module = source.split(".")[0] == PACKAGE and (inner.is_dir() or inner.with_suffix(".py").is_file())
                yield node.lineno, f"{source}.{alias.name}" if is_module else source
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if called in ("import_module", "__import__") and isinstance(node.args[0].value, str):
                name = node.args[0].value
                yield node.lineno, f"{package}{name}" if name.startswith(".") else name


def findings_of_import(importer: str, imported: str) -> Iterator[str]:
    layer = layer_of(importer)
    top = imported.partition(".")[0]
    if top == "mujoco" and (layer not in ENGINE_LAYERS or is_closed_form(importer)):
        yield f"imports mujoco; only {' and '.join(ENGINE_LAYERS)} may, and no closed form"
    if top != PACKAGE or layer is None:
        return
    target = layer_of(imported)
    if target is None:
        yield "imports the package's own surface; name the module"
        return
    own, other = rank(layer), rank(target)
    if own is not None and other is not None and other < own:
        yield f"imports {imported}, a layer above"
    if is_closed_form(importer) and target == "mjcf":
        yield f"imports {imported}; a closed form knows no file"
    if layer == "report" and target == "reference":
        yield f"imports {imported}; a report reads stored results only"


def robots_named(path: Path) -> Iterator[tuple[int, str]]:
    """Lines that hold the name of a robot that comes with the package."""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        yield from ((number, name) for form in CLOSED_FORMS if (name := form.rpartition(".")[2]) in line)


def findings(root: Path) -> list[str]:
    """Every broken rule in the package directory *root*, as ``file:line what``."""
    found: list[str] = []
    for path in sorted(root.rglob("*.py")):
        where = path.relative_to(root).as_posix()
        layer = layer_of(module_name(path, root))
        if layer is not None and rank(layer) is None:
            found.append(f"{where}:1 is in no layer; give it one in {Path(__file__).name}")
        if path.name == "utils.py" or "utils" in path.relative_to(root).parts:
            found.append(f"{where}:1 name the concept, not utils")
        lines = len(path.read_text(encoding="utf-8").splitlines())
        if lines > MAX_LINES:
            found.append(f"{where}:{lines} more than {MAX_LINES} lines")
        if not is_closed_form(module_name(path, root)) and layer is not None:
            found += [f"{where}:{line} knows the robot {name} by name" for line, name in robots_named(path)]
        for line, imported in imported_modules(path, root):
            found += [f"{where}:{line} {text}" for text in findings_of_import(module_name(path, root), imported)]
    return found


def test_the_package_keeps_its_layers(repository: Path) -> None:
    root = repository / "src" / PACKAGE
    assert len(list(root.rglob("*.py"))) > 3
    assert findings(root) == []


CLEAN = {
    "__init__.py": "def __getattr__(name): from workbench.reference import MujocoReference",
    "cli.py": "from workbench.report import build",
    "report/__init__.py": "from workbench.campaign import store\nfrom . import figures",
    "report/figures.py": "import matplotlib",
    "campaign/__init__.py": "from workbench.reference import load\nfrom workbench.robots import load",
    "campaign/store.py": "import json",
    "reference/__init__.py": "import mujoco\nfrom workbench import mjcf\nfrom workbench.robots import base",
    "mjcf/text.py": "from mujoco import MjModel",
    "robots/edit.py": "import mujoco\nimport workbench.mjcf.text",
    "robots/base.py": "from workbench.arrays import as_batch",
    "robots/planar_4rprp/closed.py": "from workbench.robots.base import X\nfrom ...errors import WorkbenchError",
    "arrays.py": "from workbench.errors import ArrayError",
    "errors.py": "import difflib",
}

CLOSED = "robots/planar_4rprp/closed.py"
REFERENCE = "reference/__init__.py"
FOR_TYPES = "if TYPE_CHECKING:\n    import workbench.arrays\n    import workbench.cli"

PLANTED = {
    "a lower layer imports an upper one": ("arrays.py", "from workbench.robots import base", "a layer above"),
    "a relative import upwards": ("campaign/store.py", "from ..report import figures", "a layer above"),
    "a relative import of the package upwards": ("campaign/store.py", "from .. import cli", "a layer above"),
    "an import inside a function": ("campaign/store.py", "def f():\n    import workbench.cli", "a layer above"),
    "an import for types only": ("errors.py", FOR_TYPES, "a layer above"),
    "a closed form imports mujoco": (CLOSED, "import mujoco.batch", "imports mujoco"),
    "a closed form imports mujoco by its name": (CLOSED, "importlib.import_module('mujoco')", "imports mujoco"),
    "a closed form imports mjcf": (CLOSED, "from workbench import mjcf", "knows no file"),
    "a closed form imports the text of a model": (CLOSED, "import workbench.mjcf.text", "knows no file"),
    "mjcf knows a robot": ("mjcf/text.py", "from workbench.robots import base", "a layer above"),
    "a closed form imports the reference": (CLOSED, "from workbench.reference import load", "a layer above"),
    "a campaign tells robots apart": ("campaign/store.py", "if name == 'planar_4rprp': pass", "by name"),
    "a report imports the reference": ("report/figures.py", "from workbench.reference import load", "stored results"),
    "a report imports mujoco": ("report/figures.py", "import mujoco", "imports mujoco"),
    "a campaign imports mujoco": ("campaign/store.py", "from mujoco import mj_step", "imports mujoco"),
    "a module imports the surface": (CLOSED, "import workbench", "name the module"),
    "a long file": ("cli.py", "\n" * (MAX_LINES + 1), "more than 400 lines"),
    "a module in no layer": ("helpers.py", "", "in no layer"),
    "a utils module": ("campaign/utils.py", "", "name the concept"),
    "a utils package": ("campaign/utils/__init__.py", "", "name the concept"),
}


@pytest.fixture
def tree(tmp_path: Path) -> Callable[[dict[str, str]], Path]:
    def write(files: dict[str, str]) -> Path:
        for name, text in files.items():
            path = tmp_path / PACKAGE / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        return tmp_path / PACKAGE

    return write


def test_the_checker_accepts_a_clean_tree(tree: Callable[[dict[str, str]], Path]) -> None:
    assert findings(tree(CLEAN)) == []


@pytest.mark.parametrize(("name", "text", "finding"), PLANTED.values(), ids=PLANTED)
def test_the_checker_finds_a_planted_violation(
    tree: Callable[[dict[str, str]], Path], name: str, text: str, finding: str
) -> None:
    found = findings(tree({**CLEAN, name: text}))
    assert len(found) == 1, found
    assert found[0].startswith(f"{name}:")
    assert finding in found[0]


def loaded_by(statement: str, directory: Path) -> list[str]:
    """Names of heavy packages that a fresh interpreter holds after *statement*, with *directory* on its path."""
    code = f"import sys; {statement}; print(*[n for n in {HEAVY!r} if n in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=directory,
        env=os.environ | {"PYTHONPATH": str(directory)},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_importing_the_package_loads_nothing_heavy(repository: Path) -> None:
    assert loaded_by("import workbench", repository / "src") == []


def test_the_check_of_heavy_imports_sees_one(tmp_path: Path) -> None:
    (tmp_path / "planted.py").write_text("import scipy", encoding="utf-8")
    assert loaded_by("import planted", tmp_path) == ["scipy"]


MACHINE_TRACES = {
    "a home or working directory of one machine": re.compile(
        r"(?<![\w.:/~-])/(?:home|root|Users|work|mnt)/[\w.]|[A-Z]:\\+Users\\"
    ),
    "the address of a package index": re.compile(
        r"\b(?:pypi|pythonhosted)\.org\b|https?://[^/\s]*(?:artifactory|jfrog|nexus|devpi|pypi|registry)[^/\s]*"
        r"|(?:index[-_]url|find[-_]links)\W{1,6}(?:https?:|file:|/)",
        re.IGNORECASE,
    ),
}


def traces(text: str) -> list[str]:
    return [what for what, pattern in MACHINE_TRACES.items() if pattern.search(text)]


def test_committed_files_hold_no_trace_of_a_machine(repository: Path) -> None:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=repository, capture_output=True, text=True)
    if listed.returncode != 0 or not listed.stdout:
        pytest.skip("not a git checkout")
    found = []
    for name in filter(None, listed.stdout.split("\0")):
        path = repository / name
        data = path.read_bytes() if path.is_file() else b"\0"
        if b"\0" in data:
            continue  # binary, or deleted and not yet committed
        found += [f"{name}: {what}" for what in traces(data.decode("utf-8", errors="replace"))]
    assert found == []


@pytest.mark.parametrize(
    "text",
    [
        "see /" + "home/ann/model.xml",
        "path = '/" + "root/.cache'",
        "C:" + "\\Users\\ann",
        "https://py" + "pi.org/simple",
        "files.python" + "hosted.org",
        "--index" + "-url https://mirror.example/simple",
        "https://" + "artifactory.example.com/api",
    ],
)
def test_the_check_of_traces_sees_one(text: str) -> None:
    assert len(traces(text)) == 1


@pytest.mark.parametrize(
    "text", ["https://example.org/home/page", "~/work/x", "reports/work/a.md", "/usr/bin/env python3", "network/home/x"]
)
def test_the_check_of_traces_lets_others_pass(text: str) -> None:
    assert traces(text) == []


def test_constraints_are_names_and_versions_only(repository: Path) -> None:
    lines = (repository / "constraints.txt").read_text(encoding="utf-8").splitlines()
    entries = [line for line in lines if line and not line.startswith("#")]
    assert len(entries) > 20
    assert [line for line in entries if not re.fullmatch(r"[a-z0-9][a-z0-9.-]*==[0-9][0-9a-z.]*", line)] == []
