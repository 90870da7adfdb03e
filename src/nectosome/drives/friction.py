"""Dry friction with presliding displacement."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Line, RateIndependent


class Dahl(RateIndependent):
    r"""Friction over a displacement (Dahl 1968): $dF/dx = \sigma\,(1 - \mathrm{sgn}(dx)\, F/F_c)$.

    F is the force that keeps up the motion, with the sign of the displacement. Exact for linear inputs, along which
    $F \to s F_c + (F - s F_c)\, e^{-\sigma |\Delta x|/F_c}$ with the sign s of $\Delta x$. It starts at 0 with F = 0.
    """

    limit: Float[Array, ""]  # F_c, sliding force [N]
    stiffness: Float[Array, ""]  # sigma, at the start of motion [N/m]

    def initial(self) -> Float[Array, "2"]:
        """Displacement and force."""
        return jnp.zeros(2)

    def step(self, state: Float[Array, "2"], u: Line) -> tuple[Float[Array, "2"], Line]:
        """Forces at both ends of a line."""
        begin = self._after(state, u.begin)
        end = self._after(begin, u.end)
        return end, Line(begin[1], end[1])

    def _after(self, state: Float[Array, "2"], x: Float[Array, ""]) -> Float[Array, "2"]:
        change = x - state[0]
        sliding = jnp.sign(change) * self.limit
        return jnp.stack([x, sliding + (state[1] - sliding) * jnp.exp(-self.stiffness * jnp.abs(change) / self.limit)])
