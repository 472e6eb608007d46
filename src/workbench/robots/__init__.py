"""Closed forms of parallel mechanisms. Nothing in this package imports MuJoCo."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from workbench.robots.base import Mechanism

MECHANISMS: dict[str, str] = {
    "asym_2rss_ppap": "workbench.robots.asym_2rss_ppap.closed_form:Asym2rssPpap",
    "planar_4rprp": "workbench.robots.planar_4rprp.closed_form:Planar4Rprp",
}
"""name in ``<custom><text name="mechanism">`` -> where its class is; imported when first asked for."""


def mechanism_class(name: str) -> type[Mechanism]:
    """Return the class of a mechanism by its name in `MECHANISMS`."""
    module, _, attribute = MECHANISMS[name].partition(":")
    found: type[Mechanism] = getattr(import_module(module), attribute)
    return found
