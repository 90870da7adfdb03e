"""A pulsed jet: what flows out comes in, momentum and energy of body, chamber, jet and crank close."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State
from nectosome.description import drive_period, parse_robot
from nectosome.mechanism import diagnose, in_plane, load_names, moves_in_plane
from nectosome.model import bind, build
from nectosome.solve import simulate
from nectosome.units import InputError

RHO, OMEGA, NOZZLE, INLET, BELL, MEAN, SWING = 1000.0, 11.0, 12e-4, 9e-4, 0.8, 300e-6, 60e-6
VOLUMES = MEAN + SWING * np.cos(2 * np.pi * np.arange(24) / 24)
CRANK = f"crank: {{kind: rate, rate: {OMEGA} rad/s}}"
LINE = "stall_torque: 0.1 N m, no_load_speed: 15 rad/s, stall_current: 2 A"
MOTOR = f"motor: {{{LINE}, inertia: 2e-3 kg m2, speed: 14 rad/s}}"
WATER = "drag_area: [5e-3 m2, 1e-2 m2, 1e-2 m2], rotational: [1e-4 kg m2, 1e-3 kg m2, 1e-3 kg m2]"
OPENINGS = "nozzle: 12 cm2, inlet: 9 cm2, bell: 0.8, elastance: 2 kPa/L"
JET = """
name: jet
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  shape: spheroid
  length: 0.2 m
  radius: 40 mm
  mass: 0.8 kg
  joint: {joint}
  loads:
    drag: {{kind: lumped_drag, {drag}}}
    water: {{kind: spheroid_added_mass}}
    jet: {{kind: jet, volume: [{volumes}], {openings}, {crank}, {more}}}
"""
SURGE, HELD = "{kind: prismatic, axis: x}", "{kind: prismatic, axis: x, motion: {kind: constant, value: 0 m}}"
ASKEW = "direction: [3, 1, -2], place: [10 mm, 20 mm, -5 mm]"


def described(joint=SURGE, crank=CRANK, more="direction: x"):
    volumes = ", ".join(f"{1e6 * v!r} mL" for v in VOLUMES.tolist())
    own = {"joint": joint, "volumes": volumes, "crank": crank, "more": more}
    return parse_robot(JET.format(drag=WATER, openings=OPENINGS, **own))


def jet_of(robot):
    return next(a.load for a in robot.loads if a.name == "jet")


def pulses(robot, time, z, along):
    one = lambda t, z, v: jet_of(robot).pulse(t, z, v, robot.water)  # noqa: E731
    return jax.jit(jax.vmap(one))(time, z, along)


@pytest.fixture(scope="module")
def surging():
    return build(described())


@pytest.fixture(scope="module")
def free():
    return build(described("{kind: free}", MOTOR, ASKEW))


def test_what_flows_out_in_a_turn_comes_in(surging):
    """Q = a omega sin(phi): 2 a are expelled, p = rho/2 (Q/A)^2 and thrust rho Q^2/A with the area of each way."""
    time = jnp.linspace(0, 2 * np.pi / OMEGA, 721)[:-1]
    now = pulses(surging, time, (), jnp.zeros_like(time))
    Q, step = np.asarray(now.outflow), time[1]
    np.testing.assert_allclose(Q, SWING * OMEGA * np.sin(now.angle), atol=2e-4 * SWING * OMEGA)
    assert np.sum(Q) * step == pytest.approx(0, abs=1e-12 * SWING)
    assert np.sum(np.maximum(Q, 0)) * step == pytest.approx(2 * SWING, rel=1e-4)
    area = np.where(Q > 0, NOZZLE, INLET)
    np.testing.assert_allclose(now.thrust, RHO * Q * np.abs(Q) / area, atol=1e-12)
    np.testing.assert_allclose(now.pressure * 2 * area, now.thrust, atol=1e-12)
    np.testing.assert_allclose(now.power, now.pressure * Q, atol=1e-12)


def test_a_held_robot_feels_the_momentum_of_its_jet():
    """Impulse of a turn: rho pi a^2 omega/2 (1/A_n - 1/A_i), whatever the bell carries along."""
    robot, time = build(described(HELD)), jnp.arange(720) / 720 * 2 * np.pi / OMEGA
    x = robot.initial()
    held = jax.jit(jax.vmap(lambda t: robot.forces(t, x, jnp.zeros(0)).residual[0]))(time)
    impulse = -float(jnp.sum(held)) * time[1]
    assert impulse == pytest.approx(RHO * np.pi * SWING**2 * OMEGA / 2 * (1 / NOZZLE - 1 / INLET), rel=1e-3)


def test_momentum_of_body_chamber_and_jet_is_kept():
    """(M + m + rho (1 + C) V) v gains what drag and the flow through the openings give, on any stretch of a swim."""
    surging = build(described(more="direction: x, wake: 0.4"))
    run = simulate(surging, 1.0, samples=2001, rtol=1e-9, atol=1e-12)
    v = np.asarray(run.value.state.v[:, 0])
    now = pulses(surging, run.value.time, (), jnp.asarray(v))
    given = np.asarray(
        now.thrust - RHO * now.outflow * jnp.where(now.outflow > 0, 1.0, 0.4) * v
    ) - 0.5 * RHO * 5e-3 * v * np.abs(v)
    mass = 0.8 + float(surging.added[0, 3, 3]) + RHO * (1 + BELL) * np.asarray(now.volume)
    h = run.value.time[1]
    gained = np.cumsum((given[1:] + given[:-1]) / 2) * h
    np.testing.assert_allclose(mass[1:] * v[1:] - mass[0] * v[0], gained, atol=1e-6)
    assert np.ptp(mass * v) > 0.01


def test_the_shell_gives_what_jet_body_and_water_get(free):
    """On any motion: its power is that of jet and change of shape on the body, and rho |Q| |v - u d|^2 / 2."""
    x, jet, rng = free.initial(), jet_of(free), np.random.default_rng(3)
    mine = np.array([load_names(free).index(name) for name in ("jet", "shape_change")])

    @jax.jit
    def one(v, z):
        state = State(
            x.q,
            v,
            free.states_by_group({i: z if free.loads[i].name == "jet" else () for i in free.states_by_load(x.z)}),
        )
        found = diagnose(free, jnp.zeros(()), state)
        place = v[3:] + jnp.cross(v[:3], 0.1 * jnp.array([1.0, 0, 0]) + jet.place)
        now = jet.pulse(jnp.zeros(()), z, jet.direction @ place, free.water)
        lost = 0.5 * RHO * jnp.abs(now.outflow) * jnp.sum((place - now.jet_speed * jet.direction) ** 2)
        stored = jet.elastance * (jnp.max(jet.volume) - now.volume) * now.outflow
        into = jnp.sum(found.load_power[mine])
        return now.torque * now.speed - stored, into + lost, found.energy_rate, jnp.sum(found.load_power)

    for _ in range(8):
        given, taken, rate, power = map(
            float, one(jnp.asarray(rng.normal(size=6)), jnp.asarray(rng.normal(size=2) * [3, 10]))
        )
        assert taken == pytest.approx(given, rel=1e-12)
        assert rate == pytest.approx(power, rel=1e-11)


def test_with_a_motor_speed_falls_while_it_pulls_and_energy_closes(free):
    """d/dt (I omega^2/2 + E (V_max - V)^2/2) = T omega - power on the water, over two seconds of a free swim."""
    run = simulate(free, 2.0, samples=2001, rtol=1e-9, atol=1e-12)
    jet, state = jet_of(free), run.value.state
    z = next(z for i, z in jax.vmap(free.states_by_load)(state.z).items() if free.loads[i].name == "jet")
    speed = np.asarray(z)[:, 1]
    still = pulses(free, run.value.time, z, jnp.zeros_like(run.value.time))
    pulled = np.asarray(still.torque)
    assert np.corrcoef(pulled[1000:], np.gradient(speed)[1000:])[0, 1] < -0.9
    current = np.asarray(jet.crank.current(jnp.asarray(speed)))
    assert current.max() > 1.5 * current.min() > 0
    stored = 0.5 * 2e-3 * speed**2 + 0.5 * 2e6 * (np.max(VOLUMES) - np.asarray(still.volume)) ** 2
    place = np.asarray(state.v)[:, 3:] + np.cross(np.asarray(state.v)[:, :3], np.array([0.1, 0, 0]) + jet.place)
    stream = 0.5 * BELL * RHO * (place @ np.asarray(jet.direction)) ** 2 * np.asarray(still.outflow)
    net = np.asarray(jet.crank.torque(jnp.asarray(speed))) * speed - np.asarray(still.power) - stream
    gained = np.cumsum((net[1:] + net[:-1]) / 2) * 1e-3
    np.testing.assert_allclose(stored[1:] - stored[0], gained, atol=1e-4 * np.ptp(stored))


def test_slopes_of_a_swim_by_numbers_of_the_jet():
    """Forward derivatives through the time steps against differences."""
    names = ("body.loads.jet.volume.6", "body.loads.jet.nozzle", "body.loads.jet.bell", "body.loads.jet.crank.rate")
    theta, to_robot = bind(described(), names)

    @jax.jit
    def rates(theta):
        robot = to_robot(theta)
        x = robot.initial()
        ends = jax.vmap(lambda t: robot.rates(t, State(x.q, x.v + 0.2, x.z)).v)(jnp.array([0.1, 0.2, 0.4]))
        return ends[:, 0]

    step = 1e-4 * theta
    ends = [jax.vmap(rates)(theta + s * jnp.diag(step)) for s in (1, -1)]
    np.testing.assert_allclose(jax.jacfwd(rates)(theta), ((ends[0] - ends[1]) / (2 * step[:, None])).T, rtol=2e-6)


@pytest.mark.parametrize("crank", [CRANK, MOTOR])
def test_in_the_plane_it_drives_as_in_space(crank):
    """A jet that pushes aside of the centre, on a body that turns as it swims: the same rates."""
    joint = "{kind: planar, axis: z, start: {angle: 0.4 rad}}"
    robot = build(described(joint=joint, crank=crank, more="direction: [3, 1, 0], place: [10 mm, 20 mm, 0 mm]"))
    assert moves_in_plane(robot)
    x = robot.initial()
    x = State(x.q, jnp.array([0.2, -0.1, 1.5]), x.z)
    space, plane = jax.jit(lambda r, t: (r.rates(t, x), in_plane(r).rates(t, x)))(robot, jnp.asarray(0.13))
    for one, other in zip(jax.tree.leaves(space), jax.tree.leaves(plane), strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-10, atol=1e-12)


def test_the_period_is_a_turn_of_the_crank():
    assert drive_period(described()) == pytest.approx(2 * np.pi / OMEGA)
    with pytest.raises(InputError, match="finds its own speed") as raised:
        drive_period(described(crank=MOTOR))
    assert raised.value.field == "body.loads.jet.motor"


@pytest.mark.parametrize(("crank", "why"), [(f"{CRANK}, {MOTOR}", "one of the two out"), ("bell: 1", "how the crank")])
def test_a_crank_is_turned_once(crank, why):
    with pytest.raises(InputError, match=why):
        described(crank=crank.replace("bell: 1", "place: [0 m, 0 m, 0 m]"))
