"""Means over a beat: what oscillates is gone, what drifts is left."""

import numpy as np
import pytest

from nectosome.controllers import Beat, BeatAveraged, BeatMean, beat_of, instants_per_sample, pid_of
from nectosome.robots import describe
from nectosome.units import InputError

from .simple_loops import UNLIMITED, commands

F, DRIFT = 2.0, 0.3


def swing(turns):
    """What repeats itself with a beat; its mean is 0.2."""
    return 0.2 + np.sin(2 * np.pi * turns) + 0.4 * np.cos(6 * np.pi * turns + 1.0)


def run_through(mean: BeatMean, beat: Beat, dt: float, pieces, per: int, drift: float):
    """Means after each piece of a signal that drifts and beats, and the times."""
    time, turns, found, times = 0.0, 0.0, [], []
    for command in pieces:
        t = time + dt * np.arange(1, per + 1) / per
        mean.add(t, drift * t + swing(turns + beat.at(command) * (t - time)), command)
        time, turns = t[-1], turns + beat.at(command) * dt
        found.append(mean.mean())
        times.append(time)
    return np.array(times), np.array(found)


@pytest.mark.parametrize("samples", [0.5, 1, 2, 4])
def test_a_slow_drift_is_measured_exactly_under_an_oscillation(samples):
    """The mean of the last beat of drift t is what it was half a beat ago."""
    beat, dt = Beat(F, 0.0), 1 / (samples * F)
    found = run_through(BeatMean(beat, swing(0.0)), beat, dt, [0.0] * 12, instants_per_sample(beat, 0.0, dt), DRIFT)
    through = found[0] > 1.001 / F
    np.testing.assert_allclose(found[1][through], (0.2 + DRIFT * (found[0] - 0.5 / F))[through], atol=1e-12)


def test_samples_that_are_no_share_of_a_beat_are_as_good_as_the_trapezoidal_rule():
    beat, dt = Beat(F, 0.0), 0.137
    time, found = run_through(BeatMean(beat, 0.0), beat, dt, [0.0] * 20, instants_per_sample(beat, 0.0, dt), DRIFT)
    exact = 0.2 + DRIFT * (time - 0.5 / F)
    np.testing.assert_allclose(found[5:], exact[5:], atol=1e-2)
    assert np.abs(found[5:] - exact[5:]).max() > 1e-6  # else this would have been no such case


def test_a_beat_that_the_command_makes_quicker_and_slower_is_averaged_stroke_by_stroke():
    """What depends on the phase alone has its mean, however fast that is gone through."""
    beat, dt = Beat(F, 1.0), 0.125
    _, found = run_through(BeatMean(beat, 0.2), beat, dt, [1.0, 1.5, 0.5, 0.5, 2.0] * 6, 400, 0.0)
    np.testing.assert_allclose(found[8:], 0.2, atol=1e-5)
    assert instants_per_sample(beat, 3.0, dt) == 3 * instants_per_sample(beat, 1.0, dt)


@pytest.mark.parametrize("dt", [0.05, 0.0625, 0.1, 0.037])
def test_a_controller_of_the_mean_has_that_of_its_samples(dt):
    """A gain of -1 about 0: its command is the mean, of whole and of broken numbers of samples in a beat."""
    beat, t = Beat(F, 0.0), dt * np.arange(60)
    measured = DRIFT * t + swing(F * t)
    expected = BeatMean.of_samples(beat, measured, dt)
    averaged = BeatAveraged(pid_of([-1.0, 0.0, 0.0], 0.0, UNLIMITED), F).planned(np.zeros(60), dt)
    found = commands(averaged, measured, measured[0], measured[0])
    np.testing.assert_allclose(found, expected, atol=1e-12)
    if dt == 0.05:  # ten samples in a beat: no oscillation is left
        np.testing.assert_allclose(found[10:], (0.2 + DRIFT * (t - 0.5 / F))[10:], atol=1e-12)


def test_a_beat_of_few_samples_has_no_mean():
    with pytest.raises(InputError, match=r"a beat takes 2\.5 samples, 4 or more are needed"):
        BeatAveraged(pid_of([1.0, 0.0, 0.0], 0.0, UNLIMITED), F).planned(np.zeros(9), 0.2)


def test_before_the_first_beat_it_counts_as_it_was():
    mean = BeatMean(Beat(F, 0.0), 1.0)
    assert mean.mean() == 1.0
    mean.add(np.array([0.125, 0.25]), np.array([1.0, 1.0]), 0.0)
    assert mean.mean() == pytest.approx(1.0, abs=1e-14)


def test_the_beat_of_a_robot_may_follow_the_command():
    eel = describe("eel")
    assert beat_of(eel, ["body.loads.muscle.moment.offset"], 0.0) == Beat(2.0, 0.0)
    led = beat_of(eel, ["body.loads.muscle.moment.frequency"], 2.0)
    assert led.at(3.0) == pytest.approx(3.0)
    beetle, one = describe("beetle1"), "limbs.left1_arm.joint.motion.frequency"
    assert beat_of(beetle, [one], 1.0) == beat_of(beetle, [], 0.0)  # of the other three
