"""Corrections as labelled data, and what is proposed where nothing can be bettered."""

import numpy as np
import pytest
from tests.synthetic_campaign import FREQUENCIES, PLAN, A, grid, mean

from nectosome.identification import Experiments, SimToReal, corrected_data, leave_one_out, next_experiments, table_of

THRUST = -grid()["force"].sel(axis="y", drop=True)
TABLE = table_of(THRUST, "Cn")


@pytest.fixture(scope="module")
def experiments():
    points = np.array([(A[i], FREQUENCIES[j]) for i, j in PLAN])
    values = mean(*points.T)
    return Experiments(points, values, 0.01 * values)


@pytest.mark.parametrize("method", ["cn-gp", "affine"])
def test_data_are_what_the_correction_gives_at_each_point(experiments, method):
    how = SimToReal(method)
    fitted, left_out = how.fit(TABLE, experiments), leave_one_out(how, TABLE, experiments)
    planned = next_experiments(how, TABLE, experiments, 2)
    found = corrected_data(fitted, THRUST, experiments, left_out, planned)
    for place in ((0, 0), (1, 3), (4, 2)):
        there = found.isel(A=place[0], f=place[1])
        point = np.array([[float(there["A"]), float(there["f"])]])
        value, error = fitted.predict(point)
        np.testing.assert_allclose([there["force"], there["force_error"]], [value[0], error[0]], rtol=1e-9)
        assert float(there["simulated"]) == pytest.approx(point[0, 0] * point[0, 1] ** 2, rel=1e-9)
        told = fitted.parameter(point).mean[0] if method == "cn-gp" else np.nan
        assert float(there["parameter"]) == pytest.approx(told, rel=1e-9, nan_ok=True)
    np.testing.assert_array_equal(found["predicted"], left_out.mean)
    np.testing.assert_array_equal(found["next_f"], [one.conditions[1] for one in planned])
    assert found["measured_A"].attrs["units"] == "rad"


def test_a_quantity_keeps_its_name_unless_it_is_taken(experiments):
    how = SimToReal("gp")
    fitted, left_out = how.fit(TABLE, experiments), leave_one_out(how, TABLE, experiments)
    for name, expected in (("thrust", "thrust"), ("simulated", "corrected"), ("f", "corrected")):
        found = corrected_data(fitted, THRUST.rename(name), experiments, left_out)
        assert found.attrs["quantity"] == expected
        assert {expected, f"{expected}_error", "simulated"} <= set(found)


def test_the_least_known_point_is_next_where_the_best_is_measured(experiments):
    """Thrust grows to the corner (60 deg, 1.3 Hz): known there, nothing betters it; left out, it is next."""
    how = SimToReal("gp")
    for_best, for_error = (next_experiments(how, TABLE, experiments, 1, aim)[0] for aim in ("highest", "error"))
    np.testing.assert_array_equal(for_best.conditions, for_error.conditions)
    assert "nothing is likely to better the highest" in for_best.reason
    without = experiments.take(~np.all(np.isclose(experiments.conditions, [A[4], 1.3]), axis=1))
    assert len(without.values) == len(PLAN) - 1
    np.testing.assert_allclose(next_experiments(how, TABLE, without, 1, "highest")[0].conditions, [A[4], 1.3])
