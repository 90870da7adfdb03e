"""Thrust of the paddle on its load cell (Experiment A): over strokes, joints and hinges, and instant by instant.

Between the points of these grids, the best strokes and hinges of the paddle with three joints, by exact derivatives of
its cycle.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from nectosome.core import Status
from nectosome.description import RevoluteJoint, RobotDescription, get_value, with_values
from nectosome.description.variables import Box, read_variable
from nectosome.designs import Limit, MotionDesign
from nectosome.designs.sweep import sweep
from nectosome.model import build
from nectosome.robots import describe
from nectosome.search import Gradient, minimise, undominated
from nectosome.solve import periodic

SAMPLES = 257  # instants of a cycle: more of them move a mean thrust by 1e-4 of itself
RANGES = {
    "A": "30 deg .. 75 deg",
    "f": "0.3 Hz .. 1.3 Hz",
    "thickness": "2 mm .. 8 mm",
    "length": "30 mm .. 150 mm",
}
COSTS = ("power", "stress")
_ROOM = 1.002  # of a cost: a design of the grid, where it is known to 1e-3, keeps its own limit
_LOOSE = {"drive_rate": 100.0, "power": 1e3, "stress": 1e9}  # limits that nothing comes near to


def over_strokes(joints: Sequence[int], amplitudes: Sequence[float], frequencies: Sequence[float]) -> xr.Dataset:
    """Thrust, power and thrust per power of paddles of so many joints, by amplitude [rad] and frequency [Hz]."""
    found = sweep("paddle", {"N": [float(n) for n in joints], "A": amplitudes, "f": frequencies}, samples=SAMPLES)
    out = _named(found).rename(N="joints", A="amplitude", f="frequency")
    return out.assign_attrs(servo_speed_limit=servo_speed())


def servo_speed() -> float:
    """Speed of the servo without load [rad/s]."""
    servo = describe("paddle").limbs["arm"].joint
    assert isinstance(servo, RevoluteJoint)
    assert servo.limits is not None
    return servo.limits.speed


def over_hinges(thicknesses: Sequence[float], lengths: Sequence[float]) -> xr.Dataset:
    """The same and the largest stress in the flexible layers, at 75 deg and 1.1 Hz, by their thickness and length [m].

    All joints are alike. `front_power` and `front_stress` are where no other hinge gives more thrust for as little
    power, or stress.
    """
    robot = with_hinges(describe("paddle"))
    found = sweep(robot, {"thickness": thicknesses, "length": lengths}, samples=SAMPLES)
    stress = found["hinge_stress_peak"].max("part")
    out = _named(found).assign(stress=stress.assign_attrs(units="Pa"))
    for cost in COSTS:
        members = np.zeros(out["thrust"].size, bool)
        members[undominated(np.column_stack([out[cost].values.ravel(), -out["thrust"].values.ravel()]))] = True
        out[f"front_{cost}"] = (("thickness", "length"), members.reshape(out["thrust"].shape))
    own = {f"own_{quantity}": get_value(robot, quantity) for quantity in ("thickness", "length")}
    return out.assign_attrs(own)


def with_hinges(robot: RobotDescription) -> RobotDescription:
    """The robot with aliases for the thickness and the length of the flexible layers of all joints."""
    hinges = [name for name in robot.limbs if name.startswith("segment")]
    fields = {"thickness": "thickness", "length": "as_printed"}
    aliases = {q: tuple(f"limbs.{name}.joint.flexure.{own}" for name in hinges) for q, own in fields.items()}
    return robot.model_copy(update={"aliases": {**robot.aliases, **aliases}})


def _named(found: xr.Dataset) -> xr.Dataset:
    """What the study looks at of a sweep; thrust [N] is what the load cell gives towards +y on the mean."""
    solved = found["status"].isin(("SOLVED", "SETTLED"))
    if not solved.all():
        worst = str(found["status"].values[~solved.values][0])
        raise RuntimeError(f"{found.attrs['title']}: {int((~solved).sum())} points not solved, such as {worst}")
    thrust = -found["force"].sel(axis="y", drop=True)
    return xr.Dataset(
        {
            "thrust": thrust.assign_attrs(units="N"),
            "power": found["power"],
            "thrust_per_power": (thrust / found["power"]).assign_attrs(units="N/W"),
            "servo_speed": found["drive_velocity_peak"].sel(prescribed="arm.angle", drop=True),
        },
        attrs=found.attrs,
    )


def cycle(joints: int, frequency: float) -> xr.Dataset:
    """The cycle that a paddle keeps at 75 deg. Raises RuntimeError where there is none."""
    description = describe("paddle", [f"N={joints}", "A=75deg", f"f={frequency}Hz"])
    found = periodic(build(description), 1 / frequency, samples=SAMPLES)
    if int(found.status) != Status.SOLVED:
        raise RuntimeError(f"cycle of {joints} joints at {frequency} Hz: {Status(int(found.status)).reason}")
    run = found.to_dataset({"samples": SAMPLES})
    run.attrs |= {"label": f"FP{joints}JP", "frequency": frequency}
    return run


def gain_over_loss(run: xr.Dataset) -> float:
    """Positive over negative thrust on the load cell, each integrated over a cycle."""
    thrust = run["reaction"].sel(prescribed="body.y").values[:-1]  # the last sample is the first again
    return float(thrust.clip(min=0).sum() / -thrust.clip(max=0).sum())


def best_strokes() -> xr.Dataset:
    """Most thrust of strokes that the servo can follow without load: with the hinges as they are, and chosen."""
    start, limits = {"A": np.radians(50), "f": 1.1}, {"drive_rate": servo_speed()}
    free = {"stroke": ("A", "f"), "stroke and hinges": tuple(RANGES)}
    return _table({chosen: best(start, names, limits) for chosen, names in free.items()}, "chosen")


def front(hinges: xr.Dataset, cost: str, count: int = 6) -> xr.Dataset:
    """Most thrust of hinges for as much of a cost, at 75 deg and 1.1 Hz; searches start on the front of a grid."""
    members = hinges.stack(design=("thickness", "length"))
    members = members.isel(design=np.flatnonzero(members[f"front_{cost}"])).sortby(cost)
    rows = {}
    for k in np.unique(np.linspace(0, members.sizes["design"] - 1, count).round().astype(int)).tolist():
        member = members.isel(design=k)
        start = {name: float(member[name]) for name in ("thickness", "length")} | {"A": np.radians(75), "f": 1.1}
        rows[k] = best(start, ("thickness", "length"), {cost: _ROOM * float(member[cost])})
    return _table(rows, "level")


def best(start: dict[str, float], free: tuple[str, ...], limits: dict[str, float]) -> dict[str, float]:
    """Most thrust within upper limits on quantities [SI], from a start [SI], where only `free` variables change.

    Variables and quantities of the best paddle [SI]. All calls ask for one program, whatever is free. Raises
    RuntimeError where no design keeps the limits.
    """
    robot = with_hinges(describe("paddle"))
    at = {name: start.get(name, get_value(robot, name)) for name in RANGES}
    variables = [read_variable(name, text, robot) for name, text in RANGES.items()]
    u = Box(tuple(variables)).design(with_values(robot, at)).clip(0, 1)
    variables = [v if v.name in free else replace(v, lower=at[v.name], upper=at[v.name]) for v in variables]
    upper = tuple(Limit(name, True, value) for name, value in (_LOOSE | limits).items())
    task = MotionDesign(robot, tuple(variables), "thrust", upper, "-y")
    found = minimise(task, Gradient(tolerance=1e-5, objective_tolerance=0, evaluations=60), u).best
    if found is None:
        raise RuntimeError(f"no paddle keeps {', '.join(task.constraint_names)} from {at} on")
    return dict(zip(RANGES, task.box.values(found.u).tolist(), strict=True)) | dict(found.outputs)


def _table(rows: dict[Any, dict[str, float]], dim: str) -> xr.Dataset:
    """Variables and quantities of designs [SI] along one dimension."""
    names = ("thrust", "power", "stress", "drive_rate", *RANGES)
    return xr.Dataset({name: (dim, [row[name] for row in rows.values()]) for name in names}, {dim: list(rows)})
