"""Motion capture of a silicone beam that is let go: what of it moves, when, and how far it drops.

Soft Robotics Lab, ETH Zurich, repository diffPD_sim2real (MIT, `recordings.LICENSE`, which ships beside this file). The
tables hold the markers of `beam_gravity_V2_a.c3d`, `beam_gravity_V2_b.c3d`, `beam_load52_V2_a.c3d` and
`beam_load101_V2_a.c3d`, all frames (100 a second), in metres to a micrometre, nothing left out or smoothed: x is up, z
along the beam, away from its clamp.

The beam is held level by its tip and let go; in `load` with a weight of 52 or 101 g at the tip. That the weight stays
on is not in the files: the beam then sinks on, and vibrates at 4.3 and 3.4 instead of 7.7 Hz.
"""

from importlib.resources import files
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

RELEASES = {"gravity_a": 1.0, "gravity_b": 1.0, "load_a": 1.5, "load_101": 1.5}  # how long each is compared [s]
LOADS = {"load_a": 0.052, "load_101": 0.101}  # at the tip [kg]
_RATE = 100.0  # [Hz]
_MOVES = 3e-3  # [m]: markers of the clamp move by less than 1 mm
_GONE = 5e-4  # [m] below where it was held: the release is a sample before
_SLACK = 5  # samples before the release that do not count as held
_REST = 50  # samples at the end that count as at rest


class Release(NamedTuple):
    """A recording from the release on; heights count from where the tip was held."""

    time: Float[np.ndarray, "n"]  # [s]
    height: Float[np.ndarray, "n"]  # of the tip: mean of the markers on the beam that are farthest from the clamp [m]
    markers: Float[np.ndarray, "n m"]  # heights of all markers that move, each from where it was held [m]
    on_beam: tuple[int, ...]  # their places among all markers, from 1
    at_tip: tuple[int, ...]  # of these, the ones that `height` is of
    rest: float  # height of the tip at the end of the recording [m]


def release(name: str) -> Release:
    """One of the `RELEASES`, to the end of its recording."""
    text = files("nectosome_studies").joinpath("softlimb", f"beam_{name}.csv").read_text(encoding="utf-8")
    rows = np.genfromtxt(text.splitlines()[1:], delimiter=",")
    place = rows[:, 1:].reshape(len(rows), -1, 3)  # frame, marker, axis
    moving = np.flatnonzero(np.ptp(place[..., 0], axis=0) > _MOVES)
    fallen = place[0, moving, 0].mean() - place[:, moving, 0].mean(axis=1)
    begin = int(np.argmax(fallen > _GONE)) - 1
    held = place[: begin - _SLACK].mean(axis=0)
    markers = place[:, moving, 0] - held[moving, 0]
    tip = np.sort(np.argsort(held[moving, 2])[-2:])  # the third sits 1 to 5 mm behind them
    height = markers[:, tip].mean(axis=1)
    return Release(
        np.arange(len(rows) - begin) / _RATE,
        height[begin:],
        markers[begin:],
        tuple(int(i) + 1 for i in moving),
        tuple(int(i) + 1 for i in moving[tip]),
        float(height[-_REST:].mean()),
    )
