"""Markers through the frames of several cameras: which candidate is which, at the times of the first camera."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from nectosome.io.errors import InputError
from nectosome.measure.cameras import Camera

from .candidates import Sightings
from .identity import Body

_TOGETHER = 0.02  # of the time between frames: cameras that differ by less see the same moment


@dataclass(frozen=True)
class Tracks:
    """Markers in the pictures: nan where a camera does not see one, and the reason where too few cameras do."""

    time: Float[np.ndarray, "t"]  # [s], of the first camera's frames that all of them cover
    pixels: Float[np.ndarray, "c t m 2"]
    areas: Float[np.ndarray, "c t m"]  # [px]
    reasons: Int[np.ndarray, "t m"]
    late: float  # most that frames taken together differ in time [s]; 0: the same moments


def followed(cameras: Sequence[Camera], seen: Sequence[Sightings], body: Body) -> Tracks:
    """Follow a body's markers through all frames; raises InputError where the videos have no time together.

    Frames are taken together that are nearest in time. Where cameras do not see the same moments, pixels of the others
    are taken at the first one's, straight between two frames that are next to each other.
    """
    clocks = [np.array(own.time) for own in seen]
    begin, end = max(clock[0] for clock in clocks), min(clock[-1] for clock in clocks)
    usual = max(float(np.median(np.diff(clock))) if len(clock) > 1 else np.inf for clock in clocks)
    first = np.flatnonzero((clocks[0] >= begin - 0.5 * usual) & (clocks[0] <= end + 0.5 * usual))
    if not first.size:
        raise InputError(
            f"the videos have no time together: one begins at {begin:.4g} s, another ends at {end:.4g} s. Look at the "
            "offsets of the cameras.",
            field="cameras",
        )
    time = clocks[0][first]
    count, m = len(cameras), len(body.at)
    pixels = np.full((count, len(time), m, 2), np.nan)
    areas = np.full((count, len(time), m), np.nan)
    frames = np.array([_nearest(clock, time) for clock in clocks])
    why = np.zeros((len(time), m), np.int8)
    for t in range(len(time)):
        now = [seen[c].groups[frames[c, t]] for c in range(count)]
        picked, why[t] = body.find(cameras, now)
        for c in range(count):
            for k in np.flatnonzero(picked[c] >= 0):
                candidate = now[c][body.groups[k]][picked[c, k]]
                pixels[c, t, k], areas[c, t, k] = candidate.pixel, candidate.area
    late = 0.0
    for c in range(1, count):
        off = float(np.max(np.abs(clocks[c][frames[c]] - time)))
        if off > _TOGETHER * usual:
            late = max(late, off)
            pixels[c] = _at(time, clocks[c][frames[c]], pixels[c], 1.5 * usual)
    return Tracks(time, pixels, areas, why, late)


def _nearest(clock: Float[np.ndarray, "n"], time: Float[np.ndarray, "t"]) -> Int[np.ndarray, "t"]:
    after = np.clip(np.searchsorted(clock, time), 1, max(len(clock) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(clock) - 1)
    return np.where(np.abs(clock[before] - time) <= np.abs(clock[after] - time), before, after)


def _at(
    time: Float[np.ndarray, "t"], own: Float[np.ndarray, "t"], pixels: Float[np.ndarray, "t m 2"], gap: float
) -> Float[np.ndarray, "t m 2"]:
    """Pixels at the first camera's times, straight between frames of this one that are next to each other."""
    out = np.full_like(pixels, np.nan)
    for k in range(pixels.shape[1]):
        known = np.flatnonzero(np.isfinite(pixels[:, k, 0]))
        known = known[np.concatenate([[True], np.diff(own[known]) > 0])] if known.size else known
        if known.size < 2:
            continue
        clock = own[known]
        after = np.searchsorted(clock, time)
        inside = (after > 0) & (after < len(clock))
        low, high = clock[np.clip(after - 1, 0, len(clock) - 1)], clock[np.clip(after, 0, len(clock) - 1)]
        exact = np.isin(time, clock)
        use = exact | (inside & (high - low <= gap))
        for d in range(2):
            out[use, k, d] = np.interp(time[use], clock, pixels[known, k, d])
    return out
