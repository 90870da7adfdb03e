"""The foam limb: what the recordings hold, what a rod makes of its tendon, and what stays unknown."""

import numpy as np
import pytest

from nectosome.solve import reading, static
from nectosome_studies import charts
from nectosome_studies.softlimb.limb import (
    SLACK_BY,
    SLACKS,
    identified,
    limb,
    limb_errors,
    limb_motions,
    limb_numbers,
)
from nectosome_studies.softlimb.limb_recordings import LIMBS, limb_recording, repeated, without_drift


@pytest.fixture(scope="module")
def recordings():
    return {name: limb_recording(name) for name in LIMBS}


def test_a_pattern_that_is_faster_than_the_camera_is_found_by_the_phase_of_its_samples(recordings):
    """The first 3 s of frames lie on the pattern that all later ones make: medians in mm, of 15 mm from end to end."""
    least = {"water_1": 0.01, "cyclic": 0.01, "baseline": 0.1, "water_2": 0.2, "water_3": 0.3, "air": 1.0}
    for name, within in least.items():
        one = recordings[name]
        moving = np.flatnonzero(one.runs)
        early, late = moving[:180], moving[180:]
        later = one._replace(runs=np.isin(np.arange(len(one.time)), late))
        assert np.median(np.abs(later.pattern(one.time[early]) - one.column[early])) < 1e-3 * within


def test_what_the_camera_sees_of_the_fast_commands_jumps(recordings):
    """From one frame to the next by a quarter of all of it and more on the mean, where slow ones take four frames."""
    jumps = {"water_1": (0.0, 0.1), "cyclic": (0.0, 0.1), "air": (0.3, 0.5), "water_2": (0.3, 0.5)}
    for name, jump in {**jumps, "baseline": (0.2, 0.3), "water_3": (0.2, 0.3)}.items():
        one = recordings[name]
        column = one.column[one.runs]
        assert jump[0] <= np.abs(np.diff(column)).mean() / np.ptp(column) <= jump[1]


def test_the_fast_commands_do_not_explain_what_the_limb_does(recordings):
    """Both limbs do the same, to 0.94 and more: it is no noise. But it repeats itself with slow commands only."""
    shares = {"water_1": (0.98, 1.0), "cyclic": (0.95, 1.0), "air": (0.4, 0.6), "water_2": (0.3, 0.4)}
    for name, share in {**shares, "baseline": (0.6, 0.7), "water_3": (0.4, 0.5)}.items():
        one = recordings[name]
        moves, other = (without_drift(one.time, x)[one.runs] for x in (one.angle, one.other))
        assert np.corrcoef(moves, other)[0, 1] > 0.94
        assert share[0] < repeated(one.cycles(one.time[one.runs]), moves) < share[1]


def test_the_limb_bends_in_water_and_hardly_in_air(recordings):
    """Means over the first 3 s, by nearly the same contraction: so it is not the tendon's alone."""
    means = {name: np.rad2deg(one.angle[one.runs][:180].mean()) for name, one in recordings.items()}
    pulls = {name: 1e3 * one.contraction()[one.runs][:180].mean() for name, one in recordings.items()}
    assert 7.5 < pulls["air"] < 8.5 and 7.5 < pulls["water_2"] < 8.5
    assert abs(means["air"]) < 1.0 and 5.0 < means["water_2"] < 15.0 and means["water_1"] > 20.0


def test_the_share_that_repeats_itself():
    """A sine and another of a third of its variance, whose frequency is no multiple: 3/4."""
    t = np.arange(4000) / 60
    value = np.sqrt(3) * np.sin(2 * np.pi * 1.08 * t) + np.sin(2 * np.pi * 0.777 * t)
    assert repeated(1.08 * t, value) == pytest.approx(0.75, abs=0.01)


def test_two_commands_slow_down_once(recordings):
    """By 5 mHz, and to the frequency of `water_2`, within 0.5 mHz."""
    for name in ("baseline", "water_3"):
        one = recordings[name]
        assert one.frequency - one.later == pytest.approx(5e-3, abs=5e-4)
        assert one.later == pytest.approx(recordings["water_2"].frequency, abs=5e-4)
        assert one.cycles(one.time[one.time < one.slows])[-1] == pytest.approx(0.0, abs=0.02)  # it does not jump


def test_the_tendon_is_loose_at_rest(recordings):
    """The same markers on one limb, a command of 6.5 mm at rest in two recordings and of 1.2 mm in one: angles within
    1 deg. By the gain that is found without slack a taut tendon would turn it by 14 deg more."""
    angles = {name: np.rad2deg(recordings[name].rest) for name in ("water_2", "baseline", "water_3")}
    pulls = {name: 1e3 * recordings[name].contraction()[0] for name in angles}
    assert abs(angles["baseline"] - angles["water_2"]) < 1.0 and abs(angles["water_3"] - angles["water_2"]) < 1.0
    more = pulls["baseline"] - pulls["water_2"]
    assert more == pytest.approx(5.278, abs=1e-3) and pulls["water_3"] == pulls["baseline"]
    assert np.rad2deg(0.71 * 0.052 * more * 2.71e-3 / (500e3 * 0.015**4 / 12)) == pytest.approx(14.4, abs=0.1)


def test_a_tendon_beside_the_middle_bends_the_limb_to_an_arc():
    """Kirchhoff: kappa = T a/(E I), the tangent at 0.71 L turns by 0.71 kappa L; its moment is the same all along."""
    settings = ["body.loads.tendon.tension.value=10 N", "gain=2 mm", "E=500 kPa"]
    turned = reading(static(limb(), settings=settings), "body.0.71.heading")[-1]
    assert turned == pytest.approx(0.71 * 0.052 * 10 * 0.002 / (500e3 * 0.015**4 / 12), rel=1e-6)


def test_the_tendon_is_counted_from_no_contraction(recordings):
    """Before it moves the command is that at rest, in the files 0, 1.696 and 1.194 mm; in water_1 it is never more than
    17.91 mm."""
    for name, rest in {"water_1": 0.0, "air": 1.69646, "water_2": 1.1938052}.items():
        one = recordings[name]
        assert one.contraction()[: one.begins + 1] == pytest.approx(1e-3 * rest, abs=1e-12)
    assert 17.8e-3 < recordings["water_1"].contraction().max() < 17.91e-3


@pytest.mark.slow
def test_one_recording_in_water_tells_ratios_and_no_modulus():
    """With E known, viscosity and gain are identifiable and drag is not; with E unknown none of the four is."""
    found = identified()
    held, asked = found.held[0].to_dataset(), found.asked.to_dataset()
    assert dict(zip(held["parameter"].values, held["identifiable"].values, strict=True)) == {
        "eta": True,
        "gain": True,
        "drag": False,
    }
    assert not asked["identifiable"].any()
    motions = limb_motions(found)
    errors = limb_errors(found, motions)
    assert float(errors["error"].sel(recording="water_1", predictor="held")) < 0.125 * float(errors["range"][0])
    numbers = limb_numbers(held, asked, errors, SLACKS[found.loose])
    assert {name for name, x in numbers.items() if x is None} == {"young", "drag"}
    assert SLACKS[found.loose] == 10.0  # as pages and figures say
    by_slack = errors["slack_error"].sel(recording=SLACK_BY)
    assert float(by_slack.min()) == float(errors["error"].sel(recording=SLACK_BY, predictor="loose"))
    for fit, slack in zip(found.held, SLACKS, strict=True):  # it rests bent where the tendon is taut
        turns = {trial.name: rows[0, 0] for trial, rows in fit.test}
        for name, pull in {"water_2": 1.1938052, "baseline": 6.4716806}.items():
            arc = 0.71 * 0.052 * max(pull - slack, 0.0) * fit.theta[1] / (500e3 * 0.015**4 / 12)
            assert turns[name] == pytest.approx(arc, rel=1e-5, abs=1e-12)
    (panel,) = charts.panels("softlimb", {"limb-motions": motions}).values()
    assert len(panel.figure.data) == 30
