import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.io import load_dataset, save_dataset
from nectosome.measure.signals.correlation import align
from nectosome.measure.signals.filters import smooth
from nectosome.measure.signals.metadata import errors_independent, processing
from nectosome.measure.signals.repeated_runs import average_repeats, combine, propagate

from .made import band_limited, recording

T = np.arange(0, 5, 0.01)


def test_repeats_come_onto_the_times_that_all_have():
    times = [T, T + 0.503, np.arange(-1, 4.5, 0.017)]
    both = combine([recording(t, force=2 * t) for t in times])
    assert both["force"].dims == ("repeat", "time")
    assert float(both.time[0]) == pytest.approx(0.51) and float(both.time[-1]) == pytest.approx(4.49)
    assert np.allclose(both["force"], 2 * both.time)
    assert both["force"].attrs["units"] == "N"


def test_the_mean_of_repeats_has_their_standard_error():
    rng = np.random.default_rng(0)
    runs = [recording(T, force=np.sin(T) + 0.3 * rng.normal(size=500)) for _ in range(9)]
    mean = average_repeats(combine(runs))
    assert mean.attrs["repeats"] == 9
    assert np.allclose(mean["force_se"], np.std([r["force"] for r in runs], axis=0, ddof=1) / 3)
    assert float(mean["force_se"].mean()) == pytest.approx(0.1, rel=0.05)
    inside = (mean["force_lower"] <= np.sin(T)) & (np.sin(T) <= mean["force_upper"])
    assert float(inside.mean()) == pytest.approx(0.95, abs=0.04)


def test_a_sample_that_one_repeat_lacks_has_no_mean():
    a = recording(T, force=T)
    b = a.where(abs(a.time - 2) > 0.05)
    mean = average_repeats(combine([a, b]))
    assert np.array_equal(np.isnan(mean["force"]), np.abs(T - 2) <= 0.05)


def test_what_differs_from_repeat_to_repeat_counts_as_one_error():
    """An offset of each repeat does not average out in a filter, and its standard error must not either."""
    rng = np.random.default_rng(1)
    mean = average_repeats(combine([recording(T, force=0 * T + rng.normal()) for _ in range(5)]))
    assert not errors_independent(mean)
    smoothed = smooth(mean[["force", "force_se"]], 0.25)
    assert (smoothed["force_se"] >= mean["force_se"] * 0.999).all()


def test_the_history_of_each_repeat_is_kept(tmp_path):
    x = band_limited(0, 5.0)
    first = recording(T, force=x(T))
    others = [align(first, recording(T, force=x(T - d)), "force").recording for d in (0.1, 0.2)]
    both = combine([first, *others])
    save_dataset(both, tmp_path / "both.nc")
    step = processing(load_dataset(tmp_path / "both.nc"))[-1]
    assert step["repeats"] == 3
    assert [history[0].get("lag", 0.0) for history in step["recordings"]] == pytest.approx([0, 0.1, 0.2], abs=1e-3)


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_standard_errors_follow_scale_and_offset(factor, offset):
    x = recording(T, "V", force=T, force_se=0.1 + T)
    y = propagate(x, "force", factor=factor, offset=offset, units="N")
    assert np.allclose(y["force"], factor * T + offset)
    assert np.allclose(y["force_se"], abs(factor) * (0.1 + T))
    assert y["force"].attrs["units"] == y["force_se"].attrs["units"] == "N"


def test_there_and_back_again_is_the_same():
    x = recording(T, force=T, force_se=0.1 + T)
    y = propagate(propagate(x, "force", factor=-4.0, offset=3.0), "force", factor=-0.25, offset=0.75)
    assert np.allclose(y["force"], x["force"]) and np.allclose(y["force_se"], x["force_se"])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: combine([]), "no recordings"),
        (lambda: combine([recording(T, force=T), recording(T, pulse=T)]), "lacking force, pulse"),
        (lambda: combine([recording(T, force=T), recording(T, "V", force=T)]), "in V in recording 1, and in N"),
        (lambda: combine([recording(T, force=T), recording(T + 10, force=T)]), "share no time.* Align"),
        (lambda: average_repeats(combine([recording(T, force=T)])), "dimension repeat has 1 members"),
        (lambda: propagate(recording(T, force=T), "pulse", factor=2.0), "no pulse; there are force"),
        (lambda: propagate(recording(T, force=T), "force", factor=np.nan), "factor is nan"),
    ],
)
def test_what_cannot_be_combined_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
