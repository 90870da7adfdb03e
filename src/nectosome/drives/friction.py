"""Dry friction over a displacement, and an oscillator whose spring has hysteresis."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Pointwise

from .rate_block import Driven


class Dahl(Pointwise):
    r"""Friction over a displacement (Dahl 1968): $dF/dx = \sigma\,(1 - \mathrm{sgn}(dx)\, F/F_c)$.

    F is the force that keeps up the motion, with the sign of the displacement. Exact for linear inputs, along which
    $F \to s F_c + (F - s F_c)\, e^{-\sigma |\Delta x|/F_c}$ with the sign s of $\Delta x$. It starts at 0 with F = 0.
    """

    limit: Float[Array, ""]  # F_c, sliding force [N]
    stiffness: Float[Array, ""]  # sigma, at the start of motion [N/m]

    def initial(self) -> Float[Array, "2"]:
        """Displacement and force."""
        return jnp.zeros(2)

    def at(self, state: Float[Array, "2"], u: Float[Array, ""]) -> tuple[Float[Array, "2"], Float[Array, ""]]:
        """Displacement and force, and the force."""
        change = u - state[0]
        sliding = jnp.sign(change) * self.limit
        force = sliding + (state[1] - sliding) * jnp.exp(-self.stiffness * jnp.abs(change) / self.limit)
        return jnp.stack([u, force]), force


class BoucWen(Driven):
    r"""A mass on a damper and a spring with hysteresis, driven by a force u [N] (Bouc 1967; Wen 1976).

    $$ m \ddot x + c \dot x + \alpha k x + (1 - \alpha) k z = u, \quad
       \dot z = \dot x - (\beta |\dot x| |z|^{n-1} z + \gamma \dot x |z|^n) $$

    with the displacement x [m] as output. It starts at rest.
    """

    mass: Float[Array, ""]  # m [kg]
    damping: Float[Array, ""]  # c [N s/m]
    stiffness: Float[Array, ""]  # k [N/m]
    elastic: Float[Array, ""]  # alpha: elastic fraction of the spring
    beta: Float[Array, ""]  # [1/m^n]
    gamma: Float[Array, ""]  # [1/m^n]
    power: Float[Array, ""]  # n, at least 1

    def initial(self) -> Float[Array, "3"]:
        """Displacement, velocity and z."""
        return jnp.zeros(3)

    def rates(self, t: Float[Array, ""], x: Float[Array, "3"], u: Any = None) -> Float[Array, "3"]:
        """Rates of the three."""
        place, speed, z = x
        size = jnp.abs(z)
        size = jnp.where(size > 0, jnp.where(size > 0, size, 1.0) ** self.power, 0.0)
        spring = self.stiffness * (self.elastic * place + (1 - self.elastic) * z)
        yielding = size * (self.beta * jnp.abs(speed) * jnp.sign(z) + self.gamma * speed)
        return jnp.stack([speed, (u - self.damping * speed - spring) / self.mass, speed - yielding])

    def output(self, x: Float[Array, "3"], u: Float[Array, ""]) -> Float[Array, ""]:
        """The displacement."""
        return x[0]
