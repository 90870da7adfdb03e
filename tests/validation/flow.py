"""Bodies in water: falling, oscillating, swimming."""

from functools import cache
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Load, State, Strips, Water
from nectosome.loads import lamb_coefficients
from nectosome.mechanism import Robot, diagnose, load_names
from nectosome.mechanism.diagnose import ADDED_MASS
from nectosome.solve import simulate

from .case import Case, robot

# --- added mass of a spheroid ----------------------------------------------------------------------------------------

_LAMB = {2.0: (0.2100, 0.7042, 0.2394), 5.0: (0.0591, 0.8943, 0.6999)}


def _lamb() -> list[Case]:
    return [
        Case(
            f"Added mass of a prolate spheroid, a/b = {ratio:g}",
            "Lamb (1932), art. 115, 373",
            quantity,
            "1",
            expected[i],
            5e-5,
            lambda ratio=ratio, i=i: float(lamb_coefficients(jnp.asarray(ratio))[i]),
        )
        for ratio, expected in _LAMB.items()
        for i, quantity in enumerate(("k1, along", "k2, across", "k', turning"))
    ]


# --- a cylinder that falls, and one that swings ----------------------------------------------------------------------

CD, CA, DIAMETER, LENGTH = 1.1, 1.0, 0.010, 0.1
_FALL = "closed form, C_d = 1.1, C_a = 1, 10 mm, 1200 kg/m3, g = 9.81 m/s2"


def _cylinder(density: float, joint: dict[str, Any], **water) -> Robot:
    loads = {"drag": {"kind": "drag", "normal": CD}, "added_mass": {"kind": "added_mass", "normal": CA}}
    body = {"kind": "rigid", "shape": "cylinder", "length": LENGTH, "radius": DIAMETER / 2, "density": density}
    return robot(body | {"joint": joint, "loads": loads}, **water)


def _falling() -> Robot:
    return _cylinder(1200.0, {"kind": "prismatic", "axis": "z"}, gravity=9.81)


def _terminal_speed() -> float:
    return -float(simulate(_falling(), 3.0, samples=2, rtol=1e-7, atol=1e-9, method="explicit").value.state.v[-1, 0])


def _first_acceleration() -> float:
    falling = _falling()
    return -float(eqx.filter_jit(falling.rates)(jnp.zeros(()), falling.initial()).v[0])


@cache
def _morison(part: str) -> float:
    """Amplitude of the first harmonic of the drive's force in phase with the acceleration, or with the velocity."""
    amplitude, frequency = 0.02, 1.5
    sine = {"kind": "sine", "amplitude": amplitude, "frequency": frequency}
    swinging = _cylinder(1200.0, {"kind": "prismatic", "axis": "y", "motion": sine})
    phase = 2 * np.pi * np.arange(256) / 256
    force = _drive(swinging, jnp.asarray(phase / (2 * np.pi * frequency)))[:, 0]
    omega, area = 2 * np.pi * frequency, np.pi * DIAMETER**2 / 4
    if part == "inertia":
        return float(-2 * np.mean(force * np.sin(phase)) / (1000 * area * LENGTH * amplitude * omega**2))
    return float(2 * np.mean(force * np.cos(phase)) / (0.5 * 1000 * DIAMETER * LENGTH * (amplitude * omega) ** 2))


@eqx.filter_jit
def _drive(robot: Robot, times: Array) -> Float[Array, "times prescribed"]:
    return jax.vmap(lambda t: diagnose(robot, t, robot.initial()).reaction)(times)


# --- a swimmer held to a small travelling wave -----------------------------------------------------------------------

RADIUS, SPEED, WAVE_SPEED, WAVENUMBER, HEIGHT = 0.01, 0.7, 1.0, 2 * np.pi, 1e-3
OMEGA = WAVENUMBER * WAVE_SPEED
_ORDER = 11


class TailWake(Load):
    r"""What a slender body sheds at its tail (Lighthill 1971); v of the tail, x along the body:

    $$ f = m \left( -\tfrac12 (v_y^2 + v_z^2),\ v_x v_y,\ v_x v_z \right) $$
    """

    mass: Float[Array, ""]  # added mass per length at the tail [kg/m]

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Force on the last station."""
        vx, vy, vz = strips.velocity[-1]
        f = self.mass * jnp.stack([-0.5 * (vy**2 + vz**2), vx * vy, vx * vz])
        return jnp.zeros((strips.weight.shape[0], 6)).at[-1, 3:].set(f), z


def _swimmer() -> Robot:
    """A rod of 1 m, towed along -x at SPEED; its root sways and turns, its curvature is set from outside."""
    wave = {"kind": "sine", "frequency": OMEGA / (2 * np.pi)}
    sway = {"kind": "prismatic", "axis": "y", "motion": wave | {"amplitude": HEIGHT, "phase": np.pi}}
    slope = wave | {"amplitude": HEIGHT * WAVENUMBER, "phase": np.pi / 2}
    point = {"kind": "rigid", "shape": "point", "mass": 1e-3}
    rod = {
        "kind": "rod",
        "on": "sway",
        "section": "circle",
        "length": 1.0,
        "radius": RADIUS,
        "young": 1.0,
        "density": 1000.0,
        "strains": {"bending_z": _ORDER},
        "points": 40,
        "joint": {"kind": "revolute", "axis": "z", "motion": slope},
        "loads": {
            "drag": {"kind": "drag", "normal": 1.1},
            "added_mass": {"kind": "added_mass", "normal": 1.0},
        },
    }
    tow = {"kind": "prismatic", "axis": "x", "motion": {"kind": "rate", "rate": -SPEED}}
    bare = robot(point | {"joint": tow}, {"sway": point | {"joint": sway}, "rod": rod})
    return bare.with_load("rod", TailWake(jnp.asarray(1000 * np.pi * RADIUS**2)), "wake")


def _wave(t: Array) -> Float[Array, "nq"]:
    """Legendre coefficients of the curvature -a k^2 sin(k x - omega t) of the wave y = a sin(k x - omega t)."""
    s, w = np.polynomial.legendre.leggauss(40)
    P = np.polynomial.legendre.legvander(s, _ORDER) * (2 * np.arange(_ORDER + 1) + 1) / 2
    return -HEIGHT * WAVENUMBER**2 * (P.T * w) @ jnp.sin(WAVENUMBER * 0.5 * (s + 1) - OMEGA * t)


@eqx.filter_jit
def _forces_over_a_cycle(swimmer: Robot, times: Array) -> tuple[Array, Array]:
    """Force along x of each load on the robot, and of the water it carries [times, loads], [times]."""

    def one(t: Array) -> tuple[Array, Array]:
        q, v = jax.jvp(_wave, (t,), (jnp.ones(()),))
        a = jax.jvp(lambda t: jax.jvp(_wave, (t,), (jnp.ones(()),))[1], (t,), (jnp.ones(()),))[1]
        forces = jnp.sum(diagnose(swimmer, t, State(q, v, swimmer.initial().z), a).load_force[..., 0], axis=1)
        water = load_names(swimmer).index(ADDED_MASS)
        return forces[:water], forces[water]

    return jax.lax.map(one, times)


@cache
def _mean_thrust() -> dict[str, float]:
    """Mean force towards -x over a cycle [N], load by load."""
    swimmer = _swimmer()
    times = jnp.linspace(0, 2 * np.pi / OMEGA, 32, endpoint=False)
    of_loads, of_water = (np.asarray(x) for x in _forces_over_a_cycle(swimmer, times))
    names = [a.name for a in swimmer.loads if not a.load.inertial]
    return dict(zip(names, -of_loads.mean(axis=0), strict=True)) | {"added_mass": float(-of_water.mean())}


def _lighthill() -> float:
    """Mean of reaction and wake over m/2 (<h_t^2> - U^2 <h_x^2>)."""
    thrust = _mean_thrust()["added_mass"] + _mean_thrust()["wake"]
    mass = 1000 * np.pi * RADIUS**2
    return thrust / (0.5 * mass * 0.5 * HEIGHT**2 * (OMEGA**2 - (SPEED * WAVENUMBER) ** 2))


def _closed_body() -> float:
    """Mean of the reaction alone, over the thrust that Lighthill's wake gives."""
    return _mean_thrust()["added_mass"] / _mean_thrust()["wake"]


def _resistive() -> float:
    """Mean of the drag's thrust over rho r C_n U L (a k)^2/2 (c - U)."""
    small = 1000 * RADIUS * CD * SPEED * 0.5 * (HEIGHT * WAVENUMBER) ** 2 * (WAVE_SPEED - SPEED)
    return _mean_thrust()["drag"] / small


_SMALL = "travelling wave y = a sin(k x - w t), a = 0.001, k = 2 pi, U/c = 0.7"
CASES = [
    *_lamb(),
    Case("Falling cylinder", _FALL, "terminal speed", "m/s", 0.16738, 5e-6, _terminal_speed),
    Case("Falling cylinder", _FALL, "first acceleration", "m/s2", 0.89182, 5e-6, _first_acceleration),
    Case(
        "Oscillating cylinder",
        "Morison et al. (1950)",
        "force in phase with the acceleration over rho V a w^2: density ratio + C_a",
        "1",
        2.2,
        1e-9,
        lambda: _morison("inertia"),
    ),
    Case(
        "Oscillating cylinder",
        "Morison et al. (1950); |cos| cos has the first harmonic 8/(3 pi)",
        "force in phase with the velocity over rho D L (a w)^2/2: 8/(3 pi) C_d",
        "1",
        8 / (3 * np.pi) * 1.1,
        1e-4,
        lambda: _morison("drag"),
    ),
    Case(
        "Swimmer, reactive force and shed wake",
        f"Lighthill (1970, 1971); {_SMALL}; the wake is a load written for this case",
        "mean thrust over m/2 (<h_t^2> - U^2 <h_x^2>)",
        "1",
        1.0,
        1e-3,
        _lighthill,
    ),
    Case(
        "Swimmer, reactive force without a wake",
        f"d'Alembert; {_SMALL}",
        "mean thrust of the added mass over that of the wake",
        "1",
        0.0,
        1e-6,
        _closed_body,
    ),
    Case(
        "Swimmer, resistive force",
        f"Gray, Hancock (1955) with the drag linearised about U; {_SMALL}",
        "mean thrust over rho r C_n U L (a k)^2/2 (c - U)",
        "1",
        1.0,
        1e-3,
        _resistive,
    ),
]
