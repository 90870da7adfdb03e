"""Muscles along rods: an internal moment that travels along the rod as a wave."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import RodLoad, Wave
from nectosome.description.rod_loads import MuscleLoad
from nectosome.mechanism.prescribed import strain_rows, wave_of

from .places import Carrier


class Muscle(RodLoad):
    r"""An active internal moment m(x, t) [N m] about one axis of the sections: $\int \Phi^T m\,dx$ with the basis Phi.

    A positive moment increases the strain. `rows` are the indices of its coordinates, of `count` in total.
    """

    rows: tuple[int, ...] = eqx.field(static=True)
    count: int = eqx.field(static=True)
    moment: Wave  # by coordinates
    described_by = MuscleLoad

    @classmethod
    def from_description(cls, described: MuscleLoad, part: Carrier) -> "Muscle":
        r"""In a rod: the generalised force is $\int P_k / L\, m\, dx$."""
        rows = strain_rows(part.rod, described.strain)
        return cls(rows, part.rod.nq, wave_of(described.moment, part.rod.length, jnp.ones(len(rows))))

    def force(self, t: Float[Array, ""], q: Float[Array, "nq"], v: Float[Array, "nq"]) -> Float[Array, "nq"]:
        """Generalised force, independent of the shape."""
        return jnp.zeros(self.count).at[jnp.array(self.rows)].set(self.moment(t)[0])
