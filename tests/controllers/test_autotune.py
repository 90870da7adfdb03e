"""The swing under a relay against where the plant's phase is -180 degrees."""

import numpy as np
import pytest
from scipy.optimize import brentq

from nectosome.controllers import BlockLoop, Relay, pid_of, ultimate
from nectosome.drives import Chain, Sensor
from nectosome.units import InputError

from .simple_loops import DT, UNLIMITED, around, dynamics, lag, late, of

DELAY = 0.08
COUNT = 600


def swung(block, band=0.0, amplitude=1.0, noise=0.0, dt=DT, count=COUNT, seed=0):
    sensor = Sensor(*of(noise, -np.inf, np.inf), np.asarray(seed))
    track = BlockLoop(block, sensor, dt, 2).run(Relay(*of(amplitude, band)), np.zeros(count))
    return np.asarray(track.measured), np.asarray(track.command)


def turning(response):
    """Angular frequency at which the phase of a response is -180 degrees."""
    return brentq(lambda w: np.angle(-response(1j * w)), 2.0, 30.0)


PLANTS = {
    "second order": (late(dynamics(), DELAY), lambda s: 400 / (s**2 + 36 * s + 400)),
    "lag": (late(Chain((lag(2.0, 0.5), lag(1.0, 0.1))), DELAY), lambda s: 2 / (0.5 * s + 1) / (0.1 * s + 1)),
}


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize("amplitude", [1.0, 1e5])
def test_it_finds_gain_and_period_of_a_known_plant(name, amplitude):
    """To 5 %, what harmonics are worth; a held command is late by half a sample."""
    block, bare = PLANTS[name]

    def response(s):
        return bare(s) * np.exp(-s * (DELAY + DT / 2))

    w = turning(response)
    found = ultimate(*swung(block, amplitude=amplitude), DT, 0.0)
    assert found.period == pytest.approx(2 * np.pi / w, rel=0.05)
    assert found.gain == pytest.approx(1 / abs(response(1j * w)), rel=0.05)


def test_a_band_makes_the_swing_wider_and_slower_and_its_share_is_taken_off():
    """Where the phase is -180 degrees and asin(band/a): |G| = pi a/(4 d)."""
    block, bare = PLANTS["second order"]
    band = 0.2
    measured, command = swung(block, band)
    found = ultimate(measured, command, DT, band)
    a = 0.5 * np.ptp(measured[-200:])

    def response(s):
        return bare(s) * np.exp(-s * (DELAY + DT / 2)) * np.exp(-1j * np.arcsin(band / a))

    w = turning(response)
    assert found.period == pytest.approx(2 * np.pi / w, rel=0.05)
    assert a == pytest.approx(4 / np.pi * abs(bare(1j * w)), rel=0.05)
    assert found.gain == pytest.approx(4 / np.pi / np.sqrt(a**2 - band**2), rel=0.02)
    assert found.period > 1.05 * ultimate(*swung(block), DT, 0.0).period


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_within_the_band_does_little(seed):
    """7 standard deviations wide: gain and period to 10 %."""
    block, _ = PLANTS["lag"]
    clean, noisy = (ultimate(*swung(block, 0.15, noise=one, seed=seed), DT, 0.15) for one in (0.0, 0.02))
    assert noisy.period == pytest.approx(clean.period, rel=0.1)
    assert noisy.gain == pytest.approx(clean.gain, rel=0.1)


def test_noise_beyond_the_band_is_told():
    block, _ = PLANTS["lag"]
    with pytest.raises(InputError, match="a wider band"):
        ultimate(*swung(block, 0.0, noise=0.2, seed=4), DT, 0.0)


def test_what_does_not_swing_is_told():
    """Within the band for ever; too short a recording; an answer that grows."""
    block, _ = PLANTS["lag"]
    with pytest.raises(InputError, match="switched up 0 times; 5 are needed"):
        ultimate(*swung(block, band=5.0), DT, 5.0)
    measured, command = swung(block)
    with pytest.raises(InputError, match="Give it more time"):
        ultimate(measured[:150], command[:150], DT, 0.0)
    t = np.arange(COUNT) * DT
    square = np.where(np.sin(8 * t) >= 0, 1.0, -1.0)
    with pytest.raises(InputError, match="not steady: the last amplitudes are"):
        ultimate(np.exp(t) * np.sin(8 * t), square, DT, 0.0)
    slower = np.sin(50 * np.log1p(t))
    with pytest.raises(InputError, match="not steady: the last periods are"):
        ultimate(slower, np.where(slower >= 0, 1.0, -1.0), DT, 0.0)
    with pytest.raises(InputError, match="it does not respond"):
        ultimate(0.1 * np.sin(8 * t), square, DT, 0.2)


def test_the_gains_are_those_of_tyreus_and_luyben_and_make_a_good_loop():
    """K_u/2.2, T_i = 2.2 T_u, T_d = T_u/6.3; a step is within 5 % after 5 T_u, with less than 25 % too much."""
    block, _ = PLANTS["lag"]
    found = ultimate(*swung(block), DT, 0.0)
    kp, ki, kd = found.pid()
    assert (kp, kp / ki, kd / kp) == pytest.approx((found.gain / 2.2, 2.2 * found.period, found.period / 6.3))
    step = np.where(np.arange(600) < 2, 0.0, 1.0)
    output = np.asarray(around(block).run(pid_of(found.pid(), 0.02, UNLIMITED), step).output)
    assert output.max() < 1.25
    assert np.abs(output[2 + int(5 * found.period / DT) :] - 1).max() < 0.05


def test_it_keeps_its_command_within_the_band_and_turns_beyond():
    regulator = Relay(*of(2.0, 0.5)).planned(np.zeros(1), DT)
    state, found = regulator.initial(-1.0, 0.0), []
    for y in (0.0, 0.4, -0.4, -0.6, 0.4, 0.6, -0.4):
        state, command = regulator.step(state, of(y)[0])
        found.append(float(command))
    assert found == [-2, -2, -2, 2, 2, -2, -2]
