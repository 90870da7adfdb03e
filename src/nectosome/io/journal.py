"""A journal: records that are on disk as soon as they are made, one JSON line each, never rewritten."""

import json
import zlib
from pathlib import Path
from typing import Any

from nectosome.io.atomic import reason
from nectosome.io.lock import lock
from nectosome.units import InputError

FORMAT = 1
_PATIENCE = 10.0  # seconds for a process that was just killed to let go of its journal


class Journal:
    """A journal open for appending; its file is locked until `close`.

    A line is `{"crc":"<crc32 of data, hex>","data":<record>}`, the first one a head with the format and `key`. What
    follows the last sound line, because its process was killed or the disk was damaged, is cut off; `damage` says so.
    Numbers come back exactly; JSON has none that are not finite, so write these as null or text.

    - records: what the file held when it was opened.
    - damage: what was cut off, in words, or "".

    Raises InputError for a file that cannot be written, is no journal, is of another version or has another key, and
    for one that another process keeps open.
    """

    def __init__(self, path: str | Path, key: str):
        self.path = Path(path)
        try:
            self._file = self.path.open("ab+", buffering=0)
        except OSError as error:
            raise InputError(f"cannot be written: {reason(error)}.", file=str(path)) from None
        try:
            if not lock(self._file, _PATIENCE):
                raise InputError("is in use by another process.", file=str(path))
            self._file.seek(0)
            raw = self._file.read()
            self.records, sound, self.damage = _parse(raw, key, str(path))
            if sound < len(raw):
                self._file.truncate(sound)
            if sound == 0:
                self._write(_line({"format": FORMAT, "key": key}))
        except BaseException:
            self._file.close()
            raise

    def append(self, record: Any) -> None:
        """Write one record (strict JSON data) and hand it to the system, so that a killed process does not lose it.

        Raises InputError where the disk does not take it, ValueError for a number that is not finite.
        """
        self._write(_line(record))

    def close(self) -> None:
        """Close the file and release its lock."""
        self._file.close()

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write(self, line: bytes) -> None:
        try:
            whole = self._file.write(line) == len(line)
        except OSError as error:
            raise InputError(f"cannot be written: {reason(error)}.", file=str(self.path)) from None
        if not whole:
            raise InputError("cannot be written: the disk is full.", file=str(self.path))


def read_journal(path: str | Path, key: str) -> tuple[list[Any], str]:
    """Return the records and what had to be left out, in words, or ""; the file stays as it is.

    Raises InputError for a file that is missing, no journal, of another version or with another key.
    """
    try:
        raw = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}.", file=str(path)) from None
    records, _, damage = _parse(raw, key, str(path))
    return records, damage


def _line(record: Any) -> bytes:
    data = json.dumps(record, allow_nan=False, separators=(",", ":")).encode()
    return b'{"crc":"%08x","data":%s}\n' % (zlib.crc32(data), data)


_DATA = slice(len(b'{"crc":"01234567","data":'), -1)  # of a line


def _parse(raw: bytes, key: str, file: str) -> tuple[list[Any], int, str]:
    """The records, the length of the sound part in bytes, and what follows it, in words."""
    head = _line({"format": FORMAT, "key": key})
    if not raw.startswith(head):
        if head.startswith(raw):  # killed while the head was written
            return [], 0, ""
        raise InputError(_foreign(raw), file=file)
    records, sound = [], len(head)
    for line in raw[len(head) :].splitlines(keepends=True):
        found, record = _record(line)
        if not found:
            break
        records.append(record)
        sound += len(line)
    lost = len(raw) - sound
    damage = f"the last {lost} bytes are cut off or damaged and were left out" if lost else ""
    return records, sound, damage


def _record(line: bytes) -> tuple[bool, Any]:
    """Whether a line is sound, and its record."""
    text = line.removesuffix(b"\n")
    data = text[_DATA]
    if text == line or line != b'{"crc":"%08x","data":%s}\n' % (zlib.crc32(data), data):
        return False, None
    return True, json.loads(data)


def _foreign(raw: bytes) -> str:
    found, head = _record(raw.partition(b"\n")[0] + b"\n")
    if not (found and isinstance(head, dict) and {"format", "key"} <= head.keys()):
        return "this is not a journal, or its first line is damaged."
    if head["format"] != FORMAT:
        return "this journal is of another version of nectosome. Start anew."
    return "this journal belongs to other work. Start anew, in another folder."
