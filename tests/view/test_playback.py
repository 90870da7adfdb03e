"""The playback of a run on the stage: period after period it goes on along the screw of the first one."""

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

from nectosome.view.display.playback import Playback, repeated

PERIOD, RATE, PITCH, RADIUS = 0.5, 0.8, 0.3, 0.7  # s, rad/s, m/s, m
TIMES = np.linspace(0.0, PERIOD, 11)


def helix(t):
    """A body on a helix about an upright line through (0.2, -0.1), which nods with its period."""
    nod = Rotation.from_euler("y", 0.1 * np.sin(2 * np.pi * t / PERIOD))
    turned = Rotation.from_euler("z", RATE * t)
    R = (turned * nod).as_matrix()
    return R, np.array([0.2, -0.1, 0.0]) + turned.apply([RADIUS, 0, 0]) + [0, 0, PITCH * t]


@pytest.fixture(scope="module")
def run():
    R, p = (np.stack(x) for x in zip(*(helix(t) for t in TIMES), strict=True))
    data = {
        "position": (("time", "station", "axis"), p[:, None]),
        "rotation": (("time", "station", "row", "axis"), R[:, None]),
    }
    return xr.Dataset(data, {"time": TIMES, "part": ["body"]})


@pytest.mark.parametrize("n", [0, 1, 7])
@pytest.mark.parametrize("k", [0, 3, 9])
def test_later_periods_are_where_the_motion_goes_on(run, n, k):
    t = n * PERIOD + TIMES[k]
    instant = Playback.of(run, PERIOD).instant(t + 1e-9, along=False)
    R, p = helix(t)
    assert instant.k == k
    np.testing.assert_allclose(instant.R @ run["position"].values[k, 0] + instant.d, p, atol=1e-12)
    np.testing.assert_allclose(instant.R @ run["rotation"].values[k, 0], R, atol=1e-12)


def test_the_observer_goes_along_evenly_and_meets_the_body_at_each_period(run):
    playback = Playback.of(run, PERIOD)
    for n in range(4):
        np.testing.assert_allclose(playback.instant(n * PERIOD + 1e-12, True).here, helix(n * PERIOD)[1], atol=1e-9)
    steps = np.diff([playback.instant(t, True).here for t in np.linspace(0.01, 0.49, 20)], axis=0)
    np.testing.assert_allclose(steps, np.tile(steps[0], (19, 1)), atol=1e-12)


def test_the_way_is_that_of_the_periods_before(run):
    path = Playback.of(run, PERIOD).path(2)
    expected = [helix(t - 2 * PERIOD)[1] for t in TIMES]
    np.testing.assert_allclose(path[: TIMES.size], expected, atol=1e-12)
    np.testing.assert_allclose(path[-TIMES.size :], run["position"].values[:, 0])


def test_a_run_without_a_period_is_seen_as_it_was(run):
    playback = Playback.of(run, 0.0)
    assert playback.end == PERIOD
    instant = playback.instant(TIMES[4] + 1e-9, along=True)
    assert instant.k == 4
    np.testing.assert_array_equal(instant.here, run["position"].values[4, 0])
    np.testing.assert_array_equal(instant.R, np.eye(3))


def test_what_repeats_itself_is_the_longer_motion(run):
    sized = run.assign(half_width=(("station", "across"), [[0.1, 0.1]]), station_x=("station", [0.05]))
    for seconds, periods in ((2.2, 5), (1.5, 3), (0.1, 1)):
        whole = repeated(sized, PERIOD, seconds)
        time = whole["time"].values
        np.testing.assert_allclose(time, np.linspace(0, periods * PERIOD, periods * 10 + 1), atol=1e-12)
        R, p = (np.stack(x) for x in zip(*map(helix, time), strict=True))
        np.testing.assert_allclose(whole["position"].values[:, 0], p, atol=1e-12)
        np.testing.assert_allclose(whole["rotation"].values[:, 0], R, atol=1e-12)
        assert whole["half_width"].dims == ("station", "across")
        assert list(whole["part"].values) == list(run["part"].values)
