"""Rules of mixture: limits, inverses, the paper's numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from nectosome.designs.composite import ratio_of, young_of
from nectosome.units import InputError

CORE, SHELL = 17e6, 592e3  # Ninjaflex, Dragon Skin 50
RULES = ("EJ", "EJV")


@pytest.mark.parametrize("rule", RULES)
def test_no_core_is_the_shell_and_no_shell_is_the_core(rule):
    assert young_of(0.0, CORE, SHELL, rule) == pytest.approx(SHELL, rel=1e-15)
    assert young_of(1.0, CORE, SHELL, rule) == pytest.approx(CORE, rel=1e-15)


def test_the_papers_numbers():
    """Both rules for 7.4 MPa, and what the printed 0.81 gives."""
    assert ratio_of(7.4e6, CORE, SHELL, "EJ") == pytest.approx(0.8026, abs=1e-3)
    assert ratio_of(7.4e6, CORE, SHELL, "EJV") == pytest.approx(0.8693, abs=1e-4)
    assert young_of(0.81, CORE, SHELL, "EJ") == pytest.approx(7.66e6, rel=1e-3)
    assert young_of(0.81, CORE, SHELL, "EJV") == pytest.approx(4.92e6, rel=1e-3)


@given(st.sampled_from(RULES), st.floats(1e4, 1e9), st.floats(1e4, 1e9), st.floats(0, 1))
def test_the_ratio_gives_back_the_modulus(rule, core, shell, share):
    if rule == "EJV":
        low = minimize_scalar(lambda b: young_of(b, core, shell, rule), bounds=(0, 1), method="bounded").fun
        low, high = min(low, core), core
    else:
        low, high = sorted((core, shell))
    young = low + (0.01 + 0.98 * share) * (high - low)
    if high - low < 1e-6 * high:
        return
    assert young_of(ratio_of(young, core, shell, rule), core, shell, rule) == pytest.approx(young, rel=1e-9)


@pytest.mark.parametrize("rule", RULES)
def test_what_cannot_be_made_is_refused(rule):
    for young in (1e5, 2e7):
        with pytest.raises(InputError, match="out of reach"):
            ratio_of(young, CORE, SHELL, rule)
    with pytest.raises(InputError, match="from 0 to 1"):
        young_of(1.1, CORE, SHELL, rule)
    with pytest.raises(InputError, match="more than 0"):
        young_of(0.5, -1.0, SHELL, rule)
    with pytest.raises(InputError, match="more than 0"):
        ratio_of(1e6, np.nan, SHELL, rule)
