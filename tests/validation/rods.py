"""Rods: large deflections, buckling, vibration.

The rods of the closed forms are 1 m long and have E I = 1 N m2, so that loads and displacements are the dimensionless
ones. They are inextensible (Kirchhoff), as the elastica is; the 45-degree bend has all six strains.
"""

from functools import cache

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from nectosome.core import State
from nectosome.mechanism import Robot

from .case import Case, robot, solve, tip

RADIUS = 5e-4
YOUNG = 4 / (np.pi * RADIUS**4)  # E I = 1 N m2
DENSITY = 1080.0
VACUUM = 1e-9  # kg/m3


@cache
def slender(upright: bool = False, water: float = VACUUM) -> Robot:
    """Rod of length 1 m and E I = 1 N m2 that bends in its x-z plane, with all the loads of the cases at zero."""
    loads = {
        "dead tip load": {"kind": "force", "force": (0.0, 0.0, 0.0)},
        "follower tip load": {"kind": "force", "force": (0.0, 0.0, 0.0), "frame": "body"},
        "dead distributed load": {"kind": "distributed_force", "force": (0.0, 0.0, 0.0)},
        "follower distributed load": {"kind": "distributed_force", "force": (0.0, 0.0, 0.0), "frame": "body"},
        "added mass": {"kind": "added_mass", "normal": 1.0},
    }
    rod = {
        "kind": "rod",
        "section": "circle",
        "length": 1.0,
        "radius": RADIUS,
        "young": YOUNG,
        "density": DENSITY,
        "strains": {"bending_y": 9},
        "points": 40,
        "rotation": (0.0, -np.pi / 2 if upright else 0.0, 0.0),
        "loads": {name.replace(" ", "_"): load for name, load in loads.items()},
    }
    return robot(rod, density=water)


def put(robot: Robot, load: str, vector: tuple[float, ...], field: str = "vector") -> Robot:
    """The robot with another force, or moment, in one of its loads."""
    (k,) = [k for k, g in enumerate(robot.load_groups.on_bodies) if load.replace(" ", "_") in g.names]
    return eqx.tree_at(lambda r: getattr(r.load_groups.on_bodies[k].load, field), robot, jnp.array([vector]))


# --- elastica --------------------------------------------------------------------------------------------------------

_ELASTICA = "the elastica, solved to the printed digits (dead tip load: Bisshop, Drucker 1945)"
_DEFLECTIONS = {
    # P L^2/EI or q L^3/EI -> shortening u/L, deflection w/L, tip angle [rad]
    ("dead tip load", 1.0): (0.05643, 0.30172, 0.46135),
    ("dead tip load", 5.0): (0.38763, 0.71379, 1.21537),
    ("dead distributed load", 1.0): (0.00875, 0.12347, 0.16512),
    ("dead distributed load", 10.0): (0.34365, 0.70020, 1.05264),
    ("follower tip load", 1.0): (0.06435, 0.32064, 0.49588),
    ("follower tip load", 5.0): (0.82772, 0.78069, 2.09816),
    ("follower distributed load", 5.0): (0.20448, 0.56042, 0.81829),
    ("follower distributed load", 15.0): (1.04563, 0.80925, 2.16949),
}


@cache
def _deflection(load: str, size: float) -> tuple[float, float, float]:
    bent = put(slender(), load, (0.0, 0.0, size))
    p, R = tip(bent, solve(bent))
    return 1 - float(p[0]), float(p[2]), float(np.arctan2(R[2, 0], R[0, 0]))


def _elastica() -> list[Case]:
    cases = []
    for (load, size), expected in _DEFLECTIONS.items():
        number = "P L^2/EI" if "tip" in load else "q L^3/EI"
        for i, quantity in enumerate(("shortening u/L", "deflection w/L", "tip angle")):
            cases.append(
                Case(
                    f"Cantilever, {load} {number} = {size:g}",
                    _ELASTICA,
                    quantity,
                    "rad" if i == 2 else "1",
                    expected[i],
                    1e-5,
                    lambda load=load, size=size, i=i: _deflection(load, size)[i],
                )
            )
    return cases


def _roll_up() -> float:
    """Distance of the tip from the root when M = 2 pi E I/L."""
    rolled = put(slender(), "dead tip load", (0.0, 2 * np.pi, 0.0), "moment")
    return float(np.linalg.norm(tip(rolled, solve(rolled))[0]))


@cache
def _bend() -> np.ndarray:
    """Tip displacement (towards the centre of the arc, along the load, along the tangent of the root) [1]."""
    arc = {
        "kind": "rod",
        "section": "rectangle",
        "length": 25 * np.pi,
        "width": 1.0,
        "height": 1.0,
        "young": 1e7,
        "poisson": 0.0,
        "density": 1.0,
        "strains": dict.fromkeys(("torsion", "bending_y", "bending_z", "extension", "shear_y", "shear_z"), 4),
        "rest": {"bending_z": (0.01,)},
        "points": 12,
    }
    free, loaded = (
        robot(arc | {"loads": {"tip": {"kind": "force", "force": (0.0, 0.0, force)}}}) for force in (0.0, 600.0)
    )
    moved = tip(loaded, solve(loaded))[0] - tip(free, free.initial())[0]
    return np.array([moved[1], moved[2], moved[0]])


# --- stability and vibration -----------------------------------------------------------------------------------------


@eqx.filter_jit
def _stiffness(robot: Robot) -> tuple[jax.Array, jax.Array]:
    """Tangent stiffness, and mass matrix, at the unloaded shape."""
    x = robot.initial()
    zero = jnp.zeros_like(x.v)
    t = jnp.zeros(())
    K = jax.jacfwd(lambda q: robot.residual(t, State(q, zero, x.z), zero))(x.q)
    return K, robot.mass_bias(t, x)[0]


def _greenhill() -> float:
    """q L^3/EI at which the smallest eigenvalue of K crosses zero; the straight shape makes K linear in q."""
    column = slender(upright=True)
    weight = put(column, "dead distributed load", (0.0, 0.0, -1.0))
    bare, loaded = (np.asarray(_stiffness(r)[0]) for r in (column, weight))
    factors = np.linalg.eigvals(np.linalg.solve(bare, bare - loaded)).real
    return float(1 / np.max(factors))


@cache
def _frequencies(wet: bool) -> np.ndarray:
    """Natural frequencies [rad/s] of a cantilever, in vacuum or in water with C_a = 1."""
    K, M = (np.asarray(m) for m in _stiffness(slender(water=1000.0 if wet else VACUUM)))
    return np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real))


def _beta(mode: int) -> float:
    """Beta L of a mode: (omega^2 rho A L^4/EI)^(1/4)."""
    return float(np.sqrt(_frequencies(False)[mode] * np.sqrt(DENSITY * np.pi * RADIUS**2)))


_VIBRATION = "cos(b) cosh(b) = -1; r/L = 0.0005, so that rotary inertia takes 2.4e-6 of the third frequency"
# Ours does not change any more: order 6 and 20 points give the same to 1e-3. Eight straight elements are a coarse arc.
_BATHE = "Bathe, Bolourchi (1979), 8 straight elements; tolerance 0.6 % of the displacement of 60"
CASES = [
    *_elastica(),
    Case("Roll-up, M = 2 pi EI/L", "closed form", "gap between tip and root, over L", "1", 0.0, 1e-6, _roll_up),
    *(
        Case("45-degree bend, R = 100, F = 600", _BATHE, f"tip displacement {along}", "1", expected, 0.35, compute)
        for along, expected, compute in (
            ("towards the centre of the arc", -13.4, lambda: float(_bend()[0])),
            ("along the load", 53.4, lambda: float(_bend()[1])),
            ("along the tangent of the root", -23.5, lambda: float(_bend()[2])),
        )
    ),
    Case(
        "Greenhill: a column buckles under its own weight",
        "Greenhill (1881)",
        "q L^3/EI",
        "1",
        7.83735,
        1e-5,
        _greenhill,
    ),
    *(
        Case("Cantilever, natural frequencies", _VIBRATION, f"beta L, mode {mode + 1}", "1", expected, 3e-5, compute)
        for mode, expected, compute in (
            (0, 1.87510, lambda: _beta(0)),
            (1, 4.69409, lambda: _beta(1)),
            (2, 7.85476, lambda: _beta(2)),
        )
    ),
    Case(
        "Cantilever in water, 1080 kg/m3, C_a = 1",
        "sqrt(1080/2080)",
        "first frequency in water over that in vacuum",
        "1",
        0.72058,
        1e-5,
        lambda: float(_frequencies(True)[0] / _frequencies(False)[0]),
    ),
]
