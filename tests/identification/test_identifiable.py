"""What data tell of parameters: closed forms, what is told only in combination or not at all, intervals that cover."""

import numpy as np
import pytest
from scipy.stats import chi2, norm
from tests.afar import Afar

from nectosome.identification import Misfit, bootstrap, identifiability, most_helpful, profile
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

TIME = np.linspace(0.1, 3.0, 15)


def linear(A, x0, ranges, **more):
    """Residuals A (x - x0)."""
    return Misfit(lambda x: (x - x0) @ A.T, ranges, **more)


def decay(data, error, ranges=None):
    """A exp(-t / tau), samples with one standard error."""
    ranges = ranges or Ranges(("A", "tau"), (0.1, 0.05), (10.0, 20.0), log=("A", "tau"))
    return Misfit(lambda x: (x[:, :1] * np.exp(-TIME / x[:, 1:]) - data) / error, ranges)


@pytest.fixture(scope="module")
def some():
    """A linear model of three parameters: matrix, truth, ranges."""
    rng = np.random.default_rng(1)
    return rng.normal(size=(8, 3)) * [10.0, 1.0, 0.1], np.array([1.0, 5.0, 200.0]), Ranges("abc", 0.0, [4, 40, 400])


APART = ". Give one of them a value measured on its own, or compare a reading that tells them apart"
UNMOVED = ": what was compared does not change with it. Compare a reading that does, or leave it out"


def test_a_linear_model_has_the_errors_of_its_covariance(some):
    A, x0, ranges = some
    width = np.ptp(ranges.bounds, axis=1)
    for jacobian in (None, lambda x: A):
        found = identifiability(linear(A, x0, ranges, jacobian=jacobian), x0)
        own = np.linalg.inv((A * width).T @ (A * width) + 12 * np.eye(3))
        np.testing.assert_allclose(found.errors, np.sqrt(np.diag(own)), rtol=1e-8)
        half = norm.ppf(0.975) * np.sqrt(np.diag(np.linalg.inv(A.T @ A)))
        got = np.array([(one.low, one.high) for one in found.intervals()])
        np.testing.assert_allclose(got, np.stack([x0 - half, x0 + half], axis=1), rtol=1e-6)
    assert found.rank == 3
    assert found.identifiable.all()
    assert found.parameters == pytest.approx(3, abs=0.05)
    assert found.words()[1] == f"b: identifiable, 5 (95 %: {5 - half[1]:.4g} to {5 + half[1]:.4g})"
    assert found.to_dataset()["error"].sel(parameter="b").item() == found.errors[1]


def test_profile_and_bootstrap_of_a_linear_model_are_its_covariance(some):
    A, x0, ranges = some
    misfit = linear(A, x0, ranges)
    half = norm.ppf(0.975) * np.sqrt(np.linalg.inv(A.T @ A)[1, 1])
    found = profile(misfit, x0 * 1.05, "b")
    assert found.best.chi2 < 1e-7  # 3e-4 standard errors from x0, where it is 0
    np.testing.assert_allclose(found.interval[:2], [5 - half, 5 + half], rtol=1e-3)
    assert found.interval.below
    assert found.interval.above
    np.testing.assert_allclose(found.rise, (norm.ppf(0.975) * (found.values - 5) / half) ** 2, atol=1e-6)
    drawn = bootstrap(misfit, x0, draws=300)
    np.testing.assert_allclose(
        np.cov((drawn.draws - x0) @ np.linalg.cholesky(A.T @ A), rowvar=False), np.eye(3), atol=0.25
    )
    np.testing.assert_allclose(drawn.intervals[1][:2], [5 - half, 5 + half], rtol=0.06)


def decayed(x):
    return 50 * x[:, :1] * np.exp(-TIME / x[:, 1:]) - 50 * np.exp(-TIME)


def test_uncertain_runs_that_workers_fit_are_those_of_this_process():
    misfit = Misfit(decayed, Ranges(("A", "tau"), 0.1, 10.0))
    here = bootstrap(misfit, np.array([1.0, 1.0]), draws=6)
    with Afar() as executor:
        there = bootstrap(misfit, np.array([1.0, 1.0]), draws=6, executor=executor)
    assert executor.calls == 6
    assert np.ptp(here.draws, axis=0).min() > 0
    np.testing.assert_array_equal(there.draws, here.draws)


def test_a_product_is_told_only_together():
    """On logarithmic scales the product is one direction, told at every a and b alike; c is told on its own."""
    ranges = Ranges("abc", 0.1, 10, log="ab")
    misfit = Misfit(lambda x: np.stack([100 * (x[:, 0] * x[:, 1] - 2), 50 * (x[:, 2] - 3)], axis=1), ranges)
    for a in (0.5, 1.0, 4.0):
        found = identifiability(misfit, np.array([a, 2 / a, 3.0]))
        assert found.rank == 2
        assert found.identifiable.tolist() == [False, False, True]
        c, both = found.words()
        assert (c, both) == ("c: identifiable, 3 (95 %: 2.961 to 3.039)", f"a and b: only in combination, a b{APART}")
        assert found.intervals()[0].text == "not identifiable"


def test_unlike_ranges_do_not_change_what_a_combination_is():
    """a + 2 b is told, whatever the bounds; on logarithmic scales a^2/b is."""
    for upper in ([10, 10], [10, 5]):
        misfit = Misfit(lambda x: 1e3 * (x[:, :1] + 2 * x[:, 1:] - 9), Ranges("ab", 0, upper))
        assert identifiability(misfit, np.array([3.0, 3.0])).words()[0] in (
            f"a and b: only in combination, +0.5 a +1 b{APART}",
            f"a and b: only in combination, +1 a +2 b{APART}",
        )
    misfit = Misfit(lambda x: 1e3 * (x[:, :1] ** 2 / x[:, 1:] - 3), Ranges("ab", 0.1, 10, log="ab"))
    assert identifiability(misfit, np.array([3.0, 3.0])).words() == [f"a and b: only in combination, a b^-0.5{APART}"]


def test_many_that_hang_together_are_counted():
    """Two sums of five parameters; a sixth has no part in them."""
    A = np.array([[1.0, 1, 1, 1, 1, 0], [1, -1, 2, -2, 3, 0]])
    found = identifiability(linear(1e3 * A, np.full(6, 0.5), Ranges("abcdef", 0, 1)), np.full(6, 0.5))
    some, none = found.words()
    assert some == f"a, b, c, d and e: only in combination, 2 of 5 combinations{APART}"
    assert none == f"f: not identifiable{UNMOVED}"


def test_what_does_nothing_is_not_told_at_all():
    misfit = Misfit(lambda x: 100 * (x[:, :1] - 0.4), Ranges(("does", "idle"), 0, 1))
    found = identifiability(misfit, np.array([0.4, 0.7]))
    assert found.words() == ["does: identifiable, 0.4 (95 %: 0.3804 to 0.4196)", f"idle: not identifiable{UNMOVED}"]
    assert found.errors[1] == pytest.approx(1 / np.sqrt(12))
    assert found.parameters == pytest.approx(1, abs=2e-3)
    idle = profile(misfit, np.array([0.4, 0.7]), "idle")
    assert idle.interval.text == "not identifiable"
    assert np.abs(idle.rise).max() < 1e-9


def test_however_well_one_direction_is_told_another_is_not():
    """Slopes of 1e12: their squares are known to 1e8 only, which is no information."""
    misfit = Misfit(lambda x: x, Ranges("ab", 0, 1), lambda x: 1e12 * np.array([[0.6, 0.8]]))
    found = identifiability(misfit, np.array([0.5, 0.5]))
    assert found.rank == 1
    assert found.words() == [f"a and b: only in combination, +0.75 a +1 b{APART}"]


def test_the_share_of_a_range_decides_what_is_told():
    """A standard error of 0.1 of the range, with the range's own 12: 1/sqrt(88 + 12)."""
    misfit = Misfit(lambda x: np.sqrt(88) * x[:, :1], Ranges("x", -1, 0))
    assert identifiability(misfit, np.array([-0.5]), share=0.1001).identifiable.all()
    found = identifiability(misfit, np.array([-0.5]), share=0.0999)
    assert not found.identifiable.any()
    assert found.rank == 0
    (told,) = found.words()
    assert told.startswith("x: hardly identifiable, -0.5 (95 %: -0.7089 to -0.2911). Record longer")


def test_a_parameter_has_one_interval_whatever_its_range_adds():
    """The sentence has the ends of `intervals()`, not those that the range makes narrower."""
    misfit = Misfit(lambda x: np.sqrt(88) * x[:, :1], Ranges("x", -1, 0))
    found = identifiability(misfit, np.array([-0.3]), share=0.2)
    (one,) = found.intervals()
    assert one.low == pytest.approx(-0.3 - norm.ppf(0.975) / np.sqrt(88))
    assert found.words() == [f"x: identifiable, -0.3 (95 %: {one.text})"]


def test_errors_that_come_together_are_told():
    """Of a + b and of a - b, whose errors are 1 and s: their errors are correlated by (1 - s^2) / (1 + s^2)."""
    for s, told in ((0.1, True), (0.3, False)):
        A = 1e3 * np.array([[1.0, 1.0], [1 / s, -1 / s]]) / np.sqrt(2)
        found = identifiability(linear(A, np.full(2, 0.5), Ranges("ab", 0, 1)), np.full(2, 0.5))
        assert found.identifiable.all()
        pair = f"a and b: correlated ({(1 - s**2) / (1 + s**2):+.3f}), the error of one comes with that of the other"
        assert (pair in found.words()) == told


@pytest.mark.parametrize("at", [0.0, 0.3, 1.0])
def test_slopes_are_exact_to_second_order_at_bounds_too(at):
    misfit = Misfit(lambda x: np.sin(3 * x), Ranges("x", 0, 1), step=1e-4)
    assert misfit.derivatives(np.array([at])).item() == pytest.approx(3 * np.cos(3 * at), abs=1e-6)


def test_the_profile_of_a_decay_is_that_of_a_fine_grid():
    """For each tau the best A is a quotient; noise as large makes the interval lopsided."""
    rng = np.random.default_rng(3)
    data = 2 * np.exp(-TIME / 1.2) + 0.2 * rng.normal(size=TIME.size)
    found = profile(decay(data, 0.2), np.array([1.0, 1.0]), "tau")
    tau = np.linspace(0.3, 4.0, 20_001)
    e = np.exp(-TIME / tau[:, None])
    A = (e @ data) / np.sum(e**2, axis=1)
    cost = np.sum((A[:, None] * e - data) ** 2, axis=1) / 0.2**2
    inside = tau[cost - cost.min() <= chi2.ppf(0.95, 1)]
    np.testing.assert_allclose(found.interval[:2], [inside[0], inside[-1]], rtol=1e-3)
    assert found.best.chi2 == pytest.approx(cost.min(), rel=1e-6)
    best = tau[np.argmin(cost)]
    assert inside[-1] - best > 1.2 * (best - inside[0])
    assert np.all(np.diff(found.values) > 0)
    np.testing.assert_allclose(found.fits[:, 1], found.values)
    k = np.searchsorted(tau, found.values)
    np.testing.assert_allclose(found.rise, cost[k] - cost.min(), atol=0.02)


def test_a_profile_of_rough_residuals_comes_to_its_end():
    """Ripples of 1e-3 standard errors, as of many time steps: a fit to rounding would follow each of them."""
    asked = 0

    def residuals(x):
        nonlocal asked
        asked += 1
        u, v = 3 * (x[:, 0] - 0.5), 3 * (x[:, 1] - 0.4) + (x[:, 0] - 0.5)
        return np.stack([u, v], axis=1) * 10 + 1e-3 * np.sin(1e5 * x)

    found = profile(Misfit(residuals, Ranges("xy", 0, 1), step=1e-3), np.array([0.6, 0.6]), "x").interval
    np.testing.assert_allclose(found[:2], 0.5 + 1.96 / 30 * np.array([-1, 1]), atol=2e-3)
    assert asked < 300


def test_an_end_that_data_do_not_tell_is_the_bound():
    """Of a step response that is over within the first sample only an upper end is told."""
    misfit = decay(np.full(TIME.size, 1.0), 0.1, Ranges(("A", "tau"), (0.1, 0.5), (10, 200), log=("A", "tau")))
    found = profile(misfit, np.array([1.0, 50.0]), "tau").interval
    assert found.below
    assert not found.above
    assert found.high == pytest.approx(200)
    assert found.text.endswith("to 200, not identifiable from above")


def test_a_profile_that_meets_a_better_fit_starts_anew_there():
    """Two minima of chi2, 0 at x = 0.8 and about 1 at 0.2, with 2.1 between them; the start is in the wrong one."""
    misfit = Misfit(
        lambda x: np.stack([15 * (x[:, 0] - 0.8) * (x[:, 0] - 0.2), (0.8 - x[:, 0]) / 0.6], axis=1), Ranges("x", 0, 1)
    )
    found = profile(misfit, np.array([0.2]), "x")
    assert found.best.theta.item() == pytest.approx(0.8, abs=1e-3)
    assert found.best.chi2 == pytest.approx(0, abs=1e-6)


def test_intervals_hold_the_truth_as_often_as_they_say():
    """200 draws of a decay: 95 % by the profile and near to it by Laplace; binomial bounds of 3 standard deviations."""
    rng = np.random.default_rng(5)
    truth = np.array([2.0, 1.2])
    laplace = profiled = 0
    for _ in range(200):
        data = truth[0] * np.exp(-TIME / truth[1]) + 0.1 * rng.normal(size=TIME.size)
        misfit = decay(data, 0.1)
        best = misfit.fit(truth)
        one = identifiability(misfit, best.theta).intervals()[1]
        laplace += one.low <= truth[1] <= one.high
        profiled += misfit.fit(truth, fixed=("tau",)).chi2 - best.chi2 <= chi2.ppf(0.95, 1)
    assert 180 <= profiled <= 199
    assert 178 <= laplace <= 199


@pytest.mark.parametrize("bend", [None, 1.345])
def test_derivatives_that_are_kept_lead_to_the_same_minimum(bend):
    """To a hundredth of a standard error, with fewer derivatives."""
    error, made = 0.02, []
    data = 2 * np.exp(-TIME / 0.8) + error * np.random.default_rng(3).normal(size=TIME.size)
    plain = decay(data, error)

    def jacobian(x):
        made.append(x)
        return np.stack([np.exp(-TIME / x[1]), x[0] * TIME / x[1] ** 2 * np.exp(-TIME / x[1])], axis=1) / error

    exact = Misfit(plain.residuals, plain.ranges, jacobian, bend=bend).fit(np.array([0.3, 5.0]))
    count = len(made)
    kept = Misfit(plain.residuals, plain.ranges, jacobian, bend=bend, precision=0.01)
    found = kept.fit(np.array([0.3, 5.0]))
    assert 0 < len(made) - count <= 0.7 * count
    apart = jacobian(exact.theta) @ (found.theta - exact.theta)
    assert np.linalg.norm(apart) < 0.01
    assert found.chi2 == pytest.approx(exact.chi2, abs=1e-4)


def test_measurements_are_ranked_by_what_they_add_to_what_is_not_known(some):
    """Each tells one direction with the information w: from l to w + l, gains w/(w + 12) where nothing was known."""
    ranges = Ranges("abc", 0, 1)
    at = np.full(3, 0.5)
    known = identifiability(linear(np.diag([100.0, 0, 0]), at, ranges), at)

    def row(*weights):
        return linear(np.array([weights], float), at, ranges)

    candidates = {
        "a again": row(1000.0, 0, 0),
        "c roughly": row(0, 0, 5.0),
        "b": row(0, 30.0, 0),
        "b and c": linear(np.diag([0, 20.0, 20.0]), at, ranges),
    }
    ranked = most_helpful(known, candidates)
    assert [one.name for one in ranked] == ["b and c", "b", "c roughly", "a again"]
    assert [one.identifiable for one in ranked] == [("b", "c"), ("b",), (), ()]
    gains = [2 * 400 / 412, 900 / 912, 25 / 37, (1e6 + 1e4) / (1e6 + 1e4 + 12) - 1e4 / (1e4 + 12)]
    np.testing.assert_allclose([one.gain for one in ranked], gains, rtol=1e-6)
    assert ranked[0].text == "b and c: +1.94 parameters, 3 of 3 directions; then identifiable: b, c"


def test_mistakes_are_told(some):
    A, x0, ranges = some
    misfit = linear(A, x0, ranges)
    known = identifiability(misfit, x0)
    holed = Misfit(lambda x: np.where(x > 2, np.nan, x), Ranges("x", 0, 4))
    for run, told in (
        (lambda: identifiability(misfit, np.array([5.0, 5, 20])), "a: 5 is not between 0 and 4"),
        (lambda: identifiability(misfit, x0, share=0.5), "share: is 0.5"),
        (lambda: profile(misfit, x0, "d"), "d: there is no such parameter"),
        (lambda: linear(A, x0, ranges, step=0.0), "step: is 0"),
        (lambda: Misfit(lambda x: x, Ranges("ab", 0, [1, 0])), "b: is fixed at 0"),
        (lambda: most_helpful(known, {"other": holed}), "other: has other parameters"),
        (lambda: holed.fit(np.array([3.0])), "NaN or infinite at x = 3"),
        (lambda: identifiability(holed, np.array([2.0])), "NaN or infinite at or near x = 2"),
    ):
        with pytest.raises(InputError, match=told):
            run()
    with pytest.raises(ValueError, match=r"the shape \(1,\) for 1 rows"):
        Misfit(lambda x: x[:, 0], Ranges("x", 0, 4)).fit(np.array([1.0]))
