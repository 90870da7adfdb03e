"""Screws against displacements made of a known axis, angle and way."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nectosome.solve import screw_of

AXIS = np.array([2.0, -1.0, 2.0]) / 3
POINT = np.cross(AXIS, [0.3, 0.7, -0.2])  # across the axis: the point nearest to the origin
START = Rotation.from_rotvec([0.4, -1.0, 0.2]).as_matrix(), np.array([0.5, -0.1, 0.8])


@pytest.mark.parametrize("angle", [1e-3, 0.5, 3.0, np.pi - 1e-9])
def test_the_screw_is_that_of_the_displacement(angle):
    R = Rotation.from_rotvec(angle * AXIS).as_matrix()
    end = R @ START[0], POINT + R @ (START[1] - POINT) + 0.06 * AXIS
    screw = screw_of(START, end)
    np.testing.assert_allclose(screw.axis, AXIS, atol=1e-12)
    np.testing.assert_allclose(screw.point, POINT, atol=1e-11)
    assert screw.angle == pytest.approx(angle, rel=1e-11)
    assert screw.along == pytest.approx(0.06, rel=1e-11)
    across = np.linalg.norm(np.cross(AXIS, START[1] - POINT))
    assert screw.radius(START[1]) == pytest.approx(screw.radius(end[1]), rel=1e-10)
    assert screw.radius(START[1]) == pytest.approx(across, rel=1e-10)


def test_without_a_turn_it_is_the_way():
    screw = screw_of(START, (START[0], START[1] + 0.3 * AXIS))
    np.testing.assert_allclose(screw.axis, AXIS, atol=1e-12)
    assert (screw.angle, screw.radius(START[1])) == (0.0, np.inf)
    assert screw.along == pytest.approx(0.3, rel=1e-12)
    still = screw_of(START, START)
    assert still.angle == 0.0
    assert still.along == pytest.approx(0, abs=1e-15)
