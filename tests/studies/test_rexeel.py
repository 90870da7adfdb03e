"""The study of RExEel: the authors' error table, the recordings, the robot's geometry, and other water."""

import numpy as np
import pytest

from nectosome.description import Rigid, Rod
from nectosome.robots import describe
from nectosome_studies import STUDIES
from nectosome_studies.rexeel import actuation
from nectosome_studies.rexeel.errors import TIMES, Links, Track, as_the_authors, centre_of_mass, errors, natural
from nectosome_studies.rexeel.recordings import AMPLITUDES, commanded, logged, recorded
from nectosome_studies.rexeel.swim import SAMPLES, links, motion, swim
from nectosome_studies.rexeel.water import CHANGES
from nectosome_studies.study import printed

LINKS = Links(np.array([0.12, *[0.098] * 5]), np.array([0.192, *[0.14] * 5]))

# every sixth picture of Genesis' swim at 10 deg, 60 a second: x, y [cm] (genesis_simulation_trajectories.csv, which has
# a yaw of 90 deg throughout)
GENESIS = """
0 61.0 61.0, 6 61.033676 60.592506, 12 61.09734 60.65919, 18 61.22425 60.94953, 24 61.37612 61.143093,
30 61.47778 61.136536, 36 61.453293 60.995464, 42 61.25303 60.860126, 48 60.878925 60.817715, 54 60.407433 60.85306,
60 59.955025 60.89127, 66 59.64685 60.88748, 72 59.48632 60.869583, 78 59.462425 60.88827, 84 59.561043 60.952686,
90 59.761944 61.01967, 96 60.05314 61.048138, 102 60.40915 61.03672, 108 60.804882 61.021725, 114 61.221706 61.040684,
120 61.629753 61.084156, 126 62.003666 61.1141, 132 62.3169 61.113045, 138 62.52026 61.09649, 144 62.58259 61.095074,
150 62.483707 61.12657, 156 62.21392 61.183838, 162 61.78229 61.24521, 168 61.23173 61.287373, 174 60.63041 61.29977,
180 60.0517 61.287567, 186 59.57267 61.263584, 192 59.247612 61.233757, 198 59.109848 61.212997, 204 59.163857 61.21477,
210 59.3962 61.242702, 216 59.775715 61.28356, 222 60.251736 61.322906, 228 60.778862 61.34864, 234 61.302906 61.35281,
239 61.704144 61.339977
"""


@pytest.fixture(scope="module")
def measured():
    return {amplitude: recorded(amplitude) for amplitude in AMPLITUDES}


@pytest.fixture(scope="module")
def swum():
    return swim(describe("rexeel"), commanded(30, SAMPLES))


def test_errors_are_those_that_the_authors_print(measured):
    """Genesis at 10 deg against their recordings, all five numbers to the last digit printed (cm, deg)."""
    frame, x, y = np.array([[float(word) for word in point.split()] for point in GENESIS.split(",")]).T
    track = natural(frame / 60, np.stack([x, y], axis=1) / 100)
    theirs = as_the_authors(measured[10])
    genesis = Track(track[:, 0], track[:, 1], np.zeros(TIMES.size), theirs.angles)
    found = np.array(errors(genesis, theirs, LINKS)) * [100, 100, 100, 100, np.rad2deg(1)]
    assert found == pytest.approx([2.709, 6.152, 2.351, 6.323, 8.766], abs=6e-4)


def test_errors_vanish_for_the_swims_themselves_wherever_they_start(measured):
    theirs = as_the_authors(measured[20])
    one = Track(theirs.x[3], theirs.y[3], theirs.yaw[3], theirs.angles)
    moved = Track(one.x + 0.3, one.y - 0.2, one.yaw, one.angles)
    assert errors(moved, Track(*(x[None] for x in one[:3]), one.angles), LINKS) == pytest.approx(5 * [0.0], abs=1e-15)


def test_the_centre_of_mass_lies_behind_the_head_and_on_the_side_to_which_links_turn():
    """Straight: 0.140 kg at 0.109, 0.207, ... m behind the head; all links but it turned by 90 deg: beside its end."""
    straight = Track(*(np.zeros(1) for _ in range(3)), np.zeros((1, 5)))
    behind = 0.14 * (5 * 0.109 + 0.098 * (1 + 2 + 3 + 4)) / 0.892
    assert centre_of_mass(straight, LINKS)[0] == pytest.approx([0, -behind], abs=1e-15)
    turned = straight._replace(angles=np.array([[np.pi / 2, 0, 0, 0, 0]]))
    beside = 0.14 * 0.098 * (0.5 + 1.5 + 2.5 + 3.5 + 4.5) / 0.892
    assert centre_of_mass(turned, LINKS)[0] == pytest.approx([beside, -0.7 * 0.06 / 0.892], abs=1e-15)


@pytest.mark.slow
def test_the_simulated_robot_has_the_centre_of_mass_that_the_errors_are_computed_with(swum):
    """The same from the places of all links in the run, to rounding of the angles' interpolation."""
    run = swum.run.to_dataset()
    first = np.unique(run["station_part"].values, return_index=True)[1]
    middles = run["position"].values[:, np.sort(first), :2]
    centre = np.einsum("k,tka->ta", LINKS.mass / LINKS.mass.sum(), middles)
    ours = centre_of_mass(swum.track, links(describe("rexeel")))
    seen = np.stack([centre[:, 1], -centre[:, 0]], axis=1)
    assert ours - ours[0] == pytest.approx(seen - seen[0], abs=1e-9)


@pytest.mark.slow
def test_it_swims_ahead_and_recoils_as_the_recorded_robot(swum, measured):
    """Forwards along the tank, and its yaw in phase with that of the swims: their correlation is above 0.98."""
    theirs = as_the_authors(measured[30])
    assert swum.track.y[-1] > 0.3
    assert np.corrcoef(swum.track.yaw, theirs.yaw.mean(axis=0))[0, 1] > 0.98


def test_the_motors_are_told_what_the_robot_is_told(measured):
    """The log's targets, to their last digit (0.01 deg)."""
    for amplitude, swims in measured.items():
        assert np.rad2deg(swims.target - commanded(amplitude, swims.log_time)) == pytest.approx(0, abs=0.0065)


def test_gain_and_lag_of_motors_are_found_from_their_log(measured):
    """Of made-up logs to 2e-3 and 0.2 ms; of the motors' own, another amplitude is predicted within 0.15 deg."""
    swims = measured[10]
    time, lag = swims.log_time, np.array([0.02, 0.03, 0.01, 0.04, 0.025])
    gain = np.array([0.99, 1.01, 1.0, 0.97, 1.02])
    made = actuation.through(actuation.IdentifiedMotors(gain, np.empty((5, 2)), lag, np.empty((5, 2))), 10, time)
    found = actuation.identified(swims._replace(target=commanded(10, time), actual=made))
    np.testing.assert_allclose(found.gain, gain, atol=2e-3)
    np.testing.assert_allclose(found.lag, lag, atol=2e-4)
    own = actuation.to_dataset(actuation.identified(swims), [measured[k] for k in AMPLITUDES])
    assert float(own["error"].sel(amplitude=20).max()) < 0.15
    assert float(own["error_commanded"].sel(amplitude=20).min()) > 0.9


def test_angles_as_logged_pass_through_the_log(measured):
    """Within the encoder's steps of 0.088 deg and the log's noise."""
    for swims in measured.values():
        off = logged(swims, swims.log_time[:-1]) - swims.actual[:-1]
        assert np.sqrt(np.mean(off**2)) < np.deg2rad(0.06)


def test_recordings_give_the_distances_and_speeds_that_they_are_known_for(measured):
    counts, distances, speeds = [], [], []
    for swims in measured.values():
        found = motion(swims.time, swims.x, swims.y, swims.yaw)
        counts.append(len(swims.x))
        distances.append(100 * found.distance.mean())
        speeds.append(100 * found.speed.mean())
    assert counts == [21, 20, 20, 19]
    assert distances == pytest.approx([13.3, 33.5, 49.4, 56.3], abs=0.05)
    assert speeds == pytest.approx([4.74, 11.22, 15.52, 17.95], abs=0.006)


def test_speed_and_swing_are_those_of_a_made_up_track():
    """2 cm/s along, with a yaw of 10 deg to either side."""
    time = np.arange(120) / 30
    found = motion(time, np.zeros(120), 0.02 * time, np.deg2rad(10) * np.cos(np.pi * time))
    assert found.speed == pytest.approx(0.02, rel=1e-12)
    assert found.distance == pytest.approx(0.02 * time[-1], rel=1e-12)
    assert np.rad2deg(found.yaw_swing) == pytest.approx(20, rel=1e-12)


@pytest.mark.parametrize("name", CHANGES)
def test_other_water_leaves_the_robot_as_it_is(name):
    """Lengths, masses and motions; and some load is another one."""
    robot = describe("rexeel")
    other = CHANGES[name].at(robot, 20)
    assert [part.length for part in other.parts.values()] == pytest.approx(LINKS.length)
    assert [mass(part) for part in other.parts.values()] == pytest.approx(LINKS.mass, rel=1e-12)
    assert all(other.limbs[link].joint == limb.joint for link, limb in robot.limbs.items())
    assert any(other.parts[part].loads != robot.parts[part].loads for part in robot.parts)


def mass(part):
    """Of a box, or of a straight elliptic rod [kg]."""
    if isinstance(part, Rigid):
        return part.mass
    assert isinstance(part, Rod)
    return part.density * np.pi / 4 * part.width * part.height * part.length


def test_every_printed_row_of_errors_has_both_codes():
    rows = {row: entry for row, entry in printed("rexeel").items() if "rmse" in row}
    assert len(rows) == 5 * len(AMPLITUDES) + 1
    assert all(entry["genesis"] > entry["printed"] for entry in rows.values())


@pytest.mark.slow
def test_the_study_fills_all_rows():
    found = STUDIES["rexeel"].run(True, lambda what, share: None)
    ours = {row["id"]: row["ours"] for row in found.rows}
    assert all(x is not None and np.isfinite(x) for x in ours.values())
    assert sum(row["kind"] == "prediction" and row["source"] == "measured" for row in found.rows) == 3 * len(AMPLITUDES)
    names = ("distance", "speed", "rmse-along", "rmse-across", "rmse-yaw")
    assert {f"rexeel/{k}deg/{name}" for k in AMPLITUDES for name in names} <= {*ours}
