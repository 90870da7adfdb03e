"""Which loads of a robot have numbers of the flow, in rows, and where they leave the ranges of their models."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from nectosome.description import LoadDescription, RobotDescription
from nectosome.description.ranges import NUMBERS
from nectosome.units import count

_MOST = 12  # rows, of single parts
_SMALL = 0.01  # of the largest power and force of a load on a part: what has less of both hardly matters


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
        for part, limb in description.parts.items()
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
    found = dict[tuple[str, str], list[tuple[float, str, str]]]()
    for one in loads_of_water(arrays, description) if "flow_number" in arrays else ():
        off = [end for end in one.load.own_ranges if not end.holds(one.numbers[end.number])]
        if not off or one.share < _SMALL:
            continue
        end, value = off[0], one.numbers[off[0].number]
        words = f"the {NUMBERS[end.number]} is {_shown(value)}, its model is made for {end.words}: {end.beyond}"
        with np.errstate(divide="ignore"):  # of 0
            farthest = abs(np.log(value / (end.low if value < end.low else end.high)))
        found.setdefault((one.load.kind, one.name), []).append((float(farthest), one.part, words))
    sentences = list[str]()
    for (_, name), each in found.items():
        _, part, words = max(each)
        others = f" and {count(len(each) - 1, 'other part')}" if len(each) > 1 else ""
        sentences.append(f"{name.replace('_', ' ')} on {part}{others}: {words}")
    return sentences


def _shown(value: float) -> str:
    """A number of the flow in two digits, as people write it."""
    if np.isinf(value):
        return "infinite"
    return f"{value:.2g}" if value < 1e5 else f"{value:.1e}".replace("e+0", "e")
