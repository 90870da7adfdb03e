"""What motion must keep: momentum and energy of free bodies, the energy a propeller is given, the choice of frame."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import simpson

from nectosome.core.se3 import dot, rotation_from_rpy
from nectosome.model import build
from nectosome.solve import simulate

TOP = """
name: top
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: box
  length: 0.3 m
  width: 0.2 m
  height: 50 mm
  mass: 2 kg
  centre_of_mass: [20 mm, -10 mm, 5 mm]
  joint:
    kind: free
    start:
      position: [1 m, 2 m, 3 m]
      orientation: [0.1 rad, 0.7 rad, -0.4 rad]
      angular_velocity: [0.3 rad/s, 9 rad/s, 0.2 rad/s]
      velocity: [0.5 m/s, -0.3 m/s, 0.2 m/s]
"""


def check(robot, method, rtol, within):
    run = simulate(robot, 1.0, samples=21, method=method, rtol=rtol, atol=1e-2 * rtol, initial=robot.initial())
    assert int(run.status) == 0
    moved = np.ptp(np.asarray(run.value.state.q), axis=0)
    assert np.all(moved > 1e-3)
    data = run.to_dataset()
    for kept in (data["momentum"], data["angular_momentum"], data["energy"].sum("form")):
        kept = kept.values
        np.testing.assert_allclose(kept, np.broadcast_to(kept[0], kept.shape), atol=within * np.linalg.norm(kept[0]))


def test_a_tumbling_body_keeps_momentum_and_energy(described):
    """It starts about its middle axis, which is unstable."""
    check(described(TOP), "explicit", 1e-10, 1e-8)


@pytest.mark.parametrize(("method", "rtol", "within"), [("explicit", 1e-9, 1e-6), ("implicit", 1e-8, 1e-6)])
def test_a_free_rod_keeps_momentum_and_energy(drifter, method, rtol, within):
    check(drifter, method, rtol, within)


@pytest.fixture(scope="module")
def swim(propelled):
    return simulate(propelled, 0.1, samples=21, rtol=1e-7, atol=1e-9)


def test_the_powers_of_a_swimming_propeller_balance(swim, propeller):
    ds = swim.to_dataset()
    assert float(ds.power_balance.max()) < 1e-12
    # what came in is what there is more, once the jerk of the start is over: the states follow the equations
    ds = ds.isel(time=slice(10, None))
    powers = ds.load_power.sum(["load", "part"]) + ds.reaction_power.sum("prescribed")
    energy = ds.energy.sum("form")
    given, scale = (simpson(p.values, x=ds.time.values) for p in (powers, np.abs(powers)))
    assert float(energy[-1] - energy[0]) == pytest.approx(given, abs=2e-5 * scale)
    assert float(ds.reaction_power.sel(prescribed="shaft.angle").mean()) > 0


def test_a_propeller_set_elsewhere_swims_the_same(swim, propeller):
    """Base moved and turned, and the current with it."""
    turn = (0.5, -1.0, 2.0)
    body = propeller.body.model_copy(update={"offset": (1.0, -2.0, 0.5), "rotation": turn})
    current = dot(rotation_from_rpy(jnp.array(turn)), jnp.array(propeller.water.current))
    water = propeller.water.model_copy(update={"current": tuple(np.asarray(current).tolist())})
    elsewhere = build(propeller.model_copy(update={"body": body, "water": water}))
    again = simulate(elsewhere, 0.1, samples=21, rtol=1e-7, atol=1e-9).value.state
    here = swim.value.state
    for a, b in ((again.q, here.q), (again.v, here.v)):
        np.testing.assert_allclose(a, b, atol=1e-9 * np.abs(b).max())
