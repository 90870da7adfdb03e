"""Servos whose loops are sampled, beside exact discrete-time solutions: a linear motor on a hinge with a spring."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from tests.small_robots import SERVO

from nectosome.core import Status
from nectosome.description import parse_robot
from nectosome.description.mission import parse_mission
from nectosome.model import bind
from nectosome.solve import SampledPlant, modes, periodic, run_mission, simulate, static, steady
from nectosome.solve.integrate import Settings, begin, integrate
from nectosome.solve.sensitivity import SensitivityState, SensitivitySystem
from nectosome.units import InputError

INERTIA, SPRING, K, OHM, VOLTS = 0.07, 0.3, 0.8, 2.0, 12.0  # of body and rotor [kg m2], N m/rad, V s/rad
AMPLITUDE, F, FULL, LEAD = 0.1, 1.25, 0.8, 0.03  # rad, Hz, rad of error to full voltage, s
W = 2 * np.pi * F
BENCH = f"""
name: bench
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  volume: 0 m3
  inertia: [0.05 kg m2, 0.05 kg m2, 0.05 kg m2]
  joint:
    kind: revolute
    axis: x
    stiffness: {SPRING} N m/rad
    motion: {{kind: sine, amplitude: {AMPLITUDE} rad, frequency: {F} Hz}}
    servo:
      torque_constant: {K} N m/A
      resistance: {OHM} ohm
      inertia: 0.02 kg m2
      supply: {VOLTS} V
      full_voltage_at: {FULL} rad
      derivative: {LEAD} s
      update_rate: 40 Hz
aliases:
  rate: body.joint.servo.update_rate
  full: body.joint.servo.full_voltage_at
"""
POSITION = f"full_voltage_at: {FULL} rad\n      derivative: {LEAD} s"
SUMS = BENCH.replace(POSITION, "velocity_loop: {full_voltage_at: 4 rad/s, integral_time: 0.2 s}")
SUMS = SUMS.replace("  full: body.joint.servo.full_voltage_at\n", "")
RATE = "body.joint.servo.update_rate"
CONTINUOUS = BENCH.replace("      update_rate: 40 Hz\n", "").replace(f"  rate: {RATE}\n", "")
TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def position_loop(t, x, z, full=FULL):
    """Demand, and the sum, which it has none of."""
    return (AMPLITUDE * np.sin(W * t) - x[0] + LEAD * (AMPLITUDE * W * np.cos(W * t) - x[1])) / full, z


def velocity_loop(rate):
    """Of a PI loop that sums up each error for the time between updates, after its use."""

    def loop(t, x, z):
        error = AMPLITUDE * W * np.cos(W * t) - x[1]
        return (error + z / 0.2) / 4.0, z + error / rate

    return loop


def limited(y, width=0.005):
    """The smooth limit of a demand, whose slope at 0 is 1.25e-5 less than 1, and that slope."""
    up, down = np.hypot(y + 1, width), np.hypot(y - 1, width)
    return 0.5 * (up - down), 0.5 * ((y + 1) / up - (y - 1) / down)


def exact(rate, times, loop=position_loop, constant=K):
    """Angle and velocity at increasing times, by a matrix exponential for each time between two updates."""
    A = np.zeros((3, 3))
    A[0, 1], A[1] = 1.0, np.array([-SPRING, -(constant**2) / OHM, constant * VOLTS / OHM]) / INERTIA
    x, z, k, found = np.zeros(2), 0.0, 0, []
    demand, z = loop(0.0, x, z)
    for t in times:
        while (k + 1) / rate < t - 1e-12:
            x, k = (expm(A / rate) @ [*x, limited(demand)[0]])[:2], k + 1
            demand, z = loop(k / rate, x, z)
        found.append((expm(A * (t - k / rate)) @ [*x, limited(demand)[0]])[:2])
    return np.array(found)


def discrete(rate, full):
    """Matrix from one update to the next, at a small demand."""
    A = np.array([[0, 1, 0], [-SPRING, -(K**2) / OHM, K * VOLTS / OHM], [0, 0, 0]])
    A[1] /= INERTIA
    one = expm(A / rate)
    return one[:2, :2] - np.outer(one[:2, 2], limited(0.0)[1] * np.array([1.0, LEAD]) / full)


@pytest.mark.parametrize("rate", [25.0, 40.0])
@pytest.mark.parametrize("method", ["implicit", "explicit"])
def test_a_trajectory_is_that_of_matrix_exponentials(rate, method):
    run = simulate(parse_robot(BENCH), 2.0, settings=[f"rate={rate}Hz"], samples=101, method=method, **TIGHT)
    data = run.to_dataset()
    found = np.stack([data["motor_position"].values[:, 0], data["motor_rate"].values[:, 0]], axis=1)
    np.testing.assert_allclose(found, exact(rate, data["time"].values), atol=2e-8)
    assert float(data["power_balance"].max()) < 1e-10


def test_a_velocity_loop_sums_up_its_errors_at_its_updates():
    data = simulate(parse_robot(SUMS), 2.0, settings=["rate=20Hz"], samples=101, **TIGHT).to_dataset()
    found = np.stack([data["motor_position"].values[:, 0], data["motor_rate"].values[:, 0]], axis=1)
    np.testing.assert_allclose(found, exact(20.0, data["time"].values, velocity_loop(20.0)), atol=2e-8)


def test_the_sampled_loop_comes_to_the_continuous_one_as_its_rate_grows():
    """The difference halves with the time between updates."""
    ends = np.linspace(0.0, 1.0, 6).tolist()
    wanted = simulate(parse_robot(CONTINUOUS), 1.0, samples=ends, **TIGHT).to_dataset()["q"].values
    off = [np.abs(exact(rate, ends)[:, :1] - wanted).max() for rate in (400.0, 800.0)]
    found = simulate(parse_robot(BENCH), 1.0, settings=["rate=800Hz"], samples=ends, **TIGHT).to_dataset()["q"].values
    assert np.abs(found - wanted).max() == pytest.approx(off[1], rel=1e-4)
    assert off[1] == pytest.approx(off[0] / 2, rel=0.02)


def test_the_multipliers_of_a_cycle_are_the_eigenvalues_of_the_discrete_map():
    """20 updates in a period; and 0, of the share that is held."""
    found = periodic(parse_robot(BENCH), settings=["rate=25Hz"], rtol=1e-8, atol=1e-10)
    assert found.status == Status.SOLVED
    wanted = np.linalg.eigvals(np.linalg.matrix_power(discrete(25.0, FULL), 20))
    np.testing.assert_allclose(np.sort_complex(found.multipliers[:2]), np.sort_complex(wanted), atol=2e-6)
    assert abs(found.multipliers[2]) < 1e-9  # rounding of differences
    data = found.to_dataset()
    later = exact(25.0, [20 * 0.8 + t for t in data["time"].values])
    np.testing.assert_allclose(data["q"].values[:, 0], later[:, 0], atol=1e-7)


def test_the_mean_power_of_a_cycle_is_that_of_the_exact_solution():
    """Updates are among the samples, where what jumps counts half before and half after: by the square of their step.

    Means by 64 intervals between updates, of a motion that has come to its cycle.
    """
    found = periodic(parse_robot(BENCH), settings=["rate=25Hz"], rtol=1e-8, atol=1e-10).means()
    drawn = []
    for k in range(500, 520):
        start = exact(25.0, [k / 25])[0]
        rates = exact(25.0, k / 25 + np.arange(1, 65) / 1600)[:, 1]
        volts = VOLTS * limited(position_loop(k / 25, start, 0.0)[0])[0]
        drawn.append(np.trapezoid(volts * (volts - K * np.array([start[1], *rates])) / OHM, dx=1 / 64))
    assert float(found.electrical_power[0]) == pytest.approx(np.mean(drawn), rel=3e-3)
    assert abs(float(found.power)) < 3e-3 * float(found.power_positive)  # nothing takes it: it is kept


def test_a_loop_that_is_updated_too_seldom_is_unstable():
    """Stable where it is continuous; its smallest motion grows by the eigenvalue of the discrete map."""
    slow = ["rate=5Hz", "full=0.4rad", "body.joint.motion.amplitude=1e-5rad"]
    growth = np.abs(np.linalg.eigvals(discrete(5.0, 0.4))).max()
    assert growth > 1.2
    faithful = simulate(
        parse_robot(CONTINUOUS), 8.0, settings=["full=0.4rad", slow[2]], samples=41, **TIGHT
    ).to_dataset()
    assert np.abs(faithful["q"].values).max() < 2e-5
    found = periodic(parse_robot(BENCH), settings=slow, rtol=1e-6, atol=1e-14)
    assert found.status == Status.UNSTABLE
    assert float(found.stats["multiplier"]) == pytest.approx(growth**4, rel=1e-6)
    slow[2] = "body.joint.motion.amplitude=1e-7rad"
    tiny = periodic(parse_robot(BENCH), settings=slow, rtol=1e-6, atol=1e-16)
    off = abs(float(tiny.stats["multiplier"]) - growth**4)  # by rounding, which its error knows of
    assert off < float(tiny.stats["multiplier_error"]) < 1e-2
    run = simulate(parse_robot(BENCH), 8.0, settings=slow, samples=41, rtol=1e-8, atol=1e-18).to_dataset()
    state = np.concatenate([run["q"].values, run["v"].values], axis=1)  # at updates, four in a period
    change = state[4:] - state[:-4]
    np.testing.assert_allclose(change[-1], np.linalg.matrix_power(discrete(5.0, 0.4), 36) @ change[0], rtol=1e-5)
    assert np.abs(change[-1]).max() > 1000 * np.abs(change[0]).max()


def _velocities_by_gain_and_constant(t):
    """Derivatives of the exact solution, by differences."""
    h = 1e-5

    def velocity(full, constant):
        return exact(40.0, t, lambda t, x, z: position_loop(t, x, z, full), constant)[:, 1]

    ends = [velocity(FULL + h, K) - velocity(FULL - h, K), velocity(FULL, K + h) - velocity(FULL, K - h)]
    return np.stack(ends, axis=1) / (2 * h)


TRIED = ("full", "body.joint.servo.torque_constant"), np.array([0.31, 0.8])
STEPS = Settings("implicit", *map(jnp.asarray, (1e-10, 1e-12, 100_000)), sensitivity_atol=1e-10)


@pytest.mark.slow
def test_gradients_through_the_steps_of_updates_are_those_of_the_exact_solution():
    (paths, t), settings = TRIED, STEPS
    theta, robot_at = bind(parse_robot(BENCH), paths)

    def final(theta):
        robot = robot_at(theta)
        start = begin(jnp.zeros(()), robot.initial(), settings, jnp.asarray(1e-4))
        return integrate(robot, start, jnp.asarray(t), settings)[1].v[:, 0]

    np.testing.assert_allclose(jax.jit(jax.jacfwd(final))(theta), _velocities_by_gain_and_constant(t), atol=1e-7)


def test_gradients_beside_updates_are_those_of_the_exact_solution():
    """By the gain and by the motor's constant, carried beside the motion as sweeps and designs do."""
    (paths, t), settings = TRIED, STEPS
    theta, robot_at = bind(parse_robot(BENCH), paths)
    change = eqx.filter_jit(jax.jacfwd(lambda x: eqx.filter(robot_at(x), eqx.is_inexact_array)))(theta)
    robot = robot_at(theta)
    change = jax.tree.map(lambda x: np.moveaxis(np.asarray(x), -1, 0), change)
    x = robot.initial()
    start = SensitivityState(x, jax.tree.map(lambda x: np.zeros((2, *x.shape)), x))
    system = SensitivitySystem(robot, change, jnp.zeros(2))

    @jax.jit
    def beside(system, start):
        m = begin(jnp.zeros(()), start, settings, jnp.asarray(1e-4))
        return integrate(system, m, jnp.asarray(t), settings)[1].derivatives.v[..., 0]

    np.testing.assert_allclose(beside(system, start), _velocities_by_gain_and_constant(t), atol=1e-7)


def test_an_event_is_found_between_updates_and_at_one():
    """Where the angle passes 0.05 rad, by the exact solution; and where an update makes the demand pass a value."""
    robot = parse_robot(BENCH)
    run = simulate(robot, 1.0, until=lambda t, x: x.q[0] - 0.05, **TIGHT)
    wanted = brentq(lambda t: exact(40.0, [t])[0, 0] - 0.05, 0.0, 0.3)
    assert run.status == Status.EVENT
    assert float(run.value.time[-1]) == pytest.approx(wanted, abs=1e-8)
    jumps = simulate(robot, 1.0, until=lambda t, x: x.z[-1].loop.demand[0] - 0.06, **TIGHT)
    demands = [position_loop(k / 40, exact(40.0, [k / 40])[0], 0.0)[0] for k in range(40)]
    first = next(k for k, demand in enumerate(demands) if demand > 0.06)
    assert jumps.status == Status.EVENT and first > 0
    assert float(jumps.value.time[-1]) == pytest.approx(first / 40, abs=1e-12)


PAIR = """
name: two servos
water: {gravity: 0 m/s2}
batteries: {pack: {voltage: 12 V, resistance: 0.4 ohm}}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  inertia: [0.05 kg m2, 0.05 kg m2, 0.05 kg m2]
  joint:
    kind: revolute
    axis: z
    motion: {kind: sine, amplitude: 30 deg, frequency: 1 Hz}
    servo: {model: XW540-T140-R, battery: pack, full_voltage_at: 40 deg, inertia: 20 g m2, update_rate: 50 Hz}
limbs:
  arm:
    kind: rigid
    shape: point
    mass: 0.1 kg
    inertia: [0.01 kg m2, 0.01 kg m2, 0.01 kg m2]
    offset: [0.1 m, 0 m, 0 m]
    joint:
      kind: revolute
      axis: z
      motion: {kind: sine, amplitude: 20 deg, frequency: 1 Hz, phase: 90 deg}
      servo: {model: XC330-M288-T, battery: pack, full_voltage_at: 40 deg, inertia: 2 g m2, update_rate: 30 Hz}
"""


def test_two_servos_update_at_their_own_instants_and_share_a_battery():
    """On a grid of 600 Hz: what is held is what was read at the last instant; at one, the mean of both."""
    data = simulate(parse_robot(PAIR), 1.0, samples=601, rtol=1e-8, atol=1e-10).to_dataset()
    full, k = np.radians(40), np.arange(1, 601)
    for i, every in enumerate((12, 20)):
        demand = data["tracking_error"].values[:, i] / full
        held = 0.5 * (demand[(k - 1) // every * every] + demand[k // every * every])
        np.testing.assert_allclose(data["voltage_demand"].values[k, i], held, atol=1e-7)
    balance = data["electrical_power"] - data["motor_torque"] * data["motor_rate"] - data["motor_heat"]
    np.testing.assert_allclose(balance, 0.0, atol=1e-9)
    assert float(data["power_balance"].max()) < 1e-10
    flown = run_mission(parse_mission("modes: [{name: go, until: 1 s}]", parse_robot(PAIR)))
    updates = k[(k % 12 == 0) | (k % 20 == 0)]
    at = np.abs(flown.time - updates[:, None] / 600).argmin(axis=1)
    np.testing.assert_allclose(flown.time[at], updates / 600, atol=1e-12)
    np.testing.assert_allclose(flown.measures.battery_power[at], data["battery_power"].values[updates], atol=1e-5)


@pytest.mark.slow
def test_two_servos_that_update_at_their_own_instants_have_a_cycle():
    cycle = periodic(parse_robot(PAIR))
    assert cycle.status == Status.SOLVED and cycle.multipliers.size == 6


def test_a_sampled_servo_is_a_motor_in_a_sampled_loop():
    """A duty cycle that a controller sets 50 times a second from the angle that it reads; limits differ by 1.3e-5."""
    motion, loop = "    motion: {kind: sine, amplitude: 30 deg, frequency: 1 Hz}\n", "full_voltage_at: 12 deg"
    motor = SERVO.replace(motion, "").replace("servo:", "motor:")
    motor = parse_robot(motor.replace(loop, "duty_cycle: {kind: constant, value: 0}"))
    plant = SampledPlant(motor, "body.joint.motor.duty_cycle.value", "body.angle", 0.02, rtol=1e-8, atol=1e-10)
    (state, _), angles = plant.start(), []
    for k in range(100):
        asked = np.radians(30) * np.sin(2 * np.pi * k * 0.02)
        state, _, status = plant.hold(state, (asked - state.reading) / np.radians(12))
        assert status == Status.SOLVED
        angles.append(state.reading)
    servo = parse_robot(SERVO.replace("inertia: 20", "update_rate: 50 Hz, inertia: 20"))
    found = simulate(servo, 2.0, samples=101, rtol=1e-8, atol=1e-10).to_dataset()["q"].values[1:, 0]
    np.testing.assert_allclose(found, angles, atol=2e-5)
    assert np.abs(found).max() > 0.5


def test_instants_are_those_of_the_whole_motion_in_samples_and_missions():
    """Samples of 30 ms and steps of 2 ms, neither with a whole number of updates: all as in one simulation."""
    robot = parse_robot(BENCH)
    plant = SampledPlant(robot, "body.joint.motion.offset", "body.angle", 0.03, rtol=1e-10, atol=1e-12)
    (state, _), angles = plant.start(), []
    for _ in range(20):
        state, _, _ = plant.hold(state, 0.0)
        angles.append(state.reading)
    np.testing.assert_allclose(angles, exact(40.0, 0.03 * np.arange(1, 21))[:, 0], atol=2e-8)
    upright = parse_robot(BENCH.replace("axis: x", "axis: z"))
    run = run_mission(parse_mission("modes: [{name: go, until: 0.6 s}]", upright), step=2e-3)
    assert run.reason == ""
    np.testing.assert_allclose(run.measures.heading, exact(40.0, run.time)[:, 0], atol=2e-8)


def test_equilibria_are_those_of_the_continuous_loop():
    """Of a motion that stays at 0.2 rad: the angle where spring and motor balance; its modes, and one of the rate."""
    still = "{kind: constant, value: 0.2 rad}"
    sine = f"{{kind: sine, amplitude: {AMPLITUDE} rad, frequency: {F} Hz}}"
    sampled = parse_robot(BENCH.replace(sine, still))
    gain = K * VOLTS / OHM / FULL * limited(0.0)[1]
    other = parse_robot(CONTINUOUS.replace(sine, still))
    for solve in (static, steady):
        found, wanted = solve(sampled), solve(other)
        assert found.status == wanted.status == Status.SOLVED
        angle = float(found.value.state.q[0, 0])
        assert angle == pytest.approx(float(wanted.value.state.q[0, 0]), rel=1e-12)
        assert angle == pytest.approx(0.2 * gain / (gain + SPRING), rel=2e-6)
    found, wanted = modes(sampled).eigenvalue, modes(other).eigenvalue
    np.testing.assert_allclose(found, [*wanted, -40.0], rtol=1e-9)


def test_a_period_without_a_whole_number_of_updates_is_refused_with_what_fits():
    with pytest.raises(InputError) as told:
        periodic(parse_robot(BENCH), settings=["rate=30.5Hz"])
    assert str(told.value) == (
        "update_rate: at 30.5 Hz a loop has 24.4 updates in a period of 800 ms: it does not repeat itself. "
        "Take 30 Hz or 31.25 Hz, the period 4 s (5 cycles), or no update_rate, for a continuous loop."
    )
    longer = periodic(parse_robot(BENCH), 4.0, settings=["rate=30.5Hz"])
    assert longer.status == Status.SOLVED
