"""Files of motion capture: markers and analog channels with their names, units and rates."""

import sys
from importlib.util import find_spec

import numpy as np
import pytest
from numpy.testing import assert_allclose

from nectosome.measure import read as read_recording
from nectosome.measure.formats.c3d import open_c3d
from nectosome.units import InputError

from .read import check_refusals, flipped, read, survived

needs_ezc3d = pytest.mark.skipif(find_spec("ezc3d") is None, reason="the extra c3d is not installed")
FRAMES, RATE = 30, 120.0


def write_c3d(path, analog=False):
    """Write a file of two markers in mm at 120 Hz, and of a load cell at ten times that rate if asked; the points."""
    import ezc3d

    file = ezc3d.c3d()
    points = np.ones((4, 2, FRAMES))
    points[:3] = 100.0 + np.arange(3 * 2 * FRAMES).reshape(3, 2, FRAMES)
    points[:3, 1, 7] = np.nan
    file["parameters"]["POINT"]["LABELS"]["value"] = ["nose", "fish:tail"]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["RATE"]["value"] = [RATE]
    file["data"]["points"] = points
    if analog:
        file["parameters"]["ANALOG"]["LABELS"]["value"] = ["load cell"]
        file["parameters"]["ANALOG"]["UNITS"]["value"] = ["V"]
        file["parameters"]["ANALOG"]["RATE"]["value"] = [10 * RATE]
        file["data"]["analogs"] = np.linspace(-1, 1, 10 * FRAMES)[None, None]
    file.write(str(path))
    return points


@pytest.fixture
def recorded(tmp_path):
    """Write such a file; its path and points."""

    def recorded(analog=False):
        path = tmp_path / "a.c3d"
        return path, write_c3d(path, analog)

    return recorded


@needs_ezc3d
def test_markers_come_back_with_names_units_and_times(recorded):
    path, points = recorded()
    contents = read(open_c3d, path)
    axes = "xyz"
    assert contents.names == ["time", *(f"{marker} {axis}" for marker in ("nose", "fish:tail") for axis in axes)]
    assert contents.units == ["s", *["mm"] * 6]
    assert_allclose(contents["time"], np.arange(FRAMES) / RATE, rtol=1e-15)
    for k, axis in enumerate(axes):
        assert_allclose(contents[f"nose {axis}"], points[k, 0], rtol=1e-6)  # single precision in the file
        assert_allclose(contents[f"fish:tail {axis}"], points[k, 1], rtol=1e-6)
    assert np.isnan(contents["fish:tail x"][7])
    run = read_recording(path)
    assert_allclose(run["nose x"], 1e-3 * points[0, 0], rtol=1e-6)
    assert run["nose x"].attrs["units"] == "m"


@needs_ezc3d
def test_analog_channels_are_a_table_of_their_own(recorded):
    path, _ = recorded(analog=True)
    contents = read(open_c3d, path)
    assert "nose x" in contents.names
    assert any("left out: analogs/time, analogs/load cell (300 rows)" in phrase for phrase in contents.found)
    contents = read(open_c3d, path, table="analogs")
    assert (contents.names, contents.units) == (["time", "load cell"], ["s", "V"])
    assert_allclose(contents["time"], np.arange(10 * FRAMES) / (10 * RATE), rtol=1e-15)
    assert_allclose(contents["load cell"], np.linspace(-1, 1, 10 * FRAMES), atol=1e-7)


@needs_ezc3d
def test_a_file_that_breaks_off_is_refused(recorded, tmp_path):
    """ezc3d alone reads zeros where frames are missing."""
    raw = recorded()[0].read_bytes()
    frames = FRAMES * 2 * 4 * 4
    for cut in (raw[:end] for end in range(512, len(raw) - 512, 256)):  # the last block may be filled up
        contents = survived(open_c3d, tmp_path / "cut.c3d", cut)
        assert contents is None or len(cut) >= len(raw) - 512 - frames % 512


@needs_ezc3d
def test_a_damaged_head_is_refused_or_leaves_a_table(recorded, tmp_path):
    raw, rng = recorded()[0].read_bytes(), np.random.default_rng(3)
    for _ in range(30):  # some of these crash ezc3d itself
        places = [(float(rng.uniform(0, 1024 / len(raw))), int(rng.integers(256))) for _ in range(3)]
        survived(open_c3d, tmp_path / "a.c3d", flipped(raw, places))


def test_what_is_no_such_file_is_told(tmp_path):
    files = {
        "empty.c3d": (b"", "is empty"),
        "text.c3d": (b"t,F\n0,1\n" * 100, "this is not a C3D file but a text file"),
    }
    check_refusals(open_c3d, tmp_path, files)


def test_without_its_package_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ezc3d", None)
    (tmp_path / "a.c3d").write_bytes(b"\x02\x50" + bytes(2046))
    with pytest.raises(InputError, match=r"a\.c3d: the package ezc3d is missing: pip install 'nectosome\[c3d\]'"):
        read(open_c3d, tmp_path / "a.c3d")
