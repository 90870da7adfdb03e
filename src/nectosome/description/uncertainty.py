"""What of a robot is not known exactly: numbers that its file gives with +-, and those that nobody knows well.

A number that a file gives with a spread, `1.2 +- 0.1 MPa`, has that one. Of the others, coefficients of the water,
stiffnesses and losses have the spread of their class (`Described.spreads`); sizes, masses and drives are taken as they
are given. One source stands for all numbers that are off together.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from pydantic import BaseModel

from nectosome.description.loads import LoadDescription
from nectosome.description.robot import RobotDescription, resolve
from nectosome.io.schema.described import Described, Uncertainty
from nectosome.io.schema.quantity import Quantity, Uncertain
from nectosome.io.schema.structure import items, numeric_paths, shortest
from nectosome.units import InputError, show_quantity

SIGMAS = 1.959963984540054
"""Standard deviations from the middle of a normal distribution to the end of its 95 % interval."""
_ROUNDING = 1e-5  # of an eigenvalue, by six digits of correlations
STATED = "given in the file"
_DRY = ("leg", "tendon", "chamber", "muscle", "force", "distributed_force", "wall_contact")  # loads not of the water
_MEASURE = "measure it, or fit it by identify"


@dataclass(frozen=True)
class Source:
    """Numbers that are off together: by a factor exp(down x) for x < 0 and exp(up x) for x > 0, or by `shift` x.

    x is normal, with mean 0 and standard deviation 1. So the numbers of the file are the medians. What their fields do
    not allow is not drawn: the tails end there.
    """

    name: str
    values: dict[str, float]  # by path [SI]
    down: float
    up: float
    shift: float  # [SI]; 0 where they are off by a factor
    why: str  # where the spread comes from
    experiment: str  # what tells it better
    dimension: str  # of its numbers, a key of `DIMENSIONS`
    of_water: bool  # whether they are of a load of the water
    least: float  # that its numbers may have [SI]
    most: float

    @property
    def range_text(self) -> str:
        """The 95 % interval, as in "-35 to +50 %", or in the unit of its numbers."""
        if self.shift:
            return f"+- {show_quantity(SIGMAS * self.shift, self.dimension)}"
        low, high = (100 * math.expm1(width * SIGMAS) for width in (-self.down, self.up))
        return f"{low:+.3g} to {high:+.3g} %"

    def at(self, x: float) -> dict[str, float]:
        """Values of its numbers, by path [SI]."""
        factor = math.exp((self.up if x > 0 else self.down) * x)
        if not self.shift:
            return {path: self._allowed(value * factor) for path, value in self.values.items()}
        shifts = {path: math.copysign(self.shift * x, value * x) for path, value in self.values.items()}
        return {path: self._allowed(value + shifts[path]) for path, value in self.values.items()}

    def _allowed(self, value: float) -> float:
        return min(max(value, self.least), self.most)


def sources_of(description: RobotDescription) -> tuple[Source, ...]:
    """Return what is not known exactly of a robot, in the order of its file.

    A coefficient of one kind of load is one source, whichever parts have it: its law is off alike. Equal stiffnesses
    and losses of parts are one too, and equal numbers with equal spreads, unless these are of `each`.
    """
    groups: dict[Any, list[tuple[str, float]]] = {}
    wet = dict[Any, bool]()
    spreads: dict[Any, Uncertainty | None] = {}
    known = numeric_paths(description)
    together_in = {path: name for name, paths in description.number_aliases.items() for path in paths if len(paths) > 1}
    for path, value, group, field, load in _numbers(description):
        if path not in known:
            continue
        row = field.partition(".")[0]
        spread = group.spreads.get(row)
        if isinstance(value, Uncertain):
            size = tuple(f"{x:.6g}" for x in (abs(float(value)), value.plus_minus))  # turned copies have rounding
            alike = path if value.each else (together_in.get(path, field), *size)
        elif spread is None or value == 0:
            continue
        else:
            alike = (load, row) if load else (type(group), row, abs(value))
        groups.setdefault(alike, []).append((path, value))
        spreads[alike] = spread
        wet[alike] = bool(load) and load.partition(" ")[0] not in _DRY
    named = {frozenset(paths): name for name, paths in description.number_aliases.items()}
    short = shortest(rows[0][0] for rows in groups.values())

    def name(alike: Any, paths: list[str]) -> str:
        if isinstance(alike, tuple) and len(alike) == 2:
            return " ".join(alike)
        alone = paths[0].removeprefix("limbs.") if len(paths) == 1 else short[paths[0]]
        return named.get(frozenset(paths), alone)

    return tuple(
        _source(name(alike, [path for path, _ in rows]), rows, spreads[alike], known[rows[0][0]], wet=wet[alike])
        for alike, rows in groups.items()
    )


def together(description: RobotDescription, sources: Sequence[Source]) -> Float[np.ndarray, "p p"]:
    """Correlations of the places of sources: those that the file says of numbers with +-, else 0.

    Raises InputError where no numbers can have all of them.
    """
    matrix = np.eye(len(sources))
    for pair in description.correlations:
        paths = [resolve(description, name)[0] for name in pair.between]
        at = [k for path in paths for k, source in enumerate(sources) if path in source.values and source.why == STATED]
        if len(at) == 2 and at[0] != at[1]:  # others are told by `idle_correlations`
            # a place moves the size of what is off by a shift
            of = [(sources[k], path) for k, path in zip(at, paths, strict=True)]
            signs = [math.copysign(1.0, one.values[path]) for one, path in of if one.shift]
            matrix[at[0], at[1]] = matrix[at[1], at[0]] = math.prod(signs, start=pair.value)
    if np.linalg.eigvalsh(matrix).min(initial=1.0) < -_ROUNDING:
        raise InputError("no numbers have all these correlations: one of them must be smaller.", field="correlations")
    return matrix


def law_of(description: RobotDescription, path: str) -> float:
    """By how much the law of a number is off however well that is measured: standard deviation of the logarithm."""
    for own, _, group, field, _ in _numbers(description):
        spread = group.spreads.get(field.partition(".")[0]) if own == path else None
        if spread is not None:
            return spread.law
    return 0.0


def idle_correlations(description: RobotDescription) -> list[tuple[str, str]]:
    """Correlations that do nothing, by path, each with why: of numbers without a spread, or that are off as one."""
    sources, out = sources_of(description), list[tuple[str, str]]()
    stated = {path: k for k, source in enumerate(sources) if source.why == STATED for path in source.values}
    for k, pair in enumerate(description.correlations):
        at = {name: stated.get(resolve(description, name)[0]) for name in pair.between}
        exact = " and ".join(name for name, source in at.items() if source is None)
        if exact:
            why = f"no spread is given of {exact}. Give one, as in 1.2 +- 0.1"
        elif len({*at.values()}) == 1:
            why = f"{' and '.join(at)} have the same value and spread, so they are off as one. Write each behind both"
        else:
            continue
        out.append((f"correlations.{k}", f"does nothing: {why}, or leave it out."))
    return out


def _source(
    name: str, rows: list[tuple[str, float]], spread: Uncertainty | None, quantity: Quantity, *, wet: bool
) -> Source:
    values = {path: float(value) for path, value in rows}
    least = -math.inf if quantity.minimum is None else quantity.minimum
    most = math.inf if quantity.maximum is None else quantity.maximum
    first = rows[0][1]
    if not isinstance(first, Uncertain):
        assert spread is not None
        told = (quantity.dimension, wet, least, most)
        low, high = spread.low, spread.high
        if spread.absolute:
            low, high = min(low / first, 1.0), max(high / first, 1.0)
        down, up = -math.log(low) / SIGMAS, math.log(high) / SIGMAS
        return Source(name, values, down, up, 0.0, spread.source, spread.experiment, *told)
    if quantity.scales(first):
        width = math.log1p(first.plus_minus / first) / SIGMAS
        return Source(name, values, width, width, 0.0, STATED, _MEASURE, quantity.dimension, wet, least, most)
    shift = first.plus_minus / SIGMAS
    return Source(name, values, 0.0, 0.0, shift, STATED, _MEASURE, quantity.dimension, wet, least, most)


def _numbers(description: RobotDescription) -> Iterator[tuple[str, Any, Described, str, str]]:
    """Yield path, value, the group around it, its path there, and the kind of its load, of all numbers."""

    def within(value: Any, path: str, group: Described, field: str, load: str) -> Iterator[Any]:
        if isinstance(value, LoadDescription):
            load = value.kind
        elif isinstance(value, Described) and load:
            load = f"{load} {field}"
        if isinstance(value, Described):
            group, field = value, ""
        if isinstance(value, BaseModel | dict | tuple):
            for key, item in items(value):
                inner = f"{field}.{key}" if field else key
                yield from within(item, f"{path}.{key}" if path else key, group, inner, load)
        elif isinstance(value, int | float):
            yield path, value, group, field, load

    yield from within(description, "", description, "", "")
