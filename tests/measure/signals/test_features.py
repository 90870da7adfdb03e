import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.measure.signals.features import features, mean, rms, slope
from nectosome.measure.signals.metadata import processing

from .made import recording, signal

T = np.arange(0, 10, 0.01)


def test_the_rms_of_a_sine_is_its_amplitude_over_root_two():
    assert rms(signal(T, 3 * np.sin(2 * np.pi * T))).value == pytest.approx(3 / np.sqrt(2), rel=1e-12)


@given(st.floats(-10, 10), st.floats(-10, 10), st.integers(0, 100))
def test_the_slope_of_a_ramp_is_its_speed_whenever_it_was_sampled(speed, start, seed):
    t = np.sort(np.random.default_rng(seed).uniform(5, 9, 30))
    assert slope(signal(t, start + speed * t, "m")).value == pytest.approx(speed, abs=1e-9)


def test_a_mean_over_time_does_not_depend_on_how_often_it_was_sampled():
    """cos^2 over whole periods: 1/2, also where one half of it was sampled ten times as often."""
    t = np.r_[np.arange(0, 5, 0.01), np.arange(5, 10, 0.001)]
    assert mean(signal(t, t)).value == pytest.approx(5.0, abs=0.01)
    assert mean(signal(t, np.cos(2 * np.pi * t) ** 2)).value == pytest.approx(0.5, abs=1e-3)


def test_standard_errors_of_white_noise_are_those_of_the_textbook():
    """Mean 5, noise 0.5, 1000 samples of 10 s: 0.5 / sqrt n; slope 0.5 / (10 s sqrt(n / 12)). 100 seeds."""
    rng = np.random.default_rng(0)
    runs = [signal(T, 5 + 0.5 * rng.normal(size=1000)) for _ in range(100)]
    for feature, true, se in ((mean, 5.0, 0.5 / np.sqrt(1000)), (slope, 0.0, 0.05 * np.sqrt(12 / 1000))):
        found = np.array([feature(x) for x in runs])
        assert found[:, 1].mean() == pytest.approx(se, rel=0.08)
        assert found[:, 0].std() == pytest.approx(se, rel=0.25)
        assert abs(found[:, 0].mean() - true) < 4 * se / 10
    found = np.array([rms(x) for x in runs])
    assert found[:, 0].std() == pytest.approx(found[:, 1].mean(), rel=0.25)


def test_errors_that_hang_together_make_the_mean_less_sure():
    """Each number of noise held for 10 samples: worth a tenth of the samples."""
    rng = np.random.default_rng(1)
    runs = np.array([mean(signal(T, np.repeat(rng.normal(size=100), 10))) for _ in range(100)])
    assert runs[:, 1].mean() == pytest.approx(0.1, rel=0.15)
    assert runs[:, 0].std() == pytest.approx(0.1, rel=0.25)


def test_a_beat_is_no_noise_in_its_mean():
    """4.7 cycles of 1 N about 30 mN with noise of 50 mN: the mean is that of four cycles, by the scatter of these."""
    t, rng = np.arange(0, 4.7, 0.0125), np.random.default_rng(2)
    beat = 0.03 + np.sin(2 * np.pi * t) + 0.3 * np.sin(4 * np.pi * t + 1)
    found = np.array([mean(signal(t, beat + 0.05 * rng.normal(size=t.size), "N")) for _ in range(100)])
    noise = 0.05 / np.sqrt(4 * 80)
    assert found[:, 0].mean() == pytest.approx(0.03, abs=4 * noise / 10)
    assert found[:, 0].std() == pytest.approx(noise, rel=0.3)
    assert np.sqrt(np.mean(found[:, 1] ** 2)) == pytest.approx(noise, rel=0.3)


def test_features_of_a_window_carry_units_and_standard_errors():
    x = recording(T, force=2 * np.sin(2 * np.pi * 1.5 * T) * (T >= 4) + 1)
    x = x.assign(x=("time", 0.3 * T, {"units": "m"}))
    got = features(x, (4.0, 8.0), {"force": ["mean", "amplitude", "frequency"], "x": ["slope"]})
    assert float(got["force_amplitude"]) == pytest.approx(2.0, rel=1e-9)
    assert float(got["force_frequency"]) == pytest.approx(1.5, rel=1e-9)
    assert float(got["x_slope"]) == pytest.approx(0.3, rel=1e-9)
    assert float(got["x_slope_se"]) < 1e-9
    units = {name: got[name].attrs["units"] for name in got.data_vars}
    assert units["x_slope"] == units["x_slope_se"] == "m/s"
    assert units["force_frequency_se"] == "Hz" and units["force_mean"] == "N"
    assert processing(got)[-1]["window"] == [4.0, 8.0]


def test_repeats_have_features_of_their_own():
    x = recording(T, force=T).assign(force=(("repeat", "time"), np.stack([T, 2 * T, 3 * T]), {"units": "N"}))
    got = features(x, (0.0, 10.0), {"force": ["slope"]})
    assert got["force_slope"].dims == ("repeat",)
    assert got["force_slope"].values == pytest.approx([1, 2, 3])


@pytest.mark.parametrize(
    ("window", "names", "message"),
    [
        ((0.0, 0.02), {"force": ["mean"]}, "3 samples, and 8 are needed"),
        ((0.0, 1.0), {"pulse": ["mean"]}, "no pulse; there are force"),
        ((0.0, 1.0), {"force": ["median"]}, "not one of mean, rms"),
    ],
)
def test_what_is_not_there_is_refused(window, names, message):
    with pytest.raises(ValueError, match=message):
        features(recording(T, force=T), window, names)
