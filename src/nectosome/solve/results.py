"""Results as labelled data: what users, files and plots see."""

import json
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from nectosome.core import Solution, State, Status
from nectosome.core.programs.remember import prepare, remembered
from nectosome.core.rows import on_device
from nectosome.core.tracers import traced
from nectosome.description import RevoluteJoint, ServoLimits, dump_robot
from nectosome.description.ranges import NUMBERS
from nectosome.io import provenance
from nectosome.io.summary import Summary
from nectosome.mechanism import SLIDES, Diagnosis, Robot, diagnose, load_names

from .flow_numbers import flow_numbers, has_flow_numbers
from .mean_window import ROUNDING, mean_weights, mean_window
from .motor_results import motor_names, motor_results
from .soft_contacts import soft_contacts
from .stream import stands, water_velocity
from .summaries.run_summary import run_summary

if TYPE_CHECKING:
    import xarray as xr


class Trajectory(eqx.Module):
    """States of a system at increasing times."""

    system: Any
    time: Float[Array, "n"]  # [s]
    state: State  # leaves [n, ...]

    def __repr__(self) -> str:
        return f"<Trajectory: {_span(self.time)}, {self.state!r}>"


class Run(Solution):
    """Solution whose value is a Trajectory."""

    title: ClassVar[str] = "simulation"

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {_describe(self.status)}, {_span(self.value.time)}>"

    @property
    def reason(self) -> str:
        """Its status in words."""
        return Status(int(self.status)).reason

    @property
    def state(self) -> State:
        """State at the first time: of one at rest, of a steady motion, or at the start of a cycle or a simulation."""
        return jax.tree.map(lambda x: x[0] if isinstance(x, Tracer) else on_device(np.asarray(x)[0]), self.value.state)

    def results(self, settings: dict[str, Any] | None = None) -> "Results":
        """Results of the run (see `results_of`); `settings` go into their provenance."""
        return results_of(self, self.diagnosis(), settings)

    def diagnosis(self) -> Diagnosis:
        """Forces, powers and energies at all times, leaves [n, ...]."""
        trajectory = self.value
        return remembered(diagnose_all, trajectory.system, trajectory.time, trajectory.state)

    def summary(self, each: bool = False) -> Summary:
        """What the run says, as the command line prints it; with `each`, each load on each part. `print` shows it."""
        return self.results().summary(each)

    def to_dataset(self, settings: dict[str, Any] | None = None) -> "xr.Dataset":
        """The results as an `xarray.Dataset` in SI units, with the robot they are of; `settings` go into provenance."""
        return self.results(settings).to_dataset()


def at_hand(x: Any) -> Any:
    """An array of NumPy; one that is traced as it is, which a dataset may hold, too."""
    return x if isinstance(x, Tracer) else np.asarray(x)


def at_one_time(system: Any, x: State, time: float | Array = 0.0) -> Trajectory:
    """Trajectory of a single state."""
    alone = lambda x: x[None] if isinstance(x, Tracer) else on_device(np.asarray(x)[None])  # noqa: E731
    return Trajectory(system, *jax.tree.map(alone, (time, x)))


def _describe(status: Any) -> str:
    """A status in words; its shape for several ones or a traced one."""
    if isinstance(status, Tracer) or np.ndim(status):
        return f"status of shape {np.shape(status)}"
    return f"{Status(int(status)).name}, {Status(int(status)).reason}"


def _span(time: Any) -> str:
    if isinstance(time, Tracer) or np.ndim(time) != 1:
        return f"times of shape {np.shape(time)}"
    if len(time) == 1:
        return f"at {time[0]:g} s"
    return f"{len(time)} times from {time[0]:g} s to {time[-1]:g} s"


Data = dict[str, tuple[tuple[str, ...], np.ndarray, str]]  # dimensions, values, unit
Names = dict[str, tuple[str, np.ndarray, str]]  # labels along dimensions: dimension, values, unit

# quantities of a run at each time, and of a cycle as means
VARIABLES: dict[str, tuple[tuple[str, ...], str]] = {
    "velocity": (("part", "axis"), "m/s"),
    "load_force": (("load", "part", "axis"), "N"),
    "load_power": (("load", "part"), "W"),
    "reaction": (("prescribed",), "N m or N"),
    "reaction_power": (("prescribed",), "W"),
    "drive_velocity": (("prescribed",), "rad/s or m/s"),
    "energy": (("form",), "J"),
    "part_energy": (("part", "form"), "J"),
    "hinge_strain": (("part",), "1"),
    "hinge_stress": (("part",), "Pa"),
}

# the same of tendons over joints
TENDON_VARIABLES: dict[str, tuple[tuple[str, ...], str]] = {
    "tension": (("tendon",), "N"),
    "tendon_stretch": (("tendon",), "m"),
    "tendon_energy": (("tendon",), "J"),
    "tendon_heat": (("tendon",), "W"),
}


class Results(NamedTuple):
    """A run as arrays, for quick answers without the import of xarray, which takes longer than some of them."""

    data: Data
    names: Names
    attributes: dict[str, Any]

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """All values by name."""
        return {name: values for name, (_, values, _) in (*self.data.items(), *self.names.items())}

    def summary(self, each: bool = False) -> Summary:
        """What they say of a run; with `each`, each load on each part."""
        return run_summary(self.arrays, self.attributes, each)

    def to_dataset(self) -> "xr.Dataset":
        """Convert to a labelled dataset."""
        import xarray as xr

        coords = {name: (dim, values, {"units": u} if u else {}) for name, (dim, values, u) in self.names.items()}
        if "coordinate" in coords:
            coords["coordinate"][2]["comment"] = _COORDINATES
        data = {name: (dims, values, {"units": unit}) for name, (dims, values, unit) in self.data.items()}
        return xr.Dataset(data, coords=coords, attrs=self.attributes)


_COORDINATES = (
    "q in coordinate_unit, v in it per second; of a rod the Legendre coefficients of strain times length: rad of "
    "torsion and bending (curvature times length), 1 of extension and shear, of a driven strain the angle of its "
    "shaft; of free rotation a rotation vector"
)
_PLAIN = {"extension", "shear_y", "shear_z"}


def coordinate_unit(name: str) -> str:
    """SI unit of the displacement of a coordinate, by its name such as `tail.bending_z.0`."""
    words = name.split(".")
    what = words[-2] if words[-1].isdigit() else words[-1]
    return "m" if what in SLIDES else "1" if what in _PLAIN else "rad"


def diagnose_all(robot: Robot, time: Float[Array, "n"], state: State) -> Diagnosis:
    """Diagnosis at each of n times, leaves [n, ...]; where a loop updates, the mean of that before and that after.

    So the trapezoidal rule gives means of what jumps there.
    """
    if robot.update_rates is None:
        return jax.lax.map(lambda tx: diagnose(robot, *tx), (time, state))

    def mean(tx: tuple[Array, State]) -> Diagnosis:
        t, before = tx
        both = jax.tree.map(lambda *x: jnp.stack(x), before, robot.updated(t, before))
        return jax.tree.map(lambda x: jnp.mean(x, axis=0), jax.vmap(lambda x: diagnose(robot, t, x))(both))

    return jax.lax.map(mean, (time, state))


def prepare_results(robot: Robot, samples: int) -> None:
    """Compile `results` for runs of that many samples in the background."""
    prepare(diagnose_all, robot, *blank(robot, samples))


def blank(robot: Robot, samples: int) -> tuple[np.ndarray, State]:
    """Times and states with the shapes of a run."""
    return np.zeros(samples), jax.tree.map(lambda x: np.broadcast_to(x, (samples, *x.shape)), robot.initial())


def labels(robot: Robot) -> Names:
    """Names along the dimensions of a robot's results."""
    names = {
        "coordinate": robot.coordinate_names,
        "prescribed": robot.prescribed_names,
        "part": [*robot.tree.names],
        "load": load_names(robot),
        "axis": ["x", "y", "z"],
        "row": ["x", "y", "z"],
        "across": ["y", "z"],
        "form": ["kinetic", "water", "elastic"],
    }
    if has_flow_numbers(robot):
        names["number"] = [*NUMBERS]
    if robot.powered.groups:
        names |= {"motor": motor_names(robot), "battery": robot.powered.battery_names}
    if robot.load_groups.tendons:
        names |= {"tendon": robot.tendon_names}
    return {name: (name, np.asarray(values, dtype=str), "") for name, values in names.items()}


def drive_limits(robot: Robot) -> Data:
    """What the servos of prescribed joints can give at most, NaN for other joints; nothing where no limit is known."""
    description = robot.description
    limbs = {} if description is None else description.parts
    joints = {f"{part}.angle": limb.joint for part, limb in limbs.items()}
    known = {name: joint.limits for name, joint in joints.items() if isinstance(joint, RevoluteJoint) and joint.limits}
    if not known:
        return {}
    none = ServoLimits.model_construct(torque=np.nan, speed=np.nan)
    limits = [known.get(name, none) for name in robot.prescribed_names]
    return {
        "reaction_limit": (("prescribed",), np.array([limit.torque for limit in limits]), "N m"),
        "drive_velocity_limit": (("prescribed",), np.array([limit.speed for limit in limits]), "rad/s"),
    }


def attributes_of(run: Run, settings: dict[str, Any] | None = None) -> dict[str, Any]:
    """Title, robot, its forward axis, status, provenance and the solver's counts; no robot without a description."""
    status, description = Status(int(run.status)), getattr(run.value.system, "description", None)
    soft = soft_contacts(run.value.system, run.value.time, run.value.state)
    return {
        "title": f"{description.name}: {run.title}" if description else run.title,
        "robot": dump_robot(description) if description else "",
        "forward": getattr(run.value.system, "forward", "x"),
        "status": status.name,
        "status_reason": run.reason,
        "provenance": json.dumps(provenance(settings or {})),
        **({"soft_contacts": " ".join(soft)} if soft else {}),
        **{key: np.asarray(value).item() for key, value in run.stats.items()},
    }


def results_of(run: Run, d: Diagnosis, settings: dict[str, Any] | None = None) -> Results:
    """Motion, forces by load and part, powers, energies and reactions of a run diagnosed as d, leaves [n, ...]; SI.

    `power_balance` is |dE/dt - sum of powers| relative to the largest sum of |powers| of the run, or to its largest
    energy over its time where that is more, `momentum_balance` the rate of momentum less the outer forces, along the
    slides of root joints, relative to the largest sum of |forces| and |rates of momentum|. They are at rounding level,
    since accelerations, forces and energies are all evaluated at the saved states.
    """
    robot, trajectory = run.value.system, run.value
    d, tree, tiny, xp = jax.tree.map(at_hand, d), robot.tree, np.finfo(float).tiny, jnp if traced(d) else np
    powers = xp.concatenate([d.load_power.sum(axis=2), d.reaction_power], axis=1)
    time = at_hand(trajectory.time)
    span = time[-1] - time[0]
    stored = xp.max(xp.sum(d.energy, axis=1)) / xp.where(span > 0, span, 1.0)
    scale = xp.maximum(xp.maximum(xp.max(xp.sum(xp.abs(powers), axis=1)), stored), tiny)
    balance = xp.abs(d.energy_rate - xp.sum(powers, axis=1)) / scale
    pushes = xp.concatenate([d.load_force.sum(axis=2), d.momentum_rate], axis=1)
    most = xp.maximum(xp.max(xp.sum(xp.linalg.norm(pushes, axis=-1), axis=1)), tiny)
    unbalanced = xp.max(xp.abs(d.momentum_balance), axis=1, initial=0.0) / most
    data = {
        "q": (("time", "coordinate"), d.displacement, "rad or m"),
        "v": (("time", "coordinate"), at_hand(trajectory.state.v), "rad/s or m/s"),
        "a": (("time", "coordinate"), d.a, "rad/s2 or m/s2"),
        "position": (("time", "station", "axis"), d.position, "m"),
        "rotation": (("time", "station", "row", "axis"), d.rotation, "1"),
        "line_force": (("time", "load", "station", "axis"), d.line_force, "N/m"),
        "support_force": (("time", "axis"), d.support_force, "N"),
        "support_moment": (("time", "axis"), d.support_moment, "N m"),
        "momentum": (("time", "axis"), d.momentum, "kg m/s"),
        "water_momentum": (("time", "axis"), d.water_momentum, "kg m/s"),
        "angular_momentum": (("time", "axis"), d.angular_momentum, "kg m2/s"),
        "bending_strain": (("time", "station", "across"), d.bending.strain, "1"),
        "bending_stress": (("time", "station", "across"), d.bending.stress, "Pa"),
        "power_balance": (("time",), balance, "1"),
        "momentum_balance": (("time",), unbalanced, "1"),
        "station_x": (("station",), tree.stations.x, "m"),
        "station_weight": (("station",), tree.stations.weight, "m"),
        "half_width": (("station", "across"), tree.stations.half_width, "m"),
    }
    if robot.water.current is not None and not stands(robot):
        seen = remembered(water_velocity, robot, trajectory.time, d.position[:, 0])
        data["water_velocity"] = ("time", "axis"), seen, "m/s"
    data |= motor_results(robot, d)
    attributes = attributes_of(run, settings)
    if has_flow_numbers(robot):
        data["flow_number"] = ("number", "load", "part"), _flow_numbers(robot, trajectory.time, d, attributes), "1"
    if robot.load_groups.tendons:
        of_tendons = zip(TENDON_VARIABLES.items(), d.tendons, strict=True)
        data |= {name: (("time", *dims), values, unit) for (name, (dims, unit)), values in of_tendons}
    found = d._asdict() | d.bending._asdict()
    data |= {name: (("time", *dims), found[name], unit) for name, (dims, unit) in VARIABLES.items()}
    of_stations = np.array(tree.names)[tree.indices.part_of_station]
    names = labels(robot) | {
        "time": ("time", np.asarray(trajectory.time), "s"),
        "station_part": ("station", of_stations, ""),
        "coordinate_unit": ("coordinate", np.array([*map(coordinate_unit, robot.coordinate_names)], dtype=str), ""),
    }
    data = {name: (dims, at_hand(values), unit) for name, (dims, values, unit) in data.items()}
    return Results(data | drive_limits(robot), names, attributes)


def _flow_numbers(
    robot: Robot, time: Any, d: Diagnosis, attributes: dict[str, Any]
) -> Float[np.ndarray, "numbers loads parts"]:
    """Of a cycle, of the last whole beats, or of the whole run, by its samples."""
    time = np.asarray(time)
    if time.size < 2:
        return at_hand(flow_numbers(robot, time, d.flows, np.ones(1), None))
    window, start, end = mean_window(time, attributes), float(time[0]), float(time[-1])
    if not (window.beats or "period" in attributes):
        return at_hand(flow_numbers(robot, time, d.flows, mean_weights(time, start, end), None))
    period = end - window.start
    kept = time > window.start + ROUNDING * period  # what comes first comes again at the end
    time, flows = time[kept], jax.tree.map(lambda x: x[kept], d.flows)
    span = np.diff(time, append=time[0] + period)
    weights = 0.5 * (span + np.roll(span, 1)) / period
    return at_hand(flow_numbers(robot, time, flows, weights, period if time.size > 1 else None))
