"""Static equilibrium: what it promises beside the published cases."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import Status
from nectosome.description import parse_robot
from nectosome.model import bind, build
from nectosome.solve import load_stepping, static

PENDULUM = """
name: pendulum
body:
  kind: rigid
  shape: cylinder
  length: 1 m
  radius: 1 cm
  mass: 2 kg
  volume: 1e-9 m3
  joint: {{kind: revolute, axis: y, position: {start}, stiffness: {stiffness}}}
"""
M_G = 2 * 9.80665


def pendulum(start: str, stiffness: str):
    return parse_robot(PENDULUM.format(start=start, stiffness=stiffness))


def test_a_sprung_beam_sags_until_the_spring_carries_it():
    """k x = m g (L/2) cos x; the turn about y is downward for positive x."""
    solution = load_stepping(build(pendulum("0 rad", "20 N m/rad")))
    x = float(solution.value.q[0])
    assert int(solution.status) == Status.SOLVED
    assert 20 * x == pytest.approx(M_G * 0.5 * np.cos(x), rel=1e-6)
    assert float(solution.residual) < 1e-10


def test_an_equilibrium_on_top_is_called_unstable():
    """It falls as exp(sqrt(3 g/(2 L)) t), L = 1 m; the rod's radius takes 1 in 12e3 of its inertia."""
    found = static(pendulum("-90 deg", "0 N m/rad"))
    assert int(found.status) == Status.UNSTABLE and found.stability.kind == "diverges"
    assert found.stability.growth == pytest.approx(np.sqrt(1.5 * 9.80665), rel=1e-4)
    assert found.reason == "found, but unstable: diverges, grows by 3.84 1/s"


def test_where_nothing_holds_there_is_no_equilibrium():
    sinking = """
name: sinking
body: {kind: rigid, shape: point, mass: 1 kg, joint: {kind: prismatic, axis: z}}
"""
    solution = load_stepping(build(parse_robot(sinking)))
    assert int(solution.status) == Status.NO_EQUILIBRIUM
    assert float(solution.stats["load"]) == 0


def test_a_batch_of_designs_is_the_designs_one_by_one():
    theta, make = bind(pendulum("0 rad", "20 N m/rad"), ("body.joint.stiffness",))
    many = theta * jnp.array([[0.5], [1.0], [3.0]])
    batch = eqx.filter_jit(jax.vmap(lambda k: load_stepping(make(k)).value.q[0]))(many)
    one = [float(load_stepping(build(pendulum("0 rad", f"{20 * s} N m/rad"))).value.q[0]) for s in (0.5, 1.0, 3.0)]
    assert np.asarray(batch) == pytest.approx(one, rel=1e-9)
