"""Text files with a table of numbers: their encoding, their blocks of lines, and the table as a TableSource."""

import codecs
import io
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from nectosome.io.file_system import reason
from nectosome.measure.formats.headings import Labels, distinct, find_label, is_time, split_unit, split_units
from nectosome.measure.formats.program_heads import begins_section, has_sections
from nectosome.measure.formats.source import Column, Options, Piece, TableSource
from nectosome.measure.formats.text_dialect import BLANKS, COMMENT, DECIMALS, DELIMITERS, MISSING, CellKind, kind, split
from nectosome.measure.formats.text_table import TextLayout, TextRows, find_layout
from nectosome.units import InputError, shorten
from nectosome.units import count as count_of

from .file_errors import check_columns, damage_as_input_error, first_bytes, is_binary, wrong_format

ENDINGS = ".csv", ".tsv", ".txt", ".dat", ".asc", ".lvm", ".log"

BLOCK = 1 << 20  # [bytes], about where pandas is fastest
_LONGEST = 1 << 24  # line [characters]
_BOMS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
_SAMPLE = 2000  # lines from which the layout is found


class TextBlock(NamedTuple):
    """Consecutive lines with their line ends; only the last line of the file may lack one."""

    line: int  # number of the first one, from 1
    raw: bytes  # UTF-8, lines end in LF
    lines: int  # number of line ends
    last: bool  # whether this is the end of the file


def find_encoding(head: bytes) -> str:
    """Return the encoding of a text that begins with `head`: that of its byte order mark, else UTF-8 if possible."""
    for mark, encoding in _BOMS.items():
        if head.startswith(mark):
            return encoding
    for encoding in ("utf-8", "cp1252"):
        try:
            # incremental, since `head` may end within a character
            codecs.getincrementaldecoder(encoding)().decode(head)
        except UnicodeDecodeError:
            continue
        return encoding
    return "latin-1"


def check_encoding(encoding: str, path: Path) -> None:
    """Raise InputError for an unknown encoding."""
    try:
        " ".encode(encoding)  # fails for codecs that are not for text
        codecs.getincrementaldecoder(encoding)
    except (LookupError, ValueError):
        known = "common ones are utf-8, utf-16, cp1252 and latin-1"
        raise InputError(f'"{shorten(encoding)}" is not a known encoding; {known}.', file=str(path)) from None


def line_ends(head: bytes, encoding: str) -> str:
    """Return the names of the line ends in `head`."""
    text = head.decode(encoding, "replace")
    pairs = text.count("\r\n")
    counts = {"CR LF": pairs, "LF": text.count("\n") - pairs, "CR": text.count("\r") - pairs}
    return " and ".join(name for name, count in counts.items() if count) or "none"


def read_blocks(path: Path, encoding: str) -> Iterator[TextBlock]:
    """Yield the file block by block; the last non-blank line is always in the last block.

    Raises InputError if the file cannot be read or decoded, contains NUL bytes, or has an endless line.
    """
    file, line, pending = str(path), 1, ""
    decoder = io.IncrementalNewlineDecoder(codecs.getincrementaldecoder(encoding)(), translate=True)
    try:
        with path.open("rb") as stream:
            raw = stream.read(BLOCK)
            while raw:
                ahead = stream.read(BLOCK)
                text = pending + decoder.decode(raw, final=not ahead)
                if line == 1:
                    text = text.removeprefix("\ufeff")  # a byte order mark that the codec kept
                if "\0" in text:
                    line += text[: text.index("\0")].count("\n")
                    why = "it is not text, its writing was interrupted, or it has another encoding such as utf-16-le"
                    raise InputError(f"contains NUL bytes: {why}.", file=file, line=line)
                cut = text.rfind("\n", 0, len(text.rstrip())) + 1 if ahead else len(text)
                if len(text) - cut > _LONGEST:
                    line += text.count("\n", 0, cut)
                    raise InputError("this line does not end; the file is not a table.", file=file, line=line)
                if cut:
                    whole = text[:cut].encode()
                    # several times as fast as bytes.count for short lines
                    count = int(np.count_nonzero(np.frombuffer(whole, np.uint8) == ord("\n")))
                    yield TextBlock(line, whole, count, not ahead)
                    line += count
                pending, raw = text[cut:], ahead
    except UnicodeDecodeError as error:
        line += pending.count("\n") + error.object[: error.start].count(b"\n")
        why = "Set encoding, for instance to cp1252" if encoding.startswith("utf-8") else "Set another encoding"
        raise InputError(f"this is not {encoding}. {why}.", file=file, line=line) from None
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}.", file=file) from None


def open_text(path: Path, options: Options) -> TableSource:
    """Return the table in a text file; layout that `options` do not give is found from the first lines.

    A column of date-times becomes seconds since the first one; a text column is left out and listed in `found`.
    Raises InputError if the file cannot be read, holds no table, or is ambiguous.
    """
    start = first_bytes(path, BLOCK)
    if is_binary(start):
        raise wrong_format(path, "a text file", start)
    encoding = options.encoding or find_encoding(start)
    check_encoding(encoding, path)
    block = next(read_blocks(path, encoding), None)
    lines = block.raw.decode().split("\n", _SAMPLE)[:_SAMPLE] if block else []
    last = next((line for line in reversed(lines) if line.strip()), "")
    with damage_as_input_error(path):  # before a cell is looked at: each is tried as several dialects
        check_columns(max(len(last.split()), *(1 + last.count(sign) for sign in DELIMITERS if sign != BLANKS)))
    numbered = list(enumerate(lines, 1))
    if has_sections(lines):
        numbered = _sections(path, encoding)
    layout = find_layout(numbered, options, str(path))
    about = _about_file(start, encoding, layout, options)
    if any(line.lstrip().startswith(COMMENT) for line in lines):
        about.append(f"lines that begin with {' or '.join(COMMENT)} are comments")
    return _TextSource(path, encoding, layout, about, options)


def _sections(path: Path, encoding: str) -> list[tuple[int, str]]:
    """Return the first lines of each section of a file, with their numbers."""
    kept: list[tuple[int, str]] = []
    begun = 1
    for block in read_blocks(path, encoding):
        for n, raw in enumerate(block.raw.split(b"\n"), block.line):
            if (section := begins_section(line := raw.decode())) or n < begun + _SAMPLE // 4:
                begun = n if section else begun
                kept.append((n, line))
    return kept


class _TextSource(TableSource):
    """A text file; each pass opens it again."""

    reader = "text"

    def __init__(self, path: Path, encoding: str, layout: TextLayout, about: list[str], options: Options):
        self._path, self._encoding, self._layout = path, encoding, layout
        columns, notes = _columns(layout)
        at = find_label(options.labels, columns)
        labels = {at: Labels()} if at is not None else {}
        self.labels = labels[at].texts if at is not None else None
        self._rows = TextRows(layout, [column.name for column in columns], str(path), labels, options.drop)
        self.columns = tuple(columns[j] for j in self._rows.used)
        capture = layout.capture
        self.rate = capture.rate if capture is not None else None
        read = {*self._rows.used}
        self.left_out = {c.place: (c.name, "text") for j, c in enumerate(columns) if j not in read}
        self.found = (
            *about,
            *notes,
            *(f"{_column(c.name)} is text, left out" for c in columns if c.place in self.left_out),
        )
        self.repairs: list[str] = []

    def pieces(self, rows: int) -> Iterator[Piece]:
        self.repairs.clear()
        self._rows.left_out.clear()
        return _regroup(self._read(), rows)

    def close(self) -> None:
        """Do nothing: no file stays open."""

    def _read(self) -> Iterator[Piece]:
        capture = self._layout.capture
        end = capture.end if capture is not None else None
        times = [k for k, column in enumerate(self.columns) if is_time(column.name)]
        for line, raw, count, last in read_blocks(self._path, self._encoding):
            if end is not None and line + count > end:
                raw = b"".join(raw.splitlines(keepends=True)[: max(0, end - line + 1)])
                count, last = raw.count(b"\n"), True
            above = max(0, self._layout.first - line)  # lines above the table
            if above >= count and not last:
                continue
            if above or last:
                text = raw.decode().split("\n", above)[-1]
                raw = (self._mend_end(text, line + above) if last else text).encode()
                count = raw.count(b"\n")
            if capture is not None and capture.skipped:
                raw = _without(raw, line + above, capture.skipped)
            if count:
                piece = self._rows.read(raw, line + above, count)
                if capture is not None and capture.ramps:
                    lines, zeros, intervals = map(np.asarray, zip(*capture.ramps, strict=True))
                    at = np.searchsorted(lines, piece.rows, side="right") - 1
                    piece.values[:, times] = (zeros[at] + intervals[at] * (piece.rows - lines[at]))[:, None]
                if capture is not None and capture.later:
                    starts, seconds = zip((0, 0.0), *capture.later, strict=True)
                    at = np.searchsorted(starts, piece.rows, side="right") - 1
                    piece.values[:, times] += np.asarray(seconds)[at, None]
                yield piece
            if last:
                break
        if left_out := self._rows.left_out:
            lines, cells = count_of(len(left_out), "line"), count_of(self._layout.width, "cell")
            self.repairs.append(f"{lines} left out: not {cells} of numbers; the first is line {min(left_out)}")

    def _mend_end(self, text: str, line: int) -> str:
        """Return the last lines up to the last row, each with a line end; drop that row if it is incomplete."""
        lines, layout = text.split("\n"), self._layout
        ended = False
        while lines and not self._rows.is_row(lines[-1]):
            lines.pop()
            ended = True
        if not lines:
            return ""
        where = f"Line {line + len(lines) - 1}, the last one,"
        needed = layout.width - layout.spare
        try:
            cells = split(lines[-1], layout.delimiter)
        except ValueError:
            cells = []
        if len(cells) < needed or (not ended and self._is_cut(cells[needed - 1])):
            self.repairs.append(f'{where} is incomplete and left out: "{shorten(lines.pop())}".')
        else:
            lines[-1] += layout.delimiter * (layout.width - len(cells))
            if not ended:
                self.repairs.append(f"{where} has no line end: its last cell may be incomplete.")
        return "".join(f"{row}\n" for row in lines)

    def _is_cut(self, cell: str) -> bool:
        """Whether the last cell of a line without line end is incomplete."""
        what = self._layout.kinds[-1]
        if what == CellKind.TEXT:
            return False
        if cell in MISSING:
            return len(cell) < 2
        return kind(cell, self._layout.decimal) != what


def _without(raw: bytes, line: int, skipped: Iterable[tuple[int, int]]) -> bytes:
    """Return lines, of which `line` is the number of the first, with empty ones in place of heads and of tabs alone."""
    lines = [row if row.strip() else b"" for row in raw.split(b"\n")]
    for first, last in skipped:
        for k in range(max(0, first - line), min(len(lines), last + 1 - line)):
            lines[k] = b""
    return b"\n".join(lines)


def _columns(layout: TextLayout) -> tuple[tuple[Column, ...], list[str]]:
    """Return all columns, text columns included, and notes about them."""
    head, count, notes = layout.head, len(layout.kinds), []
    plain = split_units(head.names or [""] * count)
    plain = [replace(column, name=column.name or f"column {j}", place=j) for j, column in enumerate(plain, 1)]
    columns = list(distinct(plain))
    if layout.capture is not None and layout.capture.start:
        columns = [replace(c, start=layout.capture.start if is_time(c.name) else "") for c in columns]
    for j, column in enumerate(columns):
        if head.units and head.units[j]:
            columns[j] = replace(column, unit=head.units[j])
        if column.name != plain[j].name:
            notes.append(f"column {j + 1} is another {plain[j].name}, named {column.name}")
    for j, column in enumerate(columns):
        if (clock := layout.clocks.get(j)) is not None:
            notes.append(f"{_column(column.name)}: {clock.note}")
            start = "" if clock.daily or clock.only else str(clock.start)
            columns[j] = replace(column, unit="s", start=start, daily=clock.daily)
    return tuple(columns), notes


def _column(name: str) -> str:
    return name if name.startswith("column ") else f"column {name}"


def _about_file(head: bytes, encoding: str, layout: TextLayout, options: Options) -> list[str]:
    """Return notes about the file as a whole."""

    def given(option: object) -> str:
        return "" if option is None else ", as given"

    guessed = ", as it is not UTF-8" if options.encoding is None and encoding in ("cp1252", "latin-1") else ""
    delimiter = DELIMITERS[layout.delimiter] if layout.width > 1 else "none, one column"
    about = [
        f"encoding: {encoding}{guessed}{given(options.encoding)}",
        f"line ends: {line_ends(head, encoding)}",
        f"delimiter: {delimiter}{given(options.delimiter)}",
        f"decimal sign: {DECIMALS[layout.decimal]}{given(options.decimal)}",
        f"names: line {layout.head.names_line}{given(options.header)}" if layout.head.names else "no names",
    ]
    if layout.head.units_line:
        about.append(f"units: line {layout.head.units_line}")
    elif any(layout.head.units) or any(split_unit(name).unit for name in layout.head.names):
        about.append("units: in the names" if layout.capture is None else "units: in the head")
    about.append(f"first row: line {layout.first}")
    if layout.capture is not None:
        about += [f"written by: {layout.capture.program}", *layout.capture.notes]
    if layout.spare:
        about.append(f"empty cells behind the last column, left out: {layout.spare}")
    return about


def _regroup(pieces: Iterable[Piece], rows: int) -> Iterator[Piece]:
    """Yield the same rows in pieces of `rows`."""
    pending: list[Piece] = []
    for piece in pieces:
        pending.append(piece)
        if sum(len(part.rows) for part in pending) >= rows:
            whole = _join(pending)
            full = len(whole.rows) - len(whole.rows) % rows
            for start in range(0, full, rows):
                yield Piece(whole.rows[start : start + rows], whole.values[start : start + rows])
            pending = [Piece(whole.rows[full:], whole.values[full:])]
    if any(len(part.rows) for part in pending):
        yield _join(pending)


def _join(pieces: list[Piece]) -> Piece:
    return Piece(*(np.concatenate(parts) for parts in zip(*pieces, strict=True)))
