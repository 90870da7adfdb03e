"""What a robot is made of: mass, displaced mass and degrees of freedom of each part."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from nectosome.units import InputError

if TYPE_CHECKING:
    from nectosome.mechanism import Robot


@dataclass(frozen=True)
class Weighed:
    """A part as built: masses [kg], and the names of its degrees of freedom."""

    name: str
    mass: float
    displaced: float
    freedoms: tuple[str, ...]


def weigh(robot: "Robot", source: str) -> list[Weighed]:
    """Weigh the parts of a robot; `source` names it. Raises InputError where a mass is no positive number.

    A part that is fixed to another may have none.
    """
    import numpy as np

    from nectosome.mechanism import Fixed

    density = float(robot.water.density)
    inertia, names = np.asarray(robot.inertia), robot.coordinate_names
    parts = []
    for part, place in zip(robot.tree.parts, robot.tree.layout, strict=True):
        mass = float(np.sum(inertia[place.stations, 3, 3]))
        displaced = float(np.sum(np.asarray(part.body.volume))) * density
        weightless = mass == 0 and isinstance(part.joint, Fixed)  # such as a float whose mass is with the body's
        if not ((0 < mass < math.inf or weightless) and displaced < math.inf):
            why = f"the mass of {part.name} comes to {mass:.3g} kg, what it displaces to {displaced:.3g} kg."
            raise InputError(f"{why} Look at its sizes and densities.", file=source)
        freedoms = tuple(name.partition(".")[2] for name in names if name.partition(".")[0] == part.name)
        parts.append(Weighed(part.name, mass, displaced, freedoms))
    return parts
