"""A uniform stream changes nothing seen from the water: Galileo's transformation of motions, and what judges them."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State, Status, UniformCurrent
from nectosome.description import RobotDescription, parse_robot
from nectosome.description.variables import read_variable
from nectosome.designs import MotionDesign, sweep
from nectosome.model import build
from nectosome.robots import describe, file_names
from nectosome.solve import (
    CycleMeans,
    cycle_means,
    goes_along,
    in_still_water,
    in_stream,
    periodic,
    simulate,
    steady,
    with_stream,
)
from nectosome.solve.stream import stands

# a hull and a stiff fin on a servo hinge, in space: it swims along its own axis and turns
SWIMMER = """
name: swimmer
water: {gravity: 9.81 m/s2}
body:
  kind: rigid
  shape: spheroid
  length: 0.3 m
  radius: 0.05 m
  mass: 2 kg
  joint: {kind: planar, axis: z}
  loads: {drag: {kind: lumped_drag, drag_area: [6 cm2, 200 cm2, 0 m2], rotational: [0 kg m2, 1e-3 kg m2, 1e-3 kg m2]}}
limbs:
  fin:
    on: body
    at: root
    rotation: [0 deg, 0 deg, 180 deg]
    kind: rigid
    shape: box
    length: 0.15 m
    width: 4 mm
    height: 60 mm
    mass: 0.1 kg
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 25 deg, offset: 6 deg, frequency: 2 Hz}}
    loads: {push: {kind: plate_drag, normal: 2, start_up: none}, added_mass: {kind: added_mass, normal: 1}}
"""
STREAM = [-0.2, 0.07, 0.0]
# what belongs to the ground: velocities in the world, and the powers and energies of what moves in it
OF_GROUND = {"velocity", "velocity_peak", "load_power", "load_power_peak", "energy", "part_energy"}
OF_GROUND |= {"water_velocity", "speed_over_ground", "forward_speed_over_ground"}


def in_current(text: str, velocity=STREAM) -> RobotDescription:
    current = ", ".join(f"{x} m/s" for x in velocity)
    return parse_robot(text.replace("gravity: 9.81 m/s2", f"gravity: 9.81 m/s2, current: [{current}]"))


def same(still: CycleMeans, there: CycleMeans) -> None:
    """All that judges a swimmer is alike to 1e-8 of the largest number of its kind."""
    for name, values in still._asdict().items():
        if name not in OF_GROUND and np.size(values):
            size = 1e-8 * np.max(np.abs(np.nan_to_num(values)), initial=0.0)
            np.testing.assert_allclose(getattr(there, name), values, atol=size + 1e-12, rtol=0, err_msg=name)


@pytest.fixture(scope="module")
def cycles():
    return periodic(parse_robot(SWIMMER)), periodic(in_current(SWIMMER))


def test_a_cycle_in_a_stream_has_the_numbers_and_multipliers_of_still_water_and_is_found_as_quickly(cycles):
    still, there = cycles
    assert int(still.status) == int(there.status) == int(Status.SOLVED)
    assert int(there.stats["cycles"]) == int(still.stats["cycles"])
    np.testing.assert_allclose(there.multipliers, still.multipliers, atol=1e-9)
    same(still.means(), there.means())
    assert float(still.means().efficiency) > 0.01
    np.testing.assert_allclose(there.course()[:2], still.course()[:2], rtol=1e-8)
    assert still.course().radius < 10


def test_through_the_water_and_over_ground_are_two_numbers(cycles):
    still, there = cycles
    means = there.means()
    over_ground = np.asarray(still.means().velocity[0]) + STREAM
    np.testing.assert_allclose(means.water_velocity, STREAM, atol=1e-15)
    np.testing.assert_allclose(means.velocity[0], over_ground, atol=1e-9)
    assert float(means.speed_over_ground) == pytest.approx(np.linalg.norm(over_ground), abs=1e-3)  # it turns: a chord
    lines = str(there.summary())
    assert "forward speed through the water" in lines
    assert "speed over ground" in lines
    assert "over ground" not in str(still.summary())


def test_the_cycle_of_a_stream_is_the_motion_that_the_equations_in_the_stream_have(cycles):
    _, there = cycles
    last = jax.tree.map(lambda x: x[-1], there.value.state)
    run = simulate(in_current(SWIMMER), float(there.value.time[-1]), initial=there.state, rtol=1e-9, atol=1e-11)
    end = jax.tree.map(lambda x: x[-1], run.value.state)
    np.testing.assert_allclose(end.v, last.v, atol=2e-5)
    np.testing.assert_allclose(end.q, last.q, atol=2e-5)


def test_a_steady_swimmer_in_a_stream_goes_through_the_water_as_in_still_water():
    towed = SWIMMER.split("limbs:")[0].replace("{drag:", "{pull: {kind: force, force: [0.3 N, 0 N, 0 N]}, drag:")
    still, there = steady(parse_robot(towed)), steady(in_current(towed))
    assert int(still.status) == int(there.status)
    assert float(there.speed) == pytest.approx(np.sqrt(2 * 0.3 / (1000 * 6e-4)), rel=1e-8)
    np.testing.assert_allclose(there.velocity, still.velocity, atol=1e-10)
    np.testing.assert_allclose(there.eigenvalues, still.eigenvalues, atol=1e-8)


def test_a_fin_that_is_held_in_a_stream_is_judged_by_the_stream_but_carries_nothing():
    held = SWIMMER.replace("joint: {kind: planar, axis: z}", "joint: {kind: fixed}")
    robot = build(in_current(held, [-0.2, 0.0, 0.0]))
    assert not goes_along(robot)
    times = jnp.linspace(0.0, 0.5, 65)
    start = robot.initial()
    states = jax.tree.map(lambda x: jnp.broadcast_to(x, (65, *x.shape)), start)
    means = jax.jit(cycle_means)(robot, times, states)
    assert float(means.speed) == pytest.approx(0.2)
    assert float(means.forward_speed) == pytest.approx(0.2)
    assert float(means.speed_over_ground) == 0
    assert float(means.strouhal) == pytest.approx(2 * float(means.tail_amplitude) / (0.5 * 0.2))
    assert np.isnan(float(means.cost_of_transport))
    assert np.isnan(float(means.froude_efficiency))


def test_a_body_that_stands_in_a_stream_by_its_own_thrust_has_no_powers_over_ground():
    """0.08 N = rho A c^2/2 with A = 10 cm2 and c = 0.4 m/s: it does not move, and powers of rounding are 0."""
    text = SWIMMER.split("limbs:")[0].replace("6 cm2, 200 cm2, 0 m2", "10 cm2, 200 cm2, 0 m2")
    thrust = "kind: prismatic, axis: x, force: {kind: constant, value: -0.08 N}"
    robot = in_current(text.replace("kind: planar, axis: z", thrust), [0.4, 0.0, 0.0])
    for run in (steady(robot), simulate(robot, 30.0, samples=5)):
        said = run.summary()
        powers = next(table for table in said.tables if table.key == "power")
        assert [row[0].key for row in powers.rows] == ["sum"] and "over ground" in str(said)
        assert "misses" not in str(said) and "e-1" not in str(said).partition("at the samples")[0]


def test_what_is_towed_in_a_stream_has_the_numbers_of_its_speed_and_no_cost_of_a_power_over_ground():
    """Through the water 0.4 m/s, the rail by 0.1 m/s: all else is that of 0.4 m/s in still water."""
    rail = "kind: prismatic, axis: x, motion: {{kind: rate, rate: {} m/s}}"
    texts = [SWIMMER.replace("kind: planar, axis: z", rail.format(speed)) for speed in (0.4, 0.1)]
    robots = build(parse_robot(texts[0])), build(in_current(texts[1], [-0.3, 0.0, 0.0]))
    times = jnp.linspace(0.0, 0.5, 33)
    starts = [robot.initial() for robot in robots]
    each = [jax.tree.map(lambda x: jnp.broadcast_to(x, (33, *x.shape)), x) for x in starts]
    still, there = (jax.jit(cycle_means)(robot, times, x) for robot, x in zip(robots, each, strict=True))
    costs = ("efficiency", "froude_efficiency", "cost_of_transport", "energy_per_metre", "energy_per_metre_positive")
    for name in ("speed", "forward_speed", "strouhal", "stride_length", "tail_amplitude", "slip", "force", "reaction"):
        np.testing.assert_allclose(getattr(there, name), getattr(still, name), rtol=1e-8, atol=1e-12, err_msg=name)
    assert np.isfinite([getattr(still, name) for name in costs]).all()
    assert np.isnan([getattr(there, name) for name in costs]).all()
    rails = float(there.reaction_power[0]), float(there.reaction[0]) * 0.1
    assert rails[0] == pytest.approx(rails[1], rel=1e-9)


@pytest.mark.parametrize(
    "change",
    [
        ("kind: planar, axis: z", "kind: prismatic, axis: x"),  # a rail across the stream
        ("planar, axis: z", "prismatic, axis: y, stiffness: 3 N/m"),
    ],
)
def test_what_holds_a_robot_against_the_stream_keeps_it_from_going_along(change):
    assert not goes_along(build(in_current(SWIMMER.replace(*change))))


def shipped() -> list[str]:
    return [*file_names(), "beetle"]


def both(name: str):
    """A shipped robot in a stream along which it is free, and in still water; None of one that stands or is held."""
    robot = build(describe(name))
    root = robot.tree.one(0)
    if stands(robot) or robot.tree.structure[0].prescribed:
        return None
    velocity = jnp.array([0.11, -0.07, 0.0])
    if root.joint.nv == 1:
        velocity = 0.2 * root.rotation @ root.joint.axis
    water = replace(robot.water, current=UniformCurrent(velocity))
    return replace(robot, water=water), in_still_water(robot)


def check_means(there, still) -> None:
    rest, n = still.initial(), still.tree.free_v.size
    times = jnp.linspace(0.0, 0.6, 5)
    draws = 0.2 * jax.random.normal(jax.random.key(0), (2, 5, n))
    moved = [still.advance(rest.q, q, jnp.ones(())) for q in draws[0]]
    states = [State(q, rest.v + v, rest.z) for q, v in zip(moved, draws[1], strict=True)]
    states = jax.tree.map(lambda *x: jnp.stack(x), *states)
    means = jax.jit(cycle_means)
    same(means(still, times, states), means(there, times, with_stream(there, times, states)))


@pytest.mark.parametrize("name", ["fish", "eel"])
def test_a_shipped_swimmer_goes_along_with_a_stream(name):
    robot = both(name)[0]
    assert goes_along(robot)
    back = in_stream(robot, jnp.ones(()), in_stream(robot, jnp.ones(()), robot.initial()), -1.0)
    np.testing.assert_allclose(back.q, robot.initial().q, atol=1e-14)


def test_a_small_swimmer_is_judged_alike_in_any_state():
    check_means(build(in_current(SWIMMER)), build(parse_robot(SWIMMER)))


def test_given_forces_on_a_root_have_their_power_through_the_water():
    thrust = "kind: prismatic, axis: [-1, 0, 0], force: {kind: sine, amplitude: 2 N, offset: 0.5 N, frequency: 2 Hz}"
    pushed = SWIMMER.split("limbs:")[0].replace("kind: planar, axis: z", thrust)
    still, there = build(parse_robot(pushed)), build(in_current(pushed, [-0.2, 0.0, 0.0]))
    assert goes_along(there)
    check_means(there, still)


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_every_shipped_swimmer_has_the_same_numbers_in_a_stream(name):
    pair = both(name)
    if pair is None:
        pytest.skip("it stands on the ground, or is held")
    there, still = pair
    assert goes_along(there)
    check_means(there, still)


@pytest.mark.slow
def test_sweeps_and_designs_in_a_stream_are_those_of_still_water():
    robots = parse_robot(SWIMMER), in_current(SWIMMER)
    path = "limbs.fin.joint.motion.frequency"
    still, there = (sweep(robot, {path: "1.5Hz,2Hz"}) for robot in robots)
    for name in ("speed", "forward_speed", "efficiency", "cost_of_transport", "strouhal", "power"):
        np.testing.assert_allclose(there[name], still[name], rtol=1e-8, err_msg=name)
    assert (abs(there["speed_over_ground"] - there["speed"]) > 0.05).all()
    designs = (MotionDesign(robot, (read_variable(path, "1 Hz .. 2 Hz", robot),), "forward_speed") for robot in robots)
    found = [design.prepare()(np.array([0.5]), True, None) for design in designs]
    assert found[1].objective == pytest.approx(found[0].objective, rel=1e-8)
    np.testing.assert_allclose(found[1].gradient, found[0].gradient, rtol=1e-6)
