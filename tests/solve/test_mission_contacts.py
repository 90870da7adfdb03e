"""Contacts in missions and samples: bounces and slides where closed forms put them, whatever the steps; derivatives."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.solve.test_contact_steps import BALL, G

from nectosome.core.rows import all_on_device
from nectosome.description import parse_robot
from nectosome.description.mission import parse_mission
from nectosome.solve import SampledPlant, run_mission, simulate
from nectosome.solve.integrate import Settings, begin, integrate
from nectosome.solve.mission import _system as ramped
from nectosome.solve.plant_batch import PlantBatch

DAMPED = parse_robot(BALL.replace("softness: 0.1 mm", "softness: 0.1 mm, damping: 5 N s/m"))
LIMIT = "body.joint.lower"
# it does not roll, since its inertia is large; 0.8 m/s along a bar 100 mm below it
PUCK = parse_robot("""
name: puck
water: {gravity: 9.81 m/s2, density: 0.001 kg/m3}
body:
  {kind: rigid, shape: spheroid, length: 20 mm, radius: 10 mm, mass: 0.4 kg, inertia: [9 kg m2, 9 kg m2, 9 kg m2],
   joint: {kind: planar, axis: [0, -1, 0], start: {position: [0 m, 0 m, 120 mm], velocity: [0.8 m/s, 0 m/s, 0 m/s]}}}
limbs:
  bar: {on: world, kind: rigid, shape: cylinder, radius: 10 mm, length: 2 m, mass: 1 kg, volume: 0 m3}
pairs:
  floor:
    {kind: contact, between: [body, bar], stiffness: 20 kN/m, damping: 30 N s/m, static_friction: 0.3,
     dynamic_friction: 0.3, creep: 10 mm/s}
""")


def flown(robot, *modes, **steps):
    return run_mission(parse_mission(f"modes: [{', '.join(modes)}]", robot), **steps)


@pytest.mark.parametrize("step", [1e-3, 1e-2, 0.1])
def test_an_undamped_ball_comes_to_its_height_again_whatever_the_steps(step):
    """0.2 m, ten times in 4 s; it falls for sqrt(2 h/g), and its contact lasts about pi sqrt(m/k)."""
    run = flown(parse_robot(BALL), "{name: fall, until: position.z < 0 m}", "{name: go, until: 4 s}", step=step)
    assert run.event_time("fall") == pytest.approx(np.sqrt(2 * 0.2 / G), abs=1e-8)
    z, v = run.measures.position[:, 2], run.measures.velocity[:, 2]
    energy = (0.4 * G * z + 0.2 * v**2)[z > 0]
    np.testing.assert_allclose(energy, 0.4 * G * 0.2, rtol=1e-4)
    touches = run.time[:-1][(z[:-1] >= 0) & (z[1:] < 0)]
    np.testing.assert_allclose(np.diff(touches), 2 * np.sqrt(2 * 0.2 / G) + np.pi * np.sqrt(0.4 / 5e4), atol=2e-4)
    assert touches.size == 10


def test_a_mission_that_changes_nothing_is_the_simulation_of_its_robot():
    run = flown(parse_robot(BALL), "{name: fall, until: position.z < 0 m}", "{name: go, until: 0.8 s}")
    same = simulate(parse_robot(BALL), float(run.time[-1]), samples=2, method="explicit", rtol=1e-8, atol=1e-10)
    assert run.measures.position[-1, 2] == pytest.approx(float(same.value.state.q[-1, 0]), abs=1e-6)


def test_a_puck_that_falls_slides_as_its_weight_brakes_it_and_stands():
    """While it slides, m dv/dt = -mu N and N = m (g + dw/dt): x = v t - mu (g t^2/2 + z - z_0), in bounces too."""
    run = flown(PUCK, "{name: fall, until: position.z < 20 mm}", "{name: slide, until: 0.8 s}", step=0.1)
    assert run.event_time("fall") == pytest.approx(np.sqrt(2 * 0.1 / G), abs=1e-8)
    t, (x, _, z) = run.time, run.measures.position.T
    slides = t < 0.9 * 0.8 / (0.3 * G)
    gone = 0.8 * t - 0.3 * (G * t**2 / 2 + z - z[0])
    np.testing.assert_allclose((x - x[0])[slides], gone[slides], atol=1e-6)
    assert np.abs(run.measures.velocity[-1]).max() < 1e-4


def test_the_end_of_a_mission_has_derivatives_through_bounces():
    """By a stiffness that is reached in 0.3 s and a damping, after three bounces, by the robot of a mission."""
    theta, until = np.array([4e4, 5.0]), (0.3, 1.0)

    mode = f"{{name: go, set: {{{LIMIT}.stiffness: 40 kN/m in 0.3 s, {LIMIT}.damping: 5 N s/m}}, until: 1 s}}"
    system, _ = ramped(parse_mission(f"modes: [{mode}]", DAMPED))
    ramps = system.ramps._replace(seconds=jnp.array([0.3, 0.0]))

    def end(theta):
        own = eqx.tree_at(lambda s: s.ramps, system, ramps._replace(end=theta))

        def go(start, stop):
            settings = Settings("explicit", *all_on_device(1e-6, 1e-8, 100_000), stop=stop)
            _, x = integrate(own, begin(start[0], start[1], settings, jnp.asarray(1e-3)), stop[None], settings)
            return (stop, jax.tree.map(lambda a: a[0], x)), None

        (_, x), _ = jax.lax.scan(go, (jnp.zeros(()), own.initial()), jnp.asarray(until))
        return x.q[0], x.q[0]

    both = jax.jit(jax.jacfwd(end, has_aux=True))
    slopes, _ = both(jnp.asarray(theta))
    for k, slope in enumerate(np.asarray(slopes)):
        change = 1e-3 * theta * np.eye(2)[k]
        more, less = (float(both(jnp.asarray(theta + sign * change))[1]) for sign in (1, -1))
        assert slope == pytest.approx((more - less) / (2 * change[k]), rel=1e-3)


def test_a_ball_in_short_samples_comes_to_its_height_again():
    """500 samples of 4 ms, most of them in free fall or within the contact: m g 0.2 m, alone and among copies."""
    push = "  loads: {push: {kind: force, force: [0 N, 0 N, 0 N]}}\n  joint:\n"
    robot = parse_robot(BALL.replace("  joint:\n", push))
    plant = SampledPlant(robot, "body.loads.push.force.2", "body.position.z", 4e-3)
    (state, _), energies, z = plant.start(), [], 0.0
    copies = PlantBatch(plant)
    batch = copies.start(np.zeros((2, 0)))
    for _ in range(500):
        state, _, _ = plant.hold(state, 0.0)
        batch, _ = copies.hold(batch, np.zeros((2, 1)))
        z, v = float(state.state.q[0]), float(state.state.v[0])
        energies += [0.4 * G * z + 0.2 * v**2] if z > 0 else []
    np.testing.assert_allclose(energies, 0.4 * G * 0.2, rtol=3e-5)
    np.testing.assert_allclose(batch.moving.state.q[:, 0], z, atol=1e-6)
