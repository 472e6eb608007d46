"""What two runs' robots differ in: each change once, with the cases that it concerns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from workbench.campaign.changed import among, few
from workbench.compare.asked import shared_cases
from workbench.report.manifest import Manifest
from workbench.report.tables import NOT_COMPUTED

Values = Mapping[str, float | None]


@dataclass(frozen=True)
class ParameterChange:
    """Parameters that changed alike, SI; None is a value that a run does not have."""

    names: tuple[str, ...]
    before: float | None
    after: float | None
    where: str = ""
    """`` in CASE, CASE`` where it does not concern all cases that both runs have computed"""
    unit: str = ""
    meaning: str = ""
    by: str = ""
    """by what the second run has another number than its robot's source: ``--set``"""

    @property
    def what(self) -> str:
        """Names and cases in words."""
        return f"{few(self.names)}{self.where}"


def parameter_changes(old: Manifest, new: Manifest) -> Iterator[ParameterChange]:
    """Yield what changed from one run's robots to the other's; parameters that changed alike stand together."""
    shared = shared_cases(old, new)
    found: dict[tuple[str, float | None, float | None], list[str]] = {}
    for case in shared:
        before, after = _values(old, case), _values(new, case)
        for name in dict.fromkeys([*before, *after]):
            if before.get(name) != after.get(name):
                found.setdefault((name, before.get(name), after.get(name)), []).append(case)
    listed = {one.name: one for one in (*old.parameters, *new.parameters)}
    causes = {(one.name, one.after): one.by for one in new.changes.parameters}
    alike: dict[tuple[float | None, float | None, tuple[str, ...], str, str, str], list[str]] = {}
    for (name, was, becomes), cases in found.items():
        known = listed.get(name)
        told = (known.unit, known.meaning) if known else ("", "")
        alike.setdefault((was, becomes, tuple(cases), *told, causes.get((name, becomes), "")), []).append(name)
    for (was, becomes, concerned, unit, meaning, by), names in alike.items():
        yield ParameterChange(tuple(names), was, becomes, among(concerned, shared), unit, meaning, by)


def _values(manifest: Manifest, case: str) -> dict[str, float | None]:
    """Parameters of one case, as far as a run says them: those listed are the first computed case's."""
    listed = {parameter.name: parameter.value for parameter in manifest.parameters}
    first = next((name for name, record in manifest.cases.items() if record.status not in NOT_COMPUTED), case)
    if case == first:
        return listed
    changes = manifest.changes.parameters
    if changes or manifest.request is not None:
        base = listed | {one.name: one.before for one in changes if first in one.cases}
        return base | {one.name: one.after for one in changes if case in one.cases}
    # a run of an earlier version: it keeps what was overridden, by names of parameters and of groups
    unknown = _expanded(manifest, first)
    return {n: v for n, v in listed.items() if n not in unknown} | _expanded(manifest, case)


def _expanded(manifest: Manifest, case: str) -> dict[str, float | None]:
    names = [parameter.name for parameter in manifest.parameters]
    found: dict[str, float | None] = {}
    overrides = manifest.cases[case].parameters
    for name in sorted(overrides, key=lambda n: n in names):  # a member goes over its group
        members = [name] if name in names else [n for n in names if n.startswith(f"{name}_")]
        found |= dict.fromkeys(members or [name], overrides[name])
    return found
