"""Gain and zero from pairs of readings and values."""

import numpy as np
import pytest
import xarray as xr

from nectosome.measure import calibrate


def pairs(x, y):
    return xr.DataArray(x, dims="time", attrs={"units": "V"}), xr.DataArray(y, dims="time", attrs={"units": "N"})


def test_a_line_is_recovered_exactly():
    x = np.array([0.1, 0.7, 1.9, 4.2])
    found = calibrate(*pairs(x, 46.5 * (x - 0.31)))
    assert float(found["gain"]) == pytest.approx(46.5, rel=1e-12)
    assert float(found["zero"]) == pytest.approx(0.31, rel=1e-12)
    assert float(found["residual_max"]) < 1e-12
    assert found["gain"].attrs["units"] == "N/(V)"


def test_standard_errors_are_those_of_many_trials():
    rng, x = np.random.default_rng(1), np.linspace(0.5, 4.5, 40)
    tries = [calibrate(*pairs(x, 20 * (x - 1.0) + rng.normal(scale=2.0, size=x.size))) for _ in range(600)]
    for name in ("gain", "zero"):
        spread = np.std([float(t[name]) for t in tries])
        assert np.mean([float(t[name + "_se"]) for t in tries]) == pytest.approx(spread, rel=0.1)


def test_pairs_that_tell_nothing_are_refused():
    with pytest.raises(
        ValueError, match="3 pairs with 1 different readings; three pairs and two different readings are needed"
    ):
        calibrate(*pairs([1.0, 1.0, 1.0], [1.0, 2.0, 3.0]))
    with pytest.raises(ValueError, match="3 readings and 2 values of the quantity; their number must agree"):
        calibrate(*pairs([1.0, 2.0, 3.0], [1.0, 2.0]))
