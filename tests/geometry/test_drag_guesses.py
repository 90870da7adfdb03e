"""First guesses of drag coefficients."""

import numpy as np
import pytest
from tests.geometry import closed_surfaces as made

from nectosome.geometry.drag_guesses import (
    FIRST_GUESSES,
    guessed_drag_areas,
    guessed_turning,
    largest_sections,
    streamlined,
)
from nectosome.geometry.mesh_numbers import projected_areas
from nectosome.geometry.triangles import joined
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
        for (area, guess, *_), form, silhouette in zip(found, forms, projected, strict=True):
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


def test_a_mast_counts_beside_its_hull_and_friction_has_a_range():
    """A hull of 0.6 x 0.12 m with a mast of 16 mm, amidships, that stands out by 60 mm, at 0.6 m/s: Re 3.6e5."""
    hull = made.spheroid(5, 1)
    hull = hull._replace(vertices=hull.vertices * 0.6 / np.ptp(hull.vertices[:, 0]))
    mast = made.box(0.016, 0.016, 0.08)
    mast = mast._replace(vertices=mast.vertices - mast.vertices.mean(axis=0) + [0, 0, 0.08])
    both = joined([hull, mast])

    def along_x(surface):
        extents, projected = np.ptp(surface.vertices, axis=0), projected_areas(surface)
        sizes = tuple(extents), tuple(projected), surface.surface.size, surface.solid.size
        return guessed_drag_areas(*sizes, 6e5, largest_sections(surface))[0]

    bare, with_mast = along_x(hull), along_x(both)
    turbulent, laminar = (0.455 / np.log10(3.6e5) ** 2.58, 1.328 / np.sqrt(3.6e5))
    form = hull.surface.size * (1 + 1.5 * 5**-1.5 + 7 / 125)
    assert bare.drag_area == bare.largest == pytest.approx(turbulent * form, rel=5e-3)
    assert bare.least == pytest.approx(laminar * form, rel=5e-3)
    assert bare.sticks_out == 0
    assert with_mast.sticks_out == pytest.approx(0.016 * 0.06, abs=5e-3 * np.pi * 0.06**2)  # of the section
    assert with_mast.drag_area == pytest.approx(bare.drag_area + 0.74 * 0.016 * 0.06, rel=0.04)
    assert with_mast.guess.form == bare.guess.form


def test_fins_behind_the_largest_section_stick_out():
    """Four fins, 10 mm thick, behind the middle of a hull: their fronts count with 0.74, from 0.1 to 1.17."""
    hull = made.spheroid(5, 1)
    hull = hull._replace(vertices=hull.vertices * 0.6 / np.ptp(hull.vertices[:, 0]))
    fins = []
    for across, sign in ((1, 1), (1, -1), (2, 1), (2, -1)):
        sides = [0.06, 0.01, 0.01]
        sides[across] = 0.06
        fin, place = made.box(*sides), np.array([-0.2, 0.0, 0.0])
        place[across] = 0.08 * sign
        fins.append(fin._replace(vertices=fin.vertices - fin.vertices.mean(axis=0) + place))
    whole = joined([hull, *fins])
    extents, projected = np.ptp(whole.vertices, axis=0), projected_areas(whole)
    sizes = tuple(extents), tuple(projected), whole.surface.size, whole.solid.size
    found = guessed_drag_areas(*sizes, 6e5, largest_sections(whole))[0]
    out = 4 * 0.0502 * 0.01  # up to 110 mm from the axis
    assert found.sticks_out == pytest.approx(out, abs=6e-3 * np.pi * 0.06**2)  # of the section
    turbulent, laminar = (streamlined(5, 3.6e5, which).coefficient * whole.surface.size for which in (True, False))
    assert found.drag_area == pytest.approx(turbulent + 0.74 * out, rel=0.02)
    assert (found.least, found.largest) == pytest.approx((laminar + 0.1 * out, turbulent + 1.17 * out), rel=0.02)


def test_fins_and_a_mast_of_a_tenth_of_a_long_hull_are_no_part_of_its_section():
    """Two pieces of a twelfth of its length, each with a quarter of its section; then a double cone and a spheroid."""
    hull = made.box(1.2, 0.1, 0.1)
    hull = hull._replace(vertices=hull.vertices - hull.vertices.mean(axis=0))
    pieces = []
    for x, z in ((-0.4, -1), (0.2, 1)):
        piece = made.box(0.1, 0.025, 0.1)
        pieces.append(piece._replace(vertices=piece.vertices - piece.vertices.mean(axis=0) + [x, 0, 0.1 * z]))
    assert largest_sections(joined([hull, *pieces]))[0] == pytest.approx(0.01, rel=1e-3)

    cone = made.spheroid(5, 1)
    x, y, z = cone.vertices.T
    rim = 1 - 2 * np.abs(x) / np.ptp(x)
    wider = rim / np.maximum(np.hypot(y, z) / np.ptp(z) * 2, 1e-9)
    cone = cone._replace(vertices=np.stack([x, y * wider, z * wider], axis=1))
    assert largest_sections(cone)[0] == pytest.approx(0.867 * projected_areas(cone)[0], rel=0.02)
    ball = made.spheroid(5, 1)
    assert largest_sections(ball)[0] == pytest.approx(projected_areas(ball)[0], rel=5e-3)


def test_a_body_that_turns_is_dragged_by_strips():
    """A box of a x b x c about b: 500 C b a^4/32 (1 - 4 r^2/a^2), r that of a disc; a ball has none."""
    a, b, c = 1.0, 0.1, 0.06
    found = guessed_turning(made.box(a, b, c), (1.0, 1.1, 1.2))
    slender = 1 - 4 * b * c / np.pi
    expected = 500 * 1.2 * b * a**4 / 32 * slender, 500 * 1.1 * c * a**4 / 32 * slender
    assert found[1:] == pytest.approx(expected, rel=2e-3)
    half, radius = b / 2, np.sqrt(b * c / np.pi)
    assert found[0] == pytest.approx(500 * 1.17 * (half**4 - radius**4) / 2 * a, rel=2e-3)
    ball = guessed_turning(made.spheroid(1, 1), (0.47, 0.47, 0.47))
    assert max(ball) < 1e-3 * 500 * 0.47 * np.ptp(made.spheroid(1, 1).vertices[:, 0]) ** 5
