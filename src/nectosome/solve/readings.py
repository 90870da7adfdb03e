"""What a sensor on a robot could tell of its motion: one number, by name, or by a formula of several."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core import State
from nectosome.core.programs.remember import remembered
from nectosome.core.rows import on_device
from nectosome.core.se3 import dot
from nectosome.core.tracers import traced
from nectosome.description import robot_of_run
from nectosome.mechanism import Diagnosis, Robot, SoftRod, diagnose, node_at
from nectosome.mechanism.tree import PartShape
from nectosome.model import build
from nectosome.units import DIMENSIONS, InputError, did_you_mean, dimension_of, kind_of, shorten
from nectosome.units.expression import Expression, FunctionFormula

from .motor_results import motor_names, of_drives
from .results import Run, at_hand

if TYPE_CHECKING:
    import xarray as xr

PLACES = {
    "position.x": ("length", "along the world's x"),
    "position.y": ("length", "along the world's y"),
    "position.z": ("length", "along the world's z, up"),
    "depth": ("length", "below the water's surface"),
    "heading": ("angle", "of the part's x axis seen from above, from the world's x towards y; full turns are counted"),
    "pitch": ("angle", "of the part's x axis over the horizon"),
    "tilt": ("angle", "of the part's z axis from straight above"),
    "velocity.x": ("speed", "along the world's x"),
    "velocity.y": ("speed", "along the world's y"),
    "velocity.z": ("speed", "along the world's z, up"),
    "surge": ("speed", "along the part's own x axis"),
    "sway": ("speed", "along the part's own y axis, to port where x is ahead"),
    "heave": ("speed", "along the part's own z axis, up where the part is level"),
    "turn_rate": ("angular_speed", "about the vertical"),
}
"""Dimension and meaning of what can be read of a part, at its root and at its tip, and of a rod at its marks.

Surge, sway and heave are the components of the velocity along body axes (SNAME 1950; Fossen 2011), here with z up: sway
and heave have the signs opposite to theirs, whose y points to starboard and z down. A robot that swims towards its own
-x has a negative surge.
"""

_OF_COORDINATE = {"angle": ("angle", "angular_speed"), "position": ("length", "speed")}
_OF_COORDINATE |= dict.fromkeys("xy", _OF_COORDINATE["position"])  # of a planar joint
_ANGLES = "torsion", "bending_y", "bending_z", "deflection"  # strains times the length, and deflections over it
_RATE, _FORCE, _REACTION, _TENSION, _FORMULA, _PLACE = "rate", "force", "reaction", "tension", "formula", "place"
# of motors and batteries, by the names of results
_OF_MOTOR = {"current": "current", "motor_torque": "torque", "motor_voltage": "voltage", "electrical_power": "power"}
_OF_BATTERY = {"battery_voltage": "voltage", "battery_power": "power"}


class Reading(eqx.Module):
    """One number of a robot's state."""

    name: str = eqx.field(static=True)
    dimension: str = eqx.field(static=True)  # a key of `units.DIMENSIONS`
    kind: str = eqx.field(static=True)  # of PLACES, of motors and batteries, or "coordinate", "rate", ...
    index: int = eqx.field(static=True)  # of the station, coordinate (of all, or prescribed ones), axis, motor, tendon
    parts: "tuple[Reading, ...]" = ()  # of which an expression is made, its name
    derived_unit: str = eqx.field(static=True, default="")  # of an expression

    @property
    def unit(self) -> str:
        """SI unit."""
        return self.derived_unit or DIMENSIONS[self.dimension].unit

    @property
    def turns(self) -> bool:
        """Whether it is an angle that comes back by a full turn."""
        return self.kind == "heading" or (self.dimension == "angle" and any(part.turns for part in self.parts))

    def value(self, robot: Robot, t: Float[Array, ""], x: State) -> Float[Array, ""]:
        """What it is at a time and a state."""
        return self._of(_Instant(robot, t, x))

    def _of(self, now: "_Instant") -> Float[Array, ""]:
        if self.kind == _FORMULA:
            return Expression(self.name).value({part.name: part._of(now) for part in self.parts}, jnp)
        return now.read(self._kind, self.index)[self.kind]

    @property
    def _kind(self) -> str:
        """What is computed together with it: all that can be read of a place, or its kind alone."""
        return _PLACE if self.kind in PLACES else self.kind


class _Instant:
    """A robot at a time and a state: what several readings need is computed once."""

    def __init__(self, robot: Robot, t: Float[Array, ""], x: State):
        self.robot, self.t, self.x = robot, t, x

    def read(self, what: str, k: int | Int[Array, ""]) -> dict[str, Float[Array, ""]]:
        """Readings of a program by their kinds, of the k-th station, coordinate, motor or tendon."""
        if what == _PLACE:
            shape, twists = self.stations
            place = place_of(shape.rotation[k], shape.position[k], twists[k])
            surface = self.robot.water.surface
            return place if surface is None else {**place, "depth": surface - place["position.z"]}
        return {what: self._all(what)[k]}

    def _all(self, what: str) -> Float[Array, "n"]:
        """A kind of each coordinate, drive, motor, battery or tendon."""
        if what in (_FORCE, _REACTION):
            return self.diagnosed.support_force if what == _FORCE else self.diagnosed.reaction
        q, v = self.coordinates
        if what == _TENSION:
            return self.robot.tendons(q, v, self.x.z).tension
        if what in _OF_MOTOR or what in _OF_BATTERY:
            powered, _, voltages = self.robot.motors(self.t, q, v, self.x.z)
            return of_drives(powered, voltages, self.robot.powered.battery_powers(powered.electrical))[what]
        return v if what == _RATE else q

    @cached_property
    def diagnosed(self) -> Diagnosis:
        return diagnose(self.robot, self.t, self.x)

    @cached_property
    def coordinates(self) -> tuple[Array, Array]:
        """All coordinates and velocities."""
        q, v, _ = self.robot.tree.complete(self.t, self.x.q, self.x.v)
        return q, v

    @cached_property
    def stations(self) -> tuple[PartShape, Float[Array, "n 6"]]:
        """Poses and twists of all stations."""
        q, v = self.coordinates
        shape = self.robot.tree.shape(q)
        return shape, self.robot.tree.twists(shape, v)


def values_of(readings: Sequence[Reading], robot: Robot, t: Float[Array, ""], x: State) -> Float[Array, "k"]:
    """What several readings are at a time and a state."""
    now = _Instant(robot, t, x)
    return jnp.stack([one._of(now) for one in readings])


def place_of(R: Float[Array, "3 3"], p: Float[Array, "3"], twist: Float[Array, "6"]) -> dict[str, Float[Array, ""]]:
    """Where a station is and how it moves, by the names of PLACES but depth; SI units, `twist` in its own frame."""
    turning, velocity = dot(R, twist[:3]), dot(R, twist[3:])
    return {
        **{f"position.{axis}": p[i] for i, axis in enumerate("xyz")},
        "heading": jnp.arctan2(R[1, 0], R[0, 0]),
        "pitch": jnp.arctan2(R[2, 0], jnp.hypot(R[0, 0], R[1, 0])),
        "tilt": jnp.arctan2(jnp.hypot(R[2, 0], R[2, 1]), R[2, 2]),
        **{f"velocity.{axis}": velocity[i] for i, axis in enumerate("xyz")},
        **{name: twist[3 + i] for i, name in enumerate(("surge", "sway", "heave"))},
        "turn_rate": turning[2],
    }


def reading(run: "Run | xr.Dataset", name: str | Callable[[Mapping[str, Any]], Any]) -> Float[np.ndarray | Array, "n"]:
    """What a sensor on the robot reads along a run or its saved dataset, at each of its times [SI].

        ns.reading(run, "tail.tip.position.y")
        ns.reading(run, "surge / electrical_power.tail.angle")                 # an expression of readings
        ns.reading(run, lambda r: abs(r["heading"] - r["tail.heading"]))       # a function of readings at one time

    Names and expressions are those of `reading_of`; a heading goes on beyond half a turn. A function takes a mapping
    from names to numbers in SI and gives a number. Raises InputError for what is no run, and for what cannot be read of
    this robot or was not saved.
    """
    if callable(name) or is_expression(name):
        known = all_readings(run.value.system if isinstance(run, Run) else _saved_robot(run))
        formula = FunctionFormula(name, known, None) if callable(name) else Expression(name, None)
        _check_reads(formula.names, formula.text)
        columns: dict[str, Any] = {one: reading(run, one) for one in formula.names}
        if any(map(traced, columns.values())):
            return jax.vmap(lambda now: formula.value(now, jnp))(columns)
        return formula.each(columns)
    if isinstance(run, Run):
        robot, times, states = run.value.system, run.value.time, run.value.state
        one = reading_of(robot, name)
        values = _along(one, robot, times, states)
    else:
        one, values = _saved(run, name)
    return (jnp if traced(values) else np).unwrap(values) if one.turns else values


def is_expression(name: Any) -> bool:
    """Whether a text is more than a name."""
    return isinstance(name, str) and not re.fullmatch(r"[\w.-]*", name.strip())


def _check_reads(names: Sequence[str], text: str) -> None:
    if not names:
        raise InputError(f'"{shorten(text)}" depends on nothing that is measured.')


def _saved_robot(data: "xr.Dataset") -> Robot:
    """Robot of a saved run."""
    if not hasattr(data, "variables"):
        raise InputError(f"{kind_of(data)} is given where a run is expected. {_RUNS}")
    lacking = [what for what in ("time", "rotation", "velocity", "q") if what not in data.variables]
    if lacking:
        raise InputError(f"{kind_of(data)} without {lacking[0]} is given where a run is expected. {_RUNS}")
    if not data.attrs.get("robot"):
        raise InputError("this dataset does not tell its robot, so that nothing can be read of it by name.")
    return build(robot_of_run(str(data.attrs["robot"])))


def _saved(data: "xr.Dataset", name: str) -> tuple[Reading, Float[np.ndarray, "n"]]:
    """A reading and its values along a saved run: those that it holds as they are, others of the robot rebuilt."""
    robot = _saved_robot(data)
    one = reading_of(robot, name)
    whole = name.removesuffix(f".{_RATE}") if one.kind == _RATE else name.removeprefix(f"{one.kind}.")
    for kind, variable, along in (
        ("coordinate", "q", "coordinate"),
        (_RATE, "v", "coordinate"),
        (_RATE, "drive_velocity", "prescribed"),
        (_REACTION, "reaction", "prescribed"),
        *((kind, kind, "motor") for kind in _OF_MOTOR),
        *((kind, kind, "battery") for kind in _OF_BATTERY),
        (_TENSION, "tension", "tendon"),
    ):
        if one.kind == kind and along in data and whole in data[along].values:
            return one, data[variable].sel({along: whole}).values
    firsts = [place.stations.start for place in robot.tree.layout]
    of_place = one.kind in PLACES and one.kind != "turn_rate"
    if of_place and (PLACES[one.kind][0] != "speed" or one.index in firsts):
        R, p = data["rotation"].values[:, one.index], data["position"].values[:, one.index]
        velocity = data["velocity"].values[:, firsts.index(one.index)] if one.index in firsts else np.zeros_like(p)
        twists = np.concatenate([np.zeros_like(p), np.einsum("tji,tj->ti", R, velocity)], axis=1)
        if one.kind == "depth" and robot.water.surface is not None:
            return one, float(robot.water.surface) - p[:, 2]
        return one, np.asarray(remembered(_places, R, p, twists)[one.kind])
    if one.kind == _FORCE and "support_force" in data.variables:
        return one, data["support_force"].values[:, one.index]
    if one.kind == _FORCE or "command" in data.variables:  # what its controller did besides is not in the dataset
        raise InputError(f'"{shorten(name)}" was not saved with this run. Read it of the run before it is saved.')
    q = remembered(_coordinates, robot, data["q"].values)
    each = jax.tree.map(lambda x: np.broadcast_to(x, (len(q), *x.shape)), robot.initial().z)
    states = State(q, on_device(data["v"].values), jax.tree.map(on_device, each))
    return one, _along(one, robot, on_device(data["time"].values), states)


def _places(R: Float[Array, "n 3 3"], p: Float[Array, "n 3"], twists: Float[Array, "n 6"]) -> dict[str, Array]:
    return jax.vmap(place_of)(R, p, twists)


def _coordinates(robot: Robot, q: Float[Array, "n nv"]) -> Float[Array, "n nq"]:
    return jax.vmap(robot.coordinates)(q)


_RUNS = "Give what ns.simulate, steady, periodic or static return, or the dataset of it."


class _Kind(eqx.Module):
    """What a program of readings computes: which of them is a number, so that all of a kind share it."""

    what: str = eqx.field(static=True)


def _along(one: Reading, robot: Robot, times: Float[Array, "n"], states: State) -> Any:
    """A reading at each time; NumPy's unless traced."""
    return at_hand(remembered(_values, _Kind(one._kind), one.index, robot, times, states)[one.kind])


def _values(
    kind: _Kind, index: int | Int[Array, ""], robot: Robot, times: Float[Array, "n"], states: State
) -> dict[str, Float[Array, "n"]]:
    return jax.vmap(lambda t, x: _Instant(robot, t, x).read(kind.what, index))(times, states)


def reading_of(robot: Robot, name: str) -> Reading:
    """Reading by its name.

    - `heading` of the body, `arm.depth` of a part, `arm.tip.position.x` of its tip, `tail.0.4.position.x` of the mark
      at 0.4 of a rod: what PLACES has.
    - `arm.angle` of a joint, `tail.bending_z.0` of a rod, `fin.bending_z.angle` of a shaft that drives a strain, and
      `arm.angle.rate`.
    - `reaction.arm.angle`: what the drive of a prescribed joint gives.
    - `current.arm.angle` of a motor, and its `motor_torque`, `motor_voltage` and `electrical_power` alike;
      `battery_voltage.pack` and `battery_power.pack` of a battery.
    - `tension.left` of a tendon over joints.
    - `force.x`: what the robot gives to what holds it, in the world, as a load cell measures; 0 where it swims freely.
    - an expression of them, such as `tail.tip.position.y - position.y` or `surge / battery_power.pack`.

    Raises InputError for what cannot be read of this robot, with what can.
    """
    if not isinstance(name, str):
        raise InputError(f"{kind_of(name)} is given where the name of a reading is expected.")
    if is_expression(name):
        formula = Expression(name, None)
        _check_reads(formula.names, name)
        parts = tuple(reading_of(robot, one) for one in formula.names)
        unit = formula.unit({one.name: one.unit for one in parts}).removesuffix("1")
        return Reading(name, dimension_of(unit), _FORMULA, -1, parts, unit)
    known = {reading.name: reading for reading in _readings(robot)}
    if name in known:
        return known[name]
    if name.rpartition(".")[2] == "depth" and robot.water.surface is None:
        raise InputError(f'"{shorten(name)}" needs a surface of the water, and there is none. Measure position.z.')
    hint = did_you_mean(name, known) or f" Known: {', '.join(common_readings(robot)[:30])}."
    raise InputError(f'"{shorten(name)}" is nothing that can be measured.{hint}')


def common_readings(robot: Robot) -> list[str]:
    """Names of what can be read, but for the places of parts and of tips."""
    return [one.name for one in _readings(robot) if one.name == one.kind or one.kind not in PLACES]


def all_readings(robot: Robot) -> list[str]:
    """Names of all that can be read."""
    return [one.name for one in _readings(robot)]


def _readings(robot: Robot) -> Iterator[Reading]:
    """All that can be read, the body's places also without its name."""
    for i, axis in enumerate("xyz"):
        yield Reading(f"{_FORCE}.{axis}", "force", _FORCE, i)
    for i, coordinate in enumerate(robot.prescribed_names):
        of = _OF_COORDINATE.get(coordinate.rpartition(".")[2])
        if of is not None:
            given = "torque" if of[0] == "angle" else "force"
            yield Reading(f"{_REACTION}.{coordinate}", given, _REACTION, i)
    for i, coordinate in enumerate(motor_names(robot)):
        slides = not coordinate.endswith(".angle")
        for kind, of in _OF_MOTOR.items():
            yield Reading(f"{kind}.{coordinate}", "force" if slides and of == "torque" else of, kind, i)
    for i, battery in enumerate(robot.powered.battery_names):
        for kind, of in _OF_BATTERY.items():
            yield Reading(f"{kind}.{battery}", of, kind, i)
    for i, tendon in enumerate(robot.tendon_names):
        yield Reading(f"{_TENSION}.{tendon}", "force", _TENSION, i)
    rods = {k: g.things for g in robot.tree.rods if isinstance(g.things, SoftRod) for k in g.members}
    for k, (part, place) in enumerate(zip(robot.tree.structure, robot.tree.layout, strict=True)):
        for kind, (dimension, _) in PLACES.items():
            if kind == "depth" and robot.water.surface is None:
                continue
            if k == 0:
                yield Reading(kind, dimension, kind, place.stations.start)
            yield Reading(f"{part.name}.{kind}", dimension, kind, place.stations.start)
            yield Reading(f"{part.name}.tip.{kind}", dimension, kind, place.stations.stop - 1)
            for mark in rods[k].marks if k in rods else ():
                yield Reading(
                    f"{part.name}.{mark}.{kind}", dimension, kind, place.stations.start + node_at(rods[k], mark)
                )
    for part, place in zip(robot.tree.structure, robot.tree.layout, strict=True):
        if part.joint.nq == part.joint.nv:  # else its coordinates are no angles one by one
            for i, what in enumerate(part.joint.names):
                if f"{part.name}.{what}" not in (f"{part.name}.{kind}" for kind in PLACES):
                    of, rate = _OF_COORDINATE[what]
                    yield Reading(f"{part.name}.{what}", of, "coordinate", place.q.start + i)
                    yield Reading(f"{part.name}.{what}.{_RATE}", rate, _RATE, place.v.start + i)
        names = [n for n in robot.tree.coordinate_names if n.startswith(f"{part.name}.")][part.joint.nv :]
        for i, strain in enumerate(names):
            of = "angle" if strain.split(".")[-2] in _ANGLES else "number"
            yield Reading(strain, of, "coordinate", place.q.start + part.joint.nq + i)
            if strain.endswith(".angle"):
                yield Reading(f"{strain}.{_RATE}", "angular_speed", _RATE, place.v.start + part.joint.nv + i)
