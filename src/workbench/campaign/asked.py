"""The wanted accuracy that a campaign or a command line asks for: `workbench.campaign.good` answers."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.campaign.spec import Campaign, check_fraction
from workbench.errors import SpecError


def with_good(campaign: Campaign, good: float | None) -> Campaign:
    """Return the campaign with another wanted accuracy; None leaves its own.

    Raises
    ------
    SpecError
        No fraction between 0 and 1.
    """
    refuse_no_fraction(good)
    return campaign if good is None else campaign.model_copy(update={"good": good})


def refuse_no_fraction(good: float | None) -> None:
    """Refuse a wanted accuracy of the command line that is no fraction; None is nothing wanted.

    Raises
    ------
    SpecError
        No number between 0 and 1.
    """
    if good is not None:
        try:
            check_fraction(good)
        except ValueError as error:
            raise SpecError(f"--good {good:g}: {error}", key="good", value=good) from error


def check_asked(campaign: Campaign, where: str) -> None:
    """Refuse a wanted accuracy that nothing is held against.

    Raises
    ------
    SpecError
        Every formula has a bound, or there is none.
    """
    asked: Sequence[str] = [one.name for one in campaign.candidate if one.bound is None]
    if campaign.good is not None and not asked:
        raise SpecError(
            f"{where}: good = {campaign.good:g}: no formula without a bound, so nothing is held against it; a"
            " [[candidate]] without bound is measured",
            key="good",
            value=campaign.good,
        )
