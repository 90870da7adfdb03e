"""What a sensor on a robot could tell of its motion: one number, by name."""

from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State
from nectosome.core.remember import remembered
from nectosome.core.se3 import dot
from nectosome.mechanism import Robot, diagnose, support_force
from nectosome.solve import Run
from nectosome.units import DIMENSIONS, InputError, did_you_mean, shorten

PLACES = {
    "x": ("length", "place along the world's x"),
    "y": ("length", "along y"),
    "z": ("length", "along z, up"),
    "depth": ("length", "below the water's surface"),
    "heading": ("angle", "of the part's x axis seen from above, from the world's x towards y; full turns are counted"),
    "pitch": ("angle", "of the part's x axis over the horizon"),
    "lean": ("angle", "of the part's z axis from straight above"),
    "surge": ("speed", "along the world's x"),
    "sway": ("speed", "along y"),
    "climb": ("speed", "along z"),
    "turn_rate": ("angular_speed", "about the vertical"),
}
"""Dimension and meaning of what can be read of a part, at its root and at its tip."""

_OF_COORDINATE = {"angle": ("angle", "angular_speed"), "position": ("length", "speed")}
_OF_COORDINATE |= {"x": _OF_COORDINATE["position"], "y": _OF_COORDINATE["position"]}
_OF_STRAIN = {"torsion": "curvature", "bending_y": "curvature", "bending_z": "curvature"}
_RATE, _FORCE, _REACTION = "rate", "force", "reaction"


class Reading(eqx.Module):
    """One number of a robot's state."""

    name: str = eqx.field(static=True)
    dimension: str = eqx.field(static=True)  # a key of `io.dimensions.DIMENSIONS`
    kind: str = eqx.field(static=True)  # a key of PLACES, "coordinate", "rate", "force" or "reaction"
    index: int = eqx.field(static=True)  # of the station, of the coordinate among all (prescribed ones), of the axis

    @property
    def unit(self) -> str:
        """SI unit."""
        return DIMENSIONS[self.dimension].unit

    @property
    def turns(self) -> bool:
        """Whether it is an angle that comes back by a full turn."""
        return self.kind == "heading"

    def value(self, robot: Robot, t: Float[Array, ""], x: State) -> Float[Array, ""]:
        """What it is at a time and a state."""
        if self.kind == _FORCE:
            return support_force(robot, t, x)[self.index]
        if self.kind == _REACTION:
            return diagnose(robot, t, x).reaction[self.index]
        tree = robot.tree
        q, v, _ = tree.complete(t, x.q, x.v)
        if self.kind == _RATE:
            return v[self.index]
        if self.kind == "coordinate":
            return q[self.index]
        shape, k = tree.shape(q), self.index
        place = place_of(shape.rotation[k], shape.position[k], tree.twists(shape, v)[k])
        if self.kind == "depth":
            assert robot.water.surface is not None
            return robot.water.surface - place["z"]
        return place[self.kind]


def place_of(R: Float[Array, "3 3"], p: Float[Array, "3"], twist: Float[Array, "6"]) -> dict[str, Float[Array, ""]]:
    """Where a station is and how it moves, by the names of PLACES but depth; SI units, `twist` in its own frame."""
    turning, velocity = dot(R, twist[:3]), dot(R, twist[3:])
    return {
        "x": p[0],
        "y": p[1],
        "z": p[2],
        "heading": jnp.arctan2(R[1, 0], R[0, 0]),
        "pitch": jnp.arctan2(R[2, 0], jnp.hypot(R[0, 0], R[1, 0])),
        "lean": jnp.arctan2(jnp.hypot(R[2, 0], R[2, 1]), R[2, 2]),
        "surge": velocity[0],
        "sway": velocity[1],
        "climb": velocity[2],
        "turn_rate": turning[2],
    }


def read(run: Run, name: str) -> Float[np.ndarray, "n"]:
    """What a sensor on the robot would have told along a run, at `run.value.time`, by the name of the reading.

    Names are those of `reading_of`; SI units; a heading goes on beyond half a turn. Raises InputError for what cannot
    be read of this robot, with what can.
    """
    robot, times, states = run.value.system, run.value.time, run.value.state
    reading = reading_of(robot, name)
    values = np.asarray(remembered(_values, reading, robot, times, states))
    return np.unwrap(values) if reading.turns else values


def _values(reading: Reading, robot: Robot, times: Float[Array, "n"], states: State) -> Float[Array, "n"]:
    return jax.vmap(lambda t, x: reading.value(robot, t, x))(times, states)


def reading_of(robot: Robot, name: str) -> Reading:
    """Reading by its name.

    - `heading` of the body, `arm.depth` of a part, `arm.tip.x` of its tip: what PLACES has.
    - `arm.angle` of a joint, `tail.bending_z.0` of a rod, and `arm.angle.rate`.
    - `reaction.arm.angle`: what the drive of a prescribed joint gives.
    - `force.x`: what the robot gives to what holds it, in the world, as a load cell measures; 0 where it swims freely.

    Raises InputError for what cannot be read of this robot, with what can.
    """
    known = {reading.name: reading for reading in _readings(robot)}
    if name in known:
        return known[name]
    if name.rpartition(".")[2] == "depth" and robot.water.surface is None:
        raise InputError(f'"{shorten(name)}" needs a surface of the water, and there is none. Measure z.')
    near = did_you_mean(name, known)
    listed = common_readings(robot)[:30]
    raise InputError(
        f'"{shorten(name)}" is nothing that can be measured.{near or " Known: " + ", ".join(listed) + "."}'
    )


def common_readings(robot: Robot) -> list[str]:
    """Names of what can be read, but for the places of parts and of tips."""
    return [one.name for one in _readings(robot) if "." not in one.name or one.kind not in PLACES]


def _readings(robot: Robot) -> Iterator[Reading]:
    """All that can be read, the body's places also without its name."""
    for i, axis in enumerate("xyz"):
        yield Reading(f"{_FORCE}.{axis}", "force", _FORCE, i)
    for i, coordinate in enumerate(robot.prescribed_names):
        of = _OF_COORDINATE.get(coordinate.rpartition(".")[2])
        if of is not None:
            given = "torque" if of[0] == "angle" else "force"
            yield Reading(f"{_REACTION}.{coordinate}", given, _REACTION, i)
    for k, (part, place) in enumerate(zip(robot.tree.parts, robot.tree.layout, strict=True)):
        for kind, (dimension, _) in PLACES.items():
            if kind == "depth" and robot.water.surface is None:
                continue
            if k == 0:
                yield Reading(kind, dimension, kind, place.stations.start)
            yield Reading(f"{part.name}.{kind}", dimension, kind, place.stations.start)
            yield Reading(f"{part.name}.tip.{kind}", dimension, kind, place.stations.stop - 1)
    for part, place in zip(robot.tree.parts, robot.tree.layout, strict=True):
        if part.joint.nq == part.joint.nv:  # else its coordinates are no angles one by one
            for i, what in enumerate(part.joint.names):
                if f"{part.name}.{what}" not in (f"{part.name}.{kind}" for kind in PLACES):
                    of, rate = _OF_COORDINATE[what]
                    yield Reading(f"{part.name}.{what}", of, "coordinate", place.q.start + i)
                    yield Reading(f"{part.name}.{what}.{_RATE}", rate, _RATE, place.v.start + i)
        names = [n for n in robot.tree.coordinate_names if n.startswith(f"{part.name}.")][part.joint.nv :]
        for i, strain in enumerate(names):
            of = _OF_STRAIN.get(strain.split(".")[-2], "number")
            yield Reading(strain, of, "coordinate", place.q.start + part.joint.nq + i)
