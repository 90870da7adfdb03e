r"""Dimensionless numbers of the flow about loads, which say whether their models hold.

Of each load on each part, over a cycle, the last whole beats of a run, or where nothing repeats the whole run:

- Reynolds number $\rho v l/\mu$, the largest along the part and over the time, with the length l that the load has,
- Keulegan-Carpenter number $2\pi a/h$ with the height h across the motion (Keulegan and Carpenter 1958): a is half of
  the range of the way through the water across the larger side, $\int (v - \bar v)\,dt$; there where $h U_m^2$, and
  with it drag, is largest along the part, with half of the range of v, $U_m$,
- reduced frequency $\omega c/2U$ (Theodorsen 1935) with the mean chord c, the mean velocity U ahead along the chord,
  and $\omega = U_m/a$ of the motion across it, so that it is the load's own frequency, not that of the whole robot;
  infinite where U is not above a thousandth of the largest speed,
- share of the time, and of the sections, beyond the angle of stall; aspect ratio,
- formation number of a jet (Gharib et al. 1998): its length over the diameter of its opening in a beat, $\int u/D\,dt$
  while it goes out (Dabiri and Gharib 2005).

Between two times of what repeats itself a velocity is a parabola (`CyclicCurve`): integrals are of the fourth order of
the time between them, and largest values are not those at the times alone. NaN where a number is not defined, and of
what is slower than 1e-6 m/s, which no simulation resolves.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Flow, Load
from nectosome.core.cyclic_curve import CyclicCurve
from nectosome.description import LoadDescription, RobotDescription
from nectosome.description.ranges import NUMBERS
from nectosome.mechanism import Robot, load_names
from nectosome.units import count

_RESTS = 1e-6  # m/s
_HOVERS = 1e-3  # of the largest speed
_MOST = 12  # rows, of single parts
_SMALL = 0.01  # of the largest power and force of a load on a part: what has less of both hardly matters


def has_flow_numbers(robot: Robot) -> bool:
    """Whether any load of a robot has such numbers."""
    return any(type(g.load).flow is not Load.flow for g in robot.load_groups.on_bodies)


def flow_numbers(
    robot: Robot, time: Any, flows: Sequence[Flow | None], weights: Any, period: Any
) -> Float[Array, "numbers loads parts"] | Float[np.ndarray, "numbers loads parts"]:
    """The numbers in the order of `NUMBERS`, of the `flows` of a diagnosis, leaves [n, ...]; NumPy's or those of JAX.

    `weights` [n] are those of means over the time. The first time comes again, as its next, a `period` [s] later;
    without one, None, nothing goes to and fro.
    """
    names, parts = load_names(robot), len(robot.tree.structure)
    columns, place = list[Any](), np.zeros((len(names), parts), int)
    xp: Any = np if isinstance(weights, np.ndarray) else weights.__array_namespace__()
    filled = 1
    for g, flow in zip(robot.load_groups.on_bodies, flows, strict=True):
        if flow is None:
            continue
        of_each = [len(here) for here in g.stations_of_each(robot.tree)] if g.load.by_station else [1] * len(g.members)
        owner = np.repeat(np.arange(len(g.members)), of_each)
        shape = next(x for x in flow if x is not None).shape
        owner = np.repeat(owner, shape[1] // owner.size)
        columns.append(_of_members(xp, flow, owner == np.arange(len(g.members))[:, None], robot, time, weights, period))
        place[[names.index(name) for name in g.names], g.parts] = filled + np.arange(len(g.members))
        filled += len(g.members)
    every = xp.concatenate([xp.full((len(NUMBERS), 1), np.nan), *columns], axis=1)
    return every[:, place]


def of_whole_run(pieces: Float[np.ndarray, "n numbers loads parts"]) -> Float[np.ndarray, "numbers loads parts"]:
    """The numbers of a run of which nothing repeats, by those of its pieces, whose weights are shares of the run."""
    found, reynolds = np.sum(pieces, axis=0), [*NUMBERS].index("reynolds")
    found[reynolds] = np.fmax.reduce(pieces[:, reynolds])
    return found


def _of_members(xp: Any, flow: Flow, own: np.ndarray, robot: Robot, time: Any, weights: Any, period: Any) -> Any:
    """The numbers of each load of a group, whose places are `own` [members, places]."""
    density, viscosity = xp.asarray(robot.water.density), xp.asarray(robot.water.viscosity)

    def largest(x: Any) -> Any:
        """Over the time, of each place."""
        return xp.max(x, axis=0) if period is None else CyclicCurve(xp, time, x, period).largest()

    def over_places(x: Any) -> Any:
        return xp.max(xp.where(own, x, -np.inf), axis=1)

    def mean(x: Any) -> Any:
        """Over the time and the places."""
        return xp.sum(xp.where(own, xp.sum(weights[:, None] * x, axis=0), 0.0), axis=1) / own.sum(axis=1)

    none = xp.full((own.shape[0],), np.nan)
    numbers = dict.fromkeys(NUMBERS, none)
    if flow.speed is not None and flow.length is not None:
        fastest = over_places(largest(flow.speed))
        reynolds = density / viscosity * over_places(largest(flow.speed * flow.length))
        numbers["reynolds"] = xp.where((fastest > _RESTS) & (reynolds > 0), reynolds, np.nan)
    if period is not None and flow.jet is not None:
        numbers["formation"] = period * mean(xp.maximum(flow.jet, 0.0))
    if period is not None and flow.across is not None:
        across = CyclicCurve(xp, time, flow.across - xp.sum(weights[:, None, None] * flow.across, axis=0), period)
        swing, amplitude = (xp.max(x, axis=-1) for x in (across.half_range(), across.half_way()))  # of both directions
        moves = swing > _RESTS
        if flow.height is not None:
            height = flow.height[0]
            pressed = over_places(swing**2 * height)
            there = own & (swing**2 * height >= pressed[:, None]) & moves & (height > 0)
            number = over_places(xp.where(there, 2 * np.pi * amplitude / xp.where(height > 0, height, 1.0), -np.inf))
            numbers["keulegan_carpenter"] = xp.where(xp.any(there, axis=1), number, np.nan)
        if flow.ahead is not None and flow.chord is not None:
            ahead, fastest = xp.abs(mean(flow.ahead)), over_places(largest(xp.abs(flow.ahead)))
            goes = ahead > _HOVERS * xp.maximum(fastest, over_places(swing))
            turning = over_places(swing) / over_places(xp.where(moves, amplitude, 1.0))
            number = turning * mean(flow.chord) / (2 * xp.where(goes, ahead, 1.0))
            oscillates = xp.any(own & moves, axis=1)
            numbers["reduced_frequency"] = xp.where(oscillates, xp.where(goes, number, np.inf), np.nan)
    if flow.stalled is not None:
        numbers["stalled"] = xp.clip(mean(flow.stalled), 0.0, 1.0)
    if flow.aspect_ratio is not None:
        numbers["aspect_ratio"] = mean(flow.aspect_ratio)
    return xp.stack([numbers[name] for name in NUMBERS])


class LoadOfWater(NamedTuple):
    """A load with ranges, and the numbers of the flow about it."""

    name: str
    part: str
    load: LoadDescription
    numbers: dict[str, float]
    share: float  # mean power or mean force over the largest one of such a load on a part, the larger of both


def loads_of_water(arrays: Mapping[str, np.ndarray], description: RobotDescription) -> Iterator[LoadOfWater]:
    """All loads of a robot with ranges.

    `arrays` are those of results, with the mean `load_power` [load, part] and `load_force` [load, part, axis].
    """
    loads, parts = ([*map(str, arrays[dim])] for dim in ("load", "part"))
    known = [
        (name, part, load, loads.index(name), parts.index(part))
        for part, limb in description.carriers.items()
        for name, load in limb.loads.items()
        if load.own_ranges and name in loads and part in parts
    ]
    here = [i for *_, i, _ in known], [k for *_, k in known]
    share = np.zeros(len(known))
    for sizes in (np.abs(arrays["load_power"][here]), np.linalg.norm(arrays["load_force"][here], axis=-1)):
        sizes = np.nan_to_num(sizes)
        share = np.maximum(share, sizes / max(float(sizes.max(initial=0.0)), np.finfo(float).tiny))
    for (name, part, load, i, k), size in zip(known, share, strict=True):
        numbers = dict(zip(NUMBERS, map(float, arrays["flow_number"][:, i, k]), strict=True))
        yield LoadOfWater(name, part, load, numbers, float(size))


class FlowRow(NamedTuple):
    """The largest numbers of the flow about a load on a part, or on several ones together."""

    name: str  # of the load
    where: str  # the part, or how many parts
    length: str  # of the Reynolds number
    numbers: dict[str, float]


def flow_rows(arrays: Mapping[str, np.ndarray], description: RobotDescription) -> list[FlowRow]:
    """The numbers of all loads that have some of the flow; of many those of one name and kind together."""
    every = list[LoadOfWater]()
    for one in loads_of_water(arrays, description):
        if any(x == x for key, x in one.numbers.items() if key != "aspect_ratio"):
            every.append(one)
    together = dict[tuple[str, str], list[LoadOfWater]]()
    for one in every:
        together.setdefault((one.name, one.load.kind if len(every) > _MOST else one.part), []).append(one)
    rows = list[FlowRow]()
    for some in together.values():
        first, where = some[0], count(len(some), "part") if len(some) > 1 else some[0].part
        known = {key: [one.numbers[key] for one in some if one.numbers[key] == one.numbers[key]] for key in NUMBERS}
        length = first.load.reynolds_length if known["reynolds"] else ""
        numbers = {key: max(values, default=np.nan) for key, values in known.items()}
        rows.append(FlowRow(first.name, where, length, numbers))
    return rows


def out_of_range(arrays: Mapping[str, np.ndarray], description: RobotDescription) -> list[str]:
    """A sentence for each load whose model leaves one of its ranges, with the number that is farthest out.

    One for all parts with a load of that kind and name; of loads with next to no power and force there is none.
    """
    beyond = dict[tuple[str, str], list[tuple[float, str, str]]]()
    for one in loads_of_water(arrays, description) if "flow_number" in arrays else ():
        off = [end for end in one.load.own_ranges if not end.holds(one.numbers[end.number])]
        if not off or one.share < _SMALL:
            continue
        end, value = off[0], one.numbers[off[0].number]
        words = f"the {NUMBERS[end.number]} is {_shown(value)}, its model is made for {end.words}: {end.beyond}"
        with np.errstate(divide="ignore"):  # of 0
            farthest = abs(np.log(value / (end.low if value < end.low else end.high)))
        beyond.setdefault((one.load.kind, one.name), []).append((float(farthest), one.part, words))
    sentences = list[str]()
    for (_, name), each in beyond.items():
        _, part, words = max(each, key=lambda one: float(f"{one[0]:.6g}"))  # the first of those that are alike
        others = f" and {count(len(each) - 1, 'other part')}" if len(each) > 1 else ""
        sentences.append(f"{name.replace('_', ' ')} on {part}{others}: {words}")
    return sentences


def _shown(value: float) -> str:
    """A number of the flow in two digits, as people write it."""
    if np.isinf(value):
        return "infinite"
    return f"{value:.2g}" if value < 1e5 else f"{value:.1e}".replace("e+0", "e")
