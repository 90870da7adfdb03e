"""Valves, tanks, dead time and sensors."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.drives import (
    DeadTime,
    Integrated,
    PrandtlIshlinskii,
    Saturation,
    Sensor,
    SlewLimit,
    Stiction,
    Tank,
    respond,
)


def of(*numbers):
    return [jnp.asarray(float(x)) for x in numbers]


def test_a_slew_limit_follows_slow_inputs_and_lags_behind_fast_ones():
    """A triangle steeper than the limit becomes one as steep as the limit."""
    dt, t = 0.001, 0.001 * np.arange(3001)
    slow = 0.3 * np.sin(2 * np.pi * t)
    np.testing.assert_allclose(respond(SlewLimit(*of(2.0)), slow, dt), slow, atol=1e-12)
    ramp = respond(SlewLimit(*of(2.0)), 5.0 * t, dt)
    np.testing.assert_allclose(ramp, 2.0 * t, atol=1e-12)
    assert np.abs(np.diff(respond(SlewLimit(*of(0.5)), slow, dt))).max() <= 0.5 * dt * (1 + 1e-9)


def test_a_slew_limit_takes_no_jumps():
    y = respond(SlewLimit(*of(2.0)), np.ones(1001), 0.001, "zero")
    np.testing.assert_allclose(y, np.minimum(0.002 * np.arange(1001), 1.0), atol=1e-12)


def test_a_dead_band_is_what_a_reversal_takes_and_a_resolution_the_step():
    """Up to 1 and back, in steps of 0.1: on the way back nothing for 0.2 and a step."""
    u = np.concatenate([np.linspace(0, 1, 1001), np.linspace(1, 0, 1001)[1:]])
    y = np.asarray(respond(Stiction(*of(0.2, 0.1)), u, 0.01))
    np.testing.assert_allclose(np.unique(np.round(np.abs(np.diff(y)), 12)), [0.0, 0.1])
    first, back = np.flatnonzero(np.diff(y) > 0), np.flatnonzero(np.diff(y) < 0)
    np.testing.assert_allclose(u[first + 1], np.arange(0.2, 1.01, 0.1), atol=1e-3)
    np.testing.assert_allclose(u[back + 1], np.arange(0.7, -0.01, -0.1), atol=1e-3)


def test_without_a_resolution_stiction_is_a_play():
    u = np.cumsum(np.random.default_rng(3).normal(size=300))
    play = PrandtlIshlinskii(jnp.zeros(()), jnp.array([0.7]), jnp.ones(1))
    np.testing.assert_allclose(respond(Stiction(*of(1.4, 0.0)), u, 0.1), respond(play, u, 0.1), atol=1e-12)
    np.testing.assert_allclose(respond(Stiction(*of(0.0, 0.0)), u, 0.1), u, atol=1e-12)


def test_stiction_does_not_depend_on_how_often_its_input_is_sampled():
    u = np.cumsum(np.random.default_rng(4).normal(size=200))
    fine = np.interp(np.arange(1991) / 10, np.arange(200), u)
    valve = Stiction(*of(0.8, 0.37))
    np.testing.assert_allclose(respond(valve, fine, 0.1)[::10], respond(valve, u, 1.0), atol=1e-9)


def test_saturation_keeps_within_its_range():
    np.testing.assert_array_equal(respond(Saturation(*of(-1, 2)), np.array([-3.0, 0.5, 7.0]), 0.1), [-1.0, 0.5, 2.0])


@pytest.mark.parametrize("delay", [0.0, 0.03, 0.1, 0.25])
@pytest.mark.parametrize("hold", ["first", "zero"])
def test_dead_time_of_whole_samples_is_a_shift(delay, hold):
    u = np.random.default_rng(0).normal(size=100)
    k = round(delay / 0.01)
    found = respond(DeadTime(jnp.asarray(delay), 25), u, 0.01, hold)
    np.testing.assert_allclose(found, np.concatenate([np.zeros(k), u[: 100 - k]]), atol=1e-12)


def test_dead_time_may_be_any():
    """What is straight comes later, unbent; and its slope by the delay is the one of the input."""
    t = 0.01 * np.arange(100)

    def at(delay):
        return respond(DeadTime(delay, 20), 3.0 * t, 0.01)

    np.testing.assert_allclose(at(jnp.asarray(0.0737)), np.maximum(3.0 * (t - 0.0737), 0), atol=1e-12)
    slopes = jax.jacfwd(at)(jnp.asarray(0.0737))
    np.testing.assert_allclose(slopes[10:], -3.0, rtol=1e-9)


def test_a_delay_longer_than_what_is_kept_is_no_number():
    u = np.arange(50.0)
    assert np.isfinite(respond(DeadTime(jnp.asarray(0.1), 10), u, 0.01)).all()
    for delay in (0.105, -0.01):
        assert np.isnan(respond(DeadTime(jnp.asarray(delay), 10), u, 0.01)).all()


C, V, B, SUPPLY, EXHAUST = 2e-9, 1e-3, 0.3, 3e5, -8e4
TANK = Integrated(Tank(*of(V, C, B, SUPPLY, EXHAUST, 1e3, 293.15)), 4)


def test_a_tank_fills_no_faster_than_sound():
    """Choked, dp/dt = C p_1 p_0/V: constant; which is the limit of the rate of a valve."""
    dt = 1e-3
    p = np.asarray(respond(TANK, np.full(200, 6e4), dt, "zero"))
    rate = C * (SUPPLY + 101325) * 1e5 / V
    assert (p[50] + 101325) / (SUPPLY + 101325) < B + 0.1
    np.testing.assert_allclose(np.diff(p)[:10], rate * dt, rtol=1e-9)
    assert np.diff(p).max() <= rate * dt * (1 + 1e-9)


def test_a_tank_empties_as_a_choked_orifice_does():
    """dp/dt = -C p_0/V (p + p_a): an exponential."""
    down = np.asarray(respond(TANK, np.concatenate([np.full(600, 2.5e5), np.full(100, -7e4)]), 1e-3, "zero"))
    absolute = down[601:640] + 101325
    assert absolute.min() * B > EXHAUST + 101325
    np.testing.assert_allclose(np.diff(np.log(absolute)), -C * 1e5 / V * 1e-3, rtol=1e-6)


def test_a_tank_settles_at_what_it_is_told_and_stays_at_its_supplies():
    settled = respond(TANK, np.full(4000, 6e4), 1e-3, "zero")[-1]
    assert float(settled) == pytest.approx(6e4, rel=1e-6)
    full = respond(TANK, np.full(8000, 9e5), 1e-3, "zero")
    assert float(full[-1]) == pytest.approx(SUPPLY, rel=1e-3)
    assert np.isfinite(full).all()
    assert float(full.max()) <= SUPPLY * (1 + 1e-9)


def test_a_sensor_is_as_noisy_as_it_says_and_ends_at_its_range():
    sensor = Sensor(*of(0.05, -1, 1), jnp.asarray(3))
    y = np.asarray(respond(sensor, np.zeros(20000), 0.01))
    assert y.std() == pytest.approx(0.05, rel=0.02)
    assert abs(np.corrcoef(y[1:], y[:-1])[0, 1]) < 0.02
    assert np.asarray(respond(sensor, np.full(100, 5.0), 0.01)).max() == 1.0
