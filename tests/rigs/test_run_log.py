"""A log is on disk while it is made, whole when it has ended, and readable where it breaks off."""

import errno
import os
import threading
import time

import numpy as np
import pytest
import xarray as xr

from nectosome.io import load_dataset
from nectosome.rigs import log, recovered
from nectosome.rigs.log import LogError, RunLog
from nectosome.units import InputError

UNITS = {"time": "s", "tail.x": "m", "tail.x.reference": "m", "valves.left.command": "Pa", "late": "s"}
ABOUT = {"title": "sine on rig", "controller": "PI(\n  1.0,\n  # not a line of its own\n)", "dt": 0.005, "rig": "é"}
ROWS = np.random.default_rng(0).normal(size=(200, 5)) * [1, 1e-3, 1e-3, 1e4, 1e-5]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.nc"


def begun(path, rows=ROWS) -> RunLog:
    run = RunLog(path, ABOUT, UNITS)
    for row in rows.tolist():
        run.append(*row)
    return run


def full(*_):
    raise OSError(errno.ENOSPC, "No space left on device")


def until(what, seconds: float = 5.0) -> bool:
    limit = time.monotonic() + seconds
    while time.monotonic() < limit:
        if what():
            return True
        time.sleep(0.005)
    return False


def test_what_went_in_comes_out_to_the_last_bit(path):
    """With units and all that is known of it; the journal goes, and the thread."""
    threads = threading.active_count()
    data, where, lost = begun(path).end({"status": "finished", "status_reason": "all samples were taken."})
    assert (where, lost) == (path, "")
    assert [file.name for file in path.parent.iterdir()] == ["run.nc"]
    assert threading.active_count() == threads
    loaded = load_dataset(path)
    xr.testing.assert_identical(loaded, data)
    assert np.array_equal(np.stack([loaded[name] for name in UNITS], axis=1), ROWS)
    assert {name: loaded[name].attrs["units"] for name in UNITS} == UNITS
    assert loaded.attrs == ABOUT | {"status": "finished", "status_reason": "all samples were taken."}


def test_a_log_without_samples_is_one(path):
    begun(path, ROWS[:0]).end({"status": "failed", "status_reason": "no rig"})
    assert load_dataset(path).sizes == {"time": 0}


def test_a_journal_that_is_left_holds_the_same(path):
    """It can be read while it is written; it ends with the last sample."""
    run = begun(path)
    assert until(lambda: recovered(run.journal).sizes["time"] == len(ROWS))
    left = recovered(run.journal)
    data, _, _ = run.end({})
    for name in UNITS:
        assert np.array_equal(left[name], data[name])
        assert left[name].attrs == data[name].attrs
    assert left.attrs["status"] == "killed"
    assert f"{ROWS[-1, 0]:.3f} s" in left.attrs["status_reason"]
    assert {name: left.attrs[name] for name in ABOUT} == ABOUT


def journal(path) -> bytes:
    run = begun(path)
    until(lambda: recovered(run.journal).sizes["time"] == len(ROWS))
    text = run.journal.read_bytes()
    run.end({})
    return text


def test_a_journal_may_be_cut_off_anywhere(path):
    """Whole lines are kept, a torn last one is left out and told; without a head it is no journal."""
    text = journal(path)
    cut = path.with_name("cut.csv")
    head = text.index(b"late [s]\n") + len(b"late [s]\n")
    for n in range(len(text) - 300, len(text)):
        cut.write_bytes(text[:n])
        found = recovered(cut)
        whole = text[head:n].count(b"\n")
        assert np.array_equal(found["valves.left.command"], ROWS[:whole, 3])
        assert ("torn" in found.attrs["status_reason"]) == (text[n - 1 : n] != b"\n")
    for n in range(0, head, 7):
        cut.write_bytes(text[:n])
        with pytest.raises(InputError, match="no journal"):
            recovered(cut)


@pytest.mark.parametrize("damage", [b"\0" * 100, b"1.0,2.0\n", b"# torn: {\n", b"a,b,c,d,e\n", b"\xff\xfe\n"])
def test_what_follows_damage_is_left_out(path, damage):
    lines = journal(path).splitlines(keepends=True)
    damaged = path.with_name("damaged.csv")
    damaged.write_bytes(b"".join(lines[:-50]) + damage + b"".join(lines[-50:]))
    found = recovered(damaged)
    assert found.sizes["time"] == len(ROWS) - 50
    assert "damaged" in found.attrs["status_reason"]


def test_a_file_that_is_none_is_refused(path):
    with pytest.raises(InputError, match="cannot be read"):
        recovered(path)
    path.write_text("time,a\n1,2\n")
    with pytest.raises(InputError, match="no journal"):
        recovered(path)


def test_what_was_measured_is_never_overwritten(path):
    begun(path).end({})
    with pytest.raises(InputError, match="is there already"):
        RunLog(path, ABOUT, UNITS)
    left = path.with_name("left.csv")
    left.write_text("what a killed run left")
    with pytest.raises(InputError, match="recovered"):
        RunLog(path.with_name("left.nc"), ABOUT, UNITS)
    assert left.read_text() == "what a killed run left"


@pytest.mark.parametrize("name", ["run.txt", "nowhere/run.nc"])
def test_a_place_that_cannot_be_written_is_told_at_once(tmp_path, name):
    threads = threading.active_count()
    with pytest.raises(InputError, match=r"run\."):
        RunLog(tmp_path / name, ABOUT, UNITS)
    assert threading.active_count() == threads


def test_a_full_disk_is_told_before_anything_moves(path, monkeypatch):
    monkeypatch.setattr(log, "_write", full)
    with pytest.raises(InputError, match="No space left on device"):
        RunLog(path, ABOUT, UNITS)
    assert not list(path.parent.iterdir())


def test_lines_are_in_the_file_at_once_and_on_the_disk_within_half_a_second(path, monkeypatch):
    """At 200 Hz for a second; even when no more come."""
    synced: list[tuple[float, int]] = []
    real = os.fsync

    def fsync(number: int) -> None:
        real(number)
        synced.append((time.monotonic(), os.fstat(number).st_size))

    monkeypatch.setattr(log.os, "fsync", fsync)
    run = begun(path, ROWS[:0])
    written = []
    for row in ROWS.tolist():
        run.append(*row)
        written.append(time.monotonic())
        time.sleep(0.005)
    assert until(lambda: synced and synced[-1][1] == run.journal.stat().st_size, 2.0)
    assert len(synced) < 10
    gaps = np.diff([written[0], *(t for t, _ in synced)])
    print(f"largest time between two calls of fsync {gaps.max():.3f} s")
    assert gaps.max() < 1.0  # 0.25 s on a machine that is not busy
    run.end({})


def test_a_disk_that_takes_its_time_holds_nothing_up(path, monkeypatch):
    """0.4 s of fsync: rows are taken in microseconds."""
    monkeypatch.setattr(log.os, "fsync", lambda number: time.sleep(0.4))
    run = begun(path, ROWS[:0])
    longest = 0.0
    for row in ROWS[:100].tolist():
        before = time.thread_time()
        run.append(*row)
        longest = max(longest, time.thread_time() - before)
        time.sleep(0.005)
    assert longest < 1e-3
    run.end({})


def test_a_full_disk_is_told_by_the_next_rows_and_what_was_measured_is_kept(path, monkeypatch):
    run = begun(path, ROWS[:50])
    monkeypatch.setattr(log, "_write", full)

    def rows():
        for row in ROWS[50:].tolist():
            run.append(*row)
            time.sleep(2e-3)

    with pytest.raises(LogError, match="No space left on device"):
        rows()
    data, where, _ = run.end({})
    assert where == path
    assert 51 <= data.sizes["time"] <= 70


def test_a_disk_that_hangs_is_told(path, monkeypatch):
    monkeypatch.setattr(log, "_PATIENCE", 0.3)
    wait = threading.Event()
    monkeypatch.setattr(log.os, "fsync", lambda number: wait.wait(5.0))
    run = begun(path, ROWS[:0])

    def rows():
        for row in ROWS.tolist():
            run.append(*row)
            time.sleep(5e-3)

    with pytest.raises(LogError, match="taken nothing"):
        rows()
    wait.set()
    run.end({})


@pytest.mark.parametrize("error", [InputError("No space left."), RuntimeError("No space in HDF5"), OSError("No space")])
def test_the_journal_stays_where_the_netcdf_cannot_be_written(path, monkeypatch, error):
    def fails(*_):
        raise error

    monkeypatch.setattr(log, "save_dataset", fails)
    data, where, lost = begun(path).end({"status": "aborted", "status_reason": "too far"})
    assert where == path.with_suffix(".csv")
    assert "No space" in lost
    left = recovered(where)
    xr.testing.assert_identical(left, data)
    assert left.attrs["status"] == "aborted"
