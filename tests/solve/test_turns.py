"""Motors that find their own speed: the period is found with the cycle, against SciPy and closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from tests.small_robots import BOB, WHEEL, turning

from nectosome.core import Status
from nectosome.description import parse_robot, with_values
from nectosome.description.variables import Variable
from nectosome.designs import MotionDesign, sweep
from nectosome.mechanism import in_plane
from nectosome.model import bind, build
from nectosome.solve import find_symmetry, periodic, simulate, with_crank
from nectosome.solve.orbit import cycle_settings, orbit

M, L, G, ROTOR, K, R = BOB
WINDING = f"torque_constant: {K} N m/A, resistance: {R} ohm, inertia: {ROTOR} kg m2"
SERVO = f"servo: {{{WINDING}, supply: 3 V, velocity_loop: {{full_voltage_at: FULL}}}}"
LOOP = f"motion: {{kind: rate, rate: 20 rad/s}}, {SERVO}"


def turn_of(voltage: float, rotor: float = ROTOR, damping: float = K**2 / R) -> tuple[float, float]:
    """Period and speed at angle 0 of (J + m l^2) w' = K U/R - d w + m g l cos(angle), by SciPy."""
    J = rotor + M * L**2

    def once(speed: float) -> tuple[float, float]:
        def rates(_, x):
            return [x[1], (K * voltage / R - damping * x[1] + M * G * L * np.cos(x[0])) / J]

        def left(_, x):
            return abs(x[0]) - 2 * np.pi

        left.terminal = True
        s = solve_ivp(rates, (0, 100), [0.0, speed], events=left, rtol=1e-12, atol=1e-13, method="DOP853")
        return s.t[-1], s.y[1, -1]

    middle = K * voltage / R / damping
    speed = brentq(lambda w: once(w)[1] - w, 0.8 * middle, 1.3 * middle, xtol=1e-13)
    return once(speed)[0], speed


@pytest.fixture(scope="module")
def wheel():
    return parse_robot(WHEEL)


@pytest.mark.parametrize("voltage", [1.0, -1.0, 0.3])
def test_a_bob_on_a_motor_turns_in_the_time_that_its_equation_says(wheel, voltage):
    """And a disturbance of its speed is multiplied by exp(-K^2 T / R J), Liouville's formula."""
    found = periodic(with_values(wheel, {"U": voltage}), rtol=1e-8, atol=1e-10)
    assert int(found.status) == Status.SOLVED
    period, speed = turn_of(voltage)
    assert float(found.stats["period"]) == pytest.approx(period, rel=3e-8)
    q, v = np.asarray(found.value.state.q)[:, 0], np.asarray(found.value.state.v)[:, 0]
    assert q[0] == 0
    assert q[-1] == pytest.approx(np.sign(voltage) * 2 * np.pi, rel=1e-8)
    np.testing.assert_allclose(v[[0, -1]], speed, rtol=1e-7)
    multiplier = np.exp(-(K**2) / R * period / (ROTOR + M * L**2))
    np.testing.assert_allclose(found.multipliers, [multiplier], rtol=1e-6)
    assert np.asarray(found.value.time)[-1] == found.stats["period"] == found.to_dataset().attrs["period"]


@pytest.mark.slow
def test_period_and_speed_change_with_voltage_and_inertia_as_by_differences(wheel):
    """Derivatives of the orbit by the implicit function theorem against SciPy's, at fixed fractions of the period."""
    theta, to_robot = bind(wheel, ("U", "J"))
    robot = build(wheel)
    symmetry = with_crank(robot, find_symmetry(robot), robot.initial())
    settings, shares = cycle_settings("implicit", 1.0, 1e-9, 1e-11), jnp.linspace(0.0, 1.0, 9)

    def start(theta):
        found = orbit(in_plane(to_robot(theta)), symmetry, robot.initial(), shares, settings).value
        return jnp.stack([found.period, found.states.v[0, 0], found.states.q[4, 0]])

    found = np.asarray(jax.jit(jax.jacfwd(start))(theta))
    for k, step in enumerate(1e-3 * np.array([1.0, ROTOR])):
        shift = step * np.eye(2)[k]
        after, before = (np.array(turn_of(*(np.array([1.0, ROTOR]) + s * shift))) for s in (1, -1))
        np.testing.assert_allclose(found[:2, k], (after - before) / (2 * step), rtol=2e-5)
    half = [float(jax.jit(start)(theta + s * jnp.array([1e-3, 0.0]))[2]) for s in (1, -1)]
    assert found[2, 0] == pytest.approx((half[0] - half[1]) / 2e-3, rel=1e-4)


def test_a_velocity_loop_without_an_integral_lacks_speed_and_so_takes_longer(wheel):
    """U = 3 V (20 rad/s - w) / 5 rad/s: the line of a motor at 12 V with more damping."""
    full = 5.0
    loop = LOOP.replace("FULL", f"{full} rad/s")
    found = periodic(parse_robot(WHEEL.replace(turning("1 V"), loop).partition("aliases")[0]), rtol=1e-8, atol=1e-10)
    assert int(found.status) == Status.SOLVED
    period, _ = turn_of(3 * 20 / full, damping=K * (K + 3 / full) / R)
    assert float(found.stats["period"]) == pytest.approx(period, rel=1e-6)
    assert period > 1.04 * 2 * np.pi / 20


def test_an_integral_keeps_the_period_and_no_multiplier_is_1():
    """All that does not move along the motion itself decays, so that the motion is stable."""
    loop = LOOP.replace("FULL", "5 rad/s, integral_time: 0.3 s")
    found = periodic(parse_robot(WHEEL.replace(turning("1 V"), loop).partition("aliases")[0]))
    assert int(found.status) == Status.SOLVED
    assert float(found.stats["period"]) == pytest.approx(2 * np.pi / 20, rel=1e-7)
    assert found.multipliers.size == 2
    assert float(found.stats["multiplier"]) < 0.5


@pytest.mark.parametrize("values", [{"U": 0.0}, {"U": 0.2, "body.mass": 1.0}])
def test_a_motor_that_stalls_has_no_period(wheel, values):
    """Without a voltage the bob swings down; a heavier one comes to rest on its way up, m g l > K U / R."""
    stalled = with_values(wheel, values)
    found = periodic(stalled)
    assert int(found.status) == Status.NO_TURN
    assert np.isnan(found.stats["period"])
    run = simulate(stalled, 60.0, samples=2)
    assert abs(float(run.state.q[0])) < 2 * np.pi


def test_a_sweep_has_the_periods_of_its_points(wheel):
    """And none where the motor stalls: there is no speed of its own."""
    found = sweep(wheel, {"U": [0.0, 0.5, 1.0]})
    assert found["status"].values.tolist() == ["NO_TURN", "SOLVED", "SOLVED"]
    periods = [turn_of(voltage)[0] for voltage in (0.5, 1.0)]
    np.testing.assert_allclose(found["period"].values, [np.nan, *periods], rtol=1e-4)


def test_a_design_knows_the_frequency_and_its_derivative(wheel):
    task = MotionDesign(wheel, (Variable("U", 0.5, 1.5, log=False, dimension="voltage"),), objective="frequency")
    found = task.prepare()(np.array([0.5]), derivatives=True, memory=None)
    assert found.outputs["frequency"] == pytest.approx(1 / turn_of(1.0)[0], rel=1e-5)
    after, before = (1 / turn_of(1.0 + s)[0] for s in (1e-3, -1e-3))
    assert found.gradient[0] == pytest.approx(-(after - before) / 2e-3, rel=1e-4)
