"""How a robot lies in the water as it starts: what it weighs there, what would make it float, where its centres are."""

from typing import TYPE_CHECKING, NamedTuple

from nectosome.cli.page import number
from nectosome.description import RobotDescription
from nectosome.units import count, format_quantity

if TYPE_CHECKING:
    import numpy as np

    from nectosome.mechanism import Robot

_NEUTRAL = 1e-6  # of the mass: what is as little too heavy floats
_NAMED = 6  # at most so many prescribed coordinates by name


class Afloat(NamedTuple):
    """A robot as it starts: masses [kg], centres [m, world frame]."""

    mass: float
    displaced: float
    centre_of_mass: "np.ndarray"
    centre_of_buoyancy: "np.ndarray"  # of all that it displaces once under water


def afloat(robot: "Robot") -> Afloat:
    """Lay a robot into the water, all of it under the surface."""
    import numpy as np

    from nectosome.core.remember import remembered
    from nectosome.mechanism.start_poses import start_poses

    rotation, position = map(np.asarray, remembered(start_poses, robot))
    inertia = np.asarray(robot.inertia)
    mass = inertia[:, 3, 3]
    first = inertia[:, :3, 3:]  # m [c]: the first moment of mass in each station's frame
    moment = np.stack([first[:, 2, 1], first[:, 0, 2], first[:, 1, 0]], axis=-1)
    moment = mass[:, None] * position + np.einsum("nij,nj->ni", rotation, moment)
    displaced = float(robot.water.density) * np.concatenate([np.asarray(p.body.volume) for p in robot.tree.parts])
    return Afloat(
        float(mass.sum()),
        float(displaced.sum()),
        moment.sum(axis=0) / mass.sum(),
        (displaced[:, None] * position).sum(axis=0) / max(displaced.sum(), np.finfo(float).tiny),
    )


def told(description: RobotDescription, robot: "Robot", found: Afloat) -> list[tuple[str, str]]:
    """Return freedoms, masses and centres in words, by name."""
    free, driven = robot.coordinate_names, robot.prescribed_names
    moves = f"{count(len(free), 'degree')} of freedom, {len(driven)} prescribed"
    if driven:
        moves += f": {', '.join(driven[:_NAMED])}{', ...' if len(driven) > _NAMED else ''}"
    rows = [("moves", moves), ("mass", f"{number(found.mass)} kg, displaces {number(found.displaced)} kg")]
    rows.append(("weight in water", _weight(description, robot, found)))
    rows.append(("centre of mass", _place(found.centre_of_mass)))
    if found.displaced > 0:
        rows.append(("centre of buoyancy", _place(found.centre_of_buoyancy)))
    return rows


def _weight(description: RobotDescription, robot: "Robot", found: Afloat) -> str:
    """The net weight, and what would make it none."""
    gravity, excess = description.water.gravity, found.mass - found.displaced
    if abs(excess) <= _NEUTRAL * found.mass:
        return "none: it is neutral"
    words = "" if gravity == 0 else f"{number(abs(excess) * gravity)} N {'downward' if excess > 0 else 'upward'}, "
    share = f"{number(100 * abs(excess) / found.mass)} % of its {'weight' if gravity else 'mass'}"
    left_out = "" if gravity else " (gravity is 0: neither weight nor buoyancy acts)"
    heavy = f"{number(abs(excess))} kg too {'heavy' if excess > 0 else 'light'}"
    return f"{words}{share}{left_out}; {heavy}{_way_out(description, robot, excess)}"


def _way_out(description: RobotDescription, robot: "Robot", excess: float) -> str:
    """The body's mass or density with which the robot floats."""
    body = description.body
    if body.kind == "rigid" and body.mass is not None:
        name, value, dimension = "mass", body.mass - excess, "mass"
    elif body.density is not None:
        volume = float(robot.weight()[0]) / body.density
        name, value, dimension = "density", body.density - excess / volume, "density"
    else:
        return ""
    if value <= 0:
        return "; more than its body can give up"
    return f"; neutral with body.{name} {format_quantity(float(f'{value:.6g}'), dimension)}"


def _place(xyz: "np.ndarray") -> str:
    return f"({', '.join(number(float(v) if abs(v) > 1e-12 else 0.0) for v in xyz)}) m"
