"""First guesses of drag coefficients."""

import numpy as np
import pytest
from tests.geometry import closed_surfaces as made

from nectosome.geometry.drag_guesses import FIRST_GUESSES, guessed_drag_areas, streamlined
from nectosome.geometry.silhouette import projected_areas
from nectosome.units import InputError


def test_first_guesses_have_a_form_an_area_and_a_source():
    assert all(0 < one.coefficient < 2.1 and one.form and one.source for one in FIRST_GUESSES.values())
    assert FIRST_GUESSES["sphere"].coefficient == 0.47


def test_a_streamlined_body():
    """Long ones tend to a flat plate: 0.455 / 6^2.58 at 1e6, and Blasius' below the transition."""
    assert streamlined(1e6, 1e6).coefficient == pytest.approx(0.00447, rel=2e-3)
    assert streamlined(1e6, 1e4).coefficient == pytest.approx(0.01328, rel=1e-8)
    assert streamlined(4, 1e6).coefficient / streamlined(1e6, 1e6).coefficient == pytest.approx(1 + 1.5 / 8 + 7 / 64)
    with pytest.raises(InputError, match="fineness of 1 at"):
        streamlined(1.0, 1e6)


def along_x(surface):
    """Of a surface along z."""
    return surface._replace(vertices=surface.vertices[:, [2, 0, 1]])


BULLET = made.revolved(np.array([0, 1e-3, 4, *(4 + np.sin(np.linspace(0, np.pi / 2, 30)))[1:]]),
                       np.array([0, 1, 1, *np.cos(np.linspace(0, np.pi / 2, 30))[1:]]))  # fmt: skip


@pytest.mark.parametrize(
    ("surface", "forms"),
    [
        (made.spheroid(1, 1), ["sphere", "sphere", "sphere"]),
        (made.box(1, 1, 1), ["cube", "cube", "cube"]),
        (made.box(0.05, 1, 1.5), ["disc", "blunt", "blunt"]),
        (made.box(0.05, 1, 30), ["plate", "cube", "blunt"]),
        (along_x(made.cylinder(10, 1)), ["blunt", "short_cylinder", "short_cylinder"]),
        (along_x(made.cylinder(100, 1)), ["blunt", "cylinder", "cylinder"]),
        (BULLET, ["round_nose", "sphere", "sphere"]),
        (made.spheroid(5, 1), ["streamlined", "short_cylinder", "short_cylinder"]),
    ],
)
def test_the_form_of_a_body_gives_its_drag_areas(surface, forms):
    """Coefficient times silhouette, or for a streamlined one times the wetted area, whichever way it is scaled."""
    for size in (0.01, 1.0):
        scaled = surface._replace(vertices=size * surface.vertices)
        extents, projected = np.ptp(scaled.vertices, axis=0), projected_areas(scaled)
        wetted, volume = scaled.surface.size, scaled.solid.size
        found = guessed_drag_areas(tuple(extents), tuple(projected), wetted, volume, 1e6 / extents[0])
        for (area, guess), form, silhouette in zip(found, forms, projected, strict=True):
            expected = streamlined(5, 1e6) if form == "streamlined" else FIRST_GUESSES[form]
            assert guess.form == expected.form
            over = wetted if form == "streamlined" else silhouette
            assert area == pytest.approx(expected.coefficient * over, rel=5e-3)


@pytest.mark.parametrize(("length", "flat", "whole"), [(2.9, 1.17, 0.47), (5, 1.17, 0.74), (30, 1.98, 1.17)])
def test_a_flat_body_broadside_is_between_a_plate_and_a_round_one(length, flat, whole):
    """As a plate at a depth of 0.2 of its height, as a ball or a cylinder at 1, evenly between, without a step."""

    def along_y(depth):
        silhouettes = np.pi / 4 * depth, np.pi / 4 * length, np.pi / 4 * length * depth
        return guessed_drag_areas((length, depth, 1.0), silhouettes, 5.0, np.pi / 6 * length * depth, 1e6)[1].guess

    found = [along_y(depth).coefficient for depth in (0.1999, 0.2001, 0.4, 0.6, 0.999, 1.0)]
    expected = [flat, flat, 0.75 * flat + 0.25 * whole, 0.5 * (flat + whole), whole, whole]
    assert found == pytest.approx(expected, abs=2e-3)
    assert along_y(0.3).form == "a flat body, 0.3 as deep as wide"
    assert f"{flat}, and " in along_y(0.3).source and f", {whole}, of Hoerner" in along_y(0.3).source
