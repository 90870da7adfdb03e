"""Hysteresis and dynamics of a soft actuator from recordings: known parameters come back, and what cannot is said."""

import json

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import nnls

from nectosome.drives import Chain, SlewLimit, Stiction, TransferFunction, evenly, respond, second_order
from nectosome.identification import Misfit, identifiability
from nectosome.identification.fits.intervals import stepwise_threshold
from nectosome.identification.hysteresis.files import HysteresisFit
from nectosome.identification.hysteresis.fit import HysteresisModel, fit_hysteresis
from nectosome.identification.hysteresis.trials import PressureTrial
from nectosome.identification.hysteresis.valve import stepwise_box
from nectosome.units import InputError
from nectosome.units.ranges import Ranges
from nectosome_studies.fishtail.levenberg import identify_as_printed

DT, LARGEST, LIMIT = 5e-3, 6e4, 2.8e5
SLOPES = 1e-7 * np.array([2.9, 4.5, 3.5, 3.4, 3.2, 3.5, 3.7, 3.9, 4.0])  # m/Pa
FREQUENCY, DAMPING = 18.65, 1.008
HYSTERESIS = evenly(np.append(np.diff(SLOPES), 0.0), LARGEST, SLOPES[0])
PLANT = Chain((HYSTERESIS, second_order(*(jnp.asarray(x) for x in (1.0, FREQUENCY, DAMPING)))))
TRUTH = np.array([FREQUENCY, DAMPING, *SLOPES])


def waves(frequency):
    """Four waves of 0.3 to 0.6 bar (eq. 1)."""
    t = np.arange(0, 4 / frequency + DT / 2, DT)
    j = np.minimum(np.floor(t * frequency + 1e-9), 3)
    return 1e5 * (0.3 + 0.1 * j) * np.sin(2 * np.pi * frequency * (t - j / frequency))


def recordings(plant=PLANT, noise=0.0, seed=0, frequencies=(0.25, 0.75, 1.5)):
    rng, out = np.random.default_rng(seed), []
    for frequency in frequencies:
        p = waves(frequency)
        y = np.asarray(respond(plant, p, DT))
        out.append(PressureTrial(f"{frequency} Hz", DT, p, y + noise * rng.normal(size=len(p))))
    return out


def as_printed(trials, start=None):
    return identify_as_printed(HysteresisModel(tuple(trials)), start)


@pytest.fixture(scope="module")
def clean():
    return recordings()


@pytest.mark.parametrize("method", [fit_hysteresis, as_printed])
def test_what_made_the_data_is_found(clean, method):
    """The fit's filters and the block share no code but the plays: they agree to rounding."""
    found = method(clean)
    np.testing.assert_allclose([*found.theta.values(), *found.slopes], TRUTH, rtol=1e-5)
    assert found.noise < 1e-8
    y = respond(found.block(), clean[0].pressure, DT)
    np.testing.assert_allclose(y, clean[0].displacement, atol=1e-6 * np.abs(clean[0].displacement).max())


@pytest.mark.parametrize("method", [fit_hysteresis, as_printed])
def test_all_of_six_random_starts_come_to_the_same(method):
    trials = recordings(noise=5e-5)
    ranges = HysteresisModel(tuple(trials)).ranges
    best = method(trials)
    for u in np.random.default_rng(7).uniform(0.1, 0.9, size=(6, 2)):
        found = method(trials, start=ranges.values(u))
        np.testing.assert_allclose(found.slopes, best.slopes, rtol=1e-3)
        assert found.noise == pytest.approx(best.noise, rel=1e-6)
    assert best.noise == pytest.approx(5e-5, rel=0.05)


@pytest.mark.parametrize("draws", [10, pytest.param(40, marks=pytest.mark.slow)])
def test_intervals_cover_the_truth(draws):
    """11 parameters, draws of noise: 95 % of the intervals; of 40 within three standard errors of correlated counts."""
    hits = []
    for seed in range(draws):
        told = fit_hysteresis(recordings(noise=5e-5, seed=seed, frequencies=(0.75, 1.5))).intervals
        hits += [one.low <= x <= one.high for one, x in zip(told.values(), TRUTH, strict=True)]
    assert 0.90 < np.mean(hits) < 0.99


@pytest.mark.parametrize("order", [1, 3, 4])
def test_other_orders_are_found_too(order):
    """One pole; one and a pair; two pairs."""
    one, pair, fast = [1.0, 30.0], [1.0, 0.8 * FREQUENCY, FREQUENCY**2], [1.0, 40.0, 60.0**2]
    parts = {1: [one], 3: [pair, one], 4: [pair, fast]}[order]
    below = np.array([1.0])
    for part in parts:
        below = np.polymul(below, part)
    plant = Chain((HYSTERESIS, TransferFunction(jnp.asarray(below[-1:]), jnp.asarray(below))))
    found = fit_hysteresis(recordings(plant), order=order)
    wanted = {
        1: {"frequency1": 30.0},
        3: {"frequency1": FREQUENCY, "damping1": 0.4, "frequency2": 30.0},
        4: {"frequency1": FREQUENCY, "damping1": 0.4, "frequency2": 60.0, "damping2": 1 / 3},
    }[order]
    assert found.theta == pytest.approx(wanted, rel=1e-4)
    np.testing.assert_allclose(found.slopes, SLOPES, rtol=1e-4)


def test_a_recording_may_begin_with_a_jump():
    """Pressure that is on from the first sample: the plant starts from rest all the same."""
    p = waves(0.75)[150:]
    assert abs(p[0]) > 1e3
    trials = [*recordings(frequencies=(1.5,)), PressureTrial("jump", DT, p, np.asarray(respond(PLANT, p, DT)))]
    found = fit_hysteresis(trials)
    np.testing.assert_allclose([*found.theta.values(), *found.slopes], TRUTH, rtol=1e-5)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_slopes_are_those_of_differences(clean, order):
    model = HysteresisModel((clean[2],), order, slew=True)
    theta = model.start
    theta[-1] = 0.5 * model.steepest
    weights = SLOPES * np.linspace(1, 2, 9)
    found = model.jacobian(theta, weights)
    for k in range(order):
        h = 1e-6 * theta[k] * np.eye(len(theta))[k]
        wanted = (model.basis(theta + h) - model.basis(theta - h)) @ weights / (2e-6 * theta[k])
        np.testing.assert_allclose(found[:, k], wanted, atol=1e-5 * np.abs(wanted).max())


@pytest.fixture(scope="module")
def limited():
    return recordings(Chain((SlewLimit(jnp.asarray(LIMIT)), *PLANT.blocks)), noise=5e-5)


def test_a_slew_limit_is_found_and_else_spoils_the_fit(limited):
    """What the valve holds back is taken for slow dynamics unless it is fitted too."""
    with_limit, without = fit_hysteresis(limited, slew=True), fit_hysteresis(limited)
    assert with_limit.theta["slew"] == pytest.approx(LIMIT, rel=2e-3)
    assert with_limit.theta["frequency"] == pytest.approx(FREQUENCY, rel=5e-3)
    assert with_limit.noise == pytest.approx(5e-5, rel=0.05)
    assert not with_limit.warnings
    assert without.theta["frequency"] < 0.9 * FREQUENCY
    assert "residuals are correlated" in without.warnings[0]
    y = respond(with_limit.block(), limited[2].pressure, DT)
    assert np.std(y - limited[2].displacement) == pytest.approx(5e-5, rel=0.05)


def test_a_trial_unlike_those_that_were_fitted_is_told(limited):
    """Off by 1 mm, of a noise of 50 um; one that is as the model says is not told."""
    found, same = fit_hysteresis(limited, slew=True), limited[2]
    off = same._replace(displacement=same.displacement + 1e-3)
    warnings = [
        json.loads(HysteresisFit(found, tuple(limited), (one,)).to_dataset().attrs["warnings"]) for one in (same, off)
    ]
    assert warnings[0] == []
    assert warnings[1][0].startswith(f"displacement of {same.name}, held out, is off by 20.")


@pytest.mark.parametrize("lead", [0.03, -0.03])
def test_a_zero_of_either_sign_is_found(lead):
    """Its time is in its interval, and without it the fit is worse."""
    above, below = np.array([lead, 1.0]) * FREQUENCY**2, [1.0, 2 * DAMPING * FREQUENCY, FREQUENCY**2]
    trials = recordings(Chain((HYSTERESIS, TransferFunction(jnp.asarray(above), jnp.asarray(below)))))
    found = fit_hysteresis(trials, zeros=1)
    assert found.theta == pytest.approx({"frequency": FREQUENCY, "damping": DAMPING, "zero1": lead}, rel=1e-4)
    np.testing.assert_allclose(found.slopes, SLOPES, rtol=1e-4)
    y = respond(found.block(), trials[0].pressure, DT)
    np.testing.assert_allclose(y, trials[0].displacement, atol=1e-6 * np.abs(trials[0].displacement).max())
    rng = np.random.default_rng(0)
    noisy = [
        one._replace(displacement=one.displacement + 5e-5 * rng.normal(size=len(one.displacement))) for one in trials
    ]
    told = fit_hysteresis(noisy, zeros=1)
    assert told.intervals["zero1"].low < lead < told.intervals["zero1"].high
    assert told.noise == pytest.approx(5e-5, rel=0.05)
    assert fit_hysteresis(noisy).noise > 1.04 * told.noise


def test_two_zeros_of_three_poles_are_found_and_their_derivatives_are_those_of_differences():
    above, below = [4e-4, 0.03, 1.0], np.polymul([1.0, 0.8 * FREQUENCY, FREQUENCY**2], [1.0, 30.0]) / 30 / FREQUENCY**2
    trials = recordings(Chain((HYSTERESIS, TransferFunction(jnp.asarray(above), jnp.asarray(below)))))
    model = HysteresisModel(tuple(trials), 3, zeros=2)
    theta = np.array([FREQUENCY, 0.4, 30.0, 0.03, 4e-4])
    np.testing.assert_allclose(model.basis(theta) @ SLOPES, model.problem.data, atol=1e-9)
    found = model.jacobian(theta, SLOPES)
    for k, h in enumerate(np.diag([1e-6, 1e-6, 1e-6, 1e-2, 1e-2] * theta)):  # linear in the zeros
        wanted = (model.basis(theta + h) - model.basis(theta - h)) @ SLOPES / (2 * h[k])
        np.testing.assert_allclose(found[:, k], wanted, atol=1e-5 * np.abs(wanted).max())
    assert fit_hysteresis(trials, 3, zeros=2).noise < 1e-8


def test_a_dead_band_is_found_and_else_taken_for_hysteresis():
    """Half of it is the width of a play: small reversals, which have the first slope, would seem to do little."""
    missed = 0
    for seed, band in enumerate((2e3, 6e3, 6e3)):
        trials = recordings(Chain((Stiction(*map(jnp.asarray, (band, 0.0))), *PLANT.blocks)), 5e-5, seed)
        found = fit_hysteresis(trials, dead_band=True)
        assert found.theta["dead_band"] == pytest.approx(band, rel=0.03)
        missed += not found.intervals["dead_band"].low < band < found.intervals["dead_band"].high
        np.testing.assert_allclose(found.slopes, SLOPES, rtol=0.02)
        assert found.noise == pytest.approx(5e-5, rel=0.05) and not found.warnings
    assert missed <= 1
    without = fit_hysteresis(trials)
    assert without.slopes[0] < 0.5 * SLOPES[0] and "residuals are correlated" in without.warnings[0]


def test_a_dead_band_and_a_slew_limit_are_found_at_once():
    valve = Stiction(*map(jnp.asarray, (4e3, 0.0))), SlewLimit(jnp.asarray(LIMIT))
    found = fit_hysteresis(recordings(Chain((*valve, *PLANT.blocks)), 5e-5), slew=True, dead_band=True)
    assert found.theta["dead_band"] == pytest.approx(4e3, rel=0.03)
    assert found.theta["slew"] == pytest.approx(LIMIT, rel=3e-3)
    assert found.noise == pytest.approx(5e-5, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("step", [1370.0, 7770.0])
def test_a_resolution_is_found(step):
    plant = Chain((Stiction(*map(jnp.asarray, (0.0, step))), *PLANT.blocks))
    found = fit_hysteresis(recordings(plant, 5e-5, frequencies=(0.25, 0.75)), resolution=True)
    assert found.theta["resolution"] == pytest.approx(step, rel=1e-3)
    interval = found.intervals["resolution"]
    assert interval.low < step < interval.high < 1.003 * interval.low and interval.below and interval.above
    assert found.theta["frequency"] == pytest.approx(FREQUENCY, rel=0.01)
    assert found.noise == pytest.approx(5e-5, rel=0.05) and not found.warnings


def coarse(valve, noise=5e-5):
    """267 samples at 50 Hz, and 89 of another one that begins with a jump."""
    out = []
    for seed, (first, count) in enumerate(((0, 267), (30, 89))):
        p, dt = waves(0.75)[::4][first : first + count], 4 * DT
        y = np.asarray(respond(Chain((Stiction(*map(jnp.asarray, valve)), *PLANT.blocks)), p, dt))
        rng = np.random.default_rng(seed)
        out.append(PressureTrial(f"{count} samples", dt, p, y + noise * rng.normal(size=count)))
    return out


def test_sums_of_squares_of_many_pairs_are_those_of_each():
    """Slopes fitted, and all else to first order, which is exact for the sum of squares where derivatives are 0."""
    model = HysteresisModel(tuple(coarse((5e3, 3.1e3))), slew=True, dead_band=True, resolution=True)
    theta = np.array([FREQUENCY, DAMPING, 5e3, 3.1e3, 0.9 * model.steepest])
    pairs = np.array([[5e3, 3.1e3], [2e3, 3.1e3], [7e3, 2.4e3]])
    found = model._by_pair(theta)(pairs)
    slopes = model.problem.fit(theta, model.names).weights
    others = np.linalg.qr(np.delete(model.jacobian(theta, slopes), [2, 3], axis=1)).Q
    for pair, sum_of_squares in zip(pairs, found, strict=True):
        basis = model.basis(np.array([*theta[:2], *pair, theta[4]]))
        basis, data = (x - others @ (others.T @ x) for x in (basis, model.problem.data))
        assert sum_of_squares == pytest.approx(nnls(basis * 1e7, data)[1] ** 2, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("pair", [(5e3, 3.1e3), (1.5e3, 5e3)])
def test_a_dead_band_and_a_resolution_are_found_at_once(pair):
    found = fit_hysteresis(coarse(pair), dead_band=True, resolution=True)
    assert found.theta["dead_band"] == pytest.approx(pair[0], abs=200)
    assert found.theta["resolution"] == pytest.approx(pair[1], rel=3e-3)
    for name, value in zip(("dead_band", "resolution"), pair, strict=True):
        assert found.intervals[name].low < value < found.intervals[name].high
        assert found.intervals[name].below and found.intervals[name].above
    assert found.noise == pytest.approx(5e-5, rel=0.1) and not found.warnings


@pytest.mark.slow
@pytest.mark.parametrize("pair", [(8.1e3, 2e3), (3e3, 1.4e3), (700.0, 7770.0), (0.0, 3.07e3), (4e3, 0.0)])
def test_of_both_one_may_be_small_or_none(pair):
    plant = Chain((Stiction(*map(jnp.asarray, pair)), *PLANT.blocks))
    found = fit_hysteresis(recordings(plant, 5e-5, frequencies=(0.75,)), dead_band=True, resolution=True)
    for name, value in zip(("dead_band", "resolution"), pair, strict=True):
        interval = found.intervals[name]
        assert interval.low <= max(value, 1e-5 * LARGEST) <= interval.high
        assert interval.below == (value > 0) and interval.above
        assert any(f"no {name.replace('_', ' ')} is seen" in text for text in found.warnings) == (value == 0)
    assert found.noise == pytest.approx(5e-5, rel=0.05)
    assert not any("not told apart" in text for text in found.warnings)


@pytest.mark.slow
def test_what_recordings_do_not_tell_apart_is_told():
    """Noise of 2 mm, of 20 mm in all."""
    found = fit_hysteresis(coarse((5e3, 3.1e3), noise=2e-3), dead_band=True, resolution=True)
    assert any("dead band and resolution are not told apart" in text for text in found.warnings)
    for name, value in (("dead_band", 5e3), ("resolution", 3.1e3)):
        assert found.intervals[name].low < value < found.intervals[name].high


def test_the_interval_of_what_goes_in_steps_is_that_of_all_values_that_fit():
    """chi2 is 0 from 2.9 to 3.2, 7 from there to 3.5, more beyond: ends are the next values that are tried."""

    def chi2(rows):
        values = rows[:, 0]
        return np.select([values < 2.9, values <= 3.2, values <= 3.5], [8.0, 0.0, 7.0], 40.0)

    bounds, nothing = np.array([[1.0, 9.0]]), np.zeros((0, 1))
    best, (interval,) = stepwise_box(chi2, np.array([3.0]), bounds, nothing)
    assert 2.9 > interval.low > 2.88 and 3.5 < interval.high < 3.57 and 2.9 <= best[0] <= 3.2
    assert interval.below and interval.above
    _, (flat,) = stepwise_box(lambda rows: np.zeros(len(rows)), np.array([3.0]), bounds, nothing)
    assert (flat.low, flat.high, flat.below, flat.above) == (1.0, 9.0, False, False)
    assert stepwise_threshold() == pytest.approx(7.35, abs=5e-3)  # Hansen 2000, table 1


def test_intervals_of_two_that_go_in_steps_are_the_sides_of_all_pairs_that_fit():
    """Pairs in an oblique parallelogram of half-widths 0.1 and 0.01 fit, and an island known from elsewhere."""

    def chi2(rows):
        x, y = (rows - [3.0, 4.0]).T
        own = (np.abs(x + y) < 0.1) & (np.abs(x - y) < 0.02)
        return np.where(own | (np.max(np.abs(rows - [5.0, 4.0]), axis=1) < 0.01), 0.0, 50.0)

    bounds = np.array([[0.1, 9.0], [0.1, 9.0]])
    _, (x, y) = stepwise_box(chi2, np.array([3.01, 4.0]), bounds, np.zeros((0, 2)))
    for one, middle in ((x, 3.0), (y, 4.0)):
        assert 0.05 < middle - one.low < 0.08 and 0.05 < one.high - middle < 0.08
    _, (x, y) = stepwise_box(chi2, np.array([3.01, 4.0]), bounds, np.array([[5.0, 4.0], [7.0, 4.0]]))
    assert x.low < 2.96 and 5.0 < x.high < 5.3 and 0.03 < y.high - 4.0 < 0.3


@pytest.mark.slow
def test_that_there_is_no_resolution_is_told():
    found = fit_hysteresis(recordings(noise=5e-5, frequencies=(0.25, 0.75)), resolution=True)
    assert found.warnings[0].startswith("no resolution is seen")


def test_that_there_is_no_dead_band_is_told():
    found = fit_hysteresis(recordings(noise=5e-5, frequencies=(0.25, 0.75)), dead_band=True)
    assert found.theta["dead_band"] < 300
    assert not found.intervals["dead_band"].below or found.warnings[0].startswith("no dead band is seen")


def test_that_there_is_no_slew_limit_is_told():
    found = fit_hysteresis(recordings(noise=5e-5, frequencies=(0.75,)), slew=True)
    assert any("no slew limit is seen" in text for text in found.warnings)


def test_hysteresis_without_an_inverse_is_not_made_up(clean):
    """A truth with a negative slope: the fit stays at 0 and says which one."""
    slopes = SLOPES.copy()
    slopes[4] = -1e-7
    bad = Chain((evenly(np.append(np.diff(slopes), 0.0), LARGEST, slopes[0]), PLANT.blocks[1]))
    found = fit_hysteresis(recordings(bad))
    assert found.slopes[4] == 0
    assert any("slopes 4 are at 0" in text for text in found.warnings)


def test_of_the_papers_fourteen_numbers_eleven_are_told(clean):
    """Ten weights, b0, a0, a1, a2: two of them only scale others, and the play of the largest pressure never moves."""
    names = [*(f"c{k + 1}" for k in range(10)), "b0", "a0", "a1", "a2"]
    printed = np.array([992.48, 560.65, -347.35, -27.09, -58.19, 83.87, 89.80, 71.84, 33.05, 71.23])
    theta = np.array([*printed, 5.92, 205.21, 22.18, 0.59])

    def at(row):
        c, (b0, a0, a1, a2) = row[:10], row[10:]
        plays = evenly(c[1:], LARGEST, c[0])
        return Chain((plays, TransferFunction(jnp.array([b0 * 1e-8]), jnp.array([a2, a1, a0]))))

    def residuals(rows):
        return np.stack([np.concatenate([respond(at(row), x.pressure, DT) for x in clean]) for row in rows]) / 1e-7

    ranges = Ranges(names, theta - np.abs(theta), theta + np.abs(theta))
    told = identifiability(Misfit(residuals, ranges, step=1e-4), theta)
    assert told.rank == 11
    assert not told.identifiable[9]
    assert told.errors[9] == pytest.approx(1 / np.sqrt(12))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"pressure": np.zeros(400)}, "the pressure is 0 throughout"),
        ({"displacement": np.full(400, 0.1)}, "the displacement is 0.1 throughout"),
        ({"displacement": np.zeros(300)}, "400 pressures and 300 displacements"),
        ({"dt": 0.0}, "the samples are 0 s apart"),
        ({"dt": np.nan}, "the samples are nan s apart"),
        ({"pressure": np.where(np.arange(400) == 7, np.nan, 1.0 * np.arange(400))}, "is NaN or infinite at sample 8"),
        ({"pressure": np.arange(20.0), "displacement": np.arange(20.0)}, "20 samples are too few"),
    ],
)
def test_recordings_that_tell_nothing_are_refused(change, told):
    good = PressureTrial("run.csv", DT, np.sin(np.arange(400) / 30), np.sin(np.arange(400) / 30 - 0.2))
    with pytest.raises(InputError, match=told):
        fit_hysteresis([good._replace(**change)])


def test_a_displacement_of_the_other_sign_is_told(clean):
    with pytest.raises(InputError, match="does not follow the pressure"):
        fit_hysteresis([one._replace(displacement=-one.displacement) for one in clean])


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"order": 0}, "from 1 to 6"),
        ({"start": [3.0]}, "frequency, damping are needed"),
        ({"start": [1e9, 1.0]}, "is not between"),
    ],
)
def test_what_makes_no_sense_is_refused(clean, options, told):
    with pytest.raises(InputError, match=told):
        fit_hysteresis(clean, **options)
    with pytest.raises(InputError, match="no recording"):
        fit_hysteresis([])
