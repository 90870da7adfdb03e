"""Planforms of soft plates, Ritz's functions over them, and Gauss points."""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.polynomial import Legendre, Polynomial

from .rods import gauss, hats


class Functions(NamedTuple):
    """Ritz's functions and what follows from them at n places, each [n, nq]: w and its derivatives for a unit of q."""

    w: Float[Array, "n nq"]  # [m]
    x: Float[Array, "n nq"]
    y: Float[Array, "n nq"]
    xx: Float[Array, "n nq"]  # [1/m]
    yy: Float[Array, "n nq"]
    xy: Float[Array, "n nq"]


class PlateSizes(NamedTuple):
    """Sizes of a plate: tables at places spread evenly, joined by straight lines."""

    length: Float[Array, ""]  # [m]
    width: Float[Array, "k"]  # along y, from the root to the tip [m]
    middle: Float[Array, "m"]  # y of the middle of the width, from the root to the tip [m]
    thickness: Float[Array, "r c"]  # from the root to the tip, and from the edge at -y to that at +y [m]

    def half(self, xi: np.ndarray) -> Array:
        """Half of the width at fractions xi of the length [m]."""
        return 0.5 * jnp.asarray(hats(self.width.shape[0], xi)) @ self.width

    def centre(self, xi: np.ndarray) -> Array:
        """Y of the middle of the width at fractions xi of the length [m]."""
        return jnp.asarray(hats(self.middle.shape[0], xi)) @ self.middle

    def across(self, xi: np.ndarray, eta: np.ndarray) -> Array:
        """Y at fractions xi of the length, eta of the half width (-1 to 1) [m]."""
        return self.centre(xi) + self.half(xi) * eta

    def thick(self, xi: np.ndarray, eta: np.ndarray) -> Array:
        """Thickness there [m]."""
        rows, columns = self.thickness.shape
        return jnp.einsum("nr,rc,nc->n", hats(rows, xi), self.thickness, hats(columns, 0.5 * (eta + 1)))

    @property
    def kinks(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Fractions of the length, and of the width, where its tables have kinks."""
        rows, columns = self.thickness.shape
        return _inner(self.width.shape[0], self.middle.shape[0], rows), _inner(columns)


class Ritz(NamedTuple):
    """Ritz's functions of a planform."""

    modes: tuple[int, int]  # how many along and across
    length: Float[Array, ""]  # L [m]
    origin: Float[Array, ""]  # Y_0 [m]
    scale: Float[Array, ""]  # s [m]

    def at(self, xi: np.ndarray, y: Array) -> Functions:
        """Values at fractions xi of the length and at Y [m]."""
        eta = (y - self.origin) / self.scale
        f, g = ([[p.deriv(d) for p in every] for d in range(3)] for every in self._polynomials())
        L, s = self.length, self.scale

        def times(along: int, across: int) -> Array:
            F, G = _values(f[along], xi), _values(g[across], eta)
            return (F[:, :, None] * G[:, None, :]).reshape(xi.size, -1)

        w, x, y = L * times(0, 0), times(1, 0), L / s * times(0, 1)
        return Functions(w, x, y, times(2, 0) / L, L / s**2 * times(0, 2), times(1, 1) / s)

    def shortening(self, xi: np.ndarray, y: Array) -> Float[Array, "2 n nq nq"]:
        """Integrals of w_X w_X over X, from the root on, and of w_Y w_Y over Y, from Y_0 on, for units of q [m]."""
        eta = (y - self.origin) / self.scale
        f, g = self._polynomials()
        n, nq = xi.size, len(f) * len(g)

        def of(polynomials: list[Polynomial], there: Array | np.ndarray, derived: bool) -> Array:
            pairs = [p.deriv() * r.deriv() if derived else p * r for p in polynomials for r in polynomials]
            return _values([p.integ() for p in pairs] if derived else pairs, there).reshape(n, *[len(polynomials)] * 2)

        along = self.length * jnp.einsum("nac,nbd->nabcd", of(f, xi, True), of(g, eta, False))
        across = self.length**2 / self.scale * jnp.einsum("nac,nbd->nabcd", of(f, xi, False), of(g, eta, True))
        return jnp.stack([along, across]).reshape(2, n, nq, nq)

    def _polynomials(self) -> tuple[list[Polynomial], list[Polynomial]]:
        """f_a and P_b."""
        along = [Legendre.basis(a, domain=[0, 1]).convert(kind=Polynomial) for a in range(self.modes[0])]
        across = [Legendre.basis(b).convert(kind=Polynomial) for b in range(self.modes[1])]
        return [Polynomial([0, 0, 1]) * p for p in along], across


def _values(polynomials: Sequence[Polynomial], x: Array | np.ndarray) -> Float[Array, "n k"]:
    return jnp.stack([jnp.polyval(jnp.asarray(p.coef[::-1]), jnp.asarray(x)) for p in polynomials], axis=-1)


class GaussGrid(NamedTuple):
    """Gauss points over a plate, row by row along it; static."""

    xi: np.ndarray  # [n] fractions of the length
    eta: np.ndarray  # [n] fractions of the half width, -1 to 1
    along: np.ndarray  # [n] shares of the length
    across: np.ndarray  # [n] shares of the width


def over(points: tuple[int, int], breaks: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())) -> GaussGrid:
    """Gauss points along and across, on each piece between breaks."""
    (xi, a), (s, b) = (gauss(n, own) for n, own in zip(points, breaks, strict=True))
    return GaussGrid(np.repeat(xi, s.size), np.tile(2 * s - 1, xi.size), np.repeat(a, s.size), np.tile(b, xi.size))


def _inner(*sizes: int) -> tuple[float, ...]:
    """Places inside 0 to 1 where tables with these numbers of places have kinks."""
    return tuple(sorted({float(at) for n in sizes for at in np.linspace(0, 1, max(n, 2))[1:-1]}))
