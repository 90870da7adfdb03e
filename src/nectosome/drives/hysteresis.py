"""Hysteresis: Prandtl-Ishlinskii (a sum of play operators), its inverses, dry friction (Dahl), Bouc and Wen."""

from abc import abstractmethod
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Line, Pointwise, RateIndependent
from nectosome.units import InputError

from .rate_block import Driven


class Envelope(eqx.Module):
    """An increasing function: the envelope of hysteresis loops."""

    @abstractmethod
    def __call__(self, u: Array) -> Array:
        """Value at u."""


class Tanh(Envelope):
    """scale tanh(steepness u + shift) + offset (Al Janaideh et al. 2011)."""

    scale: Float[Array, ""]
    steepness: Float[Array, ""]
    shift: Float[Array, ""]
    offset: Float[Array, ""]

    def __call__(self, u: Array) -> Array:
        """Value at u."""
        return self.scale * jnp.tanh(self.steepness * u + self.shift) + self.offset


class Polynomial(Envelope):
    """sum_k coefficients[k] u^k; it must increase over the range of the input."""

    coefficients: Float[Array, "k"]

    def __call__(self, u: Array) -> Array:
        """Value at u."""
        return jnp.polyval(self.coefficients[::-1], u)


class PrandtlIshlinskii(Pointwise):
    r"""A direct part and play operators of increasing width (Prandtl 1928; Krejci and Kuhnen 2001).

    $$ y = c_0\,\gamma(u) + \sum_i c_i H_i, \quad
       H_i \leftarrow \max(\gamma_+(u) - r_i, \min(\gamma_-(u) + r_i, H_i)) $$

    with H = 0 at the start. Without envelopes $\gamma_\pm(u) = u$; one envelope for both branches bends the loops; with
    two (generalised play), the rising branch follows $\gamma_+$ and the falling one $\gamma_- \ge \gamma_+$, which
    gives asymmetric loops, and $\gamma$ is their mean. The direct part is a play of zero width, which is
    differentiable.
    """

    direct: Float[Array, ""]  # c_0, output per input
    thresholds: Float[Array, "n"]  # r, positive and increasing
    weights: Float[Array, "n"]  # c
    rising: Envelope | None = None
    falling: Envelope | None = None  # None: as `rising`

    def initial(self) -> Float[Array, "n"]:
        """Plays at rest."""
        return jnp.zeros_like(self.thresholds)

    def at(self, state: Float[Array, "n"], u: Float[Array, ""]) -> tuple[Float[Array, "n"], Float[Array, ""]]:
        """Plays, and their sum with the direct part."""
        up = u if self.rising is None else self.rising(u)
        down = up if self.falling is None else self.falling(u)
        plays = jnp.maximum(up - self.thresholds, jnp.minimum(down + self.thresholds, state))
        return plays, self.direct * 0.5 * (up + down) + jnp.sum(self.weights * plays)

    def slopes(self) -> Float[Array, "n+1"]:
        """Slopes dy/du after a reversal: of the direct part, then with one more moving play each."""
        return self.direct + jnp.concatenate([jnp.zeros(1), jnp.cumsum(self.weights)])


def inverse(hysteresis: PrandtlIshlinskii) -> PrandtlIshlinskii:
    r"""The inverse operator, again of Prandtl-Ishlinskii type (Krejci and Kuhnen 2001).

    With the slopes $S_j = \sum_{i \le j} c_i$: $r'_j = \sum_{i<j} c_i (r_j - r_i)$, $c'_0 = 1/S_0$,
    $c'_j = -c_j/(S_j S_{j-1})$. It exists if all slopes are positive.

    Raises InputError for a slope that is not positive, and for envelopes (`NumericInverse` accepts these).
    """
    if hysteresis.rising is not None or hysteresis.falling is not None:
        raise InputError("hysteresis with envelopes has no inverse in closed form. Take the numeric one.")
    slopes = hysteresis.slopes()
    for k in np.flatnonzero(~(np.asarray(slopes) > 0)):
        what = "the direct part" if k == 0 else f"the sum of the direct part and the first {k} weights"
        raise InputError(f"the hysteresis has no inverse: {what} is {float(slopes[k]):g}; it must be more than 0.")
    r = jnp.concatenate([jnp.zeros(1), hysteresis.thresholds])
    widths = jnp.cumsum(slopes[:-1] * jnp.diff(r))
    return PrandtlIshlinskii(1 / slopes[0], widths, -hysteresis.weights / (slopes[1:] * slopes[:-1]))


class NumericInverse(Pointwise):
    """Numerical inverse of an increasing, rate-independent block, by bisection of a range.

    An output out of range gives the end of the range.
    """

    forward: RateIndependent
    low: Float[Array, ""]  # range of the input
    high: Float[Array, ""]
    halvings: int = eqx.field(static=True, default=60)

    def initial(self) -> Array:
        """Initial state of the operator."""
        return self.forward.initial()

    def at(self, state: Array, u: Array) -> tuple[Array, Array]:
        """State of the operator after the input that gives u, and that input."""

        def output(x: Array) -> Array:
            return self.forward.step(state, Line(x, x))[1].end

        def halve(_: int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
            middle = 0.5 * (ends[0] + ends[1])
            small = output(middle) < u
            return jnp.where(small, middle, ends[0]), jnp.where(small, ends[1], middle)

        low, high = lax.fori_loop(0, self.halvings, halve, (self.low + 0.0, self.high + 0.0))
        middle = lax.stop_gradient(0.5 * (low + high))
        y, slope = jax.jvp(output, (middle,), (jnp.ones_like(middle),))
        slope = lax.stop_gradient(slope)  # one Newton step, so that the result is differentiable
        place = jnp.clip(middle - jnp.where(slope > 0, (y - u) / slope, 0.0), self.low, self.high)
        return self.forward.step(state, Line(place, place))[0], place


def evenly(
    weights: Float[ArrayLike, "n"], largest: Float[ArrayLike, ""], direct: Float[ArrayLike, ""]
) -> PrandtlIshlinskii:
    """Prandtl-Ishlinskii operator with thresholds in equal steps: r_i = i/n largest, i = 1 .. n.

    The last play does not move for inputs up to `largest`, so its weight then has no effect.
    """
    weights = jnp.asarray(weights, dtype=float)
    n = weights.shape[0]
    return PrandtlIshlinskii(jnp.asarray(direct, dtype=float), jnp.arange(1, n + 1) / n * jnp.asarray(largest), weights)


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
