"""What is seen where no cycle is found: growth and approach by closed forms, another period, none."""

import jax.numpy as jnp
import numpy as np
import pytest
from tests.solve.test_integrate import Damper

from nectosome.core import Solution, State, Status
from nectosome.mechanism import Attached
from nectosome.model import build
from nectosome.solve import find_symmetry, periodic
from nectosome.solve.orbit import Orbit, cycle_settings
from nectosome.solve.without_cycle import instead_of_cycle, periods_agree


@pytest.mark.parametrize(("rate", "kind", "word"), [(0.2, "grows", "grows"), (-0.2, "closes", "closer")])
def test_a_velocity_that_grows_or_decays_does_so_by_its_exponential(slider, rate, kind, word):
    """m v' = c v, m = 2 kg: exp(rate T) a period of 0.5 s."""
    robot = slider(Attached("pump", 0, Damper(jnp.asarray(-2.0 * rate))))
    found = instead_of_cycle(robot, find_symmetry(robot), State(jnp.zeros(1), jnp.ones(1), ()), 0.5)
    assert found.kind == kind
    assert found.growth == pytest.approx(np.exp(rate * 0.5), rel=1e-3)
    assert word in found.words(0.5)


@pytest.mark.parametrize(("speed", "agrees"), [(1.0, False), (1e-7, True)])
def test_what_decays_slowly_does_not_come_back_from_period_to_period(slider, speed, agrees):
    """At exp(-0.1) a period; of 1e-7 m/s all is below the tolerance of 1e-8 m/s times a limit of 20."""
    robot = slider(Attached("pump", 0, Damper(jnp.asarray(0.4))))
    states = State(jnp.zeros((5, 1)), jnp.full((5, 1), speed), ())
    found = Solution(
        Orbit(states, jnp.eye(2), jnp.zeros((2, 2))),
        Status.SOLVED,
        {"residual_limit": jnp.asarray(20.0)},
        jnp.asarray(5.0),
    )
    settings = cycle_settings("implicit", 0.5, 1e-6, 1e-8)
    assert periods_agree(robot, find_symmetry(robot), found, 0.5, settings) is agrees


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
