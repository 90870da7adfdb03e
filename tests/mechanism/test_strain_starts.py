"""Rods that start bent and moving: closed forms of their shape and speed, and what starts that cannot be are told."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.description import parse_robot, with_values
from nectosome.model import build
from nectosome.solve.readings import reading_of, values_of
from nectosome.units import InputError

LENGTH = 0.12
STRIP = """
name: strip
water: {{gravity: 0 m/s2}}
body:
  kind: rod
  section: rectangle
  length: 120 mm
  width: 20 mm
  height: 4 mm
  young: 2.6 MPa
  density: 1080 kg/m3
  strains: {{bending_y: 1, extension: 0}}
  points: 4
  {more}
limbs:
  next:
    kind: rod
    section: circle
    length: 50 mm
    radius: 3 mm
    young: 1 MPa
    density: 1 g/cm3
    strains: {{bending_z: 0}}
    points: 3
"""


def strip(more):
    return parse_robot(STRIP.format(more=more))


def tip(robot, *names):
    """What is read of the tip at the start."""
    built = build(robot)
    readings = [reading_of(built, f"body.tip.{name}") for name in names]
    return jax.jit(lambda x: values_of(readings, built, jnp.zeros(()), x))(built.initial())


def test_a_rod_starts_with_the_curvature_and_the_rate_that_are_given():
    """Curvature c about y all along: x = sin(c L)/c, z = -(1 - cos c L)/c; its rate moves the tip by derivatives."""
    c, rate = 4.0, 3.0
    robot = strip(f"start: {{bending_y: {c} rad/m, rate: {{bending_y: [{rate} rad/m/s, 0 1/m/s]}}}}")
    angle = c * LENGTH
    along, down = np.sin(angle) / c, -(1 - np.cos(angle)) / c
    by_c = ((np.cos(angle) * LENGTH - along) / c, (-np.sin(angle) * LENGTH - down) / c)
    found = tip(robot, "position.x", "position.z", "velocity.x", "velocity.z")
    np.testing.assert_allclose(found, [along, down, rate * by_c[0], rate * by_c[1]], rtol=1e-12)


def test_starts_are_coefficients_of_polynomials_beyond_the_strains_at_rest():
    robot = strip("rest: {bending_y: 1 rad/m}\n  start: {bending_y: [2 rad/m, -3 rad/m], extension: 0.01}")
    q = np.asarray(build(robot).initial().q)
    np.testing.assert_allclose(q, [2 * LENGTH, -3 * LENGTH, 0.01, 0.0])
    bent = with_values(robot, {"body.start.bending_y.0": -1.0, "body.start.bending_y.1": 0.0})
    # a start of -1 rad/m makes a rest of 1 straight
    np.testing.assert_allclose(tip(bent, "position.x", "position.z"), [1.01 * LENGTH, 0.0], rtol=1e-12, atol=1e-15)


def test_the_length_of_a_robot_is_that_of_its_rods_unbent():
    ends = [float(build(strip(more)).body_length) for more in ("", "start: {bending_y: 9 rad/m}")]
    assert ends[0] == pytest.approx(ends[1], rel=1e-12)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("start: {bending_z: 1 rad/m}", "body.start.bending_z: the rod's strains do not name bending_z"),
        ("start: {rate: {extension: [0 1/s, 1 1/s]}}", "body.start.rate.extension: has 2 numbers; extension has an"),
        ("start: {bending_y: 20 deg}", '"20 deg" is an angle. Curvature expected, as in "2.5 rad/m"'),
        ("start: {rate: {bending_y: 2 rad/m}}", "is a curvature. Curvature rate expected"),
        (
            "motion: {bending_y: {kind: wave, amplitude: 1 rad/m, frequency: 1 Hz}}\n  start: {bending_y: 1 rad/m}",
            "body.start.bending_y: motion.bending_y already says how it starts. Leave this out.",
        ),
    ],
)
def test_a_start_that_cannot_be_is_told(more, said):
    with pytest.raises(InputError) as told:
        strip(more)
    assert said in str(told.value)
