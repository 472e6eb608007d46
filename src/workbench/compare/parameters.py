"""What two runs' robots differ in: each change once, with the cases that it concerns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from workbench.campaign.changed import among, few
from workbench.report.manifest import Manifest
from workbench.report.tables import NOT_COMPUTED

Values = Mapping[str, float | None]


def parameter_changes(old: Manifest, new: Manifest) -> Iterator[tuple[str, float | None, float | None]]:
    """Yield names, with the cases where they are not all that both runs have, the value before and the value after.

    Parameters that changed alike stand together: ``a1_left, a1_right``. None is a value that a run does not have.
    """
    shared = [name for name in new.cases if name in old.cases]
    found: dict[tuple[str, float | None, float | None], list[str]] = {}
    for case in shared:
        before, after = _values(old, case), _values(new, case)
        for name in dict.fromkeys([*before, *after]):
            if before.get(name) != after.get(name):
                found.setdefault((name, before.get(name), after.get(name)), []).append(case)
    alike: dict[tuple[float | None, float | None, tuple[str, ...]], list[str]] = {}
    for (name, was, becomes), cases in found.items():
        alike.setdefault((was, becomes, tuple(cases)), []).append(name)
    for (was, becomes, concerned), names in alike.items():
        yield f"{few(names)}{among(concerned, shared)}", was, becomes


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
