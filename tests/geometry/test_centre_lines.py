"""Curvatures of centre lines by their points."""

import numpy as np
import pytest

from nectosome.geometry.centre_lines import fit_curvature, fit_line
from nectosome.units import InputError


def turned(points, angle, axis=2):
    a, b = [k for k in range(3) if k != axis]
    out = points.copy()
    out[:, a] = np.cos(angle) * points[:, a] - np.sin(angle) * points[:, b]
    out[:, b] = np.sin(angle) * points[:, a] + np.cos(angle) * points[:, b]
    return out


def arc(angle: float, n: int, length: float = 0.2):
    """Along x, then towards y."""
    s, r = np.linspace(0, 1, n), length / angle
    return np.stack([r * np.sin(angle * s), r * (1 - np.cos(angle * s)), 0 * s], axis=-1)


@pytest.mark.parametrize(("angle", "turn"), [(1.5, 0.0), (1.5, 0.7), (-4.0, np.pi), (6.0, -2.5)])
def test_an_arc_has_one_curvature_wherever_it_is_drawn(angle, turn):
    found = fit_line(turned(arc(angle, 20), turn) + np.array([0.1, -0.2, 0.3]), 0.2)
    assert found.bending_y == ()
    assert found.bending_z[0] == pytest.approx(angle / 0.2, rel=1e-4)
    assert len(found.bending_z) == 1
    assert found.distance < 3e-5 * 0.2
    assert found.turned == pytest.approx(abs(turn), abs=1e-3)


def test_a_line_that_bends_towards_z_turns_about_y():
    """Turning about +y bends x towards -z."""
    points = arc(1.5, 12)[:, [0, 2, 1]]
    found = fit_line(points, 0.2)
    assert found.bending_z == ()
    assert found.bending_y[0] == pytest.approx(-7.5, rel=1e-4)


def test_a_helix_has_its_curvature_about_axes_that_do_not_turn_with_it():
    """r / (r^2 + c^2) everywhere, its direction turning by the torsion c / (r^2 + c^2), c = pitch / 2 pi."""
    r, c, angle = 0.05, 0.02, 3.0
    t = np.linspace(0, angle, 25)
    points = np.stack([r * np.cos(t), r * np.sin(t), c * t], axis=-1)
    length = angle * np.hypot(r, c)
    found = fit_line(points, length, 8)
    s = np.linspace(0.05, 0.95, 19)
    y, z = (np.polynomial.legendre.legval(2 * s - 1, row) for row in (found.bending_y, found.bending_z))
    np.testing.assert_allclose(np.hypot(y, z), r / (r * r + c * c), rtol=2e-3)
    turning = np.unwrap(np.arctan2(z, y))
    rate = abs(np.polyfit(s * length, turning, 1)[0])
    assert rate == pytest.approx(c / (r * r + c * c), rel=1e-2)
    assert found.distance < 1e-4 * length


def test_a_noisy_line_is_taken_as_it_is_with_an_order():
    """Points off by 1 mm: an arc of order 0 goes through their middle."""
    points = arc(1.5, 25)
    points[1:, :2] += 0.5e-3 * np.random.default_rng(1).normal(size=(24, 2))
    found = fit_line(points, 0.2, 0)
    assert found.bending_z[0] == pytest.approx(7.5, rel=0.05)
    assert 0.2e-3 < found.distance < 4e-3


def test_straight_lines_through_a_table_become_polynomials():
    at = np.array([0.0, 0.5, 1.0])
    coefficients, missed = fit_curvature(at, np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(coefficients, [2.0, 1.0], atol=1e-12)
    assert missed < 1e-12
    tent, missed = fit_curvature(at, np.array([0.0, 1.0, 0.0]), 2)  # int P2 (1 - |x|) 5/2 dx = -5/8
    np.testing.assert_allclose(tent, [0.5, 0.0, -0.625], atol=1e-12)
    assert missed == pytest.approx(np.sqrt(1 - 3 * (0.25 + 0.625**2 / 5)), rel=1e-9)


@pytest.mark.parametrize(
    ("points", "told"),
    [
        (arc(1.5, 3), "has 3 points, and a curved line needs at least 4"),
        (np.repeat(arc(1.5, 6), 2, axis=0), "has two points at one place, 1 and 2"),
        (1.1 * arc(1.5, 9), "is a line of 220 mm, and the rod is 200 mm long"),
    ],
)
def test_what_is_no_line_of_the_rod_is_told(points, told):
    with pytest.raises(InputError, match=told):
        fit_line(points, 0.2)


def test_a_line_that_no_polynomial_meets_is_told():
    corner = np.array([[0, 0, 0], [4, 0, 0], [8, 0, 0], [10, 0, 0], [10, 2, 0], [10, 6, 0], [10, 10, 0]]) * 0.01
    with pytest.raises(InputError, match=r"polynomials of order 4 miss the line by .* Draw it smoother"):
        fit_line(corner, 0.2015)
