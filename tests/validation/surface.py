"""Bodies at the water's surface: draughts, metacentres, heaving, entry."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from nectosome.core import State
from nectosome.core.programs.remember import remembered
from nectosome.mechanism import Robot
from nectosome.solve import simulate

from .case import Case, robot

G, DENSITY, SPEED = 9.81, 1000.0, 2.0
_BOX = {"kind": "rigid", "shape": "box", "length": 1.0, "width": 0.4, "height": 0.2}
_BALL = {"kind": "rigid", "shape": "spheroid", "length": 0.4, "radius": 0.2}
_HEAVE, _ROLL = {"kind": "prismatic", "axis": "z"}, {"kind": "revolute", "axis": "x"}
_SPHERE_ADDED = {"am": {"kind": "spheroid_added_mass"}}


def _floating(body: dict[str, Any], limbs: dict[str, Any] | None = None, gravity: float = G) -> Robot:
    return robot(body, limbs, density=DENSITY, surface=0.0, gravity=gravity)


def _square_of_frequency(floating: Robot) -> tuple[jnp.ndarray, jnp.ndarray]:
    """Acceleration from rest along the one joint at its start, and minus its slope."""
    x = floating.initial()
    found, slope = jax.jvp(lambda q: floating.rates(jnp.zeros(()), State(q, x.v, x.z)).v[0], (x.q,), (jnp.ones(1),))
    return found, -slope


def _frequency(body: dict[str, Any]) -> float:
    return float(np.sqrt(remembered(_square_of_frequency, _floating(body))[1]))


def _draught() -> float:
    """By the force that is left with the middle 0.2 h over the surface, and its slope."""
    middle = 0.04
    body = _BOX | {"density": 300.0, "joint": _HEAVE | {"position": middle}}
    left, stiffness = remembered(_square_of_frequency, _floating(body))
    return float(0.1 - middle - left / stiffness)


def _disc() -> float:
    """Fixed to a hinge through its middle, at the surface."""
    hinge = {"kind": "rigid", "shape": "point", "mass": 1e-9, "joint": {"kind": "revolute", "axis": "y"}}
    disc = {"kind": "rigid", "on": "body", "shape": "cylinder", "length": 0.4, "radius": 0.3, "density": 500.0}
    upright = {"rotation": (0.0, -np.pi / 2, 0.0), "offset": (0.0, 0.0, -0.2)}
    floating = _floating(hinge, {"disc": disc | upright})
    return float(np.sqrt(remembered(_square_of_frequency, floating)[1]))


def _entry() -> float:
    """Speed of a ball all of which has just come under the surface."""
    joint = _HEAVE | {"position": 0.25, "velocity": -SPEED}
    ball = _floating(_BALL | {"mass": 20.0, "joint": joint, "loads": _SPHERE_ADDED}, gravity=0.0)
    return -float(simulate(ball, 0.5, samples=2, rtol=1e-9, atol=1e-11, method="explicit").value.state.v[-1, 0])


_METACENTRE = "naval architecture: m g GM = I w^2, GM = I_w/V + KB - KG; 1 m x 0.4 m x 0.2 m, 500 kg/m3"
_WATERPLANE = "rho g times the waterplane over the mass; half sunk"
CASES = [
    Case("Floating box, 300 kg/m3", "Archimedes", "draught", "m", 0.06, 1e-9, _draught),
    Case(
        "Floating box",
        _METACENTRE,
        "roll",
        "rad/s",
        float(np.sqrt(12 * G * (0.16 / 1.2 + 0.05 - 0.1) / (0.16 + 0.04))),
        1e-6,
        lambda: _frequency(_BOX | {"density": 500.0, "joint": _ROLL}),
    ),
    Case(
        "Floating ball",
        _WATERPLANE,
        "heave",
        "rad/s",
        float(np.sqrt(1.5 * G / 0.2)),
        1e-6,
        lambda: _frequency(_BALL | {"density": 500.0, "joint": _HEAVE}),
    ),
    Case(
        "Floating ball",
        f"{_WATERPLANE}; half of the added mass 2/3 rho pi r^3",
        "heave with added mass",
        "rad/s",
        float(np.sqrt(G / 0.2)),
        1e-6,
        lambda: _frequency(_BALL | {"density": 500.0, "joint": _HEAVE, "loads": _SPHERE_ADDED}),
    ),
    Case(
        "Upright disc, r = 0.3 m, h = 0.4 m",
        "GM = h/4 + r^2/(2 h) - h/2 = 12.5 mm; 500 kg/m3, on a hinge through its middle",
        "roll",
        "rad/s",
        float(np.sqrt(G * 0.0125 / (0.0225 + 0.16 / 12))),
        1e-6,
        _disc,
    ),
    Case(
        "Ball that meets the water",
        "von Karman (1929): M V0 = (M + A) V, 20 kg, 2 m/s, A = 2/3 rho pi r^3, no gravity",
        "speed under water",
        "m/s",
        SPEED * 20 / (20 + 2 / 3 * DENSITY * np.pi * 0.008),
        1e-7,
        _entry,
    ),
]
