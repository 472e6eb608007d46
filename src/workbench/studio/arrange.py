"""Where the panels stand: beside each other in a wide window, above each other where little room would be left."""

from __future__ import annotations

from typing import Any

NARROW = 0.45
"""Width over height of the scene below which panels beside each other leave too little of it. A ratio, since the
scene's pixels are not those of the window."""
CONTROLS, RESULTS = 330, 350
"""Widths of the panels, px."""


class Panels:
    """The page's two panels, docked at the right edge."""

    def __init__(self, server: Any, answers: Any) -> None:
        self._main, self._answers, self._stacked = server.gui.main_panel, answers, False
        self._main.dock_right()
        self._main.set_width(CONTROLS)
        self._beside()
        server.on_client_connect(self._connected)

    def _beside(self) -> None:
        self._answers.dock_right()
        self._answers.set_width(RESULTS)

    def _connected(self, client: Any) -> None:
        self._seen(client)
        # its first shape is that of the whole window: the panels take their room only then
        client.camera.on_update(lambda _: self._seen(client))

    def _seen(self, client: Any) -> None:
        """Stand above each other, once and for all, where a browser's scene becomes too narrow."""
        if not self._stacked and client.camera.aspect < NARROW:
            self._stacked = True
            self._answers.dock_below(self._main)
