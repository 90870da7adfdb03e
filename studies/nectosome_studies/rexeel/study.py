"""The study of RExEel: its recorded swims, predicted from what its motors were told, and from what they did."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from nectosome.description import RobotDescription
from nectosome.robots import describe

from ..study import Progress, StudyPart, printed, score
from .actuation import FITTED, IdentifiedMotors, identified, through, to_dataset
from .errors import TIMES, RmsErrors, as_the_authors, errors
from .figures import panels
from .recordings import AMPLITUDES, FRAME, RecordedSwims, commanded, logged, recorded
from .swim import SAMPLES, Motion, PredictedSwim, at_frames, links, motion, swim
from .tables import WORDS
from .water import CHANGES

__all__ = ["panels", "part"]

NAME = "rexeel"
_COMPARED = {"distance": "m", "speed": "m/s", "yaw_swing": "deg"}
_TOLERANCE = 10.0  # percent


def part(quick: bool, progress: Progress) -> StudyPart:
    """All rows; there is nothing to shorten."""
    del quick
    robot = describe(NAME)
    measured = [recorded(amplitude) for amplitude in AMPLITUDES]
    asked = [commanded(amplitude, SAMPLES) for amplitude in AMPLITUDES]
    share = 1 / (4 + len(CHANGES))
    progress("swims, commanded angles", 0.0)
    swum = {"commanded": _swims(robot, asked)}
    again = _swims(robot, asked)  # the first has compiled it
    progress("swims, logged angles", 2 * share)
    swum["logged"] = _swims(robot, [logged(one, SAMPLES) for one in measured])
    progress("swims, angles of identified motors", 3 * share)
    motors = identified(measured[AMPLITUDES.index(FITTED)])
    swum["identified"] = _swims(robot, [through(motors, amplitude, SAMPLES) for amplitude in AMPLITUDES])
    others: dict[str, list[PredictedSwim]] = {}
    for k, (name, change) in enumerate(CHANGES.items(), start=4):
        progress(f"other water: {change.what}", k * share)
        others[name] = [swim(change.at(robot, a), angles) for a, angles in zip(AMPLITUDES, asked, strict=True)]

    swims, pieces = _dataset(robot, measured, swum), _pieces(robot, measured, others)
    numbers = _numbers(swims, pieces) | {f"{NAME}/wall-time": max(one.seconds for one in again)}
    numbers |= _motor_numbers(motors)
    runs = {f"{k}deg": _saved(one, k) for k, one in zip(AMPLITUDES, swum["commanded"], strict=True)}
    data = {"swims": swims, "pieces": pieces, "motors": to_dataset(motors, measured)}
    return StudyPart(numbers, data, runs, _measured_rows(swims))


def _swims(robot: RobotDescription, angles: Sequence[np.ndarray]) -> list[PredictedSwim]:
    return [swim(robot, one) for one in angles]


def _saved(one: PredictedSwim, amplitude: int) -> xr.Dataset:
    """A run for the report."""
    made = one.run.to_dataset({"amplitude": f"{amplitude} deg", "angles": "commanded"})
    made.attrs["label"] = f"RExEel, {amplitude} deg"
    return made


def _compared(motions: Sequence[Motion]) -> dict[str, np.ndarray]:
    """Numbers of motions by name, in the units of `_COMPARED`."""
    distance, speed, yaw_swing = (np.array([*map(np.asarray, column)]) for column in zip(*motions, strict=True))
    return {"distance": distance, "speed": speed, "yaw_swing": np.rad2deg(yaw_swing)}


def _errors(robot: RobotDescription, measured: Sequence[RecordedSwims], ours: Sequence[PredictedSwim]) -> np.ndarray:
    """The authors' table (amplitude, quantity) in m and deg."""
    found = [
        errors(one.track, as_the_authors(theirs), links(robot)) for one, theirs in zip(ours, measured, strict=True)
    ]
    return np.array(found) * [1, 1, 1, 1, np.rad2deg(1)]


def _dataset(
    robot: RobotDescription, measured: Sequence[RecordedSwims], swum: dict[str, list[PredictedSwim]]
) -> xr.Dataset:
    """Tracks and numbers, measured (amplitude, swim) and ours (angles, amplitude); absent swims are nan."""
    most = max(len(one.x) for one in measured)

    def filled(values: np.ndarray) -> np.ndarray:
        gap = [(0, most - len(values)), *[(0, 0)] * (values.ndim - 1)]
        return np.pad(values.astype(float), gap, constant_values=np.nan)

    theirs = [_compared([motion(one.time, one.x, one.y, one.yaw)]) for one in measured]
    table: dict[str, Any] = {
        f"measured_{name}": (("amplitude", "swim"), [filled(one[name][0]) for one in theirs], {"units": unit})
        for name, unit in _COMPARED.items()
    }
    for name, unit in (("x", "m"), ("y", "m"), ("yaw", "rad")):
        tracks = [filled(getattr(one, name)) for one in measured]
        table[f"measured_{name}"] = (("amplitude", "swim", "frame"), tracks, {"units": unit})
        ours = [[getattr(one.track, name) for one in swims] for swims in swum.values()]
        table[name] = (("angles", "amplitude", "time"), ours, {"units": unit})
    found = [_compared([motion(*at_frames(one.track)) for one in swims]) for swims in swum.values()]
    for name, unit in _COMPARED.items():
        table[name] = (("angles", "amplitude"), [one[name] for one in found], {"units": unit})
    table["error"] = (("angles", "amplitude", "quantity"), [_errors(robot, measured, x) for x in swum.values()])
    book = printed(NAME)
    codes = [
        [[book[_error_row(k, quantity)][code] for quantity in RmsErrors._fields] for k in AMPLITUDES]
        for code in ("printed", "genesis")
    ]
    table["printed_error"] = (("code", "amplitude", "quantity"), codes)
    return xr.Dataset(
        table,
        coords={
            "amplitude": ("amplitude", [*AMPLITUDES], {"units": "deg"}),
            "angles": [*swum],
            "time": ("time", TIMES, {"units": "s"}),
            "frame": ("frame", FRAME * np.arange(measured[0].time.size), {"units": "s"}),
            "quantity": [*RmsErrors._fields],
            "code": ["Navier-Stokes", "Genesis"],
        },
    )


def _pieces(
    robot: RobotDescription, measured: Sequence[RecordedSwims], others: dict[str, list[PredictedSwim]]
) -> xr.Dataset:
    """Numbers (piece, amplitude) of swims in other water, by the commanded angles."""
    found = [_compared([motion(*at_frames(one.track)) for one in swims]) for swims in others.values()]
    along = [_errors(robot, measured, swims)[:, 1] for swims in others.values()]
    return xr.Dataset(
        {n: (("piece", "amplitude"), [one[n] for one in found], {"units": u}) for n, u in _COMPARED.items()}
        | {"error_along": (("piece", "amplitude"), along, {"units": "m"})},
        coords={
            "piece": [*others],
            "what": ("piece", [CHANGES[name].what for name in others]),
            "amplitude": ("amplitude", [*AMPLITUDES], {"units": "deg"}),
        },
    )


def _error_row(amplitude: int, quantity: str) -> str:
    return f"{NAME}/{amplitude}deg/rmse-{quantity.replace('_', '-')}"


def _numbers(swims: xr.Dataset, pieces: xr.Dataset) -> dict[str, float | None]:
    """Numbers of the book's rows."""
    ours = swims.sel(angles="commanded")
    numbers: dict[str, float | None] = {
        _error_row(k, q): float(ours["error"].sel(amplitude=k, quantity=q))
        for k in AMPLITUDES
        for q in RmsErrors._fields
    }
    numbers[f"{NAME}/rmse-along/mean"] = float(ours["error"].sel(quantity="along").mean())
    change = 100 * (pieces["distance"] / ours["distance"] - 1).mean("amplitude")
    return numbers | {f"{NAME}/change/{name}": float(change.sel(piece=name)) for name in CHANGES}


def _motor_numbers(motors: IdentifiedMotors) -> dict[str, float | None]:
    """Of the motors' own rows: means over the five."""
    return {f"{NAME}/motors/gain": float(np.mean(motors.gain)), f"{NAME}/motors/lag": float(np.mean(motors.lag))}


def _measured_rows(swims: xr.Dataset) -> list[dict[str, Any]]:
    """What was measured beside ours by the commanded angles, by amplitude and quantity.

    The other angles are no other facts: they change distances and speeds by 2 %, and stand on the page on RExEel.
    """
    rows = []
    for k in AMPLITUDES:
        for name, unit in _COMPARED.items():
            theirs = swims[f"measured_{name}"].sel(amplitude=k).dropna("swim")
            entry = {
                "quantity": f"RExEel at {k} deg: {WORDS[name]}",
                "unit": unit,
                "kind": "prediction",
                "source": "measured",
                "printed": float(theirs.mean()),
                "tolerance": _TOLERANCE,
                "note": f"{theirs.sizes['swim']} swims, standard deviation {float(theirs.std(ddof=1)):.3g} {unit}.",
            }
            ours = float(swims[name].sel(amplitude=k, angles="commanded"))
            rows.append(score(f"{NAME}/{k}deg/{name.replace('_', '-')}", entry, ours))
    return rows
