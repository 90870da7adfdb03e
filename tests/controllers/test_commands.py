"""Ranges of commands and gains, read from text with units."""

import numpy as np
import pytest

from nectosome.controllers import CommandRange, parse_gains
from nectosome.robots import describe
from nectosome.units import InputError


def test_the_unit_of_the_last_number_counts_for_both():
    eel = describe("eel")
    for text in ("bias=-8..8mN m", "bias = -8 mN m .. 8e-3 N m", " bias=-0.008 .. 0.008 N m"):
        found = CommandRange.parse(text, eel)
        assert (found.low, found.high, found.initial) == (pytest.approx(-8e-3), pytest.approx(8e-3), 0.0)
    assert CommandRange.parse("bias=-8..8mN m", eel).show(4e-3) == "4 mN m"
    assert found.paths == ("body.loads.muscle.moment.offset",)


@pytest.mark.parametrize(("text", "why"), [
    ("bias", "has no range. Write PATH=LOW..HIGH"),
    ("bias=-8:8mN m", "has no range. Write PATH=LOW..HIGH"),
    ("bias=8..-8mN m", "is empty. Write the smaller end first"),
    ("bias=-8..8", "has no unit"),
    ("bias=1..8mN m", "starts at 0 mN m, outside of 1 mN m to 8 mN m"),
    ("bais=-8..8mN m", "bias"),
])  # fmt: skip
def test_a_range_that_is_none_is_refused_with_a_way_out(text, why):
    with pytest.raises(InputError, match=why) as told:
        CommandRange.parse(text, describe("eel"))
    assert str(told.value.field).startswith("command")


def test_gains_are_in_the_units_of_command_and_measurement():
    np.testing.assert_allclose(parse_gains("4, 0.5,0", 1e8), [4e8, 5e7, 0.0])
    np.testing.assert_allclose(parse_gains((-1, -2.5, 0)), [-1, -2.5, 0])


@pytest.mark.parametrize(("gains", "why"), [
    ("1,2", "three numbers"),
    ("0,0,0", "not all 0"),
    ((1.0, float("nan"), 0.0), "three numbers"),
    ("1,-2,0", "gains must share one sign; use negative gains for a plant with negative response"),
    ("1N,2,0", "is a force. Number expected"),
])  # fmt: skip
def test_gains_that_are_none_are_refused(gains, why):
    with pytest.raises(InputError, match=why) as told:
        parse_gains(gains)
    assert told.value.field == "gains"
