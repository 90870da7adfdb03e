"""Files of 2 GB through the whole of `nectosome measure`, in less than 500 MB of memory."""

import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from .formats.test_tdms import segment

ROWS, BYTES, CHANNELS = 100_000, 2_000_000_000, 7
VALUES = np.random.default_rng(0).normal(scale=30.0, size=(ROWS, CHANNELS)).round(3)
NAMES = [f"c{k}" for k in range(CHANNELS)]


def text(path: Path) -> int:
    block = "".join("\t".join(f"{value:.3f}" for value in row) + "\n" for row in VALUES.tolist()).encode()
    times = BYTES // len(block) + 1
    with path.open("wb") as file:
        file.write("\t".join(NAMES).encode() + b"\n")
        for _ in range(times):
            file.write(block)
    return times


def tdms(path: Path) -> int:
    block = segment({name: VALUES[:, k] for k, name in enumerate(NAMES)})
    times = BYTES // len(block) + 1
    with path.open("wb") as file:
        for _ in range(times):
            file.write(block)
    return times


def hdf5(path: Path) -> int:
    times = BYTES // VALUES.nbytes + 1
    with h5py.File(path, "w") as file:
        for k, name in enumerate(NAMES):
            data = file.create_dataset(name, (times * ROWS,), "f8", chunks=(ROWS,))
            for i in range(times):
                data[i * ROWS : (i + 1) * ROWS] = VALUES[:, k]
    return times


@pytest.mark.slow
@pytest.mark.parametrize(("name", "write"), [("a.tsv", text), ("a.tdms", tdms), ("a.h5", hdf5)])
def test_a_file_of_2_GB_is_read_shown_and_drawn_in_500_MB(tmp_path, name, write):
    """Peak resident memory of the whole process, as Linux counts it; pages of files that it may drop are among it."""
    times = write(tmp_path / name)
    assert (tmp_path / name).stat().st_size >= BYTES
    (tmp_path / "sheet.yaml").write_text("time: {rate: 1000 Hz}\n")
    program = """
import re, sys
from pathlib import Path
from nectosome.cli import main
code = main(["measure", sys.argv[1], "--config", "sheet.yaml", "--plot", "page.html"])
print("peak", re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1])
sys.exit(code)
"""
    argv = [sys.executable, "-c", program, name]
    done = subprocess.run(argv, capture_output=True, text=True, check=True, cwd=tmp_path)
    assert f"{times * ROWS} rows, 0 to {(times * ROWS - 1) / 1000:.6g} s, every 0.001 s" in done.stdout
    shown = re.search(rf"c3 +c3 +{VALUES[:, 3].min():.6g} +(\S+) +{VALUES[:, 3].max():.6g} +0", done.stdout)
    assert shown is not None
    assert float(shown[1]) == pytest.approx(VALUES[:, 3].mean(), rel=1e-5)
    assert (tmp_path / "page.html").stat().st_size < 20e6
    peak = 1024 * int(re.search(r"peak (\d+)", done.stdout)[1])
    assert peak < 500e6
    (tmp_path / name).unlink()
