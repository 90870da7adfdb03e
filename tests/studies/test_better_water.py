"""The papers' robots in water by published laws: each piece is exchanged, and does what it must."""

import math

import numpy as np
import pytest

from nectosome_studies.flagellum import water as of_flagellum
from nectosome_studies.paddle import water as of_paddle
from nectosome_studies.poseidrone import water as of_poseidrone
from nectosome_studies.study import printed


def book(study: str) -> set[str]:
    return {row for row in printed(study) if row.startswith(f"{study}/better-water/")}


def test_coefficients_of_a_paddle_of_105_by_40_mm_whose_middle_goes_206_mm_to_either_side():
    """1.11 + 0.018 x 2.625, and 8 KC^(-1/3) with KC = 2 pi x 1.309 x 157.5 / 40 = 32.4."""
    keulegan_carpenter = 2 * math.pi * math.radians(75) * 157.5 / 40
    steady, oscillating = of_paddle.coefficients(math.radians(75))
    assert steady == pytest.approx(1.15725, rel=1e-12)
    assert oscillating == pytest.approx(8 * keulegan_carpenter ** (-1 / 3), rel=1e-12)


def test_poseidrone_goes_with_the_root_of_its_drag_area_and_swings_with_its_mass():
    """Mean thrust is that of the mean square of the speed; the thrust's swing goes over the mass, to 3 %."""
    rows = of_poseidrone.numbers()
    assert rows.keys() == book("poseidrone")
    speed, swing = (
        {k: rows[f"poseidrone/better-water/{k}/{what}"] for k in ("paper", "added-mass", "hull", "all")}
        for what in ("speed", "swing")
    )
    areas = 99.395122e-4 / (0.47 * math.pi * 47.6032e-3**2)
    assert speed["hull"] / speed["paper"] == pytest.approx(np.sqrt(areas), rel=0.005)
    added = swing["paper"] / swing["added-mass"] * (0.755 + 2.768) - 0.755
    assert added == pytest.approx(0.2630 * 1025 * 0.759366e-3 + 1025 * 0.30e-3, rel=0.03)  # Lamb's k1; 0.30 L in it


@pytest.mark.slow
def test_pieces_of_the_flagellum_act_as_they_must():
    """A hull of less drag is faster, friction makes it slower; a row for each."""
    rows = of_flagellum.numbers()
    assert rows.keys() == book("flagellum")
    speed = {name.split("/")[2]: x for name, x in rows.items() if name.endswith("speed")}
    assert speed["paper"] == pytest.approx(0.683, rel=0.01)
    assert speed["friction"] < speed["paper"] < speed["hull"]
    assert speed["friction"] < speed["all"] < speed["hull"]


@pytest.mark.slow
def test_the_rowing_robot_is_faster_with_more_drag_at_its_plates_and_slower_with_water_to_carry():
    rows = of_paddle.numbers(0.017243)
    assert rows.keys() == book("paddle")
    for joints in (3, 1):
        speed = {k: rows[f"paddle/better-water/{k}/fp{joints}jp/speed"] for k in ("paper", "plate", "oscillating")}
        assert speed["paper"] < speed["plate"] < speed["oscillating"]
        assert rows[f"paddle/better-water/added-mass/fp{joints}jp/speed"] < speed["paper"]
