"""Friction between surfaces that cling before they slide."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Line, RateIndependent


class Dahl(RateIndependent):
    r"""Friction over a displacement (Dahl 1968): $dF/dx = \sigma\,(1 - \mathrm{sgn}(dx)\, F/F_c)$.

    It opposes the motion as a pull does that keeps it up: F has the sign of the way gone. Exact for lines, along which
    $F \to s F_c + (F - s F_c)\, e^{-\sigma |\Delta x|/F_c}$ with the sign s of the way. Rests at 0 with F = 0 at first.
    """

    limit: Float[Array, ""]  # F_c, force of sliding [N]
    stiffness: Float[Array, ""]  # sigma, where it begins to move [N/m]

    def initial(self) -> Float[Array, "2"]:
        """Displacement and force."""
        return jnp.zeros(2)

    def step(self, state: Float[Array, "2"], u: Line) -> tuple[Float[Array, "2"], Line]:
        """Forces at both ends of a line."""
        begin = self._after(state, u.begin)
        end = self._after(begin, u.end)
        return end, Line(begin[1], end[1])

    def _after(self, state: Float[Array, "2"], x: Float[Array, ""]) -> Float[Array, "2"]:
        way = x - state[0]
        sliding = jnp.sign(way) * self.limit
        return jnp.stack([x, sliding + (state[1] - sliding) * jnp.exp(-self.stiffness * jnp.abs(way) / self.limit)])
