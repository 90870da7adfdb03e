r"""The table of F. Berio and others, and the curvatures that a rod is made to take by a midline of its numbers.

Berio, Morerod, Di Santo, "Speed-dependent locomotor patterns during steady swimming in a demersal shark", repository
scanicula_steady_swimming (MIT, `midline_kinematics.LICENSE`, which ships beside this file with the table): 51 swims of
five small-spotted catsharks.

With the arc length s in body lengths, from side to side A(s), and the wavelength $\lambda$, a midline is

$$ y = \tfrac12 A(s) \sin(2\pi(f t - s/\lambda)), \quad \kappa = y'' $$

to first order in the slope. The rod's recoil adds a motion as of a rigid body, so that amplitudes are aimed at and come
out of the swim.
"""

from importlib.resources import files
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Complex, Float

from nectosome.core import Wave
from nectosome.mechanism.rods import legendre

VISCOSITY = 1e-6  # of the water [m2/s]: what the table's Reynolds numbers U L/nu say
POINTS = 0.79  # wavelength [L] by the points of three swims, see `wavelengths`
_GAUSS = 60  # points of the rule


class SwimTable(NamedTuple):
    """Swims, one a row; L is the total length."""

    specimen: np.ndarray
    speed_class: Float[np.ndarray, "n"]  # of the flume [L/s]
    length: Float[np.ndarray, "n"]  # [m]
    frequency: Float[np.ndarray, "n"]  # of the tail [Hz]
    head: Float[np.ndarray, "n"]  # excursion from side to side [L]
    tail: Float[np.ndarray, "n"]  # [L]; St = f A L/U holds with it
    wavelength: Float[np.ndarray, "n"]  # as printed, without a unit; its wave speed is f times it
    speed: Float[np.ndarray, "n"]  # [L/s]
    strouhal: Float[np.ndarray, "n"]


def table(only: str | None = None) -> SwimTable:
    """All swims, or those of one specimen."""
    text = files("nectosome_studies").joinpath("catshark", "midline_kinematics.txt").read_text(encoding="utf-8")
    rows = np.genfromtxt(text.splitlines(), delimiter=",", names=True, dtype=None, encoding="utf-8")
    rows = rows if only is None else rows[rows["specimen"] == only]
    length = rows["TL"] / 100
    return SwimTable(
        rows["specimen"],
        rows["speedBL"].astype(float),
        length,
        rows["TBF"],
        rows["headAmplitude"],
        rows["tailAmplitude"],
        rows["wavelength"],
        rows["U"] / length,
        rows["St"],
    )


def wavelengths(swims: SwimTable) -> dict[str, Float[np.ndarray, "n"]]:
    """Wavelengths of all swims [L], by ways to read them.

    - points: one length for all, by hand from the positions that the repository gives of points on the body: the lag
      from points at 0.35 and 0.45 L to the tip of the tail, by a harmonic at the printed frequency and a straight
      drift. Catshark 11 at 1 L/s gives 0.91, catshark 7 at 2 L/s 0.71, catshark 10 at 4 L/s 0.83 L; with a quadratic
      drift 0.84, 0.70 and 0.76: 0.79 on the mean. None of them are the printed 0.40, 0.57, 0.60, nor twice as much.
    - full: as printed, in body lengths.
    - half: printed were half waves, from one turning point to the next.
    - metres: as printed, in metres.
    """
    return {
        "points": np.full(swims.frequency.shape, POINTS),
        "full": swims.wavelength,
        "half": 2 * swims.wavelength,
        "metres": swims.wavelength / swims.length,
    }


def curvature(
    s: Float[np.ndarray, "k"],
    head: Float[np.ndarray, "n 1"],
    tail: Float[np.ndarray, "n 1"],
    wavelength: Float[np.ndarray, "n 1"],
    power: int = 2,
) -> Complex[np.ndarray, "n k"]:
    r"""Curvature times L, c in $Im(c e^{i\omega t})$, of $A = head + (tail - head) s^{power}$; powers 1 and 2.

    Amplitudes along fish are of second degree (Goerig et al. 2021); that A has no slope at the head is assumed.
    """
    k, more = 2 * np.pi / wavelength, tail - head
    first, second = (power * s ** (power - 1), power * (power - 1) * np.ones_like(s))
    A, dA, ddA = head + more * s**power, more * first, more * second
    return 0.5 * (ddA - 2j * k * dA - k**2 * A) * np.exp(-1j * k * s)


def waves(
    order: int,
    frequency: Float[np.ndarray, "n"],
    head: Float[np.ndarray, "n"],
    tail: Float[np.ndarray, "n"],
    wavelength: Float[np.ndarray, "n"],
    power: int = 2,
) -> list[Wave]:
    """Strain coordinates of bending up to an order, by swim: (2 k + 1) int P_k L kappa ds, s from 0 to 1."""
    x, weight = np.polynomial.legendre.leggauss(_GAUSS)
    s = 0.5 * (x + 1)
    basis = (2 * np.arange(order + 1) + 1) * legendre(order, s) * (0.5 * weight)[:, None]
    c = curvature(s, head[:, None], tail[:, None], wavelength[:, None], power) @ basis
    none = jnp.zeros(())
    return [
        Wave(
            amplitude=none + 1.0,
            frequency=jnp.asarray(f),
            phase=none,
            offset=none,
            envelope=jnp.zeros(order + 1),
            cosine=jnp.asarray(one.real),
            sine=jnp.asarray(-one.imag),
        )
        for f, one in zip(frequency, c, strict=True)
    ]
