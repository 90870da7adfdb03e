"""A start from rest: momentum of what is free stays what it was, in water too, and drives put in the energy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import Constant
from nectosome.description import parse_robot
from nectosome.mechanism import from_rest
from nectosome.mechanism.diagnose import energies
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import simulate

ARM = """
name: arm on a float
water: {gravity: 0 m/s2}
body: {kind: rigid, shape: point, mass: 1 kg, inertia: [0.01 kg m2, 0.01 kg m2, 0.01 kg m2], volume: 0 m3, JOINT}
limbs:
  arm:
    on: body
    kind: rigid
    shape: point
    mass: 0.5 kg
    inertia: [1e-3 kg m2, 1e-3 kg m2, 1e-3 kg m2]
    centre_of_mass: [0.2 m, 0 m, 0 m]
    volume: 0 m3
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 30 deg, frequency: 1 Hz}}
"""
PLANAR = ARM.replace("JOINT", "joint: {kind: planar, axis: z}")
CARRIED = ARM.replace(
    "JOINT",
    "joint: {kind: free}, loads: {water: {kind: given_added_mass, mass: [1 kg, 3 kg, 2 kg], "
    "inertia: [0.01 kg m2, 0.02 kg m2, 0.03 kg m2]}}",
)
TOWED = """
name: bob under a carriage
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: point
  mass: 3 kg
  volume: 0 m3
  joint: {kind: prismatic, axis: x, motion: {kind: rate, rate: 0.7 m/s}}
limbs:
  bob:
    on: body
    kind: rigid
    shape: point
    mass: 2 kg
    centre_of_mass: [0 m, 0 m, -0.4 m]
    volume: 0 m3
    joint: {kind: revolute, axis: y}
"""


def start(text):
    robot = build(parse_robot(text))
    return robot, jax.jit(from_rest)(robot, jnp.zeros(()), robot.initial())


def test_a_free_body_and_its_arm_keep_their_momentum_and_their_centre():
    """Two masses drift neither at the start nor later; before, 0.1645 kg m/s came out of nothing."""
    run = simulate(parse_robot(PLANAR), 2.0, samples=41, rtol=3e-14, atol=3e-16)
    data = run.to_dataset()
    for kept in ("momentum", "angular_momentum"):
        np.testing.assert_allclose(data[kept], 0.0, atol=1e-12)
    angle = 0.5 * np.pi / 3 * np.sin(2 * np.pi * data["time"].values)
    turned = np.arctan2(data["rotation"].values[:, 0, 1, 0], data["rotation"].values[:, 0, 0, 0])
    bob = data["position"].sel(station=0).values + 0.2 * np.stack(
        [np.cos(turned + angle), np.sin(turned + angle), 0 * angle], axis=1
    )
    centre = (data["position"].sel(station=0).values + 0.5 * bob) / 1.5
    np.testing.assert_allclose(centre, np.broadcast_to([0.2 / 3, 0, 0], centre.shape), atol=1e-12)
    assert np.ptp(turned) > 0.3
    assert float(data["impulse_energy"]) == pytest.approx(float(data["energy"].sum("form")[0]), rel=1e-12)


def test_the_carried_water_keeps_the_momentum_too():
    """In a free space of water, what the body gains the arm and the water lose."""
    data = simulate(parse_robot(CARRIED), 0.5, samples=11, rtol=1e-11, atol=1e-13).to_dataset()
    total = data["momentum"] + data["water_momentum"]
    np.testing.assert_allclose(total[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(total, 0.0, atol=1e-9)  # of the steps
    assert float(np.abs(data["water_momentum"]).max()) > 1e-2


def test_a_bob_stays_where_it_is_when_its_carriage_starts():
    """A point mass on a hinge feels no force along its path: omega = U/l; the drive moves the carriage alone."""
    _, begun = start(TOWED)
    np.testing.assert_allclose(begun.state.v, [0.7 / 0.4], rtol=1e-12)
    np.testing.assert_allclose(begun.impulse, [3 * 0.7], rtol=1e-12)
    assert float(begun.energy) == pytest.approx(0.5 * 3 * 0.7**2, rel=1e-12)


def still(robot):
    """The robot with all prescribed coordinates at rest where they start."""
    tree, t = robot.tree, jnp.zeros(())
    rest = lambda signals: tuple(  # noqa: E731
        type(g)(g.members, Constant(g.map(lambda signal: signal(t)[0]))) for g in signals
    )
    held = type(tree)(**{**vars(tree), "motions": rest(tree.motions), "strains": rest(tree.strains)})
    return type(robot)(**{**vars(robot), "tree": held})


@pytest.mark.parametrize("name", ["zoo", "propeller", "wave"])
def test_the_momentum_along_what_is_free_stays_what_it_was(name, zoo, propelled):
    """dT/dv of the free velocities, by differentiation of the kinetic energy; the energy of the impulse is dT."""
    robot = {"zoo": lambda: zoo, "propeller": lambda: propelled, "wave": lambda: build(describe("catshark"))}[name]()
    t, x = jnp.zeros(()), robot.initial()

    @jax.jit
    def compare(robot, held):
        begun = from_rest(robot, t, x)
        energy = lambda robot, v: jnp.sum(energies(robot, t, type(x)(x.q, v, x.z))[:, :2])  # noqa: E731
        before, after = (jax.value_and_grad(energy, argnums=1)(r, v) for r, v in ((held, x.v), (robot, begun.state.v)))
        return before, after, begun

    (e0, p0), (e1, p1), begun = compare(robot, still(robot))
    np.testing.assert_allclose(p1, p0, atol=1e-11 * float(jnp.max(jnp.abs(begun.impulse))))
    assert float(jnp.max(jnp.abs(begun.state.v - x.v))) > 1e-3
    if robot.water.current is None:
        assert float(begun.energy) == pytest.approx(float(e1 - e0), rel=1e-9)


def test_a_ramp_starts_without_an_impulse():
    robot, begun = start(PLANAR.replace("frequency: 1 Hz", "frequency: 1 Hz, ramp: 0.5 s"))
    assert float(begun.energy) == float(jnp.max(jnp.abs(begun.impulse))) == 0.0
    np.testing.assert_array_equal(begun.state.v, robot.initial().v)


def test_a_run_that_goes_on_has_no_impulse():
    robot = build(parse_robot(PLANAR))
    run = simulate(robot, 0.1, samples=3, initial=robot.initial())
    assert run.start is None and "impulse" not in run.to_dataset()
