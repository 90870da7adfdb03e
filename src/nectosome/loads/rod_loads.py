r"""What acts inside rods: threads (tendons and fluid chambers), muscles, and material that relaxes.

A thread is at $d(x) = (0, y, z)$ in the sections of a rod. Its direction and stretch are those of
$u = \gamma + \kappa \times d + d'$, with the curvatures $\kappa$ [rad/m] and linear strains $\gamma$ (1 along the rod
at rest). A tension T gives the internal wrench $T (d \times \hat u, \hat u)$ in each section (Renda et al. 2020,
"A geometric variable-strain approach for static modeling of soft manipulators with tendon and fluidic actuation",
eq. 24); its power is $-T \dot\ell$ with the thread's length $\ell = \int |u| dx$.

A tendon with friction has the tension $T e^{-\mu \theta}$ (`nectosome.core.dry_friction`), where it has turned since it
began by $\theta(x) = \int s |\kappa \times \hat u| dx$, with the direction s of friction, a state at each point;
changes of $\hat u$ within the sections are left out.
"""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import RodLoad, Signal, Wave, signal_of
from nectosome.core.described import is_zero, number, vector
from nectosome.core.dry_friction import LENGTH_SLIP, acting, bend, share_rate
from nectosome.core.se3 import cross
from nectosome.description import STRAIN_NAMES, Rod
from nectosome.description.rod_loads import ChamberLoad, MuscleLoad, TendonLoad
from nectosome.mechanism.rods import SoftRod, basis, gauss, kinks, legendre, strain_rows, values_at, wave_of

from .places import Carrier


class Thread(eqx.Module):
    """Path of a thread at m points along a rod."""

    basis: Float[Array, "m 6 nq"]  # of the rod's strains [rad/m, 1] there
    rest: Float[Array, "m 6"]  # stress-free strains
    weight: Float[Array, "m"]  # quadrature weight: length of the rod [m]
    place: Float[Array, "m 3"]  # d [m], with first component 0
    slope: Float[Array, "m 3"]  # d' [1]

    @classmethod
    def from_description(cls, described: TendonLoad | ChamberLoad, part: Carrier) -> "tuple[Thread, np.ndarray]":
        """The thread of a description, and the share of its length at which each of its points lies."""
        rod, limb = part.rod, part.limb
        assert isinstance(limb, Rod)
        start, end = described.along
        share, weight = gauss(*_rule(described, rod))
        n = share.size
        x = start + (end - start) * share
        scale = jnp.concatenate([jnp.ones(3) / rod.length, jnp.ones(3)])
        rest = jnp.zeros((n, 6)).at[:, 3].set(1.0)
        for row, name in enumerate(STRAIN_NAMES):
            if given := getattr(limb.rest, name):
                rest = rest.at[:, row].add(jnp.asarray(legendre(len(given) - 1, x)) @ vector(given))
        along = rod.length * (end - start)
        root, tip = vector(described.place), vector(described.tip_place or described.place)
        place = jnp.zeros((n, 3)).at[:, 1:].set(root + (tip - root) * share[:, None])
        slope = jnp.zeros((n, 3)).at[:, 1:].set((tip - root) / along)
        strains = jnp.asarray(basis({**limb.strains}, values_at(rod.driven, x), x)) * scale[:, None]
        return cls(strains, rest, along * jnp.asarray(weight), place, slope), share

    def along(self, strain: Float[Array, "m 6"]) -> Float[Array, "m 3"]:
        """Its direction in the sections of a rod with these strains."""
        u = strain[:, 3:] + cross(strain[:, :3], self.place) + self.slope
        return u / jnp.sqrt(jnp.sum(u * u, axis=-1))[:, None]

    def lever(self, q: Float[Array, "nq"]) -> Float[Array, "m 6"]:
        """Internal wrench per tension."""
        along = self.along(self.rest + self.basis @ q)
        return jnp.concatenate([cross(self.place, along), along], axis=-1)

    def pull(self, q: Float[Array, "nq"], tension: Float[Array, "m"]) -> Float[Array, "nq"]:
        """Generalised force of a tension [N] along the thread."""
        return -jnp.einsum("m,mri,mr->i", self.weight * tension, self.basis, self.lever(q))


def _rule(described: TendonLoad | ChamberLoad, rod: SoftRod) -> tuple[int, tuple[float, ...]]:
    """Points of a Gauss rule on each piece of a thread, and the shares of its length between which pieces lie."""
    start, end = described.along
    return rod.nq + 8, tuple((at - start) / (end - start) for at in kinks(rod.driven) if start < at < end)


def _up_to(n: int, breaks: tuple[float, ...]) -> Float[np.ndarray, "m m"]:
    """Integrals from 0 up to each point of a Gauss rule, per value there: exact for polynomials on each piece."""
    s, w = np.polynomial.legendre.leggauss(n)
    of_each = np.stack([np.polynomial.legendre.legint(row, lbnd=-1) for row in np.eye(n)])
    part = np.polynomial.legendre.legval(s, of_each.T).T @ np.linalg.inv(np.polynomial.legendre.legvander(s, n - 1))
    widths = np.diff([0.0, *breaks, 1.0]) / 2
    k = widths.size
    return np.kron(np.diag(widths), part) + np.kron(np.tri(k, k, -1) * widths, np.ones((n, 1)) * w)


class ThreadFriction(eqx.Module):
    """Friction of a thread that is pulled where it begins."""

    coefficient: Float[Array, ""]  # mu
    up_to: Float[Array, "m m"]  # integrates values at its points from where it begins up to each of them [m]

    def share(
        self, thread: Thread, q: Float[Array, "nq"], v: Float[Array, "nq"], z: Float[Array, "m"]
    ) -> tuple[Float[Array, "m"], Float[Array, "m"]]:
        """Tension along the thread over that where it begins, with directions z of friction, and the rates of these."""
        strain, rate = thread.rest + thread.basis @ q, thread.basis @ v
        along = thread.along(strain)
        longer = jnp.sum(along * (rate[:, 3:] + cross(rate[:, :3], thread.place)), axis=-1)
        sliding = self.up_to @ longer - jnp.dot(thread.weight, longer)  # as what lies beyond gets shorter
        turn = bend(jnp.sum(cross(strain[:, :3], along) ** 2, axis=-1), jnp.sum(thread.weight))
        share = jnp.exp(-self.coefficient * (self.up_to @ (acting(z, sliding, LENGTH_SLIP) * turn)))
        return share, share_rate(z, sliding, LENGTH_SLIP, 1.0)


class Tendon(RodLoad):
    """A thread without stiffness, with a given tension where it begins, and without friction unless it is given."""

    thread: Thread
    tension: Signal  # [N]
    friction: ThreadFriction | None = None
    described_by = TendonLoad

    @classmethod
    def from_description(cls, described: TendonLoad, part: Carrier) -> "Tendon":
        """In a rod."""
        thread, friction = Thread.from_description(described, part)[0], None
        if not is_zero(described.friction):
            up_to = jnp.sum(thread.weight) * jnp.asarray(_up_to(*_rule(described, part.rod)))
            friction = ThreadFriction(number(described.friction), up_to)
        return cls(thread, signal_of(described.tension), friction)

    def initial(self) -> Any:
        """As pulled last, all along; () without friction."""
        return () if self.friction is None else jnp.ones(self.thread.weight.shape)

    def force(self, t: Float[Array, ""], q: Float[Array, "nq"], v: Float[Array, "nq"]) -> Float[Array, "nq"]:
        """As pulled last."""
        return self.at_state(t, q, v, self.initial())[0]

    def at_state(
        self, t: Float[Array, ""], q: Float[Array, "nq"], v: Float[Array, "nq"], z: Any
    ) -> tuple[Float[Array, "nq"], Any]:
        r"""$-\int T \partial |u| / \partial q\, dx$, and the rates of the directions z of friction."""
        tension, rate = jnp.broadcast_to(self.tension(t)[0], self.thread.weight.shape), z
        if self.friction is not None:
            share, rate = self.friction.share(self.thread, q, v, z)
            tension = tension * share
        return self.thread.pull(q, tension), rate


class FluidChamber(RodLoad):
    r"""A fluid chamber with a given gauge pressure: its power is $p \dot V$, $V = \int A |u| dx$.

    Its section A is constant: the walls do not bulge, as for a chamber wound with thread.
    """

    thread: Thread
    area: Float[Array, "m"]  # A [m2]
    pressure: Signal  # p [Pa]
    described_by = ChamberLoad

    @classmethod
    def from_description(cls, described: ChamberLoad, part: Carrier) -> "FluidChamber":
        """In a rod, without hysteresis."""
        thread, share = Thread.from_description(described, part)
        first, tip = number(described.area), described.tip_area
        last = first if tip is None else number(tip)
        return cls(thread, first + (last - first) * share, signal_of(described.pressure))

    def force(self, t: Float[Array, ""], q: Float[Array, "nq"], v: Float[Array, "nq"]) -> Float[Array, "nq"]:
        r"""$p \partial V/\partial q$."""
        return self.thread.pull(q, -self.pressure(t)[0] * self.area)


class Muscle(RodLoad):
    r"""An active internal moment m(x, t) [N m] about one axis of the sections: $\int \Phi^T m\,dx$ with the basis Phi.

    It travels along the rod as a wave. A positive moment increases the strain. `rows` are the indices of its
    coordinates, of `count` in total.
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


_BRANCHES = 4


class Relaxation(RodLoad):
    r"""What a material of constant loss factor adds to the springs K of a rod: Maxwell branches beside them,

    $$ -\sum_k g_k K (q - z_k), \qquad \dot z_k = (q - z_k)/\tau_k $$

    so that its modulus over that at rest is $1 + \sum_k g_k \frac{i\omega\tau_k}{1 + i\omega\tau_k}$. Each branch
    stores $\tfrac12 g_k (q - z_k)^T K (q - z_k)$ and no motion gains any. It begins relaxed in its first shape.
    """

    stiffness: Float[Array, "nq nq"]  # K
    share: Float[Array, "k"]  # g [-]
    time: Float[Array, "k"]  # tau [s]
    start: Float[Array, "nq"]

    @classmethod
    def of(cls, rod: SoftRod, constant: tuple[Any, Any, Any], start: Float[Array, "nq"]) -> "Relaxation":
        """Of a rod whose loss factor is constant between two frequencies [Hz]."""
        return cls(rod.stiffness, *relaxation_of(*map(number, constant)), start)

    def initial(self) -> Float[Array, "k nq"]:
        """What each branch has yielded."""
        return jnp.broadcast_to(self.start, (_BRANCHES, *self.start.shape))

    def force(self, t: Float[Array, ""], q: Float[Array, "nq"], v: Float[Array, "nq"]) -> Float[Array, "nq"]:
        """In its first state."""
        return self.at_state(t, q, v, self.initial())[0]

    def at_state(
        self, t: Float[Array, ""], q: Float[Array, "nq"], v: Float[Array, "nq"], z: Float[Array, "k nq"]
    ) -> tuple[Float[Array, "nq"], Float[Array, "k nq"]]:
        """Generalised force, and the rates at which the branches yield."""
        stretch = q - z
        return -self.stiffness @ (self.share @ stretch), stretch / self.time[:, None]


def relaxation_of(
    loss_factor: Float[Array, ""], low: Float[Array, ""], high: Float[Array, ""]
) -> tuple[Float[Array, "4"], Float[Array, "4"]]:
    r"""Shares g and times tau [s] of Maxwell branches with a constant loss factor $\delta$ between frequencies [Hz].

    Times are spread evenly over the logarithm, a little beyond the band. Shares solve
    $\sum_k g_k (x_k - \delta x_k^2)/(1 + x_k^2) = \delta$, $x_k = \omega\tau_k$, over the band in least squares. Up to
    $\delta = 0.3$ and two decades all are positive, and the loss factor is within 4.5 % of it, within 2.5 % up to 0.11.
    """
    middle, decades = 0.5 * (jnp.log10(low) + jnp.log10(high)), jnp.log10(high / low)
    half = 0.5 * jnp.maximum(decades, 1.0)
    beyond = jnp.maximum(0.3 - 0.2 * half, 0.7 - half)
    frequency = 10 ** (middle + (half + beyond) * jnp.linspace(-1.0, 1.0, _BRANCHES))
    time = 1 / (2 * jnp.pi * frequency)
    x = jnp.outer(2 * jnp.pi * 10 ** (middle + half * jnp.linspace(-1.0, 1.0, 60)), time)
    rows = (x - loss_factor * x**2) / (1 + x**2)
    share = jnp.linalg.solve(rows.T @ rows, jnp.sum(rows, axis=0) * loss_factor)
    return share, time
