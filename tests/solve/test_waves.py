"""Robots in waves: closed forms of what floats, is held or drifts; balances, derivatives and cycles."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import nectosome as ns
from nectosome.core import State, Status
from nectosome.description import drive_period, parse_robot
from nectosome.description.flow_fields import wave_number
from nectosome.description.plausible import implausible
from nectosome.model import build
from nectosome.units import InputError

G, RHO, T = 9.80665, 1000.0, 3.0
OMEGA = 2 * np.pi / T
K = OMEGA**2 / G
LENGTH, WIDTH, HEIGHT = 0.2, 0.4, 0.1
BOX = f"""
name: box
water: {{surface: 0 m, flows: {{swell: {{kind: regular_waves, height: 1 mm, period: {T} s, heading: HEADING}}}}}}
body:
  kind: rigid
  shape: box
  length: {LENGTH} m
  width: {WIDTH} m
  height: {HEIGHT} m
  density: 500 kg/m3
  joint: {{kind: JOINT}}
  loads: {{drag: {{kind: lumped_drag, drag_area: [0 m2, 0 m2, 100 cm2]}}}}
"""
PILE = """
name: pile
water:
  surface: 0 m
  floor: -1 m
  current: [0.1 m/s, 0 m/s, 0 m/s]
  flows: {swell: {kind: regular_waves, height: 60 mm, period: 1.5 s}}
limbs:
  pile:
    kind: rigid
    shape: cylinder
    length: 0.3 m
    radius: 10 mm
    mass: 0.2 kg
    offset: [0.2 m, -0.15 m, -0.4 m]
    rotation: [0 deg, 0 deg, 90 deg]
    joint: {kind: fixed}
    loads:
      drag: {kind: drag, normal: 1.2}
      water: {kind: added_mass, normal: 0.9, separated: true}
  weight: {kind: rigid, shape: point, mass: 1 kg, joint: {kind: prismatic, axis: x}}
"""
BALL = """
name: ball
about: As dense as the water, with the velocity of the water at the start.
water:
  surface: 0.1 m
  floor: -0.7 m
  flows: {swell: {kind: regular_waves, height: 2 mm, period: 1.3 s, phase: 90 deg}}
body:
  kind: rigid
  shape: spheroid
  length: 2 mm
  radius: 1 mm
  density: 1000 kg/m3
  joint: {kind: planar, axis: y, start: {position: [-1 mm, 0 m, 0 m], velocity: START}}
  loads: {water: {kind: spheroid_added_mass}}
"""
EEL = """
name: eel
water:
  surface: 10 mm
  floor: -0.5 m
  current: [0.05 m/s, 0 m/s, 0 m/s]
  flows:
    swell: {kind: regular_waves, height: 30 mm, period: 0.8 s, heading: 30 deg}
    shear: {kind: sheared_current, direction: y, heights: [-0.5 m, 0.1 m], speed: [0 m/s, 0.1 m/s]}
    gust: {kind: changing_current, speed: {kind: sine, amplitude: 0.05 m/s, frequency: 2.5 Hz}}
body:
  kind: rigid
  shape: box
  length: 100 mm
  width: 40 mm
  height: 40 mm
  density: 700 kg/m3
  joint: {kind: free}
  loads: {drag: {kind: lumped_drag, drag_area: [8 cm2, 20 cm2, 20 cm2]}, water: {kind: added_mass, normal: 1}}
limbs:
  tail:
    kind: rod
    at: root
    section: ellipse
    length: 0.3 m
    width: 10 mm
    height: 20 mm
    young: 2 MPa
    density: 900 kg/m3
    damping: 10 kPa s
    strains: {bending_y: 2, bending_z: 2}
    points: 4
    loads: {drag: {kind: drag, normal: 1.2}, water: {kind: added_mass, normal: 1}}
"""
NUMBERS = (
    *(f"water.flows.swell.{name}" for name in ("height", "period", "heading")),
    *(f"water.flows.shear.{name}.1" for name in ("speed", "heights")),
    *(f"water.flows.gust.speed.{name}" for name in ("amplitude", "frequency")),
)


def box(heading: str, joint: str):
    return parse_robot(BOX.replace("HEADING", heading).replace("JOINT", joint))


def test_waves_push_a_box_as_the_closed_forms_say():
    """Held level: rho g L W a exp(-k D) with the waves' height, rho g V GM k a with their slope in beam seas."""
    draught, mass, times = HEIGHT / 2, 0.5 * RHO * LENGTH * WIDTH * HEIGHT, jnp.linspace(0.0, T, 9)
    metacentre = WIDTH**2 / 12 / draught - draught / 2
    angle = OMEGA * np.asarray(times)
    wave = 0.5e-3 * np.cos(K * LENGTH / 2 - angle), 0.5e-3 * np.sin(angle)  # at its middle
    for held, expected in (
        (box("0 deg", "prismatic, axis: z"), RHO * G * LENGTH * WIDTH * np.exp(-K * draught) * wave[0]),
        (box("90 deg", "revolute, axis: x"), mass * G * metacentre * K * wave[1]),
    ):
        robot = build(held)
        x = robot.initial()
        pushed = jax.jit(jax.vmap(lambda t, robot=robot, x=x: -robot.residual(t, x, jnp.zeros(1))[0]))(times)
        np.testing.assert_allclose(pushed, expected, atol=0.004 * np.abs(expected).max())


@pytest.mark.slow
def test_a_box_heaves_as_far_as_the_closed_form_says():
    """Draught D, without added mass: a exp(-k D) / (1 - omega^2 D / g); drag is small of second order."""
    cycle = ns.periodic(box("0 deg", "prismatic, axis: z"))
    assert cycle.status == Status.SOLVED
    z, draught = cycle.to_dataset()["position"].values[:, 0, 2], HEIGHT / 2
    height = 0.5e-3 * np.exp(-K * draught) / (1 - OMEGA**2 * draught / G)
    assert np.ptp(z) / 2 == pytest.approx(height, rel=2e-3)


@pytest.mark.slow
def test_a_box_rolls_as_far_as_the_closed_form_says():
    """About its middle, in beam seas: k a / (1 - omega^2 / omega_n^2), omega_n^2 = rho g V GM over its inertia."""
    cycle = ns.periodic(box("90 deg", "revolute, axis: x"))
    assert cycle.status == Status.SOLVED
    roll = cycle.to_dataset()["q"].values[:, 0]
    draught, mass = HEIGHT / 2, 0.5 * RHO * LENGTH * WIDTH * HEIGHT
    metacentre = WIDTH**2 / 12 / draught - draught / 2
    stiffness, inertia = mass * G * metacentre, mass * (WIDTH**2 + HEIGHT**2) / 12
    assert np.ptp(roll) / 2 == pytest.approx(K * 0.5e-3 / (1 - OMEGA**2 * inertia / stiffness), rel=2e-3)


def test_the_force_on_a_fixed_cylinder_is_morisons():
    """rho/2 C_D D L |c| c + rho (1 + C_A) V Dc/Dt across it, with the current: ratios by the Doppler-shifted wave."""
    data = ns.simulate(parse_robot(PILE), 1.5, samples=13).to_dataset()
    t, omega, depth, x, z = data["time"].values, 2 * np.pi / 1.5, 1.0, 0.2, -0.4
    k = wave_number(omega, G, depth, 0.1)
    angle, size = k * x - omega * t, 0.03 * (omega - 0.1 * k) / np.sinh(k * depth)
    cosh, sinh = size * np.cosh(k * (z + depth)), size * np.sinh(k * (z + depth))
    c = np.stack([0.1 + cosh * np.cos(angle), sinh * np.sin(angle)])
    slope = (
        k * np.stack([-cosh * np.sin(angle), sinh * np.cos(angle)]),
        k * np.stack([sinh * np.cos(angle), cosh * np.sin(angle)]),
    )
    local = omega * np.stack([cosh * np.sin(angle), -sinh * np.cos(angle)])
    rate = local + c[0] * slope[0] + c[1] * slope[1]
    volume = np.pi * 0.01**2 * 0.3
    force = 0.5 * RHO * 1.2 * 0.02 * 0.3 * np.linalg.norm(c, axis=0) * c + RHO * 1.9 * volume * rate
    force[1] += (RHO * volume - 0.2) * G
    found = data["load_force"].sel(part="pile").sum("load").values
    np.testing.assert_allclose(found[:, 0], force[0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found[:, 2], force[1], rtol=1e-9, atol=1e-12)


def test_a_neutral_ball_drifts_with_the_water():
    """As Stokes says of a particle: with its added mass the whole of it follows the water."""
    k, a, omega = wave_number(2 * np.pi / 1.3, G, 0.8, 0.0), 1e-3, 2 * np.pi / 1.3
    up = a * omega * np.sinh(k * 0.7) / np.sinh(k * 0.8)
    run = ns.simulate(
        parse_robot(BALL.replace("START", f"[0 m/s, 0 m/s, {-up} m/s]")), 13.0, samples=11, rtol=1e-8, atol=1e-11
    )
    drift = run.to_dataset()["position"].values[-1, 0, 0] / 13.0
    expected = a**2 * omega * k * np.cosh(2 * k * 0.7) / (2 * np.sinh(k * 0.8) ** 2)
    assert drift == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("text", [EEL.partition("limbs:")[0], pytest.param(EEL, marks=pytest.mark.slow)])
def test_powers_and_momenta_balance_in_waves_and_currents(text: str):
    data = ns.simulate(parse_robot(text), 0.4, samples=9, rtol=1e-6).to_dataset()
    assert float(data["power_balance"].max()) < 1e-11
    assert float(data["momentum_balance"].max()) < 1e-11


@cache
def by_numbers():
    """Numbers of the flows, a direction of them, and the robot by them."""
    theta, to_robot = ns.bind(parse_robot(EEL.partition("limbs:")[0]), NUMBERS)
    return theta, theta * np.random.default_rng(2).normal(size=theta.size), to_robot


def slope_and_difference(f, step: float):
    theta, direction, _ = by_numbers()
    difference = (f(theta + step * direction) - f(theta - step * direction)) / (2 * step)
    return jax.jvp(f, (theta,), (direction,))[1], difference


def test_the_push_of_waves_has_the_derivatives_of_differences():
    """By their height and period, on a box that they roll."""
    theta, to_robot = ns.bind(box("70 deg", "revolute, axis: x"), NUMBERS[:2])
    way = theta * np.array([0.7, -1.3])

    @jax.jit
    def pushed(theta):
        robot = to_robot(theta)
        return robot.residual(jnp.asarray(0.3), robot.initial(), jnp.zeros(1))[0]

    difference = (pushed(theta + 1e-6 * way) - pushed(theta - 1e-6 * way)) / 2e-6
    assert float(jax.jvp(pushed, (theta,), (way,))[1]) == pytest.approx(float(difference), rel=1e-7)


@pytest.mark.slow
def test_forces_have_the_derivatives_of_differences():
    """By all numbers of the flows, along one direction."""
    to_robot = by_numbers()[2]

    @jax.jit
    def forces(theta):
        robot = to_robot(theta)
        x = robot.initial()
        return robot.residual(jnp.asarray(0.3), State(x.q, x.v + 0.2, x.z), jnp.zeros_like(x.v))

    slope, difference = slope_and_difference(forces, 1e-6)
    np.testing.assert_allclose(slope, difference, rtol=1e-7, atol=1e-8)


@pytest.mark.slow
def test_the_derivative_through_a_run_is_that_of_differences():
    to_robot = by_numbers()[2]

    def end(theta):
        return ns.simulate(to_robot(theta), 0.1, samples=2, rtol=1e-9, atol=1e-11).value.state.q[-1, :3]

    slope, difference = slope_and_difference(end, 1e-4)
    np.testing.assert_allclose(slope, difference, rtol=1e-5, atol=1e-6 * float(np.abs(difference).max()))


@pytest.mark.parametrize(
    ("waves", "said"),
    [
        ("{kind: regular_waves, height: 10 mm, period: 0.75 s}", 1.5),
        ("{kind: regular_waves, height: 0 mm, period: 0.77 s}", 0.5),
        ("{kind: regular_waves, height: 10 mm, period: 0.77 s}", "water.flows.swell.period"),
        ("{kind: irregular_waves, significant_height: 10 mm, peak_period: 1 s}", "water.flows.swell.kind"),
    ],
)
def test_a_cycle_has_the_period_of_drives_and_waves(waves, said):
    driven = "joint: {kind: prismatic, axis: z, motion: {kind: sine, amplitude: 1 cm, frequency: 2 Hz}}"
    text = "water: {surface: 0 m, flows: {swell: WAVES}}, body: {kind: rigid, shape: point, mass: 1 kg, DRIVEN}}"
    robot = parse_robot("{name: float, " + text.replace("WAVES", waves).replace("DRIVEN", driven))
    if isinstance(said, float):
        assert drive_period(robot) == pytest.approx(said, rel=1e-12)
    else:
        with pytest.raises(InputError) as caught:
            drive_period(robot)
        assert caught.value.field == said


def test_water_that_changes_leaves_nothing_at_rest():
    with pytest.raises(InputError, match="leave nothing at rest"):
        ns.static(parse_robot(BOX.replace("HEADING", "0 deg").replace("JOINT", "prismatic, axis: z")))


def test_waves_that_are_short_against_a_part_are_told():
    box = BOX.replace("HEADING", "0 deg").replace("JOINT", "free")
    told = [dict(implausible(parse_robot(box.replace(f"period: {T}", f"period: {n}")))) for n in (1, 2)]
    assert "1.561 m long, and body has 400 mm" in told[0]["water.flows.swell"]
    assert "water.flows.swell" not in told[1]
