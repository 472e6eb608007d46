"""From the first to the last moment of a studio: start, watch the files, end."""

from __future__ import annotations

import time
from collections.abc import Callable

from workbench.studio.page import Page
from workbench.studio.server import Address, start_server
from workbench.studio.session import Session

LOOK_S = 0.5
"""Seconds between two looks at the files."""

QUIET_LOOKS = 1
"""Looks for which files have to stay as they are: editors write in several steps."""


def serve(
    session: Session,
    host: str,
    port: int,
    started: Callable[[Address], None],
    dark: bool = False,
    going_on: Callable[[], bool] = lambda: True,
) -> None:
    """Serve a page until Ctrl-C, or until the terminal closes; returns when everything is tidied up.

    Parameters
    ----------
    session
        What is shown.
    host, port
        Where; another port is taken where this one is in use.
    started
        Told the address.
    dark
        Begin dark.
    going_on
        Asked now and then; false ends it.

    Raises
    ------
    OutputError
        The host is no address of this machine.
    """
    server, address = start_server(host, port)
    page = None
    try:
        page = Page(server, session, dark)
        started(address)
        quiet = 0
        while going_on():
            time.sleep(LOOK_S)
            if not session.edited():
                quiet = 0
                continue
            quiet += 1
            if quiet > QUIET_LOOKS:
                quiet = 0
                page.read_again()
                page.worker.idle(timeout=60.0)
    finally:
        if page is not None:
            page.end()
        server.stop()
