"""An example of every load, with the dimensions of its numbers."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import nectosome.loads as ld
from nectosome.core import JointLoad, Load, Rate
from nectosome.core.se3 import exp_so3

NUMBER, LENGTH, AREA, MASS, INERTIA = (0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (2, 1, 0)
SPEED, ACCELERATION, RATE, DENSITY = (1, 0, -1), (1, 0, -2), (0, 0, -1), (-3, 1, 0)
FORCE, MOMENT, LINE_FORCE = (1, 1, -2), (2, 1, -2), (0, 1, -2)


class Example(NamedTuple):
    """A load to try, the dimension (powers of length, mass, time) of its parameters, and what it is fixed to.

    Parameters of what a load holds have names with a dot.
    """

    load: Load | JointLoad
    dimensions: dict[str, tuple[int, int, int]] = {}  # noqa: RUF012
    vertical: bool = False  # singles out the direction of gravity
    turns: tuple[str, ...] = ()  # vectors given in the world's axes
    joint: str = "revolute"


def _force(follower: bool) -> ld.PointForce:
    moment, vector, arm = jnp.array([0.1, -0.2, 0.3]), jnp.array([1.0, 2.0, -0.5]), jnp.array([0.05, -0.02, 0.03])
    return ld.PointForce(moment, vector, arm, 2, follower)


def _jet(crank: Rate | None) -> ld.Jet:
    """Of 1 L; filling at the angle and speed of the crank."""
    volume, along = 1e-3 * _n([1.0, 0.9, 0.7, 0.8]), _n([2.0, -1.0, 2.0]) / 3
    return ld.Jet(volume, _n(1.3e-3), _n(1e-3), _n(0.5), _n(0.3), _n(1e6), along, _THREE, crank)


def _leg(speed: Array | None) -> ld.Leg:
    return ld.Leg(
        0.01 * _DEAD_VECTOR,
        *(_n(0.01), _n([0.0, -0.03]), _n(0.05), speed, _n(0.4)),
        ld.GroundContact(_n(200.0), _n(0.8), _n(0.6), _n(0.01), pulls=False),
        *(_n(0.5), _n(0.3), _n(0.4), _n(2.0)),
    )


def _thruster(hand: float) -> ld.Thruster:
    """With other coefficients backward, as most have."""
    numbers = _n([0.2, 0.46, 0.42, 0.07, 0.05, 0.3, 0.06])
    return ld.Thruster(*numbers, direction=_n([2.0, -1.0, 2.0]) / 3, hand=_n(hand))


def _foil(kind: type[ld.Foil], sections: int, **more) -> ld.Foil:
    """With axes of the part's own."""
    own = (_n(3.0), _n(0.01), None, _n(1.4), _n(0.9), _n(0.8), _n(0.3), _n(0.02))
    return kind(exp_so3(_n([0.4, -0.3, 0.2])), _n([0.03, 0.05, 0.04, 0.02])[:sections], *own, **more)


def _starting(length: Array | None, **more) -> ld.StartingPlateDrag:
    own = {"extra": _n([2.0, 1.0]), "distance": _n([0.2, 1.5]), "softness": _n(0.3), "length": length}
    return ld.StartingPlateDrag(_n(1.1), **own, rows=(0, 1, 2, 3), **more)


_n = jnp.asarray
_TETRAHEDRON = jnp.array([[-1.0, -1, -1], [3, -1, -1], [-1, 3, -1], [-1, -1, 3]])[
    jnp.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
] * jnp.array([0.03, 0.02, 0.04])
_THREE = jnp.array([0.02, 0.03, 0.05])
_JET = {"volume": (3, 0, 0), "nozzle": AREA, "inlet": AREA, "bell": NUMBER, "wake": NUMBER, "elastance": (-4, 1, -2)}
_JET |= {"direction": NUMBER, "place": LENGTH}
_POINT = {"moment": MOMENT, "vector": FORCE, "arm": LENGTH}
_STOP = {"at": NUMBER, "stiffness": MOMENT, "damping": (2, 1, -1), "softness": NUMBER}
_LINEAR_STOP = {"at": LENGTH, "stiffness": LINE_FORCE, "damping": (0, 1, -1), "softness": LENGTH}
_DEAD_VECTOR = jnp.array([0.5, -1.0, 2.0])
_LEG = {
    **dict.fromkeys(("hip", "crank", "bearing", "length", "contact.softness"), LENGTH),
    **dict.fromkeys(("start", "damping_ratio", "count", "contact.static_friction", "contact.dynamic_friction"), NUMBER),
    "contact.stiffness": LINE_FORCE,
    **dict.fromkeys(("tangential", "normal"), (-1, 1, 0)),
}
_THRUSTER = {"diameter": LENGTH, "direction": NUMBER, "hand": NUMBER}
_THRUSTER |= dict.fromkeys(("thrust", "thrust_slope", "torque", "torque_slope", "backward_thrust"), NUMBER)
_THRUSTER |= {"backward_torque": NUMBER}
_FOIL = {"axes": NUMBER, "half_chord": LENGTH, "aspect_ratio": NUMBER, "thickness": LENGTH, "broadside": NUMBER}
_FOIL |= {"lift": NUMBER, "suction": NUMBER, "stall": NUMBER, "softness": SPEED}
_STARTING = {"normal": NUMBER, "extra": NUMBER, "distance": NUMBER, "softness": SPEED}
EXAMPLES = [
    Example(
        ld.StripDrag(_n(1.1), _n(0.2), _n(-0.1)),
        {"normal": NUMBER, "tangential": NUMBER, "lift": NUMBER},
    ),
    Example(ld.LumpedDrag(_THREE, 1e-4 * _THREE), {"drag_area": AREA, "rotational": (5, 0, 0)}),
    Example(ld.PlateDrag(_n(1.1)), {"normal": NUMBER}),
    Example(ld.PlateDrag(_n(1.1), _n(0.03)), {"normal": NUMBER, "amplitude": LENGTH}),
    Example(_starting(None), _STARTING),
    Example(_starting(_n(0.6)), _STARTING | {"length": LENGTH}),
    Example(ld.StripAddedMass(_n(0.9), _n(0.1)), {"normal": NUMBER, "tangential": NUMBER}),
    Example(ld.StripAddedMass(_n(0.9), _n(0.1), separated=True), {"normal": NUMBER, "tangential": NUMBER}),
    Example(
        ld.StripAddedMass(_n(0.9), _n(0.1), _n(0.4), _n(0.3)),
        {"normal": NUMBER, "tangential": NUMBER, "wavelength": LENGTH, "length": LENGTH},
    ),
    Example(
        ld.GivenAddedMass(jnp.diag(_THREE) + 0.01, 0.01 * jnp.outer(_THREE, _THREE), 0.1 * jnp.diag(_THREE)),
        {"mass": MASS, "coupling": tuple(np.add(MASS, LENGTH)), "rotational": INERTIA},
    ),
    Example(
        ld.MeshAddedMass(jnp.diag(_THREE) + 0.01, 0.01 * jnp.outer(_THREE, _THREE), 0.1 * jnp.diag(_THREE)),
        {"mass": (3, 0, 0), "coupling": (4, 0, 0), "rotational": (5, 0, 0)},
    ),
    Example(ld.SpheroidAddedMass(_n(0.1), _n(0.03)), {"half_length": LENGTH, "radius": LENGTH}),
    Example(
        ld.CylinderAddedMass(_n(0.2), _n(0.03), _n(0.9)), {"length": LENGTH, "radius": LENGTH, "coefficient": NUMBER}
    ),
    Example(
        ld.CylinderAddedMass(_n(0.2), _n(0.03), _n(0.9), separated=True),
        {"length": LENGTH, "radius": LENGTH, "coefficient": NUMBER},
    ),
    Example(_leg(_n(5.0)), _LEG | {"speed": RATE}, vertical=True),
    Example(_leg(None), _LEG, vertical=True),
    Example(ld.Weight(), vertical=True),
    Example(ld.Buoyancy(), vertical=True),
    Example(ld.MeshBuoyancy(_TETRAHEDRON, _n(0.8)), {"corners": LENGTH, "share": NUMBER}, vertical=True),
    Example(_force(follower=False), _POINT, turns=("moment", "vector")),
    Example(_force(follower=True), _POINT),
    Example(ld.LineForce(_DEAD_VECTOR, False), {"vector": LINE_FORCE}, turns=("vector",)),
    Example(ld.LineForce(_DEAD_VECTOR, True), {"vector": LINE_FORCE}),
    Example(_jet(Rate(_n(-9.0), _n(2.5))), _JET | {"crank.rate": RATE, "crank.start": NUMBER}),
    Example(_jet(None), _JET),
    Example(
        ld.NearFloor(_THREE, _THREE, 1e-4 * _THREE, _n(-0.02), _n(0.03)),
        {"mass": MASS, "drag_area": AREA, "rotational": (5, 0, 0), "full": LENGTH, "none": LENGTH},
        vertical=True,
    ),
    Example(
        ld.PulsedThrust(_n([1.0, -0.2, 0.3, 0.7]), *map(_n, (11.0, 9.0, 0.4)), _n([2.0, -1.0, 2.0]) / 3, _THREE),
        {"values": FORCE, "rated": RATE, "speed": RATE, "start": NUMBER, "direction": NUMBER, "place": LENGTH},
    ),
    Example(_thruster(1.0), _THRUSTER),
    Example(_thruster(-1.0), _THRUSTER),
    Example(  # without walls, as everywhere here; `test_wall_contact` has some
        ld.WallContact(*map(_n, (0.1, 200.0, 20.0, 1e-3))),
        {"reach": LENGTH, "stiffness": LINE_FORCE, "damping": (0, 1, -1), "softness": LENGTH},
    ),
    Example(
        ld.SheetAddedMass(_n(0.9), 1e-4 * _n([3.0, 2.0, 5.0, 4.0]), 1e-7 * _n([1.0, 0.0, 3.0, 2.0])),
        {"normal": NUMBER, "carried": (3, 0, 0), "turned": (5, 0, 0)},
    ),
    Example(
        ld.BellJet(_n([[1.4, -0.4], [-0.3, 1.3]]), *map(_n, (2e-4, 0.8, 0.3))),
        {"ends": NUMBER, "flat": (3, 0, 0), "contraction": NUMBER, "refill": NUMBER},
    ),
    Example(ld.Membrane(_n([2.0, 3.0]), _n([0.2, 0.3])), {"tension": FORCE, "unstressed": LENGTH}),
    Example(ld.SkinFriction(_n(0.6)), {"length": LENGTH}),
    Example(ld.StokesDrag(_n(0.6), False), {"wavelength": LENGTH}),
    Example(ld.StokesDrag(_n(0.6), True), {"wavelength": LENGTH}),
    Example(ld.TrailingEdge(_n(0.9), _n(0.5), None, None), {"normal": NUMBER, "softness": SPEED}),
    Example(
        ld.TrailingEdge(_n(0.9), _n(0.5), _n([0.1, 0.02, -0.03]), exp_so3(_n([0.4, -0.3, 0.2]))),
        {"normal": NUMBER, "softness": SPEED, "arm": LENGTH, "turned": NUMBER},
    ),
    Example(
        ld.LaggedTrailingEdge(_n(0.9), _n(0.5), None, None, _n(0.08)),
        {"normal": NUMBER, "softness": SPEED, "chord": LENGTH},
    ),
    Example(
        _foil(ld.RigidFoil, 2, place=_n([[0.01, 0.02, -0.1], [-0.01, 0.0, 0.1]]), width=_n([0.2, 0.15])),
        _FOIL | {"place": LENGTH, "width": LENGTH},
    ),
    Example(_foil(ld.RodFoil, 4), _FOIL),
    Example(ld.Spring(_n(3.0), _n(0.2)), {"stiffness": MOMENT, "rest": NUMBER}),
    Example(ld.Spring(_n(3.0), _n(0.2)), {"stiffness": LINE_FORCE, "rest": LENGTH}, joint="prismatic"),
    Example(ld.Spring(_n(3.0), _n(0.2), ld.FlexureSpring(_n(0.1), _n(5.0))), {"stiffness": MOMENT, "rest": NUMBER}),
    Example(ld.Damper(_n(0.7)), {"damping": (2, 1, -1)}),
    Example(ld.Damper(_n(0.7)), {"damping": (0, 1, -1)}, joint="prismatic"),
    Example(ld.JointFriction(_n(0.7), _n(0.02)), {"limit": MOMENT, "slip": NUMBER}),
    Example(ld.JointFriction(_n(0.7), _n(0.02)), {"limit": FORCE, "slip": LENGTH}, joint="prismatic"),
    Example(ld.LowerLimit(_n(0.9), _n(10.0), _n(0.01), _n(0.8)), _STOP),
    Example(ld.UpperLimit(_n(-0.3), _n(10.0), _n(0.01), _n(0.8)), _STOP),
    Example(ld.UpperLimit(_n(0.3), _n(10.0), _n(0.01), _n(0.8)), _LINEAR_STOP, joint="prismatic"),
]
