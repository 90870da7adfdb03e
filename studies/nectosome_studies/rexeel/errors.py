r"""The authors' error table: how far a simulated swim is from all recorded ones, as `sim_to_real_comparison.jl` has it.

At 241 times from 0 to 4 s, of all swims together, the root mean square of what the simulation is off from each swim:
position of the centre of mass, across and along, that of the head, and its yaw. The centre of mass follows from head,
yaw and the motors' logged angles; a position counts from where it was at the start.

All recordings are joined by natural cubic splines, and go on straight after their end. As in the authors' program they
are spread evenly from 0 to their last time but one: time is 0.8 % short. This is kept here so that numbers compare.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from .recordings import RecordedSwims

TIMES = np.arange(241) / 60  # [s]


class Links(NamedTuple):
    """Lengths [m] and masses [kg] from head to tail."""

    length: Float[np.ndarray, "6"]
    mass: Float[np.ndarray, "6"]


class Track(NamedTuple):
    """A swim at `TIMES`, or several: head [m] and its yaw [rad] as in the recordings, angles of the motors [rad]."""

    x: Float[np.ndarray, "*swims time"]
    y: Float[np.ndarray, "*swims time"]
    yaw: Float[np.ndarray, "*swims time"]
    angles: Float[np.ndarray, "*swims time 5"]


class RmsErrors(NamedTuple):
    """Root mean squares [m; rad]."""

    across: float
    along: float
    head_across: float
    head_along: float
    yaw: float


def errors(simulated: Track, measured: Track, links: Links) -> RmsErrors:
    """Of one simulated swim, from all measured ones."""
    pairs = [(centre_of_mass(track, links), np.stack([track.x, track.y], axis=-1)) for track in (simulated, measured)]
    of_mass, of_head = ((ours - ours[:1]) - (theirs - theirs[..., :1, :]) for ours, theirs in zip(*pairs, strict=True))
    yaw = simulated.yaw - measured.yaw
    each = (of_mass[..., 0], of_mass[..., 1], of_head[..., 0], of_head[..., 1], yaw)
    return RmsErrors(*(float(np.sqrt(np.mean(off**2))) for off in each))


def centre_of_mass(track: Track, links: Links) -> Float[np.ndarray, "*swims time 2"]:
    """Centre of mass of all links, across and along [m]; motors turn anticlockwise, as one goes from head to tail."""
    joints = np.broadcast_to(track.angles, (*track.yaw.shape, 5))
    turned = np.cumsum(np.concatenate([-track.yaw[..., None], joints], axis=-1), axis=-1)
    half = 0.5 * links.length[:, None] * np.stack([np.sin(turned), -np.cos(turned)], axis=-1)  # tailwards
    steps = np.concatenate([np.zeros_like(half[..., :1, :]), half[..., :-1, :] + half[..., 1:, :]], axis=-2)
    share = links.mass / links.mass.sum()
    return np.stack([track.x, track.y], axis=-1) + np.einsum("k,...ka->...a", share, np.cumsum(steps, axis=-2))


def as_the_authors(swims: RecordedSwims) -> Track:
    """All recorded swims at `TIMES`, each with the logged angles."""
    x, y, yaw = (_spread(swims.time, values.T).T for values in (swims.x, swims.y, swims.yaw))
    return Track(x, y, yaw, _spread(swims.log_time, swims.actual))


def _spread(time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n m"]) -> Float[np.ndarray, "time m"]:
    """Values at `TIMES`, spread evenly up to their last time but one."""
    return natural(np.linspace(0.0, time[-2], time.size), values)


def natural(time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n m"]) -> Float[np.ndarray, "time m"]:
    """Values at `TIMES` by a natural cubic spline that goes on straight after its end."""
    spline = CubicSpline(time, values, bc_type="natural")
    beyond = np.maximum(TIMES - time[-1], 0.0)[:, None]
    return spline(np.minimum(TIMES, time[-1])) + beyond * spline(time[-1], 1)
