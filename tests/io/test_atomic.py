"""A file is there whole or not at all, whatever fails on the way."""

import errno
import os

import pytest

from nectosome.io import write_atomic
from nectosome.units import InputError


def left(folder):
    return sorted(file.name for file in folder.iterdir())


def test_bytes_and_callables_are_written(tmp_path):
    write_atomic(tmp_path / "a", b"one")
    write_atomic(tmp_path / "a", b"two")
    write_atomic(tmp_path / "b", lambda path: path.write_text("three"))
    assert (tmp_path / "a").read_bytes() == b"two"
    assert (tmp_path / "b").read_text() == "three"
    assert left(tmp_path) == ["a", "b"]


@pytest.mark.parametrize("failure", [KeyboardInterrupt, RuntimeError, MemoryError])
def test_a_failure_halfway_leaves_the_old_file(tmp_path, failure):
    file = tmp_path / "a"
    file.write_bytes(b"old")

    def half(path):
        path.write_bytes(b"new, but not a")
        raise failure

    with pytest.raises(failure):
        write_atomic(file, half)
    assert file.read_bytes() == b"old"
    assert left(tmp_path) == ["a"]


def test_a_full_disk_is_told(tmp_path, monkeypatch):
    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError) as caught:
        write_atomic(tmp_path / "a", b"much")
    assert str(caught.value) == f"cannot write {tmp_path / 'a'}: No space left on device."
    assert left(tmp_path) == []


def test_what_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    for path, why in [
        (tmp_path, "it is a folder"),
        (tmp_path / "no" / "a", "No such file or directory"),
        (tmp_path / "file" / "a", "Not a directory"),
        (tmp_path / ("a" * 300), "File name too long"),
        (tmp_path / "a\0b", "embedded null byte"),
        ("/dev/null", "it is not a file"),
    ]:
        with pytest.raises(InputError, match=why):
            write_atomic(path, b"x")
    assert left(tmp_path) == ["file"]


def test_a_new_file_has_the_usual_rights(tmp_path):
    write_atomic(tmp_path / "a", b"x")
    (tmp_path / "b").write_bytes(b"x")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "b").stat().st_mode
