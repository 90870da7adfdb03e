"""Where a run is at any time, and where it is seen from: a periodic motion continues, period after period."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from nectosome.solve import screw_of


def repeated(run: xr.Dataset, period: float, seconds: float) -> xr.Dataset:
    """Places of the stations of a run of one period [s] as it continues for so many seconds, at least one period.

    Each period begins where the last one ended. Only places, rotations and sizes are kept.
    """
    playback, count = Playback.of(run, period), max(int(np.ceil(seconds / period - 1e-9)), 1)
    one = run[["position", "rotation", "half_width", "station_x"]]
    pieces = []
    for n in range(count):
        R, d = playback.after(n)
        moved = one.assign(
            position=one["position"].copy(data=one["position"].values @ R.T + d),
            rotation=one["rotation"].copy(data=R @ one["rotation"].values),
        )
        last = n == count - 1
        pieces.append(moved.assign_coords(time=playback.time + n * period).isel(time=slice(None, None if last else -1)))
    whole = pieces[0].drop_dims("time").assign_coords(part=run["part"])
    return xr.concat([piece[["position", "rotation"]] for piece in pieces], "time").merge(whole).assign_attrs(run.attrs)


class Instant(NamedTuple):
    """One instant: number `k` of the run's, moved by x -> R x + d [m], seen from `here` [m]."""

    k: int
    R: Float[np.ndarray, "3 3"]
    d: Float[np.ndarray, "3"]
    here: Float[np.ndarray, "3"]


class Playback:
    """The path of a run's body. With a period [s] each one begins where the last one ended."""

    def __init__(
        self,
        time: Float[np.ndarray, "t"],
        place: Float[np.ndarray, "t 3"],
        turn: Float[np.ndarray, "t 3 3"] | None = None,
        period: float = 0.0,
    ):
        self.begins = float(time[0])
        self.time, self.place, self.period = time - time[0], place, period
        ends = None if turn is None or not period else ((turn[0], place[0]), (turn[-1], place[-1]))
        self._step = None if ends is None else screw_of(*ends)

    @classmethod
    def of(cls, run: xr.Dataset, period: float) -> "Playback":
        """Return that of the first part of a run, the body; 0 where it has no period [s]."""
        return cls(run["time"].values, run["position"].values[:, 0], run["rotation"].values[:, 0], period)

    @property
    def end(self) -> float:
        """How long one period, or all of it, takes [s]."""
        return self.period or float(self.time[-1])

    def after(self, periods: float) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
        """Motion x -> R x + d [m] of the first period to the one after so many; that of a screw."""
        s = self._step
        if s is None:
            return np.eye(3), np.zeros(3)
        along = periods * s.along * s.axis
        if s.angle == 0:
            return np.eye(3), along
        R = Rotation.from_rotvec(periods * s.angle * s.axis).as_matrix()
        return R, s.point - R @ s.point + along

    def instant(self, time: float, along: bool) -> Instant:
        """The saved instant nearest to a time [s], seen from where the run began, or going `along` with the body."""
        n, t = divmod(time, self.period) if self.period else (0.0, time)
        k = int(np.abs(self.time - t).argmin())
        R, d = self.after(n)
        if not along:
            return Instant(k, R, d, self.place[0])
        if self._step is None:
            return Instant(k, R, d, self.place[k])
        ahead, further = self.after(n + 1)
        share = t / self.period
        here = (1 - share) * (R @ self.place[0] + d) + share * (ahead @ self.place[0] + further)
        return Instant(k, R, d, here)

    def path(self, before: int) -> Float[np.ndarray, "n 3"]:
        """Places of the body [m] in so many periods before, and in the first one; of a run all."""
        if self._step is None:
            return self.place
        return np.concatenate([self.place @ R.T + d for R, d in (self.after(-n) for n in range(before, -1, -1))])
