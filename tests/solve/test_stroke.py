"""Tail amplitude, Strouhal number, stride, slip and Froude efficiency against closed forms, on known states."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State
from nectosome.description import parse_robot
from nectosome.model import bind, build
from nectosome.solve import cycle_means
from nectosome.units import InputError

# a hull with a stiff fin behind it, which a hinge at the hull's rear end turns; ahead is the hull's x
FIN = """
name: fin
water: {density: 1000 kg/m3, gravity: 0 m/s2}
body:
  kind: rigid
  shape: spheroid
  length: 0.3 m
  radius: 0.05 m
  mass: 2 kg
  joint: {kind: planar, axis: z}
  loads: {drag: {kind: lumped_drag, drag_area: [4e-3 m2, 4e-3 m2, 0 m2]}}
limbs:
  fin:
    on: body
    at: root
    rotation: [0 deg, 0 deg, 180 deg]
    kind: rigid
    shape: box
    length: 0.2 m
    width: 4 mm
    height: 60 mm
    mass: 0.1 kg
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 0.4 rad, frequency: 1.25 Hz}}
    loads: {push: {kind: plate_drag, normal: 1, start_up: none}}
"""
A, F, V, LENGTH = 0.4, 1.25, 0.35, 0.2  # rad, Hz, m/s, m
means_of = jax.jit(cycle_means)


def towed(robot, angle: float = 0.0, speed: float = V, n: int = 129):
    """Times and states of a body that goes along its own axis at an angle to the world's x."""
    times = jnp.linspace(0.0, 1 / F, n)
    rates = speed * jnp.array([jnp.cos(angle), jnp.sin(angle), 0.0])
    place = times[:, None] * rates + jnp.array([0.0, 0.0, angle])
    return times, State(place, jnp.broadcast_to(rates, (n, 3)), robot.initial().z)


@pytest.fixture(scope="module")
def fin():
    return build(parse_robot(FIN))


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.5])
def test_a_fin_beats_with_its_chord_times_the_sine_of_its_angle(fin, angle):
    """a = L sin A at the trailing edge, St = 2 f a/V; 0.5 m long, V/0.5 m body lengths a second, V/(0.5 m f) a beat."""
    means = means_of(fin, *towed(fin, angle))
    a = LENGTH * np.sin(A)  # 129 samples see the largest angle
    assert float(fin.body_length) == pytest.approx(0.5, rel=1e-12)
    assert float(means.tail_amplitude) == pytest.approx(a, rel=1e-9)
    assert float(means.strouhal) == pytest.approx(2 * F * a / V, rel=1e-9)
    assert float(means.body_lengths_per_second) == pytest.approx(V / 0.5, rel=1e-12)
    assert float(means.stride_length) == pytest.approx(V / (0.5 * F), rel=1e-12)
    assert np.isnan(means.slip)  # no wave is prescribed


def test_backwards_the_stride_is_negative_and_the_tail_is_where_it_was(fin):
    means = means_of(fin, *towed(fin, speed=-V))
    assert float(means.stride_length) == pytest.approx(-V / (0.5 * F), rel=1e-12)
    assert float(means.strouhal) == pytest.approx(2 * F * LENGTH * np.sin(A) / V, rel=1e-9)
    assert np.isnan(means.froude_efficiency)  # its thrust would be backwards


def test_froude_efficiency_is_the_drag_of_the_hull_times_its_speed_over_power(fin):
    """rho/2 CdA V^3 / P; the efficiency by towing is the same for a hull that does not wag."""
    means = means_of(fin, *towed(fin))
    drag = 500 * 4e-3 * V**2
    assert float(means.power) > 0
    assert float(means.froude_efficiency) == pytest.approx(drag * V / float(means.power), rel=1e-9)
    assert float(means.efficiency) == pytest.approx(float(means.froude_efficiency), rel=1e-9)


@pytest.mark.parametrize(
    "change",
    [
        ("loads: {drag: {kind: lumped", "loads: {jet: {kind: force, force: [0 N, 0 N, 0 N]}, drag: {kind: lumped"),
        ("planar, axis: z}\n  loads", "prismatic, axis: x, damping: 1 N s/m}\n  loads"),
    ],
)
def test_where_thrust_cannot_be_told_from_drag_there_is_no_froude_efficiency(change):
    """A force on the hull may be thrust; a damper on its rail is no drag of the water."""
    robot = build(parse_robot(FIN.replace(*change)))
    times = jnp.linspace(0.0, 1 / F, 33)
    rates = jnp.zeros((33, robot.initial().v.size)).at[:, 0].set(V)
    means = means_of(robot, times, State(times[:, None] * rates, rates, robot.initial().z))
    assert np.isnan(means.froude_efficiency)


def test_two_times_of_a_steady_motion_see_no_beat(fin):
    means = means_of(fin, *towed(fin, n=2))
    for name in ("tail_amplitude", "strouhal", "stride_length"):
        assert np.isnan(getattr(means, name)), name
    assert float(means.body_lengths_per_second) == pytest.approx(V / 0.5, rel=1e-12)


EEL = """
name: eel
water: {density: 1000 kg/m3, gravity: 0 m/s2}
forward: -x
body:
  kind: rod
  section: ellipse
  length: 0.4 m
  width: 20 mm
  height: 30 mm
  young: 0.1 MPa
  density: 1000 kg/m3
  strains: {bending_z: 12}
  points: 14
  joint: {kind: planar, axis: z}
  motion: {bending_z: {kind: wave, amplitude: 2 rad/m, frequency: 2 Hz, wavelength: 0.3 m}}
"""


def test_slip_is_the_speed_over_that_of_the_wave():
    robot = build(parse_robot(EEL))
    times = jnp.linspace(0.0, 0.5, 33)
    rates = jnp.zeros((33, 3)).at[:, 0].set(-0.25)
    means = means_of(robot, times, State(times[:, None] * rates, rates, robot.initial().z))
    assert float(means.slip) == pytest.approx(0.25 / (2 * 0.3), rel=1e-9)
    assert float(robot.body_length) == pytest.approx(0.4, rel=1e-12)  # unbent
    assert 0 < float(means.tail_amplitude) < 0.1


def test_a_tail_that_goes_round_has_the_radius_of_its_path():
    """A fin that stands 30 deg off the hull's axis and turns about it: L sin 30 deg, in all directions."""
    turning = FIN.replace("{kind: planar, axis: z}", "{kind: free}").replace("180 deg]", "150 deg]")
    turning = turning.replace(
        "axis: z, motion: {kind: sine, amplitude: 0.4 rad, frequency: 1.25 Hz}",
        f"axis: [{np.cos(np.radians(150))}, -0.5, 0], motion: {{kind: rate, rate: 7.853981633974483 rad/s}}",
    )
    robot = build(parse_robot(turning))
    times, still = jnp.linspace(0.0, 1 / F, 65), robot.initial()
    rates = jnp.zeros(6).at[3].set(V)
    place = jax.jit(jax.vmap(lambda t: robot.advance(still.q, rates, t)))(times)
    means = means_of(robot, times, State(place, jnp.broadcast_to(rates, (65, 6)), still.z))
    assert float(means.tail_amplitude) == pytest.approx(LENGTH / 2, rel=1e-9)
    assert float(means.strouhal) == pytest.approx(F * LENGTH / V, rel=1e-9)


def test_derivatives_are_those_of_finite_differences():
    """In reverse: JAX makes it of the forward derivatives, so that these are checked, too."""
    paths = ("limbs.fin.length", "limbs.fin.joint.motion.amplitude", "body.length")
    theta, build_at = bind(parse_robot(FIN), paths)

    def told(theta):
        robot = build_at(theta)
        m = cycle_means(robot, *towed(robot, 0.3, n=17))
        return m.strouhal + m.stride_length + m.tail_amplitude + 10 * m.froude_efficiency

    both = jax.jit(jax.value_and_grad(told))
    h = 1e-6 * np.eye(3)
    differences = [(float(both(theta + x)[0]) - float(both(theta - x)[0])) / 2e-6 for x in h]
    np.testing.assert_allclose(both(theta)[1], differences, rtol=1e-5)


def test_a_camera_below_changes_neither_length_nor_tail_of_a_reference():
    """It reaches 0.4 m behind and below the hull: without a reference it is the robot's rearmost end, and stiff."""
    camera = (
        "  camera: {on: body, at: root, rotation: [0 deg, 120 deg, 0 deg], kind: rigid, shape: cylinder, length: 0.8 m,"
        " radius: 5 mm, mass: 0.1 kg}\n"
    )
    reference = "reference: {length: 220 mm, tail: limbs.fin}\n"
    bare, hung, known = (build(parse_robot(text)) for text in (FIN, FIN + camera, FIN + camera + reference))
    amplitude = LENGTH * np.sin(A)
    means = [means_of(robot, *towed(robot)) for robot in (bare, hung, known)]
    assert float(means[0].tail_amplitude) == pytest.approx(amplitude, rel=1e-3)
    assert float(means[1].tail_amplitude) < 0.1 * amplitude
    assert float(means[2].tail_amplitude) == float(means[0].tail_amplitude)
    assert float(means[2].strouhal) == float(means[0].strouhal)
    assert float(means[2].body_length) == 0.22
    assert float(means[2].body_lengths_per_second) == pytest.approx(V / 0.22)


def test_a_tail_that_is_no_part_is_refused_with_the_parts():
    with pytest.raises(InputError, match=r"reference.tail: there is no part limbs.tial"):
        parse_robot(FIN + "reference: {tail: limbs.tial}\n")
