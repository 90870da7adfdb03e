"""Time integration against closed forms, and what a run promises: samples, status, resumption, batches."""

from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float
from scipy.linalg import expm
from scipy.special import ellipk

from nectosome.core import Constant, Load, State, Status, Strips, Water
from nectosome.description import RevoluteJoint, parse_robot
from nectosome.loads import Damper
from nectosome.mechanism import Attached, make_robot
from nectosome.model import bind, build
from nectosome.solve import simulate
from nectosome.solve.integrate import Settings, begin, integrate
from nectosome.solve.runge_kutta import explicit_step, implicit_step, newton_memory
from nectosome.units import InputError

G = 9.81
METHODS = ("explicit", "implicit")
TIGHT = {"rtol": 1e-10, "atol": 1e-12}


@eqx.filter_jit
def fixed_steps(robot, x, h, n, method):
    """n steps of size h."""
    step, memory = (explicit_step, None) if method == "explicit" else (implicit_step, newton_memory(x.v.size))
    allowed = jax.tree.map(lambda x: jnp.full_like(x, 1e-12), x)

    def one(k, carry):
        x, rate, memory = carry
        s = step(robot, k * h, h, x, rate, k > 0, memory, allowed)
        return s.x, s.rate, s.memory

    start = (x, x, jax.tree.map(jnp.asarray, memory))
    return jax.lax.fori_loop(0, n, one, start)[0]


@pytest.mark.parametrize(("method", "order"), [("explicit", 5), ("implicit", 4)])
def test_the_error_of_fixed_steps_falls_with_the_order_of_the_method(swinging, method, order):
    robot, at = swinging
    ends = []
    for n in (20, 40, 80, 2000):
        x = fixed_steps(robot, at(1.0), jnp.asarray(1.0 / n), jnp.asarray(n), method)
        ends.append(np.concatenate([x.q, x.v]))
    errors = [np.linalg.norm(end - ends[-1]) for end in ends[:-1]]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(orders > order - 0.25), (errors, orders)


def upright(t, x):
    return x.q[0] - jnp.pi / 2


@pytest.mark.parametrize("method", METHODS)
def test_a_pendulum_takes_the_time_of_the_elliptic_integral(swinging, method):
    """A quarter of T = 4 sqrt(I/(m g d)) K(sin^2(angle/2)), by the event at the lowest point."""
    robot, at = swinging
    angle, d = 2.0, 0.5
    inertia = (1.0**2 + 0.1**2) / 12 + d**2
    quarter = np.sqrt(inertia / (G * d)) * ellipk(np.sin(angle / 2) ** 2)
    run = simulate(robot, 2.0, samples=21, method=method, initial=at(angle), until=upright, **TIGHT)
    assert int(run.status) == Status.EVENT
    assert float(run.value.time[-1]) == pytest.approx(quarter, rel=2e-9)
    assert float(run.value.state.q[-1, 0]) == pytest.approx(np.pi / 2, abs=1e-9)


def reaches_two_metres_down(t, x):
    return x.q[0] + 2.0


def rises(t, x):
    return x.q[0] - 1.0


@pytest.mark.parametrize("method", METHODS)
def test_a_dropped_body_reaches_a_height_in_time(falling, method):
    run = simulate(falling, 1.0, samples=21, method=method, until=reaches_two_metres_down)
    assert int(run.status) == Status.EVENT
    assert float(run.value.time[-1]) == pytest.approx(np.sqrt(4 / G), abs=1e-10)
    t = np.asarray(run.value.time)
    np.testing.assert_allclose(t[:-1], 0.05 * np.arange(13), rtol=1e-15)  # the last step goes over several
    np.testing.assert_allclose(run.value.state.q[:, 0], -0.5 * G * t**2, atol=1e-10)
    np.testing.assert_allclose(run.value.state.v[:, 0], -G * t, atol=1e-10)


def test_an_event_that_never_happens_lets_the_run_end(falling):
    run = simulate(falling, 1.0, samples=21, method="explicit", until=rises)
    assert int(run.status) == Status.SOLVED
    assert run.value.time.shape == (21,)


def test_a_body_that_is_driven_all_over_is_simulated_too(pendulum):
    """Nothing is unknown: states without numbers, at all times."""
    motion = {"kind": "sine", "amplitude": "17 deg", "frequency": "1 Hz"}
    joint = RevoluteJoint.model_validate({"kind": "revolute", "axis": "y", "motion": motion})
    driven = pendulum.model_copy(update={"body": pendulum.body.model_copy(update={"joint": joint})})
    run = simulate(build(driven), 1.0, samples=41)
    assert int(run.status) == Status.SOLVED
    assert run.value.state.v.shape == (41, 0)
    crank = run.to_dataset()["position"].sel(axis="z").values[:, -1]
    np.testing.assert_allclose(crank[[0, 20, 40]], 0, atol=1e-9)


def test_states_are_kept_at_the_times_asked_for(falling):
    run = simulate(falling, 0.7, samples=21, method="explicit")
    t = np.linspace(0, 0.7, 21)
    np.testing.assert_array_equal(run.value.time, t)
    np.testing.assert_allclose(run.value.state.q[:, 0], -0.5 * G * t**2, atol=1e-12)


def test_a_run_can_be_cancelled(falling):
    shares = []

    def progress(share):
        shares.append(share)
        return share < 0.29

    run = simulate(falling, 1.0, samples=21, method="explicit", progress=progress)
    assert int(run.status) == Status.CANCELLED
    assert float(run.value.time[-1]) == pytest.approx(0.3)
    assert run.value.state.v.shape == (7, 1)
    np.testing.assert_allclose(shares, np.arange(1, 7) / 20)


def test_a_run_tells_its_progress_to_the_end(falling):
    shares = []
    simulate(falling, 1.0, samples=21, method="explicit", progress=shares.append)
    np.testing.assert_allclose(shares, np.arange(1, 21) / 20)


def test_a_run_of_many_samples_can_be_cancelled_every_twenty_of_them(falling):
    run = simulate(falling, 1.0, samples=2001, method="explicit", progress=lambda share: False)
    assert int(run.status) == Status.CANCELLED
    assert float(run.value.time[-1]) == pytest.approx(0.01)


def test_a_run_that_takes_too_many_steps_says_so(swinging):
    robot, at = swinging
    run = simulate(robot, 1.0, samples=21, method="explicit", initial=at(1.0), max_steps=20, **TIGHT)
    assert Status(int(run.status)) == Status.STEP_LIMIT
    assert int(run.stats["steps"]) == 20
    assert 1 < run.value.time.size < 21
    assert np.all(np.isfinite(run.value.state.q))


def test_a_state_that_is_not_finite_is_told_at_once(falling):
    x = falling.initial()
    run = simulate(falling, 1.0, samples=21, method="explicit", initial=State(x.q, x.v + jnp.nan, x.z))
    assert Status(int(run.status)) == Status.NOT_FINITE
    assert run.value.time.shape == (1,)


def test_a_run_that_blows_up_ends_with_a_reason_and_keeps_what_is_finite(slider):
    """v' = 1e3 v passes the largest number at 0.71 s."""
    run = simulate(
        slider(Attached("pump", 0, Damper(jnp.asarray(-2e3)))),
        1.0,
        samples=21,
        method="explicit",
        initial=State(jnp.zeros(1), jnp.ones(1), ()),
    )
    assert Status(int(run.status)) in (Status.STEP_TOO_SMALL, Status.NOT_FINITE)
    assert 0.6 < float(run.value.time[-1]) < 0.72
    assert np.all(np.isfinite(run.value.state.v))


@pytest.mark.parametrize(
    ("wrong", "word"), [({"time": 0.0}, "time"), ({"samples": 1}, "samples"), ({"rtol": 0.0}, "rtol")]
)
def test_settings_without_sense_are_refused(falling, wrong, word):
    with pytest.raises(InputError, match=word):
        simulate(falling, **{"time": 1.0, **wrong})


class Maxwell(Load):
    """A spring k and a dashpot c in series, from the world's plane z = 0; z is what the dashpot has given way."""

    stiffness: Float[Array, ""]
    damping: Float[Array, ""]

    def initial(self) -> Any:
        return jnp.zeros(())

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        pull = -self.stiffness * (strips.position[0, 2] - z)
        return jnp.zeros((strips.weight.shape[0], 6)).at[0, 5].set(pull), -pull / self.damping


@pytest.fixture(scope="module")
def maxwell():
    return Attached("maxwell", 0, Maxwell(jnp.asarray(50.0), jnp.asarray(20.0)))


@pytest.mark.parametrize("method", METHODS)
def test_a_mass_on_a_maxwell_element_moves_as_its_linear_equation_says(slider, maxwell, method):
    k, c, m = 50.0, 20.0, 2.0
    start = State(jnp.array([0.1]), jnp.array([0.3]), (jnp.zeros(1),))
    run = simulate(slider(maxwell), 1.0, samples=21, method=method, initial=start, **TIGHT)
    x = run.value.state
    A = np.array([[0, 1, 0], [-k / m, 0, k / m], [k / c, 0, -k / c]])
    wanted = np.array([expm(A * t) @ [0.1, 0.3, 0] for t in np.asarray(run.value.time)])
    np.testing.assert_allclose(np.column_stack([x.q, x.v, x.z[0]]), wanted, atol=1e-8)


@pytest.mark.parametrize("method", METHODS)
def test_a_held_maxwell_element_relaxes(slider, maxwell, method):
    """F = k x exp(-k t / c), on a joint whose motion is given: the load's state is the only unknown."""
    robot = slider(maxwell)
    part = replace(robot.tree.one(0), prescribed=Constant(jnp.asarray(0.1)))
    robot = make_robot([part], robot.loads, robot.water)
    run = simulate(robot, 1.0, samples=21, method=method, **TIGHT)
    t = np.asarray(run.value.time)
    np.testing.assert_allclose(0.1 - run.value.state.z[0][:, 0], 0.1 * np.exp(-50 / 20 * t), atol=2e-9)


def test_lengths_side_by_side_move_as_one_by_one(pendulum):
    """A batch of designs under vmap, each with steps of its own."""
    theta0, from_theta = bind(pendulum, ("body.length", "body.mass"))
    settings = Settings("explicit", jnp.asarray(1e-6), jnp.asarray(1e-9), jnp.asarray(1000))
    times = jnp.linspace(0.1, 1.0, 4)

    def swing(theta):
        robot = from_theta(theta)
        m = begin(jnp.zeros(()), robot.initial(), settings, jnp.asarray(1e-3))
        m, x = integrate(robot, m, times, settings)
        return x.q, x.v, m.status, m.steps

    thetas = theta0 * jnp.array([[1.0, 1.0], [0.05, 1.0], [1.0, 3.0], [10.0, 1.0]])
    together = jax.jit(jax.vmap(swing))(thetas)
    alone = [jax.jit(swing)(theta) for theta in thetas]
    for i, one in enumerate(alone):
        np.testing.assert_allclose(together[0][i], one[0], rtol=1e-10)
        np.testing.assert_allclose(together[1][i], one[1], rtol=1e-10, atol=1e-10)
        assert (int(together[2][i]), int(together[3][i])) == (int(one[2]), int(one[3]))
    np.testing.assert_allclose(together[0][0], together[0][2], rtol=1e-9)  # mass does not matter
    assert len(set(np.asarray(together[3]).tolist())) > 1


@pytest.mark.parametrize("method", METHODS)
def test_a_march_in_pieces_is_the_march_in_one_go(swinging, method):
    robot, at = swinging
    settings = Settings(method, jnp.asarray(1e-6), jnp.asarray(1e-9), jnp.asarray(1000))
    times = jnp.linspace(0.1, 1.0, 9)
    go = eqx.filter_jit(integrate)
    start = begin(jnp.zeros(()), at(1.0), settings, jnp.asarray(1e-3))
    m, whole = go(robot, start, times, settings)
    n, pieces = start, []
    for some in np.split(np.asarray(times), 3):
        n, x = go(robot, n, jnp.asarray(some), settings)
        pieces.append(x)
    np.testing.assert_array_equal(np.concatenate([x.q for x in pieces]), whole.q)
    np.testing.assert_array_equal(np.concatenate([x.v for x in pieces]), whole.v)
    assert int(m.steps) == int(n.steps)


def test_implicit_and_explicit_agree_on_a_soft_rod(drifter):
    ends = [simulate(drifter, 0.2, samples=3, method=method, rtol=1e-8, atol=1e-9).value.state for method in METHODS]
    for a, b in zip(jax.tree.leaves(ends[0]), jax.tree.leaves(ends[1]), strict=True):
        np.testing.assert_allclose(a, b, atol=2e-6)


TUMBLER = """
name: tumbler
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: box
  length: 0.3 m
  width: 0.2 m
  height: 0.1 m
  mass: 1 kg
  volume: 0 m3
  joint: {kind: free, start: {angular_velocity: [0.1 rad/s, 20 rad/s, 0.1 rad/s]}}
"""


def test_a_tumbling_body_keeps_its_energy_and_flips_in_time_by_the_method_that_is_taken():
    """About the middle axis w = sqrt((2 E I3 - L^2)/(I2 (I3 - I2))) sn(r t, k): a flip every 2 K(k)/r (Landau, 37)."""
    robot = build(parse_robot(TUMBLER))
    run = simulate(robot, 60.0, samples=6001)
    assert "jacobians" not in run.stats  # the explicit method
    w, inertia = np.asarray(run.value.state.v[:, :3]), np.diag(robot.inertia[0, :3, :3])
    energy, momentum = np.sum(inertia * w**2, axis=1) / 2, np.sum((inertia * w) ** 2, axis=1)
    assert np.ptp(energy) < 1e-4 * energy[0]
    one, two, three = inertia
    E, L2 = energy[0], momentum[0]
    if 2 * E * two > L2:
        one, three = three, one
    m = (two - one) * (2 * E * three - L2) / ((three - two) * (L2 - 2 * E * one))
    rate = np.sqrt((three - two) * (L2 - 2 * E * one) / (one * two * three))
    before = np.flatnonzero(np.diff(np.sign(w[:, 1])))
    flips = 0.01 * (before + w[before, 1] / (w[before, 1] - w[before + 1, 1]))
    expected = flips[0] + 2 * ellipk(m) / rate * np.arange(flips.size)
    assert flips.size > 40
    np.testing.assert_allclose(flips, expected, atol=0.02 * 2 * ellipk(m) / rate)


def test_soft_bodies_and_springs_take_the_implicit_method(drifter):
    assert not drifter.mild
    assert "jacobians" in simulate(drifter, 0.01, samples=3).stats
    hinge = "joint: {kind: revolute, axis: x, stiffness: 1 N m/rad}"
    free = next(line.strip() for line in TUMBLER.splitlines() if "kind: free" in line)
    assert not build(parse_robot(TUMBLER.replace(free, hinge))).mild
