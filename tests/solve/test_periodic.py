"""Periodic motions against closed forms and long simulations; stability; derivatives; honest ways to fail."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.small_robots import DRIVEN, M0, SHAKEN, C, F, I, K

from nectosome.core import State, Status
from nectosome.description import parse_robot, with_values
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import find_symmetry, periodic, simulate
from nectosome.units import InputError

from .conftest import ROWING


@pytest.fixture(scope="module")
def driven():
    return periodic(build(parse_robot(DRIVEN)), 1 / F, rtol=1e-8, atol=1e-10)


def test_a_driven_oscillator_answers_as_its_transfer_function(driven):
    """theta = Re M0 e^{i w t} / (K - I w^2 + i C w); disturbances decay with its own eigenvalues."""
    found = driven
    assert int(found.status) == Status.SOLVED
    w = 2 * np.pi * F
    answer = M0 / (K - I * w**2 + 1j * C * w) * np.exp(1j * (w * np.asarray(found.value.time) + 0.4 - np.pi / 2))
    np.testing.assert_allclose(found.value.state.q[:, 0], answer.real, rtol=0, atol=5e-7 * np.abs(answer).max())
    own = np.exp(np.roots([I, C, K]) / F)
    np.testing.assert_allclose(np.sort_complex(found.multipliers), np.sort_complex(own), atol=1e-6)
    assert float(found.stats["multiplier"]) == pytest.approx(np.exp(-C / (2 * I) / F), rel=1e-6)


def test_ends_that_meet_within_noise_only_are_laid_to_contacts_where_there_are_any(driven):
    """Not those of a robot that touches nothing and has no stops."""
    loose = eqx.tree_at(lambda found: found.residual, driven, jnp.asarray(3.0))
    assert loose.reason.endswith("that are accepted, as the motion amplifies errors of steps")


def test_what_drives_put_in_over_a_cycle_loads_take_out(driven):
    """P = C w^2 X^2 / 2 of the solved cycle; mean powers balance since the energy comes back."""
    w = 2 * np.pi * F
    means = driven.means()
    burnt = C * w**2 * abs(M0 / (K - I * w**2 + 1j * C * w)) ** 2 / 2
    assert float(means.power) == pytest.approx(burnt, rel=1e-6)
    assert float(jnp.sum(means.load_power)) == pytest.approx(0, abs=1e-6 * burnt)


def test_results_hold_the_multipliers_and_the_period(driven):
    dataset = driven.to_dataset()
    complex_ = dataset["multiplier_real"].values + 1j * dataset["multiplier_imaginary"].values
    assert np.array_equal(complex_, driven.multipliers)
    assert np.array_equal(dataset["multiplier_error"].values, driven.multiplier_errors)
    page = driven.summary(multipliers=True)
    assert [len(one.rows) for one in page.tables if one.key == "multipliers"] == [complex_.size]
    assert dataset.attrs["multiplier"] == np.abs(complex_).max()
    assert dataset.attrs["period"] == 1 / F


def hill_multiplier(frequency):
    """Largest Floquet multiplier of the shaken bob, I theta'' + c theta' + m l (g + z'') theta = 0, by SciPy."""
    w = 2 * np.pi * frequency

    def rates(t, x):
        return [x[1], (-0.02 * x[1] - (9.81 - 0.06 * w**2 * np.sin(w * t)) * x[0]) / 2]

    ends = [solve_ivp(rates, (0, 1 / frequency), e, rtol=1e-11, atol=1e-13).y[:, -1] for e in np.eye(2)]
    return np.max(np.abs(np.linalg.eigvals(np.transpose(ends))))


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("frequency", [0.70486, 1.4])
def test_a_shaken_pendulum_is_stable_or_not_as_hills_equation_says(frequency, exact):
    robot = build(with_values(parse_robot(SHAKEN), {"f": frequency}))
    still = State(jnp.zeros(1), jnp.zeros(1), robot.initial().z)
    found = periodic(robot, 1 / frequency, guess=still, rtol=1e-8, atol=1e-10, multipliers=exact)
    wanted = hill_multiplier(frequency)
    assert float(found.stats["multiplier"]) == pytest.approx(wanted, rel=1e-5)
    assert abs(float(found.stats["multiplier"]) - wanted) <= float(found.stats["multiplier_error"]) < 2e-5
    assert int(found.status) == (Status.UNSTABLE if wanted > 1 else Status.SOLVED)


@pytest.fixture(scope="module")
def rowing(boat):
    return periodic(build(boat), 1 / 0.8, rtol=1e-8, atol=1e-10)


def test_a_boat_that_rows_away_has_a_cycle_all_the_same(boat, rowing):
    """Its place drifts; all else returns, as at the end of a long simulation."""
    assert int(rowing.status) == Status.SOLVED
    assert find_symmetry(build(boat)).drift == (0,)
    q, v = np.asarray(rowing.value.state.q), np.asarray(rowing.value.state.v)
    np.testing.assert_allclose(q[-1, 1:], q[0, 1:], atol=1e-7)
    np.testing.assert_allclose(v[-1], v[0], atol=1e-6)
    cycles = 30  # a disturbance halves in each
    times = np.concatenate([[0.0], np.linspace(cycles - 1, cycles, 129)]) / 0.8
    run = simulate(build(boat), cycles / 0.8, samples=times.tolist(), rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(v, np.asarray(run.value.state.v)[1:], rtol=0, atol=1e-5 * np.abs(v).max())
    way = np.asarray(run.value.state.q)[:, 0]
    assert q[-1, 0] - q[0, 0] == pytest.approx(way[-1] - way[1], rel=1e-4)


@pytest.mark.slow
def test_the_means_of_a_boat_account_for_all_power(boat):
    """What the arm puts in, drag, spring and stop take out; with fewer samples the blow on the stop is missed."""
    robot = build(boat)
    found = periodic(robot, 1 / 0.8, samples=1025, rtol=1e-8, atol=1e-10)
    means, way = found.means(), np.asarray(found.value.state.q)[:, 0]
    assert float(means.speed) == pytest.approx(abs(way[-1] - way[0]) * 0.8, rel=1e-12)
    put_in = float(means.power)
    assert float(jnp.sum(means.load_power)) == pytest.approx(-put_in, rel=2e-5)
    assert 0 < float(means.efficiency) < 1
    assert float(means.cost_of_transport) == pytest.approx(put_in / (1.046 * 9.80665 * float(means.speed)), rel=1e-12)


def test_drives_of_another_period_are_told(boat):
    found = periodic(build(boat), 1.0)
    assert int(found.status) == Status.OTHER_PERIOD
    assert "do not have this period" in Status.OTHER_PERIOD.reason


def test_a_cycle_is_that_of_drives_without_their_ramps(boat):
    ramp = parse_robot(ROWING.replace("frequency: 0.8 Hz}", "frequency: 0.8 Hz, ramp: 3 s}"))
    found, wanted = periodic(ramp), periodic(boat)
    assert int(found.status) == Status.SOLVED
    np.testing.assert_array_equal(found.state.v, wanted.state.v)


def test_what_never_repeats_itself_is_not_solved(falling):
    assert int(periodic(falling, 0.1).status) == Status.NO_PERIOD


@pytest.mark.parametrize(("period", "options"), [(0.0, {}), (np.nan, {}), (1.0, {"samples": 1}), (1.0, {"rtol": 0.0})])
def test_numbers_without_sense_are_refused(falling, period, options):
    with pytest.raises(InputError):
        periodic(falling, period, **options)


@pytest.mark.slow
@pytest.mark.parametrize(("A", "f", "N"), [(75, 1.1, 3), (30, 0.3, 3), (60, 1.3, 1), (45, 0.7, 2)])
def test_the_mean_thrust_of_a_paddle_is_that_of_a_long_simulation(A, f, N):
    robot = build(describe("paddle", [f"N={N}", f"A={A}deg", f"f={f}Hz"]))
    found = periodic(robot, 1 / f)
    assert int(found.status) == Status.SOLVED
    mean = found.to_dataset()["reaction"].sel(prescribed="body.y").values
    times = np.concatenate([[0.0], np.linspace(9, 10, 129)]) / f
    run = simulate(robot, 10 / f, samples=times.tolist(), rtol=1e-6, atol=1e-8).to_dataset()
    late = run["reaction"].sel(prescribed="body.y").values[1:]
    thrust, wanted = np.trapezoid(mean) / 128, np.trapezoid(late) / 128
    assert thrust == pytest.approx(wanted, rel=5e-3, abs=1e-4)


def test_what_is_driven_through_and_through_repeats_itself_at_once():
    """A rigid plate on its servo: nothing is free, so that there is nothing to find and nothing to last."""
    found = periodic(build(describe("paddle", ["N=0", "A=60deg", "f=0.7Hz"])), 1 / 0.7, samples=65)
    assert found.status == Status.SOLVED
    assert found.multipliers.size == 0
    assert abs(float(found.means().force[1])) < 1e-9
    fastest = np.radians(60) * 2 * np.pi * 0.7
    assert float(found.means().drive_velocity_peak[3]) == pytest.approx(fastest, rel=1e-12)
