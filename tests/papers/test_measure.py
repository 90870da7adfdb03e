"""Data that others made, with numbers checked by hand; skipped where the data are not."""

import numpy as np
import pytest

from nectosome.papers.measure import study
from nectosome.papers.measure.catshark import by_speed, catsharks
from nectosome.papers.measure.friction import friction_test

FOLDER = study.data_folder()
needs_data = pytest.mark.skipif(FOLDER is None, reason="the measurements are not here")


@needs_data
@pytest.mark.parametrize(
    ("file", "row", "distance", "force"),
    [("Circle_3bar.csv", 7, 0.044e-3, 150.235), ("KDN_3bar.csv", 7, 0.039e-3, 152.040)],
)
def test_a_friction_test_is_read_and_split(file, row, distance, force):
    """The eighth line of each file, by eye; the sensors' gains by hand from its first and largest reading."""
    test = friction_test(FOLDER / "pneumatic" / file)
    assert float(test.recording["time"][row]) == pytest.approx(0.071 if "Circle" in file else 0.076)
    assert float(test.recording["distance"][row]) == pytest.approx(distance)
    assert float(test.recording["force"][row]) == pytest.approx(force)
    assert test.friction.size == 10
    gains = test.calibrations["gain"].values
    np.testing.assert_allclose(gains, [13.34e-3, 2.002e5, 46.52], rtol=2e-3)
    assert float(test.calibrations["residual_max"][0]) < 0.01e-3  # m: the laser's volts are given to 1 mV


@needs_data
def test_strouhal_numbers_of_catsharks_are_those_given():
    """Catshark 11 at 1 length a second: 1.953125 Hz x 0.174855 x 0.16 m / 0.224827 m/s = 0.24304."""
    found = catsharks(FOLDER / "catshark" / "midline_kinematics.txt")
    assert float(found["again"][0]) == pytest.approx(0.24304, abs=1e-5)
    assert float(np.max(np.abs(found["again"] - found["strouhal"]))) < 1e-12
    assert by_speed(found)["count"].sum() == 51


def test_without_the_data_rows_say_so(monkeypatch):
    monkeypatch.setenv("NECTOSOME_DATA", "/nowhere")
    done = study.run(False, lambda what, share: None)
    assert len(done.rows) == 23
    assert {row["kind"] for row in done.rows} == {"missing"}
    assert all(row["ours"] is None and "NECTOSOME_DATA" in row["note"] for row in done.rows)
