"""Limbs that all do the same: one of them and its share of the body against the whole robot; what breaks the symmetry.

The closed form is the whole robot, whose equations hold for any state.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome import robots
from nectosome.core import State, Status
from nectosome.description import parse_robot, with_values
from nectosome.model import build
from nectosome.solve import periodic, simulate
from nectosome.solve.equal_limbs import copies_of, one_limb
from nectosome.solve.integrate import fixed_step

BELL = """
name: bell
water: {density: 1000 kg/m3}
batteries: {cell: {voltage: 7.4 V, resistance: 1 ohm, idle_power: 2 W}}
body:
  kind: rigid
  shape: cylinder
  length: 40 mm
  radius: 40 mm
  density: 1000 kg/m3
  joint:
    kind: free
    start: {position: [0.1 m, 0.2 m, -1 m], orientation: [10 deg, -50 deg, 20 deg], velocity: [0.02 m/s, 0 m/s, 0 m/s]}
  loads:
    drag: {kind: lumped_drag, drag_area: [25 cm2, 35 cm2, 35 cm2]}
    water: {kind: given_added_mass, mass: [0.08 kg, 0.1 kg, 0.1 kg]}
limbs:
  nozzle: {on: body, at: tip, kind: rigid, shape: spheroid, length: 20 mm, radius: 5 mm, density: 1000 kg/m3}
  arm:
    on: body
    at: root
    offset: [10 mm, 0 mm, 38 mm]
    rotation: [0 deg, -120 deg, 0 deg]
    repeat: {count: COUNT, around: x}
    kind: rod
    section: rectangle
    length: 80 mm
    width: 25 mm
    height: 4 mm
    young: 0.4 MPa
    damping: 1 kPa s
    density: 1000 kg/m3
    strains: {bending_y: 0}
    points: 4
    joint:
      kind: revolute
      axis: y
      motion: {kind: stroke, amplitude: 25 deg, frequency: 1 Hz, forward_share: 0.4}
      servo: {model: HS-5646WP, battery: cell, full_voltage_at: 10 deg, inertia: 2e-5 kg m2}
    loads:
      drag: {kind: drag, normal: 1.8, tangential: 0.02}
      water: {kind: added_mass, normal: 1}
  tip:
    on: arm
    at: tip
    kind: rigid
    shape: box
    length: 30 mm
    width: 20 mm
    height: 2 mm
    density: 1000 kg/m3
    joint: {kind: revolute, axis: y, stiffness: 0.01 N m/rad, damping: 1e-5 N m s/rad}
    loads: {drag: {kind: plate_drag, normal: 1, start_up: none}}
"""
# a hub on a rail with rigid flaps on springs, pushed to and fro
PADDLES = """
name: paddles
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: cylinder
  length: 100 mm
  radius: 20 mm
  density: 1000 kg/m3
  joint: {kind: prismatic, axis: x}
  loads: {drag: {kind: lumped_drag, drag_area: [3e-4 m2, 0 m2, 0 m2]}}
limbs:
  flap:
    on: body
    offset: [0 mm, 20 mm, 0 mm]
    rotation: [0 deg, 0 deg, 130 deg]
    repeat: {count: 3, around: x}
    kind: rigid
    shape: box
    length: 100 mm
    width: 2 mm
    height: 60 mm
    density: 2000 kg/m3
    strips: 4
    joint:
      kind: revolute
      axis: z
      stiffness: 0.05 N m/rad
      damping: 1e-3 N m s/rad
      torque: {kind: sine, amplitude: 0.02 N m, frequency: 2 Hz, offset: 0.01 N m}
    loads:
      drag: {kind: plate_drag, normal: 1, start_up: none}
      water: {kind: given_added_mass, mass: [0 kg, 30 g, 0 kg]}
"""


def bell(count=3):
    return parse_robot(BELL.replace("COUNT", str(count)))


def of(description):
    robot = build(description)
    return one_limb(robot, robot.initial())


@pytest.fixture(scope="module")
def paddles():
    return build(parse_robot(PADDLES))


def test_a_run_of_one_limb_is_that_of_the_whole_robot(paddles):
    """Coordinates and velocities to the tolerance of the steps; all results are of the whole robot's states."""
    options = {"samples": [0.0, 0.04, 0.1], "rtol": 1e-10, "atol": 1e-13}
    own, whole = (simulate(paddles, 0.1, whole=whole, **options) for whole in (False, True))
    assert own.value.system is paddles
    assert int(own.stats["equal_limbs"]) == 3
    assert own.reason.startswith("solved, by one of 3 equal limbs: disturbances that differ between limbs")
    assert "equal_limbs" not in whole.stats
    assert whole.reason == "solved"
    for a, b in ((own.value.state.q, whole.value.state.q), (own.value.state.v, whole.value.state.v)):
        assert np.abs(b).max() > 1e-3
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-8 * np.abs(b).max())


WEBBED = (
    PADDLES.replace("height: 60 mm", "height: 20 mm")
    + """
webs:
  bell:
    between: flap
    thickness: 1 mm
    young: 20 kPa
    density: 1100 kg/m3
    loads:
      drag: {kind: plate_drag, normal: 1.2, start_up: {}}
      water: {kind: sheet_added_mass, normal: 0.5}
      jet: {kind: bell_jet}
"""
)


def webbed(order="[flap1, flap2, flap3]"):
    robot = build(parse_robot(WEBBED.replace("between: flap", f"between: {order}\n    closed: true")))
    return robot, one_limb(robot, robot.initial())


@pytest.mark.parametrize("order", ["[flap1, flap2, flap3]", "[flap2, flap1, flap3]"])
def test_a_ring_with_a_web_is_solved_by_one_gap(order):
    """Either way around: residuals are those of the whole in random states, or there were none; states of all gaps."""
    _, limb = webbed(order)
    assert limb is not None
    assert limb.robot.tree.names == ("body", "flap1", "bell")
    numbers, r = jax.tree.flatten(limb.start), np.random.default_rng(0)
    x = jax.tree.unflatten(numbers[1], [jnp.asarray(r.normal(size=np.shape(leaf))) for leaf in numbers[0]])
    back = limb.own_state(limb.whole_state(x))
    for a, b in zip(jax.tree.leaves(back), jax.tree.leaves(x), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-13)
    sizes = [sum(leaf.size for leaf in jax.tree.leaves(one.z)) for one in (limb.whole_state(x), x)]
    assert sizes[0] == 3 * sizes[1] > 0


@pytest.mark.slow
def test_a_ring_with_a_web_takes_the_steps_of_one_gap():
    """Web, jet and start-ups, which an implicit step solves for: steps of one length agree to rounding."""
    robot, limb = webbed()
    assert limb is not None
    ends = []
    for system, x in ((robot, robot.initial()), (limb.robot, limb.start)):
        run = jax.jit(lambda x, system=system: fixed_step(system, jnp.zeros(()), x, jnp.asarray(1e-3), 50)[0])
        ends.append(run(x))
    assert np.abs(ends[0].v[0]) > 1e-3
    for a, b in zip(jax.tree.leaves(limb.whole_state(ends[1])), jax.tree.leaves(ends[0]), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-10 * max(np.abs(b).max(), 1e-6))


def test_an_open_web_and_one_that_leaves_a_limb_out_are_solved_whole():
    assert (
        of(
            parse_robot(
                WEBBED.replace("between: flap", "between: [flap1, flap2, flap3]").replace("jet: {kind: bell_jet}", "")
            )
        )
        is None
    )
    four = WEBBED.replace("count: 3", "count: 4").replace(
        "between: flap", "between: [flap1, flap2, flap3]\n    closed: true"
    )
    assert of(parse_robot(four)) is None


def test_a_cycle_of_one_limb_is_one_of_the_whole_robot(paddles):
    """The whole robot returns to where the cycle begins but for its place; multipliers are of what is alike in all."""
    found = periodic(paddles, rtol=1e-8, atol=1e-10)
    assert found.status == Status.SOLVED
    assert int(found.stats["equal_limbs"]) == 3
    assert found.multipliers.size == 3  # of the hub's speed, a flap's angle and its speed
    run = simulate(paddles, 0.5, initial=found.state, whole=True, samples=[0.0, 0.5], rtol=1e-10, atol=1e-13)
    x, end = found.value.state, run.value.state
    np.testing.assert_allclose(end.q[1, 1:], x.q[0, 1:], rtol=0, atol=1e-6)
    np.testing.assert_allclose(end.v[1], x.v[0], rtol=0, atol=1e-6 * np.abs(np.asarray(x.v)).max())
    np.testing.assert_allclose(x.q[-1], end.q[1], rtol=0, atol=1e-6 * np.abs(np.asarray(x.q)).max())
    assert abs(float(end.q[1, 0] - end.q[0, 0])) > 1e-3  # it swims


@pytest.mark.slow
@pytest.mark.parametrize("count", [3, 8])
def test_a_cycle_of_one_limb_is_that_of_the_search_by_the_whole_robot(count):
    """Speed, powers and forces of the cycle, to the tolerance of the steps; its multipliers are among those of all."""
    robot = build(parse_robot(PADDLES.replace("count: 3", f"count: {count}")))
    own, whole = (periodic(robot, rtol=1e-10, atol=1e-12, whole=whole) for whole in (False, True))
    found, expected = own.mean_results().arrays, whole.mean_results().arrays
    for name in ("speed", "power", "load_power", "load_force", "energy"):
        np.testing.assert_allclose(found[name], expected[name], rtol=0, atol=1e-8 * np.abs(expected[name]).max())
    assert all(np.abs(whole.multipliers - one).min() < 1e-5 for one in own.multipliers)


@pytest.mark.slow
@pytest.mark.parametrize("count", [3, 8])
def test_one_limb_and_its_share_take_the_steps_of_the_whole_robot(count):
    """Steps of one length: velocities, coordinates and states of motors on one battery agree to rounding."""
    robot = build(bell(count))
    limb = one_limb(robot, robot.initial())
    assert limb is not None
    assert limb.count == count
    assert limb.robot.tree.names == ("body", "nozzle", "arm1", "tip1")
    ends = []
    for system, x in ((robot, robot.initial()), (limb.robot, limb.start)):
        run = jax.jit(lambda x, system=system: fixed_step(system, jnp.zeros(()), x, jnp.asarray(1e-5), 50)[0])
        ends.append(run(x))
    whole, own = ends
    assert abs(float(whole.v[3]) - 0.02) > 1e-7  # it does change
    again = jax.tree.map(lambda x: x[0], limb.whole_states(jax.tree.map(lambda x: x[None], own)))
    for a, b in zip(jax.tree.leaves(again), jax.tree.leaves(whole), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-10 * max(np.abs(b).max(), 1e-6))


def test_a_run_goes_on_whole_from_a_state_that_is_not_alike(paddles):
    x = paddles.initial()
    assert one_limb(paddles, x) is not None
    assert one_limb(paddles, State(x.q.at[1].add(1e-6), x.v, x.z)) is None
    assert one_limb(paddles.with_load("body", paddles.loads[0].load, "more"), x) is None  # it has no description


FREE = PADDLES.replace("{kind: prismatic, axis: x}", "{kind: free}").replace("gravity: 0 m/s2", "density: 1000 kg/m3")
BROKEN = {
    "a drive that is ahead by a thousandth of a radian": {"limbs.flap2.joint.torque.phase": 1e-3},
    "a limb on a spring that is stiffer by a thousandth": {"limbs.flap3.joint.stiffness": 0.05005},
    "a limb that sits a micrometre further out": {"limbs.flap1.offset.1": 20.001e-3},
    "mass off the axis by a hundredth of a millimetre": {"body.centre_of_mass.1": 1e-5},
}


def free(*changes, **values):
    text = FREE
    for before, after in changes:
        assert before in text
        text = text.replace(before, after, 1)
    return of(with_values(parse_robot(text), values))


def test_a_body_that_is_free_and_flaps_as_heavy_as_water_go_along_the_axis_alone():
    limb = free(("2000 kg/m3", "1000 kg/m3"))
    assert limb is not None
    assert limb.robot.coordinate_names == ("body.position", "flap1.angle")


@pytest.mark.parametrize("what", BROKEN)
def test_robots_that_are_nearly_symmetric_are_solved_whole(what):
    assert free(("2000 kg/m3", "1000 kg/m3"), **BROKEN[what]) is None


def test_what_pushes_across_the_axis_is_seen():
    """Weight, a stream, a surface; drives that make the body turn, or run from limb to limb."""
    light = "2000 kg/m3", "1000 kg/m3"
    assert free() is None  # flaps that sink, while the axis lies level
    assert free(("{kind: free}", "{kind: free, start: {orientation: [0 deg, 90 deg, 0 deg]}}")) is not None
    assert free(light, ("1000 kg/m3}", "1000 kg/m3, current: [0 m/s, 1 mm/s, 0 m/s]}")) is None
    assert free(light, ("1000 kg/m3}", "1000 kg/m3, surface: 5 m}")) is None
    assert free(light, ("[0 deg, 0 deg, 130 deg]", "[20 deg, 0 deg, 130 deg]")) is None
    assert free(light, ("around: x}", "around: x, phase: 1 deg}")) is None


@pytest.mark.parametrize(("name", "count"), [("octopus", 8), ("jelly", 4)])
def test_shipped_robots_with_equal_limbs(name, count):
    limb = of(robots.describe(name))
    assert limb is not None
    assert limb.count == count


@pytest.mark.parametrize("name", ["flagella4", "turtle", "krill", "manta", "tuna"])
def test_shipped_robots_without(name):
    """Every other flagellum turns the other way; legs of a krill go one after the other; pairs are mirror images."""
    assert copies_of(robots.describe(name)) is None
