"""Reports of a campaign run: read the stored results, draw and write them; recompute nothing."""

from __future__ import annotations

import workbench.plotting  # noqa: F401  before anything that imports matplotlib
from workbench.report.build import build_report

__all__ = ["build_report"]
