"""A thruster: what a propeller gives a vehicle, what it takes from its shaft, and what is no propeller."""

from functools import cache

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.load_examples import _thruster
from tests.loads.test_contract import strips, water, wrench

from nectosome.description import parse_robot
from nectosome.description.propeller import ThrusterLoad
from nectosome.model import bind, build
from nectosome.solve import simulate, steady
from nectosome.units import InputError

RHO, D, RPM, DRAG_AREA, MASS = 1000.0, 0.1, 1200.0, 2e-3, 5.1
# Wageningen B, three blades, pitch over diameter 1, area ratio 0.718, at J = 0 and 0.6632 (Fossen, MSS, remus100)
A, A_Q = 0.4566, 0.0700
B, B_Q = (A - 0.1798) / 0.6632, (A_Q - 0.0312) / 0.6632
SCREW = f"diameter: {D} m, thrust: {A}, thrust_slope: {B!r}, torque: {A_Q}, torque_slope: {B_Q!r}"
TUG = """
name: tug
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  shape: spheroid
  length: 0.6 m
  radius: 60 mm
  mass: 5 kg
  joint: {{kind: {joint}, axis: x}}
  loads: {{drag: {{kind: lumped_drag, drag_area: [20 cm2, 0 m2, 0 m2]}}}}
limbs:
  rotor:
    kind: rigid
    shape: cylinder
    length: 20 mm
    radius: 50 mm
    mass: 100 g
    at: root
    joint: {{kind: revolute, axis: x, motion: {{kind: rate, rate: {rpm} rpm}}}}
    loads: {{screw: {{kind: thruster, {screw}, {more}}}}}
"""
N = RPM / 60
FIRST, SECOND = RHO * D**4 * A * N**2, RHO * D**3 * B * N  # T = FIRST - SECOND u
HALF = 0.5 * RHO * DRAG_AREA


def tug(joint="prismatic", rpm=RPM, screw=SCREW, more="hand: right"):
    return parse_robot(TUG.format(joint=joint, rpm=rpm, screw=screw, more=more))


def roots(first: float = FIRST, second: float = SECOND) -> tuple[float, float]:
    """Speeds at which thrust and drag are equal."""
    spread = np.sqrt(second**2 + 4 * first * HALF)
    return (spread - second) / (2 * HALF), (-spread - second) / (2 * HALF)


@cache
def at_speed():
    return steady(tug())


def test_a_vehicle_comes_to_its_speed_as_the_closed_form_says():
    """M u' = FIRST - SECOND u - HALF u^2 from rest; without the slope that is a tanh."""
    data = simulate(build(tug()), 5.0, samples=11, rtol=1e-8, atol=1e-9).to_dataset()
    fast, slow = roots()
    fade = fast / slow * np.exp(-HALF * (fast - slow) / MASS * data["time"].values)
    assert data["v"].values[:, 0] == pytest.approx((fast - fade * slow) / (1 - fade), rel=1e-6, abs=1e-9)


def test_its_steady_speed_is_that_at_which_thrust_and_drag_are_equal():
    assert float(at_speed().state.v[0]) == pytest.approx(roots()[0], rel=1e-9)


def test_the_shaft_takes_what_drag_and_slip_lose():
    """2 pi n Q by the closed form; the account of the run closes."""
    u = roots()[0]
    power = 2 * np.pi * N * RHO * D**5 * (A_Q * N**2 - B_Q * N * u / D)
    data = at_speed().to_dataset()
    loads = data["load_power"].sum("part").squeeze()
    assert float(data["reaction_power"].sum()) == pytest.approx(power, rel=1e-9)
    assert float(loads.sel(load="drag")) == pytest.approx(-HALF * u**3, rel=1e-9)
    assert float(loads.sel(load="screw")) == pytest.approx((FIRST - SECOND * u) * u - power, rel=1e-9)


def test_the_hull_rolls_against_a_right_handed_propeller():
    """By the torque of the water over the inertia of all that turns about x: hull, and rotor at a given speed."""
    robot = build(tug("revolute"))
    inertia = 5 * 2 / 5 * 0.06**2 + 0.1 * 0.05**2 / 2
    roll = eqx.filter_jit(robot.rates)(jnp.zeros(()), robot.initial()).v[0]
    assert float(roll) == pytest.approx(-RHO * D**5 * A_Q * N**2 / inertia, rel=1e-9)


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_backward_at_rest_it_pulls_by_its_backward_coefficients(hand: float):
    load, s = _thruster(hand), strips(1)
    turned = eqx.tree_at(
        lambda s: (s.velocity, s.angular_velocity),
        s,
        (0 * s.velocity, jnp.tile(-hand * 2 * jnp.pi * 3 * load.direction, (4, 1))),
    )
    found = wrench(load, turned, water("deep"))[0]
    expected = 1025 * 0.2**4 * 9 * np.concatenate([hand * 0.2 * 0.06 * load.direction, -0.3 * load.direction])
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_standing_still_it_does_nothing_and_goes_smoothly_through_there():
    load, s = _thruster(1.0), strips(1)

    def by_speed(n):
        turning = jnp.tile(2 * jnp.pi * n * load.direction, (4, 1))
        return wrench(load, eqx.tree_at(lambda s: s.angular_velocity, s, turning), water("deep"))[0]

    assert jnp.all(by_speed(0.0) == 0)
    assert float(jnp.abs(by_speed(1e-9)).max()) < 1e-5


def test_the_image_of_a_propeller_in_an_image_of_its_motion_gives_the_image_of_its_wrench():
    D_, about = np.diag([1.0, -1.0, 1.0]), np.diag([-1.0, 1.0, -1.0])
    row = {"diameter": 0.2, "thrust": 0.46, "thrust_slope": 0.42, "torque": 0.07, "torque_slope": 0.05}
    described = ThrusterLoad.model_validate({"kind": "thruster", **row, "direction": (2.0, -1.0, 2.0)})
    image, load, s = described.image(), _thruster(1.0), strips(1)
    other = eqx.tree_at(lambda x: (x.direction, x.hand), load, (jnp.asarray(image.direction) / 3, jnp.asarray(-1.0)))
    mirrored = eqx.tree_at(lambda s: (s.velocity, s.angular_velocity), s, (s.velocity @ D_, s.angular_velocity @ about))
    assert image.hand == "left"
    expected = wrench(load, s, water("deep"))[0] @ np.block([[about, 0 * D_], [0 * D_, D_]])
    np.testing.assert_allclose(wrench(other, mirrored, water("deep"))[0], expected, rtol=1e-12, atol=1e-12)


@pytest.mark.slow  # `test_contract.py` has the derivatives of the wrench
def test_the_speed_has_the_derivative_by_the_diameter():
    theta, to_robot = bind(tug(), ("limbs.rotor.loads.screw.diameter",))
    slope = jax.jacfwd(lambda theta: steady(to_robot(theta)).state.v[0])(theta)[0]

    def speed(d):
        return roots(RHO * d**4 * A * N**2, RHO * d**3 * B * N)[0]

    assert float(slope) == pytest.approx((speed(D + 1e-6) - speed(D - 1e-6)) / 2e-6, rel=1e-6)


@pytest.mark.parametrize(
    ("screw", "more", "message"),
    [
        (
            SCREW.replace("torque: 0.07", "torque: 0.007"),
            "hand: right",
            "limbs.rotor.loads.screw.torque: at an advance ratio of 0.987 the thrust gives more power than the shaft",
        ),
        (SCREW, "backward_torque: 0.01", "screw.backward_torque: at an advance ratio of 0.987 the thrust gives more"),
        (SCREW, "backward_thrust: 1", "screw.backward_thrust: at an advance ratio of 1.64 the thrust gives more power"),
        (SCREW, "hand: both", "screw.hand"),
        (SCREW.replace(f"diameter: {D} m", "diameter: 0 m"), "hand: right", "screw.diameter"),
    ],
)
def test_what_is_no_propeller_is_refused(screw: str, more: str, message: str):
    with pytest.raises(InputError) as caught:
        tug(screw=screw, more=more)
    assert message in str(caught.value)
