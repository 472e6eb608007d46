"""The buttons that make a find reproducible."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

from workbench.errors import WorkbenchError
from workbench.studio.reproduce import campaign_case, csv_of, model_command, model_diff, set_command, write_copy
from workbench.studio.session import Session

PICTURE = (1200, 1600)
"""Height and width of a picture, pixels."""

STYLE = (
    "white-space:pre-wrap;word-break:break-word;font:0.75rem/1.4 ui-monospace,monospace;padding:0.5em;margin:0 0.7em;"
    "border:1px solid color-mix(in srgb,currentColor 25%,transparent);border-radius:4px;user-select:all"
)


class Keep:
    """Buttons, and a place where what they give can be read and copied."""

    def __init__(self, gui: Any, session: Session) -> None:
        self._gui, self._session = gui, session
        gui.add_markdown("What is shown, as something that others can run.")
        self._button("Command with --set", lambda: set_command(session))
        self._button("Campaign case", self._case)
        self._button("Lines of the model that change", self._diff)
        self._name = gui.add_text(
            "copy's name", initial_value=self._proposed(), hint="a new file, here; never replaced"
        )
        self._button("Write a copy of the model", self._copy)
        picture, table = gui.add_button("Picture (PNG)"), gui.add_button("Table (CSV)")
        self._said = gui.add_html("")

        @table.on_click
        def _(event: Any) -> None:
            name = f"{session.subject.campaign.name}-{session.good.state.case}.csv"
            self._send(event, name, csv_of(session.good).encode())

        @picture.on_click
        def _(event: Any) -> None:
            if event.client is not None:
                import imageio.v3

                image = event.client.get_render(height=PICTURE[0], width=PICTURE[1])
                self._send(
                    event, f"{session.subject.base.name}.png", imageio.v3.imwrite("<bytes>", image, extension=".png")
                )

    def _proposed(self) -> str:
        return f"{self._session.subject.model.stem}_changed.xml"

    def _button(self, label: str, make: Callable[[], str]) -> None:
        button = self._gui.add_button(label)

        @button.on_click
        def _(_: Any) -> None:
            try:
                self.say(label, make())
            except WorkbenchError as error:
                self.say(label, str(error))

    def say(self, label: str, text: str) -> None:
        """Show a text under the buttons; one click selects all of it."""
        head = f'<p style="margin:0.4em 0.7em"><b>{escape(label)}</b></p>'
        self._said.content = f'{head}<pre tabindex="0" style="{STYLE}">{escape(text)}</pre>'

    def _send(self, event: Any, name: str, content: bytes) -> None:
        if event.client is not None:
            event.client.send_file_download(name, content, save_immediately=True)

    def _case(self) -> str:
        text, files = campaign_case(self._session, "studio")
        where = self._session.subject.shown_campaign if self._session.subject.has_campaign else "a new file .toml"
        said = f"# for the end of {where}\n{text}"
        return "\n".join([said, *(f"# {name} beside it:\n{content}" for name, content in files.items())])

    def _diff(self) -> str:
        found = model_diff(self._session)
        if not found:
            return "nothing is changed"
        return f"# {model_command(self._session, self._name.value)}\n{found}"

    def _copy(self) -> str:
        return f"{write_copy(self._session, self._name.value.strip())} is written"
