"""Young's modulus from the static weights test (Fig. 5): deflected shapes, synthetic, and what they say about E."""

from importlib.resources import files
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float
from scipy.optimize import least_squares
from scipy.special import stdtrit

from nectosome.core import Status
from nectosome.description import RobotDescription, apply_settings, parse_robot
from nectosome.mechanism import Robot, SoftRod
from nectosome.model import bind
from nectosome.solve import load_stepping

TRUTH = 7.9e6  # Pa: what the paper found
_NOISE = 1e-3  # m, of a marker read off a photograph
_CASES = {"low": 0.5, "middle": 0.3, "high": 0.1}  # N, a weight at one of three places at a time
_MARKERS = (0.4, 0.55, 0.7, 0.85, 1.0)  # fractions of the filament that are seen


class Stiffness(NamedTuple):
    """An estimate of Young's modulus [Pa] with its 95 % interval, and the shapes behind it."""

    young: float
    low: float
    high: float
    shapes: xr.Dataset


def stiffness_test(seed: int = 1) -> Stiffness:
    """Identify Young's modulus from synthetic photographs of the filament under weights.

    The photographs are made by a finer model (strain order 5, 20 Gauss points) with E = 7.9 MPa and 1 mm of noise.
    Least squares over log E; the interval is that of the linearised fit, residual variance and Student's t.
    """
    text = files("nectosome.papers.flagellum").joinpath("weights_test.yaml").read_text(encoding="utf-8")
    description = parse_robot(text)
    finer = ["limbs.filament.strains={torsion: 3, bending_y: 5, bending_z: 3}", "limbs.filament.points=20"]
    seen = _markers(apply_settings(description, finer))(TRUTH)
    seen = seen + _NOISE * np.random.default_rng(seed).normal(size=seen.shape)
    model = _markers(description)
    fit = least_squares(lambda e: ((model(np.exp(e[0])) - seen) / _NOISE).ravel(), [np.log(3e6)], diff_step=1e-4)
    free = seen.size - 1
    spread = np.sqrt(2 * fit.cost / free / np.sum(fit.jac**2)) * stdtrit(free, 0.975)
    young = float(np.exp(fit.x[0]))
    low, high = (float(np.exp(fit.x[0] + sign * spread)) for sign in (-1, 1))
    shapes = xr.Dataset(
        {
            "measured": (("case", "marker", "axis"), seen, {"units": "m", "source": "synthetic"}),
            "fitted": (("case", "marker", "axis"), model(young), {"units": "m"}),
        },
        coords={
            "case": list(_CASES),
            "marker": list(_MARKERS),
            "axis": ["x", "z"],
            "weight": ("case", [*_CASES.values()]),
        },
        attrs={"young": young, "young_low": low, "young_high": high, "truth": TRUTH, "synthetic": "yes"},
    )
    return Stiffness(young, low, high, shapes)


def _markers(description: RobotDescription):
    """Function of E [Pa]: positions of the markers in the plane of bending [case, marker, 2] in the world [m]."""
    paths = ("limbs.filament.young", *(f"limbs.filament.loads.{case}.force.2" for case in _CASES))
    _, from_theta = bind(description, paths)

    @jax.jit
    def positions(theta: Float[Array, "4"]) -> tuple[Array, Array]:
        robot: Robot = from_theta(theta)
        solution = load_stepping(robot)
        q, *_ = robot.tree.complete(jnp.zeros(()), solution.value.q, solution.value.v)
        rod = robot.tree.part("filament")
        body, first = robot.tree.parts[rod].body, robot.tree.layout[rod].stations.start
        if not isinstance(body, SoftRod):
            raise TypeError("static test: the filament is no rod")
        at = [first + int(np.flatnonzero(np.equal(body.nodes, mark))[-1]) for mark in _MARKERS]
        return robot.tree.shape(q).position[np.array(at)][:, np.array([0, 2])], solution.status

    def shapes(young: float) -> np.ndarray:
        out = []
        for case, weight in _CASES.items():
            loads = [-weight if name == case else 0.0 for name in _CASES]
            position, status = positions(jnp.array([young, *loads]))
            if int(status) != Status.SOLVED:
                raise RuntimeError(f"static test: weight {case}, E = {young:.4g} Pa: {Status(int(status)).reason}")
            out.append(np.asarray(position))
        return np.array(out)

    return shapes
