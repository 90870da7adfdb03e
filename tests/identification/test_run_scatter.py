"""Intervals of several recordings hold what differs between these: by the scatter of what each of them tells."""

import numpy as np
import pytest
from scipy.stats import t as student

from nectosome.description import parse_robot
from nectosome.identification import identify
from nectosome.identification.fits.errors import SIDES

# a slider on a spring: it goes by F/k
SLIDER = """
name: slider
water: {density: 1e-3 kg/m3, gravity: 0 m/s2}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  joint: {kind: prismatic, axis: x, stiffness: 10 N/m}
  loads: {pull: {kind: force, force: [1 N, 0 N, 0 N], at: root}}
aliases: {k: body.joint.stiffness, F: body.loads.pull.force.0}
"""
FORCES = np.array([1.0, 1.0, 1.0])  # N
TOLD = np.array([10.0, 10.2, 9.9, 10.1, 9.7, 10.3])  # N/m, by each recording
ERROR = 1e-4  # m


@pytest.fixture(scope="module")
def slider():
    return parse_robot(SLIDER)


def found(slider, stiffness, error=ERROR, at=None):
    """The fit to recordings of which each has a stiffness of its own; `at` are their masses, which do nothing here."""
    runs = [
        {"time": None, "pull": (FORCES, "N"), "way": FORCES / k}
        | ({} if at is None else {"body.mass": (np.array(at[i]), "kg")})
        for i, k in enumerate(stiffness)
    ]
    vary, compare = {"k": "5..20N/m"}, {"way": "body.position"}
    return identify(slider, runs, vary=vary, compare=compare, drive={"pull": "F"}, errors={"way": error}, starts=1)


def half_width(fit) -> float:
    (interval,) = fit.identifiability.intervals()
    return 0.5 * (interval.high - interval.low)


def test_an_interval_is_that_of_students_t_of_what_recordings_tell(slider):
    """k = F/mean(x): s_x/sqrt(G) of the mean, and |dk/dx| = k^2/F."""
    fit = found(slider, TOLD)
    ways = 1 / TOLD
    k = 1 / ways.mean()
    assert fit.theta[0] == pytest.approx(k, rel=1e-6)
    exact = student.ppf(0.975, TOLD.size - 1) * ways.std(ddof=1) / np.sqrt(TOLD.size) * k**2
    assert half_width(fit) == pytest.approx(exact, rel=1e-4)
    noise = SIDES * ERROR / np.sqrt(3 * TOLD.size) * k**2
    assert fit.scatter == (
        f"by the scatter between 6 recordings: intervals of k {exact / noise:.2g} times as wide as by noise alone",
    )


def test_noise_is_never_less_than_it_is_and_two_recordings_tell_no_scatter(slider):
    """Of six alike the noise is left, and of two that differ, however much."""
    for stiffness in (np.full(6, 10.0), TOLD[1:3]):
        fit = found(slider, stiffness)
        assert fit.scatter == ()
        k = 1 / np.mean(1 / stiffness)
        assert half_width(fit) == pytest.approx(SIDES * ERROR / np.sqrt(3 * stiffness.size) * k**2, rel=1e-4)


def test_recordings_that_tell_more_count_as_fewer(slider):
    """Of pulls by 1, 1 and 5 N the last one decides: a = 1/27 and 25/27, and a degree of freedom is the least."""
    forces, told = np.array([1.0, 1.0, 5.0]), np.array([9.9, 10.05, 10.1])
    runs = [
        {"time": None, "pull": (np.full(3, F), "N"), "way": np.full(3, F / k)}
        for F, k in zip(forces, told, strict=True)
    ]
    how = {"drive": {"pull": "F"}, "errors": {"way": ERROR}, "starts": 1}
    fit = identify(slider, runs, vary={"k": "5..20N/m"}, compare={"way": "body.position"}, **how)
    ways, k = forces / told, float(fit.theta[0])
    others = np.array([np.sum(np.delete(forces**2, g)) / np.sum(np.delete(forces * ways, g)) for g in range(3)])
    slope = [2 * k - k**2 * np.sum(np.delete(forces * ways, g)) / np.sum(np.delete(forces**2, g)) for g in range(3)]
    spread = np.sqrt(2 / 3 * np.sum((slope - np.mean(slope)) ** 2))  # the same to first order from the fit
    assert np.allclose(others, slope, atol=2e-3)
    assert half_width(fit) == pytest.approx(student.ppf(0.975, 1) * spread, rel=1e-3)


def test_what_is_the_same_in_repeats_is_told_by_conditions(slider):
    """Three masses of which each has three repeats: by F the conditions differ, with two degrees of freedom."""
    by_condition, repeats = np.repeat([9.0, 10.0, 11.0], 3), np.tile([-0.02, 0.0, 0.02], 3)
    masses = np.repeat([1.0, 2.0, 3.0], 3)
    fit = found(slider, by_condition + repeats, at=masses)
    ways = 1 / (by_condition + repeats)
    k, means = 1 / ways.mean(), ways.reshape(3, 3).mean(axis=1)
    exact = student.ppf(0.975, 2) * means.std(ddof=1) / np.sqrt(3) * k**2
    assert half_width(fit) == pytest.approx(exact, rel=1e-3)
    assert "between 3 conditions" in fit.scatter[0]
    alike = found(slider, np.tile(TOLD[:3], 3), at=masses)  # the same scatter at each
    assert "between 9 recordings" in alike.scatter[0]
