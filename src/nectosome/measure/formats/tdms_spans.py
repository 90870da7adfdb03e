"""Where in a TDMS file the values of a channel are, so that some rows are read without the rest of their segment.

npTDMS reads whole chunks at once, and a file that LabVIEW has defragmented is a single chunk.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

if TYPE_CHECKING:
    from nptdms.tdms_segment import TdmsSegment

_SPAN = np.dtype([(name, np.int64) for name in ("base", "stride", "offset", "count", "chunks", "big")])
_WIDE = 2**16  # bytes of a chunk from which on a channel's part of it is read alone
_BATCH = 2**25  # bytes read at once at most

STAMP = np.dtype([("fractions", "<u8"), ("seconds", "<i8")])
"""A time: seconds since 1904, and 2^-64 of seconds."""


class Bytes:
    """A file that remembers what it read last, which in interleaved data is wanted by each channel."""

    def __init__(self, file: BinaryIO):
        self._file, self._last, self._read = file, (0, 0), b""

    def read(self, position: int, size: int) -> bytes:
        """Return `size` bytes from `position` on. Raises EOFError where there are fewer."""
        if self._last != (position, size):
            self._file.seek(position)
            self._last, self._read = (position, size), self._file.read(size)
        if len(self._read) < size:
            raise EOFError
        return self._read


class Spans:
    """The raw values of a channel, in runs of equal chunks.

    A chunk has `stride` bytes, of which from `offset` on `count` values belong to the channel; a run of `chunks` begins
    at byte `base`. An interleaved segment is a run of chunks with one value of each channel.
    """

    def __init__(self, file: Bytes, spans: list[tuple[int, ...]], dtype: np.dtype[Any]):
        self._file, self._spans = file, np.array(spans, _SPAN)
        self._ends = np.cumsum(self._spans["count"] * self._spans["chunks"])
        self.shape, self.dtype = (int(self._ends[-1]) if spans else 0,), dtype

    def __getitem__(self, rows: slice) -> np.ndarray:
        start, stop, _ = rows.indices(self.shape[0])
        values = np.empty(max(stop - start, 0), self.dtype)
        row = start
        while row < stop:
            i = int(np.searchsorted(self._ends, row, side="right"))
            end = min(stop, int(self._ends[i]))
            skipped = row - (int(self._ends[i - 1]) if i else 0)
            self._fill(values[row - start : end - start], skipped, *map(int, self._spans[i].item()))
            row = end
        return values

    def _fill(
        self, values: np.ndarray, first: int, base: int, stride: int, offset: int, count: int, chunks: int, big: int
    ) -> None:
        """Read values of one run, from its `first` on."""
        dtype = _big_endian(self.dtype) if big else self.dtype
        done = 0
        while done < len(values):
            chunk, skip = divmod(first + done, count)
            if stride >= _WIDE:
                wanted = min(count - skip, len(values) - done, _BATCH // dtype.itemsize)
                position = base + chunk * stride + offset + skip * dtype.itemsize
                read = np.frombuffer(self._file.read(position, wanted * dtype.itemsize), dtype)
            else:
                several = min(-(-(skip + len(values) - done) // count), _BATCH // stride)
                raw = np.frombuffer(self._file.read(base + chunk * stride, several * stride), np.uint8)
                own = raw.reshape(several, stride)[:, offset : offset + count * dtype.itemsize]
                read = own.copy().view(dtype).ravel()[skip : skip + len(values) - done]
            values[done : done + len(read)] = read[list(self.dtype.names)] if self.dtype.names else read
            done += len(read)


def spans(segments: "list[TdmsSegment]", path: str) -> list[tuple[int, ...]] | None:
    """Return the runs of the channel of that `path` for `Spans`; None if some of it is raw data of DAQmx."""
    from nptdms.common import toc_properties
    from nptdms.daqmx import DaqmxSegmentObject

    runs: list[tuple[int, ...]] = []
    for segment in segments:
        here = segment.get_segment_object(path)
        if here is None or not here.has_data or not segment.num_chunks:
            continue
        if isinstance(here, DaqmxSegmentObject):
            return None
        big = int(bool(segment.toc_mask & toc_properties["kTocBigEndian"]))
        runs += [(*run, big) for run in _runs(segment, path, segment.toc_mask & toc_properties["kTocInterleavedData"])]
    return runs


def _runs(segment: Any, path: str, interleaved: int) -> Iterator[tuple[int, int, int, int, int]]:
    """Base, stride, offset, count, chunks of the runs in a segment: its whole chunks, and a last one cut short."""
    objects = [o for o in segment.ordered_objects if o.has_data]
    at = next(i for i, o in enumerate(objects) if o.path == path)
    here, before = objects[at], objects[:at]
    kept = segment.final_chunk_lengths_override
    whole = segment.num_chunks - (kept is not None)
    rest = kept.get(path, 0) if kept is not None else 0
    if interleaved:
        if any(o.number_values != here.number_values for o in objects):
            raise ValueError("interleaved channels of different lengths")
        width, offset = (sum(o.data_type.size for o in some) for some in (objects, before))
        yield segment.data_position, width, offset, 1, here.number_values * whole + rest
        return
    stride, offset = (sum(o.data_size for o in some) for some in (objects, before))
    if whole and here.number_values:
        yield segment.data_position, stride, offset, here.number_values, whole
    if rest and kept is not None:
        parts = [(o, kept.get(o.path, 0)) for o in before]
        offset = sum(o.data_size if n == o.number_values else o.data_type.size * n for o, n in parts)
        yield segment.data_position + whole * stride, offset + rest * here.data_type.size, offset, rest, 1


def _big_endian(dtype: np.dtype[Any]) -> np.dtype[Any]:
    return np.dtype([("seconds", ">i8"), ("fractions", ">u8")]) if dtype.names else dtype.newbyteorder(">")
