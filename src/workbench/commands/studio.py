"""``workbench studio``: a page on which parameters are moved and everything answers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from workbench.commands.assignments import settings
from workbench.errors import MissingExtraError

if TYPE_CHECKING:
    from workbench.studio.server import Address

MISSING = "the studio needs the extra studio: pip install 'parallel-robot-workbench[studio]' (viser {reason})"


def studio(
    what: Annotated[
        str | None,
        typer.Argument(
            metavar="[ROBOT | CAMPAIGN | RUN]",
            help="Folder or file of a robot, a campaign, the directory of a run, or a name that comes along.",
        ),
    ] = None,
    case: Annotated[str | None, typer.Option(metavar="CASE", help="Case to begin with. Default: the first.")] = None,
    set_: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Set a parameter in every case, SI.")
    ] = None,
    model: Annotated[
        Path | None, typer.Option(metavar="FILE", help="MJCF file in place of the campaign's own.")
    ] = None,
    candidates: Annotated[
        list[str] | None,
        typer.Option(metavar="FILE", help="File with formulas of your own, which is run; may be repeated."),
    ] = None,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Another address than this machine's own: others can see the page.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port; the next free one where it is in use.")] = 8765,
    dark: Annotated[bool, typer.Option("--dark", help="Begin dark.")] = False,
    open_: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = False,
) -> None:
    """Move a robot's parameters on a local page: scene, torques, errors, reach and reactions answer at once.

    Nothing is loaded from the internet and no file is changed. Ctrl-C ends it.
    """
    from workbench.errors import ParameterError
    from workbench.terminal import out

    try:
        import viser  # noqa: F401
    except ImportError as error:  # before anything is read: who lacks it wants to know at once
        raise MissingExtraError(MISSING.format(reason="is not installed")) from error
    from workbench.robots.catalogue import bundled_robots
    from workbench.studio.life import serve
    from workbench.studio.session import Session
    from workbench.studio.subject import open_subject

    values, relative = settings(set_ or [])
    if relative:
        raise ParameterError(f"studio: --set {relative[0]}: allowed: NAME=VALUE; factors can be typed on the page")
    session = Session(
        open_subject(what or next(iter(bundled_robots())), model=model, settings=values, candidates=candidates or []),
        case,
    )

    def started(address: Address) -> None:
        out.print(f"workbench studio: {address.url}", soft_wrap=True, markup=False, highlight=False)
        if address.token:
            out.print("others who know this address, token and all, can see and move the page", soft_wrap=True)
        out.print(
            f"{session.subject.base.title}, case {session.wanted.case}; Ctrl-C ends", soft_wrap=True, markup=False
        )
        out.file.flush()
        if open_:
            import webbrowser

            webbrowser.open(address.url)

    try:
        serve(session, host, port, started, dark)
    except KeyboardInterrupt:
        out.print("stopped")
