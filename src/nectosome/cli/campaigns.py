"""Campaigns on the command line, and what of them is held out."""

from pathlib import Path
from typing import TYPE_CHECKING

from nectosome.io import InputError, did_you_mean

if TYPE_CHECKING:
    from nectosome.measure.campaign import Campaign


def planned_files(campaign: Path, test: list[str] | None) -> "tuple[Campaign, set[str]]":
    """A campaign, and its files that are not fitted. Raises InputError for one that it does not have."""
    from nectosome.measure import load_campaign

    planned = load_campaign(campaign)
    files = [one.path.name for one in planned.planned]
    for name in test or ():
        if name not in files:
            raise InputError(f'"{name}" is not in the campaign.{did_you_mean(name, files)}', field="--test")
    return planned, {*(test or ())}
