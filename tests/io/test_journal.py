"""A journal gives back what was written before its process was killed, and nothing else."""

import json
import subprocess
import sys

import pytest

from nectosome.io.journal import FORMAT, Journal, read_journal
from nectosome.units import InputError

RECORDS = [{"u": [0.1, 1e-300, -0.0, 1 / 3]}, {"reason": "schön\n", "f": None}, [1, "nan"]]


@pytest.fixture
def file(tmp_path):
    with Journal(tmp_path / "a.jsonl", "key") as journal:
        assert journal.records == []
        for record in RECORDS:
            journal.append(record)
    return tmp_path / "a.jsonl"


def test_records_come_back_exactly_and_go_on(file):
    records, damage = read_journal(file, "key")
    assert json.dumps(records) == json.dumps(RECORDS)
    assert damage == ""
    with Journal(file, "key") as journal:
        assert journal.records == RECORDS
        journal.append(4)
    assert read_journal(file, "key")[0] == [*RECORDS, 4]


def test_each_line_is_strict_json(file):
    for line in file.read_text().splitlines():
        assert json.loads(line, parse_constant=pytest.fail).keys() == {"crc", "data"}
    with Journal(file, "key") as journal, pytest.raises(ValueError, match="not JSON compliant"):
        journal.append(float("nan"))
    assert read_journal(file, "key") == (RECORDS, "")


def test_a_file_cut_anywhere_gives_its_whole_records(file):
    raw = file.read_bytes()
    ends = [i + 1 for i, byte in enumerate(raw) if byte == ord("\n")]
    for n in range(len(raw)):
        file.write_bytes(raw[:n])
        whole = sum(end <= n for end in ends[1:])
        records, damage = read_journal(file, "key")
        assert records == RECORDS[:whole]
        assert bool(damage) == (n > ends[0] and n not in ends)
        with Journal(file, "key") as journal:
            assert (journal.records, journal.damage) == (records, damage)
            journal.append("next")
        assert read_journal(file, "key") == ([*RECORDS[:whole], "next"], "")


def test_a_changed_byte_ends_the_record_there(file):
    raw = file.read_bytes()
    head = raw.index(b"\n") + 1
    starts = [head, *(i + 1 for i, byte in enumerate(raw) if byte == ord("\n") and i + 1 > head)]
    for n in range(head, len(raw)):
        file.write_bytes(raw[:n] + bytes([raw[n] ^ 0x15]) + raw[n + 1 :])
        records, damage = read_journal(file, "key")
        assert records == RECORDS[: sum(start <= n for start in starts) - 1]
        assert "bytes are incomplete or damaged" in damage


def test_foreign_files_are_left_alone(file):
    other = file.read_bytes()
    with pytest.raises(InputError, match="belongs to other work"):
        Journal(file, "another key")
    file.write_bytes(other.replace(b'"format":%d' % FORMAT, b'"format":9'))
    with pytest.raises(InputError, match="not a journal"):
        Journal(file, "key")
    text = b"dear diary\n" * 20
    file.write_bytes(text)
    for read in (Journal, read_journal):
        with pytest.raises(InputError, match="not a journal"):
            read(file, "key")
    assert file.read_bytes() == text
    with pytest.raises(InputError, match="No such file"):
        read_journal(file.parent / "missing", "key")
    with pytest.raises(InputError, match="cannot be written"):
        Journal(file.parent, "key")


def test_two_processes_cannot_write_at_once(file, monkeypatch):
    pytest.importorskip("fcntl")
    monkeypatch.setattr("nectosome.io.journal._PATIENCE", 0.1)
    code = f"from nectosome.io.journal import Journal; j = Journal({str(file)!r}, 'key'); print(1, flush=True); input()"
    other = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert other.stdout is not None
    other.stdout.readline()
    with pytest.raises(InputError, match="in use by another process"):
        Journal(file, "key")
    other.kill()
    other.wait()
    Journal(file, "key").close()
