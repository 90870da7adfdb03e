"""What counts as zero, and what is small but real."""

import numpy as np
import pytest

from nectosome.units.zero import counts_as_zero


@pytest.mark.parametrize(
    ("value", "largest", "peak", "zero"),
    [
        (-9.7e-10, 7.0, 0.0, True),  # W of one load beside 7 W of another: rounding
        (0.9e-9, 1.0, 0.0, True),
        (1.1e-9, 1.0, 0.0, False),
        (-3.2e-8, 0.33, 6e-8, False),  # W that soft tentacles burn, beside a weight that gives 0.33 W and takes it back
        (2.3e-9, 0.15, 0.01, True),  # W on the mean of a spring that gives and takes 10 mW
        (0.9e-5, 1.0, 1.0, True),
        (1.1e-5, 1.0, 1.0, False),
        (1e-13, 1e-13, 1e-13, False),  # nothing is zero by its size alone
        (0.0, 0.0, 0.0, True),
        (float("nan"), 1.0, 1.0, False),
        (1e200, float("inf"), 0.0, False),  # m/s whose square overflows
        (1e200, 1e200, float("inf"), False),
    ],
)
def test_a_number_counts_as_zero_beside_its_kind_or_its_own_peak_only(value, largest, peak, zero):
    assert bool(counts_as_zero(value, largest, peak)) is zero


def test_arrays_are_judged_number_by_number():
    found = counts_as_zero(np.array([1.0, 1e-10, 1e-7]), 1.0, np.array([1.0, 0.0, 0.1]))
    assert found.tolist() == [False, True, True]


def test_a_solver_may_be_less_exact():
    assert not counts_as_zero(5e-4, 1.0, 1.0)
    assert counts_as_zero(5e-4, 1.0, 1.0, 1e-3)
