"""Sliders of a robot: their ranges, units and steps."""

import math

import numpy as np
import pytest

from nectosome.description import get_value, with_values
from nectosome.designs import shipped_problem
from nectosome.robots import describe
from nectosome.robots.shipped import file_names
from nectosome.studio.session import motion_problem
from nectosome.studio.sliders import scales_of

ROBOTS = (*file_names(), "beetle")


@pytest.mark.parametrize("name", ROBOTS)
def test_each_slider_holds_the_robots_value_and_every_place_of_it_is_allowed(name):
    robot = describe(name)
    scales = scales_of(robot, motion_problem(name).vary)
    assert scales or name == "poseidrone_turning"  # front and rear legs are not driven alike
    for scale in scales:
        value = float(get_value(robot, scale.name))
        assert scale.low <= scale.shown(value) <= scale.high
        assert len(f"{scale.shown(value):.10g}") <= 6  # what the field beside it has room for
        finer = round(value / scale.factor, 1 - math.floor(math.log10(scale.step)))
        off = 0.051 if len(f"{finer:.10g}") <= 6 else 0.51  # of a step, where a further decimal has no room
        assert abs(scale.shown(value) * scale.factor - value) <= off * scale.step * scale.factor
        assert 299 <= (scale.high - scale.low) / scale.step <= 1000
        assert np.isclose(scale.low / scale.step, round(scale.low / scale.step))
        for place in (scale.low, scale.high):
            assert get_value(with_values(robot, {scale.name: place * scale.factor}), scale.name) == place * scale.factor


def test_ranges_of_the_design_problem_come_first_in_units_that_people_read():
    by_name = {scale.name: scale for scale in scales_of(describe("flagellum"), shipped_problem("flagellum").vary)}
    assert (by_name["L"].label, by_name["L"].low, by_name["L"].high) == ("L (mm)", 300, 700)
    assert by_name["alpha"].label == "alpha (deg)"


def test_a_slider_goes_to_the_ends_of_its_range_and_never_beyond():
    robot = describe("flagellum")
    whole, odd = scales_of(robot, {"omega": "3 rad/s .. 3000 rad/s", "E": "100 Pa .. 100 MPa"})[:2]
    assert (whole.low, whole.high, whole.step) == (3, 3000, 1)
    assert odd.unit == "MPa"
    assert 1e-4 <= odd.low < 1e-4 + odd.step  # no step people count in meets both ends
    assert odd.high == 100


def test_of_a_wide_logarithmic_range_what_is_near_is_shown():
    scale = next(k for k in scales_of(describe("flagellum"), {"E": "1.4 MPa .. 1681 MPa log"}) if k.name == "E")
    assert scale.low == pytest.approx(7.4 / 4, rel=0.03)
    assert scale.high == pytest.approx(7.4 * 4, rel=0.03)


def test_what_differs_among_its_paths_or_is_zero_has_no_slider_of_its_own():
    robot = describe("beetle", ["A_left=60deg"])
    names = {scale.name for scale in scales_of(robot, {})}
    assert "A_left" in names
    assert "A" not in names  # it would say one value for two


def test_a_value_beyond_a_slider_is_told_and_one_within_is_not():
    robot = with_values(describe("flagellum"), {"E": 12e6})
    scale = next(k for k in scales_of(robot, {"E": "2..9MPa"}) if k.name == "E")
    told = "E is 12 MPa, beyond its slider (2 to 9 MPa). The robot keeps it until that is moved."
    assert scale.beyond(12e6) == told
    assert [scale.beyond(value) for value in (2e6, 5e6, 9e6)] == ["", "", ""]
