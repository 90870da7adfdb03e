"""A quantity that repeats itself, by its values at some times: between them a parabola."""

from typing import Any


class CyclicCurve:
    """A quantity at times [n, ...] of a period, and between them."""

    def __init__(self, xp: Any, time: Any, x: Any, period: Any):
        self.xp, self.x, self.next = xp, x, xp.roll(x, -1, axis=0)
        span = xp.concatenate([time[1:] - time[:-1], (time[:1] + period - time[-1:])])
        self.span = span.reshape(-1, *[1] * (x.ndim - 1))
        slope = (self.next - x) / self.span
        here = 2 * (xp.roll(slope, 1, axis=0) - slope) / (xp.roll(self.span, 1, axis=0) + self.span)
        there = xp.roll(here, -1, axis=0)
        least = xp.minimum(xp.abs(here), xp.abs(there))
        # -x'' up to the next time; limited, so that a jump bends nothing beside it
        self.bend = xp.where(here * there > 0, xp.clip(0.5 * (here + there), -2 * least, 2 * least), 0.0)

    def largest(self, sign: float = 1.0) -> Any:
        """Over the period; of minus the quantity with -1."""
        x, rise, bent = sign * self.x, sign * (self.next - self.x), sign * self.bend * self.span**2
        turns = bent > 2 * self.xp.abs(rise)
        share = 0.5 + rise / self.xp.where(turns, bent, 1.0)
        return self.xp.max(self.xp.where(turns, x + rise * share + 0.5 * bent * share * (1 - share), x), axis=0)

    def half_range(self) -> Any:
        """Half of the difference of its largest and its smallest value."""
        return 0.5 * (self.largest() + self.largest(-1.0))

    def half_way(self) -> Any:
        """Half of the range of its integral."""
        steps = 0.5 * (self.x + self.next) * self.span + self.bend * self.span**3 / 12
        way = self.xp.cumsum(steps, axis=0) - steps
        turns = self.x * self.next < 0
        further = 0.5 * self.span * self.x**2 / self.xp.where(turns, self.x - self.next, 1.0)
        way = way + self.xp.where(turns, further, 0.0)  # up to where it turns
        return 0.5 * (self.xp.max(way, axis=0) - self.xp.min(way, axis=0))
