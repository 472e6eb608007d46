"""Workers that do to some cases what should never happen; for tests only, handed to the workers by name."""

from __future__ import annotations

import dataclasses
import os
import signal
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from sweep_tasks import suffer
from workbench.sweep import evaluate
from workbench.sweep.evaluate import Context


def faulty_setup(context: Context, faults: Mapping[int, str]) -> Callable[[Any], Any]:
    """Set up a worker as `Context.setup` does, with faults planted where cases are computed."""
    compute = evaluate.compute_case

    def planted(campaign: Any, case: Any, effort: Any) -> Any:
        fault = faults.get(int(case.name.rpartition("-")[2]), "")
        suffer(fault)
        result = compute(campaign, case, effort)
        if fault in ("nan", "inf"):
            rows = [dataclasses.replace(result.rows[0], peak_error=float(fault)), *result.rows[1:]]
            result = dataclasses.replace(result, rows=rows)
        return result

    evaluate.compute_case = planted
    return context.setup()


def once_setup(context: Context, marker: str, index: int) -> Callable[[Any], Any]:
    """Set up a worker that kills itself the first time it meets a case, and never again."""
    compute = evaluate.compute_case

    def planted(campaign: Any, case: Any, effort: Any) -> Any:
        if int(case.name.rpartition("-")[2]) == index and not os.path.exists(marker):
            with open(marker, "w"):
                os.kill(os.getpid(), signal.SIGKILL)
        return compute(campaign, case, effort)

    evaluate.compute_case = planted
    return context.setup()


def with_faults(faults: Mapping[int, str]) -> Callable[[Context], Any]:
    """Return what stands in for ``context.setup``."""
    return lambda context: partial(faulty_setup, context, dict(faults))
