import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.io import load_dataset, save_dataset
from nectosome.measure.signals.events import crossings, peaks
from nectosome.measure.signals.filters import detrend, lowpass, smooth
from nectosome.measure.signals.metadata import errors_independent, processing, product, quantities
from nectosome.measure.signals.resample import resample
from nectosome.measure.signals.spectra import spectrum

from .made import recording, signal


def test_steps_are_kept_in_order_and_survive_a_file(tmp_path):
    t = np.arange(300) * 0.01
    x = lowpass(detrend(resample(recording(t, force=np.sin(t)), rate=100.0), "linear"), 10.0)
    save_dataset(x, tmp_path / "x.nc")
    back = load_dataset(tmp_path / "x.nc")
    assert [step["function"] for step in processing(back)] == ["resample", "detrend", "lowpass"]
    assert processing(back) == processing(x)
    assert processing(back)[2]["cutoff"] == 10.0
    assert back["force"].attrs["units"] == "N"


def test_what_is_given_is_not_changed():
    t = np.arange(100) * 0.01
    x = recording(t, force=t**2, force_se=np.full(100, 0.1))
    before = x.copy(deep=True)
    smooth(x, 0.11, derivative=1)
    assert x.identical(before)


def test_a_standard_error_belongs_to_its_quantity_and_is_none_itself():
    t = np.arange(10.0)
    x = recording(t, force=t, force_se=t, pulse_se=t)
    assert quantities(x) == ["force", "pulse_se"]


def test_a_data_array_stays_one_and_carries_its_steps():
    t = np.arange(100) * 0.01
    x = detrend(smooth(signal(t, t**2), 0.11))
    assert x.name == "force"
    assert [step["function"] for step in processing(x)] == ["smooth", "detrend"]
    assert x.attrs["units"] == "N"


def test_order_of_dimensions_and_what_has_no_time_are_kept():
    t = np.arange(100) * 0.01
    x = recording(t, a=t).assign(b=(("time", "axis"), np.stack([t, t**2, t**3], axis=1)), mass=2.0)
    y = smooth(x, 0.11)
    assert y["b"].dims == ("time", "axis")
    assert np.allclose(y["b"], x["b"], atol=1e-12)
    assert float(y["mass"]) == 2.0


def test_errors_are_independent_until_a_step_mixes_them():
    t = np.arange(100) * 0.01
    x = recording(t, force=t)
    assert errors_independent(x)
    assert errors_independent(detrend(x))
    assert not errors_independent(smooth(x, 0.11))
    assert not errors_independent(detrend(smooth(x, 0.11)))


def test_one_standard_error_may_serve_all_samples_and_goes_where_it_says_nothing():
    t = np.arange(100) * 0.01
    x = recording(t, force=t).assign(force_se=0.1)
    assert smooth(x, 0.11)["force_se"].shape == (100,)
    assert "force_se" not in spectrum(x, scaling="amplitude")


def test_settings_may_be_numbers_of_numpy():
    t = np.arange(100) * 0.01
    x = smooth(signal(t, t), np.float32(0.25), order=np.int64(2))
    assert processing(x)[0]["order"] == 2 and processing(x)[0]["window"] == 0.25


def test_a_standard_error_that_is_no_number_is_refused():
    t = np.arange(100) * 0.01
    with pytest.raises(ValueError, match="force_se has 1 values"):
        smooth(recording(t, force=t, force_se=np.where(t == 0.5, np.nan, 1.0)), 0.11)


def test_events_and_peaks_go_on_with_the_list():
    t = np.arange(0, 5, 0.01)
    x = smooth(signal(t, np.sin(2 * np.pi * t)), 0.11)
    assert [step["function"] for step in processing(crossings(x, 0.0))] == ["smooth", "crossings"]
    assert processing(peaks(x, 0.5))[-1]["prominence"] == 0.5


def test_text_is_refused_by_its_name():
    t = np.arange(100) * 0.01
    x = recording(t, force=t).assign(note=("time", ["a"] * 100))
    with pytest.raises(ValueError, match=r"note holds .*drop_vars"):
        smooth(x, 0.11)


SYMBOLS = st.dictionaries(
    st.sampled_from(["N", "m", "s", "rad", "kg", "Pa"]), st.integers(-3, 3).filter(bool), max_size=4
)


@pytest.mark.parametrize(
    ("factors", "unit"),
    [
        ([("m", 1), ("s", -1)], "m/s"),
        ([("m/s", 1), ("s", -1)], "m/s2"),
        ([("m", 1), ("s", -2)], "m/s2"),
        ([("N", 1), ("m", 1)], "N m"),
        ([("N", 2), ("Hz", -1)], "N2/Hz"),
        ([("m/s2", 2), ("Hz", -1)], "m2/(s4 Hz)"),
        ([("1", 1), ("s", -1)], "1/s"),
        ([("m", 1), ("m", -1)], "1"),
        ([("", 1), ("s", -1)], "1/s"),
        ([("N/(m s)", 1), ("s", 1)], "N/m"),
        ([("N m s/rad", 1), ("rad/s", 1)], "N m"),
        ([("kg*m^2/s", 1)], "kg m2/s"),
        ([("rad or m", 1), ("s", -1)], "(rad or m)/s"),
        ([("N/m s", 1), ("s", 1)], "(N/m s) s"),
    ],
)
def test_powers_of_a_symbol_add_up(factors, unit):
    assert product(*factors) == unit


@given(SYMBOLS, SYMBOLS)
def test_what_a_product_writes_it_reads_again(a, b):
    """A product with its own inverse is 1, whatever was written in between."""
    text = product(*a.items(), *b.items())
    assert product((text, 1), *((symbol, -n) for symbol, n in (*a.items(), *b.items()))) == "1"
    assert product((text, 1)) == text
