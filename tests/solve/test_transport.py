"""Energy per metre, cost of transport, endurance and range against closed forms, on states that are known."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State
from nectosome.description import parse_robot
from nectosome.model import bind, build
from nectosome.solve import cycle_means
from nectosome.solve.transport import KINDS

U0, RB, IDLE, CHARGE = 12.0, 0.5, 2.0, 3600.0  # V, ohm, W, A s: 1 Ah
DUTY, R, K = 0.25, 1.5, 0.02  # of a motor by its constants: ohm, N m/A
G = 9.80665


def arm(name: str, battery: str) -> str:
    return f"""
  {name}:
    kind: rigid
    shape: box
    length: 0.1 m
    width: 10 mm
    height: 10 mm
    mass: 0.1 kg
    joint:
      kind: revolute
      axis: z
      motor:
        torque_constant: {K} N m/A
        resistance: {R} ohm
        battery: {battery}
        duty_cycle: {{kind: constant, value: {DUTY}}}"""


# a body that travels, with two arms that their motors cannot turn: each takes (d U)^2/R
STALLED = f"""
name: stalled
water: {{gravity: 0 m/s2}}
batteries:
  pack: {{voltage: {U0} V, resistance: {RB} ohm, capacity: 1 Ah, idle_power: {IDLE} W}}
  spare: {{voltage: {U0} V, idle_power: 1 W}}
body:
  kind: rigid
  shape: spheroid
  length: 0.2 m
  radius: 0.05 m
  mass: 2 kg
  joint: {{kind: planar, axis: z, drive: {{x: {{kind: constant, value: 3 N}}}}}}
limbs:{arm("one", "pack")}{arm("other", "spare")}
"""
V = 0.4  # m/s
MASS = 2.2


def voltage() -> float:
    """Root of U = U0 - RB (IDLE + (d U)^2/R)/U."""
    a = 1 + RB * DUTY**2 / R
    return (U0 + np.sqrt(U0**2 - 4 * a * RB * IDLE)) / (2 * a)


def gliding(robot, speed: float = V):
    """Means of a robot that goes along x; its arms stand still."""
    times = jnp.linspace(0.0, 2.0, 17)
    rates = jnp.zeros((17, 5)).at[:, 0].set(speed)
    return cycle_means(robot, times, State(times[:, None] * rates, rates, jax.tree.map(over(17), robot.initial().z)))


def over(n: int):
    return lambda x: jnp.broadcast_to(x, (n, *x.shape))


@pytest.fixture(scope="module")
def means():
    return jax.jit(gliding)(build(parse_robot(STALLED)))


def test_a_battery_lasts_its_charge_over_its_current(means):
    """Its own resistance takes its part; a battery without a capacity says nothing, and the other one counts."""
    current = (U0 - voltage()) / RB
    assert float(means.battery_power[0]) == pytest.approx(voltage() * current, rel=1e-10)
    assert float(means.battery_endurance[0]) == pytest.approx(CHARGE / current, rel=1e-9)
    assert np.isnan(means.battery_endurance[1])
    assert float(means.endurance) == pytest.approx(CHARGE / current, rel=1e-9)
    assert float(means.range) == pytest.approx(V * CHARGE / current, rel=1e-9)


def test_each_power_has_its_energy_per_metre_and_cost(means):
    """Drives 3 N V, forward and so positive; motors (d U)^2/R; batteries these and the electronics."""
    burnt = [(DUTY * U) ** 2 / R for U in (voltage(), U0)]
    powers = {"": 3.0 * V, "_positive": 3.0 * V, "_electrical": sum(burnt), "_battery": sum(burnt) + IDLE + 1.0}
    assert [*powers] == [*KINDS]
    for kind, power in powers.items():
        energy, cost = getattr(means, f"energy_per_metre{kind}"), getattr(means, f"cost_of_transport{kind}")
        assert float(energy) == pytest.approx(power / V, rel=1e-9), kind
        assert float(cost) == pytest.approx(power / (MASS * G * V), rel=1e-9), kind


def test_a_body_that_stays_has_an_endurance_and_no_range(means):
    still = jax.jit(gliding)(build(parse_robot(STALLED)), 0.0)
    assert float(still.endurance) == pytest.approx(float(means.endurance), rel=1e-12)
    for name in ("range", *(f"{what}{kind}" for what in ("energy_per_metre", "cost_of_transport") for kind in KINDS)):
        assert np.isnan(getattr(still, name)), name


def test_what_a_spring_holds_has_no_cost_of_transport_of_a_speed_that_is_rounding():
    """0.1 um/s of 0.5 m/s: neither a cost of transport nor a Strouhal number."""
    robot = build(
        parse_robot("""
name: hammer
water: {gravity: 0 m/s2}
body:
  {kind: rigid, shape: spheroid, length: 0.2 m, radius: 0.05 m, mass: 2 kg,
   joint: {kind: prismatic, axis: x, stiffness: 200 N/m, force: {kind: sine, amplitude: 3 N, frequency: 1 Hz}}}
""")
    )
    times = jnp.linspace(0.0, 1.0, 17)
    q = 0.1 * jnp.sin(2 * jnp.pi * times) + 1e-7 * times
    v = 0.2 * jnp.pi * jnp.cos(2 * jnp.pi * times)
    found = cycle_means(robot, times, State(q[:, None], v[:, None], jax.tree.map(over(17), robot.initial().z)))
    assert float(found.speed) == pytest.approx(1e-7, rel=1e-6)
    for name in ("energy_per_metre", "cost_of_transport_positive", "strouhal"):
        assert np.isnan(getattr(found, name)), name


def test_a_robot_without_batteries_has_none_of_theirs():
    text = STALLED.partition("batteries:")[0] + "body:" + STALLED.partition("body:")[2].partition("limbs:")[0]

    def glides(robot):
        times = jnp.linspace(0.0, 2.0, 17)
        rates = jnp.zeros((17, 3)).at[:, 0].set(V)
        return cycle_means(robot, times, State(times[:, None] * rates, rates, robot.initial().z))

    means = jax.jit(glides)(build(parse_robot(text)))
    assert float(means.energy_per_metre) == pytest.approx(3.0, rel=1e-12)
    for name in ("endurance", "range", "energy_per_metre_electrical", "cost_of_transport_battery"):
        assert np.isnan(getattr(means, name)), name
    assert means.battery_endurance.shape == (0,)


def test_endurance_has_derivatives():
    """In reverse: by the charge E/Q; by the motor's resistance as finite differences have it. NaN spoils neither."""
    theta, build_at = bind(parse_robot(STALLED), ("batteries.pack.capacity", "limbs.one.joint.motor.resistance"))

    def lasts(theta):
        means = gliding(build_at(theta))
        return means.endurance + means.range + 1e4 * means.cost_of_transport_battery

    both = jax.jit(jax.value_and_grad(lasts))
    back = both(theta)[1]
    assert float(back[0]) == pytest.approx((1 + V) * RB / (U0 - voltage()), rel=1e-9)
    h = 1e-4
    behind, beyond = (float(both(theta + np.array([0.0, s * h]))[0]) for s in (-1, 1))
    assert float(back[1]) == pytest.approx((beyond - behind) / (2 * h), rel=1e-6)
