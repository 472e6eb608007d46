"""Where the panels stand: beside each other in a wide window, above each other where little room would be left."""

from __future__ import annotations

from typing import Any

NARROW, WIDE = 0.45, 1.0
"""Width over height of the scene: below the first, panels beside each other leave too little of it; above the second,
panels above each other need not be. A ratio, since the scene's pixels are not those of the window."""
CONTROLS, RESULTS = 330, 350
"""Widths of the panels, px."""


class Panels:
    """The page's two panels, docked at the right edge; the first look of a browser says how."""

    def __init__(self, server: Any, answers: Any) -> None:
        self._main, self._answers, self._stacked = server.gui.main_panel, answers, False
        self._main.dock_right()
        self._main.set_width(CONTROLS)
        self._beside()
        server.on_client_connect(self._seen)

    def _beside(self) -> None:
        self._answers.dock_right()
        self._answers.set_width(RESULTS)

    def _seen(self, client: Any) -> None:
        """Stand as the window of the browser that came last has room; what is moved by hand afterwards stays."""
        shape = client.camera.aspect
        if not self._stacked and shape < NARROW:
            self._stacked = True
            self._answers.dock_below(self._main)
        elif self._stacked and shape > WIDE:
            self._stacked = False
            self._beside()
