r"""Numbers of thin foils of a finite span, by the aspect ratio A (span squared over area)."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

_SHARES, _RATES = np.array([0.165, 0.335]), np.array([0.0455, 0.3])  # of Wagner's function (Jones 1940)
_QUICKER = 1.2  # what a finite span adds to the rates is this over A


def lift_share(aspect_ratio: Float[Array, "*n"]) -> Float[Array, "*n"]:
    r"""Lift slope over $2\pi$: $\kappa = A/(2 + \sqrt{A^2 + 4})$ (Helmbold 1942).

    It tends to 1 for long spans and to Jones' slender wing, A/4, for short ones. Of the circular wing (A = 4/pi) it
    gives a slope of 1.830; exact is 1.790 (Jordan 1971).
    """
    return aspect_ratio / (2 + jnp.sqrt(aspect_ratio**2 + 4))


def centre_of_pressure(aspect_ratio: Float[Array, "*n"]) -> Float[Array, "*n"]:
    r"""Place of the lift behind the leading edge, in chords: $x = \tfrac14\, s/(1 + s)$ with $s = 2.05\,A^{1.32}$.

    A quarter for long spans, towards the leading edge for short ones, where the water goes round the sides (R. T. Jones
    1946). Interpolation of a vortex lattice of rectangles at small angles: within 0.002 for A from 0.5 to 8.
    """
    s = 2.05 * aspect_ratio**1.32
    return 0.25 * s / (1 + s)


def suction_gain(aspect_ratio: Float[Array, ""]) -> Float[Array, ""]:
    r"""Leading-edge suction over that of an endless foil with the same lift per angle: $g = \sqrt{(1 - 2\kappa/A)/
    \kappa}$.

    So much that the drag due to lift is that of an elliptic wing, $C_L^2/(\pi A)$: 1 for long spans; of a slender wing
    half of the lift's tilt comes back, at its side edges (R. T. Jones 1946).
    """
    share = lift_share(aspect_ratio)
    return jnp.sqrt((1 - 2 * share / aspect_ratio) / share)


def lag_numbers(aspect_ratio: Float[Array, ""]) -> tuple[Float[Array, "2"], Float[Array, "2"]]:
    r"""Shares and rates of the lag of lift behind a step of the angle of attack, over its final value:

    $$ \frac{\Phi(s)}{\Phi(\infty)} = 1 - \sum_i a_i e^{-b_i s}, \quad a_i = \kappa\,(0.165, 0.335), \quad
       b_i = (0.0455, 0.3) + 1.2/A $$

    with the way s in half chords. For an infinite span that is Wagner's function (R. T. Jones 1940, NACA Report 681);
    for A = 3 and 6 it is within 0.02 of the functions that the same report gives.
    """
    return lift_share(aspect_ratio) * _SHARES, jnp.asarray(_RATES) + _QUICKER / aspect_ratio


def plate_strip_share(aspect_ratio: Float[Array, "*n"]) -> Float[Array, "*n"]:
    r"""Added mass of a rectangular plate over that of its strips $\rho \pi h^2/4$, by A = height h over length:
    $\frac{1}{\sqrt{1 + A^2}} \left(1 - 0.425 \frac{A}{1 + A^2}\right)$ (Pabst 1930)."""
    square = 1 + aspect_ratio**2
    return (1 - 0.425 * aspect_ratio / square) / jnp.sqrt(square)


def plate_added_mass_share(aspect_ratio: Float[Array, ""]) -> Float[Array, ""]:
    r"""Added mass of a rectangular plate over $\rho \pi c^2/4$ per span, of strips along its chord c: A times
    `plate_strip_share`, since the plate is the same whichever way its strips run."""
    return aspect_ratio * plate_strip_share(aspect_ratio)


def broadside_drag(aspect_ratio: Float[Array, ""]) -> Float[Array, ""]:
    """Drag coefficient of a plate across the flow: 1.11 + 0.018 A, at most 2.01 (Viterna and Corrigan 1982)."""
    return 1.11 + 0.018 * jnp.minimum(aspect_ratio, 50.0)


def form_factor(thickness: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Profile drag over the friction of both sides, by thickness over chord t: 1 + 2 t + 60 t^4 (Hoerner 1965, 6-6)."""
    return 1 + 2 * thickness + 60 * thickness**4
