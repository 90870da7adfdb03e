r"""Dry friction that holds: of motors, of joints, and of cords over guides.

A share w of it acts, from -1 to 1, a state. With the speed v of sliding, a slip s and times T and $\tau$,

$$ \dot w = \frac{v - |v|\, w^9}{s} - \frac{w - w_0}{T}, \qquad
   F = F_c \left( w + \frac{1 - w^2}{2} \frac{y}{\sqrt{1 + y^2}} \right), \quad y = \frac{\tau v}{s} $$

(Bouc 1967; Wen 1976; with $w$ in the place of $w^9$, and without $\tau$, that of Dahl 1968). It slips with $F_c$ at any
speed, |F| is never more, and it holds what is less: by a displacement of about w s, as a spring, which the second
part damps. By the ninth power loads that go to and fro below 0.8 $F_c$ move it by less than 0.03 s each time. What it
holds fades to $w_0$ within 10,000 s, so that one equilibrium is at rest of all that friction may hold. It stores
$F_c s w^2/2$; what else it takes turns to heat.

Over a bend by the angle $\theta$ a cord that slides towards the end that pulls it has the tension $T e^{-\mu \theta}$
beyond the bend, one that slides away from it $T e^{\mu \theta}$ (the capstan equation, Euler 1769; Eytelwein 1808):
$T e^{-\mu w \theta}$ at any w. It fades to the $w_0$ of a cord that was drawn from the straight shape; so does an
equilibrium have it.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

ANGLE_SLIP = np.deg2rad(0.1)  # s [rad] of a joint, or of the drum of a slide
LENGTH_SLIP = 1e-4  # s [m] of a slide, or of a thread
_FADES = 1e4  # T [s]
_DAMPS = 0.01  # tau [s]: chosen, about critical where what is held would swing at 30 Hz
_STRAIGHT = 1e-4  # [rad] below which the bend sets in smoothly: changes a tension by less than mu times this


def share_rate(
    w: Float[Array, "*n"], v: Float[Array, "*n"], slip: Array | float, at_rest: Array | float = 0.0
) -> Float[Array, "*n"]:
    """Rate of w [1/s] at a speed v of sliding [rad/s, m/s], with `at_rest` the w_0 to which it fades."""
    return (v - jnp.abs(v) * w * (w**2) ** 4) / slip - (w - at_rest) / _FADES


def acting(w: Float[Array, "*n"], v: Float[Array, "*n"], slip: Array | float) -> Float[Array, "*n"]:
    """F over F_c, from -1 to 1."""
    y = _DAMPS * v / slip
    return w + 0.5 * (1 - w**2) * y / jnp.sqrt(1 + y**2)


class DryFriction(eqx.Module):
    """Dry friction along a coordinate; with w = 0 at rest."""

    limit: Float[Array, ""]  # F_c [N m, N]
    slip: Float[Array, ""]  # s [rad, m]

    def force(self, w: Float[Array, "*n"], v: Float[Array, "*n"]) -> Float[Array, "*n"]:
        """F, against the motion [N m, N]."""
        return self.limit * acting(w, v, self.slip)

    def rate(self, w: Float[Array, "*n"], v: Float[Array, "*n"]) -> Float[Array, "*n"]:
        """Of the state w [1/s]."""
        return share_rate(w, v, self.slip)

    def energy(self, w: Float[Array, "*n"]) -> Float[Array, "*n"]:
        """Energy stored [J]."""
        return 0.5 * self.limit * self.slip * w**2


def bend(squared: Float[Array, "*n"], length: Array | float = 1.0) -> Float[Array, "*n"]:
    """Size of an angle by its square, or of a curvature over a length [m], with a derivative of 0 at 0."""
    straight = _STRAIGHT / length
    return jnp.sqrt(squared + straight**2) - straight
