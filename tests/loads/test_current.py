"""Bodies that move through water and water that moves past bodies."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from nectosome.description import RobotDescription
from nectosome.mechanism import Robot, diagnose
from nectosome.model import build
from nectosome.solve import simulate

CD, CA, LENGTH, DIAMETER, MASS = 1.1, 0.9, 0.3, 0.02, 0.12
AREA = np.pi * DIAMETER**2 / 4
AMPLITUDE, OMEGA = 0.03, 2 * np.pi * 1.5
TIMES = np.linspace(0.0, 0.7, 15)


def cylinder(joint: dict, gravity: float = 9.81, **water) -> RobotDescription:
    loads = {"drag": {"kind": "drag", "normal": CD}, "added_mass": {"kind": "added_mass", "normal": CA}}
    body = {"kind": "rigid", "shape": "cylinder", "length": LENGTH, "radius": DIAMETER / 2, "mass": MASS}
    whole = {"name": "test", "water": {"gravity": gravity, **water}, "body": body | {"joint": joint, "loads": loads}}
    return RobotDescription.model_validate(whole)


@eqx.filter_jit
def drive_force(robot: Robot) -> Float[Array, "times"]:
    return jax.vmap(lambda t: diagnose(robot, t, robot.initial()).reaction[0])(jnp.asarray(TIMES))


def test_an_oscillating_cylinder_needs_morisons_force():
    """F = (m + C_a rho V) a + 1/2 rho C_d D L |v| v."""
    motion = {"kind": "sine", "amplitude": AMPLITUDE, "frequency": OMEGA / (2 * np.pi)}
    robot = build(cylinder({"kind": "prismatic", "axis": "y", "motion": motion}))
    v = AMPLITUDE * OMEGA * np.cos(OMEGA * TIMES)
    a = -AMPLITUDE * OMEGA**2 * np.sin(OMEGA * TIMES)
    expected = (MASS + CA * 1000 * AREA * LENGTH) * a + 0.5 * 1000 * CD * DIAMETER * LENGTH * np.abs(v) * v
    assert np.asarray(drive_force(robot)) == pytest.approx(expected, rel=1e-10, abs=1e-12)


class Swell(eqx.Module):
    """A current that swings to and fro along y."""

    speed: Float[Array, ""]
    omega: Float[Array, ""]

    def __call__(self, t: Array, x: Array) -> Array:
        return jnp.array([0.0, 1.0, 0.0]) * self.speed * jnp.sin(self.omega * t)


def in_swell(robot: Robot) -> Robot:
    swell = Swell(jnp.asarray(AMPLITUDE * OMEGA), jnp.asarray(OMEGA))
    return eqx.tree_at(lambda r: r.water.current, robot, swell, is_leaf=lambda x: x is None)


def test_a_held_cylinder_in_swell_feels_the_inertia_coefficient_one_plus_ca():
    """F = (1 + C_a) rho V du/dt + 1/2 rho C_d D L |u| u: the 1 is the pressure of the accelerating water."""
    held = {"kind": "prismatic", "axis": "y", "motion": {"kind": "constant", "value": 0.0}}
    robot = in_swell(build(cylinder(held)))
    u = AMPLITUDE * OMEGA * np.sin(OMEGA * TIMES)
    du = AMPLITUDE * OMEGA**2 * np.cos(OMEGA * TIMES)
    expected = (1 + CA) * 1000 * AREA * LENGTH * du + 0.5 * 1000 * CD * DIAMETER * LENGTH * np.abs(u) * u
    assert -np.asarray(drive_force(robot)) == pytest.approx(expected, rel=1e-10, abs=1e-12)


def test_a_body_carried_by_a_current_is_the_same_body_towed_backwards():
    """Galileo: adding one velocity to water and body changes nothing but the place."""
    c = np.array([0.3, -0.2, 0.1])
    start = {"kind": "free", "start": {"orientation": (0.3, 0.4, 0.9), "angular_velocity": (0.5, -1.0, 2.0)}}
    still = build(cylinder(start, gravity=9.81))
    flowing = build(cylinder(start, gravity=9.81, current=tuple(c)))
    towed = eqx.tree_at(lambda x: x.v, still.initial(), still.initial().v.at[3:].set(-_to_body(still) @ c))
    options = {"time": 0.5, "samples": 6, "rtol": 1e-9, "atol": 1e-11, "method": "explicit"}
    a, b = (
        np.asarray(run.value.state.q)
        for run in (simulate(flowing, **options), simulate(still, initial=towed, **options))
    )
    drift = np.linspace(0, 0.5, 6)[:, None] * c
    assert a[:, :3] == pytest.approx(b[:, :3] + drift, abs=1e-7)
    assert a[:, 3:] == pytest.approx(b[:, 3:], abs=1e-7)
    assert np.linalg.norm(a[-1, :3]) > 0.01


def _to_body(robot: Robot) -> np.ndarray:
    q, *_ = robot.tree.complete(jnp.zeros(()), robot.initial().q, robot.initial().v)
    return np.asarray(robot.tree.shape(q).rotation[0]).T
