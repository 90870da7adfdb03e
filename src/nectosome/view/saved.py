"""Whether a results file is a saved run, and one that can be drawn, a saved sweep, or a comparison of controllers."""

import json
from contextlib import suppress

import numpy as np
import xarray as xr

from nectosome.core import Status
from nectosome.description import DIRECTIONS, RobotDescription, robot_of_run
from nectosome.description.own_rows import DRIVE
from nectosome.description.ranges import NUMBERS
from nectosome.designs.sweep import MEANS, MORE_MEANS
from nectosome.io.results import Contents, check_contents
from nectosome.solve.cycle_means import OF_A_CYCLE
from nectosome.solve.motor_results import MOTOR_VARIABLES
from nectosome.solve.results import TENDON_VARIABLES
from nectosome.solve.run_means import DIMENSIONS
from nectosome.units import InputError

_NEEDED = {
    "time": ("time",),
    "position": ("time", "station", "axis"),
    "rotation": ("time", "station", "row", "axis"),
    "station_x": ("station",),
    "half_width": ("station", "across"),
    "velocity": ("time", "part", "axis"),
    "load_force": ("time", "load", "part", "axis"),
    "load_power": ("time", "load", "part"),
    "reaction": ("time", "prescribed"),
    "reaction_power": ("time", "prescribed"),
    "energy": ("time", "form"),
    "power_balance": ("time",),
}
# those that a run has with motors, tendons or limits, of which older versions saved fewer
_FILLED = {name: ("time", *dims) for name, (dims, _) in (MOTOR_VARIABLES | TENDON_VARIABLES).items()}
_FILLED |= {"drive_velocity": ("time", "prescribed"), "drive_velocity_limit": ("prescribed",)}
_LOOP = {"reference": ("sample",), "output": ("sample",), "measured": ("sample",), "command": ("sample",)}
_LOOP |= {"sample": ("sample",), "reading": ("time",)}
_SINGLE = {name: () for name, (dims, _) in OF_A_CYCLE.items() if not dims}
_KNOWN = (
    _FILLED
    | _LOOP
    | _SINGLE
    | DIMENSIONS
    | {
        "water_velocity": ("time", "axis"),
        "momentum_balance": ("time",),
        "line_force": ("time", "load", "station", "axis"),
        "bending_strain": ("time", "station", "across"),
        "bending_stress": ("time", "station", "across"),
        "hinge_strain": ("time", "part"),
        "hinge_stress": ("time", "part"),
        "part_energy": ("time", "part", "form"),
        "flow_number": ("number", "load", "part"),
        "reaction_limit": ("prescribed",),
        "impulse": ("prescribed",),
        "impulse_energy": (),
    }
)
_RUN = Contents(
    "a simulation",
    _NEEDED,
    _KNOWN,
    finite={*_NEEDED, *_LOOP, "part_energy", "impulse", "impulse_energy"} - {"power_balance"},
    endless=("flow_number",),
    units=tuple(_LOOP),
    names=("part", "load", "prescribed", "form", "axis"),
    texts=("title", "robot", "status", "status_reason"),
    counts=("steps", "rejected", "jacobians", "residuals", "cycles", "corrections"),
    numbers=("seconds", "period", "growth", "multiplier", "multiplier_error"),
    encoded={"provenance": dict},
)
_SCORES = ("rms_error", "largest_error", "effort", "change", "at_limits")
_RESPONSES = ("output", "measured", "command")
_COMPARISON = Contents(
    "a comparison of controllers",
    {"sample": ("sample",), "reference": ("sample",)}
    | dict.fromkeys(_RESPONSES, ("controller", "sample"))
    | dict.fromkeys(_SCORES, ("controller",)),
    finite=("sample", "reference"),
    units=("sample", "reference", *_RESPONSES, *_SCORES),
    names=("controller",),
    texts=("title", "measured", "commanded"),
    numbers=("seconds",),
    encoded={"provenance": dict},
)
_POSITIVE = {"reaction_limit", "drive_velocity_limit", "battery_voltage"}
_SIZES = {"axis": 3, "row": 3, "across": 2, "number": len(NUMBERS)}
_FARTHEST = 1e9  # m, s: what is drawn beside it would be lost in its digits
_SHEARED = 1e-3  # of the determinant of a rotation, against 1


def saved_run(dataset: xr.Dataset, source: str) -> xr.Dataset:
    """Return a results file as a run: NaN where it lacks arrays of motors, tendons or limits.

    Raises InputError where it is not that of a simulation; `source` names it.
    """
    dims = {*map(str, dataset.dims)}
    if compares_controllers(dataset):
        message = "this is no simulation but a comparison of controllers: `nectosome show` draws it."
        raise InputError(message, file=source)
    numbers = dataset.coords.get("number")
    if numbers is not None and numbers.dims == ("number",) and {*numbers.values.tolist()} < {*NUMBERS}:  # an older one
        dataset = dataset.reindex(number=[*NUMBERS])
    powered = [name for name in ("motor", "battery", "tendon") if name in dims or name in dataset]
    check_contents(dataset, _RUN._replace(names=(*_RUN.names, *powered)), source)

    def need(fits: object, what: str) -> None:
        if not fits:
            raise InputError(f"this is not a simulation: {what}.", file=source)

    for name in ("time", "part", "station"):
        need(dataset.sizes[name], f"it has no {name}")
    for name, size in _SIZES.items():
        need(dataset.sizes.get(name, size) == size, f"its {name} has {dataset.sizes.get(name)} places, not {size}")
    time = dataset["time"].values
    if not np.all(np.diff(time) >= 0) or (time.size > 1 and time[-1] == time[0]):
        raise InputError("its times do not go on.", file=source)
    parts, loads = ({*dataset[name].values.tolist()} for name in ("part", "load"))
    own = dataset.variables.get("station_part")
    need(own is not None and own.dims == ("station",), "its station_part has no names")
    need({*dataset["station_part"].values.tolist()} == parts, "its station_part is not of its parts")
    need(DRIVE in loads, f"its load has no {DRIVE}")
    forward = dataset.attrs.get("forward", "x")
    need(isinstance(forward, str) and forward in DIRECTIONS, "its forward is no axis")
    for name in _POSITIVE & {*dataset.data_vars}:
        need(not (dataset[name].values <= 0).any(), f"its {name} is not positive")
    need("flow_number" not in dataset or not (dataset["flow_number"].values < 0).any(), "its flow_number is negative")
    need("reading" not in dataset or {*_LOOP} <= {*dataset.variables}, "it lacks some of a closed loop")
    for name in ("measured", "commanded") if "reference" in dataset else ():
        need(isinstance(dataset.attrs.get(name), str), f"its {name} is missing")
    made = json.loads(dataset.attrs["provenance"])
    need(isinstance(made.get("packages", {}), dict), "its provenance cannot be read")
    robot = _robot_of(dataset)
    need(robot is None or parts <= {*robot.carriers}, "its parts are not those of its robot")
    own_names = {"motor": robot.powered, "battery": robot.batteries} if robot is not None else {}
    for name in dims & {"motor", "battery"}:
        need({*dataset[name].values.tolist()} <= {*own_names.get(name, ())}, f"its {name} is not one of its robot")
    there = dims if "reaction_limit" in dataset else dims - {"prescribed"}
    lacking = {name: over for name, over in _FILLED.items() if name not in dataset and {*over} <= there}
    return dataset.assign(
        {name: (over, np.full([dataset.sizes[d] for d in over], np.nan)) for name, over in lacking.items()}
    )


def compares_controllers(dataset: xr.Dataset) -> bool:
    """Whether a results file compares controllers, as `nectosome control --controller a,b --save` does."""
    return {"controller", "sample"} <= {*dataset.dims}


def check_comparison(dataset: xr.Dataset, source: str) -> None:
    """Raise InputError where such a file lacks what its page needs, or has something else there."""
    check_contents(dataset, _COMPARISON, source)

    def need(fits: object, what: str) -> None:
        if not fits:
            raise InputError(f"this is not {_COMPARISON.kind}: {what}.", file=source)

    for name in ("controller", "sample"):
        need(dataset.sizes[name], f"it has no {name}")
    need(np.all(np.diff(dataset["sample"].values) > 0), "its times do not go on")
    for name in ("outcome", "cause"):
        words = dataset.coords.get(name)
        need(
            words is not None and words.dims == ("controller",) and words.dtype.kind == "U", f"its {name} has no words"
        )
    ends = np.asarray(dataset.attrs.get("command_range"))
    need(
        ends.shape == (2,) and ends.dtype.kind in "if" and np.isfinite(ends).all(), "its command_range has no two ends"
    )
    for name in ("rms_error", "largest_error"):
        where = dataset["outcome"].isin(["tracks", "poor"])
        need(dataset[name].notnull().where(where, True).all(), f"its {name} is NaN where a controller has run")


def _robot_of(dataset: xr.Dataset) -> RobotDescription | None:
    """The robot of a file; None where it has none, and of an older version that is not read any more."""
    with suppress(InputError):
        return robot_of_run(dataset.attrs["robot"])
    return None


def check_drawable(run: xr.Dataset, source: str) -> None:
    """Raise InputError where a saved run does not tell at all times where its stations are, and how they are turned."""
    for name in ("position", "rotation", "half_width", "station_x", "time"):
        if not np.isfinite(run[name].values).all():
            raise InputError(f"its {name} is not finite everywhere: it cannot be drawn.", file=source)
        if run[name].size and np.abs(run[name].values).max() > _FARTHEST:
            raise InputError(f"its {name} is beyond {_FARTHEST:g}: it cannot be drawn.", file=source)
    turned = run["rotation"].values
    if np.abs(np.linalg.det(turned) - 1).max(initial=0.0) > _SHEARED:
        raise InputError("its rotation turns nothing, its determinant is not 1: it cannot be drawn.", file=source)
    if not np.all(np.diff(run["time"].values) > 0):
        raise InputError("its times do not go on: it cannot be drawn.", file=source)


def check_sweep(dataset: xr.Dataset, source: str) -> None:
    """Raise InputError where a results file is not a sweep of one robot over one or two quantities."""
    kind = "a sweep of a robot that can be shown"

    def need(fits: object, what: str) -> None:
        if not fits:
            raise InputError(f"this is not {kind}: {what}.", file=source)

    need("status" in dataset, "it has no status")
    status = dataset["status"]
    over = tuple(map(str, status.dims))
    need(status.ndim in (1, 2) and status.size > 0, "it is not over one or two quantities")
    need(all(str(word) in Status.__members__ for word in status.values.ravel()), "its status is not known here")
    needed = {name: (name,) for name in over} | dict.fromkeys(MEANS, over)
    needed |= dict.fromkeys(("force", "force_peak"), (*over, "axis"))
    known = dict.fromkeys(MORE_MEANS, over) | {"velocity_peak": (*over, "part", "axis")}
    contents = Contents(kind, needed, known, finite=over, names=("axis",), texts=("title", "robot"))
    check_contents(dataset, contents._replace(units=tuple(needed | known)), source)
    for name in over:
        need(len({*dataset[name].values.tolist()}) == dataset.sizes[name], f"its {name} has a value twice")
    need(dataset.sizes.get("part", 1), "it has no part")
    solved = status.isin([one.name for one in (Status.SOLVED, Status.SETTLED, Status.UNSTABLE)])
    for name in ("speed", "power"):
        need(dataset[name].notnull().where(solved, True).all(), f"its {name} is NaN where a motion was found")
    need(dataset.attrs["robot"], "its robot is missing")
