"""Mass and displaced mass of each part of a robot."""

import math
from dataclasses import dataclass

import numpy as np

from nectosome.units import InputError

from .joints import Fixed
from .robot import Robot


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
