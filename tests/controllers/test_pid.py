"""PID and scheduled gains against their transfer functions, and what limits do to them."""

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from nectosome.controllers import ActuatorLimits, GainSchedule, PIDRegulator, pid_of, wave
from nectosome.drives import Chain, Saturation, SlewLimit

from .simple_loops import DT, UNLIMITED, around, commands, lag, of

some = st.floats(0.0, 50.0)
N = 200


def errors(seed=0, count=N):
    """From 0 on, as a regulator begins where it is."""
    e = np.random.default_rng(seed).normal(size=count)
    e[0] = 0.0
    return e


def answer(gains, filtering, e, dt=DT, reach=UNLIMITED):
    return np.asarray(commands(pid_of(gains, filtering, reach).planned(np.zeros(len(e)), dt), -e))


@given(some, some, some, st.floats(0.0, 1.0))
def test_it_is_its_discrete_transfer_function(kp, ki, kd, filtering):
    """K_p + K_i dt/(1 - 1/z) + K_d (1 - 1/z)/(T_f + dt - T_f/z)."""
    e = errors()
    parts = (
        kp * e,
        lfilter([ki * DT], [1, -1], e),
        lfilter([kd, -kd], [filtering + DT, -filtering], e),
    )
    size = 1 + kp + ki + kd / (filtering + DT)
    np.testing.assert_allclose(answer([kp, ki, kd], filtering, e), sum(parts), atol=1e-11 * size)


def test_with_short_samples_it_is_the_continuous_one():
    """u for e = sin(w t) in closed form; differences fall as the samples do, by 4."""
    (kp, ki, kd), f, w = (2.0, 5.0, 0.4), 0.05, 9.0

    def off(dt):
        t = np.arange(0, 0.8 + dt / 2, dt)
        slow = (np.cos(w * t) + f * w * np.sin(w * t) - np.exp(-t / f)) * kd * w / (1 + (f * w) ** 2)
        wanted = kp * np.sin(w * t) + ki * (1 - np.cos(w * t)) / w + slow
        return np.abs(answer([kp, ki, kd], f, np.sin(w * t), dt) - wanted).max()

    assert off(2.5e-4) < 0.02
    assert off(1e-3) / off(2.5e-4) == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize("filtering", [0.0, 0.02, 0.1])
def test_the_derivative_s_filter_cuts_noise_off(filtering):
    """White noise of e leaves with the variance 2 K_d^2/((T_f + dt)^2 (1 + a)), a = T_f/(T_f + dt)."""
    kd, a = 0.3, filtering / (filtering + DT)
    u = answer([0, 0, kd], filtering, errors(count=40_000))
    assert np.std(u) == pytest.approx(kd / (filtering + DT) * np.sqrt(2 / (1 + a)), rel=0.03)


def test_the_derivative_answers_a_step_with_its_area():
    """K_d in all, whatever the filter."""
    e = np.where(np.arange(N) < 5, 0.0, 1.0)
    u = answer([0, 0, 0.3], 0.05, e)
    assert u[5] == pytest.approx(0.3 / 0.06, rel=1e-12)
    assert np.sum(u) * DT == pytest.approx(0.3, rel=1e-9)


@pytest.fixture(scope="module")
def overshoots():
    """Of a slow lag after a step, under limits that the controller knows, or does not, of range or of rate."""
    step = np.where(np.arange(1000) < 2, 0.0, 1.0)
    valve = Chain((Saturation(*of(-1.2, 1.2)), SlewLimit(*of(0.4)), lag(1.0, 0.8)))
    found = {}
    for what, reach in (("known", ActuatorLimits(*of(-1.2, 1.2, 0.4))), ("unknown", UNLIMITED)):
        track = around(valve).run(pid_of([6.0, 10.0, 0.0], 0.01, reach), step)
        found[what] = np.asarray(track.output)
    return found


def test_the_integral_does_not_wind_up(overshoots):
    """Where it does not know the limits the output goes far beyond, for long."""
    known, unknown = (overshoots[one].max() - 1 for one in ("known", "unknown"))
    assert unknown > 0.15
    assert known < 0.25 * unknown
    assert abs(overshoots["known"][-1] - 1) < 1e-3


def test_a_held_integral_comes_off_its_limit_at_once():
    """After a long time at the limit the command leaves it with the sign of the error."""
    reach = ActuatorLimits(*of(-1.0, 1.0, np.inf))
    e = np.concatenate([np.zeros(1), np.full(300, 2.0), np.full(5, -0.1)])
    u = answer([1.0, 3.0, 0.0], 0.01, e, reach=reach)
    assert np.all(u[2:301] == 1.0)
    assert np.all(u[301:] < 1.0)
    assert np.all(answer([1.0, 3.0, 0.0], 0.01, e)[301:] > 1.0)


def test_the_integral_goes_on_where_it_leads_away_from_the_limit():
    """Against a limit on the other side: the slew holds the command back, the error changes its sign."""
    u = answer([0.0, 2.0, 0.0], 0.01, errors(2), reach=ActuatorLimits(*of(-0.02, 0.02, np.inf)))
    assert np.sum(u == 0.02) > 2
    assert np.sum(np.abs(u) < 0.02) > 20


@given(st.integers(0, 1000))
def test_a_change_of_gains_makes_no_bump(seed):
    """Without a derivative each command is the last one, K_p (e - e') and K_i dt e, with the gains of its sample."""
    rng = np.random.default_rng(seed)
    gains = np.column_stack([rng.uniform(0, 50, (N, 2)), np.zeros(N)])
    e, none = errors(seed), jnp.zeros(N)
    law = PIDRegulator(none, none, jnp.asarray(gains), jnp.asarray(0.1), UNLIMITED, DT)
    u = np.asarray(commands(law, -e))
    wanted = np.cumsum(gains[1:, 0] * np.diff(e) + gains[1:, 1] * DT * e[1:])
    np.testing.assert_allclose(u[1:], wanted, atol=1e-10)


def schedule(ki=0.0):
    gains = jnp.array([[1.0, ki, 0.0], [20.0, 4 * ki, 0.0]])
    return GainSchedule(*of([0.5, 2.0]), gains, *of(0.02), UNLIMITED)


def test_scheduled_gains_change_under_a_standing_error_without_a_bump():
    """K_p grows by 20 from a sample to the next; without this the command would jump by 19 x 0.3."""
    reference = wave("varying", None, DT, amplitude=(1.0, 1.0), frequency=(0.5, 2.0))
    law = schedule().planned(reference, DT)
    assert np.ptp(law.gains[:, 0]) > 18
    u = commands(law, reference - 0.3, 0.7, reference[0] - 0.3)
    np.testing.assert_allclose(u, 0.7, rtol=1e-12)


@pytest.mark.parametrize(("frequency", "kp"), [(0.25, 1.0), (0.5, 1.0), (1.0, 10.5), (2.0, 20.0), (4.0, 20.0)])
def test_scheduled_gains_lie_between_those_of_the_table_on_a_logarithmic_scale(frequency, kp):
    """1 Hz is halfway between 0.5 Hz and 2 Hz; beyond the table its ends hold."""
    law = schedule(3.0).planned(wave("sine", 12.0, 1e-3, amplitude=1.0, frequency=frequency), 1e-3)
    np.testing.assert_allclose(law.gains[:, 0], kp, rtol=0.01)
    np.testing.assert_allclose(law.gains[:, 1], 3.0 + 9.0 * (kp - 1) / 19, rtol=0.01)


def test_what_stands_still_has_the_gains_of_the_lowest_frequency():
    np.testing.assert_allclose(schedule().planned(np.ones(50), DT).gains[:, 0], 1.0, rtol=1e-12)


def test_slower_than_its_rate_nothing_is_limited():
    """`limit` gives the nearest command: the rate counts first, the range always."""
    reach = ActuatorLimits(*of(-1.0, 2.0, 10.0))
    cases = [
        (0.05, 0.0, 0.05),
        (0.5, 0.0, 0.1),
        (-0.5, 0.0, -0.1),
        (5.0, 1.95, 2.0),
        (-5.0, -0.95, -1.0),
        (0.0, 4.0, 2.0),
    ]
    for wanted, before, nearest in cases:
        assert float(reach.limit(*of(wanted, before), DT)) == pytest.approx(nearest, rel=1e-12)
