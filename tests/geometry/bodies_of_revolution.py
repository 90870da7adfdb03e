r"""Added mass of bodies of revolution by rings, for tests: an equation along the profile, without triangles.

Green's identity of `panel_added_mass` for potentials $\phi(s) \cos m\theta$, m = 0 along the axis, 1 across it and
turning. The integrals around the axis are complete elliptic ones, with $k^2 = 4 r r'/D^2$ and
$D^2 = (r + r')^2 + (x - x')^2$:

$$ \int_0^{2\pi} \frac{d\theta}{R} = \frac{4 K}{D}, \quad
   \int_0^{2\pi} \frac{\cos\theta\, d\theta}{R} = \frac{4}{D} \frac{(2 - k^2) K - 2 E}{k^2} $$
"""

import numpy as np
from jaxtyping import Float
from scipy.special import ellipe, ellipkm1

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(12)
_EVEN = 0.5 * (_POINTS + 1), 0.5 * _WEIGHTS
# of a piece that is seen from its own middle, where the integrand has a logarithm: u^3 to either side
_DENSE = (
    np.concatenate([0.5 + side * 0.5 * _EVEN[0] ** 3 for side in (-1, 1)]),
    np.tile(1.5 * _EVEN[0] ** 2 * _EVEN[1], 2),
)


def added_mass_of_revolution(
    x: Float[np.ndarray, "n+1"], r: Float[np.ndarray, "n+1"]
) -> tuple[float, float, float, float]:
    """Volume [m3], and added mass over the density along the axis, across it [m3] and turning about the origin [m5].

    Of a profile of straight pieces from aft to ahead, its ends on the axis.
    """
    dx, dr = np.diff(x), np.diff(r)
    length = np.hypot(dx, dr)
    out = np.stack([-dr, dx]) / length
    at = np.stack([x[:-1] + 0.5 * dx, r[:-1] + 0.5 * dr])
    turning = at[0] * out[1] - at[1] * out[0]
    n, found = length.size, []
    for mode, motions in ((0, [out[0]]), (1, [out[1], turning])):
        single, double = (np.zeros((n, n)) for _ in range(2))
        for share, weight in zip(*_EVEN, strict=True):
            there = x[:-1] + share * dx, r[:-1] + share * dr
            one, other = _ring(mode, at[0][:, None], at[1][:, None], *there, *out)
            single += weight * length * one
            double += weight * length * other
        own = np.zeros((2, n))
        for share, weight in zip(*_DENSE, strict=True):
            own += weight * length * np.stack(_ring(mode, *at, x[:-1] + share * dx, r[:-1] + share * dr, *out))
        np.fill_diagonal(single, own[0])
        np.fill_diagonal(double, own[1])
        V = np.stack(motions, axis=1)
        phi = np.linalg.solve(0.5 * np.eye(n) + double, single @ V)
        found += (-(2 - mode) * np.pi * (length * at[1]) @ (phi * V)).tolist()
    volume = float(np.pi * np.sum(dx * (r[:-1] ** 2 + r[:-1] * r[1:] + r[1:] ** 2)) / 3)
    along, across, about = found
    return volume, along, across, about


def _ring(mode, x, r, ring_x, ring_r, out_x, out_r):
    """Integrals around a ring of G = -1/(4 pi R) times cos(mode theta), and of its derivative along the ring's normal,
    seen from (x, r)."""
    d, s = x - ring_x, r + ring_r
    D2 = s**2 + d**2
    rest = ((r - ring_r) ** 2 + d**2) / D2  # 1 - k^2
    m = 1 - rest
    K, E = ellipkm1(rest), ellipe(m)
    dK, dE = (E - rest * K) / (2 * m * rest), (E - K) / (2 * m)
    if mode == 0:
        f, df = K, dK
    else:
        f = ((2 - m) * K - 2 * E) / m
        df = ((2 - m) * dK - K - 2 * dE - f) / m
    D = np.sqrt(D2)
    by_x = (-f * (-d) / D2 + df * m * 2 * d / D2) / D  # D2 by ring_x is -2 d, m is 4 r r'/D2
    by_r = (-f * s / D2 + df * (m / ring_r - m * 2 * s / D2)) / D
    scale = -4 * ring_r / (4 * np.pi)
    return scale * f / D, scale * (out_x * by_x + out_r * by_r)


def suboff_hull(n: int = 400) -> tuple[Float[np.ndarray, "n+1"], Float[np.ndarray, "n+1"]]:
    """Profile of the bare hull of the DARPA SUBOFF, axisymmetric, from aft to ahead [m].

    The equations of Groves, Huang and Chang (1989), Geometric characteristics of DARPA SUBOFF models, DTRC/SHD-1298-01,
    which are in feet from the bow; a hull of 4.356 m by 0.508 m.
    """
    length, bow, body, tail, most = 14.291667, 3.333333, 10.645833, 13.979167, 0.8333333
    x = 0.5 * length * (1 + np.cos(np.linspace(0, np.pi, n + 1)))
    end, k0, k1 = 0.1175, 10.0, 44.6244
    a, xi = 0.3 * x - 1.0, (tail - x) / 3.333333
    ahead = 1.126395101 * x * a**4 + 0.442874707 * x**2 * a**3 + 1 - a**4 * (1.2 * x + 1)
    aft = end**2 + end * k0 * xi**2 + (20 - 20 * end**2 - 4 * end * k0 - k1 / 3) * xi**3
    aft += (-45 + 45 * end**2 + 6 * end * k0 + k1) * xi**4 + (36 - 36 * end**2 - 4 * end * k0 - k1) * xi**5
    aft += (-10 + 10 * end**2 + end * k0 + k1 / 3) * xi**6
    cap = 1 - (3.2 * x - 44.733333) ** 2
    parts = [np.maximum(ahead, 0) ** (1 / 2.1), np.ones(n + 1), np.sqrt(np.maximum(aft, 0))]
    r = np.select([x < bow, x < body, x < tail], parts, end * np.sqrt(np.maximum(cap, 0)))
    r[[0, -1]] = 0.0
    return 0.3048 * (length - x), 0.3048 * most * r


def remus_hull(n: int = 400) -> tuple[Float[np.ndarray, "n+1"], Float[np.ndarray, "n+1"]]:
    """Profile of the bare hull of the REMUS 100, from aft to ahead, with its flat ends [m].

    The shape of Myring (1976) with the numbers of Prestero (2001), table 2.1.
    """
    a, off, b, c, cut, d, angle = 0.191, 0.0165, 0.654, 0.541, 0.0368, 0.191, 0.436
    length, tail = a + b + c - off - cut, a + b - off
    x = 0.5 * length * (1 + np.cos(np.linspace(0, np.pi, n - 1)))
    ahead = 0.5 * d * np.sqrt(np.maximum(1 - ((x + off - a) / a) ** 2, 0))
    s = x - tail
    aft = 0.5 * d - (1.5 * d / c**2 - np.tan(angle) / c) * s**2 + (d / c**3 - np.tan(angle) / c**2) * s**3
    r = np.select([x < a - off, x < tail], [ahead, 0.5 * d + 0 * x], aft)
    return length - np.concatenate([[length], x, [0.0]]), np.concatenate([[0.0], r, [0.0]])
