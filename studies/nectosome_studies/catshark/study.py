"""The study of the catsharks: each swim of the table again, by every reading of its wavelengths; nothing is fitted."""

from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float

from nectosome.mechanism import SoftRod
from nectosome.model import build
from nectosome.robots import describe

from ..study import Progress, StudyPart, score
from ..undulation import Swims, swims, with_plate_friction
from .midline import VISCOSITY, SwimTable, table, wavelengths, waves

NAME = "catshark"
_MAIN = "points"
_QUICK = "catshark2"  # the one whose swims are computed
_TOLERANCE = 10.0  # percent, of medians at a speed
_CHANGES: dict[str, dict[str, Any]] = {
    "friction": {"plate": 3.25e4},  # of the one at 1.5 lengths a second
    "envelope": {"power": 1},
    "tail": {"settings": ("body.tip_height=14mm",)},
    "cross": {"settings": ("body.loads.cross.normal=0",)},
}


def part(quick: bool, progress: Progress) -> StudyPart:
    """All swims by all readings, and what assumptions change; `quick` takes those of one specimen."""
    measured = table(_QUICK if quick else None)
    read = wavelengths(measured)
    share = 1 / (len(read) + len(_CHANGES))
    found: dict[str, Swims] = {}
    for k, (name, wavelength) in enumerate(read.items()):
        progress(f"wavelength: {name}", k * share)
        found[name] = swum(measured, wavelength)
    numbers: dict[str, float | None] = {}
    for k, (name, how) in enumerate(_CHANGES.items(), start=len(read)):
        progress(f"other assumptions: {name}", k * share)
        other = swum(measured, read[_MAIN], **how)
        numbers[f"{NAME}/change/{name}"] = 100 * float(np.median(other.speed / found[_MAIN].speed) - 1)
    data = _dataset(measured, read, found)
    for name in read:
        numbers |= _summary(data.sel(reading=name), name)
    return StudyPart(numbers, {"swims": data}, rows=_by_class(data.sel(reading=_MAIN)))


def swum(
    measured: SwimTable,
    wavelength: Float[np.ndarray, "n"],
    power: int = 2,
    plate: float | None = None,
    settings: tuple[str, ...] = (),
) -> Swims:
    """Swims of the table by wavelengths [L]: the robot `catshark` with the waves of its rows, each at the Reynolds
    number of its own length; with the friction of a plate at the Reynolds number `plate`."""
    described = describe("catshark", settings)
    robot = build(described if plate is None else with_plate_friction(described, plate))
    body = robot.tree.parts[0].body
    assert isinstance(body, SoftRod)
    made = waves(body.nq - 1, measured.frequency, measured.head, measured.tail, wavelength, power)
    scale = float(robot.water.density) * (float(body.length) / measured.length) ** 2
    return swims(robot, made, VISCOSITY * scale)


def _dataset(measured: SwimTable, read: dict[str, Float[np.ndarray, "n"]], found: dict[str, Swims]) -> xr.Dataset:
    """Measured (swim) and computed (reading, swim) numbers, in body lengths and seconds."""
    unit = {"speed": "1/s", "strouhal": "", "head": "", "tail": "", "wavelength": "", "frequency": "Hz"}
    ours = {name: [getattr(one, name) for one in found.values()] for name in ("speed", "head", "tail", "change")}
    ours |= {
        "wavelength": [*read.values()],
        "strouhal": [measured.frequency * one.tail / one.speed for one in found.values()],
    }
    theirs = {name: getattr(measured, name) for name in ("frequency", "speed", "head", "tail", "strouhal")}
    return xr.Dataset(
        {name: (("reading", "swim"), np.stack(each), {"units": unit.get(name, "1")}) for name, each in ours.items()}
        | {f"measured_{name}": ("swim", x, {"units": unit[name]}) for name, x in theirs.items()},
        coords={
            "reading": [*read],
            "specimen": ("swim", measured.specimen.astype(str)),
            "speed_class": ("swim", measured.speed_class),
        },
    )


def _summary(one: xr.Dataset, name: str) -> dict[str, float]:
    """Numbers by scorecard row of one reading."""
    speed, strouhal = (100 * (one[x] / one[f"measured_{x}"] - 1).values for x in ("speed", "strouhal"))
    slow = (one["measured_speed"] > one["measured_frequency"] * one["wavelength"]).values
    numbers = {
        "speed-error": np.median(speed),
        "strouhal-error": np.median(strouhal),
        "slow-wave": 100 * np.mean(slow),
    }
    if name == _MAIN:
        numbers["speed-error-fast-wave"] = np.median(speed[~slow])
        numbers |= {end: np.median(one[end] / one[f"measured_{end}"]) for end in ("tail", "head")}
    return {f"{NAME}/{name}/{key}": float(x) for key, x in numbers.items()}


def _by_class(one: xr.Dataset) -> list[dict[str, Any]]:
    """Median speeds at each speed of the flume, measured and computed; Strouhal numbers follow from them."""
    rows = []
    for speed_class, group in one.groupby("speed_class"):
        theirs = group["measured_speed"]
        low, high = (100 * float((group["speed"] / theirs - 1).quantile(q)) for q in (0.0, 1.0))
        entry = {
            "quantity": f"median speed of catsharks with the flume at {speed_class:g} body lengths a second",
            "unit": "L/s",
            "kind": "prediction",
            "source": "measured",
            "printed": float(theirs.median()),
            "tolerance": _TOLERANCE,
            "note": f"{group.sizes['swim']} swims, single errors from {low:+.0f} to {high:+.0f} %.",
        }
        rows.append(score(f"{NAME}/speed/{speed_class:g}", entry, float(group["speed"].median())))
    return rows
