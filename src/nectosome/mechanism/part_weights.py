"""Masses of the parts of a robot, and coordinates along which nothing has inertia and no acceleration is defined."""

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np
from jaxtyping import Array, Float

from nectosome.core.programs.remember import remembered
from nectosome.units import InputError

from .joints import Fixed
from .robot import Robot, start_shape
from .rods import SoftRod

_TURNS = ("angle", "wx", "wy", "wz")
_SINGULAR = 1e-13  # eigenvalue of the mass matrix scaled to a unit diagonal: rounding


@dataclass(frozen=True)
class PartWeight:
    """A part as built: masses [kg], and the names of its degrees of freedom."""

    name: str
    mass: float
    displaced: float
    freedoms: tuple[str, ...]


def weigh(robot: Robot, source: str) -> list[PartWeight]:
    """Return masses of the parts of a robot, which comes from `source`.

    Raises InputError where a mass is not positive and finite; a part that is fixed to another may have none, and one
    that a motor with a rotor moves.
    """
    inertia, names = np.asarray(robot.inertia), robot.coordinate_names
    parts = []
    displaces = float(robot.water.density) * np.asarray(robot.tree.stations.volume)
    for part, place in zip(robot.tree.structure, robot.tree.layout, strict=True):
        mass = float(np.sum(inertia[place.stations, 3, 3]))
        displaced = float(np.sum(displaces[place.stations]))
        rotor = robot.rotors is not None and bool(np.any(np.asarray(robot.rotors)[place.v]))
        weightless = mass == 0 and (rotor or issubclass(part.joint, Fixed))  # a float whose mass is with the body's
        if not ((0 < mass < math.inf or weightless) and displaced < math.inf):
            why = f"the mass of {part.name} comes to {mass:.3g} kg, what it displaces to {displaced:.3g} kg."
            raise InputError(f"{why} Look at its sizes and densities.", file=source)
        freedoms = tuple(name.partition(".")[2] for name in names if name.partition(".")[0] == part.name)
        parts.append(PartWeight(part.name, mass, displaced, freedoms))
    return parts


def check_inertia(robot: Robot) -> None:
    """Raise InputError where the mass matrix at the start is singular, with the joint and what may be given.

    It can be so where a part that turns has no moment of inertia of its own, as a point has not, and where a strain of
    a rod has more coordinates than the rod has points that carry mass. Others are not looked at, so that they cost
    nothing.
    """
    if robot.load_groups.reshaping or not (_has_points(robot) or _has_few_points(robot)):
        return
    M = np.asarray(remembered(_start_mass, robot))
    size = np.sqrt(np.diag(M))
    lacking = size == 0
    if not lacking.any():
        values, vectors = np.linalg.eigh(M / np.outer(size, size))
        lacking = (np.abs(vectors[:, 0]) > 0.1) & (values[0] < _SINGULAR)
    names = [name for name, none in zip(robot.coordinate_names, lacking, strict=True) if none]
    if names:
        raise _sentence(robot, names)


def _sentence(robot: Robot, names: list[str]) -> InputError:
    part = names[0].partition(".")[0]
    described = robot.description
    place = part if described is None else described.place_of(part)
    powered = None if described is None else described.powered.get(names[0])
    rotor = "" if powered is None else f", or the motor that of its rotor ({powered.path}.inertia)"
    way_out = f"Give it an inertia, or a centre_of_mass away from the axis{rotor}."
    orders = [int(order) for order in (name.rpartition(".")[2] for name in names) if order.isdigit()]
    if orders:
        way_out = f"Give the rod at least {max(orders) + 1} points, or strains of lower orders."
    return InputError(
        f"nothing has inertia along {', '.join(names)}, so that it has no acceleration. {way_out}", field=place
    )


def _has_points(robot: Robot) -> bool:
    """Whether a part that turns freely has no moment of inertia at its stations, and no rotor."""
    inertia = (np.asarray(robot.inertia) + np.asarray(robot.added))[:, :3, :3]
    rotors = np.zeros(robot.tree.layout[-1].v.stop) if robot.rotors is None else np.asarray(robot.rotors)
    for part, place in zip(robot.tree.structure, robot.tree.layout, strict=True):
        turning = [place.v.start + i for i, name in enumerate(part.joint.names) if name in _TURNS]
        free = [i for i in turning if i in robot.tree.free_v and rotors[i] == 0]
        if free and np.linalg.matrix_rank(inertia[place.stations].sum(axis=0)) < 3:
            return True
    return False


def _has_few_points(robot: Robot) -> bool:
    """Whether a strain of a rod has more free coordinates than the rod has Gauss points."""
    for group in robot.tree.rods:
        rod = group.things
        if not isinstance(rod, SoftRod):
            continue
        counts = Counter(name.partition(".")[0] for name in rod.names)
        if max(counts.values()) > len(rod.nodes) - len(rod.marks) - 2:
            return True
    return False


def _start_mass(robot: Robot) -> Float[Array, "nv nv"]:
    return robot.mass(start_shape(robot), robot.added)
