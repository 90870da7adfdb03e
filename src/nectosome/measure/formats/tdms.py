"""LabVIEW's TDMS files: the channels of one group as columns."""

import logging
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nectosome.io.errors import InputError
from nectosome.measure.formats.arrays import ArraySource
from nectosome.measure.formats.faults import damage_told, foreign, head
from nectosome.measure.formats.items import Item, Other
from nectosome.measure.formats.source import Options, Source
from nectosome.measure.formats.tables import choose
from nectosome.measure.formats.tdms_channels import channel_of, whole_rows
from nectosome.measure.formats.tdms_clock import with_clock
from nectosome.measure.formats.tdms_spans import Bytes

if TYPE_CHECKING:
    from nptdms import TdmsFile
    from nptdms.tdms_segment import TdmsSegment


def open_tdms(path: Path, options: Options) -> Source:
    """Open a .tdms file, also one that LabVIEW did not finish; what is kept of that is told in `repairs`.

    Raises InputError for what is no such file, is damaged, or whose channels have no common length and clock.
    """
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    start = head(path)
    if not start.startswith(b"TDSm"):
        raise foreign(path, "a LabVIEW file (.tdms)", start)
    log_manager.set_level(logging.ERROR)  # what it warns of is told in `repairs`
    with damage_told(path), ExitStack() as stack:
        stream = stack.enter_context(path.open("rb"))
        file = TdmsFile.open(stream)  # a stream, so that a stale .tdms_index beside it is not looked at
        lost = _lost(file, path.stat().st_size)
        things = _inventory(file, Bytes(stream))
        if lost and not any(isinstance(thing, Item) for thing in things):
            raise InputError("holds no whole row of numbers: it is cut off before.")
        table = choose(things, options.table, beside=False)
        repairs = [f"{lost}; {table.rows} whole rows are kept."] if lost else []
        return ArraySource("tdms", path, table.blocks(), table.found, repairs, stack.pop_all().close)


def _inventory(file: "TdmsFile", stream: Bytes) -> list[Item | Other]:
    """The channels of all groups, with the time of each group."""
    segments, rows = _segments(file), whole_rows(file)
    things: list[Item | Other] = []
    for group in file.groups():
        channels = {channel.name: channel for channel in group.channels()}
        inside = [channel_of(file, group, c, stream, segments, rows.get(c.path, len(c))) for c in channels.values()]
        properties = {name: channel.properties for name, channel in channels.items()}
        things += with_clock([thing for thing in inside if isinstance(thing, Item)], properties)
        things += [thing for thing in inside if isinstance(thing, Other)]
    return things


def _lost(file: "TdmsFile", size: int) -> str:
    """How a file breaks off; "" if it does not."""
    segments = _segments(file)
    if file.file_status.incomplete_final_segment:
        return "the file ends within a segment, as when LabVIEW is stopped"
    end = segments[-1].next_segment_pos if segments else 0
    return f"the last {size - end} bytes are the beginning of a segment that was not written" if end < size else ""


def _segments(file: "TdmsFile") -> "list[TdmsSegment]":
    reader: Any = file._reader
    return reader._segments
