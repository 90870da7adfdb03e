"""The file of a robot that a fit found: values, intervals and correlations as the fit has them."""

from dataclasses import replace

import numpy as np
import pytest
from tests.description.test_uncertainty import ROD
from tests.small_robots import DRIVEN

from nectosome.description import dump_robot, get_value, parse_robot
from nectosome.description.ranges import YIELDS
from nectosome.description.uncertainty import SIGMAS, sources_of, together
from nectosome.description.variables import read_variable
from nectosome.identification.fits.identifiability import Identifiability
from nectosome.identification.robot.found_robot import found_robot
from nectosome.units.ranges import Ranges

ROBOT = parse_robot(DRIVEN)
THETA = np.array([0.05, 0.02])
VARIABLES = [read_variable(name, (0.0, 0.1), ROBOT) for name in ("k", "c")]


def known(root):
    """Of two unknowns by the root of their information, in places of their ranges."""
    ranges = Ranges(["k", "c"], [0.0, 0.0], [0.1, 0.1], [])
    return Identifiability(ranges, THETA, np.asarray(root), 0.1)


def test_values_have_their_95_percent_intervals_and_pairs_their_correlation():
    covariance = np.array([[0.03**2, -0.8 * 0.03 * 0.01], [-0.8 * 0.03 * 0.01, 0.01**2]])
    robot = found_robot(ROBOT, VARIABLES, THETA, known(np.linalg.cholesky(np.linalg.inv(covariance)).T))
    k, c = (get_value(robot, name) for name in ("k", "c"))
    assert [float(k), float(c)] == THETA.tolist()
    assert [k.plus_minus, c.plus_minus] == pytest.approx([1.959964 * 0.003, 1.959964 * 0.001], rel=1e-6)
    (pair,) = robot.correlations
    assert pair.between == ("k", "c")
    assert pair.value == pytest.approx(-0.8, abs=1e-6)
    again = parse_robot(dump_robot(robot))
    sources = sources_of(again)
    places = [[source.name for source in sources].index(name) for name in ("k", "c")]
    assert together(again, sources)[tuple(places)] == pair.value


def test_a_modulus_has_what_its_law_leaves_out_beside_its_interval():
    """A standard error of 1 % and 10 % of the law, in quadrature of logarithms; the density has its interval alone."""
    robot = parse_robot(ROD % "{}")
    names = ("limbs.arm.young", "limbs.arm.density")
    theta = np.array([float(get_value(robot, name)) for name in names])
    ranges = Ranges([*names], [*(0.5 * theta)], [*(1.5 * theta)], [])
    covariance = np.array([[1.0, 0.5], [0.5, 1.0]]) * 0.01**2  # of places, a hundredth of the value each
    fit = Identifiability(ranges, theta, np.linalg.cholesky(np.linalg.inv(covariance)).T, 0.1)
    found = found_robot(robot, [replace(VARIABLES[0], name=name) for name in names], theta, fit)
    young, density = (get_value(found, name) for name in names)
    alone = np.log1p(SIGMAS * 0.01)
    wide = np.expm1(np.hypot(alone, SIGMAS * YIELDS))
    assert young.plus_minus == pytest.approx(wide * theta[0], rel=1e-6)
    assert density.plus_minus == pytest.approx(SIGMAS * 0.01 * theta[1], rel=1e-6)
    assert found.correlations[0].value == pytest.approx(0.5 * SIGMAS * 0.01 / wide, abs=1e-6)


def test_what_the_data_do_not_tell_has_no_interval():
    """The range alone makes the ends of k; nothing at all says how well c is known."""
    robot = found_robot(ROBOT, VARIABLES, THETA, known(np.diag([0.1, 100.0])))
    assert not hasattr(get_value(robot, "k"), "plus_minus")
    assert get_value(robot, "c").plus_minus == pytest.approx(1.959964 * 0.001, rel=1e-6)
    assert robot.correlations == ()
    bare = found_robot(ROBOT, VARIABLES, THETA, None)
    assert "+-" not in dump_robot(bare)
    assert float(get_value(bare, "c")) == THETA[1]


def test_the_file_can_be_read_whatever_the_fit_found():
    """Poisson's ratio of 0.45 with a standard error of 0.03: its interval ends at 0.5. What was told before stays."""
    told = "correlations: [{between: [limbs.arm.young, limbs.arm.density], value: 0.5}]\n"
    before = parse_robot(ROD % "{}" + told)
    ranges = Ranges(["nu"], [0.1], [0.9], [])  # wider than the field, so that both ends are those of the data
    fit = Identifiability(ranges, np.array([0.45]), np.array([[0.8 / 0.03]]), 0.1)
    variable = replace(VARIABLES[0], name="limbs.arm.poisson")
    robot = parse_robot(dump_robot(found_robot(before, [variable], fit.theta, fit)))
    assert get_value(robot, "limbs.arm.poisson").plus_minus == pytest.approx(0.05, rel=1e-12)
    assert [pair.value for pair in robot.correlations] == [0.5]
