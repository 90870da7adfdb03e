"""Results as labelled data: what users, files and plots see."""

import json
from importlib import import_module
from threading import Thread
from typing import TYPE_CHECKING, Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Solution, State, Status
from nectosome.core.remember import prepare, remembered
from nectosome.io import RobotDescription, dump_robot, provenance
from nectosome.mechanism import Diagnosis, Robot, diagnose, load_names

if TYPE_CHECKING:
    import xarray as xr


class Trajectory(eqx.Module):
    """States of a system at increasing times."""

    system: Any
    time: Float[Array, "n"]  # [s]
    state: State  # leaves [n, ...]


class Run(Solution):
    """Solution whose value is a Trajectory."""

    title: ClassVar[str] = "simulation"

    def to_dataset(self, description: RobotDescription | None = None, settings: dict[str, Any] | None = None):
        """Dataset of the run (see `dataset`); `description` and `settings` go into its attributes."""
        return dataset(self, description, settings or {})


def _diagnose_all(robot: Robot, time: Array, state: State) -> Diagnosis:
    return jax.lax.map(lambda tx: diagnose(robot, *tx), (time, state))


def prepare_dataset(robot: Robot, samples: int) -> None:
    """Get `dataset` ready for runs of that many samples, beside what goes on."""
    many = jax.tree.map(lambda x: np.broadcast_to(x, (samples, *x.shape)), robot.initial())
    prepare(_diagnose_all, robot, np.zeros(samples), many)
    Thread(target=import_module, args=("xarray",), daemon=True).start()


def dataset(run: Run, description: RobotDescription | None, settings: dict[str, Any]) -> "xr.Dataset":
    """Motion, forces by load and part, powers, energies and reactions of a robot's run, in SI units.

    `power_balance` is |dE/dt - sum of powers| relative to the largest sum of |powers| of the run: what rounding
    leaves, since accelerations, forces and energies are all taken at the saved states.
    """
    import xarray as xr

    robot, trajectory = run.value.system, run.value
    d = jax.tree.map(
        np.asarray,
        remembered(_diagnose_all, robot, trajectory.time, trajectory.state),
    )
    tree = robot.tree
    powers = np.concatenate([d.load_power.sum(axis=2), d.reaction_power], axis=1)
    scale = max(float(np.max(np.sum(np.abs(powers), axis=1))), np.finfo(float).tiny)
    balance = np.abs(d.energy_rate - np.sum(powers, axis=1)) / scale
    q = _coordinates(robot, trajectory.state.q)
    data = {
        "q": (("time", "coordinate"), q, "rad or m"),
        "v": (("time", "coordinate"), np.asarray(trajectory.state.v), "rad/s or m/s"),
        "a": (("time", "coordinate"), d.a, "rad/s2 or m/s2"),
        "position": (("time", "station", "axis"), d.position, "m"),
        "rotation": (("time", "station", "row", "axis"), d.rotation, "1"),
        "velocity": (("time", "part", "axis"), d.velocity, "m/s"),
        "load_force": (("time", "load", "part", "axis"), d.load_force, "N"),
        "load_power": (("time", "load", "part"), d.load_power, "W"),
        "line_force": (("time", "load", "station", "axis"), d.line_force, "N/m"),
        "reaction": (("time", "prescribed"), d.reaction, "N m or N"),
        "reaction_power": (("time", "prescribed"), d.reaction_power, "W"),
        "momentum": (("time", "axis"), d.momentum, "kg m/s"),
        "angular_momentum": (("time", "axis"), d.angular_momentum, "kg m2/s"),
        "energy": (("time", "form"), d.energy, "J"),
        "power_balance": (("time",), balance, "1"),
        "station_x": (("station",), np.concatenate([p.body.x for p in tree.parts]), "m"),
        "station_weight": (("station",), np.concatenate([p.body.weight for p in tree.parts]), "m"),
        "half_width": (("station", "across"), np.concatenate([p.body.half_width for p in tree.parts]), "m"),
    }
    coords = {
        "time": ("time", np.asarray(trajectory.time), {"units": "s"}),
        "coordinate": list(robot.coordinate_names),
        "prescribed": list(robot.prescribed_names),
        "part": [part.name for part in tree.parts],
        "load": list(load_names(robot)),
        "axis": ["x", "y", "z"],
        "row": ["x", "y", "z"],
        "across": ["y", "z"],
        "form": ["kinetic", "water", "elastic"],
        "station_part": ("station", np.concatenate([[p.name] * p.body.weight.shape[0] for p in tree.parts])),
    }
    status = Status(int(run.status))
    attributes = {
        "title": f"{description.name}: {run.title}" if description else run.title,
        "robot": dump_robot(description) if description else "",
        "status": status.name,
        "status_reason": status.reason,
        "provenance": json.dumps(provenance(settings)),
        **{key: np.asarray(value).item() for key, value in run.stats.items()},
    }
    return xr.Dataset(
        {name: (dims, np.asarray(values), {"units": unit}) for name, (dims, values, unit) in data.items()},
        coords=coords,
        attrs=attributes,
    )


def _coordinates(robot: Robot, q: Array) -> np.ndarray:
    """Coordinates by velocity: what joints displace, rotations in space as rotation vectors [rad]."""

    def one(q: Array) -> Array:
        out, i = [], 0
        for part in robot.tree.parts:
            if part.prescribed is None and part.joint.nv:
                out.append(part.joint.displacement(q[i : i + part.joint.nq]))
                i += part.joint.nq
            out.append(q[i : i + part.body.nq])
            i += part.body.nq
        return jnp.concatenate([jnp.zeros(0), *out])

    return np.asarray(jax.jit(jax.vmap(one))(q))
