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
    "engine_warnings", "hints", "idle_rods", "importing", "malformed_mechanisms", "mass_models", "metrics",
    "mjcf_assumptions", "mjcf_edit", "mjcf_roundtrip",
    "mjcf_safety", "mjcf_setup", "mjcf_source", "model_command", "models", "motion_along", "motion_platform",
    "negative_controls", "own_campaign", "own_reference", "pinocchio_reference", "planar_4rprp", "planar_4rprp_model",
    "plant_terms", "platform_side", "random_robots", "reactions", "recorded", "reference_closure",
    "reference_dynamics", "reference_evidence", "reference_linear", "reference_thresholds", "refusals",
    "robot_file", "robot_folder", "screws", "shelf",
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

INTERPRETED_TESTS = ("reference_linear", "closure_kinds", "own_reference", "reactions", "idle_rods", "task_coordinates")
"""Small enough to run with all kernels uncompiled."""

LOOPS = ("closure_kinds", "own_reference", "idle_rods", "reactions", "reference_thresholds")
"""Tests of all that closes loops; they take seconds, also uncompiled."""

SHORT_TESTS: dict[str, tuple[str, ...]] = {
    "metrics": ("metrics",),
    "campaign/": ("verdict", "compare_case"),
    "mjcf/engine_warnings": ("engine_warnings",),
    "mjcf/free_joints": ("mjcf_setup", "importing"),
    "mjcf/loop_table": ("urdf",),
    "mjcf/safety": ("mjcf_safety", "mjcf_source"),
    "mjcf/urdf": ("urdf",),
    "mjcf/": ("mjcf_setup", "mjcf_source", "mjcf_edit", "mjcf_safety", "mjcf_roundtrip"),
    "robots/asym_2rss_ppap/literal": ("asym_literal",),
    "robots/asym_2rss_ppap/mobility": ("asym_mobility", "mjcf_assumptions"),
    "robots/asym_2rss_ppap/kernel": ("asym_kernel", "asym_literal", "friction", "speed_semantics"),
    "robots/asym_2rss_ppap/": ("asym_kernel", "asym_literal", "friction"),
    "robots/planar_4rprp/kernel": ("planar_4rprp", "planar_4rprp_model", "friction", "speed_semantics"),
    "robots/planar_4rprp/": ("planar_4rprp", "planar_4rprp_model", "friction"),
    "robots/screws": ("screws", "planar_4rprp", "asym_mobility"),
    "robots/sine_cosine": ("speed_semantics", "asym_kernel"),
    "robots/blocks": ("speed_semantics", "asym_kernel", "planar_4rprp"),
    "robots/kernel_call": ("speed_semantics", "asym_kernel", "planar_4rprp"),
    "robots/limbs": ("turning",),
    "robots/turning": ("turning",),
    "robots/variants": ("variants",),
    "robots/mass_models": ("mass_models", "asym_kernel"),
    "robots/show": ("model_command", "mjcf_edit"),
    "robots/edit": ("mjcf_edit", "model_command"),
    "robots/robot_file": ("robot_file", "actuators"),
    "robots/actuators": ("robot_file", "actuators"),
    "robots/assumptions/": ("mjcf_assumptions", "robot_file"),
    "robots/": ("robot_file", "agreement", "body_numbers", "mjcf_roundtrip", "mjcf_assumptions", "mjcf_edit"),
    "dry_friction": ("friction",),
    "reference/along": ("motion_along", "sides"),
    "reference/alike": ("reference_evidence",),
    "reference/body_": ("terms", "counted_forces"),
    "reference/check": ("mjcf_assumptions", "own_reference"),
    "reference/continuation": ("closure_kinds", "reference_closure", "motion_along"),
    "reference/crossings": ("reference_thresholds", "importing"),
    "reference/displaced": ("reference_evidence",),
    "reference/forward": ("plant_terms", "control_routes"),
    "reference/left_o": ("refusals", "importing", "tolerances", "idle_rods"),
    "reference/linear": ("reference_linear", "closure_kinds"),
    "reference/pinocchio": ("reference_thresholds", "pinocchio_reference", "sides", "second_engine_campaigns"),
    "reference/platform_": ("task_coordinates", "platform_side"),
    "reference/power": ("reference_evidence", "counted_forces"),
    "reference/regressor": ("terms",),
    "reference/replay": ("counted_forces", "reference_evidence"),
    "reference/rods": ("idle_rods", "reference_closure"),
    "reference/shelf": ("shelf", "variants"),
    "reference/sides": ("sides",),
    "reference/skeleton": ("report_skeleton",),
    "reference/stiff_plant": ("control_plant",),
    "reference/survey": ("importing",),
    "reference/task": ("task_coordinates",),
    "reference/terms": ("terms",),
    "reference/tolerance": ("tolerances", "own_reference"),
    "reference/uncovered": ("refusals", "counted_forces"),
    "reference/varied_model": ("terms",),
    "reference/": (*LOOPS, "refusals", "counted_forces"),
}  # fmt: skip
"""Beginnings of names of files, the first that fits: the test files of a short run, which looks at no map of lines."""

UNCOMPILED_TESTS: dict[str, tuple[str, ...]] = {
    "reference/forward": ("plant_terms",),
    "reference/kinematics": ("compiled_closure", *LOOPS),
    "reference/linear": ("reference_linear", "closure_kinds"),
    "reference/platform_": ("task_coordinates",),
    "reference/sides": ("sides",),
    "reference/task_rows": ("seen_from_the_base", "task_coordinates"),
    "reference/": LOOPS,
}  # fmt: skip
"""The same for the reference's kernels, which are left uncompiled."""

LONGER_TESTS: dict[str, tuple[str, ...]] = {
    "campaign/": (
        "user_kinematics", "own_campaign", "case_figures", "negative_controls", "recorded", "errata", "campaign_run",
        "second_engine_campaigns", "campaign_spec", "statements",
    ),
    "mjcf/": ("mjcf_assumptions", "robot_file", "importing", "urdf", "engine_warnings", "variants", "own_campaign"),
    "robots/": (
        "model_command", "models", "variants", "agreement", "actuators", "mass_models", "robot_folder", "statements",
        "fuzz_mechanisms", "own_campaign", "library_formulas", "friction", "speed_semantics", "workspace",
    ),
    "reference/forward": ("control_plant", "control_routes", "seen_from_the_base", "plant_terms"),
    "reference/pinocchio": ("seen_from_the_base", "pinocchio_reference", "second_engine_campaigns"),
    "reference/platform_": ("task_coordinates", "platform_side"),
    "reference/stiff_plant": ("control_routes", "control_plant"),
    "reference/survey": (),
    "reference/task": ("seen_from_the_base", "task_coordinates", "platform_side"),
    "reference/": (
        "compiled_closure", "reference_closure", "motion_along", "reference_linear", "counted_forces", "tolerances",
        "large_machines", "reference_evidence", "variants", "shelf", "mjcf_assumptions", "seen_from_the_base", "sides",
        "platform_side", "plant_terms", "reference_thresholds", "task_coordinates", "scattered_branch", "model_command",
        "statements", "pinocchio_reference",
    ),
}  # fmt: skip
"""Test files that what survives a short run has to survive as well, compiled and however long a test takes."""


def short_tests(module: str) -> list[str]:
    """Test files of a short run."""
    table = UNCOMPILED_TESTS if is_kernel(module) and module.startswith("reference/") else SHORT_TESTS
    return [test_file(name) for name in next(tests for start, tests in table.items() if module.startswith(start))]


def longer_tests(module: str) -> list[str]:
    """Test files for what survives those of a short run."""
    for start, tests in LONGER_TESTS.items():
        if module.startswith(start):
            return list(dict.fromkeys([*map(test_file, tests), *short_tests(module)]))
    return []


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
