"""Keys of the page; they stand in the command palette, too."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from workbench.studio.page import Page


def add_keys(page: Page) -> None:
    """Let keys do what buttons do."""
    gui: Any = page.server.gui
    for label, key, modifier, act in (
        ("Play or pause", "space", None, page.toggle),
        ("Worst moment", "W", None, page.worst),
        ("Undo", "Z", "cmd/ctrl", partial(page.step, "Undo")),
        ("Redo", "Z", "cmd/ctrl+shift", partial(page.step, "Redo")),
        (page.back_words(), "B", "shift", partial(page.step, "Back")),
    ):
        command = gui.add_command(label, hotkey=key, modifier=modifier)
        command.on_trigger(partial(_triggered, act))


def _triggered(act: Callable[[], object], _: Any) -> None:
    act()
