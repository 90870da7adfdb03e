"""Dead times of a soft actuator: any part of a sample comes back, and where one was left out it is told."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import nnls

from nectosome.drives import Chain, SlewLimit, Stiction, respond
from nectosome.identification.hysteresis.files import HysteresisFit, saved_model
from nectosome.identification.hysteresis.fit import HysteresisModel, fit_hysteresis
from nectosome.identification.hysteresis.trials import PressureTrial
from nectosome.units import InputError

from .test_hysteresis import DAMPING, DT, FREQUENCY, HYSTERESIS, PLANT, SLOPES, recordings, waves

FINE = 20  # samples within a sample
DYNAMICS = PLANT.blocks[1]


def late(delay, noise=0.0, seed=0, frequencies=(0.75, 1.5), valve=None, first=0):
    """Recordings with a delay [samples, of 1/20]: what drives the dynamics is straight between samples, as theirs."""
    rng, out = np.random.default_rng(seed), []
    for frequency in frequencies:
        p = waves(frequency)[first:]
        x = np.asarray(respond(HYSTERESIS if valve is None else Chain((*valve, HYSTERESIS)), p, DT))
        fine = np.interp(np.arange((len(p) - 1) * FINE + 1) / FINE, np.arange(len(p)), x)
        y = np.asarray(respond(DYNAMICS, fine, DT / FINE))
        y = np.concatenate([np.zeros(round(delay * FINE)), y])[: len(fine) : FINE]
        out.append(PressureTrial(f"{frequency} Hz", DT, p, y + noise * rng.normal(size=len(p))))
    return out


@pytest.mark.parametrize("delay", [0.0, 0.5, 1.0, 2.7])
def test_a_dead_time_of_any_part_of_a_sample_is_found(delay):
    """Exactly, since the answer between the samples is."""
    found = fit_hysteresis(late(delay), dead_time=True)
    assert found.theta["dead_time"] == pytest.approx(delay * DT, abs=1e-5 * DT)
    assert found.theta["frequency"] == pytest.approx(FREQUENCY, rel=1e-5)
    assert found.theta["damping"] == pytest.approx(DAMPING, rel=1e-5)
    np.testing.assert_allclose(found.slopes, SLOPES, rtol=1e-5)
    assert found.noise < 1e-8


def test_a_recording_with_a_dead_time_may_begin_with_a_jump():
    """The displacement jumps in its rate between two samples, a dead time later."""
    trials = [*late(1.3, first=150), *late(1.3)]
    assert abs(trials[0].pressure[0]) > 1e3
    found = fit_hysteresis(trials, dead_time=True)
    assert found.theta["dead_time"] == pytest.approx(1.3 * DT, rel=1e-5)
    assert found.noise < 1e-8


@pytest.mark.slow
def test_intervals_cover_the_dead_time_and_the_others():
    """12 parameters, 24 draws of noise, four dead times: 95 %, within three standard errors of correlated counts."""
    hits = []
    for seed in range(24):
        delay = (0.5, 1.0, 1.65, 2.7)[seed % 4]
        start = np.array([FREQUENCY, DAMPING, delay * DT])
        told = fit_hysteresis(late(delay, 5e-5, seed, (1.5,)), dead_time=True, start=start).intervals
        truth = {"frequency": FREQUENCY, "damping": DAMPING, "dead_time": delay * DT}
        truth |= {f"slope{k}": slope for k, slope in enumerate(SLOPES)}
        hits.append([told[name].low <= x <= told[name].high for name, x in truth.items()])
    assert 0.90 < np.mean(hits) < 0.99
    assert np.mean(np.array(hits)[:, :3]) > 0.85  # frequency, damping, dead time: they come together


def test_that_there_is_no_dead_time_is_told():
    """The others are found as they are."""
    found = fit_hysteresis(late(0.0, 5e-5, 1), dead_time=True)
    assert found.warnings == ("no dead time is seen: 0 s is in its interval",)
    assert found.intervals["dead_time"].low == 0.0 and found.intervals["dead_time"].high < 0.5 * DT
    for name, value in (("frequency", FREQUENCY), ("damping", DAMPING)):
        assert found.intervals[name].low < value < found.intervals[name].high


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("delay", [0.4, 1.0, 2.7])
def test_derivatives_by_all_are_those_of_differences(order, delay):
    model = HysteresisModel(tuple(late(1.0, frequencies=(1.5,))), order, slew=True, dead_time=True)
    theta = model.start
    theta[-2:] = delay * DT, 0.5 * model.steepest
    weights = SLOPES * np.linspace(1, 2, 9)
    found = model.jacobian(theta, weights)
    for k in range(order + 1):
        h = 1e-6 * theta[k] * np.eye(len(theta))[k]
        wanted = (model.basis(theta + h) - model.basis(theta - h)) @ weights / (2e-6 * theta[k])
        np.testing.assert_allclose(found[:, k], wanted, atol=1e-5 * np.abs(wanted).max())


def test_a_dead_time_that_was_left_out_is_told_and_found_when_asked_for():
    """Left out it is taken for slow dynamics: 16 rad/s in place of 18.65."""
    trials = late(1.5, 5e-5)
    without = fit_hysteresis(trials)
    assert without.theta["frequency"] < 17.0
    (told,) = (text for text in without.warnings if "dead time" in text)
    found = fit_hysteresis(trials, dead_time=True)
    assert found.noise == pytest.approx(5e-5, rel=0.05) and not found.warnings
    assert told.startswith(
        f"a dead time of {1e3 * found.theta['dead_time']:.3g} ms would fit better (residuals of 0.04"
    )
    numbers = f"{found.theta['frequency']:.4g} rad/s, not {without.theta['frequency']:.4g} rad/s"
    assert told.endswith(f", and frequency would be {numbers}: fit it too (--dead-time)")
    for name, value in (("frequency", FREQUENCY), ("damping", DAMPING), ("dead_time", 1.5 * DT)):
        assert found.intervals[name].low < value < found.intervals[name].high


@pytest.mark.parametrize("draws", [6, pytest.param(20, marks=pytest.mark.slow)])
def test_no_dead_time_is_made_up(draws):
    """Of draws of noise without one, none tells of one."""
    for seed in range(draws):
        assert not fit_hysteresis(recordings(noise=5e-5, seed=seed, frequencies=(1.5,))).warnings


def test_a_dead_time_and_a_slew_limit_are_found_at_once():
    """Both make the displacement late: the limit only where the pressure is steep."""
    limit = 2.8e5
    trials = late(1.6, 5e-5, valve=(SlewLimit(jnp.asarray(limit)),), frequencies=(0.25, 0.75, 1.5))
    found = fit_hysteresis(trials, slew=True, dead_time=True)
    assert [*found.theta] == ["frequency", "damping", "dead_time", "slew"]
    assert found.theta["slew"] == pytest.approx(limit, rel=3e-3)
    assert found.theta["dead_time"] == pytest.approx(1.6 * DT, abs=0.3 * DT)
    assert found.noise == pytest.approx(5e-5, rel=0.05) and not found.warnings


def held(delay, limit, noise=0.0, seed=0, frequencies=(0.75, 1.5), fine=50):
    """Recordings of commands that are held from sample to sample, whose valve follows at a limited rate within them."""
    rng, out = np.random.default_rng(seed), []
    valve = SlewLimit(jnp.asarray(limit))
    for frequency in frequencies:
        c = waves(frequency)
        plant = Chain((valve, HYSTERESIS, DYNAMICS))
        y = np.asarray(respond(plant, np.repeat(c, fine), DT / fine))
        y = np.concatenate([np.zeros(round(delay * fine) + 1), y])[: len(y) : fine]  # the first sample is that at 0 s
        means = 0.5 * (c + np.append(0.0, c[:-1]))
        out.append(PressureTrial(f"{frequency} Hz", DT, means, y + noise * rng.normal(size=len(c)), held=True))
    return out


def test_a_valve_that_follows_held_commands_at_a_limited_rate_is_found():
    """The limit is half as high again as the steepest change, which it meets in two thirds of a sample.

    Steps of 0.1 ms of the truth make a delay of half of that.
    """
    model = HysteresisModel(tuple(held(1.3, 1.0)))
    limit = 1.5 * model.steepest
    found = fit_hysteresis(held(1.3, limit), slew=True, dead_time=True)
    assert found.theta["frequency"] == pytest.approx(FREQUENCY, rel=2e-3)
    assert found.theta["damping"] == pytest.approx(DAMPING, rel=2e-3)
    assert found.theta["dead_time"] == pytest.approx(1.31 * DT, abs=0.02 * DT)
    assert found.theta["slew"] == pytest.approx(limit, rel=0.05)
    without = fit_hysteresis(held(1.3, limit), dead_time=True)
    assert abs(without.theta["frequency"] - FREQUENCY) > 5 * abs(found.theta["frequency"] - FREQUENCY)


@pytest.mark.parametrize("per_sample", [0.1, 0.4])
def test_lines_for_held_commands_answer_as_steps_do(per_sample):
    """A sine with so much of its phase in a sample, of size sinc(w dt/2) to fourth order; means lack (w dt)^2/6."""
    k = np.arange(400)
    size = np.cos(per_sample / 2)  # of means of neighbours
    trial = PressureTrial("sine", DT, size * np.sin(per_sample * k), np.zeros(400), held=True)
    lines = np.sinc(per_sample / (2 * np.pi)) ** 2
    found = lines * np.abs(trial.joined()[1:-1]).max()
    steps = np.sinc(per_sample / (2 * np.pi))
    assert found == pytest.approx(steps, abs=per_sample**4)
    assert lines * size == pytest.approx(steps * (1 - per_sample**2 / 6), abs=per_sample**4)
    np.testing.assert_array_equal(trial._replace(held=False).joined(1.0), trial.pressure)


def test_sums_of_squares_of_pairs_behind_a_dead_time_are_those_of_each():
    """Two recordings of different steps, one that begins with a jump; all else of the model as in the fit."""
    valve = (Stiction(*map(jnp.asarray, (5e3, 3.1e3))),)
    fast, jump = (late(1.6, 5e-5, frequencies=(1.5,), valve=valve, first=k)[0] for k in (0, 40))
    slow = fast._replace(dt=4 * DT, pressure=fast.pressure[::4], displacement=fast.displacement[::4])
    model = HysteresisModel((jump, slow), dead_band=True, resolution=True, dead_time=True)
    theta = np.array([FREQUENCY, DAMPING, 1.6 * DT, 5e3, 3.1e3])
    pairs = np.array([[5e3, 3.1e3], [2e3, 3.1e3], [7e3, 2.4e3]])
    found = model._by_pair(theta)(pairs)
    slopes = model.problem.fit(theta, model.names).weights
    others = np.linalg.qr(np.delete(model.jacobian(theta, slopes), [3, 4], axis=1)).Q
    for pair, sum_of_squares in zip(pairs, found, strict=True):
        basis = model.basis(np.array([*theta[:3], *pair]))
        basis, data = (x - others @ (others.T @ x) for x in (basis, model.problem.data))
        assert sum_of_squares == pytest.approx(nnls(basis * 1e7, data)[1] ** 2, rel=1e-6)


def test_a_saved_model_has_its_dead_time_and_answers_as_late():
    """Exactly for whole samples; else by straight lines between displacements, an eighth of dt^2 y'' at most."""
    for delay, beside in ((1.0, 1e-9), (2.7, None)):
        trials = late(delay, frequencies=(1.5,))
        found = fit_hysteresis(trials, dead_time=True)
        read = saved_model(HysteresisFit(found, tuple(trials)).to_dataset())
        assert read.theta["dead_time"] == found.theta["dead_time"]
        y, p = trials[0].displacement, trials[0].pressure
        bent = np.abs(np.diff(y, 2)).max() / 8
        assert np.abs(respond(read.block(), p, DT) - y).max() < (1.02 * bent if beside is None else 1e-6 * np.ptp(y))
        assert HysteresisFit(found, tuple(trials)).to_dataset()["unit"].sel(parameter="dead_time").item() == "s"


def test_a_dead_time_of_0_is_one_that_a_saved_model_may_have():
    trials = late(0.0, 5e-5, 3)
    found = fit_hysteresis(trials, dead_time=True)
    data = HysteresisFit(found._replace(theta=found.theta | {"dead_time": 0.0}), tuple(trials)).to_dataset()
    assert saved_model(data).theta["dead_time"] == 0.0
    data["value"].loc[{"parameter": "dead_time"}] = -1e-3
    with pytest.raises(InputError, match="a parameter is not positive"):
        saved_model(data)
