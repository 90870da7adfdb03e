"""Misprints of the paddle's paper: right values by hand, from printed numbers alone."""

import math

import numpy as np
import pytest
import xarray as xr

from nectosome.description import get_value
from nectosome.robots import describe
from nectosome_studies.paddle import misprints, servos, swim
from nectosome_studies.study import printed

BOOK = printed("paddle")


@pytest.fixture(scope="module")
def right():
    return {name.removeprefix("paddle/misprint/"): value for name, value in misprints.numbers().items()}


def test_every_misprint_has_its_right_value(right):
    rows = {name.removeprefix("paddle/misprint/") for name, entry in BOOK.items() if entry["kind"] == "misprint"}
    assert rows == {*right, "frequency-fp1jp", "frequency-fp3jp"}


def test_the_layer_is_as_thick_as_eq_16_asks_for(right):
    """k = pi 0.85^2 E (w t^3/12) / L_p with 2 MPa, 40 mm, 105 mm: 0.031 N m/rad, and 3.1e-5 with the printed 0.6 mm."""

    def stiffness(thickness: float) -> float:
        return math.pi * 0.85**2 * 2e6 * 0.04 * thickness**3 / 12 / 0.105

    assert stiffness(1e-3 * right["thickness"]) == pytest.approx(0.031, rel=1e-9)
    assert stiffness(0.6e-3) == pytest.approx(3.1e-5, rel=0.01)


def test_eq_17_gives_another_number_than_the_blade_has(right):
    """4 F/(S^2 rho w v^2) for the peak of a blade of Cn 1, S its length, v the speed of its tip."""
    inner, outer = 0.105, 0.210
    literal = 4 * (outer**3 - inner**3) / 6 / ((outer - inner) ** 2 * outer**2)
    assert BOOK["paddle/misprint/eq17-cn"]["printed"] == pytest.approx(literal, rel=0.005)
    assert right["eq17-cn"] == pytest.approx(1.0, rel=1e-6)


def test_ratios_and_the_sum_are_those_of_the_printed_numbers(right):
    assert right["ratio-abstract"] == right["ratio-conclusions"] == pytest.approx(0.323 / 0.093, rel=1e-12)
    assert BOOK["paddle/misprint/ratio-conclusions"]["printed"] == pytest.approx(0.323 / 0.142, abs=5e-4)
    assert right["eq30-sum"] == pytest.approx(110 * 21.74, rel=1e-12)
    assert right["width"] == pytest.approx(0.529, abs=1.5e-3)


def test_a_frequency_is_read_between_the_speeds_at_two():
    """Speeds of 0.07 and 0.10 m/s at 1.2 and 1.3 Hz: 0.093 m/s is 23/30 of the way, 0.082 m/s 12/30."""
    speed = [{1.2: 0.07, 1.3: 0.10}.get(f, 0.0) for _, _, f in servos.SWIMS]
    at_1_3 = [k for k, (_, a, f) in enumerate(servos.SWIMS) if f == 1.3 and a > 1]
    speed = np.array(speed)
    speed[at_1_3] = 0.3
    rows = servos.numbers(xr.Dataset({"speed": ("row", speed)}, attrs={"drag_area": 0.01, "coefficient": 1.05}))
    assert rows["paddle/misprint/frequency-fp3jp"] == pytest.approx(1.2 + 0.1 * 23 / 30, rel=1e-12)
    assert rows["paddle/misprint/frequency-fp1jp"] == pytest.approx(1.2 + 0.1 * 12 / 30, rel=1e-12)
    assert rows["paddle/servo/fp1jp/75-1.3/speed"] == 0.3


def test_speeds_are_told_with_the_drag_of_the_hull_that_they_were_found_with():
    """The coefficient in the notes is that of the calibrated drag area, and that of the robot that ships."""
    notes = [entry["note"] for name, entry in BOOK.items() if name.startswith("paddle/table5/f") and "swim" in entry]
    assert len(notes) == 6
    assert all(f"drag coefficient of {swim.drag_coefficient(172.4e-4):.2f}" in note for note in notes)
    shipped = swim.drag_coefficient(get_value(describe("beetle3"), "drag_area"))
    assert f"{shipped:.2f} of its frontal area" in BOOK["paddle/shipped/fp3jp/75-1.1/speed"]["note"]
    assert shipped < 1.2  # of a plate across the stream
