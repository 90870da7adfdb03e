r"""Soft plates by Ritz's method: a thin sheet, clamped along its root, that bends in both directions.

The plate lies in the plane z = 0 of its root frame, x from its root edge to its tip, y across. Its middle surface moves
out of the plane by

$$ w(X, Y) = L \sum_{ab} q_{ab}\, f_a(X/L)\, P_b\big((Y - Y_0)/s\big), \quad f_a(\xi) = \xi^2 P_a(2\xi - 1) $$

with Legendre polynomials P, so that $w = w_X = 0$ at the root, and $q_{a0}$ [rad] is a deflection of the tip over the
length L. It is not stretched along x and y: to second order its points come nearer to the root and to the middle by

$$ u = -\tfrac12 \int_0^X w_X^2\, dX, \quad v = -\tfrac12 \int_{Y_0}^Y w_Y^2\, dY $$

(foreshortening, as in Banerjee and Kane 1989). What the middle surface would be sheared and stretched by where it bends
in both directions at once (von Karman) is left out. The energy is Kirchhoff's,

$$ \tfrac12 \iint D \left( w_{XX}^2 + w_{YY}^2 + 2 \nu w_{XX} w_{YY} + 2 (1 - \nu) w_{XY}^2 \right) dX dY, \quad
D = \frac{E h^3}{12 (1 - \nu^2)} $$

with the thickness h at each place (Leissa 1969, appendix).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core.se3 import cross, matmul3

from .soft_bodies import SoftBody


class BentPlate(NamedTuple):
    """A plate's shape relative to its root frame."""

    rotation: Float[Array, "n 3 3"]
    position: Float[Array, "n 3"]
    q: Float[Array, "nq"]


class RitzPlate(SoftBody):
    """A soft plate; stations are its root frame, places on it, and the middle of its tip edge."""

    place: Float[Array, "k 2"]  # X, Y of all stations but the root [m]
    lift: Float[Array, "k nq"]  # w there for a unit of q [m]
    slope: Float[Array, "2 k nq"]  # w_X and w_Y
    shortening: Float[Array, "2 k nq nq"]  # S of u and v = -q S q/2 [m]
    curvature: Float[Array, "2 k nq"]  # w_XX and w_YY [1/m]
    young: Float[Array, ""]  # [Pa]
    poisson: Float[Array, ""]
    star = True

    def shape(self, q: Float[Array, "nq"]) -> BentPlate:
        """Poses of all stations."""
        R, p = self._poses(q)
        return BentPlate(jnp.concatenate([jnp.eye(3)[None], R]), jnp.concatenate([jnp.zeros((1, 3)), p]), q)

    def added(self, shape: BentPlate, v: Float[Array, "nq"]) -> Float[Array, "k 6"]:
        """Twist of each station against the root, in the root frame and about its origin; linear in v."""
        return self._increment(shape.q, v)

    def added_rate(self, shape: BentPlate, v: Float[Array, "nq"], a: Float[Array, "nq"]) -> Float[Array, "k 6"]:
        """Rate of `added`, of rates v that change at a."""
        return jax.jvp(self._increment, (shape.q, v), (v, a))[1]

    def bending(self, half_width: Float[Array, "n 2"], q: Float[Array, "nq"]) -> Float[Array, "2 n 2"]:
        r"""Strains along y and along x at the face +z, and their stresses.

        $\epsilon = -\tfrac h2 (w_{YY}, w_{XX})$, $\sigma_x = E (\epsilon_x + \nu \epsilon_y)/(1 - \nu^2)$.
        """
        curved = jnp.concatenate([jnp.zeros((1, 2)), (self.curvature[::-1] @ q).T])
        strain = -half_width[:, 1:] * curved
        return jnp.stack([strain, self.young * (strain + self.poisson * strain[:, ::-1]) / (1 - self.poisson**2)])

    def _poses(self, q: Float[Array, "nq"]) -> tuple[Float[Array, "k 3 3"], Float[Array, "k 3"]]:
        """Of all stations but the root: x along the bent plate, z across it."""
        sx, sy = self.slope @ q
        shorter = -0.5 * jnp.einsum("i,dkij,j->kd", q, self.shortening, q)
        p = jnp.concatenate([self.place + shorter, (self.lift @ q)[:, None]], axis=1)
        ax, ay, none = 1 - 0.5 * sx**2, 1 - 0.5 * sy**2, jnp.zeros_like(sx)
        x = _unit(jnp.stack([ax, none, sx], axis=-1))
        z = _unit(jnp.stack([-ay * sx, -ax * sy, ax * ay], axis=-1))
        return jnp.stack([x, cross(z, x), z], axis=-1), p

    def _increment(self, q: Float[Array, "nq"], v: Float[Array, "nq"]) -> Float[Array, "k 6"]:
        (R, p), (turning, moving) = jax.jvp(self._poses, (q,), (v,))
        spin = matmul3(turning, jnp.swapaxes(R, -1, -2))
        w = jnp.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
        return jnp.concatenate([w, moving - cross(w, p)], axis=-1)


def _unit(x: Float[Array, "k 3"]) -> Float[Array, "k 3"]:
    return x / jnp.sqrt(jnp.sum(x * x, axis=-1, keepdims=True))
