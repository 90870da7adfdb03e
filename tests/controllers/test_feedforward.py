"""Feedforward by the inverse of a model: exact where it can be, and what it is worth alone."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.controllers import ActuatorLimits, Feedforward, check_reachable, eased, hysteretic, pid_of, wave
from nectosome.controllers.feedforward import convolved, smoothing
from nectosome.drives import Chain, DeadTime, TransferFunction, evenly, respond
from nectosome.units import InputError

from .simple_loops import DT, UNLIMITED, around, dynamics, linear, model, of, plays

FINE = 1e-3
NOTHING = pid_of([0.0, 0.0, 0.0], 0.02, UNLIMITED)
SMOOTH = eased(wave("sine", 4.0, DT, amplitude=1.0, frequency=1.0), 2.0, DT)
NUMBERS = st.floats(-3.0, 3.0)


@given(st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS), st.sampled_from([0.001, 0.05, 0.3]))
def test_kernels_are_exact_for_cubics(c, width):
    """Values and three derivatives, wherever the window is within the samples."""
    t = np.arange(80) * DT
    x = np.polynomial.Polynomial(c)
    kernels = smoothing(width, DT, 3)
    half = kernels.shape[1] // 2
    assert kernels.shape[1] == 2 * half + 1 >= 5
    assert kernels.shape[1] * DT >= width
    for k, kernel in enumerate(kernels):
        found = convolved(kernel, jnp.asarray(x(t)))[half:-half]
        wanted = x.deriv(k)(t) if k else x(t)
        np.testing.assert_allclose(found, wanted[half:-half], atol=1e-10 * (1 / DT) ** k)


def test_ends_go_on_as_they_are():
    np.testing.assert_allclose(convolved(smoothing(0.1, DT, 0)[0], jnp.full(7, 2.5)), 2.5, rtol=1e-12)
    np.testing.assert_allclose(convolved(smoothing(0.1, DT, 1)[1], jnp.full(7, 2.5)), 0.0, atol=1e-11)


@pytest.mark.parametrize("a", [(0.3, 2.0), (0.02, 0.3, 2.0), (0.001, 0.02, 0.3, 2.0)])
def test_the_dynamics_driven_so_follow_a_cubic(a):
    """a_n r^(n) + ... + a_0 r over b_0, of the first, second and third order."""
    t = np.arange(80) * DT
    r = np.polynomial.Polynomial([0.2, -1.0, 0.5, 2.0])
    known = hysteretic(linear(), TransferFunction(*of([1.6], a)), 0.0)
    wanted = sum(one * (r.deriv(k)(t) if k else r(t)) for k, one in enumerate(a[::-1])) / 1.6
    found = known.dynamics_input(jnp.asarray(r(t)), DT, 0.08)
    np.testing.assert_allclose(found[4:-4], wanted[4:-4], atol=1e-8)


@pytest.mark.parametrize("zeros", [(-5.0,), (5.0,), (-8.0, 6.0), (4.0 + 6.0j, 4.0 - 6.0j)])
def test_dynamics_with_zeros_on_either_side_follow_too(zeros):
    """By their stable inverse, that of a zero to the right from the end: what it commands gives the reference back."""
    poles = [-20.0, -9.0 + 12.0j, -9.0 - 12.0j]
    above, below = np.poly(zeros).real, np.poly(poles).real
    t = np.arange(5000) * FINE
    r = np.exp(-(((t - 3.0) / 0.25) ** 2))  # rests at both ends
    known = hysteretic(linear(), TransferFunction(*of(above / above[-1], below / below[-1])), 0.0)
    v = known.dynamics_input(jnp.asarray(r), FINE, 0.02)
    np.testing.assert_allclose(respond(known.dynamics, v, FINE), r, atol=1e-3)
    assert np.abs(v).max() < 20


def test_a_zero_that_a_reference_is_too_short_for_is_refused():
    known = hysteretic(linear(), TransferFunction(*of([-10.0, 1.0], [0.01, 0.2, 1.0])), 0.0)
    with pytest.raises(
        InputError, match=r"model: has a zero at 0\.1 /s: its inverse needs a reference of 3 of its time"
    ):
        known.dynamics_input(jnp.asarray(SMOOTH), DT, 0.08)


def test_a_reference_that_stays_needs_no_length():
    """Margins and a live loop are about one value: the input is that over the gain, however slow a zero."""
    known = hysteretic(linear(2.0), TransferFunction(*of([-0.02, 0.3, 1.6], [0.01, 0.2, 0.4])), 0.0)
    v = known.dynamics_input(jnp.full(1, 0.6), DT, 0.08)
    np.testing.assert_allclose(v, 0.6 * 0.4 / 1.6, rtol=1e-12)
    Feedforward(NOTHING, known, 0.08).planned(np.zeros(2), DT)  # as margins do


@pytest.mark.parametrize("numerator", [[0.01, 0.0, 1.0], [0.1, 0.0]])
def test_a_zero_that_is_no_lag_is_refused_of_any_reference(numerator):
    known = hysteretic(linear(), TransferFunction(*of(numerator, [0.01, 0.2, 1.0])), 0.0)
    for reference in (np.full(4, 0.6), SMOOTH):
        with pytest.raises(InputError, match=r"model: has a zero at "):
            known.dynamics_input(jnp.asarray(reference), DT, 0.08)


@pytest.mark.parametrize("delay", [0.0, 0.013, 0.05])
def test_commands_are_sent_ahead_by_the_delay_and_half_a_sample(delay):
    """Along a line; the last value stands where the line has ended."""
    known = hysteretic(linear(2.0), dynamics(), delay)
    t = np.arange(60) * DT
    found = np.asarray(known.command(jnp.asarray(3 * t), DT))
    np.testing.assert_allclose(found, 1.5 * np.minimum(t + delay + DT / 2, t[-1]), rtol=1e-12)


def test_the_inverse_undoes_the_hysteresis():
    known, wanted = model(), jnp.asarray(SMOOTH)
    np.testing.assert_allclose(respond(known.hysteresis, respond(known.inverse, wanted, DT), DT), wanted, atol=1e-12)


@pytest.fixture(scope="module")
def alone():
    """Errors on the model itself, by samples [s], with or without what the inverse consists of; range 2."""

    def error(dt, known=None, block=None):
        reference = np.concatenate(
            [np.zeros(round(0.1 / dt)), eased(wave("sine", 3.0, dt, amplitude=1.0, frequency=1.0), 2.0, dt)]
        )
        plant = block or Chain((DeadTime(jnp.asarray(0.02), 60), plays(), dynamics()))
        way = Feedforward(NOTHING, known or hysteretic(plays(), dynamics(), 0.02), 0.04)
        off = (np.asarray(around(plant, dt).run(way, reference).output) - reference)[: -round(0.1 / dt)]
        return np.sqrt(np.mean(off**2)) / 2

    return error


def test_alone_it_follows_on_its_own_model(alone):
    """Gains of 0, no noise: 0.05 % rms of the range at 100 Hz; less with shorter samples."""
    errors = [alone(dt) for dt in (0.01, 0.002)]
    assert errors[0] < 5e-4
    assert errors[1] < 0.6 * errors[0]


def test_each_part_of_the_inverse_counts(alone):
    """Without the delay, the dynamics or the plays the error is 10 times as large, or more."""
    least = alone(0.01)
    quick = TransferFunction(*of([1.0], [1e-6, 1e-3, 1.0]))
    for known in (
        hysteretic(plays(), dynamics(), 0.0),
        hysteretic(plays(), quick, 0.02),
        hysteretic(linear(float(plays().slopes()[-1])), dynamics(), 0.02),
    ):
        assert alone(0.01, known) > 10 * least


def test_what_the_model_lacks_is_the_pid_s():
    """The plant is 20 % stronger: a PID beside the feedforward takes half of the error away; alone it errs far more."""
    strong = Chain((DeadTime(jnp.asarray(DT), 10), plays(), TransferFunction(*of([1.2 * 400], [1.0, 36.0, 400.0]))))
    pid = pid_of([0.5, 12.0, 0.01], 0.02, UNLIMITED)
    errors = [
        np.std(np.asarray(around(strong).run(way, SMOOTH).output) - SMOOTH)
        for way in (Feedforward(NOTHING, model(), 0.08), pid, Feedforward(pid, model(), 0.08))
    ]
    assert errors[2] < 0.6 * min(errors[0], 0.3 * errors[1])


def test_what_has_no_inverse_is_refused():
    with pytest.raises(InputError, match="no inverse"):
        hysteretic(evenly(np.array([0.5, -1.2]), 1.0, 0.6), dynamics(), DT)
    with pytest.raises(InputError, match="model: has dynamics of order 4: controllers invert those of order 3 at most"):
        hysteretic(plays(), TransferFunction(*of([1.0], [1.0, 4.0, 6.0, 4.0, 1.0])), DT)


REACH = ActuatorLimits(*of(-1.5, 1.5, 30.0))


def test_what_is_out_of_reach_is_named_with_what_is_not():
    """The share that it offers is within reach, and a little more is not; nothing is said of what is within."""
    check_reachable(model(), REACH, 0.5 * SMOOTH, DT)
    with pytest.raises(InputError, match=r"beyond the limits of -1\.5 Pa to 1\.5 Pa") as told:
        check_reachable(model(), REACH, 3 * SMOOTH, DT)
    offered = 1e-3 * float(str(told.value).rsplit("amplitude of ", 1)[1].removesuffix(" mm."))
    check_reachable(model(), REACH, 0.999 * offered * SMOOTH / (np.ptp(SMOOTH) / 2), DT)
    with pytest.raises(InputError):
        check_reachable(model(), REACH, 1.01 * offered * SMOOTH / (np.ptp(SMOOTH) / 2), DT)


def test_rates_out_of_reach_are_told_but_corners_are_not():
    slow = eqx.tree_at(lambda one: one.slew, REACH, jnp.asarray(2.0))
    with pytest.raises(InputError, match="beyond the slew limit of 2 Pa a second"):
        check_reachable(model(), slow, 0.5 * SMOOTH, DT)
    corners = wave("triangle", 8.0, DT, amplitude=0.6, frequency=0.25)
    check_reachable(model(), slow, corners, DT)
    command = np.asarray(model().command(model().dynamics_input(jnp.asarray(corners), DT, 0.08), DT))
    assert np.abs(np.diff(command)).max() / DT > 2.0
