"""The core modules by group, and the tests that may notice a fault in them."""

from __future__ import annotations

from mutants.tree import ROOT, source_of

PACKAGE = ROOT / "src" / "workbench"

GROUPS: dict[str, tuple[str, ...]] = {
    "robots": ("robots/**/*.py", "dry_friction.py"),
    "reference": ("reference/**/*.py",),
    "comparison": ("campaign/compare.py", "campaign/unloaded.py", "campaign/evidence.py", "campaign/kinematics.py",
                   "campaign/platform.py", "campaign/torques.py"),
    "verdict": ("campaign/verdict.py", "campaign/candidate_spec.py", "campaign/claims.py"),
    "metrics": ("metrics.py",),
    "mjcf": ("mjcf/**/*.py",),
}  # fmt: skip
"""Patterns of files, below the package."""

CORE_TESTS = (
    "agreement", "asym_kernel", "asym_literal", "asym_mobility", "body_numbers", "campaign_run", "campaign_spec",
    "case_figures", "closure_kinds", "compare_case", "counted_forces", "errata", "friction", "fuzz_mechanisms",
    "hints", "idle_rods",
    "importing", "malformed_mechanisms", "mass_models", "metrics", "mjcf_assumptions", "mjcf_edit", "mjcf_roundtrip",
    "mjcf_safety", "mjcf_setup", "mjcf_source", "model_command", "models", "motion_along", "motion_platform",
    "negative_controls", "own_campaign", "own_reference", "pinocchio_reference", "planar_4rprp", "planar_4rprp_model",
    "platform_side", "random_robots", "reactions", "recorded", "reference_closure", "reference_dynamics",
    "reference_evidence", "reference_linear", "refusals", "robot_file", "robot_folder", "screws",
    "second_engine_campaigns", "sides", "speed_semantics", "task_coordinates", "terms", "tolerances", "urdf",
    "user_kinematics", "verdict",
)  # fmt: skip

KERNEL_TESTS: dict[str, tuple[str, ...]] = {
    "robots/asym_2rss_ppap/": ("asym_kernel", "asym_literal", "friction"),
    "robots/planar_4rprp/": ("planar_4rprp", "planar_4rprp_model", "friction"),
    "robots/": ("asym_kernel", "planar_4rprp", "friction"),
    "reference/platform_kernels": ("task_coordinates", "platform_side"),
    "reference/task_rows": ("task_coordinates", "platform_side"),
    "reference/": (
        "reference_linear", "closure_kinds", "own_reference", "reactions", "idle_rods", "counted_forces",
        "fuzz_mechanisms", "reference_dynamics",
    ),
}  # fmt: skip
"""Beginnings of the names of files with kernels, the first that fits: tests of the compiled kernels."""

UNCOMPILED = ("closure_kinds", "own_reference")
"""Of these the quickest."""

INTERPRETED_TESTS = ("reference_linear", "closure_kinds", "own_reference", "reactions", "idle_rods", "task_coordinates")
"""Small enough to run with all kernels uncompiled."""


GROUP_TESTS: dict[str, tuple[str, ...]] = {
    "metrics": ("metrics",),
    "verdict": ("verdict", "compare_case"),
    "comparison": ("verdict", "compare_case"),
    "mjcf": ("mjcf_setup", "mjcf_roundtrip", "mjcf_source", "mjcf_assumptions"),
    "robots": (
        "agreement",
        "body_numbers",
        "screws",
        "asym_literal",
        "planar_4rprp",
        "mass_models",
        "mjcf_roundtrip",
        "robot_file",
        "mjcf_assumptions",
        "mjcf_edit",
        "friction",
        "errata",
    ),
    "reference": ("reference_linear", "closure_kinds", "own_reference", "counted_forces", "reference_closure"),
}
"""The tests of each group that a short run tries, in this order, without knowing who reaches what."""


SHORT_TESTS: dict[str, tuple[str, ...]] = {
    "reference/check": ("mjcf_assumptions", "own_reference"),
    "reference/closing": ("closure_kinds", "compiled_closure"),
    "reference/continuation": ("closure_kinds", "reference_closure", "motion_along"),
    "reference/left_out": ("refusals", "importing"),
    "reference/pinocchio": ("pinocchio_reference",),
    "reference/platform_": ("task_coordinates",),
    "reference/replay": ("counted_forces", "reference_evidence"),
    "reference/sides": ("sides",),
    "reference/survey": ("importing",),
    "reference/task_rows": ("task_coordinates",),
}  # fmt: skip
"""The same for files that other tests know better, by the beginnings of their names."""


def short_tests(group: str, module: str) -> list[str]:
    """Test files of a short run."""
    names = next((tests for start, tests in SHORT_TESTS.items() if module.startswith(start)), GROUP_TESTS[group])
    if is_kernel(module) and names is GROUP_TESTS[group]:
        names = UNCOMPILED if module.startswith("reference/") else KERNEL_TESTS[f"{module.rpartition('/')[0]}/"]
    return [test_file(name) for name in names]


def files_of(group: str) -> list[str]:
    """Files of a group, below the package."""
    found = {path for pattern in GROUPS[group] for path in PACKAGE.glob(pattern)}
    return sorted(path.relative_to(PACKAGE).as_posix() for path in found if path.name != "__init__.py")


def is_kernel(module: str) -> bool:
    """Whether a file is compiled to machine code, where no line can be watched."""
    # the package itself must not be imported here, see `mutants.trial`
    return "\nfrom workbench.compiled import " in source_of(module) or module.endswith("/kinds.py")


def kernel_tests(module: str) -> list[str]:
    """Test files for a file with kernels, those that ask most of it first."""
    return [
        test_file(name) for name in next(tests for start, tests in KERNEL_TESTS.items() if module.startswith(start))
    ]


def test_file(name: str) -> str:
    """Path of a test file, below the repository."""
    return f"tests/test_{name}.py"


def core_test_files() -> list[str]:
    """The core tests that there are."""
    return [test_file(name) for name in CORE_TESTS if (ROOT / test_file(name)).exists()]
