"""Points that SLEAP and DeepLabCut tracked, in the HDF5 files that they write, come back under their names."""

import json
import pickle

import h5py
import numpy as np
import pandas as pd
import pytest
from hypothesis import given

from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet
from nectosome.measure import read as read_recording
from nectosome.measure.formats.hdf5 import open_hdf5
from nectosome.measure.formats.pose_tracks import unpickled_texts
from nectosome.units import InputError

from .read import flipped, flips, read, survived

FRAMES, NODES = 50, ["nose", "tail é"]
RANDOM = np.random.default_rng(0)


def sleap(path, animals=3, dims=("track", "xy", "node", "frame"), newer=True, **more):
    """A file as SLEAP or sleap-io writes it; returns points and scores by frame, track, node (and coordinate)."""
    points = RANDOM.normal(size=(FRAMES, animals, 2, 2))
    points[3, 0] = np.nan
    scores = RANDOM.uniform(size=(FRAMES, animals, 2))
    own = ["frame", "track", "node", "xy"]
    flat = [dim for dim in dims if dim != "xy"]
    with h5py.File(path, "w") as file:
        file.create_dataset("tracks", data=points.transpose([own.index(d) for d in dims]), compression="gzip")
        file.create_dataset("point_scores", data=scores.transpose([own.index(d) for d in flat]), compression="gzip")
        if newer:
            file["tracks"].attrs["dims"] = json.dumps(dims)
        file["node_names"] = np.array([name.encode() for name in NODES])
        file["track_names"] = np.array([f"fish {k}".encode() for k in range(animals)]) if animals > 1 else np.array([])
        file["track_occupancy"] = np.ones((FRAMES, animals), "u1")
        file["instance_scores"] = np.ones((animals, FRAMES))
        file["video_path"] = "video.mp4"
        for name, value in more.items():
            del file[name]
            file[name] = value
    return points, scores


@pytest.mark.parametrize("newer", [True, False])
def test_sleap_with_one_animal(tmp_path, newer):
    points, scores = sleap(tmp_path / "a.h5", animals=1, newer=newer)
    got = read(open_hdf5, tmp_path / "a.h5")
    assert got.names == ["nose x", "nose y", "nose score", "tail é x", "tail é y", "tail é score"]
    np.testing.assert_array_equal(got["tail é y"], points[:, 0, 1, 1])
    np.testing.assert_array_equal(got["nose score"], scores[:, 0, 0])
    assert got.found[0] == "written by: SLEAP"
    assert "write time: {rate: 30 Hz} in a sheet" in got.found[1]


@pytest.mark.parametrize(
    "dims", [("track", "xy", "node", "frame"), ("frame", "track", "node", "xy"), ("node", "frame", "xy", "track")]
)
def test_sleap_with_several_animals_in_any_order_of_axes(tmp_path, dims):
    points, scores = sleap(tmp_path / "a.h5", dims=dims)
    got = read(open_hdf5, tmp_path / "a.h5", rows=7)
    assert len(got.names) == 3 * 2 * 3
    for k in range(3):
        for i, node in enumerate(NODES):
            np.testing.assert_array_equal(got[f"fish {k} {node} x"], points[:, k, i, 0])
            np.testing.assert_array_equal(got[f"fish {k} {node} score"], scores[:, k, i])


def test_a_sheet_gives_the_rate_and_chooses_points(tmp_path):
    points, _ = sleap(tmp_path / "a.h5")
    data = {"time": {"rate": "25 Hz"}, "columns": {"x": {"column": "fish 1 nose x", "gain": "0.2 mm/px", "unit": "px"}}}
    run = read_recording(tmp_path / "a.h5", validate_as(Sheet, data, "sheet"))
    np.testing.assert_allclose(run["time"], np.arange(FRAMES) / 25, rtol=1e-14)
    np.testing.assert_allclose(run["x"], 0.2e-3 * points[:, 1, 0, 0], rtol=1e-14)


@pytest.mark.parametrize(
    "more",
    [
        {"node_names": np.array([b"nose"])},
        {"node_names": np.array([1.0, 2.0])},
        {"point_scores": np.ones((3, 2, 4))},
        {"tracks": np.ones((3, 3, 2, FRAMES))},
    ],
)
def test_a_file_of_sleap_that_does_not_fit_together_is_refused(tmp_path, more):
    sleap(tmp_path / "a.h5", newer=False, **more)
    with pytest.raises(InputError, match=r"a\.h5: cannot be read: the file is damaged or cut off"):
        read(open_hdf5, tmp_path / "a.h5")


def frame(levels=3, rows=40):
    """A table as DeepLabCut makes it: columns are tuples of network, (animal,) point and coordinate."""
    animals = [("a",), ("b",)] if levels == 4 else [()]
    columns = [("net", *a, part, c) for a in animals for part in ("nose", "tail") for c in ("x", "y", "likelihood")]
    return pd.DataFrame(RANDOM.normal(size=(rows, len(columns))), columns=pd.MultiIndex.from_tuples(columns))


def pytables(path, table, protocol=0, group="df_with_missing"):
    """A file as pandas' `to_hdf(..., format="table")` writes it through PyTables."""
    kinds = [("index", "<i8"), ("values_block_0", "<f8", (table.shape[1],))]
    records = np.zeros(len(table), kinds)
    records["index"], records["values_block_0"] = table.index, table.to_numpy()
    with h5py.File(path, "w") as file:
        made = file.create_group(group)
        made.attrs["pandas_type"] = np.bytes_("frame_table")
        data = made.create_dataset("table", data=records, chunks=(16,), compression="gzip")
        data.attrs["values_block_0_kind"] = np.void(pickle.dumps([*table.columns], protocol))
        if protocol == 0:
            data.attrs["values_block_0_kind"] = np.bytes_(pickle.dumps([*table.columns], protocol))
        made.create_group("_i_table").create_group("index")["bounds"] = np.zeros((0, 127))
    return table


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
@pytest.mark.parametrize("levels", [3, 4])
def test_deeplabcut(tmp_path, levels, protocol):
    table = pytables(tmp_path / "a.h5", frame(levels), protocol)
    got = read(open_hdf5, tmp_path / "a.h5")
    assert got.names == ["frame", *(" ".join(column[1:]) for column in table.columns)]
    np.testing.assert_array_equal(got.values[:, 1:], table.to_numpy())
    np.testing.assert_array_equal(got["frame"], np.arange(40))
    assert got.found[0] == "written by: DeepLabCut"
    assert "write time: {rate: 30 Hz} in a sheet" in got.found[1]


def test_other_tables_of_pandas_keep_their_names(tmp_path):
    table = pd.DataFrame({"time [s]": 0.1 * np.arange(20), "force [N]": np.arange(20.0)})
    pytables(tmp_path / "a.h5", table, group="log")
    run = read_recording(tmp_path / "a.h5")
    np.testing.assert_array_equal(run["time"], table["time [s]"])
    assert run["force"].attrs["units"] == "N"
    assert list(run.data_vars) == ["index", "force"]


def test_the_other_layout_of_pandas(tmp_path):
    table = frame()
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file.create_group("df_with_missing")
        group["block0_values"] = table.to_numpy()
        for i, (level, codes) in enumerate(zip(table.columns.levels, table.columns.codes, strict=True)):
            for axis in ("axis0", "block0_items"):
                group[f"{axis}_level{i}"] = np.array([name.encode() for name in level])
                group[f"{axis}_label{i}"] = codes
        group["axis1"] = np.arange(len(table))
    got = read(open_hdf5, tmp_path / "a.h5")
    assert got.names == [" ".join(column[1:]) for column in table.columns]
    np.testing.assert_array_equal(got.values, table.to_numpy())


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
@pytest.mark.parametrize(
    "value", [[], ["a"], [("a", "b", 3), ("c", "é", -70_000)], [(), ("a",)], ["a"] * 3000, [[["x"]]]]
)
def test_names_come_out_of_a_pickle_that_is_not_run(value, protocol):
    assert unpickled_texts(pickle.dumps(value, protocol)) == value


class Harmful:
    def __reduce__(self):
        return print, ("run",)


MUCH = b"\x80\x05\x96" + (2**60).to_bytes(8, "little")  # an array of as many bytes, of which none follows


@pytest.mark.parametrize(
    "raw", [pickle.dumps([Harmful()]), pickle.dumps([np.float64(1)]), b"(lp0", b"", b"I" + b"9" * 9000, MUCH]
)
def test_anything_else_in_a_pickle_is_refused(raw, capsys):
    with pytest.raises((ValueError, EOFError, KeyError)):
        unpickled_texts(raw)
    assert capsys.readouterr().out == ""


def test_a_harmful_pickle_is_told_as_damage(tmp_path):
    pytables(tmp_path / "a.h5", frame())
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        file["df_with_missing/table"].attrs["values_block_0_kind"] = np.void(pickle.dumps([Harmful()]))
    with pytest.raises(InputError, match="the file is damaged"):
        read(open_hdf5, tmp_path / "a.h5")


@given(flips)
def test_damaged_files_are_refused_or_read(tmp_path_factory, places):
    folder = tmp_path_factory.mktemp("damaged")
    for write in (sleap, lambda path: pytables(path, frame())):
        write(folder / "a.h5")
        survived(open_hdf5, folder / "b.h5", flipped((folder / "a.h5").read_bytes(), places))
