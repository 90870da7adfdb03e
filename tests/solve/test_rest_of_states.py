"""Equilibria of all states: rest in a stream is where a long simulation ends, and where a steady motion stays."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq
from tests.load_examples import EXAMPLES

from nectosome.core import Load, Status
from nectosome.description import parse_robot, with_values
from nectosome.identification import identify
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
  loads: {water: {kind: added_mass, normal: 1, separated: false}, own: LOAD}
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
    alone = SCENES["StartingPlateDrag"].replace("water: {kind: added_mass, normal: 1, separated: false}, ", "")
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


# --- robots that their loads alone hold ------------------------------------------------------------------------------

PENDULUM = """
name: pendulum
water: {gravity: 9.81 m/s2, density: 1e-9 kg/m3}
body: {kind: rigid, shape: cylinder, length: 1 m, radius: 10 mm, mass: 0.3 kg, volume: 0 m3,
  joint: {kind: revolute, axis: y}}
limbs:
  second: {kind: rigid, shape: cylinder, length: 0.6 m, radius: 10 mm, mass: 0.2 kg, volume: 0 m3,
    joint: {kind: revolute, axis: y}}
"""


@pytest.mark.parametrize("start", [(0, 0), (-20, 170), (-80, 10), (0, 90)])
def test_links_without_springs_hang_below_wherever_they_start(start: tuple[float, float]):
    """Horizontal ones have no stiffness where they start; two links without friction swing at two frequencies."""
    paths = ("body.joint.position", "limbs.second.joint.position")
    rests = static(with_values(parse_robot(PENDULUM), dict(zip(paths, np.radians(start), strict=True))))
    assert int(rests.status) == Status.SOLVED and rests.stability.kind == "marginal"
    np.testing.assert_allclose(rests.state.q, [np.pi / 2, 0.0], atol=1e-12)


def test_links_that_stand_are_unstable():
    stands = static(with_values(parse_robot(PENDULUM), {"body.joint.position": -np.pi / 2}))
    assert int(stands.status) == Status.UNSTABLE and stands.stability.kind == "diverges"


SLIDES = PENDULUM.replace("joint: {kind: revolute, axis: y}}", "joint: {kind: prismatic, axis: x, position: 0.3 m}}", 1)


def test_what_nothing_holds_stays_where_it_starts_unless_something_pushes_it():
    rests = static(parse_robot(SLIDES))
    assert int(rests.status) == Status.SOLVED and rests.loose == ("body.position",)
    np.testing.assert_allclose(rests.state.q, [0.3, np.pi / 2], atol=1e-12)
    assert rests.notes == ["nothing holds body.position: there it stays where it starts."]
    pushed = static(parse_robot(SLIDES.replace("position: 0.3 m", "force: {kind: constant, value: 1 mN}")))
    assert int(pushed.status) == Status.NO_EQUILIBRIUM and pushed.loose == ("body.position",)


HUB = """{on: ON, at: root, kind: rigid, shape: spheroid, length: 20 mm, radius: 10 mm, mass: 0.1 kg, volume: 0 m3,
    centre_of_mass: [-10 mm, 0 mm, 0 mm], joint: {kind: revolute, axis: AXIS}}"""


@pytest.mark.parametrize(("axis", "turn"), [("y", 1.0), ("[0, 0.8, 0.6]", 0.8)])
def test_what_may_move_together_is_told(axis: str, turn: float):
    """A link that hangs on two hubs in one point is held against turns about y alone; the others are told.

    The axis of the second hub is y, or of 0.6 along the vertical and 0.8 along y: that turns the link about y by 0.8.
    The link swings by sqrt(m g L/2 / I); small hubs make no growth of what is loose.
    """
    text = f"""
name: hubs
water: {{gravity: 9.81 m/s2, density: 1e-9 kg/m3}}
body: {HUB.replace("on: ON, at: root, ", "").replace("AXIS", "y")}
limbs:
  second: {HUB.replace("ON", "body").replace("AXIS", axis)}
  link: {{on: second, at: root, rotation: [0 deg, 90 deg, 0 deg], kind: rigid, shape: cylinder, length: 0.6 m,
    radius: 10 mm, mass: 0.2 kg, volume: 0 m3, joint: {{kind: revolute, axis: y}}}}
"""
    rests = static(parse_robot(text))
    assert int(rests.status) == Status.SOLVED and rests.stability.kind == "marginal"
    pairs = [
        (tuple(part.partition(".")[0] for part in names.replace(" and ", ",").split(",")), ratio)
        for names, ratio in (told.removesuffix(")").split(" together (") for told in rests.loose)
    ]
    moves = {"body": 1.0, "second": turn, "link": 1.0}
    assert len(pairs) == 2
    for (first, other), ratio in pairs:
        ahead, back = map(float, ratio.split(" : "))
        assert moves[first] * ahead + moves[other] * back == pytest.approx(0.0, abs=5e-3)  # of three digits
    assert rests.notes[-1] == f"nothing holds {', '.join(rests.loose)}: there it stays where it starts."


def test_what_stays_where_it_starts_has_derivatives():
    """The slide goes with its start; the link hangs with its centre of mass, 0.3 m along and c across it, below."""
    text = SLIDES.replace("mass: 0.2 kg", "mass: 0.2 kg, centre_of_mass: [0 m, 0 m, 40 mm]")
    theta, make = bind(parse_robot(text), ("body.joint.position", "limbs.second.centre_of_mass.2"))
    rest = jax.jit(lambda theta: static(make(theta)).state.q)
    theta = jnp.asarray(theta)
    np.testing.assert_allclose(rest(theta), [0.3, np.pi / 2 + np.arctan2(0.04, 0.3)], atol=1e-12)
    np.testing.assert_allclose(jax.jacfwd(rest)(theta), [[1, 0], [0, 0.3 / (0.3**2 + 0.04**2)]], atol=1e-10)


RAFT = """
name: raft
water: {surface: 0 m, density: 1000 kg/m3}
body: {kind: rigid, shape: box, length: 0.4 m, width: 0.2 m, height: 0.1 m, mass: 4 kg,
  centre_of_mass: [20 mm, 0 m, 0 m],
  joint: {kind: planar, axis: y, start: {position: [3 m, 0 m, 0.2 m]}}}
limbs:
  vane: {on: body, at: root, kind: rigid, shape: point, mass: 1 g, volume: 0 m3,
    joint: {kind: revolute, axis: x, stiffness: 0.1 N m/rad, rest: 10 deg}}
"""


def test_a_raft_in_a_plane_floats():
    """Of walls that leave the water its centre of buoyancy is L^2 t/12d ahead and d/2 + L^2 t^2/24d up, t = tan(trim).

    The vane of 1 g is at its root, L/2 behind the middle.
    """
    length, height, weight = 0.4, 0.1, 4.001
    depth, ahead = weight / (1000 * length * 0.2), (4 * 0.02 - 0.001 * length / 2) / weight

    def lever(trim: float) -> float:
        t = np.tan(trim)
        up = height / 2 - depth / 2 - (length * t) ** 2 / (24 * depth)
        return ahead - length**2 * t / (12 * depth) + up * t

    trim = brentq(lever, 0.0, 0.1)
    floats = static(parse_robot(RAFT))
    assert int(floats.status) == Status.SOLVED
    root = length / 2 * np.sin(trim) + (height / 2 - depth) * np.cos(trim)
    np.testing.assert_allclose(floats.state.q[1:3], [-root, trim], atol=1e-9)


def test_a_raft_without_weight_stays():
    still = static(parse_robot(RAFT.replace("surface: 0 m", "gravity: 0 m/s2")))
    np.testing.assert_allclose(still.state.q, [3.0, -0.2, 0.0, np.radians(10)], atol=1e-12)


FREE = PLATE.replace("stiffness: 0.5 N m/rad, ", "").replace("0.1 m/s, 0 m/s]", "0 m/s, 0 m/s]")


@pytest.mark.parametrize("own", ["{kind: plate_drag, normal: 1.2}", pytest.param(FOIL, marks=pytest.mark.slow)])
def test_a_vane_without_a_spring_comes_to_rest_where_its_motion_ends(own):
    """Its added mass turns it across the stream, what else it has along it: so there are four places of rest."""
    vane = parse_robot(FREE.replace("LOAD", own).replace("joint:", "rotation: [0 deg, 0 deg, 20 deg]\n  joint:"))
    for turned in (0.0, 80.0, 150.0):
        start = with_values(vane, {"body.joint.position": np.radians(turned)})
        rests, goes_on = static(start), steady(start)
        run = simulate(start, 40.0, samples=2, rtol=1e-6, atol=1e-9, method="implicit")
        assert int(rests.status) == Status.SOLVED and rests.stability.kind == "decays"
        assert int(goes_on.status) == Status.SOLVED
        for other in (goes_on.state.q, run.value.state.q[-1]):
            np.testing.assert_allclose(other, rests.state.q, atol=1e-5)


def test_a_motor_that_turns_a_vane_on_is_never_at_rest():
    """Its stall torque, 0.24 N m, is more than rho U^2 L (C h L/4 + pi h^2/8), 0.16 N m, of the stream."""
    motor = (
        "motor: {torque_constant: 0.2 N m/A, resistance: 2 ohm, supply: 6 V, duty_cycle: {kind: constant, value: 0.4}}"
    )
    robot = FREE.replace("LOAD", "{kind: plate_drag, normal: 1.2}").replace("damping: 0.05 N m s/rad", motor)
    found = static(parse_robot(robot))
    assert int(found.status) == Status.NO_EQUILIBRIUM
    assert found.why == "no shape at rest found: from its start its loads move it on. See nectosome simulate."


HANGING = """
name: hanging
water: {density: 1000 kg/m3, gravity: 9.81 m/s2, current: [0 m/s, 0.3 m/s, 0 m/s]}
body: {kind: rigid, shape: box, length: 200 mm, width: 3 mm, height: 60 mm, density: 2000 kg/m3,
  rotation: [0 deg, 90 deg, 0 deg], joint: {kind: revolute, axis: z, position: 150 deg},
  loads: {own: {kind: plate_drag, normal: 1.2, start_up: none}}}
aliases: {U: water.current.1, C: body.loads.own.normal}
"""


def hanging(speed: float, normal: float) -> tuple[float, float]:
    """Angle a in a stream with sin a = b cos^2 a, b = C rho h U^2/(2 (rho_s - rho) h w g), and its derivative by C."""
    b = normal * speed**2 / (2 * 3e-3 * 9.81)
    sine = (np.sqrt(1 + 4 * b**2) - 1) / (2 * b)
    return float(np.arcsin(sine)), float((1 - sine**2) * b / normal / np.sqrt(1 - sine**2) / (1 + 2 * b * sine))


def test_a_plate_hangs_in_a_stream_from_above_too():
    """It starts 30 deg from upright; so do derivatives."""
    robot = parse_robot(HANGING)
    angle, slope = hanging(0.3, 1.2)
    assert float(static(robot).state.q[0]) == pytest.approx(angle, rel=1e-9)
    theta, make = bind(robot, ("C",))
    assert float(jax.jacfwd(lambda C: static(make(C)).state.q[0])(theta)[0]) == pytest.approx(slope, rel=1e-8)


@pytest.mark.slow
def test_angles_of_a_plate_that_hangs_in_a_stream_tell_its_drag():
    robot, speeds = parse_robot(HANGING), np.array([0.1, 0.2, 0.4])
    data = {"time": None, "U": (speeds, "m/s"), "angle": np.array([hanging(speed, 1.1)[0] for speed in speeds])}
    found = identify(robot, [data], vary={"C": (0.5, 2.0)}, compare={"angle": "body.angle"}, drive={"U": "U"}, starts=1)
    assert found.theta[0] == pytest.approx(1.1, rel=1e-8) and not found.warnings


BALL = """
name: ball
water: {gravity: 9.81 m/s2, density: 1e-9 kg/m3}
body: {kind: rigid, shape: point, mass: 0.4 kg, volume: 0 m3, inertia: [1e-4 kg m2, 1e-4 kg m2, 1e-4 kg m2],
  joint: {kind: prismatic, axis: z, position: 200 mm, lower: {at: 0 mm, stiffness: 50 kN/m, softness: 0.1 mm}}}
"""


def test_a_ball_above_a_stop_rests_on_it():
    """Well into the stop its force is k (d - s/2), d = m g/k + s/2."""
    robot = parse_robot(BALL)
    for found in (static(robot), steady(robot)):
        assert int(found.status) == Status.SOLVED
        assert float(found.state.q[0]) == pytest.approx(-(0.4 * 9.81 / 5e4 + 5e-5), rel=1e-9)


MOORED = """
name: moored
water: {density: 1000 kg/m3, gravity: 0 m/s2, current: [-0.3 m/s, 0.1 m/s, 0 m/s]}
body: {kind: rigid, shape: spheroid, length: 300 mm, radius: 30 mm, density: 1000 kg/m3, joint: {kind: planar, axis: z},
  loads: {drag: {kind: lumped_drag, drag_area: [6 cm2, 200 cm2, 200 cm2]}}}
limbs:
  post: {on: world, kind: rigid, shape: cylinder, radius: 10 mm, length: 50 mm, mass: 1 kg, offset: [0.3 m, 0, 0]}
  fin: {on: body, at: root, kind: rigid, shape: box, length: 100 mm, width: 3 mm, height: 100 mm, density: 1000 kg/m3,
    rotation: [0 deg, 0 deg, 180 deg],
    loads: {own: {kind: foil, span_along: z, ahead: -x, chord: 100 mm, thickness: 3 mm, profile_drag: 0}}}
pairs: {rope: {kind: bushing, between: [body, post], at: [tip, root], stiffness: 20 N/m, damping: 5 N s/m}}
"""


def test_a_body_on_a_rope_lies_along_the_stream():
    """Across the stream all forces come to 0; along it the rope is stretched by rho A U^2/2k."""
    found = steady(parse_robot(MOORED))
    assert int(found.status) == Status.SOLVED and found.stability.kind == "decays"
    x, y, angle = np.asarray(found.state.q)
    assert angle == pytest.approx(-np.arctan(1 / 3), abs=1e-9)
    assert np.hypot(0.3 - x, y) - 0.3 == pytest.approx(0.5 * 1000 * 6e-4 * 0.1 / 20, rel=1e-9)
