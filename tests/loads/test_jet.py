"""A pulsed jet: what flows out comes in, momentum and energy of body, chamber, jet and crank close."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

from nectosome.core import CrankState, Solution, State, Status
from nectosome.description import drive_period, parse_robot
from nectosome.mechanism import diagnose, in_plane, load_names, moves_in_plane
from nectosome.model import bind, build
from nectosome.solve import find_symmetry, periodic, simulate, static, with_crank
from nectosome.solve.orbit import Orbit, cycle_settings, orbit
from nectosome.solve.without_cycle import periods_agree
from nectosome.units import InputError

RHO, OMEGA, NOZZLE, INLET, BELL, MEAN, SWING = 1000.0, 11.0, 12e-4, 9e-4, 0.8, 300e-6, 60e-6
G = 9.80665
VOLUMES = MEAN + SWING * np.cos(2 * np.pi * np.arange(24) / 24)
CRANK = f"crank: {{kind: rate, rate: {OMEGA} rad/s}}"
T_STALL, OMEGA_0, I_STALL, INERTIA = 0.1, 15.0, 2.0, 2e-3
LINE = f"rated_voltage: {T_STALL * OMEGA_0 / I_STALL} V, stall_torque: {T_STALL} N m, no_load_speed: {OMEGA_0} rad/s"
MOTOR = f"{{{LINE}, stall_current: {I_STALL} A, inertia: {INERTIA} kg m2, voltage: VOLTAGE}}"
FULL = f"{{kind: constant, value: {T_STALL * OMEGA_0 / I_STALL} V}}"
TURNED = "turned_by: wheel"
WHEEL = """
limbs:
  wheel:
    kind: rigid
    shape: point
    mass: 0 kg
    volume: 0 m3
    joint: {kind: revolute, axis: z, velocity: 14 rad/s, motor: MOTOR}
"""
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


def described(joint=SURGE, crank=CRANK, more="direction: x", wheel=WHEEL, openings=OPENINGS, motor=MOTOR, parts=""):
    volumes = ", ".join(f"{1e6 * v!r} mL" for v in VOLUMES.tolist())
    own = {"joint": joint, "volumes": volumes, "crank": crank, "more": more}
    limbs = wheel.replace("MOTOR", motor).replace("VOLTAGE", FULL) + parts if crank == TURNED else ""
    return parse_robot(JET.format(drag=WATER, openings=openings, **own) + limbs)


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
    return build(described("{kind: free}", TURNED, ASKEW))


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
    def one(v, angle):
        found = diagnose(free, jnp.zeros(()), State(x.q.at[7].set(angle), v, x.z))
        place = v[3:6] + jnp.cross(v[:3], 0.1 * jnp.array([1.0, 0, 0]) + jet.place)
        now = jet.pulse(jnp.zeros(()), CrankState(angle, v[6], ()), jet.direction @ place, free.water)
        lost = 0.5 * RHO * jnp.abs(now.outflow) * jnp.sum((place - now.jet_speed * jet.direction) ** 2)
        stored = jet.elastance * (jnp.max(jet.volume) - now.volume) * now.outflow
        into = jnp.sum(found.load_power[mine])  # into the body, less what the crank gives
        return -stored - lost, into, found.energy_rate, jnp.sum(found.load_power)

    for _ in range(8):
        v = jnp.asarray(rng.normal(size=7) * [1, 1, 1, 1, 1, 1, 10])
        taken, into, rate, power = map(float, one(v, jnp.asarray(3 * rng.normal())))
        assert into == pytest.approx(taken, rel=1e-11)
        assert rate == pytest.approx(power, rel=1e-11)


def test_a_motor_by_its_data_sheet_turns_the_crank_along_a_straight_torque_line(free):
    """d omega/dt = (T_s (1 - omega/omega_0) - torque)/I, current i_s (1 - omega/omega_0); the body feels no other."""
    x, jet, rng = free.initial(), jet_of(free), np.random.default_rng(5)
    turns = build(described("{kind: free}", "crank: {kind: rate, rate: 9 rad/s, start: 0.8 rad}", ASKEW))

    @jax.jit
    def one(free, turns, v, angle):
        t, state = jnp.zeros(()), State(x.q.at[7].set(angle), v, x.z)
        place = v[3:6] + jnp.cross(v[:3], 0.1 * jnp.array([1.0, 0, 0]) + jet.place)
        pulled = jet.pulse(t, CrankState(angle, v[6], ()), jet.direction @ place, free.water).torque
        driven = turns.rates(t, State(x.q[:7], v[:6], turns.initial().z)).v
        found = diagnose(free, t, state)
        return pulled, found.powered.current[0], found.a, free.rates(t, state).v, driven

    for _ in range(4):
        v = jnp.asarray(rng.normal(size=7) * [1, 1, 1, 1, 1, 1, 10])
        pulled, current, a, same, _ = one(free, turns, v, jnp.asarray(3 * rng.normal()))
        line = 1 - float(v[6]) / OMEGA_0
        assert float(a[6]) == pytest.approx((T_STALL * line - float(pulled)) / INERTIA, rel=1e-9)
        assert float(current) == pytest.approx(I_STALL * line, rel=1e-9)
        np.testing.assert_allclose(a, same, rtol=1e-9)
    *_, alike, driven = one(free, turns, v.at[6].set(9.0), jnp.asarray(0.8))
    np.testing.assert_allclose(alike[:6], driven, rtol=1e-9)


def test_with_a_motor_the_speed_falls_while_it_pulls_and_energy_closes(free):
    """Electrical power is heat and what the crank takes, and goes into water, shell and rotor at every time."""
    run = simulate(free, 2.0, samples=2001, rtol=1e-9, atol=1e-12)
    data, jet, speed = run.to_dataset(), jet_of(free), np.asarray(run.value.state.v)[:, 6]
    z = CrankState(run.value.state.q[:, 7], run.value.state.v[:, 6], ())
    still = pulses(free, run.value.time, z, jnp.zeros_like(run.value.time))
    assert np.corrcoef(np.asarray(still.torque)[1000:], np.gradient(speed)[1000:])[0, 1] < -0.9
    one = {name: data[name].sel(motor="wheel.angle") for name in ("current", "electrical_power", "motor_heat")}
    assert one["current"].max() > 1.5 * one["current"].min() > 0
    work = (data["motor_torque"] * data["motor_rate"]).sel(motor="wheel.angle")
    np.testing.assert_allclose(one["electrical_power"], work + one["motor_heat"], rtol=1e-12)
    np.testing.assert_allclose(work, data["load_power"].sel(load="drive").sum("part"), rtol=1e-12)
    assert float(data["power_balance"].max()) < 1e-12
    shell = 0.5 * float(jet.elastance) * (np.max(VOLUMES) - np.asarray(still.volume)) ** 2
    stored = data["energy"].sum("form").values + shell
    place = np.asarray(run.value.state.v)[:, 3:6] + np.cross(
        np.asarray(run.value.state.v)[:, :3], np.array([0.1, 0, 0]) + jet.place
    )
    stream = place - np.asarray(still.jet_speed)[:, None] * np.asarray(jet.direction)
    lost = 0.5 * RHO * np.abs(still.outflow) * np.sum(stream**2, axis=1)
    net = (work + data["load_power"].sel(load="drag").sum("part")).values - lost
    gained = np.concatenate([[0.0], np.cumsum((net[1:] + net[:-1]) / 2) * 1e-3])
    np.testing.assert_allclose(stored - stored[0], gained, atol=1e-4 * np.ptp(stored))


def test_without_water_resistance_the_crank_runs_up_with_the_time_constant_of_its_motor():
    """omega = omega_0 (1 - exp(-t/tau)), tau = I omega_0/T_s = 0.3 s, through openings of 1 m2."""
    still, wide = WHEEL.replace("14 rad/s", "0 rad/s"), "nozzle: 1 m2, inlet: 1 m2"
    run = simulate(build(described(HELD, TURNED, wheel=still, openings=wide)), 1.0, samples=101, rtol=1e-8, atol=1e-9)
    wanted = OMEGA_0 * (1 - np.exp(-run.value.time / (INERTIA * OMEGA_0 / T_STALL)))
    np.testing.assert_allclose(run.value.state.v[:, 0], wanted, atol=1e-6)


def test_a_weak_motor_stalls_against_the_shell():
    """At the angle where a^2 E sin(phi) (1 - cos(phi)) is its torque at rest, by a small voltage."""
    weak = MOTOR.replace("VOLTAGE", "{kind: constant, value: 0.02 V}")
    found = static(
        build(described(HELD, TURNED, wheel=WHEEL.replace("velocity: 14 rad/s", "position: 0.8 rad"), motor=weak))
    )
    assert int(found.status) == Status.SOLVED
    torque = lambda phi: SWING**2 * 2e6 * np.sin(phi) * (1 - np.cos(phi)) - T_STALL * 0.02 / 0.75  # noqa: E731
    assert float(found.state.q[0]) == pytest.approx(brentq(torque, 0.1, 2.0), rel=1e-3)
    data = found.to_dataset()
    assert float(data["current"].squeeze()) == pytest.approx(I_STALL * 0.02 / 0.75, rel=1e-9)
    assert float(data["electrical_power"].squeeze()) == pytest.approx(float(data["motor_heat"].squeeze()), rel=1e-9)


def test_a_battery_sags_with_the_crank_and_a_servo_together():
    """One voltage for both: U = U_0 - R_b (P_crank + P_servo)/U."""
    rudder = """
  rudder:
    kind: rigid
    shape: point
    mass: 20 g
    joint:
      kind: revolute
      axis: z
      motion: {kind: sine, amplitude: 40 deg, frequency: 2 Hz}
      servo: {model: HS-5646WP, full_voltage_at: 5 deg, inertia: 1e-4 kg m2, battery: pack}
batteries: {pack: {voltage: 7.4 V, resistance: 0.3 ohm, regenerative: true}}
"""
    motor = MOTOR.replace("voltage: VOLTAGE", "duty_cycle: {kind: constant, value: 0.1}, battery: pack")
    run = simulate(build(described(SURGE, TURNED, motor=motor, parts=rudder)), 0.4, samples=81)
    data = run.to_dataset()
    assert [*data["motor"].values] == ["wheel.angle", "rudder.angle"]
    U, P = data["battery_voltage"].squeeze(), data["battery_power"].squeeze()
    np.testing.assert_allclose(P, data["electrical_power"].sum("motor"), rtol=1e-12)
    np.testing.assert_allclose(U, 7.4 - 0.3 * P / U, rtol=1e-12)
    np.testing.assert_allclose(data["motor_voltage"].sel(motor="wheel.angle"), 0.1 * U, rtol=1e-12)
    assert float(U.min()) < 7.4 - 0.1 and np.ptp(data["electrical_power"].sel(motor="rudder.angle").values) > 0.5


def test_a_velocity_loop_turns_the_crank_once_a_period_and_its_power_is_that_of_the_swim():
    """By its integral; P is the mean of torque times speed, and the cost of transport P/(m g U)."""
    loop = "velocity_loop: {full_voltage_at: 4 rad/s, integral_time: 0.2 s}"
    servo = MOTOR.replace("voltage: VOLTAGE", f"supply: 1.5 V, {loop}")
    followed = f"motion: {{kind: rate, rate: {OMEGA} rad/s}}, servo: MOTOR"
    wheel = WHEEL.replace("velocity: 14 rad/s, motor: MOTOR", followed)
    robot = build(described(SURGE, TURNED, wheel=wheel, motor=servo))
    found = periodic(robot, samples=257)
    assert int(found.status) == Status.SOLVED
    state, means = found.value.state, found.means()
    assert float(state.q[-1, 1] - state.q[0, 1]) == pytest.approx(2 * np.pi, abs=1e-6)
    z = CrankState(state.q[:, 1], state.v[:, 1], ())
    assert np.ptp(z.speed) > 0.1
    now = pulses(robot, jnp.asarray(found.value.time), z, state.v[:, 0])
    power = float(jnp.mean((now.torque * now.speed)[:-1]))
    assert float(means.power) == pytest.approx(power, rel=1e-3)
    assert float(means.cost_of_transport) == pytest.approx(
        float(means.power) / (0.8 * G * float(means.speed)), rel=1e-9
    )
    assert np.isnan(float(means.efficiency))
    taken = means.electrical_power - means.motor_heat
    assert float(taken[0]) == pytest.approx(float(means.power), rel=1e-9)


@pytest.fixture(scope="module")
def pulsing():
    """A jet whose crank a motor turns, and its cycle."""
    robot = build(described(SURGE, TURNED))
    return robot, periodic(robot, rtol=1e-8, atol=1e-10)


def test_a_period_that_a_motor_decides_takes_as_few_cycles_as_a_given_one(pulsing):
    """Corrections converge as Newton's method does: one at each level after the first, though the robot drifts."""
    _, found = pulsing
    assert int(found.status) == Status.SOLVED
    assert float(found.residual) < 0.1
    assert int(found.stats["cycles"]) <= 13 and int(found.stats["corrections"]) <= 3


def test_periods_after_the_cycle_agree_whatever_turns_the_crank_has_made(pulsing):
    """Four more periods, in which the crank turns four times; not those of a cycle that is 1 % faster."""
    robot, found = pulsing
    symmetry = with_crank(robot, find_symmetry(robot), robot.initial())
    settings = cycle_settings("implicit", 1.0, 1e-8, 1e-10)
    for share, agree in ((1.0, True), (1.01, False)):
        states = eqx.tree_at(lambda x: x.v, found.value.state, share * found.value.state.v)
        cycle = Solution(
            Orbit(states, jnp.eye(4), jnp.zeros((4, 4))),
            found.status,
            {"residual_limit": jnp.asarray(100.0)},
            found.residual,
        )
        assert periods_agree(robot, symmetry, cycle, float(found.stats["period"]), settings) is agree


@pytest.mark.slow
def test_the_cycle_of_a_crank_on_a_motor_is_the_last_turn_of_a_long_simulation(pulsing):
    """Period and mean speed to 1e-5: a disturbance shrinks to 0.8^60 in 60 turns."""
    robot, found = pulsing
    assert int(found.status) == Status.SOLVED
    assert 0 < float(found.stats["multiplier"]) < 0.81
    period = float(found.stats["period"])
    begun, end = 59.5 * period, 62.5 * period  # the start takes about half a turn more
    run = simulate(robot, end, samples=[0.0, *np.linspace(begun, end, 3001)], rtol=1e-9, atol=1e-11).value
    time, crank, way = np.asarray(run.time)[1:], *np.asarray(run.state.q)[1:, ::-1].T
    turns = 2 * np.pi * np.array([60, 61])
    assert crank[0] < turns[0] and crank[-1] > turns[1]
    ends = np.interp(turns, crank, time)
    assert ends[1] - ends[0] == pytest.approx(period, rel=1e-5)
    speed = np.diff(np.interp(ends, time, way))[0] / np.diff(ends)[0]
    assert abs(speed) == pytest.approx(float(found.means().speed), rel=1e-5)


@pytest.mark.slow
def test_period_and_speed_change_with_voltage_and_nozzle_as_by_differences(pulsing):
    """The derivatives of the cycle, of unknown period, by the implicit function theorem.

    Differences of the fourth order over changes of 1 and 2 %, of cycles a thousand times more exact.
    """
    robot, _ = pulsing
    theta, to_robot = bind(described(SURGE, TURNED), ("limbs.wheel.joint.motor.voltage.value", "body.loads.jet.nozzle"))
    symmetry = with_crank(robot, find_symmetry(robot), robot.initial())

    def swim(theta, settings):
        shares = jnp.linspace(0.0, 1.0, 3)
        found = orbit(in_plane(to_robot(theta)), symmetry, robot.initial(), shares, settings).value
        way = found.states.q[-1, 0] - found.states.q[0, 0]
        return jnp.stack([found.period, way / found.period])

    derivatives = jax.jit(jax.jacfwd(swim))(theta, cycle_settings("implicit", 1.0, 1e-8, 1e-10))
    fine, swims = cycle_settings("implicit", 1.0, 1e-11, 1e-13), jax.jit(swim)

    def difference(shift, change):
        return (swims(theta + change * shift, fine) - swims(theta - change * shift, fine)) / (2 * change * shift.sum())

    shifts = jnp.diag(theta)
    ends = jnp.stack([(4 * difference(shift, 0.01) - difference(shift, 0.02)) / 3 for shift in shifts], axis=1)
    np.testing.assert_allclose(derivatives, ends, rtol=1e-5)


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


def test_gradients_of_a_crank_by_numbers_of_motor_and_jet():
    """Its acceleration and that of the body against differences."""
    names = ("wheel.joint.motor.stall_torque", "wheel.joint.motor.no_load_speed", "wheel.joint.motor.inertia")
    names = (*(f"limbs.{name}" for name in names), "body.loads.jet.nozzle", "body.loads.jet.elastance")
    theta, to_robot = bind(described(SURGE, TURNED), names)

    @jax.jit
    def rates(theta):
        robot = to_robot(theta)
        x = robot.initial()
        return robot.rates(jnp.zeros(()), State(x.q + 0.9, x.v + 0.2, x.z)).v

    step = 1e-5 * theta
    ends = [jax.vmap(rates)(theta + s * jnp.diag(step)) for s in (1, -1)]
    np.testing.assert_allclose(jax.jacrev(rates)(theta), ((ends[0] - ends[1]) / (2 * step[:, None])).T, rtol=1e-6)


@pytest.mark.parametrize("crank", [CRANK, TURNED])
def test_in_the_plane_it_drives_as_in_space(crank):
    """A jet that pushes aside of the centre, on a body that turns as it swims: the same rates."""
    joint = "{kind: planar, axis: z, start: {angle: 0.4 rad}}"
    robot = build(described(joint=joint, crank=crank, more="direction: [3, 1, 0], place: [10 mm, 20 mm, 0 mm]"))
    assert moves_in_plane(robot)
    x = robot.initial()
    x = State(x.q + 0.7 * (jnp.arange(x.q.size) == 3), jnp.array([0.2, -0.1, 1.5, 9.0])[: x.v.size], x.z)
    both = lambda r, t: [(s.rates(t, x), s.residual(t, x, x.v)) for s in (r, in_plane(r))]  # noqa: E731
    space, plane = jax.jit(both)(robot, jnp.asarray(0.13))
    for one, other in zip(jax.tree.leaves(space), jax.tree.leaves(plane), strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-10, atol=1e-12)


def test_the_period_is_a_turn_of_the_crank():
    assert drive_period(described()) == pytest.approx(2 * np.pi / OMEGA)
    with pytest.raises(InputError, match="a motor finds its own speed") as raised:
        drive_period(described(crank=TURNED))
    assert raised.value.field == "limbs.wheel.joint.motor"


@pytest.mark.parametrize(
    ("crank", "why"),
    [
        (f"{CRANK}, {TURNED}", "one of the two out"),
        ("place: [0 m, 0 m, 0 m]", "how the crank turns, or name a part"),
        ("turned_by: weel", 'there is no part "weel"'),
        ("turned_by: body", "sits on a prismatic joint. A crank is turned by a part on a revolute joint"),
        (f"motor: {{{LINE}}}", "Give a part a revolute joint with a motor and name it in turned_by"),
    ],
)
def test_a_crank_is_turned_once_by_a_hinge(crank, why):
    with pytest.raises(InputError, match=why):
        described(crank=crank)
