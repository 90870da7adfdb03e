"""Names of quantities of a file: free ones, and doubts where a sheet may have mixed up its columns."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from nectosome.units import InputError, shorten

from .channels import Channel
from .formats.headings import split_unit
from .formats.source import TableSource


def named_channels(
    channels: Sequence[Channel], conditions: Iterable[str], taken: str, file: str
) -> tuple[list[Channel], list[str]]:
    """Return quantities with names that are free, and notes on those that got another; `taken` is the coordinate.

    Raises InputError for a condition that has the name of a quantity.
    """
    names = {channel.name for channel in channels}
    for name in conditions:
        if name in names:
            raise InputError("is a column of the file, too. Give the condition another name.", file=file, field=name)
    given, notes = list(channels), list[str]()
    for k, channel in enumerate(channels):
        if channel.name == taken:
            name = next(free for n in range(2, len(names) + 3) if (free := f"{taken} ({n})") not in names)
            given[k] = replace(channel, name=name)
            notes.append(f"the column {taken} is a quantity, named {name}, as {taken} is the coordinate")
    return given, notes


def doubtful_names(
    source: TableSource, chosen: Mapping[str, int | str | None], channels: Sequence[Channel], time: Mapping[int, str]
) -> list[str]:
    """Return warnings of columns that a sheet may have mixed up.

    `chosen` is what it says of the column of each quantity, and `time` the fields with the clocks, by their column.
    """
    notes = list[str]()
    of_column: dict[int, list[str]] = defaultdict(list)
    by_name: dict[str, list[int]] = defaultdict(list)
    for k, column in enumerate(source.columns):
        by_name[split_unit(column.heading).name if column.heading else column.name].append(k)
    for channel in channels:
        if channel.name not in chosen:
            continue
        of_column[channel.index].append(channel.name)
        if channel.index in time:
            notes.append(f"{channel.name}: is the column of the {time[channel.index]}, {shorten(channel.source)}")
        same = by_name.get(channel.name, [])
        if same and channel.index not in same:
            why = f"is the column {shorten(channel.source)}; the file's own column {channel.name} is another"
            notes.append(f"{channel.name}: {why}")
        named = chosen[channel.name] or channel.name
        twins = by_name.get(str(named), [])
        if isinstance(named, str) and len(twins) > 1:
            places = " and ".join(str(source.columns[k].place) for k in twins[:8])
            first = source.columns[channel.index].place
            notes.append(f"{channel.name}: columns {places} are called {shorten(named)}; it is column {first}")
    for index, names in of_column.items():
        if len(names) > 1:
            notes.append(f"{', '.join(names[:8])}: are one column, {shorten(source.columns[index].name)}")
    return notes
