"""Intervals of predictions: a run again and again, each time with other values of what is not known exactly.

What is not known are the `Source`s of a robot. Each draw takes a place of all of them at once, in a Latin hypercube
(McKay, Beckman and Conover 1979), so that few draws cover all. What they say stands in `Draws`.

Draws are computed one by one in threads, not as one batch: there each takes both sides of every branch of an implicit
step, and as long as the slowest. Eight of them took 1.7 times the processor time of one by one as steady motions of the
flagellum, 5 times as cycles of a soft tail, 12 times as those of the tuna.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Float

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
from nectosome.units import InputError, check_whole

from .kept_parts import Part, Parts, Progress
from .prediction_intervals import FOUND, HIGH, LOW, Draws, Key

DRAWS = 40
LEAST_DRAWS, MOST_DRAWS = 8, 10_000
_MORE = 10  # draws than sources at least, unless told otherwise: so a linear fit has something left over
_TITLES = {"simulate": "simulation", "steady": "steady motion", "periodic": "periodic motion"}
_VERBS = {"simulate": simulate, "steady": steady, "periodic": periodic}
_REFUSED = "REFUSED"  # by the verb, with a sentence
_MOSTLY = 0.9  # of the draws in which a number must be there
_SERIES = ("velocity.x", "velocity.y", "velocity.z")


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


def usual_draws(description: RobotDescription) -> int:
    """How many draws tell what makes numbers wide, where all is filled in. Raises InputError as `drawn_places` does."""
    return max(DRAWS, len(_known(sources_of(description))) + _MORE)


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
    draws = usual_draws(filled) if draws is None else draws
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
        return _written({"status": _REFUSED, "numbers": [], "cautions": []}, {})
    status = Status(int(run.status))
    numbers, series, cautions = list[Any](), dict[str, np.ndarray](), list[str]()
    if status in FOUND:
        page = run.summary()
        cautions = [*page.cautions]
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
    return _written({"status": status.name, "numbers": numbers, "cautions": cautions}, series)


def _written(head: dict[str, Any], series: Mapping[str, np.ndarray]) -> Part:
    """A draw as arrays."""
    return {"head": np.frombuffer(json.dumps(head).encode(), dtype=np.uint8), **series}


class _Draw(NamedTuple):
    """What is known of a draw."""

    status: str
    numbers: Mapping[Key, float]
    series: Mapping[str, np.ndarray]
    cautions: Sequence[str]


def _read(part: Part) -> _Draw:
    """A draw as it was kept; a number that stands on a page twice has the first of its places."""
    head = json.loads(part["head"].tobytes())
    numbers = dict[Key, float]()
    for *key, value in head["numbers"]:
        numbers.setdefault(Key(*key), value)
    return _Draw(head["status"], numbers, {name: x for name, x in part.items() if name != "head"}, head["cautions"])


def _joined(
    verb: str,
    description: RobotDescription,
    drawn: tuple[tuple[Source, ...], Float[np.ndarray, "p p"], Float[np.ndarray, "k p"]],
    read: list[_Draw],
) -> Draws:
    """All draws; numbers of the file's robot that most of them have, and that are not 0 in all of these."""
    solved = [one.numbers for one in read[1:] if one.numbers]
    first = read[0]
    often = [key for key in first.numbers if sum(key in one for one in solved) >= _MOSTLY * max(len(solved), 1)]
    kept = tuple(key for key in often if any(one.numbers.get(key) for one in read))
    values = np.array([[one.numbers.get(key, np.nan) for key in kept] for one in read])
    blank = {name: np.full(x.shape, np.nan) for name, x in first.series.items()}
    series = {name: np.stack([one.series.get(name, x) for one in read]) for name, x in blank.items() if name != "time"}
    series |= {"time": first.series["time"]} if first.series else {}
    title = f"{description.name}: {_TITLES[verb]}, {100 * (HIGH - LOW):.0f} % intervals"
    return Draws(title, *drawn, tuple(one.status for one in read), kept, values, series, tuple(first.cautions))
