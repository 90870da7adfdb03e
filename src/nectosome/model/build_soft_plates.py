"""From a description to a soft plate: its stiffness, its stations and the water of its sections."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Stations
from nectosome.core.described import number, vector
from nectosome.description import SoftPlate
from nectosome.loads.places import SheetCarrier
from nectosome.mechanism.ritz_functions import Functions, GaussGrid, PlateSizes, Ritz, over
from nectosome.mechanism.ritz_plates import RitzPlate
from nectosome.mechanism.webs import sheet_reach

_ROUND = 12  # Gauss points across for the water of a section


def soft_plate(described: SoftPlate) -> tuple[RitzPlate, SheetCarrier]:
    r"""A plate as built, and as its loads see it.

    Stations with mass are Gauss points over the plate, row by row. For each row follow two stations without mass, which
    carry the water of its section, and then the middle of the tip edge. Kelvin-Voigt damping has three times the
    viscosity in the place of E, as bending of a rod has.
    """
    thickness = jnp.stack([vector(row) for row in described.thickness])
    plan = PlateSizes(number(described.length), vector(described.width), vector(described.middle), thickness)
    nu, modes, points = number(described.poisson), described.modes, described.points
    length, rule = plan.length, over((sum(modes) + 3, modes[1] + 3), plan.kinks)
    share = jnp.asarray(rule.along * rule.across) * plan.half(rule.xi)
    ritz = Ritz(modes, length, jnp.sum(share * plan.centre(rule.xi)) / jnp.sum(share), jnp.sum(share))
    bent = ritz.at(rule.xi, plan.across(rule.xi, rule.eta))
    rigidity = 2 * length * share * plan.thick(rule.xi, rule.eta) ** 3 / (12 * (1 - nu**2))
    both, twist = bent.xx + bent.yy, bent.xy
    unlike = jnp.einsum("n,ni,nj->ij", rigidity, bent.xx, bent.yy)
    energy = jnp.einsum("n,ni,nj->ij", rigidity, both, both) + (1 - nu) * (
        2 * jnp.einsum("n,ni,nj->ij", rigidity, twist, twist) - unlike - unlike.T
    )

    grid, rows = over(points), slice(None, None, points[1])
    sections = _sections(plan, ritz, grid.xi[rows], grid.along[rows], described.root == "closed")
    tip, y = np.ones(1), plan.across(grid.xi, grid.eta)
    places = [(grid.xi, y), (sections.xi, sections.y), (tip, plan.centre(tip))]
    here, at_tip = ritz.at(*places[0]), ritz.at(*places[2])

    def every(name: str) -> Array:
        return jnp.concatenate([getattr(one, name) for one in (here, sections.functions, at_tip)])

    body = RitzPlate(
        names=tuple(f"deflection.{a}_{b}" for a in range(modes[0]) for b in range(modes[1])),
        stiffness=number(described.young) * energy,
        damping=3 * number(described.damping) * energy,
        place=jnp.concatenate([jnp.stack([length * jnp.asarray(xi), y], axis=-1) for xi, y in places]),
        lift=every("w"),
        slope=jnp.stack([every("x"), every("y")]),
        shortening=jnp.concatenate([ritz.shortening(*place) for place in places], axis=1),
        curvature=jnp.stack([every("xx"), every("yy")]),
        young=number(described.young),
        poisson=nu,
    )
    return body, _carrier(plan, grid, points, sections, number(described.density))


class _WetSections(NamedTuple):
    """Stations that carry the water of sections, two at each, and all first ones before the second ones."""

    xi: np.ndarray  # [n] fractions of the length
    y: Float[Array, "n"]  # [m]
    functions: Functions
    carried: Float[Array, "n"]  # [m3]
    turned: Float[Array, "n"]  # [m5]


def _sections(plan: PlateSizes, ritz: Ritz, xi: np.ndarray, along: np.ndarray, closed: bool) -> _WetSections:
    r"""Water of the sections across a plate, as each moves, turns and bends.

    In potential flow about a strip of half width b, which moves across itself at
    $w(\eta) = \sum_n c_n U_{n-1}(\eta)$, with Chebyshev polynomials of the second kind, the energy per length is
    $\tfrac12 \rho \pi b^2 \sum_n c_n^2 / n$: Glauert's series of the thin foil. Here the terms up to n = 3 are kept.
    The ends of the plate reduce each one as `sheet_reach` does, with b/n in the place of b: $A_n \approx \pi b^2/n$.
    Both stations of a section move at $c_1 \pm c_3 \sqrt{A_3/A_1}$, turn at $2 c_2/b$ and carry $A_1/2$ and
    $A_2 b^2/8$, which has this energy also where the root moves.
    """
    angle = np.pi * np.arange(1, _ROUND + 1) / (_ROUND + 1)
    eta, weight = np.cos(angle), np.pi / (_ROUND + 1) * np.sin(angle) ** 2
    n, b, length = xi.size, plan.half(xi), plan.length
    to_ends = length * jnp.asarray(np.sqrt((1 - xi) * ((1 + xi) if closed else xi)))
    to_ends = jnp.repeat(to_ends[:, None], _ROUND, axis=1)
    volume = []
    for k in (1, 2, 3):
        reach = sheet_reach(to_ends, b[:, None] / k * np.sin(angle))
        volume.append(2 * b * length * along * (reach / np.sin(angle) @ weight))
    first, second, third = volume

    there = np.repeat(xi, _ROUND)
    found = ritz.at(there, plan.across(there, np.tile(eta, n)))
    chebyshev = 2 / np.pi * weight * np.stack([np.ones(_ROUND), 2 * eta, 4 * eta**2 - 1])
    w, x = (jnp.einsum("ce,nei->cni", chebyshev, values.reshape(n, _ROUND, -1)) for values in found[:2])
    bowed, none = jnp.sqrt(third / first)[:, None] * w[2], jnp.zeros_like(w[0])
    twice = [jnp.concatenate([values] * 2) for values in (x[0], 2 * w[1] / b[:, None], none, none, none)]
    functions = Functions(jnp.concatenate([w[0] + bowed, w[0] - bowed]), *twice)
    volumes = (jnp.concatenate([values] * 2) for values in (0.5 * first, second * b**2 / 8))
    return _WetSections(np.tile(xi, 2), jnp.tile(plan.centre(xi), 2), functions, *volumes)


def _carrier(
    plan: PlateSizes, grid: GaussGrid, points: tuple[int, int], sections: _WetSections, density: Array
) -> SheetCarrier:
    """A plate as loads see it: its stations, the root first, and their water."""
    length, n, m = plan.length, grid.xi.size, sections.xi.size
    thick, wide = plan.thick(grid.xi, grid.eta), plan.half(grid.xi) * grid.across
    weight, volume = length * jnp.asarray(grid.along), 2 * length * grid.along * wide * thick
    frames = [np.zeros(1), sections.xi, np.ones(1)]  # without mass
    halves = [jnp.stack([plan.half(xi), 0.5 * plan.thick(xi, np.zeros(xi.size))], axis=-1) for xi in frames]
    half = jnp.concatenate([halves[0], jnp.stack([wide, 0.5 * thick], axis=-1), *halves[1:]])
    every = np.concatenate([frames[0], grid.xi, *frames[1:]])

    def on_grid(values: Array) -> Array:
        return jnp.concatenate([jnp.zeros(1), values, jnp.zeros(m + 1)])

    def on_sections(values: Array) -> Array:
        return jnp.concatenate([jnp.zeros(n + 1), values, jnp.zeros(1)])

    flat = thick**2 / 12
    inertia = volume[:, None] * jnp.stack([flat, flat, *[jnp.zeros(n)], *[jnp.ones(n)] * 3], axis=-1)
    inertia = density * jnp.concatenate([jnp.zeros((1, 6)), inertia, jnp.zeros((m + 1, 6))])[..., None] * jnp.eye(6)
    stations = Stations.along(length * jnp.asarray(every), on_grid(weight), half, on_grid(volume), inertia, 0.0)
    rows = (points[0], *np.repeat(np.arange(points[0]), points[1]).tolist(), *[points[0]] * (m + 1))
    height = jnp.minimum(length, 2 * plan.half(every))
    return SheetCarrier(stations, on_sections(sections.carried), on_sections(sections.turned), height, rows)
