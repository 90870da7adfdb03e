"""Muscles along rods: a moment in every section, which goes along the rod as a wave."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import RodLoad, Wave


class Muscle(RodLoad):
    r"""An active internal moment m(x, t) [N m] about one axis of the sections: $\int \Phi^T m\,dx$ with the basis Phi.

    A positive moment makes the strain larger. `rows` are that strain's coordinates, of `count` in all.
    """

    rows: tuple[int, ...] = eqx.field(static=True)
    count: int = eqx.field(static=True)
    moment: Wave  # by coordinates

    def force(self, t: Float[Array, ""], q: Float[Array, "nq"], v: Float[Array, "nq"]) -> Float[Array, "nq"]:
        """Generalised force, whatever the shape is."""
        return jnp.zeros(self.count).at[jnp.array(self.rows)].set(self.moment(t)[0])
