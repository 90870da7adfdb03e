"""The study of the tracker: what it films is what it compares with."""

import numpy as np
import pytest
import xarray as xr
from scipy.interpolate import CubicSpline

from nectosome_studies import STUDIES
from nectosome_studies.study import printed
from nectosome_studies.track import poseidrone, rowing, study, tank
from nectosome_studies.track.limits import Degradation, _table
from nectosome_studies.track.rowing import RowingMotion, Shot


@pytest.fixture(scope="module")
def motion():
    """A made-up cycle of the right sizes: the first layer turns to and fro, the others trail behind."""
    time = np.linspace(0, 1.0, 21)
    lengths = np.array([0.105, 0.035, 0.035, 0.035])
    directions = np.stack([1.2 * np.sin(2 * np.pi * time - lag) for lag in (0.0, 0.3, 0.6, 0.9)], axis=1)
    unit = np.stack([np.cos(directions), np.sin(directions)], axis=-1) * lengths[:, None]
    middles = np.cumsum(unit, axis=1) - 0.5 * unit
    rows = np.concatenate([middles, directions[..., None]], axis=-1).reshape(len(time), -1)
    rows[-1] = rows[0]
    return RowingMotion(1.0, lengths, CubicSpline(time, rows, bc_type="periodic"))


def test_a_rendered_stroke_is_tracked_as_it_was(motion):
    found = rowing.tracked(motion, Shot(), 30, lambda share: None, every=4)
    turn, off = rowing.errors(found)
    assert np.rad2deg(np.sqrt(np.nanmean(turn**2))) < 0.35
    assert np.sqrt(np.nanmean(off**2)) < 0.5e-3
    assert np.mean(np.isfinite(turn)) > 0.95


def test_cycles_are_put_together_by_phase(motion):
    frames = round(rowing.RATE)
    time = np.arange(3 * frames) / rowing.RATE
    true = motion.at(time)[..., 2]
    noise = np.deg2rad(0.5) * np.random.default_rng(0).normal(size=true[:, 1:].shape)
    measured = np.diff(true, axis=1) + noise
    measured[5] = np.nan
    found = xr.Dataset(
        {"joint_angle": (("time", "joint"), measured), "true_direction": (("time", "segment"), true)},
        coords={"joint": ["a", "b", "c"]},
    )
    made = rowing.by_phase(found, motion)
    assert made.attrs["cycles"] == 3
    assert np.isfinite(made["angle"].values).all()  # the gap of one cycle is filled by the others
    off = np.rad2deg(made["angle"].values - made["simulated"].values)
    assert np.sqrt(np.mean(off**2)) == pytest.approx(0.5 / np.sqrt(3), rel=0.2)


def test_the_swim_that_is_filmed_is_that_of_the_recording():
    """Its speed, taken from its path, is the one that the equation of motion gave."""
    path = poseidrone.swim("train", 3.0)
    time, speed = poseidrone.settled(poseidrone.OMEGA["train"])
    now = time[10:140]
    place = np.array([path(now + dt)[0][:, 0] for dt in (-1e-4, 1e-4)])
    np.testing.assert_allclose((place[1] - place[0]) / 2e-4, speed[10:140], atol=1e-6)


def test_an_exact_track_gives_the_numbers_back_from_either_file():
    """Without cameras between: what remains is the filter on positions."""
    time = np.arange(0, 6.0, 0.02)
    place, _ = poseidrone.swim("train", 6.0)(time)
    none = np.zeros(len(time))
    track = xr.Dataset(
        {"position": (("time", "axis"), place, {"units": "m"}), "status": ("time", none, {"units": "1"})},
        coords={"time": time, "axis": ["x", "y", "z"]},
    )
    found = poseidrone.identified(track, "train", 6.0)
    _, *true = poseidrone.body()
    np.testing.assert_allclose(found["csv"].physical.values, true, rtol=0.01)
    np.testing.assert_array_equal(found["csv"].physical.values, found["tdms"].physical.values)


def test_what_breaks_is_the_first_level_that_is_too_bad():
    kinds = (
        Degradation("noise", "", "grain", (0, 1, 2)),
        Degradation("light", "", "gain", (1, 2)),
        Degradation("bar", "", "bar", (1, 2, 3)),
    )
    rows = [[(0.1, 1.0), (0.2, 0.9), (0.7, 0.9)], [(0.1, 1.0), (0.2, 1.0)], [(0.1, 1.0), (np.nan, 0.0), (0.1, 1.0)]]
    made = _table(kinds, rows, 0.5)
    assert made["broken"].values.tolist() == [2, -1, 1]


def test_without_the_packages_rows_have_no_numbers_and_say_why(monkeypatch):
    monkeypatch.setattr(study, "find_spec", lambda name: None)
    done = STUDIES["track"].run(True, lambda what, share: None)
    assert [row["id"] for row in done.rows] == list(printed("track"))
    assert {row["kind"] for row in done.rows} == {"missing"}
    assert all("nectosome[video]" in row["note"] for row in done.rows)


def test_the_sheet_says_where_the_lamps_are_but_not_exactly_where_they_are_seen():
    sheet, cameras = tank.sheet(tank.Filming()), tank.cameras(tank.Filming())
    for k, point in enumerate(sheet.points.values()):
        for name, pixel in point.seen.items():
            off = np.abs(np.array(pixel) - cameras[name].sees(tank.lamps_at()[k : k + 1])[0])
            assert 0 < off.max() < 5
