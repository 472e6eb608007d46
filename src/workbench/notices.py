"""What somebody who waits should know: libraries do not print, so whoever shows notices subscribes to them."""

from __future__ import annotations

from collections.abc import Callable

subscribers: list[Callable[[str], None]] = []
"""Called with each notice, one line; the command line is one."""


def tell(notice: str) -> None:
    """Hand one line to all subscribers and, at level INFO, to the logger ``workbench``."""
    import logging

    logging.getLogger("workbench").info(notice)
    for subscriber in subscribers:
        subscriber(notice)
