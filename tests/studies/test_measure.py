"""Data that others made, with numbers checked by hand."""

import numpy as np
import pytest

from nectosome_studies import STUDIES
from nectosome_studies.measure.catshark import by_speed, catsharks
from nectosome_studies.measure.friction import friction_test


@pytest.mark.parametrize(
    ("name", "row", "time", "distance", "force"),
    [("circle", 7, 0.071, 0.044e-3, 150.235), ("kdn", 7, 0.076, 0.039e-3, 152.040)],
)
def test_a_friction_test_is_read_and_split(name, row, time, distance, force):
    """The eighth line of each file, by eye; the sensors' gains by hand from its first and largest reading."""
    test = friction_test(name)
    assert float(test.recording["time"][row]) == pytest.approx(time)
    assert float(test.recording["distance"][row]) == pytest.approx(distance)
    assert float(test.recording["force"][row]) == pytest.approx(force)
    assert test.friction.size == 10
    gains = test.calibrations["gain"].values
    np.testing.assert_allclose(gains, [13.34e-3, 2.002e5, 46.52], rtol=2e-3)
    assert float(test.calibrations["residual_max"][0]) < 0.01e-3  # m: the laser's volts are given to 1 mV


def test_strouhal_numbers_of_catsharks_are_those_given():
    """Catshark 11 at 1 length a second: 1.953125 Hz x 0.174855 x 0.16 m / 0.224827 m/s = 0.24304."""
    found = catsharks()
    assert float(found["again"][0]) == pytest.approx(0.24304, abs=1e-5)
    assert float(np.max(np.abs(found["again"] - found["strouhal"]))) < 1e-12
    assert by_speed(found)["count"].sum() == 51


def test_the_study_fills_every_row_and_figure():
    done = STUDIES["measure"].run(False, lambda what, share: None)
    assert len(done.rows) == 23
    assert np.all(np.isfinite([row["ours"] for row in done.rows]))
    assert set(done.runs) == {"circle", "kdn", "catshark"}
    assert len(done.figures(done.data, done.runs)) == 3
