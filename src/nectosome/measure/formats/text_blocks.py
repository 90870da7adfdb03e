"""A text file, decoded, in blocks of whole lines; lines end in LF, CR LF or CR."""

import codecs
import io
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from nectosome.io.atomic import reason
from nectosome.io.errors import InputError, shorten

BLOCK = 1 << 20  # [bytes], about where pandas is fastest
_LONGEST = 1 << 24  # line [characters]
_BOMS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}


class Block(NamedTuple):
    """Consecutive lines, each with its end; only the last of the file may lack it."""

    line: int  # where the first one is in the file, from 1
    raw: bytes  # UTF-8, lines end in LF
    lines: int  # how many end here
    last: bool  # whether the file ends here


def find_encoding(head: bytes) -> str:
    """Return the encoding of a text that begins with `head`: what its byte order mark says, or UTF-8 if it can be."""
    for mark, encoding in _BOMS.items():
        if head.startswith(mark):
            return encoding
    for encoding in ("utf-8", "cp1252"):
        try:
            # a character may be cut at the end, which is no fault
            codecs.getincrementaldecoder(encoding)().decode(head)
        except UnicodeDecodeError:
            continue
        return encoding
    return "latin-1"


def check_encoding(encoding: str, path: Path) -> None:
    """Raise InputError if there is no such encoding."""
    try:
        " ".encode(encoding)  # refuses codecs that are not for text
        codecs.getincrementaldecoder(encoding)
    except (LookupError, ValueError):
        known = "utf-8, utf-16, cp1252 and latin-1 are usual ones"
        raise InputError(f'there is no encoding "{shorten(encoding)}"; {known}.', file=str(path)) from None


def line_ends(head: bytes, encoding: str) -> str:
    """Return the names of the line ends in `head`."""
    text = head.decode(encoding, "replace")
    pairs = text.count("\r\n")
    found = {"CR LF": pairs, "LF": text.count("\n") - pairs, "CR": text.count("\r") - pairs}
    return " and ".join(name for name, count in found.items() if count) or "none"


def read_blocks(path: Path, encoding: str) -> Iterator[Block]:
    """Yield the file block by block; the last line that is not blank is always in the last block.

    Raises InputError where the file cannot be read or decoded, holds NUL, or has a line without end.
    """
    file, line, held = str(path), 1, ""
    decoder = io.IncrementalNewlineDecoder(codecs.getincrementaldecoder(encoding)(), translate=True)
    try:
        with path.open("rb") as stream:
            raw = stream.read(BLOCK)
            while raw:
                ahead = stream.read(BLOCK)
                text = held + decoder.decode(raw, final=not ahead)
                if line == 1:
                    text = text.removeprefix("\ufeff")  # a byte order mark that the encoding does not take away
                if "\0" in text:
                    line += text[: text.index("\0")].count("\n")
                    why = "it is no text, or its writing broke off, or its encoding is another one, such as utf-16-le"
                    raise InputError(f"there are NUL bytes: {why}.", file=file, line=line)
                cut = text.rfind("\n", 0, len(text.rstrip())) + 1 if ahead else len(text)
                if len(text) - cut > _LONGEST:
                    line += text.count("\n", 0, cut)
                    raise InputError("this line does not end; the file is no table.", file=file, line=line)
                if cut:
                    whole = text[:cut].encode()
                    # several times as fast as bytes.count where lines are short
                    count = int(np.count_nonzero(np.frombuffer(whole, np.uint8) == ord("\n")))
                    yield Block(line, whole, count, not ahead)
                    line += count
                held, raw = text[cut:], ahead
    except UnicodeDecodeError as error:
        line += held.count("\n") + error.object[: error.start].count(b"\n")
        why = "Set encoding, to cp1252 perhaps" if encoding.startswith("utf-8") else "Set another encoding"
        raise InputError(f"this is not {encoding}. {why}.", file=file, line=line) from None
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}.", file=file) from None
