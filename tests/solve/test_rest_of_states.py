"""Equilibria of all states: rest in a stream is where a long simulation ends, and where a steady motion stays."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.load_examples import EXAMPLES

from nectosome.core import Load, Status
from nectosome.description import parse_robot, with_values
from nectosome.model import bind
from nectosome.solve import modes, simulate, static, steady
from nectosome.units import InputError

PLATE = """
name: plate
water: {density: 1000 kg/m3, gravity: 0 m/s2, current: [0.4 m/s, 0.1 m/s, 0 m/s], floor: -1 m}
body:
  kind: rigid
  shape: box
  length: 200 mm
  width: 3 mm
  height: 60 mm
  mass: 0.1 kg
  joint: {kind: revolute, axis: z, stiffness: 0.5 N m/rad, damping: 0.05 N m s/rad}
  loads: {water: {kind: added_mass, normal: 1}, own: LOAD}
"""
ROD = """
name: rod
water: {density: 1000 kg/m3, gravity: 0 m/s2, current: [0 m/s, 0.1 m/s, 0.4 m/s]}
body: {kind: rod, section: rectangle, width: 4 mm, height: 60 mm, length: 200 mm, young: 3 MPa, density: 1100 kg/m3,
  damping: 30 kPa s, strains: {bending_z: 1}, points: 4, loads: {own: LOAD}}
"""
STANDS = """
name: stands
water: {density: 1000 kg/m3, floor: -129 mm}
body: {kind: rigid, shape: cylinder, length: 60 mm, radius: 10 mm, mass: 0.2 kg,
  joint: {kind: prismatic, axis: [3, 0, 4]}, loads: {own: LOAD}}
"""
LEG = (
    "{kind: leg, hip: [0 mm, 0 mm, 0 mm], crank: 10 mm, bearing: [0 mm, -50 mm], length: 120 mm, speed: SPEED,"
    " start: -90 deg, stiffness: 200 N/m, damping_ratio: 0.5, static_friction: 2, dynamic_friction: 2}"
)
FOIL = "{kind: foil, span_along: z, ahead: -x, chord: 100 mm, thickness: 4 mm}"
THRUST = "{kind: pulsed_thrust, values: [1 N, 2 N, 1 N, 0 N], rated: 10 rad/s, speed: SPEED, direction: [0, 1, 0]}"
SCENES = {
    "StartingPlateDrag": PLATE.replace("LOAD", "{kind: plate_drag, normal: 1.2}"),
    "RigidFoil": PLATE.replace("LOAD", FOIL),
    "RodFoil": ROD.replace(
        "LOAD", FOIL.replace("span_along: z, ", "span_along: x, ").replace("ahead: -x", "ahead: -z")
    ),
    "LaggedTrailingEdge": PLATE.replace("LOAD", "{kind: trailing_edge, chord: 50 mm}"),
    "Leg": STANDS.replace("LOAD", LEG.replace("SPEED", "0 rad/s")),
    "PulsedThrust": PLATE.replace("LOAD", THRUST.replace("SPEED", "0 rad/s")),
}


def test_every_load_with_states_has_a_scene():
    loads = (e.load for e in EXAMPLES if isinstance(e.load, Load))
    assert {type(load).__name__ for load in loads if jax.tree.leaves(load.initial())} == {*SCENES}


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow if n == "RodFoil" else ()) for n in SCENES])
def test_rest_is_where_a_long_run_ends_and_a_steady_motion_stays(name):
    robot = parse_robot(SCENES[name])
    rests = static(robot)
    assert int(rests.status) == Status.SOLVED
    run = simulate(robot, 30.0, samples=2, rtol=1e-6, atol=1e-9, method="implicit")
    goes_on = steady(robot)
    assert int(goes_on.status) == Status.SOLVED and int(run.status) == Status.SOLVED
    for other in (goes_on.state.q, run.value.state.q[-1]):
        np.testing.assert_allclose(other, rests.state.q, atol=1e-6 * np.max(np.abs(rests.state.q)))
    assert np.max(np.abs(rests.state.q)) > 1e-3


SERVO = PLATE.replace("LOAD", "{kind: plate_drag, normal: 1.2}").replace(
    "stiffness: 0.5 N m/rad,", "stiffness: 0 N m/rad, motion: {kind: rate, rate: 0 rad/s}, servo: {torque_constant: 0.5"
    " N m/A, resistance: 2 ohm, inertia: 1e-3 kg m2, supply: 6 V, velocity_loop: {full_voltage_at: 4 rad/s,"
    " integral_time: 0.3 s}},",
)  # fmt: skip


def test_the_integral_of_a_servo_holds_what_the_water_pushes():
    """It is -x where a speed of 0 is held from x = 0 on, with no other condition; its torque K U (-x/T_i)/(e_f R)."""
    robot = parse_robot(SERVO)
    rests, goes_on = static(robot), steady(robot)
    run = simulate(robot, 30.0, samples=2, rtol=1e-7, atol=1e-10, method="implicit")
    x = float(rests.state.q[0])
    for other in (goes_on.state.q[0], run.value.state.q[-1, 0]):
        assert float(other) == pytest.approx(x, rel=1e-6)
    assert np.asarray(jax.tree.leaves(rests.state.z[-1])[0]) == pytest.approx(-x, rel=1e-12)
    torque = -0.5 * 6 * x / (0.3 * 4 * 2)
    data = rests.to_dataset()
    assert float(data["motor_torque"].squeeze()) == pytest.approx(torque, rel=3e-5)  # its limit is smooth


def test_a_plate_in_a_stream_turns_as_far_as_its_steady_drag_says():
    """k x = C rho A (U cos x)^2 l/4 with 1.2, 2 N m/rad, 12e-3 m2, 0.5 m/s, from broadside on; and its derivative."""
    alone = SCENES["StartingPlateDrag"].replace("water: {kind: added_mass, normal: 1}, ", "")
    robot = parse_robot(alone.replace("joint:", "rotation: [0 deg, 0 deg, 90 deg]\n  joint:"))
    robot = with_values(robot, {"water.current.0": 0.5, "water.current.1": 0.0, "body.joint.stiffness": 2.0})
    drag = 0.5 * 1.2 * 1000 * 0.012 * 0.1
    x = 0.0
    for _ in range(60):
        x = -drag * 0.25 * np.cos(x) ** 2 / 2
    assert float(static(robot).state.q[0]) == pytest.approx(x, rel=1e-9)
    theta, make = bind(robot, ("body.joint.stiffness",))
    slope = jax.jit(jax.vmap(jax.grad(lambda k: static(make(k)).state.q[0])))(jnp.stack([theta, theta]))
    expected = -x / (2 + drag * 0.25 * np.sin(-2 * x))
    assert np.asarray(slope) == pytest.approx(np.full((2, 1), expected), rel=1e-8)


def test_what_turns_on_is_never_at_rest():
    robot = parse_robot(PLATE.replace("LOAD", THRUST.replace("SPEED", "3 rad/s")))
    found = static(robot)
    assert int(found.status) == Status.NO_EQUILIBRIUM
    assert found.why.startswith("the crank of body.own turns on: nothing comes to rest. Set its speed to 0 rad/s")
    with pytest.raises(InputError, match=r"The crank of body\.own turns on"):
        modes(robot)
