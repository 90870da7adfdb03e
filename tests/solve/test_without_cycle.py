"""What is seen where no cycle is found: growth and approach by closed forms, another period, none."""

import jax.numpy as jnp
import numpy as np
import pytest
from tests.solve.test_integrate import Damper

from nectosome.core import State
from nectosome.mechanism import Attached
from nectosome.model import build
from nectosome.solve import find_symmetry, periodic
from nectosome.solve.without_cycle import instead_of_cycle


@pytest.mark.parametrize(("rate", "kind", "word"), [(0.2, "grows", "grows"), (-0.2, "closes", "closer")])
def test_a_velocity_that_grows_or_decays_does_so_by_its_exponential(slider, rate, kind, word):
    """m v' = c v, m = 2 kg: exp(rate T) a period of 0.5 s."""
    robot = slider(Attached("pump", 0, Damper(jnp.asarray(-2.0 * rate))))
    found = instead_of_cycle(robot, find_symmetry(robot), State(jnp.zeros(1), jnp.ones(1), ()), 0.5)
    assert found.kind == kind
    assert found.growth == pytest.approx(np.exp(rate * 0.5), rel=1e-3)
    assert word in found.words(0.5)


def test_half_of_the_period_of_the_drives_comes_back_after_two(driven):
    robot = build(driven)
    cycle = periodic(robot)
    found = instead_of_cycle(robot, find_symmetry(robot), cycle.state, 0.5 * float(cycle.stats["period"]))
    assert (found.kind, found.periods) == ("repeats", 2)
    assert "--period 769.2ms" in found.words(0.5 / 1.3)


def test_an_incommensurate_period_wanders(driven):
    robot = build(driven)
    cycle = periodic(robot)
    found = instead_of_cycle(robot, find_symmetry(robot), cycle.state, 0.6180339887 * float(cycle.stats["period"]))
    assert found.kind == "wanders"
