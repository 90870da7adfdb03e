"""What draws say: intervals, what makes them wide, and what to measure.

The interval of a number is that between the 10 % and the 90 % quantile of the draws. What makes it wide follows from a
linear fit of the number by the places: the share of a source is its squared coefficient over the variance, the
first-order Sobol index of a linear model (Saltelli 2008).
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from nectosome.core import Status
from nectosome.description.uncertainty import Source
from nectosome.io import provenance
from nectosome.units import count

if TYPE_CHECKING:
    import xarray as xr

LOW, HIGH = 0.1, 0.9
"""Quantiles at the ends of an interval."""
FOUND = (Status.SOLVED, Status.SETTLED, Status.UNSTABLE, Status.EVENT)
"""What a draw must end with to be in an interval."""
LEFT_OUT = 0.2
"""Standard deviation of the logarithm of numbers that depend on the water, of what its models leave out."""
USELESS = 3.0
"""Ratio of the ends from which on an interval says hardly anything."""
_AGAIN = 200  # resamples of the draws that say how sure an end is
_HALF = 1.2815515655446004  # standard deviations from the median to the ends
_TOUCHED = 0.05  # share of loads of the water in a variance from which on a number depends on them
_MAIN = ("speed", "forward speed", "velocity, forward", "velocity, size", "mean velocity, size", "turn rate about z")
_NAMED = 4  # numbers in a sentence


class Key(NamedTuple):
    """Which number of a page: its table, by key and heading, its name there, and its unit."""

    table: str
    heading: str
    name: str
    unit: str

    @property
    def text(self) -> str:
        """Heading of its table, and its name."""
        return f"{self.heading}: {self.name}"


def shares_of(
    x: Float[np.ndarray, "k p"], y: Float[np.ndarray, "k n"], correlations: Float[np.ndarray, "p p"]
) -> tuple[Float[np.ndarray, "p n"], Float[np.ndarray, "n"]]:
    """Shares of the sources, at places x, in the variance of each number y, and of all of them together.

    NaN where there are too few draws, and of a number that does not vary.
    """
    shares, whole = np.full((x.shape[1], y.shape[1]), np.nan), np.full(y.shape[1], np.nan)
    for k, column in enumerate(y.T):
        good = np.isfinite(column)
        if good.sum() < x.shape[1] + 3 or np.ptp(column[good]) == 0:
            continue
        design = np.column_stack([np.ones(good.sum()), x[good]])
        coefficients, *_ = np.linalg.lstsq(design, column[good], rcond=None)
        rest = column[good] - design @ coefficients
        noise = (rest @ rest) / (good.sum() - design.shape[1])
        b = coefficients[1:]
        # what b C b has of noise alone, on average
        error = noise * np.diag(correlations @ np.linalg.pinv(design.T @ design)[1:, 1:])
        each = np.maximum(b * (correlations @ b) - error, 0.0)  # places have the variance 1
        shares[:, k] = each / (each.sum() + noise)
        whole[k] = each.sum() / (each.sum() + noise)
    return shares, whole


def depend(shares: Float[np.ndarray, "p n"], of_water: Bool[np.ndarray, "p"]) -> Bool[np.ndarray, "n"]:
    """Which numbers depend on sources that are of loads of the water; where no shares are known all count."""
    return of_water.any() & ~(shares[of_water].sum(axis=0) <= _TOUCHED)


@dataclass(frozen=True)
class Draws:
    """What a verb gives in all draws, the first of which is the file itself."""

    title: str
    sources: tuple[Source, ...]
    correlations: Float[np.ndarray, "p p"]  # of the places of the sources
    places: Float[np.ndarray, "k p"]
    status: tuple[str, ...]
    keys: tuple[Key, ...]
    values: Float[np.ndarray, "k n"]  # NaN where a draw has none
    series: Mapping[str, np.ndarray]  # over time, of each draw [k, t]; and "time"
    cautions: tuple[str, ...] = ()  # what the models of the file's robot leave out, as the verb warns of it

    @cached_property
    def found(self) -> Bool[np.ndarray, "k"]:
        """Draws that count: solved, without that of the file."""
        good = [status in {one.name for one in FOUND} for status in self.status]
        return np.array([False, *good[1:]])

    @cached_property
    def ends(self) -> Float[np.ndarray, "2 n"]:
        """Lower and upper ends of the intervals, with what models of the water leave out."""
        return np.where(self.wet, widened(self.drawn), self.drawn)

    @cached_property
    def drawn(self) -> Float[np.ndarray, "2 n"]:
        """The same of the draws alone."""
        return _ends(self.values[self.found])

    @cached_property
    def wet(self) -> Bool[np.ndarray, "n"]:
        """Which numbers depend on loads of the water; with too few draws all that vary count."""
        of_water = np.array([source.of_water for source in self.sources], dtype=bool)
        return (self.drawn[0] < self.drawn[1]) & depend(self.shares, of_water)

    @cached_property
    def unsure(self) -> Float[np.ndarray, "n"]:
        """Standard error of an end over the width of its interval, by resampled draws (bootstrap)."""
        rows, rng = self.values[self.found], np.random.default_rng(0)
        if not rows.size:
            return np.full(rows.shape[1], np.nan)
        again = np.stack([_ends(rows[rng.integers(0, len(rows), len(rows))]) for _ in range(_AGAIN)])
        width = self.drawn[1] - self.drawn[0]
        return again.std(axis=0).mean(axis=0) / np.where(width > 0, width, np.nan)

    @cached_property
    def _fit(self) -> tuple[Float[np.ndarray, "p n"], Float[np.ndarray, "n"]]:
        return shares_of(self.places[self.found], self.values[self.found], self.correlations)

    @property
    def shares(self) -> Float[np.ndarray, "p n"]:
        """Share of each source in the variance of each number; NaN where there are too few draws."""
        return self._fit[0]

    @property
    def explained(self) -> Float[np.ndarray, "n"]:
        """Share of the variance of each number that a linear fit by the places explains."""
        return self._fit[1]

    @cached_property
    def mean_shares(self) -> Float[np.ndarray, "p"]:
        """Share of each source in the variance, the mean over the numbers that vary; NaN with too few draws."""
        known = np.isfinite(self.shares).all(axis=0)
        return self.shares[:, known].mean(axis=1) if known.any() else np.full(len(self.sources), np.nan)

    @property
    def main(self) -> int | None:
        """The number that a robot is judged by first: its speed, else the first that varies; None where none does."""
        varies = [k for k in range(len(self.keys)) if self.ends[0, k] < self.ends[1, k]]
        named = [k for name in _MAIN for k in varies if self.keys[k].name == name]
        return next(iter([*named, *varies]), None)

    @property
    def advice(self) -> list[str]:
        """What to measure so that the interval of the main number becomes narrow."""
        k = self.main
        if k is None or np.isnan(self.shares[:, k]).all():
            return []
        top = int(np.argmax(self.shares[:, k]))
        source, share, unit = self.sources[top], float(self.shares[top, k]), self.keys[k].unit
        middle = float(np.nanmedian(self.values[self.found, k]))
        narrow = middle + (self.drawn[:, k : k + 1] - middle) * math.sqrt(1 - share)
        narrow = (widened(narrow) if self.wet[k] else narrow).ravel()
        text = f"{narrow[0]:.4g} to {narrow[1]:.4g} {unit}".strip()
        most = f"{source.name} makes {100 * share:.0f} % of the variance of {self.keys[k].name}"
        return [f"{most}; known exactly, the interval would be {text}: {source.experiment}"]

    @property
    def lost(self) -> list[str]:
        """A sentence where draws have no run."""
        draws, good = len(self.status) - 1, int(self.found.sum())
        return [f"{draws - good} of {draws} draws have no such run, and are in no interval"] if good < draws else []

    @property
    def useless(self) -> list[str]:
        """A sentence where the ends of intervals differ by a factor that says hardly anything."""
        low, high = np.sort(np.abs(self.ends), axis=0)
        same = np.sign(self.ends[0]) == np.sign(self.ends[1])
        wide = [key.name for key, bad in zip(self.keys, same & (high > USELESS * low), strict=True) if bad]
        if not wide:
            return []
        more = f" and {count(len(wide) - _NAMED, 'more number')}" if len(wide) > _NAMED else ""
        return [
            f"not known to a factor of {USELESS:g}: {', '.join(wide[:_NAMED])}{more}; measure first what makes it wide"
        ]

    def to_dataset(self, settings: Mapping[str, Any] | None = None) -> "xr.Dataset":
        """All draws, intervals and shares, labelled; `settings` go into the provenance."""
        import xarray as xr

        ends = self.ends
        data = {
            "value": (("draw", "number"), self.values),
            "status": (("draw",), np.array(self.status)),
            "place": (("draw", "source"), self.places),
            "low": (("number",), ends[0]),
            "high": (("number",), ends[1]),
            "share": (("source", "number"), self.shares),
            "explained": (("number",), self.explained),
        }
        data |= {name: (("draw", "time"), x) for name, x in self.series.items() if name != "time"}
        coords = {
            "draw": np.arange(len(self.status)),
            "number": [key.text for key in self.keys],
            "unit": (("number",), [key.unit or "1" for key in self.keys]),
            "source": [source.name for source in self.sources],
            "paths": (("source",), [" ".join(source.values) for source in self.sources]),
        }
        if "time" in self.series:
            coords["time"] = (("time",), self.series["time"], {"units": "s"})
        attrs = {"title": self.title, "provenance": json.dumps(provenance(dict(settings or {})))}
        attrs |= {"cautions": "\n".join(self.cautions)} if self.cautions else {}
        found = xr.Dataset(data, coords=coords, attrs=attrs)
        for name in self.series:
            found[name].attrs["units"] = "s" if name == "time" else "m/s"
        return found


def widened(ends: Float[np.ndarray, "2 n"], left_out: float = LEFT_OUT) -> Float[np.ndarray, "2 n"]:
    """Ends of intervals with what models of the water leave out, in quadrature; what does not vary stays.

    By a factor about their geometric mean where both are on one side of 0, else by a share of the larger one.
    """
    low, high = ends
    more, outwards = _HALF * left_out, np.array([[-1.0], [1.0]])
    with np.errstate(divide="ignore", invalid="ignore"):
        half = 0.5 * np.abs(np.log(high / low))
        near = np.sign(low) * np.sqrt(low * high) * np.exp(outwards * np.sign(low) * np.hypot(half, more))
    far = 0.5 * (low + high) + outwards * np.hypot(0.5 * (high - low), more * np.abs(ends).max(axis=0))
    far = np.where(low == 0, np.maximum(far, 0.0), np.where(high == 0, np.minimum(far, 0.0), far))  # such as a share
    return np.where(low < high, np.where(low * high > 0, near, far), ends)


def _ends(rows: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "2 n"]:
    """The quantiles of columns at both ends, of the numbers that there are."""
    if not rows.size:
        return np.full((2, rows.shape[1]), np.nan)
    return np.nanquantile(rows, [LOW, HIGH], axis=0, method="median_unbiased")
