"""The run that another one is compared with: as it lies, or a campaign that is computed for it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from workbench.report.load import Run
    from workbench.report.manifest import Manifest


@contextmanager
def run_before(path: Path, after: Manifest) -> Iterator[Run]:
    """Read the run in *path*; a campaign, or the name of one that comes along, is computed as it stands.

    It then has the cases of *after*, where the campaign knows them, and gathers the same evidence; formulas of the
    user's own are not run, since no option names them here.

    Raises
    ------
    WorkbenchError
        The run cannot be read, or the campaign not be computed.
    """
    from workbench.campaign.spec import campaign_names, load_campaign
    from workbench.report.load import load_run

    if path.is_dir() or not (path.suffix == ".toml" or str(path) in campaign_names()):
        yield load_run(path)
        return
    from workbench.campaign.evidence import Effort
    from workbench.campaign.run import run_campaign
    from workbench.scratch import scratch_directory
    from workbench.terminal import CaseProgress

    spec, _ = load_campaign(path)
    known = [case.name for case in spec.case if case.name in after.cases]
    effort = Effort(after.engines or ("mujoco",), budget=after.budget is not False)
    with scratch_directory() as folder:
        with CaseProgress() as progress:
            run_campaign(path, folder / "run", only=known, progress=progress, effort=effort)
        yield load_run(folder / "run")
