"""Where a run is at any time, and where it is looked at from: what repeats itself goes on, period after period."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from nectosome.solve.screw import screw_of

if TYPE_CHECKING:
    import xarray as xr

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


def repeated(run: "xr.Dataset", period: float, seconds: float) -> "xr.Dataset":
    """Where the stations of a run of one period [s] are as it goes on for so long [s], at least one period.

    Each period begins where the last one ended. What else the run tells is left out.
    """
    import xarray as xr

    course, count = Playback(run, period), max(int(np.ceil(seconds / period - 1e-9)), 1)
    one = run[["position", "rotation", "half_width", "station_x"]]
    pieces = []
    for n in range(count):
        R, d = course.after(n)
        moved = one.assign(
            position=one["position"].copy(data=one["position"].values @ R.T + d),
            rotation=one["rotation"].copy(data=R @ one["rotation"].values),
        )
        last = n == count - 1
        pieces.append(moved.assign_coords(time=course.time + n * period).isel(time=slice(None, None if last else -1)))
    whole = pieces[0].drop_dims("time").assign_coords(part=run["part"])
    return xr.concat([piece[["position", "rotation"]] for piece in pieces], "time").merge(whole).assign_attrs(run.attrs)


class Moment(NamedTuple):
    """One moment: number `k` of the run's, moved by x -> R x + d [m], seen from `here` [m]."""

    k: int
    R: Float[np.ndarray, "3 3"]
    d: Float[np.ndarray, "3"]
    here: Float[np.ndarray, "3"]


class Playback:
    """The way of a run's body. With a period [s] each one begins where the last one ended."""

    def __init__(self, run: "xr.Dataset", period: float):
        self.time, self.period = run["time"].values - run["time"].values[0], period
        self.place, turn = run["position"].values[:, 0], run["rotation"].values[:, 0]
        self._step = screw_of((turn[0], self.place[0]), (turn[-1], self.place[-1])) if period else None

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

    def moment(self, time: float, along: bool) -> Moment:
        """The moment at a time [s], seen from where it began, or from one who goes along with the body."""
        n, t = divmod(time, self.period) if self.period else (0.0, time)
        k = int(np.abs(self.time - t).argmin())
        R, d = self.after(n)
        if not along:
            return Moment(k, R, d, self.place[0])
        if self._step is None:
            return Moment(k, R, d, self.place[k])
        ahead, further = self.after(n + 1)
        share = t / self.period
        here = (1 - share) * (R @ self.place[0] + d) + share * (ahead @ self.place[0] + further)
        return Moment(k, R, d, here)

    def way(self, before: int) -> Float[np.ndarray, "n 3"]:
        """Places of the body [m] in so many periods before, and in the first one; of a run all."""
        if self._step is None:
            return self.place
        ways = [self.place @ R.T + d for R, d in (self.after(-n) for n in range(before, -1, -1))]
        return np.concatenate(ways)
