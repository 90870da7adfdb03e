r"""Webs: sheets between neighbouring limbs, as strips that each lie between two stations of these.

With the frames $(R_k, p_k)$ of the two stations, k = 1, 2, the place $r_k$ of the web's edge and the direction $a_k$ of
the limb there, in these frames, a strip at the share w of the way across is at

$$ p = (1 - w)\, e_1 + w\, e_2, \quad e_k = p_k + R_k r_k, \quad d = e_2 - e_1, \quad a = (1 - w) R_1 a_1 + w R_2 a_2 $$

with the axes x along a, z along $a \times d$ and y across the web, and $d \cdot y$ is the width of the web there. Its
twist is the rate of this pose, so that forces on strips act on the limbs by the interpolation's own Jacobian.

Of a ring of n limbs that all do the same one limb may stand for all, while the body only goes along their axis. The
second station of a strip is then the first one's, in its place at the next limb: turned about the axis in the world.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import safe_norm
from nectosome.core.se3 import cross, dot, dot_t, matmul3, skew

Pose = tuple[Float[Array, "w 3 3"], Float[Array, "w 3"]]  # rotations to the world frame, and places [m]
Sides = tuple[Float[Array, "w 2 3 3"], Float[Array, "w 2 3"]]  # the same of the stations beside each strip


# shares of the way across a gap at which its two strips are: Gauss points
ACROSS = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3)
APART = float(ACROSS[1] - ACROSS[0])


class Web(eqx.Module):
    """The strips of a web, or of all webs of a robot: two at each place along each gap, one behind the other."""

    place: Float[Array, "w 2 3"]  # of its edges on the stations beside each strip, in their frames [m]
    along: Float[Array, "w 2 3"]  # direction of the limbs there, in the same frames
    to_next: Float[Array, "w 3 4"] | None = None  # rotation and shift [m] in the world to the next limb, of one for all

    def pose(self, sides: Sides) -> Pose:
        """Poses of the strips by those of the two stations beside each."""
        frame = self._frame(sides)
        return frame.rotation, frame.position

    def half_width(self, sides: Sides) -> Float[Array, "w"]:
        """Half of the width of each strip [m]."""
        return 0.5 / len(ACROSS) * self._frame(sides).width

    def _frame(self, sides: Sides) -> "_Frame":
        R, p = sides
        if self.to_next is not None:
            R = self._in_place(R)
            p = jnp.stack([p[:, 0], dot(self.to_next[..., :3], p[:, 1]) + self.to_next[..., 3]], axis=1)
        edge, limb = p + dot(R, self.place), dot(R, self.along)
        across, along = edge[:, 1] - edge[:, 0], self._between(limb)
        length = safe_norm(along)
        x = along / length[:, None]
        normal = cross(x, across)
        width = safe_norm(normal)
        z = normal / width[:, None]
        return _Frame(jnp.stack([x, cross(z, x), z], axis=-1), self._between(edge), across, width, length)

    def _in_place(self, R: Float[Array, "w 2 3 3"]) -> Float[Array, "w 2 3 3"]:
        """Rotations of both stations, of the second one at the next limb where one stands for all."""
        return R if self.to_next is None else jnp.stack([R[:, 0], matmul3(self.to_next[..., :3], R[:, 1])], axis=1)

    def _between(self, both: Float[Array, "w 2 3"]) -> Float[Array, "w 3"]:
        """What is at a strip, of vectors at both sides."""
        w = jnp.tile(ACROSS, len(self.place) // len(ACROSS))[:, None]
        return (1 - w) * both[:, 0] + w * both[:, 1]

    def twists(self, sides: Sides, twist: Float[Array, "w 2 6"]) -> Float[Array, "w 6"]:
        r"""Body twists of the strips by those of the stations beside them; linear in these.

        With the rates of d and a, $\omega_y = -z \cdot \dot a/|a|$, $\omega_z = y \cdot \dot a/|a|$, and $\omega_x = (z
        \cdot \dot d + (d \cdot x)\, \omega_y)/(d \cdot y)$.
        """
        here, R = self._frame(sides), self._in_place(sides[0])
        turn, slide = twist[..., :3], twist[..., 3:]
        edge, limb = dot(R, slide + cross(turn, self.place)), dot(R, cross(turn, self.along))
        turned = dot_t(here.rotation, self._between(limb)) / here.length[:, None]
        opens = jnp.sum(here.rotation[..., 2] * (edge[:, 1] - edge[:, 0]), axis=-1)
        ahead = jnp.sum(here.rotation[..., 0] * here.across, axis=-1)
        about_x = (opens - ahead * turned[:, 2]) / here.width
        spin = jnp.stack([about_x, -turned[:, 2], turned[:, 1]], axis=-1)
        return jnp.concatenate([spin, dot_t(here.rotation, self._between(edge))], axis=-1)

    def twist_rates(
        self, sides: Sides, twist: Float[Array, "w 2 6"], rate: Float[Array, "w 2 6"]
    ) -> Float[Array, "w 6"]:
        """Rates of these body twists, by those of the stations beside them."""
        return jax.jvp(self.twists, (sides, twist), (_rates(sides, twist), rate))[1]


class _Frame(NamedTuple):
    """Frames of the strips."""

    rotation: Float[Array, "w 3 3"]  # to the world frame
    position: Float[Array, "w 3"]  # [m]
    across: Float[Array, "w 3"]  # d [m]
    width: Float[Array, "w"]  # of the web there, d . y [m]
    length: Float[Array, "w"]  # |a|


def _rates(sides: Sides, twist: Float[Array, "w 2 6"]) -> Sides:
    """Rates of poses that move with body twists."""
    R, _ = sides
    return matmul3(R, skew(twist[..., :3])), dot(R, twist[..., 3:])


_BLEND = 1.3  # with which rectangles of all aspect ratios have their added mass
_WAVES = 1.65  # with which long strips have that of waves of all lengths along them


def sheet_reach(along: Float[Array, "*n"], across: Float[Array, "*n"]) -> Float[Array, "*n"]:
    r"""Half chord c [m] of a place on a sheet that carries the mass $2 \rho c$ per area as it moves across itself.

    A long plate has there the root of the product of the distances to its two edges (its potential). With these roots
    h of strips along and across a rectangle, $c = (h_1^{-p} + h_2^{-p})^{-1/p}$: with p = 1.3 its whole added mass
    is that of Pabst (1930) within 2 % at any aspect ratio.
    """
    p = _BLEND
    return (along**-p + across**-p) ** (-1 / p)


def waves_reach(reach: Float[Array, "*n"], wavelength: Float[Array, ""]) -> Float[Array, "*n"]:
    r"""The same where waves run along the sheet, of a wave number k: $(c^{-q} + k^q)^{-1/q}$ with q = 1.65.

    An endless sheet in waves carries $2\rho/k$ per area, as its potential falls off as $e^{-kz}$. Of a strip with waves
    along it the whole mass is that of potential flow within 3 % at any wavelength; its potential $\varphi$ solves
    $\int \sqrt{\kappa^2 + k^2}\, \hat\varphi\, e^{i \kappa y} d\kappa / 2\pi = w$ on the strip.
    """
    k = 2 * jnp.pi / wavelength
    return (reach**-_WAVES + k**_WAVES) ** (-1 / _WAVES)
