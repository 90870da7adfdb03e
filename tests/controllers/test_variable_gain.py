"""A geared motor at low speed: cogging and static friction against gains that grow there."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from nectosome.controllers import VariableGainPI
from nectosome.controllers.block_loop import BlockLoop, BlockLoopRecord
from nectosome.controllers.pid import ActuatorLimits
from nectosome.core import Block, Line, Stepper
from nectosome.drives import Dahl, Sensor

DT = 0.005
FREE = jnp.asarray(jnp.inf)


class GearedMotor(Block):
    """Torque [N m] in, speed [rad/s] out: J w' = u - d w - T sin(n angle) - friction that clings before it slides."""

    inertia: Float[Array, ""]
    drag: Float[Array, ""]
    cogging: Float[Array, ""]
    friction: Dahl
    teeth: int = eqx.field(static=True)

    def sampled(self, dt):
        return Turning(self, jnp.asarray(dt))


class Turning(Stepper):
    motor: GearedMotor
    dt: Float[Array, ""]

    def initial(self):
        return jnp.zeros(()), jnp.zeros(()), self.motor.friction.initial()

    def step(self, state, u):
        angle, speed, clinging = state
        m = self.motor
        torque = u.end - m.drag * speed - m.cogging * jnp.sin(m.teeth * angle) - clinging[1]
        after = speed + self.dt * torque / m.inertia
        clinging, _ = m.friction.step(clinging, Line(angle, angle + self.dt * after))
        return (angle + self.dt * after, after, clinging), Line(speed, after)


MOTOR = GearedMotor(
    inertia=jnp.asarray(2e-3),
    drag=jnp.asarray(0.02),
    cogging=jnp.asarray(0.05),
    friction=Dahl(limit=jnp.asarray(0.1), stiffness=jnp.asarray(20.0)),
    teeth=12,
)


def law(boost: float, most: float = 2.0) -> VariableGainPI:
    reach = ActuatorLimits(jnp.asarray(-most), jnp.asarray(most), FREE)
    kp, ki, extra, low = map(jnp.asarray, (0.02, 0.2, boost, 1.0))
    return VariableGainPI(kp, ki, extra, low, reach)


def turned(boost: float, speed: float, noise: float = 0.0) -> BlockLoopRecord:
    """8 s at a speed, the last 6 s of it: more than two teeth at the lowest."""
    loop = BlockLoop(MOTOR, Sensor(jnp.asarray(noise), -FREE, FREE), DT, substeps=20)
    track = loop.run(law(boost), np.full(1600, speed))
    return BlockLoopRecord(*(x[400:] for x in track))


@pytest.mark.parametrize("speed", [0.2, 0.5])
def test_the_variable_gain_turns_steadily_where_the_fixed_gain_sticks(speed):
    fixed, variable = (turned(boost, speed).output / speed for boost in (0.0, 20.0))
    assert np.std(fixed) > 1.0
    assert np.mean(np.abs(fixed) < 0.1) > 0.1  # of the time it stands
    assert np.std(variable) < 0.15
    assert np.min(variable) > 0.5
    assert np.mean(variable) == pytest.approx(1.0, abs=0.02)


def test_at_high_speed_the_gain_passes_on_no_more_noise_than_the_fixed_one():
    fixed, variable = (turned(boost, 10.0, noise=0.5).command for boost in (0.0, 20.0))
    assert np.std(variable) == pytest.approx(float(np.std(fixed)), rel=0.01)


def test_gains_are_as_the_formula_says():
    gains = law(20.0).planned(np.array([0.0, -1.0, 5.0]), DT).gains
    k = 1 + 20 * np.exp(-np.array([0.0, 1.0, 5.0]))
    np.testing.assert_allclose(gains, np.stack([0.02 * k, 0.2 * k, 0 * k], axis=1), rtol=1e-12)


def test_it_takes_over_a_held_command_without_a_bump():
    """The first command differs by one sample of the integral."""
    regulator = law(20.0).planned(np.array([0.5, 0.5]), DT)
    _, command = regulator.step(regulator.initial(0.13, 0.3), jnp.asarray(0.3))
    k = 1 + 20 * np.exp(-0.5)
    assert command == pytest.approx(0.13 + k * 0.2 * DT * 0.2, rel=1e-12)


def test_a_blocked_motor_does_not_wind_the_integral_up():
    """Held for 2 s at its limit, the command comes off it as soon as the speed is more than wanted."""
    regulator = law(20.0, most=0.1).planned(np.array([0.5]), DT)
    state, command = regulator.initial(), jnp.zeros(())
    step = eqx.filter_jit(regulator.step)
    for _ in range(400):
        state, command = step(state, jnp.asarray(0.0))
    assert command == 0.1
    _, command = step(state, jnp.asarray(0.7))
    assert command < 0.1
