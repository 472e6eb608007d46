"""matplotlib, imported without settings of the current directory; whatever draws imports this first."""

from __future__ import annotations

from workbench.shielded import shielded

with shielded("MPLBACKEND"):
    import matplotlib as mpl

__all__ = ["mpl"]
