"""Intervals of predictions: a run again and again, each time with other values of what is not known exactly.

What is not known are the `Source`s of a robot. Each draw takes a place of all of them at once, in a Latin hypercube
(McKay, Beckman and Conover 1979), so that few draws cover all. The interval of a number is that between the 10 % and
the 90 % quantile of the draws. What makes it wide follows from a linear fit of the number by the places: the share of
a source is its squared coefficient over the variance, the first-order Sobol index of a linear model (Saltelli 2008).
"""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from nectosome.core import Status
from nectosome.description import RobotDescription, check_numbers, dump_robot
from nectosome.description.foil_planform import FoilLoad
from nectosome.description.uncertainty import Source, sources_of, together
from nectosome.io import provenance
from nectosome.io.schema.structure import changed
from nectosome.loads.foil import Foil
from nectosome.model import build
from nectosome.model.inputs import RobotLike, description_of
from nectosome.search.executors.processes import processors
from nectosome.solve import periodic, reading, simulate, steady
from nectosome.units import InputError, check_whole, count

from .kept_parts import Part, Parts, Progress

if TYPE_CHECKING:
    import xarray as xr

LOW, HIGH = 0.1, 0.9
"""Quantiles at the ends of an interval."""
DRAWS = 40
LEAST_DRAWS, MOST_DRAWS = 8, 10_000
_MORE = 10  # draws than sources at least, unless told otherwise: so a linear fit has something left over
_TITLES = {"simulate": "simulation", "steady": "steady motion", "periodic": "periodic motion"}
_VERBS = {"simulate": simulate, "steady": steady, "periodic": periodic}
_FOUND = (Status.SOLVED, Status.SETTLED, Status.UNSTABLE, Status.EVENT)
_REFUSED = "REFUSED"  # by the verb, with a sentence
_MOSTLY = 0.9  # of the draws in which a number must be there
_AGAIN = 200  # resamples of the draws that say how sure an end is
_SERIES = ("velocity.x", "velocity.y", "velocity.z")
LEFT_OUT = 0.2
"""Standard deviation of the logarithm of numbers that depend on the water, of what its models leave out."""
_HALF = 1.2815515655446004  # standard deviations from the median to the ends
_TOUCHED = 0.05  # share of loads of the water in a variance from which on a number depends on them
_MAIN = ("speed", "forward speed", "velocity, forward", "velocity, size", "mean velocity, size", "turn rate about z")
_NAMED = 4  # numbers in a sentence
USELESS = 3.0
"""Ratio of the ends from which on an interval says hardly anything."""


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


def places(draws: int, correlations: Float[np.ndarray, "p p"], seed: int) -> Float[np.ndarray, "k p"]:
    """Normal places of the sources in each draw, a Latin hypercube; the first draw is the file itself."""
    from scipy.special import ndtri
    from scipy.stats import qmc

    uniform = qmc.LatinHypercube(len(correlations), rng=np.random.default_rng(seed)).random(draws)
    size, directions = np.linalg.eigh(correlations)
    root = directions * np.sqrt(np.maximum(size, 0.0)) @ directions.T  # symmetric: others keep their places
    return np.vstack([np.zeros(len(correlations)), ndtri(uniform) @ root])


def with_left_open(description: RobotDescription, others: Iterable[RobotDescription] = ()) -> RobotDescription:
    """The robot with the numbers of foils that its file leaves open, as they follow from their planforms.

    Those that differ in one of the other robots stay open: there they follow from what differs.
    """
    values = _left_open(description)
    for other in others if values else ():
        there = _left_open(other)
        values = {path: x for path, x in values.items() if there.get(path) == x}
    return changed(description, values) if values else description


def _left_open(description: RobotDescription) -> dict[str, float]:
    """Numbers of foils that a file leaves open, by path."""
    foils = {
        (name, key): load
        for name, part in description.parts.items()
        for key, load in part.loads.items()
        if isinstance(load, FoilLoad)
    }
    values = dict[str, float]()
    if not foils:
        return values
    built = build(description)
    for row in built.loads:
        name = built.tree.names[row.part]
        load = foils.get((name, row.name))
        if load is not None and isinstance(row.load, Foil):
            path = f"{description.place_of(name)}.loads.{row.name}"
            own = {"aspect_ratio": row.load.aspect_ratio, "broadside_drag": row.load.broadside}
            values |= {f"{path}.{key}": float(x) for key, x in own.items() if getattr(load, key) is None}
    return values


def drawn_places(
    description: RobotDescription, draws: int, seed: int
) -> tuple[tuple[Source, ...], Float[np.ndarray, "p p"], Float[np.ndarray, "k p"]]:
    """What is not known exactly, the correlations of its places, and these in each draw; the first is the file's robot.

    Raises InputError for a robot of which all is known exactly.
    """
    sources = _known(sources_of(description))
    correlations = together(description, sources)
    return sources, correlations, places(draws, correlations, seed)


def draws_of(description: RobotDescription, draws: int, seed: int) -> list[dict[str, float]]:
    """Values by path of what is not known exactly, in each draw; the first is the robot of the file.

    Raises InputError as `drawn_places` does.
    """
    sources, _, each = drawn_places(description, draws, seed)
    return [_values(sources, place) for place in each]


def _known(sources: tuple[Source, ...]) -> tuple[Source, ...]:
    if not sources:
        raise InputError("all of it is known exactly: give numbers a spread, as in young: 1.2 +- 0.1 MPa.")
    return sources


def _values(sources: Sequence[Source], place: Float[np.ndarray, "p"]) -> dict[str, float]:
    """Values by path at one place of all sources."""
    each = (source.at(x) for source, x in zip(sources, place.tolist(), strict=True))
    return {path: value for own in each for path, value in own.items()}


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

    @cached_property
    def found(self) -> Bool[np.ndarray, "k"]:
        """Draws that count: solved, without that of the file."""
        good = [status in {one.name for one in _FOUND} for status in self.status]
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
        found = xr.Dataset(
            data, coords=coords, attrs={"title": self.title, "provenance": json.dumps(provenance(dict(settings or {})))}
        )
        for name in self.series:
            found[name].attrs["units"] = "s" if name == "time" else "m/s"
        return found


def spread(
    robot: RobotLike,
    verb: Literal["simulate", "steady", "periodic"] = "periodic",
    settings: Iterable[str] = (),
    *,
    draws: int | None = None,
    seed: int = 1,
    folder: Path | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    **options: Any,
) -> Draws | None:
    """Numbers of a run in many draws of what is not known exactly of a robot: see the top of this file.

    - verb, options: what is run, with its own options: `spread("tuna", "simulate", time=4.0)`.
    - draws: how many, beside the robot of the file itself; 40 unless given, more where more is not known exactly.
    - folder: finished draws are kept there: the same call goes on from them after it was killed.
    - progress(what, share): the run is cancelled where it returns False, and None is returned.
    - workers: threads of this process; one a processor unless given. executor: where it is computed instead.

    Raises InputError for values that make no sense, for a robot of which all is known exactly, and where the robot of
    the file itself has no such run.
    """
    check_whole(seed, "seed", 0)
    if verb not in _VERBS:
        raise InputError(f'"{verb}" is no verb with a spread. Take simulate, steady or periodic.', field="verb")
    description = description_of(robot, settings)
    filled = with_left_open(description)
    draws = max(DRAWS, len(_known(sources_of(filled))) + _MORE) if draws is None else draws
    check_whole(draws, "draws", LEAST_DRAWS)
    sources, correlations, each = drawn_places(filled, draws, seed)
    robots = [changed(filled, _values(sources, place)) for place in each]
    request = {"verb": verb, "draws": draws, "seed": seed, **options}
    try:
        json.dumps(request)
    except TypeError:
        raise InputError("takes plain options only: numbers and words.", field="options") from None
    key = hashlib.sha256(json.dumps([provenance(request)["nectosome"], dump_robot(description), request]).encode())
    through = nullcontext(executor) if executor else ThreadPoolExecutor(workers or processors())
    with Parts(folder, key.hexdigest()) as kept, through as pool:
        first = kept.computed([(0, _drawn, (verb, robots[0], options, True))], "the robot of the file", progress, pool)
        calls = [(k, _drawn, (verb, one, options, False)) for k, one in enumerate(robots) if k]
        found = first and first | kept.computed(calls, f"{draws} draws", progress, pool)
    if len(found) < len(robots):
        return None
    return _joined(verb, description, (sources, correlations, each), [_read(found[k]) for k in range(len(robots))])


def _drawn(verb: str, description: RobotDescription, options: Mapping[str, Any], first: bool) -> Part:
    """What a verb gives of one robot, as it is kept. Raises InputError of the first draw only."""
    try:
        check_numbers(description)
        run = _VERBS[verb](build(description), **options)
    except InputError:
        if first:
            raise
        return _written({"status": _REFUSED, "numbers": []}, {})
    status = Status(int(run.status))
    numbers, series = list[Any](), dict[str, np.ndarray]()
    if status in _FOUND:
        page = run.summary()
        numbers = [
            (
                table.key,
                next(iter(table.columns.values())),
                ", ".join(filter(None, (name, head))),
                cell.unit,
                cell.value,
            )
            for table in page.tables
            for name, head, cell in table.numbers()
            if np.isfinite(cell.value)
        ]
        series = {} if verb == "steady" else {"time": np.asarray(run.value.time)}
        series |= {name.replace(".", "_"): np.asarray(reading(run, name)) for name in _SERIES if series}
    elif first:
        raise InputError(f"{description.name}: {status.reason}. The robot of the file itself needs such a run.")
    return _written({"status": status.name, "numbers": numbers}, series)


def _written(head: dict[str, Any], series: Mapping[str, np.ndarray]) -> Part:
    """A draw as arrays."""
    return {"head": np.frombuffer(json.dumps(head).encode(), dtype=np.uint8), **series}


def _read(part: Part) -> tuple[str, dict[Key, float], dict[str, np.ndarray]]:
    """Status, numbers and series of a draw; a number that stands on a page twice has the first of its places."""
    head = json.loads(part["head"].tobytes())
    numbers = dict[Key, float]()
    for *key, value in head["numbers"]:
        numbers.setdefault(Key(*key), value)
    return head["status"], numbers, {name: x for name, x in part.items() if name != "head"}


def _joined(
    verb: str,
    description: RobotDescription,
    drawn: tuple[tuple[Source, ...], Float[np.ndarray, "p p"], Float[np.ndarray, "k p"]],
    read: list[tuple[str, dict[Key, float], dict[str, np.ndarray]]],
) -> Draws:
    """All draws; numbers of the file's robot that most of them have, and that are not 0 in all of these."""
    solved = [numbers for _, numbers, _ in read[1:] if numbers]
    often = [key for key in read[0][1] if sum(key in numbers for numbers in solved) >= _MOSTLY * max(len(solved), 1)]
    kept = tuple(key for key in often if any(numbers.get(key) for _, numbers, _ in read))
    values = np.array([[numbers.get(key, np.nan) for key in kept] for _, numbers, _ in read])
    first = read[0][2]
    blank = {name: np.full(x.shape, np.nan) for name, x in first.items()}
    series = {name: np.stack([own.get(name, blank[name]) for *_, own in read]) for name in first if name != "time"}
    series |= {"time": first["time"]} if first else {}
    title = f"{description.name}: {_TITLES[verb]}, {100 * (HIGH - LOW):.0f} % intervals"
    return Draws(title, *drawn, tuple(status for status, *_ in read), kept, values, series)


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
    return np.where(low < high, np.where(low * high > 0, near, far), ends)


def _ends(rows: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "2 n"]:
    """The quantiles of columns at both ends, of the numbers that there are."""
    if not rows.size:
        return np.full((2, rows.shape[1]), np.nan)
    return np.nanquantile(rows, [LOW, HIGH], axis=0, method="median_unbiased")
