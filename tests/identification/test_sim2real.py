"""Correcting a simulator with a few experiments, on made-up (synthetic) truths."""

from itertools import pairwise

import numpy as np
import pytest
import xarray as xr

from nectosome.identification import (
    METHODS,
    Experiments,
    ParameterEstimate,
    SimToReal,
    errors_of,
    leave_one_out,
    next_experiments,
    table_of,
    uniform_plan,
)
from nectosome.units import InputError

A, F, P = np.linspace(0.5, 1.3, 7), np.linspace(0.3, 1.3, 6), np.linspace(0.4, 1.6, 7)


def model(a, f, p):
    """A thrust [N] that grows with the stroke and the parameter, neither of them linearly."""
    return p**1.2 * a**1.5 * f**2


@pytest.fixture(scope="module")
def table():
    values = model(*np.meshgrid(A, F, P, indexing="ij"))
    return table_of(xr.DataArray(values, {"A": A, "f": F, "p": P}, name="thrust", attrs={"units": "N"}), "p")


def field(x):
    """A parameter that falls with both conditions."""
    return 1.1 - 0.2 * x[:, 0] - 0.15 * x[:, 1]


def offset(table, points):
    """Truth: the parameter of `field`, and 0.05 N that the simulator knows nothing of."""
    return model(*points.T, field(table.in_box(points))) + 0.05


def experiments(table, truth, count, noise=0.0, seed=0, peaks=True):
    rng, points = np.random.default_rng(seed), table.points
    rows = uniform_plan(table.in_box(points), count)
    q = points[rows]
    values = truth(table, q) * (1 + noise * rng.normal(size=count))
    p = field(table.in_box(q)) * (1 + noise * rng.normal(size=count))
    return Experiments(
        q, values, noise * np.abs(values), ParameterEstimate(p, noise * p, apart=True) if peaks else None
    )


@pytest.mark.parametrize("method", [m for m in METHODS if m.startswith("cn")])
def test_a_simulator_with_another_parameter_is_met(table, method):
    """Nothing but the parameter is wrong, and peaks tell it: what is left to correct is nothing."""

    def truth(table, points):
        return model(*points.T, field(table.in_box(points)))

    fitted = SimToReal(method).fit(table, experiments(table, truth, 12))
    right = truth(table, table.points)
    np.testing.assert_allclose(fitted.predict(table.points).mean, right, atol=6e-3 * right.max())
    told = fitted.parameter(table.points)
    np.testing.assert_allclose(told.mean, field(table.in_box(table.points)), atol=0.02)
    assert np.all(np.abs(told.mean - field(table.in_box(table.points))) < 4 * told.error + 1e-3)


def test_values_tell_the_parameter_where_nothing_else_does(table):
    def truth(table, points):
        return model(*points.T, field(table.in_box(points)))

    fitted = SimToReal("cn").fit(table, experiments(table, truth, 12, peaks=False))
    np.testing.assert_allclose(fitted.parameter(table.points).mean, field(table.in_box(table.points)), atol=0.02)


@pytest.mark.parametrize(("method", "left"), [("svd", 0.9), ("cn-svd", 0.25), ("affine", 0.7), ("thin-plate", 0.25)])
def test_methods_leave_less_than_there_was(table, method, left):
    """Mean absolute error on an offset truth, of what the simulator's was; "cn" alone leaves the offset."""
    given, right = experiments(table, offset, 15), offset(table, table.points)
    before = np.abs(table.simulated(table.points)[0] - right).mean()
    after = SimToReal(method).fit(table, given).predict(table.points)
    assert np.isnan(after.error).all()
    assert np.abs(after.mean - right).mean() < left * before
    alone = SimToReal("cn").fit(table, given).predict(table.points)
    assert np.abs(alone.mean - right).mean() == pytest.approx(0.05, rel=0.05)


@pytest.mark.parametrize("method", ["gp", "cn-gp"])
def test_intervals_hold_what_was_not_measured(table, method):
    """With 3 % noise, over five campaigns: 95 % intervals hold 88 % or more, and the error is near the noise."""
    right, inside, wrong = offset(table, table.points), [], []
    for seed in range(5):
        found = SimToReal(method).fit(table, experiments(table, offset, 12, 0.03, seed)).predict(table.points)
        inside.append(np.mean(np.abs(found.mean - right) < 1.96 * found.error))
        wrong.append(np.mean(np.abs(found.mean - right) / right))
        assert np.mean(1.96 * found.error) < 0.15 * np.mean(right)
    assert np.mean(inside) > 0.88
    assert np.mean(wrong) < 0.04


def test_peaks_that_are_wrong_are_doubted(table):
    """A parameter told half as large again, but for values that fit the simulator: the values count."""

    def truth(table, points):
        return model(*points.T, 1.0)

    given = experiments(table, truth, 12, 0.02)
    assert given.estimate is not None
    wrong = Experiments(
        given.conditions,
        given.values,
        given.errors,
        ParameterEstimate(0 * given.values + 1.5, 0.02 * given.values, True),
    )
    right = truth(table, table.points)
    found = SimToReal("cn-gp").fit(table, wrong).predict(table.points).mean
    alone = SimToReal("cn").fit(table, wrong).predict(table.points).mean
    assert np.abs(found - right).mean() < 0.1 * np.abs(alone - right).mean()


@pytest.mark.parametrize("method", [m for m in METHODS if "raw" not in m])
def test_units_do_not_matter(table, method):
    """Thrust in uN, frequency in 1/min: the same corrected values."""
    given = experiments(table, offset, 8, 0.02)
    scaled = table_of(xr.DataArray(1e6 * table.values, {"A": A, "f": 60 * F, "p": P}, name="thrust"), "p")
    other = Experiments(given.conditions * [1, 60], 1e6 * given.values, 1e6 * given.errors, given.estimate)
    one = SimToReal(method).fit(table, given).predict(table.points)
    two = SimToReal(method).fit(scaled, other).predict(scaled.points)
    np.testing.assert_allclose(two.mean, 1e6 * one.mean, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("method", ["gp", "cn-gp"])
def test_what_is_already_right_or_nothing_at_all_is_no_accident(table, method):
    """Exact values of the simulator itself, without errors; and values where the simulator has none."""
    points = table.points[::5]
    own = model(*points.T, 1.0)
    exact = Experiments(points, own, 0 * own, ParameterEstimate(0 * own + 1.0, 0 * own, True))
    found = SimToReal(method).fit(table, exact).predict(table.points)
    np.testing.assert_allclose(found.mean, model(*table.points.T, 1.0), rtol=5e-3)
    nothing = table_of(xr.DataArray(0 * table.values, {"A": A, "f": F, "p": P}, name="thrust"), "p")
    for values in (0 * own, 0.3 + 0 * own):
        given = Experiments(points, values, 0.01 * values, ParameterEstimate(0 * own + 0.9, 0 * own + 0.01, True))
        found = SimToReal(method).fit(nothing, given).predict(table.points)
        np.testing.assert_allclose(found.mean, values[0], atol=0.01)


def test_leaving_out_the_only_one_that_tells_is_refused_with_a_reason(table):
    given = experiments(table, offset, 5)
    p = np.array([np.nan, np.nan, 0.9, np.nan, np.nan])
    lonely = Experiments(given.conditions, given.values, given.errors, ParameterEstimate(p, 0.01 * p, True))
    SimToReal("cn-gp").fit(table, lonely)
    with pytest.raises(InputError, match="only experiment 3 determines it"):
        leave_one_out(SimToReal("cn-gp"), table, lonely)


def test_three_conditions_are_corrected_and_planned_too():
    grid = np.meshgrid(A[::2], F[::2], [1.0, 2.0, 3.0], indexing="ij")
    cube = xr.DataArray(model(grid[0], grid[1], 1.0) * grid[2], {"A": A[::2], "f": F[::2], "h": [1.0, 2.0, 3.0]})
    table = table_of(cube.rename("thrust"))
    rows = uniform_plan(table.in_box(table.points), 12)
    values = 0.8 * table.simulated(table.points[rows])[0] + 0.05
    given = Experiments(table.points[rows], values, 0.01 * values)
    found = SimToReal("gp").fit(table, given).predict(table.points)
    right = 0.8 * table.simulated(table.points)[0] + 0.05
    assert np.abs(found.mean - right).mean() < 0.02 * right.mean()
    (one,) = next_experiments(SimToReal("gp"), table, given, 1)
    assert one.conditions.shape == (3,)


def test_raw_axes_mix_units(table):
    """With frequencies in 1/min another rotation comes out: that is what scaled axes are for."""
    given = experiments(table, offset, 8)
    scaled = table_of(xr.DataArray(table.values, {"A": A, "f": 60 * F, "p": P}, name="thrust"), "p")
    other = Experiments(given.conditions * [1, 60], given.values, given.errors, given.estimate)
    one, two = (SimToReal("svd-raw").fit(t, e).predict(t.points).mean for t, e in ((table, given), (scaled, other)))
    assert np.abs(one - two).max() > 0.01


def test_without_experiments_it_is_the_simulator(table):
    none = Experiments(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
    found = SimToReal().fit(table, none).predict(table.points)
    np.testing.assert_allclose(found.mean, model(*table.points.T, 1.0), rtol=1e-9)


def test_left_out_experiments_tell_the_error_of_the_rest(table):
    """The error that leaving one out tells is that against the truth, within a factor of 3 for 14 experiments."""
    given = experiments(table, offset, 14, 0.02)
    found = leave_one_out(SimToReal("cn-gp"), table, given)
    told = np.mean(np.abs(found.mean - given.values))
    right = offset(table, table.points)
    own = np.mean(np.abs(SimToReal("cn-gp").fit(table, given).predict(table.points).mean - right))
    assert own / 3 < told < 6 * own
    with pytest.raises(InputError, match="two are needed"):
        leave_one_out(SimToReal(), table, given.take(np.array([0])))


def test_a_table_interpolates_and_says_where_it_ends(table):
    a, f = np.array([0.61, 0.93]), np.array([0.47, 1.11])
    values, slopes = table.simulated(np.stack([a, f], axis=1), np.array([0.77, 1.23]))
    p = np.array([0.77, 1.23])
    np.testing.assert_allclose(values, model(a, f, p), rtol=2e-3)
    np.testing.assert_allclose(slopes, 1.2 * model(a, f, p) / p, rtol=5e-3)
    back, errors = table.matching(np.stack([a, f], axis=1), values, 0.01 * values)
    np.testing.assert_allclose(back, p, rtol=1e-6)
    np.testing.assert_allclose(errors, 0.01 * values / slopes, rtol=1e-6)
    beyond, _ = table.matching(np.stack([a, f], axis=1), 9 * values, values)
    assert np.isnan(beyond).all()
    with pytest.raises(InputError, match=r"^A: 2 is outside of the simulated grid, which goes from 0.5 to 1.3"):
        table.curves(np.array([[2.0, 1.0]]))


def test_grids_that_are_none_are_refused(table):
    grid = xr.DataArray(table.values, {"A": A, "f": F, "p": P}, name="thrust")
    with pytest.raises(InputError, match="no dimension"):
        table_of(grid, "Cn")
    with pytest.raises(InputError, match="must lie between"):
        table_of(grid, "p", 3.0)
    with pytest.raises(InputError, match="two levels or more"):
        table_of(grid.isel(A=[0]), "p")
    with pytest.raises(InputError, match="3 of 294 values"):
        table_of(grid.where((grid["A"] != A[2]) | (grid["f"] != F[1]) | (grid["p"] > P[2])), "p")
    plain = table_of(grid.sel(p=1.0, drop=True))
    given = experiments(table, offset, 8)
    with pytest.raises(InputError, match="no axis of a parameter"):
        SimToReal("cn-gp").fit(plain, given)
    with pytest.raises(InputError, match="no experiment determines it"):
        SimToReal("cn").fit(table, Experiments(given.conditions, 50 + given.values, given.errors))
    with pytest.raises(InputError, match='Did you mean "cn-gp"'):
        SimToReal("cn-pg")


def test_experiments_that_are_none_are_refused():
    with pytest.raises(InputError, match="experiment 2 is NaN or infinite"):
        Experiments(np.zeros((2, 1)), np.array([1.0, np.nan]), np.zeros(2))
    with pytest.raises(InputError, match="same conditions"):
        Experiments(np.zeros((2, 1)), np.ones(2), np.zeros(2))


def test_errors_are_those_of_the_definition():
    found = errors_of(
        np.array([1.1, 1.8, 5.0]), np.array([1.0, 2.0, 0.0]), np.array([0.1, 0.05, np.nan]), np.full(3, 0.01)
    )
    assert found.mean == pytest.approx(10.0)
    assert found.signed == pytest.approx(0.0, abs=1e-12)
    assert found.largest == pytest.approx(10.0)
    assert found.total == pytest.approx(100 * 5.3 / 3)
    assert found.coverage == pytest.approx(50.0)
    assert found.floor == pytest.approx(100 * np.sqrt(2 / np.pi) * 0.01 * 0.75)
    assert found.small == 1


def test_uniform_plans_spread_and_grow(table):
    x = table.in_box(table.points)
    plans = [uniform_plan(x, n) for n in (1, 5, 12)]
    for short, long in pairwise(plans):
        np.testing.assert_array_equal(long[: len(short)], short)
    np.testing.assert_allclose(np.abs(x[plans[1]][1:] - 0.5), 0.5)  # the corners after the centre
    taken = x[plans[2]]
    apart = np.linalg.norm(taken[:, None] - taken, axis=-1) + 9 * np.eye(12)
    assert apart.min() > 0.25
    assert len(uniform_plan(x, 999)) == len(x)


def test_next_experiments_are_where_they_tell_most(table):
    """With all experiments on one side the next is on the other; with the aim of the highest it is near the optimum."""
    left = table.points[table.points[:, 0] < 0.9]
    rows = left[uniform_plan(table.in_box(left), 8)]
    values = offset(table, rows)
    given = Experiments(rows, values, 0.02 * values)
    one, two = next_experiments(SimToReal("gp"), table, given, 2)
    assert one.conditions[0] > 1.1
    assert one.error > two.error
    assert "least known" in one.reason
    assert "N at 95 %" in one.reason
    best, *_ = next_experiments(SimToReal("gp"), table, given, 1, "highest")
    np.testing.assert_allclose(best.conditions, [1.3, 1.3])
    assert "may better the highest so far" in best.reason
    lowest, *_ = next_experiments(SimToReal("gp"), table, given, 1, "lowest")  # the lowest was measured
    assert "nothing is likely to better the lowest so far" in lowest.reason
    fast = given.take(given.conditions[:, 1] > 0.4)
    lowest, *_ = next_experiments(SimToReal("gp"), table, fast, 1, "lowest")
    assert lowest.conditions[1] == pytest.approx(0.3)
    far, *_ = next_experiments(SimToReal("svd"), table, given, 1)
    assert far.conditions[0] == pytest.approx(1.3)
    assert "away from all others" in far.reason
    everywhere = Experiments(table.points, offset(table, table.points), 0 * table.points[:, 0])
    assert next_experiments(SimToReal("svd"), table, everywhere, 2) == []
