"""The time series of a case, column by column, as they are stored; docs/run-directory.md lists them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from workbench.arrays import FloatArray
from workbench.campaign.cases import Case
from workbench.campaign.platform import Platform
from workbench.campaign.recorded import Found
from workbench.reference import ReferenceResult


def series_of(
    case: Case,
    platform: Platform,
    results: Mapping[str, ReferenceResult],
    torques: Mapping[str, FloatArray],
    recorded: Sequence[Found],
) -> dict[str, FloatArray]:
    """Columns of the time series, in the order in which they are stored."""
    joints, first = case.robot.joints, platform.result
    series = _motion_columns(case) | platform.columns()
    for mass_model, result in results.items():
        series |= _columns(f"ref_{mass_model}", result.tau, joints)
    for name, tau in torques.items():
        series |= _columns(f"cand_{name}", tau, joints)
    for found in recorded:
        series |= _columns(f"rec_{found.spec.label}", found.tau, joints)
        series |= _columns(f"band_{found.spec.label}", found.band, joints)
    for joint, force in first.reactions.items():
        series |= {f"reaction_{joint}_{axis}": force[:, i] for i, axis in enumerate("xyz")}
    return series | {"closure_residual": first.closure_residual}


def _columns(prefix: str, values: FloatArray, joints: tuple[str, ...]) -> dict[str, FloatArray]:
    return {f"{prefix}_{joint}": values[:, i] for i, joint in enumerate(joints)}


def _motion_columns(case: Case) -> dict[str, FloatArray]:
    motion = case.motion
    columns: dict[str, FloatArray] = {"t": motion.t}
    for prefix, values in (("q", motion.q), ("qd", motion.qd), ("qdd", motion.qdd)):
        columns |= {f"{prefix}{i + 1}": values[:, i] for i in range(values.shape[1])}
    return columns
