"""Margins against closed forms, and against loops that run."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.controllers import margins, open_loop, pid_of
from nectosome.drives import Chain, PrandtlIshlinskii

from .simple_loops import DT, UNLIMITED, around, integrator, lag, late, of

F = np.geomspace(1e-3, 50, 4000)  # Hz
S = 2j * np.pi * F


def gains(kp=0.0, ki=0.0, kd=0.0, filtering=0.02):
    return pid_of([kp, ki, kd], filtering, UNLIMITED)


def test_an_integrator_bears_a_quarter_of_a_turn():
    """L = K/s: |L| = 1 at K, 90 degrees, pi/2/K; no gain makes it swing."""
    found = margins(F, 3.0 / S)
    assert found.gain == np.inf
    assert found[1:] == pytest.approx((np.pi / 2, np.pi / 2 / 3.0, 3.0 / (2 * np.pi)), rel=1e-6)


def test_an_integrator_with_a_lag():
    """L = K/(s (s + 1)): w^2 (1 + w^2) = K^2, 90 degrees less atan w."""
    K = 2.0
    w = np.sqrt((np.sqrt(1 + 4 * K**2) - 1) / 2)
    phase = np.pi / 2 - np.arctan(w)
    found = margins(F, K / (S * (S + 1)))
    assert found.gain == np.inf
    assert found[1:] == pytest.approx((phase, phase / w, w / (2 * np.pi)), rel=1e-4)


@pytest.mark.parametrize("K", [0.5, 1.9, 2.1, 8.0])
def test_three_lags_swing_from_a_gain_of_2_on(K):
    """L = K/(s (s + 1)^2): the phase is -180 degrees at w = 1, where |L| = K/2."""
    found = margins(F, K / (S * (S + 1) ** 2))
    assert found.gain == pytest.approx(2 / K, rel=1e-4)
    assert np.sign(found.phase) == np.sign(found.delay) == (1 if K < 2 else -1)


def test_a_pure_delay_under_an_integral():
    """L = K e^(-s T)/s: swings where K T = pi/2, whatever turns the phase has made by then."""
    T = 0.1
    for K in (3.0, 15.0, 17.0, 30.0, 50.0, 75.0):
        found = margins(F, K * np.exp(-S * T) / S)
        assert found.gain == pytest.approx(np.pi / 2 / (K * T), rel=1e-3)
        steady = np.pi / 2 / T > K
        assert (found.phase > 0) == (found.delay > 0) == steady
        if K < 40:
            assert found.phase == pytest.approx(np.pi / 2 - K * T, rel=1e-3)
            assert found.delay == pytest.approx((np.pi / 2 - K * T) / K, rel=1e-3)


def test_a_resonance_that_turns_far_beyond_is_steady():
    """Above 1 again only between -180 and -540 degrees: only a further lag of a turn less some, or a lead, would do."""
    resonance = 10.0**2 / (S**2 + 2 * 0.02 * 10.0 * S + 10.0**2)
    behind = np.exp(-S * 0.4)  # 229 degrees at the resonance, which adds 90
    found = margins(F, 0.2 * resonance * behind)
    assert found.phase > 0
    assert margins(F, 0.2 * resonance * np.exp(-S * 0.1)).phase < 0  # 57 + 90 to 180: right into it


def test_the_wrong_sign_swings():
    """L = -2/(s + 1): exp(t)."""
    assert margins(F, -2 / (S + 1)).phase < 0
    assert margins(F, -0.5 / (S + 1)).phase == np.inf


def test_a_double_integrator_needs_a_lead():
    """L = K (1 + s)/s^2 is steady for each K; with the lead before the integral, L = K/(s^2 (s + 1)), it never is."""
    assert margins(F, 3.0 * (1 + S) / S**2).phase > 0
    assert margins(F, 3.0 / (S**2 * (S + 1))).phase < 0


def test_a_loop_above_1_at_all_frequencies_has_no_margins():
    found = margins(F, 1e6 / S)
    assert found.phase == found.delay == -np.inf
    assert found.gain == 0


@pytest.fixture(scope="module")
def answers():
    """Of a lag under all three gains, with a delay of two samples."""
    law = gains(2.0, 3.0, 0.1)
    return law, open_loop(around(late(lag(0.8, 0.3), 2 * DT)), law, 0.7)


def test_the_open_loop_is_that_of_samples(answers):
    """A lag of commands that are held, the PID's differences, a delay of whole samples: in closed form."""
    frequency, found = answers[1]
    z = np.exp(2j * np.pi * frequency * DT)
    a, f = np.exp(-DT / 0.3), 0.02
    block = 0.8 * (1 - a) / (z - a) / z**2
    law = 2.0 + 3.0 * DT / (1 - 1 / z) + 0.1 * (1 - 1 / z) / (f + DT - f / z)
    np.testing.assert_allclose(found, block * law, rtol=1e-6)


def test_a_held_command_is_late_by_half_a_sample():
    """An integrator under a gain: 90 degrees, and w dt/2; |L| = 1 where 2 sin(w dt/2) = K dt."""
    K = 8.0
    w = 2 * np.arcsin(K * DT / 2) / DT
    found = margins(*open_loop(around(integrator()), gains(K), 1.0))
    assert found.phase == pytest.approx(np.pi / 2 - w * DT / 2, rel=1e-3)
    assert found.delay == pytest.approx(np.pi / 2 / w - DT / 2, rel=2e-3)


@pytest.mark.parametrize("block", [integrator(), lag(6.0, 0.5)], ids=["integrator", "lag"])
def test_a_loop_settles_just_below_its_delay_margin_and_swings_just_above(block):
    law = gains(1.0, 0.5)
    longest = margins(*open_loop(around(block), law, 1.0)).delay
    growth = [_growth(around(late(block, share * longest, 800), substeps=4), law) for share in (0.95, 1.05)]
    assert growth[0] < 0.9
    assert growth[1] > 1.1


@pytest.mark.parametrize("share", [0.97, 1.03])
def test_a_loop_settles_just_below_its_gain_margin_and_swings_just_above(answers, share):
    law, response = answers
    most = share * margins(*response).gain
    law = eqx.tree_at(
        lambda x: (x.proportional, x.integral, x.derivative), law, tuple(of(*(most * g for g in (2, 3, 0.1))))
    )
    growth = _growth(around(late(lag(0.8, 0.3), 2 * DT)), law)
    assert growth < 0.9 if share < 1 else growth > 1.1
    again = margins(*open_loop(around(late(lag(0.8, 0.3), 2 * DT)), law, 0.7))
    assert again.gain == pytest.approx(1 / share, rel=1e-3)
    assert np.sign(again.phase) == np.sign(1 - share)


def _growth(loop, law):
    """Of the errors, from the first half of the swings after a step to the second."""
    error = np.asarray(loop.run(law, np.where(np.arange(1500) < 2, 0.0, 1.0)).output) - 1.0
    first, last = error[500:1000], error[1000:]
    return np.ptp(last) / np.ptp(first)


def test_gains_far_too_high_do_not_look_safe():
    """At each frequency above 1: it swings from sample to sample."""
    assert margins(*open_loop(around(integrator()), gains(1e4), 1.0)).phase < 0


def test_hysteresis_by_its_describing_function():
    """A play of half width r and a direct part: only that for small commands; for large ones also the play's first
    harmonic, N = (pi/2 + asin c + c sqrt(1 - c^2))/pi - j 4 (r/A)(1 - r/A)/pi with c = 1 - 2 r/A.
    """
    r, tail = 0.5, lag(1.0, 0.2)
    loop = around(Chain((PrandtlIshlinskii(*of(1.0, [r], [2.0])), tail)))
    law = gains(0.0, 2.0)
    frequency, bare = open_loop(around(tail), law, 1.0)
    slow = frequency < 1.0  # where a period has a hundred samples
    _, small = open_loop(loop, law, 0.4)
    np.testing.assert_allclose(small, bare, rtol=1e-9)
    A = 1.5
    c = 1 - 2 * r / A
    N = (np.pi / 2 + np.arcsin(c) + c * np.sqrt(1 - c**2)) / np.pi - 4j * (r / A) * (1 - r / A) / np.pi
    _, large = open_loop(loop, law, A)
    np.testing.assert_allclose((large / bare)[slow], 1 + 2 * N, rtol=2e-3)
    assert margins(frequency, large).delay < margins(frequency, small).delay


def test_how_commands_are_scaled_does_not_matter():
    """Margins of a linear loop are those at any amplitude."""
    found = [
        margins(*open_loop(around(late(lag(1.0, 0.3), 0.05)), gains(1.0, 4.0), jnp.asarray(a))) for a in (1e-5, 1e5)
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-9)
