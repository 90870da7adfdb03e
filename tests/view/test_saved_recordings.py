"""Files of `measure` and `track` are told apart, and what is none of them is refused with what it lacks."""

import numpy as np
import pytest
import xarray as xr
from tests.measured_files import means, recorded, tracked

from nectosome.io import load_dataset, save_dataset
from nectosome.units import InputError
from nectosome.view.saved_recordings import saved_recording


def kept(data: xr.Dataset, folder) -> xr.Dataset:
    """As it is read from a file again."""
    save_dataset(data, folder / "kept.nc")
    return load_dataset(folder / "kept.nc")


def test_a_recording_shows_its_quantities_and_their_ranges(tmp_path):
    found = saved_recording(kept(recorded(tmp_path), tmp_path), "kept.nc")
    (panel,) = found.panels.values()
    assert [line.y.tolist() for line in panel.figure.data] == [[1, 2, 3], pytest.approx(np.radians([10, 20, 30]))]
    (table,) = found.summary.tables
    assert table.texts()[1][:5] == ("push", "push", "1 N", "2 N", "3 N")


def test_means_show_each_number_with_its_interval(tmp_path):
    data = kept(means(), tmp_path)
    found = saved_recording(data, "kept.nc")
    assert [*found.panels] == ["mean", "amplitude"]
    bars = found.panels["mean"].figure.data[0].error_y
    assert bars.array == pytest.approx(1e3 * (data["mean_high"] - data["mean"]).values)  # mN
    assert "20 deg, 0.4 Hz" in found.summary.tables[1].texts()[1]


def test_a_track_shows_gaps_and_how_much_was_seen(tmp_path):
    found = saved_recording(kept(tracked(), tmp_path), "kept.nc")
    lines = {line.name: line.y for line in found.panels["segments"].figure.data if line.showlegend is not False}
    assert np.isnan(lines["tail"]).tolist() == [False, False, False, True, False]
    assert found.summary.tables[0].texts()[2][:3] == ("tail", "80.0 %", "100.0 mm")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (xr.Dataset(), "it has no time"),
        (tracked().drop_vars("quality"), "this is not a track of segments: it has no quality over time, segment"),
        (tracked().assign_attrs(provenance="{}"), "its provenance does not say how it was read"),
        (tracked().drop_vars("reason"), "it has no reason"),
        (tracked().isel(time=[]), "it has no frames"),
        (means().drop_vars("mean_low"), "it has no mean_low over condition"),
        (means().drop_vars("runs"), "it has no runs by conditions"),
    ],
)
def test_what_is_none_of_them_is_refused(data, words):
    with pytest.raises(InputError, match=f"a.nc.*{words}"):
        saved_recording(data, "a.nc")


def test_a_recording_that_lacks_its_columns_is_refused(tmp_path):
    data = recorded(tmp_path)
    data["push"].attrs.pop("column")
    with pytest.raises(InputError, match="it is not told which column push was"):
        saved_recording(data, "a.nc")
