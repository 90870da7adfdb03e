"""Append-only journal: one JSON line per record, written to disk immediately."""

import json
import zlib
from pathlib import Path
from typing import Any

from nectosome.io.atomic import lock
from nectosome.io.file_system import read_bytes, reason
from nectosome.units import InputError

FORMAT = 1
_PATIENCE = 10.0  # [s] wait for a killed process to release its lock


class Journal:
    """A journal, open for appending and locked until `close`.

    A line is `{"crc":"<crc32 of data, hex>","data":<record>}`, the first one a header with the format and `key`. Data
    after the last intact line (killed process, disk error) are cut off and described by `damage`. Numbers are restored
    exactly; NaN and infinite ones are not allowed in JSON: write null or text.

    - records: records of the file when it was opened.
    - damage: description of the data cut off, or "".

    Raises InputError for a file that cannot be written, is not a journal, has another version or another key, or is in
    use by another process.
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
            self.records, intact, self.damage = _parse(raw, key, str(path))
            if intact < len(raw):
                self._file.truncate(intact)
            if intact == 0:
                self._write(_line({"format": FORMAT, "key": key}))
        except BaseException:
            self._file.close()
            raise

    def append(self, record: Any) -> None:
        """Write one record (strict JSON data) to the system, so that it survives a kill of the process.

        Raises InputError if writing fails, ValueError for NaN or infinite numbers.
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
    """Return the records, and a description of damaged data or ""; the file is not changed.

    Raises InputError for a missing file, another format, another version or another key.
    """
    records, _, damage = _parse(read_bytes(path), key, str(path))
    return records, damage


def has_records(path: str | Path) -> bool:
    """Return whether a file holds more than the header of a journal. Raises InputError where it cannot be read."""
    head, _, rest = read_bytes(path).partition(b"\n")
    return bool(rest) or not b'{"crc":"'.startswith(head[:8])


def _line(record: Any) -> bytes:
    data = json.dumps(record, allow_nan=False, separators=(",", ":")).encode()
    return b'{"crc":"%08x","data":%s}\n' % (zlib.crc32(data), data)


_DATA = slice(len(b'{"crc":"01234567","data":'), -1)  # of a line


def _parse(raw: bytes, key: str, file: str) -> tuple[list[Any], int, str]:
    """Records, the length of the intact part [bytes], and a description of the rest."""
    head = _line({"format": FORMAT, "key": key})
    if not raw.startswith(head):
        if head.startswith(raw):  # killed during the header
            return [], 0, ""
        raise InputError(_foreign(raw), file=file)
    records, intact = [], len(head)
    for line in raw[len(head) :].splitlines(keepends=True):
        whole, record = _record(line)
        if not whole:
            break
        records.append(record)
        intact += len(line)
    lost = len(raw) - intact
    damage = f"the last {lost} bytes are incomplete or damaged and were left out" if lost else ""
    return records, intact, damage


def _record(line: bytes) -> tuple[bool, Any]:
    """Whether a line is intact, and its record."""
    text = line.removesuffix(b"\n")
    data = text[_DATA]
    if text == line or line != b'{"crc":"%08x","data":%s}\n' % (zlib.crc32(data), data):
        return False, None
    return True, json.loads(data)


def _foreign(raw: bytes) -> str:
    whole, head = _record(raw.partition(b"\n")[0] + b"\n")
    if not (whole and isinstance(head, dict) and {"format", "key"} <= head.keys()):
        return "this is not a journal, or its first line is damaged."
    if head["format"] != FORMAT:
        return "this journal is of another version of nectosome. Start again."
    return "this journal belongs to other work. Start again in another folder."
