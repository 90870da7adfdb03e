"""What is odd about the times of a video's frames."""

import numpy as np
from jaxtyping import Float

from .clip import Clip

_LATE = 1.5  # of the usual time between frames, beyond which one is missing
_UNEVEN = 0.2  # of it, by which the rest may differ


def intervals(time: Float[np.ndarray, "t"], clip: Clip) -> tuple[list[list[float]], list[str]]:
    """Gaps as [from, to, row after it, from 1], and what is odd, in words."""
    odd = [f"{clip.damaged} packets could not be decoded: their frames are missing"] if clip.damaged else []
    if len(time) < 3:
        return [], odd
    steps = np.diff(time)
    usual = float(np.median(steps))
    late = np.flatnonzero(steps > _LATE * usual)
    regular = np.delete(steps, late)
    if np.ptp(regular) > _UNEVEN * usual:
        odd.append(f"the rate of frames varies: {1e3 * steps.min():.3g} to {1e3 * steps.max():.3g} ms between frames")
    if late.size:
        missing = int(np.sum(np.round(steps[late] / usual) - 1))
        odd.append(f"about {missing} frames are missing, the first after {time[late[0]]:.4g} s")
    return [[float(time[k]), float(time[k + 1]), int(k) + 2] for k in late], odd
