r"""Soft rods by the Geometric Variable Strain approach (Renda et al. 2020; Boyer et al. 2021).

The strain of a Cosserat rod, $g' = g\,\hat\xi$, is a sum of Legendre polynomials per strain mode,
$\xi(X) = \Phi(X)\,q + \xi^*(X)$; poses follow by the fourth-order Magnus expansion over intervals that end at the Gauss
points. Strain order: torsion, bending about y, bending about z, extension, shear along y, shear along z; the angular
coordinates are in rad (curvature times length), the linear ones are strains. A strain that a motor drives has one
coordinate instead, the angle of the shaft, and the shape of an envelope.
"""

import math
from collections.abc import Callable, Collection
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Shaped, Signal, Stations, Wave, signal_of
from nectosome.core.described import is_zero, number, numbers, vector
from nectosome.core.se3 import Exponential, bracket, exponential, matmul3
from nectosome.description import STRAIN_NAMES, Rod
from nectosome.description.signals import RecordedStrain, WaveSignal

from .rod_matter import Matter
from .soft_bodies import SoftBody


class DrivenShape(eqx.Module):
    """Shape of a driven strain: numbers at places spread evenly along the rod, joined by straight lines."""

    values: Float[Array, "n"]  # of the strain times length, per angle of the shaft [1]
    start: Float[Array, ""]  # angle of the shaft at the start [rad]

    def along(self, s: np.ndarray) -> Array:
        """Values at fractions s of the length."""
        return jnp.asarray(hats(self.values.size, s)) @ self.values

    def over(self, nodes: np.ndarray) -> Float[Array, "2 k"]:
        """Values at two collocation points in each interval between nodes, of a line with the same two moments.

        Values of the shape itself there would lose what its kinks add to the mean of an interval.
        """
        lines = [self._line(*ends) for ends in pairwise(nodes)]
        return jnp.asarray(np.stack(lines, axis=1)) @ self.values

    def _line(self, start: float, end: float) -> np.ndarray:
        """Shares [2, n] of its numbers in the values of such a line."""
        n, width = self.values.size, end - start
        inside = [at for at in np.linspace(0, 1, n)[1:-1] if start < at < end]
        s, w = gauss(2, tuple((at - start) / width for at in inside))
        mean, slope = (w * np.stack([np.ones(s.size), 12 * (s - 0.5)])) @ hats(n, start + width * s)
        return mean + np.outer([-0.5, 0.5], slope) / np.sqrt(3)


def hats(n: int, s: np.ndarray) -> np.ndarray:
    """Shares [*s, n] of values at n places spread evenly over 0 to 1, joined by straight lines."""
    if n == 1:
        return np.ones((*s.shape, 1))
    return np.stack([np.interp(s, np.linspace(0, 1, n), own) for own in np.eye(n)], axis=-1)


def values_at(driven: dict[str, DrivenShape], s: np.ndarray) -> dict[str, Array]:
    """Values of shapes at fractions s of the length."""
    return {name: shape.along(s) for name, shape in driven.items()}


def kinks(driven: dict[str, DrivenShape]) -> tuple[float, ...]:
    """Fractions of the length where shapes of driven strains have kinks."""
    places = {Fraction(k, shape.values.size - 1) for shape in driven.values() for k in range(1, shape.values.size - 1)}
    return tuple(map(float, sorted(places)))


def gauss(points: int, breaks: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Places and weights of a Gauss rule on each piece of 0 to 1 between `breaks`."""
    s, w = np.polynomial.legendre.leggauss(points)
    ends = np.array([0.0, *breaks, 1.0])
    widths = np.diff(ends)[:, None]
    return (ends[:-1, None] + widths * (0.5 * (s + 1))).ravel(), (widths * (0.5 * w)).ravel()


def driven_shapes(limb: Rod) -> dict[str, DrivenShape]:
    """Shapes of a rod's strains that motors drive; a servo starts at rest where its motion starts."""
    out = {}
    for name, strain in limb.drive.given.items():
        start = jnp.zeros(()) if strain.motion is None else signal_of(strain.motion)(jnp.zeros(()))[0]
        out[name] = DrivenShape(number(strain.ratio) * vector(strain.envelope), start)
    return out


class Grid(NamedTuple):
    """Nodes of a rod, as fractions of its length; static."""

    nodes: np.ndarray  # [n] 0, Gauss points and marks in order, 1
    weights: np.ndarray  # [n] Gauss weights that sum to 1; 0 at the ends and at marks
    widths: np.ndarray  # [n - 1] of the intervals between nodes
    collocation: np.ndarray  # [n - 1, 2] two Gauss points in each interval


def grid(points: int, marks: tuple[float, ...], steps: tuple[float, ...] = ()) -> Grid:
    """Nodes of a rod with `points` Gauss points and extra nodes at `marks`.

    Between `steps` of its material each piece has its share of the points, two at least.
    """
    ends = [*pairwise((0.0, *steps, 1.0))]
    counts = [max(2, math.ceil(points * (end - start))) for start, end in ends] if steps else [points]
    pieces = [_gauss_on(count, *piece) for count, piece in zip(counts, ends, strict=True)]
    s, w = map(np.concatenate, zip(*pieces, strict=True))
    extra = [0.0, *marks, 1.0]
    nodes = np.concatenate([s, extra])
    weights = np.concatenate([w, np.zeros(len(extra))])
    order = np.argsort(nodes, kind="stable")
    nodes, weights = nodes[order], weights[order]
    widths = np.diff(nodes)
    middle = 0.5 * (nodes[1:] + nodes[:-1])
    collocation = middle[:, None] + widths[:, None] * np.array([-0.5, 0.5]) / np.sqrt(3)
    return Grid(nodes, weights, widths, collocation)


def _gauss_on(points: int, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and weights of a Gauss rule between two places."""
    s, w = np.polynomial.legendre.leggauss(points)
    return start + (end - start) * (0.5 * (s + 1)), (end - start) * (0.5 * w)


def legendre(order: int, s: np.ndarray) -> np.ndarray:
    """Legendre polynomials P_0..P_order at fractions s of the length [..., order + 1]."""
    return np.polynomial.legendre.legvander(2 * s - 1, order)


def names_of_strains(orders: dict[str, int], driven: Collection[str]) -> tuple[str, ...]:
    """Names of the coordinates: `bending_z.0`, `bending_z.1`, ... of a free strain, `bending_z.angle` of a shaft."""
    each = {name: [f"{name}.{k}" for k in range(order + 1)] for name, order in orders.items()}
    each |= {name: [f"{name}.angle"] for name in driven}
    return tuple(own for name in STRAIN_NAMES for own in each.get(name, ()))


def basis(orders: dict[str, int], driven: dict[str, Array], s: np.ndarray) -> np.ndarray | Array:
    """Strain basis [..., 6, nq] at fractions s; columns in the order of `names_of_strains`.

    `driven` are the values of shapes of driven strains there.
    """
    blocks = []
    for row, name in enumerate(STRAIN_NAMES):
        if name in orders or name in driven:
            P = driven[name][..., None] if name in driven else legendre(orders[name], s)
            blocks.append((np.arange(6) == row)[:, None] * P[..., None, :])
    return (jnp if driven else np).concatenate(blocks, axis=-1)


class RodShape(NamedTuple):
    """A rod's shape relative to its root frame."""

    rotation: Float[Array, "n 3 3"]
    position: Float[Array, "n 3"]
    strains: Float[Array, "2 k 6"]  # strain times length at the two collocation points of each interval
    steps: Exponential  # of the Magnus vector of each interval


_MAGNUS = np.sqrt(3) / 12


class SoftRod(SoftBody):
    """A soft rod; stations at its nodes, root frame first, tip last."""

    nodes: tuple[float, ...] = eqx.field(static=True)  # fractions of the length
    marks: tuple[float, ...] = eqx.field(static=True)
    widths: Float[Array, "k"]  # of the intervals, fractions
    basis: Float[Array, "2 k 6 nq"]  # of the strain times length, at the collocation points
    rest: Float[Array, "2 k 6"]  # stress-free strain times length
    length: Float[Array, ""]  # [m]
    young: Float[Array, "*n"]  # [Pa], one or that at each node
    driven: dict[str, DrivenShape]  # strains that motors drive
    star = False

    def start(self) -> Float[Array, "nq"]:
        """Coordinates at the start: unstressed, but for shafts that start elsewhere."""
        at = {f"{name}.angle": shape.start for name, shape in self.driven.items()}
        return jnp.stack([at.get(name, jnp.zeros(())) for name in self.names])

    def shape(self, q: Float[Array, "nq"]) -> RodShape:
        r"""Poses of all nodes.

        Over an interval of width h, with the strains $\xi_1, \xi_2$ at its two collocation points,
        $\Omega = \tfrac h2 (\xi_1 + \xi_2) + \tfrac{\sqrt 3}{12} h^2 [\xi_1, \xi_2]$ and $g_{k+1} = g_k \exp\Omega$.
        """
        strains = self.rest + self.basis @ q
        h = self.widths[:, None]
        steps = exponential(0.5 * h * (strains[0] + strains[1]) + _MAGNUS * h**2 * bracket(strains[0], strains[1]))

        def forward(pose: tuple[Array, Array], step: tuple[Array, Array]):
            R, p = pose
            new = (matmul3(R, step[0]), p + jnp.sum(R * step[1], axis=-1))
            return new, new

        root = (jnp.eye(3), jnp.zeros(3))
        _, (R, p) = jax.lax.scan(forward, root, (steps.rotation, steps.position))
        return RodShape(jnp.concatenate([root[0][None], R]), jnp.concatenate([root[1][None], p]), strains, steps)

    def _step_rate(self, strains: Float[Array, "2 k 6"], rates: Float[Array, "2 k 6"]) -> Float[Array, "k 6"]:
        r"""Rate of the Magnus vectors, linear in the rates.

        $\tfrac h2 (\dot\xi_1 + \dot\xi_2) + \tfrac{\sqrt 3}{12} h^2 ([\xi_1, \dot\xi_2] - [\xi_2, \dot\xi_1])$
        """
        h = self.widths[:, None]
        turning = bracket(strains, rates[::-1])
        return 0.5 * h * (rates[0] + rates[1]) + _MAGNUS * h**2 * (turning[0] - turning[1])

    def added(self, shape: RodShape, v: Float[Array, "nq"]) -> Float[Array, "k 6"]:
        r"""Twist increment of each interval, in the frame of its first node: $T(\Omega) \dot\Omega$; linear in v."""
        return shape.steps.tangent(self._step_rate(shape.strains, self.basis @ v))

    def added_rate(self, shape: RodShape, v: Float[Array, "nq"], a: Float[Array, "nq"]) -> Float[Array, "k 6"]:
        r"""Rate of `added`, of rates v that change at a.

        $\ddot\Omega$ is the rate of the Magnus vectors at the second rates, and $\tfrac{\sqrt 3}{6} h^2 [\dot\xi_1,
        \dot\xi_2]$.
        """
        rates = self.basis @ v
        second = self._step_rate(shape.strains, self.basis @ a)
        second += 2 * _MAGNUS * self.widths[:, None] ** 2 * bracket(rates[0], rates[1])
        return shape.steps.tangent_rate(self._step_rate(shape.strains, rates), second)

    def bending(self, half_width: Float[Array, "n 2"], q: Float[Array, "nq"]) -> Float[Array, "2 n 2"]:
        r"""Bending strain relative to the rest shape at the section's edges +r_y, +r_z of each node, and its stress.

        $\epsilon = -\kappa_z r_y$ and $\kappa_y r_z$, $\sigma = E \epsilon$.
        """
        curvature = [jnp.zeros(len(self.nodes))] * 2
        for row, name in enumerate(("bending_y", "bending_z")):
            there, nodes = strain_rows(self, name), np.asarray(self.nodes)
            if there:
                driven = name in self.driven
                P = self.driven[name].along(nodes)[:, None] if driven else jnp.asarray(legendre(len(there) - 1, nodes))
                curvature[row] = P @ q[np.asarray(there)] / self.length
        strain = jnp.stack([-curvature[1] * half_width[:, 0], curvature[0] * half_width[:, 1]], axis=-1)
        return jnp.stack([strain, self.young.reshape(-1, 1) * strain])


def make_rod(
    length: Array,
    matter: Callable[[np.ndarray], Matter],
    orders: dict[str, int],
    driven: dict[str, DrivenShape],
    rest: dict[str, Array],
    points: int,
    marks: tuple[float, ...],
    bends: tuple[float, ...] = (),
    steps: tuple[float, ...] = (),
) -> tuple[SoftRod, Stations]:
    r"""A rod and its stations, from its primary quantities.

    `matter` tells what it is made of at fractions of its length. It begins to change otherwise at `bends`; its points
    are spread on either side of each of its `steps`. `rest` holds Legendre coefficients of the stress-free curvatures
    [1/m] and strains [1].
    """
    g = grid(points, marks, steps)
    n = g.nodes.size
    scale = jnp.concatenate([jnp.ones(3), jnp.ones(3) * length])
    between = {name: shape.over(g.nodes) for name, shape in driven.items()}
    collocation_basis = jnp.asarray(basis(orders, between, g.collocation.T)) * scale[:, None]
    unstrained = jnp.zeros((2, n - 1, 6)).at[..., 3].set(length)
    for row, name in enumerate(STRAIN_NAMES):
        if name in rest:
            P = jnp.asarray(legendre(rest[name].size - 1, g.collocation.T))
            unstrained = unstrained.at[..., row].add(length * (P @ rest[name]))

    at_nodes = matter(g.nodes)
    s, w = _stiffness_rule(orders, tuple(sorted({*kinks(driven), *bends})), points)
    along = matter(s)
    # strain = basis / length for the angular rows (coordinates in rad), basis for the linear ones
    per_length = jnp.concatenate([jnp.ones(3) / length, jnp.ones(3)])
    B = jnp.asarray(basis(orders, values_at(driven, s), s)) * per_length[:, None]
    weights = length * jnp.asarray(w)[:, None]
    stiffness = jnp.einsum("xri,xr,xrj->ij", B, along.stiffness(weights), B)
    damping = jnp.einsum("xri,xr,xrj->ij", B, along.damping(weights), B)

    weight = length * jnp.asarray(g.weights)
    inertia = at_nodes.inertia(weight[:, None])[..., None] * jnp.eye(6)
    rod = SoftRod(
        names=names_of_strains(orders, driven),
        nodes=tuple(g.nodes.tolist()),
        marks=marks,
        widths=jnp.asarray(g.widths),
        basis=collocation_basis,
        rest=unstrained,
        length=length,
        young=at_nodes.layers[0].young,
        stiffness=stiffness,
        damping=damping,
        driven=driven,
    )
    x = length * jnp.asarray(g.nodes)
    outline = at_nodes.outline
    return rod, Stations.along(x, weight, outline.half_width, weight * at_nodes.area, inertia, outline.round_axes)


def _stiffness_rule(orders: dict[str, int], breaks: tuple[float, ...], points: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss rule on [0, 1] exact for two basis functions times a section's r^4, tapered linearly, and a modulus."""
    return gauss(max(points, max(orders.values(), default=1) + 3), breaks)


_POINTS = 60  # of the Gauss rule along a rod
_ANGULAR = "torsion", "bending"


def prescribed_strains(limb: Rod, rod: SoftRod) -> tuple[tuple[int, ...], tuple[Signal, ...]]:
    """Which coordinates of a rod are prescribed, and their values as functions of time, by strain."""
    known = {name: getattr(limb.motion, name) for name in type(limb.motion).model_fields}
    given = {name: strain for name, strain in known.items() if strain is not None}
    rows = [strain_rows(rod, name) for name in given]
    signals = []
    for strain, own in zip(given.values(), rows, strict=True):
        scale = rod.length * (2 * np.arange(len(own)) + 1)  # coordinates of a curvature: (2 k + 1) L int P_k kappa ds
        recorded = isinstance(strain, RecordedStrain)
        signals.append(_recorded(strain, scale) if recorded else wave_of(strain, rod.length, scale))
    return sum(rows, ()), tuple(signals)


def start_of_strains(limb: Rod, rod: SoftRod) -> Float[Array, "2 nq"] | None:
    """Coordinates of a rod at the start and their rates; None where it starts free of stress and at rest."""
    if not limb.start.given:
        return None
    every = []
    for own in (limb.start, limb.start.rate):
        given = {f"{name}.{k}": x for name, row in own if name != "rate" for k, x in enumerate(row)}
        # coordinates of a curvature are those of its product with the length
        size = {name: rod.length if name.startswith(_ANGULAR) else 1.0 for name in rod.names}
        every.append(jnp.stack([number(given.get(name, 0.0)) * size[name] for name in rod.names]))
    return jnp.stack(every)


def strain_rows(rod: SoftRod, strain: str) -> tuple[int, ...]:
    """Which coordinates of a rod are those of a strain."""
    return tuple(k for k, name in enumerate(rod.names) if name.startswith(f"{strain}."))


def wave_of(described: WaveSignal, length: Array, scale: Float[Array, "n"]) -> Wave:
    """Wave by its numbers int P_k e(s) (1, cos, sin)(2 pi s L/wavelength) ds, each times `scale`."""
    share, e, project = _projection(described, scale)
    wavelength = described.wavelength
    turn = jnp.asarray(share) * (0.0 if wavelength is None else 2 * jnp.pi * length / wavelength)
    return Wave(
        **numbers(described, "amplitude", "frequency", "phase", "offset"),
        envelope=jnp.dot(project, e),
        cosine=jnp.dot(project, e * jnp.cos(turn)),
        sine=jnp.dot(project, e * jnp.sin(turn)),
        ramp=None if is_zero(described.ramp) else number(described.ramp),
    )


def _recorded(described: RecordedStrain, scale: Float[Array, "n"]) -> Shaped:
    """Recording by its numbers int P_k e(s) ds, each times `scale`."""
    _, e, project = _projection(described, scale)
    return Shaped(signal_of(described), jnp.dot(project, e))


def _projection(described: WaveSignal | RecordedStrain, scale: Float[Array, "n"]) -> tuple[np.ndarray, Array, Array]:
    """Points along a rod, the envelope there, and what gives its coefficients, times `scale`."""
    share, weight = gauss(_POINTS, ())
    knots = np.linspace(0, 1, max(len(described.envelope), 2))
    e = jnp.interp(share, knots, jnp.broadcast_to(vector(described.envelope), knots.shape))
    return share, e, scale[:, None] * jnp.asarray((legendre(scale.size - 1, share) * weight[:, None]).T)
