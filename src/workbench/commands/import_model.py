"""``workbench new DIR --from FILE``: a robot folder from a real file."""

from __future__ import annotations

from pathlib import Path

from workbench.errors import ModelError, SpecError


def names_of(given: tuple[str, ...]) -> tuple[str, ...]:
    """Joint names of repeated options, each of which may list several with commas."""
    return tuple(name.strip() for one in given for name in one.split(",") if name.strip())


def import_model(source: Path, directory: Path, actuated: tuple[str, ...]) -> None:
    """Write the folder and say what was found.

    Raises
    ------
    SpecError
        A folder's name that cannot name a campaign.
    ModelError
        The reference refuses the file; the message is the reference's, and `workbench model check` lists all of it.
    """
    from rich.text import Text

    from workbench.commands.new import NAME
    from workbench.console import out
    from workbench.importing.proposal import propose
    from workbench.importing.write import write_folder

    if not NAME.fullmatch(directory.name):
        raise SpecError(f'DIR "{directory.name}"; allowed: letters, digits and _, first a letter, at most 40')
    found = propose(source, names_of(actuated))
    if found.problem:
        raise ModelError(f"{found.problem}; everything that was found: workbench model check {source}")
    campaign = write_folder(found, directory)
    for note in (*found.notes, *found.prepared.notes):
        out.print(Text(f"note: {note}"), soft_wrap=True)
    out.print(Text(f"{directory}: {found.model.name}, {campaign.name}; now"), soft_wrap=True)
    out.print(Text(f"  workbench run {campaign}"), soft_wrap=True)
