"""Metrics of a step, against those of a second-order system in closed form."""

import numpy as np
import pytest

from nectosome.controllers import rms_error, step_response
from nectosome.controllers.tracking_errors import still_approaching

DAMPING, W = 0.4, 3.0


def step(t, damping=DAMPING):
    """Unit step of w^2/(s^2 + 2 z w s + w^2), z < 1."""
    wd = W * np.sqrt(1 - damping**2)
    return 1 - np.exp(-damping * W * t) * (np.cos(wd * t) + damping * W / wd * np.sin(wd * t))


def test_the_step_of_a_second_order_system_has_its_textbook_numbers():
    """Overshoot exp(-pi z/sqrt(1 - z^2)); about -20 + 0.5 the numbers are the same as about 0."""
    t = np.linspace(0.0, 8.0, 4001)
    found = step_response(t, -20 + 0.5 * step(t), np.full(t.size, -19.5))
    assert found is not None
    assert found.overshoot == pytest.approx(np.exp(-np.pi * DAMPING / np.sqrt(1 - DAMPING**2)), rel=1e-5)
    y = step(t)
    assert found.rise == pytest.approx(t[np.argmax(y > 0.9)] - t[np.argmax(y > 0.1)], abs=2e-3)
    assert found.settling == pytest.approx(t[np.flatnonzero(abs(y - 1) > 0.05)[-1]], abs=2e-3)
    assert abs(found.steady_error) < 1e-4


def test_what_does_not_happen_has_no_number():
    t = np.linspace(0.0, 1.0, 11)
    slow = step_response(t, 0.5 * t, np.ones(11))
    assert slow is not None
    assert np.isnan(slow.rise) and np.isnan(slow.settling)
    assert slow.overshoot == 0.0
    assert slow.steady_error == pytest.approx(-0.525)
    assert step_response(t, t, np.sin(t)) is None
    assert step_response(t, t, np.zeros(11)) is None


def test_a_way_down_is_a_step_too():
    t = np.linspace(0.0, 5.0, 501)
    found = step_response(t, 2 - 3 * (1 - np.exp(-2 * t)), np.full(501, -1.0))
    assert found is not None
    assert found.rise == pytest.approx(np.log(9) / 2, rel=1e-3)
    assert found.settling == pytest.approx(np.log(20) / 2, rel=1e-3)
    assert found.overshoot == 0.0


def test_rms_error():
    assert rms_error(np.array([1.0, 3.0]), np.array([0.0, 0.0])) == pytest.approx(np.sqrt(5))


@pytest.mark.parametrize(("error", "approaches"), [
    (lambda t: 9 - 0.1 * t, True),  # a drift far from the reference
    (lambda t: 1 + np.exp(-t / 2), True),  # not settled
    (lambda t: 1 + np.exp(-5 * t), False),
    (lambda t: -1 - np.exp(-t / 2), True),
    (lambda t: 1 + t, False),
    (lambda t: np.ones_like(t), False),
])  # fmt: skip
def test_an_error_that_still_decreases_is_told_from_one_that_stays(error, approaches):
    assert still_approaching(error(np.linspace(0, 3, 61))) is approaches
