"""Areas, moments and widths of plates by their outlines, against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.mechanism.shapes.plates import outline_moments, outline_widths, plate_inertia

FORK = jnp.array(
    [[0, 3], [15, 8], [45, 45], [60, 50], [48, 20], [45, 0], [48, -20], [60, -50], [45, -45], [15, -8], [0, -3.0]]
)


def close(found, expected, rel: float = 1e-13, abs: float = 0.0):
    np.testing.assert_allclose(found, expected, rtol=rel, atol=abs)


def test_a_right_triangle_has_its_closed_form():
    """Legs b and h from the origin: A = bh/2, centre (b, h)/3, about it b^3 h/36, b h^3/36 and -b^2 h^2/72."""
    b, h = 0.06, 0.04
    area, centre, second = outline_moments(jnp.array([[0.0, 0.0], [b, 0.0], [0.0, h]]) + jnp.array([3.0, -2.0]))
    close(area, b * h / 2, rel=1e-12)
    close(centre, [3 + b / 3, -2 + h / 3])
    product = -(b**2) * h**2 / 72
    close(second, [[b**3 * h / 36, product], [product, b * h**3 / 36]], rel=1e-11)


def test_a_rectangle_weighs_and_turns_as_a_box():
    box = jnp.array([[0.0, -0.02], [0.08, -0.02], [0.08, 0.02], [0.0, 0.02]])
    moments, mass, thickness = outline_moments(box), jnp.asarray(0.3), jnp.asarray(0.003)
    flat, upright = (plate_inertia(mass, moments, thickness, way) for way in (False, True))
    x, y, z = 0.08**2, 0.04**2, 0.003**2
    close(flat, 0.3 / 12 * np.diag([y + z, x + z, x + y]), abs=1e-18)
    close(upright, 0.3 / 12 * np.diag([z + y, x + y, x + z]), abs=1e-18)


@pytest.mark.parametrize("corners", [50, 111, 400])
def test_an_ellipse_by_corners_comes_near_to_it_by_their_number(corners: int):
    """A regular polygon of n corners has the share sin(x)/x, x = 2 pi/n, of the disc's area, stretched or not.

    Its second moment has that share times (2 + cos x)/3.
    """
    a, b, turn = 0.04, 0.01, 0.4
    angle = 2 * np.pi * np.arange(corners) / corners
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    area, centre, second = outline_moments(jnp.asarray(np.stack([a * np.cos(angle), b * np.sin(angle)], axis=1) @ R.T))
    x = 2 * np.pi / corners
    share = np.sin(x) / x
    close(area, share * np.pi * a * b, rel=1e-12)
    close(centre, 0, abs=1e-15)
    exact = share * (2 + np.cos(x)) / 3 * np.pi * a * b / 4 * R @ np.diag([a**2, b**2]) @ R.T
    close(second, exact, rel=1e-11)


def test_direction_and_first_corner_of_an_outline_do_not_matter():
    at = jnp.array([2.0, 20.0, 46.0, 55.0])
    one = (*outline_moments(FORK), *outline_widths(FORK, at))
    for other in (FORK[::-1], jnp.roll(FORK, 4, axis=0), jnp.roll(FORK[::-1], -3, axis=0)):
        for found, expected in zip((*outline_moments(other), *outline_widths(other, at)), one, strict=True):
            close(found, expected, rel=1e-12, abs=1e-8)  # of moments of 1e6


def test_widths_across_lines_are_summed_where_an_outline_is_crossed_twice():
    width, middle = outline_widths(FORK, jnp.array([7.5, 30.0, 54.0]))
    # its lines there: 3 + 5/15 x; 8 + 37/30 (x - 15); from 20 + 30/12 (x - 48) to 45 + 5/15 (x - 45), and their images
    lobe = (45 + 9 / 3) - (20 + 6 * 2.5)
    close(width, [2 * (3 + 7.5 / 3), 2 * (8 + 15 * 37 / 30), 2 * lobe])
    close(middle, 0, abs=1e-13)
    tilted = jnp.array([[0.0, 0.0], [4.0, 2.0], [4.0, 5.0]])
    close(outline_widths(tilted, jnp.array([1.0, 3.0])), [[0.75, 2.25], [0.875, 2.625]])


def test_gradients_in_the_corners_are_those_of_finite_differences():
    @jax.jit
    def numbers(points):
        area, centre, second = outline_moments(points)
        return jnp.concatenate(
            [area[None], centre, second.ravel(), *outline_widths(points, jnp.array([20.0, 54.0]))[:1]]
        )

    exact, step = jax.jit(jax.jacfwd(numbers))(FORK), 1e-4
    for k in ((2, 1), (4, 0), (9, 1)):
        moved = [numbers(FORK.at[k].add(sign * step)) for sign in (1, -1)]
        close((moved[0] - moved[1]) / (2 * step), exact[:, *k], rel=1e-6, abs=1e-5)
