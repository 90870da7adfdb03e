"""Options that several commands share, each with one spelling and one help, and readers of their text."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from nectosome.units import InputError, did_you_mean

if TYPE_CHECKING:
    from nectosome.measure import Campaign as PlannedCampaign


Robot = Annotated[str, Parameter(help="Name of a robot that ships, or a robot file.")]
Settings = Annotated[
    list[str] | None, Parameter("--set", help="Quantity to set, such as E=7.4MPa or f=1.5Hz; may be repeated.")
]
Loads = Annotated[
    bool, Parameter("--loads", help="Print force and power of each load on each part, and the energy of each part.")
]

Campaign = Annotated[Path | None, Parameter("--campaign", help="Campaign (.yaml): recordings and their conditions.")]


def planned_files(campaign: Path, test: list[str] | None) -> "tuple[PlannedCampaign, set[str]]":
    """A campaign, and its files that are not fitted. Raises InputError for one that it does not have."""
    from nectosome.measure import load_campaign

    planned = load_campaign(campaign)
    files = [one.path.name for one in planned.planned]
    for name in test or ():
        if name not in files:
            raise InputError(f'"{name}" is not in the campaign.{did_you_mean(name, files)}', field="--test")
    return planned, {*(test or ())}


def read_count(text: str, option: str, *, least: int, most: int) -> int:
    """Return a whole number from `least` to `most`. Raises InputError."""
    number = int(text) if re.fullmatch(r"-?\d{1,9}", text) else least - 1
    if not least <= number <= most:
        raise InputError(f'"{text}" must be a whole number from {least} to {most}.', field=option)
    return number
