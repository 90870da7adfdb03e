"""The speed loop of a geared motor, as it runs on its microcontroller."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .contract import Controller
from .pid import ActuatorLimits, PIDRegulator


class VariableGainPI(Controller):
    r"""A PI of speed whose gains grow where the motor is to turn slowly.

    $$ u = k K_p\, e + \int k K_i\, e\, dt, \quad k = 1 + \beta\, e^{-|r|/w_0} $$

    with the reference r and the error e = r - y. Cogging and static friction are as strong at low speed as at high
    speed, where the inertia carries the motor over them; slowly, only the gain does. High gains at high speed would
    pass on the noise of the encoder. Limits, anti-windup and the change of gains without a bump are those of a PID.
    """

    proportional: Float[Array, ""]  # K_p, command per rad/s
    integral: Float[Array, ""]  # K_i, command per rad
    boost: Float[Array, ""]  # beta, what gains are more by at rest
    low: Float[Array, ""]  # w_0, speed over which that fades [rad/s]
    reach: ActuatorLimits

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> PIDRegulator:
        """Gains at each sample."""
        r = jnp.asarray(reference, dtype=float)
        k = 1 + self.boost * jnp.exp(-jnp.abs(r) / self.low)
        none = jnp.zeros_like(r)
        gains = jnp.stack([k * self.proportional, k * self.integral, none], axis=1)
        return PIDRegulator(r, none, gains, jnp.zeros(()), self.reach, dt)
