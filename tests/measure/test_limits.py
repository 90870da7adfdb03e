"""What one file may take: columns, and memory when it is unpacked; more is refused before it is there."""

import subprocess
import sys

import numpy as np
import pytest

from nectosome.cli import main
from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, load_sheet, read, read_all
from nectosome.measure.formats.file_errors import COLUMNS, read_size
from nectosome.measure.formats.headings import distinct
from nectosome.measure.formats.source import Column
from nectosome.units import InputError

from .formats.hostile import BOMBS, WIDE, compressed_mat


def test_small_files_with_gigabytes_inside_are_refused_before_they_are_in_memory(tmp_path):
    """Peak resident memory of the process grows by less than 60 MB, over all of them."""
    for name, (write, message) in BOMBS.items():
        write(tmp_path / name)
        assert (tmp_path / name).stat().st_size < 7e6
        with pytest.raises(InputError, match=message):
            read(tmp_path / name)
    program = """
import re, sys
from pathlib import Path
from nectosome.cli import main
import h5py, openpyxl, scipy.io, nectosome.measure
peak = lambda: int(re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]) / 1024
before = peak()
codes = {main(["measure", name]) for name in sys.argv[1:]}
print(peak() - before)
sys.exit(codes.pop() if len(codes) == 1 else 99)
"""
    argv = [sys.executable, "-c", program, *BOMBS]
    done = subprocess.run(argv, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 2
    assert float(done.stdout) < 60


def test_compressed_data_that_are_longer_than_they_say_are_damage(tmp_path):
    compressed_mat(tmp_path / "a.mat", said=800, there=64 * 2**20)
    with pytest.raises(InputError, match="the file is damaged"):
        read(tmp_path / "a.mat")


def test_the_limit_is_an_option(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    np.savez_compressed("a.npz", t=np.arange(100_000.0), x=np.ones(100_000))
    assert main(["measure", "a.npz", "--memory", "1MB"]) == 2
    assert "1.6 MB are what it holds when it is unpacked, and 1 MB are allowed" in capsys.readouterr().err
    assert main(["measure", "a.npz", "--memory", "2 MB"]) == 0
    for wrong in ("2", "2 m", "0MB", "much", "GB"):
        assert main(["measure", "a.npz", "--memory", wrong]) == 2
        assert 'is no size, as in "500MB" or "2GB"' in capsys.readouterr().err
    assert [read_size(text, "") for text in ("3 kB", "2.5MB", "1GB", "7B")] == [3000, 2_500_000, 10**9, 7]


def test_what_is_kept_to_be_split_or_resampled_is_bounded_too(tmp_path):
    (tmp_path / "a.csv").write_text("t [s],trial,x\n" + "".join(f"{k},{k // 500},{k}\n" for k in range(1000)))
    for data in (
        {"split": "trial"},
        {"clocks": {"camera": {"column": "t", "offset": "0.5 s"}}, "columns": {"x": {"clock": "camera"}, "trial": 2}},
    ):
        sheet = validate_as(Sheet, data, "sheet")
        read_all(tmp_path / "a.csv", sheet)
        with pytest.raises(InputError, match=r"a\.csv: .* kB are what .*, and 10 kB are allowed\. Allow more by"):
            read_all(tmp_path / "a.csv", sheet, memory=10_000)


@pytest.mark.parametrize("name", WIDE)
def test_more_columns_than_any_rig_has_are_refused(tmp_path, name):
    WIDE[name](tmp_path / name, COLUMNS + 1)
    with pytest.raises(
        InputError, match=f"has {COLUMNS + 1} (columns|datasets|arrays), and {COLUMNS} are read at most"
    ):
        read(tmp_path / name)


def test_a_wide_table_of_text_is_read_in_pieces_that_fit_into_memory(tmp_path, monkeypatch):
    sizes = []
    monkeypatch.setattr("nectosome.measure.recordings.IN_MEMORY", 8 * 300 * 7)
    (tmp_path / "a.csv").write_text("".join(",".join([f"{k}"] * 300) + "\n" for k in range(40)))
    from nectosome.measure.formats import text

    whole = text._TextSource.pieces

    def pieces(self, rows):
        sizes.append(rows)
        return whole(self, rows)

    monkeypatch.setattr(text._TextSource, "pieces", pieces)
    run = read(tmp_path / "a.csv")
    assert sizes == [7]
    np.testing.assert_array_equal(run["column 300"], np.arange(40))


def test_many_columns_of_one_name_get_distinct_ones():
    names = [column.name for column in distinct([Column("c (3)"), *[Column("c")] * 3000, Column("d")])]
    assert names[:5] == ["c (3)", "c", "c (2)", "c (4)", "c (5)"]
    assert len(set(names)) == 3002


MANY = "a: [" + "1," * 490_000 + "]\n", "-\n" * 400_000, "".join(f"a{k}: 1\n" for k in range(90_000))


@pytest.mark.parametrize("text", MANY, ids=["list", "dashes", "names"])
def test_a_sheet_of_a_hundred_thousand_values_is_refused_when_they_are_counted(tmp_path, text):
    (tmp_path / "s.yaml").write_text(text)
    with pytest.raises(InputError, match=r"s\.yaml, line \d+: too large: at most 20000 values are read"):
        load_sheet(tmp_path / "s.yaml")
