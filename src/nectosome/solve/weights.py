"""Weights of a whole robot: mass and displaced mass, its centres, what makes it neutral."""

from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike

from nectosome.core.programs.remember import remembered
from nectosome.description import RobotDescription
from nectosome.io.tables import number
from nectosome.mechanism import Robot
from nectosome.units import count, format_quantity, show_quantity
from nectosome.units.zero import counts_as_zero

from .floating import centres

_NEUTRAL = 1e-6  # share of the mass: less excess counts as neutral
_STEADILY = 0.1  # of the fastest vertical velocity: a mean that is less comes from going to and fro
_NAMED = 6  # at most so many prescribed coordinates, and values that no robot has, by name


class Hydrostatics(NamedTuple):
    """Masses [kg] and centres [m, world frame] of a robot in its initial pose, all of it under the surface."""

    mass: float
    displaced: float
    centre_of_mass: np.ndarray
    centre_of_buoyancy: np.ndarray


def hydrostatics(robot: Robot) -> Hydrostatics:
    """Mass, displaced mass and centres of a robot in its initial pose, all of it under the surface."""
    mass, displaced, *places = (np.asarray(x) for x in remembered(centres, robot))
    size = max(abs(np.stack(places)).max(), float(robot.body_length))
    return Hydrostatics(float(mass), float(displaced), *(np.where(counts_as_zero(x, size), 0.0, x) for x in places))


def hydrostatics_rows(description: RobotDescription, robot: Robot, found: Hydrostatics) -> list[tuple[str, str]]:
    """Return names and texts of degrees of freedom, masses and centres."""
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


def _weight(description: RobotDescription, robot: Robot, found: Hydrostatics) -> str:
    """The net weight, and the change that makes it neutral."""
    gravity, excess = description.water.gravity, found.mass - found.displaced
    if abs(excess) <= _NEUTRAL * found.mass:
        return "none: it is neutral"
    words = "" if gravity == 0 else f"{number(abs(excess) * gravity)} N {'downward' if excess > 0 else 'upward'}, "
    share = f"{number(100 * abs(excess) / found.mass)} % of its {'weight' if gravity else 'mass'}"
    left_out = "" if gravity else " (gravity is 0: neither weight nor buoyancy acts)"
    heavy = f"{number(abs(excess))} kg too {'heavy' if excess > 0 else 'light'}"
    return f"{words}{share}{left_out}; {heavy}{_way_out(description, robot, excess)}"


def sinking(description: RobotDescription, robot: Robot, velocity: ArrayLike) -> str:
    """Return that a robot with this upward velocity [m/s] over a cycle sinks or rises, why, and what to do.

    Empty where it does not, or against its weight in water.
    """
    velocity = np.asarray(velocity)
    found, mean = hydrostatics(robot), float(velocity.mean())
    excess = found.mass - found.displaced
    force = abs(excess) * description.water.gravity
    goes = abs(mean) > _STEADILY * abs(velocity).max()  # not where it is NaN
    if not goes or excess * mean >= 0 or abs(excess) <= _NEUTRAL * found.mass or force == 0:
        return ""
    does, more, less = ("sinks", "weight", "buoyancy") if excess > 0 else ("rises", "buoyancy", "weight")
    why = f"its {more} exceeds its {less} by {number(force)} N{_way_out(description, robot, excess)}"
    remedy = "Make it neutral, hold its depth by its joint, or see nectosome simulate."
    return f" It {does}, at last at {show_quantity(abs(mean), 'speed')}: {why}. {remedy}"


def _way_out(description: RobotDescription, robot: Robot, excess: float) -> str:
    """The body's mass or density with which the robot floats."""
    body = description.body
    if body is None:
        return ""
    if body.kind == "rigid" and body.mass is not None:
        name, value, dimension = "mass", body.mass - excess, "mass"
    elif body.density is not None:
        volume = float(robot.weight()[0]) / body.density
        name, value, dimension = "density", body.density - excess / volume, "density"
    else:
        return ""
    if value <= 0:
        return "; its body is lighter than that"
    return f"; neutral with body.{name} {format_quantity(float(f'{value:.6g}'), dimension)}"


def _place(xyz: np.ndarray) -> str:
    return f"({', '.join(number(float(v)) for v in xyz)}) m"
