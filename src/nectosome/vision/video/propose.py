"""Proposal of colour ranges for a sheet, from the hue histogram of one picture."""

from dataclasses import dataclass
from itertools import permutations

import numpy as np
from jaxtyping import Float, UInt8
from scipy.ndimage import gaussian_filter1d

from nectosome.io.extras import package

from .clip import Clip
from .segments import MOST, ColourGroups, blobs
from .sheet import Colour

_SMOOTH = 2.5  # [1/256 turn] standard deviation of the smoothing
_LOW = 0.05  # [peak] level at which a peak ends
_WIDER = 3  # [1/256 turn] margin of hue on both sides
_BROAD = 0.1  # margin of saturation and value on both sides
_MOST_OF_IT = 0.15  # [picture] largest area of a segment


@dataclass(frozen=True)
class Proposal:
    """A colour range and its blobs in a picture."""

    colour: Colour
    pixels: list[int]  # number of pixels of each blob
    middles: list[tuple[float, float]]  # [px] centre of each blob's box


def propose(image: UInt8[np.ndarray, "height width 3"], smallest: int = 20) -> list[Proposal]:
    """Salient colours of a picture (blue, green, red), at most eight; in the order of `along_a_chain`.

    The histogram of hues is weighted by the chroma S V of the pixels, above Otsu's threshold (Otsu 1979). Each peak is
    a colour, down to 1/20 of it on either side; saturation and value span 96 % of its pixels and a margin of 0.1. A
    colour of more than 15 % of the picture is background.
    """
    cv2 = package("cv2", "video")
    hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV_FULL)
    chroma = (hsv[..., 1].astype(np.uint16) * hsv[..., 2] // 255).astype(np.uint8)
    hue = hsv[..., 0]
    found: list[Proposal] = []
    colourful = chroma > max(cv2.threshold(chroma, 0, 255, cv2.THRESH_OTSU)[0], 30)
    counts = np.bincount(hue[colourful], weights=chroma[colourful].astype(float), minlength=256)
    for low, high in _peaks(gaussian_filter1d(counts, _SMOOTH, mode="wrap", truncate=10)):
        inside = colourful & (((hue.astype(int) - low) % 256) <= (high - low) % 256)
        if not inside.any():
            continue
        ends = [np.percentile(hsv[..., k][inside] / 255, (2, 98)) for k in (1, 2)]
        saturation, value = ((max(a - _BROAD, 0.0), min(b + _BROAD, 1.0)) for a, b in ends)
        edges = ((low - _WIDER) % 256, (high + 1 + _WIDER) % 256)
        turn = 2 * np.pi / 256
        colour = Colour(
            hue=(edges[0] * turn, edges[1] * turn),
            saturation=(round(saturation[0], 2), round(saturation[1], 2)),
            value=(round(value[0], 2), round(value[1], 2)),
        )
        bits = ColourGroups([colour]).find(image)
        if np.count_nonzero(bits) > _MOST_OF_IT * bits.size:
            continue
        seen = blobs(bits, [False], smallest)[0]
        if seen:
            middles = [(b.left + b.width / 2 - 0.5, b.top + b.height / 2 - 0.5) for b in seen]
            found.append(Proposal(colour, [b.pixels for b in seen], middles))
    return along_a_chain(sorted(found, key=lambda proposal: -sum(proposal.pixels))[:MOST])


def along_a_chain(found: list[Proposal]) -> list[Proposal]:
    """Colours in their order along the shortest path through the largest blobs of all, from its left end."""
    if len(found) < 2:
        return found
    place = np.array([one.middles[int(np.argmax(one.pixels))] for one in found])
    orders = np.array([*permutations(range(len(found)))])
    orders = orders[place[orders[:, 0], 0] <= place[orders[:, -1], 0]]
    lengths = np.linalg.norm(np.diff(place[orders], axis=1), axis=2).sum(axis=1)
    return [found[k] for k in orders[int(np.argmin(lengths))]]


def _peaks(counts: Float[np.ndarray, "256"]) -> list[tuple[int, int]]:
    """Ranges of hue [1/256 turn] around peaks, the highest first; a range may wrap around 0."""
    left = counts.copy()
    found: list[tuple[int, int]] = []
    while len(found) < 2 * MOST and left.max() > max(0.01 * counts.max(), 1e-9):
        top = int(np.argmax(left))
        ends = []
        for step in (-1, 1):
            k, lowest = 0, left[top]
            # to the end of the peak, or the start of the next one
            while k < 127:
                level = left[(top + step * (k + 1)) % 256]
                if level <= _LOW * left[top] or level > 1.5 * lowest + 0.01 * left[top]:
                    break
                lowest = min(lowest, level)
                k += 1
            ends.append(k)
        found.append(((top - ends[0]) % 256, (top + ends[1]) % 256))
        left[np.arange(top - ends[0], top + ends[1] + 1) % 256] = 0.0
    return found


def proposal_text(found: list[Proposal], clip: Clip, time: float) -> str:
    """Proposed colours as text of a sheet, each with its blobs in the frame."""
    if not found:
        return f"At {time:.4g} s no colour is salient. Try another frame, with --at."
    lines = [f"# salient colours at {time:.4g} s along the shortest path through them, from its left end"]
    lines += ["# keep those of segments; turn the order round where the chain begins on the right"]
    lines += [f"size: [{clip.size[0]}, {clip.size[1]}]", "pixel: 1 mm # side of a pixel in the plane of motion"]
    lines += ["segments:"]
    for k, one in enumerate(found):
        c = one.colour
        hue = ", ".join(f"{np.rad2deg(edge):.0f} deg" for edge in c.hue)
        parts = [f"{name}: [{a:g}, {b:g}]" for name, (a, b) in (("saturation", c.saturation), ("value", c.value))]
        where = "; ".join(
            f"{n} px at ({u:.0f}, {v:.0f})" for n, (u, v) in list(zip(one.pixels, one.middles, strict=True))[:4]
        )
        more = f"; and {len(one.pixels) - 4} more" if len(one.pixels) > 4 else ""
        lines.append(f"  segment{k + 1}: {{hue: [{hue}], {', '.join(parts)}}} # {where}{more}")
    return "\n".join(lines)
