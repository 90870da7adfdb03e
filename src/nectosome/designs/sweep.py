"""Sweeps: cycle averages and peaks of a robot's motion at every point of a grid of its quantities."""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from nectosome.core import Status
from nectosome.description import dump_robot, resolve, with_values
from nectosome.drives.motor import SATURATION_WIDTH
from nectosome.io import provenance
from nectosome.model.inputs import RobotLike
from nectosome.search.executors.processes import processors
from nectosome.solve import CycleMeans, mean_data
from nectosome.solve.equal_limbs import EQUAL_LIMBS
from nectosome.units import InputError, check_names, check_share, check_whole
from nectosome.units.zero import counts_as_zero

from .axes import AxisValues, axis_of, check_each_once, each_structure, set_paths, structures_of
from .batches import RobotBatch, RobotPoints, batches_of
from .kept_parts import Part, Parts, Progress
from .prediction_intervals import HIGH, LOW, depend, shares_of, widened
from .uncertain_runs import drawn_places, draws_of, with_left_open

if TYPE_CHECKING:
    import xarray as xr

MEANS = ("speed", "turn_rate", "power", "efficiency", "cost_of_transport")
MORE_MEANS = (
    "forward_speed",
    "speed_over_ground",
    "body_lengths_per_second",
    "tail_amplitude",
    "strouhal",
    "slip",
    "froude_efficiency",
    "energy_per_metre",
    "cost_of_transport_battery",
    "endurance",
    "range",
)
"""Means that older files lack."""
_OPPOSED = 1e-3  # of its peak: the mean of a force that nothing opposes is 0 up to the tolerance of a sweep
_STAYS = 1e-12  # m: rounding, of a tail that does not beat
_STRAIGHT = 1e-4  # rad/s: a robot that turns no faster keeps its heading up to that tolerance


def mean_of(found: "xr.Dataset", name: str) -> "xr.DataArray":
    """A mean over the axes of a sweep: one of MEANS or MORE_MEANS, or `force.x`, the force on the robot along x [N].

    What `counts_as_zero` is 0: along the axes in which the robot is free to move, or cannot be pushed, the mean of the
    force is 0.
    """
    axis = name.removeprefix("force.") if name.startswith("force.") else ""
    values = found["force" if axis else name]
    if name == "turn_rate":
        nothing = abs(values) <= _STRAIGHT
    elif name == "tail_amplitude":
        nothing = values <= _STAYS
    elif name == "body_lengths_per_second" and "forward_speed" in found:
        nothing = mean_of(found, "forward_speed") == 0
    elif (
        name in ("speed", "forward_speed", "speed_over_ground") and "velocity_peak" in found
    ):  # absent from older files
        peak = (found["velocity_peak"].isel(part=0) ** 2).sum("axis") ** 0.5
        nothing = counts_as_zero(values, abs(values).max(), peak)
    elif not axis:
        return values
    else:
        largest = found["force_peak"].max()
        values, peak = (found[own].sel(axis=axis, drop=True) for own in ("force", "force_peak"))
        values = values.rename(f"force {axis}").assign_attrs(found["force"].attrs)
        nothing = counts_as_zero(values, largest, peak, _OPPOSED)
    return values.where(~nothing | values.isnull(), 0)


def nonzero_means(found: "xr.Dataset") -> dict[str, "xr.DataArray"]:
    """Means that are known and not 0 at some point, by name."""
    forces = [f"force.{axis}" for axis in found["axis"].values] if "force" in found else []
    known = (MEANS[0], *MORE_MEANS[:2], *forces, *MEANS[1:], *MORE_MEANS[2:])
    if "water_velocity" not in found or not found["water_velocity"].fillna(0).any():
        known = tuple(name for name in known if name != "speed_over_ground")  # it is the speed
    means = {name: mean_of(found, name) for name in known if name in found or name in forces}
    return {name: values for name, values in means.items() if values.notnull().any() and (values != 0).any()}


def of_file(found: "xr.Dataset") -> "xr.Dataset":
    """A sweep without its draws: the robot of the file."""
    return found.isel(draw=0, drop=True) if "draw" in found.dims else found


def intervals_of(found: "xr.Dataset", values: "xr.DataArray") -> "tuple[xr.DataArray, xr.DataArray, xr.DataArray]":
    """A mean of the robot of the file, and the ends of its interval, with what models of the water leave out."""
    value, draws = values.isel(draw=0, drop=True), values.isel(draw=slice(1, None))
    low, high = (draws.quantile(q, "draw", method="median_unbiased").drop_vars("quantile") for q in (LOW, HIGH))
    ends = np.stack([low.values.ravel(), high.values.ravel()])
    wet = np.full(ends.shape[1], bool(found.attrs["of_water"]))
    if "place" in found:  # of one structure
        rows = draws.transpose("draw", *value.dims).values.reshape(draws.sizes["draw"], -1)
        shares, _ = shares_of(found["place"].values[1:], rows, found["correlation"].values)
        wet = depend(shares, found["source_of_water"].values.astype(bool))
    ends = np.where(wet, widened(ends), ends)
    return value, low.copy(data=ends[0].reshape(low.shape)), high.copy(data=ends[1].reshape(high.shape))


def saturated(found: "xr.Dataset") -> "xr.DataArray | None":
    """Whether a servo asks for more than its full voltage, over the axes of a sweep; None of a robot without servos."""
    if "voltage_demand_peak" not in found or found["voltage_demand_peak"].isnull().all():
        return None
    return (found["voltage_demand_peak"] > 1 + SATURATION_WIDTH).any("motor")


def sweep(
    robot: RobotLike,
    over: Mapping[str, AxisValues],
    settings: Iterable[str] = (),
    *,
    samples: int = 257,
    rtol: float = 1e-4,
    whole: bool = False,
    draws: int = 0,
    seed: int = 1,
    folder: Path | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
) -> "xr.Dataset":
    """Means and peaks of the motion at every point of a grid, as an `xarray.Dataset` with one dimension an axis.

    - robot: a name, a path, a description or a built robot, with `settings` such as "A=75deg".
    - over: values of each quantity, by path or alias, as `axis_of` takes them: numbers in SI, or text such as
      "30..75:5deg"; "N" of a family and "limbs.fin.repeat.count" of a file make another robot for each
      value, and so does a categorical variable, such as {"body.joint.servo.model": "XC330-M288-T,XW540-T140-R"}.
    - the motion: steady where nothing that drives the robot changes with time, else periodic with its drives, or with
      the turns of a crank whose motor finds its own speed. Its means and peaks are `CycleMeans` of `samples` times of a
      cycle, found as by `periodic`, at its tolerance. Links that move in a plane are solved side by side, to the
      relative tolerance `rtol` of a cycle: by a transient and Newton's method, as by `periodic`
      where these do not close it within a few cycles.
    - whole: every limb is solved, as by `periodic`, also where equal ones do the same.
    - draws: how often each point is computed with other values of what is not known exactly (`spread`), the same for
      all points: a last dimension `draw`, whose first one is the robot of the file. `seed` is that of their places.
    - folder: finished parts are kept there: the same sweep goes on from them after it was killed.
    - progress(what, share): called twice a second and after each part; the sweep is cancelled where it returns False.
    - workers: threads of this process; one a processor unless given.
    - executor: where it is computed instead: any of `concurrent.futures`, or a cluster (`nectosome.search.cluster`).

    `status` says how each point was solved; where it was not, its numbers are NaN. Raises InputError for names and
    values that make no sense, and for a folder that holds another sweep; LostError where the executor ends before.
    """
    plan = plan_of(robot, over, settings, samples, rtol, whole, draws, seed)
    through = nullcontext(executor) if executor else ThreadPoolExecutor(workers or processors())
    with Parts(folder, plan.key) as kept, through as through:
        found = compute(plan.work, kept, progress, through)
    return plan.dataset(found)


class PlannedPart(NamedTuple):
    """Points that are computed together."""

    number: int  # in the plan
    grid: int
    batch: RobotBatch
    span: np.ndarray  # indices of the points in the grid


class SweepSteps(NamedTuple):
    """How the points of a sweep are computed, as `sweep` takes it."""

    samples: int
    rtol: float
    whole: bool
    draws: int
    seed: int


@dataclass(frozen=True)
class SweepPlan:
    """A sweep as it was asked for: a grid for each structure."""

    grids: tuple[RobotBatch, ...]
    structures: Mapping[str, Sequence[int] | Sequence[str]]
    request: Mapping[str, Any]  # what was asked for, as JSON data
    made: Mapping[str, Any]  # provenance

    @property
    def key(self) -> str:
        """The same for the same sweep only."""
        robots = [[dump_robot(grid.description), grid.width] for grid in self.grids]
        asked = {name: what for name, what in self.request.items() if name != "robot"}  # its file may lie elsewhere
        text = json.dumps([self.made["nectosome"], asked, robots])
        return hashlib.sha256(text.encode()).hexdigest()

    @cached_property
    def work(self) -> list[PlannedPart]:
        """All that is to be computed, in order."""
        spans = ((i, grid, span) for i, grid in enumerate(self.grids) for span in grid.spans())
        return [PlannedPart(k, i, grid, span) for k, (i, grid, span) in enumerate(spans)]

    def dataset(self, found: Mapping[int, Part]) -> "xr.Dataset":
        """All points; what was not found is NaN and CANCELLED."""
        parts = [[found.get(work.number) for work in self.work if work.grid == i] for i in range(len(self.grids))]
        datasets = [_dataset(grid, own) for grid, own in zip(self.grids, parts, strict=True)]
        one = len(self.grids) == 1
        name = self.grids[0].description.name if one else self.request["robot"]
        title = f"{name}: sweep over {', '.join(self.request['over'])}"
        robot = dump_robot(self.grids[0].description) if one else ""
        joined = _joined(datasets, self.structures)
        limbs = max((int(part[EQUAL_LIMBS].max()) for part in found.values() if EQUAL_LIMBS in part), default=1)
        alike = {EQUAL_LIMBS: limbs} if limbs > 1 else {}
        joined = joined.assign_attrs(title=title, robot=robot, provenance=json.dumps(self.made), **alike)
        return self._with_places(joined) if self.request.get("draws") else joined

    def _with_places(self, found: "xr.Dataset") -> "xr.Dataset":
        """The places of the draws, which say what a mean depends on; of several structures, whether one is in water."""
        each = [drawn_places(grid.description, self.request["draws"], self.request["seed"]) for grid in self.grids]
        found = found.assign_attrs(of_water=int(any(source.of_water for sources, *_ in each for source in sources)))
        if len(each) > 1:
            return found
        ((sources, correlations, places),) = each
        return found.assign(
            place=(("draw", "source"), places),
            correlation=(("source", "source_too"), correlations),
            source_of_water=("source", [int(source.of_water) for source in sources]),
        ).assign_coords(source=[source.name for source in sources])


def plan_of(
    robot: RobotLike,
    over: Mapping[str, AxisValues],
    settings: Iterable[str],
    samples: int,
    rtol: float,
    whole: bool,
    draws: int = 0,
    seed: int = 1,
) -> SweepPlan:
    """Check what is asked of `sweep`. Raises InputError."""
    check_names(over, "over", "{'f': '0.5..2:0.5Hz'}")
    check_whole(samples, "samples", 2)
    check_share(rtol, "rtol")
    check_whole(draws, "draws", 0)
    settings = [settings] if isinstance(settings, str) else [*settings]
    over = {axis: given if isinstance(given, str) else [*given] for axis, given in over.items()}
    if not over:
        raise InputError("there is nothing to sweep over: at least one quantity is needed.", field="over")
    structures = structures_of(robot, over, settings)
    grids = _grids(robot, over, settings, structures, SweepSteps(samples, rtol, whole, draws, seed))
    name = str(robot) if isinstance(robot, str | Path) else grids[0].description.name
    axes = structures | {axis.name: axis.values for axis in grids[0].axes}
    values = {name: [*axes[name]] for name in over}
    request = {"robot": name, "set": settings, "over": values, "samples": samples, "rtol": rtol}
    request |= ({"whole": True} if whole else {}) | ({"draws": draws, "seed": seed} if draws else {})
    return SweepPlan(tuple(grids), structures, request, provenance(request))


def compute(work: list[PlannedPart], kept: Parts, progress: Progress | None, executor: Executor) -> dict[int, Part]:
    """Parts by their numbers, kept as they come in; after a cancellation some are missing."""
    calls = [(w.number, RobotPoints.solved, (w.batch.part(w.span),)) for w in work]
    return kept.computed(calls, f"{sum(len(each.span) for each in work)} points", progress, executor)


def _grids(
    robot: RobotLike,
    over: Mapping[str, AxisValues],
    settings: list[str],
    structures: Mapping[str, Sequence[int] | Sequence[str]],
    steps: SweepSteps,
) -> list[RobotBatch]:
    """Grids of the numbers, one for each structure, the last axis of which runs fastest."""
    grids = []
    for description in each_structure(robot, structures, settings).values():
        axes = tuple(axis_of(name, values, description) for name, values in over.items() if name not in structures)
        each = ((axis.name, resolve(description, axis.name)) for axis in axes)
        check_each_once(each, "over", set_paths((text.partition("=")[0].strip() for text in settings), description))
        draws = list[dict[str, float]]()
        if steps.draws:
            ends = product(*({a.values[0], a.values[-1]} for a in axes))
            corners = (with_values(description, dict(zip((a.name for a in axes), x, strict=True))) for x in ends)
            description = with_left_open(description, corners)
            draws = draws_of(description, steps.draws, steps.seed)
        grids.append(batches_of(description, axes, steps.samples, steps.rtol, steps.whole, draws))
    return grids


def _dataset(grid: RobotBatch, parts: list[Part | None]) -> "xr.Dataset":
    """Dataset of one structure; what was not computed is NaN and CANCELLED."""
    import xarray as xr

    shape, dims = tuple(len(a.values) for a in grid.axes), tuple(a.name for a in grid.axes)
    total = int(np.prod(shape))
    status = np.full(total, int(Status.CANCELLED))
    done = next((part for part in parts if part is not None), None)
    shapes = grid.shapes() if done is None else {name: done[name].shape[1:] for name in CycleMeans._fields}
    arrays = {name: np.full((total, *own), np.nan) for name, own in shapes.items()}
    periods = np.where(grid.periods > 0, grid.periods, np.nan)
    for span, part in zip(grid.spans(), parts, strict=True):
        if part is not None:
            status[span] = part["status"]
            periods[span] = part.get("period", periods[span])
            for name, x in arrays.items():
                x[span] = part[name]
    means = CycleMeans(**{name: jnp.asarray(x.reshape(shape + x.shape[1:])) for name, x in arrays.items()})
    data, names = mean_data(grid.robot, means, dims)
    words = np.array([Status(int(s)).name for s in status]).reshape(shape)
    return xr.Dataset(
        {name: (d, x, {"units": unit}) for name, (d, x, unit) in data.items()}
        | {"status": (dims, words), "period": (dims, periods.reshape(shape), {"units": "s"})},
        coords={a.name: (a.name, np.array(a.values), {"units": a.unit}) for a in grid.axes}
        | {name: (d, x, {"units": u} if u else {}) for name, (d, x, u) in names.items()},
    )


def _joined(datasets: list["xr.Dataset"], structures: Mapping[str, Sequence[int] | Sequence[str]]) -> "xr.Dataset":
    """All structures along their axes; parts that one of them has not are NaN there."""
    import xarray as xr

    for name, values in reversed([*structures.items()]):
        along = xr.DataArray(np.array(values), dims=name, name=name)
        groups = [datasets[k : k + len(values)] for k in range(0, len(datasets), len(values))]
        datasets = [xr.concat(group, along, join="outer") for group in groups]
    return datasets[0]
