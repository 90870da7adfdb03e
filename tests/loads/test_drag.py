"""Drag and lift of a strip and of a plate, against the published formulas written out by hand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome import model
from nectosome.core import State, Stations, Strips, Water
from nectosome.description import parse_robot
from nectosome.loads import LumpedDrag, PlateDrag, StripDrag

RHO = 1000.0


def strip(velocity, half_width=(0.01, 0.01), spin=(0.0, 0.0, 0.0)) -> Strips:
    return Strips(
        rotation=jnp.eye(3)[None],
        position=jnp.zeros((1, 3)),
        angular_velocity=jnp.array([spin]),
        velocity=jnp.array([velocity]),
        **vars(
            Stations.along(
                jnp.array([0.1]),
                jnp.array([0.2]),
                jnp.array([half_width]),
                jnp.array([1e-4]),
                jnp.eye(6)[None],
            )
        ),
    )


def force(load, strips: Strips) -> np.ndarray:
    water = Water(jnp.asarray(RHO), jnp.asarray(9.81))
    return np.asarray(load.force(jnp.zeros(()), strips, (), water)[0][0])


def test_a_round_strip_feels_the_published_force():
    """f = -rho r |v| [pi/2 C_t v_x; C_n v_y - C_l v_z; C_l v_y + C_n v_z], per length."""
    drag = StripDrag(jnp.asarray(1.1), jnp.asarray(0.3), jnp.asarray(-0.1))
    vx, vy, vz = v = (0.3, -0.4, 1.2)
    line = [0.5 * np.pi * 0.3 * vx, 1.1 * vy + 0.1 * vz, -0.1 * vy + 1.1 * vz]
    expected = -RHO * 0.01 * 1.3 * 0.2 * np.array(line)
    assert force(drag, strip(v)) == pytest.approx(np.concatenate([np.zeros(3), expected]))


def test_broadside_it_is_half_rho_cd_diameter_v_squared():
    drag = StripDrag(jnp.asarray(1.1), jnp.asarray(0.0), jnp.asarray(0.0))
    assert force(drag, strip((0.0, 0.0, -2.0)))[5] == pytest.approx(0.5 * RHO * 1.1 * 0.02 * 0.2 * 2.0**2)


@pytest.mark.parametrize(("v", "axis", "shown"), [((0, 1.0, 0), 4, 0.03), ((0, 0, 1.0), 5, 0.01)])
def test_a_flat_strip_feels_the_width_it_shows(v, axis: int, shown: float):
    """Moving along y it shows its half width along z, and the other way round."""
    zero = jnp.asarray(0.0)
    for drag in (StripDrag(jnp.asarray(2.0), zero, zero), PlateDrag(jnp.asarray(2.0))):
        assert force(drag, strip(v, half_width=(0.01, 0.03)))[axis] == pytest.approx(-RHO * shown * 2.0 * 0.2)


def test_a_plate_feels_each_face_by_its_own_velocity():
    """f_y = -rho C r_z |v_y| v_y, f_z = -rho C r_y |v_z| v_z per length (Hu et al. 2024, eq. 7, with the sign)."""
    line = [0.0, -0.03 * 0.4 * -0.4, -0.01 * 1.2 * 1.2]
    expected = RHO * 1.5 * 0.2 * np.array([0.0, 0.0, 0.0, *line])
    plate = PlateDrag(jnp.asarray(1.5))
    assert force(plate, strip((0.3, -0.4, 1.2), half_width=(0.01, 0.03))) == pytest.approx(expected)


def test_negative_lift_turns_sideways_motion_against_a_rotation_about_x():
    """With C_l < 0 a strip that moves along +y is pushed along +z."""
    lift = StripDrag(jnp.asarray(0.0), jnp.asarray(0.0), jnp.asarray(-0.1))
    f = force(lift, strip((0.0, 1.0, 0.0)))
    assert f[5] == pytest.approx(RHO * 0.01 * 0.1 * 0.2)
    assert f[3:5] == pytest.approx(np.zeros(2))


def test_lumped_drag_acts_axis_by_axis():
    drag = LumpedDrag(jnp.array([0.01, 0.02, 0.03]), jnp.array([0.1, 0.2, 0.3]) / RHO)
    f = force(drag, strip((1.0, -2.0, 0.5), spin=(0.0, 3.0, -1.0)))
    assert f == pytest.approx([0, -0.2 * 9, 0.3, -0.5 * RHO * 0.01, 0.5 * RHO * 0.02 * 4, -0.5 * RHO * 0.03 * 0.25])


@pytest.mark.parametrize("density", [1000.0, 1025.0])
@pytest.mark.parametrize("kind", ["lumped_drag", "near_floor, full: 1 m, none: 2 m"])
def test_drag_on_turning_is_given_for_water_of_1000_and_goes_with_the_density(kind, density):
    """M = -c |w| w rho/(1000 kg/m3)."""
    robot = model.build(
        parse_robot(f"""
name: turning
water: {{density: {density} kg/m3, floor: 0 m, gravity: 0 m/s2}}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  inertia: [1 kg m2, 1 kg m2, 1 kg m2]
  joint: {{kind: free}}
  loads: {{drag: {{kind: {kind}, drag_area: [1 m2, 1 m2, 1 m2], rotational: [1 g m2, 2 g m2, 3 g m2]}}}}
""")
    )
    start = robot.initial()
    state = State(start.q, jnp.array([0.0, 3.0, -2.0, 0.0, 0.0, 0.0]), start.z)
    turned, _ = jax.jit(type(robot).solved)(robot, jnp.zeros(()), state)
    expected = density / 1000 * np.array([0.0, -0.002 * 9, 0.003 * 4, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(turned, expected, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(("amplitude", "coefficient"), [(0.01, 8 * np.pi ** (-1 / 3)), (1.0, 1.2)])
def test_a_plate_that_oscillates_has_grahams_drag(amplitude, coefficient):
    """Keulegan-Carpenter number pi of a face 20 mm high at 10 mm: 5.46; far beyond 64 that of a steady stream."""
    drag = PlateDrag(jnp.asarray(1.2), jnp.asarray(amplitude))
    expected = -RHO * 0.01 * coefficient * 0.2 * 0.3**2
    assert force(drag, strip((0.0, 0.3, 0.0)))[4] == pytest.approx(expected, rel=1e-12)
