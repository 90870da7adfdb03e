r"""Tendons over joints, all of one kind in one piece: winches and slides pull them, or cranks.

With the angles q of the hinges at constant moment arms r, as of pulleys or circular arcs about their axes, and the
pull p by a joint at $q_d$, the stretch of a tendon is

$$ e = e_0 - \sum_j r_j q_j + p(q_d), \qquad
   p = R q_d \quad\text{or}\quad p = s(q_d + \phi) - s(\phi), \quad s(\theta) = \sqrt{a^2 + d^2 - 2 a d \cos\theta} $$

of a winch of radius R (of a slide, its ratio), or of a crank whose pin at the radius a stands at the angle
$q_d + \phi$ from the direction of a guide at the distance d. Between two holes on both sides of a hinge a tendon is
straight, $\ell_j(q) = \sqrt{S + C \cos q - D \sin q}$ long, with the holes at distances d, e before and after the axis
and heights h, i: $S = d^2 + h^2 + e^2 + i^2$, $C = 2(d e - h i)$, $D = 2(d i + e h)$. There
$\ell_j(0) - \ell_j(q_j)$ stands for $r_j q_j$, and the arm is $(C \sin q + D \cos q)/2\ell_j$. It changes its sign
where the cord passes the axis; a real one may lie on the hinge there.

Its tension T is the one-sided force of e (`nectosome.core.one_sided`), and the generalised forces are
$-T \partial e/\partial q$: a positive arm turns a joint towards positive angles. The tendon has no mass. With a
coefficient of friction mu each hinge on its way from what pulls it takes $e^{-\mu |q_j|}$ of the tension, also between
holes
(`nectosome.core.dry_friction`): $T_j = T \exp(-\mu \sum_{i \le j} s_i |q_i|)$ acts on hinge j. Each $s_i$ is a state,
the share of friction that acts there, which turns within the softness of sliding; what is held fades to the direction
of the pull p.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core.dry_friction import acting, bend, share_rate
from nectosome.core.one_sided import Gaps, one_sided_energy, one_sided_force
from nectosome.core.rows import alike, rows

from .tree import Tree

_MET = 1e-12  # of S, the square of a way between holes that meet


class Crank(eqx.Module):
    """A crank that pulls a tendon."""

    radius: Float[Array, "*m"]  # a [m]
    guide: Float[Array, "*m"]  # d [m]
    angle: Float[Array, "*m"]  # phi [rad]

    def pull(self, q: Float[Array, "*m"]) -> tuple[Float[Array, "*m"], Float[Array, "*m"]]:
        """Pull p [m] and its derivative by the angle [m/rad]."""
        a, d = self.radius, self.guide
        free = jnp.sqrt(a**2 + d**2 - 2 * a * d * jnp.cos(q + self.angle))
        at_zero = jnp.sqrt(a**2 + d**2 - 2 * a * d * jnp.cos(self.angle))
        return free - at_zero, a * d * jnp.sin(q + self.angle) / free


class Cord(eqx.Module):
    """Numbers of the cord of a tendon."""

    start: Float[Array, "*m"]  # stretch with all joints at 0, negative where it is slack [m]
    stiffness: Float[Array, "*m"]  # [N/m]
    damping: Float[Array, "*m"]  # [N s/m]
    softness: Float[Array, "*m"]  # [m]
    friction: Float[Array, "*m"] | None = None  # mu


class JointTendon(eqx.Module):
    """A tendon and the parts over whose joints it runs, that which pulls it last."""

    name: str = eqx.field(static=True)
    parts: tuple[int, ...] = eqx.field(static=True)
    arms: Float[Array, "k"]  # moment of each joint per tension: r [m], -R of a winch, 0 of a crank and between holes
    bows: tuple[Float[Array, "3"] | None, ...]  # S, C, D [m2] of the ways between holes; None of constant arms
    crank: Crank | None
    cord: Cord


class TendonOutput(NamedTuple):
    """What tendons do at one time."""

    tension: Float[Array, "m"]  # [N]
    stretch: Float[Array, "m"]  # negative while it is slack [m]
    energy: Float[Array, "m"]  # stored [J]
    heat: Float[Array, "m"]  # of damping and friction [W]


class TendonGroup(eqx.Module):
    """Tendons with cranks, or those without, with their indices among all tendons."""

    members: tuple[int, ...] = eqx.field(static=True)
    names: tuple[str, ...] = eqx.field(static=True)
    parts: tuple[int, ...] = eqx.field(static=True)  # whose joints any of them runs over, or is pulled by
    ways: tuple[tuple[int, ...], ...] = eqx.field(
        static=True
    )  # place of each one's parts among them, the puller's last
    cranks: tuple[int, ...] = eqx.field(static=True)  # place of each one's crank among them; () without cranks
    arms: Float[Array, "m h"]  # moment of each joint per tension, without those of cranks and between holes [m]
    bows: Float[Array, "m h 3"] | None  # of ways between holes, and 1, 0, 0 elsewhere; None: no holes
    crank: Crank | None
    cord: Cord

    @classmethod
    def of(cls, tendons: Sequence[JointTendon]) -> "tuple[TendonGroup, ...]":
        """All tendons, those with a crank and those without."""
        cords = []
        for g in alike({i: (tendon.crank, tendon.cord) for i, tendon in enumerate(tendons)}):
            own = [tendons[i] for i in g.members]
            parts = tuple(sorted({part for one in own for part in one.parts}))
            row = np.repeat(np.arange(len(own)), [len(one.parts) for one in own])
            ways = tuple(tuple(parts.index(part) for part in one.parts) for one in own)
            column = np.concatenate(ways)
            arms = jnp.zeros((len(own), len(parts))).at[row, column].set(jnp.concatenate([x.arms for x in own]))
            bows = None
            for m, (one, way) in enumerate(zip(own, ways, strict=True)):
                for joint, bow in zip(way, one.bows, strict=False):  # that which pulls has none
                    if bow is not None:
                        bows = jnp.zeros((*arms.shape, 3)).at[..., 0].set(1.0) if bows is None else bows
                        bows = bows.at[m, joint].set(bow)
            crank, cord = g.things
            cranks = () if crank is None else tuple(way[-1] for way in ways)
            cords.append(cls(g.members, tuple(one.name for one in own), parts, ways, cranks, arms, bows, crank, cord))
        return tuple(cords)

    def coordinates(self, tree: Tree, what: str) -> Int[np.ndarray, "m h"]:
        """Coordinates ("q") or velocities ("v") of the joints, the same for each tendon."""
        places = np.array([getattr(tree.layout[part], what).start for part in self.parts])
        return np.broadcast_to(places, (len(self.members), places.size))

    @property
    def guides(self) -> tuple[Int[np.ndarray, "g"], Int[np.ndarray, "g"], Float[np.ndarray, "g m h"]]:
        """Tendon and joint of each place with friction, one state each, and the joints from there on along the tendon.

        The places are in the order of the tendons, and along each of them.
        """
        on = [(m, k) for m, way in enumerate(self.ways) for k in range(len(way) - 1)]
        beyond = np.zeros((len(on), len(self.members), len(self.parts)))
        for g, (m, k) in enumerate(on):
            beyond[g, m, list(self.ways[m][k:-1])] = 1.0
        each = np.array([(m, self.ways[m][k]) for m, k in on], dtype=int).reshape(-1, 2)
        return each[:, 0], each[:, 1], beyond

    def initial(self, tree: Tree) -> Any:
        """Shares of friction at the guides, which bears nothing yet; () without friction."""
        return () if self.cord.friction is None else jnp.zeros(self.guides[0].size)

    def at_state(
        self, tree: Tree, t: Array, q: Float[Array, "nq"], v: Float[Array, "nv"], z: Any
    ) -> tuple[Float[Array, "m h"], Any]:
        """Forces of each tendon along the velocities of the joints, from all of these [N m, N], and rates of z."""
        here, moving, stretch, arms = self._stretched(tree, q, v)
        tension = self._tension(stretch, -jnp.sum(arms * moving, axis=1))
        force = tension[:, None] * self._share(here, moving, arms, z) * arms
        if self.cord.friction is None:
            return force, z
        owner, sliding = self.guides[0], self._sliding(moving, arms)
        pull = stretch - self.cord.start + jnp.sum(self._on_way * self._drawn(here)[0], axis=1)
        softness = rows(self.cord.softness, owner)
        return force, share_rate(z, sliding, softness, jnp.tanh(rows(pull, owner) / softness))

    def gaps(self, tree: Tree, q: Float[Array, "nq"]) -> Gaps:
        """Slack over the softness, negative under tension."""
        slack = -self._stretched(tree, q, jnp.zeros_like(q))[2] / self.cord.softness
        return Gaps.of(slack, self.cord.stiffness, self.cord.damping)

    def output(self, tree: Tree, q: Float[Array, "nq"], v: Float[Array, "nv"], z: Any) -> TendonOutput:
        """Tensions where they are pulled, and energies, at all coordinates and velocities with states z."""
        here, moving, stretch, arms = self._stretched(tree, q, v)
        rate = -jnp.sum(arms * moving, axis=1)
        tension = self._tension(stretch, rate)
        energy = one_sided_energy(stretch, self.cord.stiffness, self.cord.softness)
        heat = (tension - self._tension(stretch, jnp.zeros_like(rate))) * rate
        rubbed = jnp.sum((1.0 - self._share(here, moving, arms, z)) * arms * moving, axis=1)
        return TendonOutput(tension, stretch, energy, heat + tension * rubbed)

    def _stretched(self, tree: Tree, q: Array, v: Array) -> tuple[Array, Array, Array, Float[Array, "m h"]]:
        """Coordinates and velocities of the joints, stretch [m], and moments of the joints per tension [m]."""
        here, moving = (rows(x, self.coordinates(tree, what)[0]) for x, what in ((q, "q"), (v, "v")))
        drawn, arms = self._drawn(here)
        stretch = self.cord.start - jnp.sum(drawn, axis=1)
        if self.crank is not None:
            pull, lever = self.crank.pull(rows(here, np.array(self.cranks)))
            stretch, arms = stretch + pull, arms - lever[:, None] * np.eye(len(self.parts))[list(self.cranks)]
        return here, moving, stretch, arms

    def _drawn(self, here: Float[Array, "h"]) -> tuple[Float[Array, "m h"], Float[Array, "m h"]]:
        """Length that each joint draws in [m], cranks left out, and its derivatives, the arms."""
        drawn, arms = self.arms * here, self.arms
        if self.bows is None:
            return drawn, arms
        S, C, D = jnp.moveaxis(self.bows, -1, 0)
        # equal holes may meet: there the arm has no sign, and is 0
        way = jnp.sqrt(jnp.maximum(S + C * jnp.cos(here) - D * jnp.sin(here), _MET * S))
        return drawn + jnp.sqrt(S + C) - way, arms + (C * jnp.sin(here) + D * jnp.cos(here)) / (2 * way)

    @property
    def _on_way(self) -> Float[np.ndarray, "m h"]:
        """1 where a tendon runs over a joint, without that which pulls it."""
        on_way = np.zeros((len(self.members), len(self.parts)))
        for m, way in enumerate(self.ways):
            on_way[m, list(way[:-1])] = 1.0
        return on_way

    def _sliding(self, moving: Float[Array, "h"], arms: Float[Array, "m h"]) -> Float[Array, "g"]:
        """Speeds at the guides towards what pulls [m/s]: what lies beyond gets shorter."""
        return jnp.einsum("gmh,mh->g", self.guides[2], arms * moving)

    def _share(self, here: Array, moving: Array, arms: Array, z: Any) -> Float[Array, "m h"] | float:
        """Tension at each joint over that where the tendon is pulled."""
        if self.cord.friction is None:
            return 1.0
        owner, joint, beyond = self.guides
        s = acting(z, self._sliding(moving, arms), rows(self.cord.softness, owner))
        turned = rows(self.cord.friction, owner) * s * bend(rows(here, joint) ** 2)
        return jnp.exp(-jnp.einsum("gmh,g->mh", beyond, turned))

    def _tension(self, stretch: Array, rate: Array) -> Array:
        return one_sided_force(stretch, rate, self.cord.stiffness, self.cord.damping, self.cord.softness)


def outputs(
    groups: Sequence[TendonGroup], tree: Tree, q: Float[Array, "nq"], v: Float[Array, "nv"], z: Sequence[Any]
) -> TendonOutput:
    """Outputs of all tendons at all coordinates and velocities, with states of each group, as they are described."""
    own = (g.output(tree, q, v, states) for g, states in zip(groups, z, strict=True))
    each = [TendonOutput(*[jnp.zeros(0)] * 4), *own]
    order = np.argsort([i for g in groups for i in g.members])
    return jax.tree.map(lambda *x: rows(jnp.concatenate(x), order.astype(int)), *each)
