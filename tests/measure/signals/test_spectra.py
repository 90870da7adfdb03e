import numpy as np
import pytest

from nectosome.measure.signals.spectra import dominant_frequency, spectrum

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
