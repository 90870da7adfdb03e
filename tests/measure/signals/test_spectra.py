import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.measure.signals.spectra import dominant_frequency, sine, spectrum

from .made import recording, signal

T = np.arange(4000) * 0.005


def test_the_integral_of_the_density_is_the_variance():
    """Parseval: exact for sines of whole periods in a segment, within the scatter of the variance for white noise."""
    x = 2 * np.sin(2 * np.pi * 3 * T) + 0.5 * np.cos(2 * np.pi * 17 * T) + 10
    for segment in (None, 2.0):
        density = spectrum(signal(T, x), segment)
        assert float(density.sum()) * float(density.frequency[1]) == pytest.approx(2 + 0.125, rel=1e-9)
    noise = np.random.default_rng(0).normal(size=4000)
    density = spectrum(signal(T, noise), 1.0)
    assert float(density.sum() * density.frequency[1]) == pytest.approx(noise.var(), rel=0.03)
    assert density.attrs["units"] == "N2/Hz"


def test_white_noise_has_two_variances_over_the_rate():
    noise = 3 * np.random.default_rng(1).normal(size=4000)
    density = spectrum(signal(T, noise), 0.5)
    assert float(density[2:-1].mean()) == pytest.approx(2 * 9 * 0.005, rel=0.06)


def test_the_amplitude_spectrum_shows_the_amplitude_of_a_sine():
    x = spectrum(signal(T, 2 * np.sin(2 * np.pi * 3 * T + 1) + 5), 4.0, scaling="amplitude")
    assert float(x.sel(frequency=3.0)) == pytest.approx(2.0, rel=1e-9)
    assert x.attrs["units"] == "N"
    assert float(x[0]) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("segment", [1.0, 4.0, 20.0])
def test_the_standard_error_of_the_density_is_that_of_monte_carlo(segment):
    noise = np.random.default_rng(2).normal(size=(400, 4000))
    x = recording(T, force=T).assign(force=(("run", "time"), noise, {"units": "N"}))
    density = spectrum(x, segment)
    spread = density["force"].std("run")[2:-2].mean()
    assert float(spread) == pytest.approx(float(density["force_se"][:, 2:-2].mean()), rel=0.05)
    assert density["force_se"].attrs["units"] == "N2/Hz"


@pytest.mark.parametrize("frequency", [0.731, 3.0, 12.3456, 77.7])
def test_the_dominant_frequency_is_found_within_a_hundredth_of_a_bin(frequency):
    x = signal(T, np.sin(2 * np.pi * frequency * T + 0.3) + 7)
    assert dominant_frequency(x) == pytest.approx(frequency, abs=0.01 / 20)


def test_spectra_follow_units_and_do_not_care_when():
    x = np.random.default_rng(3).normal(size=4000)
    plain, other = spectrum(signal(T, x), 1.0), spectrum(signal(T + 50, 1000 * x), 1.0)
    assert np.allclose(other.values, 1e6 * plain.values, rtol=1e-6)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: spectrum(signal(T**2 + T, T)), "even steps"),
        (lambda: spectrum(signal(T, T), 100.0), "20000 samples of 0.005 s; it must have 8 to 4000"),
        (lambda: spectrum(signal(T, T), scaling="power"), "density"),
        (lambda: dominant_frequency(signal(T, 0 * T)), "constant"),
    ],
)
def test_what_has_no_spectrum_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@given(
    st.floats(0.01, 100),
    st.floats(1.05, 40),
    st.floats(-3, 3),
    st.floats(-100, 100),
    st.booleans(),
)
def test_a_sine_is_found_as_it_was_made(amplitude, periods, phase, offset, even):
    t = np.linspace(0, 2, 200)
    if not even:
        t = np.sort(np.random.default_rng(0).uniform(0, 2, 200))
    frequency = periods / (t[-1] - t[0])
    found = sine(signal(t, offset + amplitude * np.sin(2 * np.pi * frequency * t + phase)))
    assert found.amplitude.value == pytest.approx(amplitude, rel=1e-6)
    assert found.frequency.value == pytest.approx(frequency, rel=1e-6)
    assert np.cos(found.phase.value - phase) == pytest.approx(1, abs=1e-9)
    assert found.offset.value == pytest.approx(offset, abs=1e-6 * (amplitude + abs(offset)))


def test_standard_errors_are_those_of_monte_carlo_and_of_cramer_and_rao():
    """A 2, noise 0.5, n 400: the bounds of Rife and Boorstyn; 150 runs know a spread to 5.8 %."""
    n, h, a, noise = 400, 0.02, 2.0, 0.5
    t, rng = np.arange(n) * h, np.random.default_rng(0)
    clean = 1 + a * np.sin(2 * np.pi * 1.3 * t + 0.7)
    runs = [sine(signal(t, clean + noise * rng.normal(size=n))) for _ in range(150)]
    values = np.array([[e.value for e in run] for run in runs])
    se = np.array([[e.se for e in run] for run in runs]).mean(axis=0)
    bound = [
        np.sqrt(2 / n) * noise,
        np.sqrt(24 / (n * (n**2 - 1))) * noise / a / (2 * np.pi * h),
        np.sqrt(4 * (2 * n - 1) / (n * (n + 1))) * noise / a,
        noise / np.sqrt(n),
    ]
    assert se == pytest.approx(bound, rel=0.08)
    assert np.all(se >= 0.99 * np.array(bound))
    assert values.std(axis=0) == pytest.approx(bound, rel=0.2)
    assert np.all(np.abs(values.mean(axis=0) - [a, 1.3, 0.7, 1.0]) < 4 * np.array(bound) / np.sqrt(150))


def test_errors_that_hang_together_make_standard_errors_larger():
    """Noise of first order, pole 0.8: at low frequency it has (1 + 0.8) / (1 - 0.8) = 9 times the power of white."""
    from scipy.signal import lfilter

    rng, t = np.random.default_rng(1), np.arange(3000) * 0.01
    clean = np.sin(2 * np.pi * 0.2 * t)
    noise = lfilter([0.3 * np.sqrt(1 - 0.8**2)], [1, -0.8], rng.normal(size=(60, 3000)))
    runs = [sine(signal(t, clean + e)) for e in noise]
    se = np.mean([run.amplitude.se for run in runs])
    spread = np.std([run.amplitude.value for run in runs])
    assert se == pytest.approx(3 * 0.3 * np.sqrt(2 / 3000), rel=0.1)
    assert spread == pytest.approx(se, rel=0.3)


def test_the_dominant_sine_is_taken():
    t = np.arange(0, 10, 0.01)
    found = sine(signal(t, np.sin(2 * np.pi * 1.7 * t) + 0.3 * np.sin(2 * np.pi * 5.1 * t)))
    assert found.frequency.value == pytest.approx(1.7, abs=1e-3)
    assert found.amplitude.value == pytest.approx(1.0, abs=0.01)


def test_a_later_clock_turns_only_the_phase():
    t = np.arange(0, 4, 0.01)
    x = np.sin(2 * np.pi * 1.3 * t + 0.5) + 0.1 * np.random.default_rng(0).normal(size=400)
    early, late = sine(signal(t, x)), sine(signal(t + 10, x))
    assert late.frequency.value == pytest.approx(early.frequency.value, rel=1e-7)
    assert late.amplitude.se == pytest.approx(early.amplitude.se, rel=1e-4)
    turned = early.phase.value - 2 * np.pi * early.frequency.value * 10
    assert np.cos(late.phase.value - turned) == pytest.approx(1, abs=1e-6)
    assert late.phase.se > 3 * early.phase.se


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (lambda t: 0 * t, "constant"),
        (lambda t: np.sin(0.4 * np.pi * t), "at least one is needed"),
        (lambda t: np.where(t > 1, np.nan, t), "NaN or infinite"),
    ],
)
def test_what_holds_no_sine_is_refused(values, message):
    t = np.arange(0, 2, 0.01)
    with pytest.raises(ValueError, match=message):
        sine(signal(t, values(t)))
