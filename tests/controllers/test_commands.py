"""Ranges of commands and gains, read from text with units."""

import pytest

from nectosome.controllers import CommandRange
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
