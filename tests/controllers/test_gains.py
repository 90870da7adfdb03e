"""Gains as text, by frequency too, and back."""

import numpy as np
import pytest

from nectosome.controllers import PIDGains
from nectosome.controllers.autotune import schedule_of
from nectosome.units import InputError


def test_gains_are_in_the_units_of_command_and_measurement():
    np.testing.assert_allclose(PIDGains.parse("4, 0.5,0", 1e8).row, [4e8, 5e7, 0.0])
    np.testing.assert_allclose(PIDGains.parse((-1, -2.5, 0)).row, [-1, -2.5, 0])


@pytest.mark.parametrize(("gains", "why"), [
    ("1,2", "three numbers"),
    ("0,0,0", "not all 0"),
    ((1.0, float("nan"), 0.0), "three numbers"),
    ("1,-2,0", "gains must share one sign; use negative gains for a plant with negative response"),
    ("1N,2,0", "is a force. Number expected"),
    ("0.2Hz: 1,2,0; 3,2,1", "a row without a frequency"),
    ("1Hz: 1,2,0; 0.2Hz: 3,2,1", "must grow from row to row"),
    ("0.2Hz: 1,2,0; 1Hz: -3,0,0", "all rows must share one sign"),
    ("0.2N: 1,2,0", "is a force. Frequency expected"),
])  # fmt: skip
def test_gains_that_are_none_are_refused(gains, why):
    with pytest.raises(InputError, match=why) as told:
        PIDGains.parse(gains)
    assert told.value.field == "gains"


def test_gains_by_frequency_are_read_and_written():
    found = PIDGains.parse("200 mHz: 4, 0.5,0; 1Hz:3,0.4,0.1 ;", 10.0)
    np.testing.assert_allclose(found.table[0], [0.2, 1.0])
    np.testing.assert_allclose(found.table[1], [[40, 5, 0], [30, 4, 1]])
    again = PIDGains.parse(found.text(10.0), 10.0)
    np.testing.assert_allclose(again.rows, found.rows)
    np.testing.assert_allclose(again.table[0], found.table[0])


def test_one_row_and_several_are_told_apart():
    with pytest.raises(InputError, match="belong to a scheduled PID"):
        _ = PIDGains.parse("0.2Hz: 4,0.5,0").row
    with pytest.raises(InputError, match="a scheduled PID has gains by frequency"):
        _ = PIDGains.parse("4,0.5,0").table


def test_a_schedule_needs_a_reference_that_has_a_frequency():
    """3 s of 0.04 Hz are an eighth of a period, and not constant."""
    t = 0.01 * np.arange(300)
    with pytest.raises(InputError, match=r"turns less than twice in 3 s, too short .* Take a period or more"):
        schedule_of(np.sin(2 * np.pi * 0.04 * t), 0.01, 0.0)
    with pytest.raises(InputError, match="that is constant has no frequency"):
        schedule_of(np.ones(300), 0.01, 0.0)
    found, _ = schedule_of(np.sin(2 * np.pi * 1.0 * t), 0.01, 0.0)
    np.testing.assert_allclose(found, 1.0, rtol=0.02)
