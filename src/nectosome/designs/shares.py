"""Sweeps in shares, each computed on its own and kept in a file of its own, and the file of all that is made of them.

A machine needs nothing of another one: share k of N has every Nth part of the sweep, beginning with the kth.
"""

import json
import time
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from nectosome.description import dump_robot, parse_robot
from nectosome.io import load_checkpoint, save_checkpoint
from nectosome.model.inputs import RobotLike
from nectosome.search.executors.processes import processors
from nectosome.search.search_folder import read_share
from nectosome.units import InputError

from .axes import AxisValues, SweepAxis
from .batches import batches_of
from .kept_parts import Part, Parts, Progress
from .sweep import SweepPlan, compute, plan_of

if TYPE_CHECKING:
    import xarray as xr

FORMAT = 2


def sweep_share(
    robot: RobotLike,
    over: Mapping[str, AxisValues],
    settings: Iterable[str] = (),
    *,
    share: str,
    file: str | Path,
    samples: int = 257,
    rtol: float = 1e-4,
    whole: bool = False,
    folder: Path | None = None,
    progress: Progress | None = None,
    executor: Executor | None = None,
) -> bool:
    """Compute a share of a sweep into a file, from which `gather` takes it; False where it was cancelled before.

    - share: "2/8" is the second of eight. All of them take the same robot, axes and settings.
    - file: of this share (.npz); others as `sweep` takes them.

    Raises InputError as `sweep` does.
    """
    k, n = read_share(share, "share")
    began = time.perf_counter()
    plan = plan_of(robot, over, settings, samples, rtol, whole)
    work = plan.work[k - 1 :: n]
    pool = nullcontext(executor) if executor else ThreadPoolExecutor(processors())
    with Parts(folder, plan.key) as kept, pool as through:
        found = compute(work, kept, progress, through)
    if len(found) < len(work):
        return False
    arrays = dict[str, np.ndarray]()
    for i in range(len(plan.grids)):
        own = [found[each.number] for each in work if each.grid == i]
        arrays |= {f"{i}.{name}": np.concatenate([part[name] for part in own]) for name in (own[0] if own else ())}
    save_checkpoint(file, arrays, _about(plan) | {"share": [k, n], "seconds": time.perf_counter() - began})
    return True


def gather(files: Iterable[str | Path]) -> "xr.Dataset":
    """Join the shares of a sweep, as `sweep` would have found it in one.

    Raises InputError for files that are no shares, or of different sweeps, and where one is missing or there twice.
    """
    shares = [_read(Path(file)) for file in files]
    if not shares:
        raise InputError("no share is given.", field="gather")
    first, *others = shares
    for other in others:
        if other.meta["sweep"] != first.meta["sweep"]:
            words = f"is of another sweep than {first.file}: {_difference(other.meta, first.meta)}."
            raise InputError(words, file=str(other.file))
        if other.total != first.total:
            words = f"is one of {other.total} shares, and {first.file} one of {first.total}."
            raise InputError(words, file=str(other.file))
    by_number = dict[int, _Share]()
    for each in shares:
        if each.number in by_number:
            words = f"and {by_number[each.number].file} are both share {each.number}/{each.total}. Leave one out."
            raise InputError(words, file=str(each.file))
        by_number[each.number] = each
    if missing := [k for k in range(1, first.total + 1) if k not in by_number]:
        shown = ", ".join(f"{k}/{first.total}" for k in missing[:10]) + (", ..." if len(missing) > 10 else "")
        raise InputError(f"{len(missing)} of {first.total} shares are missing: {shown}.", field="gather")
    plan = _plan(first.meta)
    if plan.key != first.meta["sweep"]:
        raise InputError("was computed by another version of nectosome.", file=str(first.file))
    found = {k: part for each in shares for k, part in each.parts(plan)}
    seconds = sum(each.meta["seconds"] for each in shares)
    return plan.dataset(found).assign_attrs(seconds=round(seconds, 3))


class _Share(NamedTuple):
    """A share as it was read."""

    file: Path
    arrays: dict[str, np.ndarray]
    meta: dict[str, Any]

    @property
    def number(self) -> int:
        return self.meta["share"][0]

    @property
    def total(self) -> int:
        return self.meta["share"][1]

    def parts(self, plan: SweepPlan) -> Iterable[tuple[int, Part]]:
        """Number and content of each of its parts."""
        at = [0] * len(plan.grids)
        for work in plan.work[self.number - 1 :: self.total]:
            i, size = work.grid, len(work.span)
            own = {name: x for name, x in self.arrays.items() if name.startswith(f"{i}.")}
            yield work.number, {name.partition(".")[2]: x[at[i] : at[i] + size] for name, x in own.items()}
            at[i] += size


def _read(file: Path) -> _Share:
    arrays, meta = load_checkpoint(file)
    if meta.get("shares") != FORMAT:
        raise InputError("is no share of a sweep, or of another version of nectosome.", file=str(file))
    return _Share(file, arrays, meta)


def _about(plan: SweepPlan) -> dict[str, Any]:
    """What a share holds of the whole sweep, as JSON data: enough to know all its points without the robot's file."""
    grids = [
        {"robot": dump_robot(g.description), "axes": [axis.__dict__ for axis in g.axes], "width": g.width}
        for g in plan.grids
    ]
    structures = {name: [*values] for name, values in plan.structures.items()}
    made = {"request": plan.request, "made": plan.made, "structures": structures, "grids": grids}
    return {"shares": FORMAT, "sweep": plan.key, **json.loads(json.dumps(made))}


def _difference(meta: Mapping[str, Any], other: Mapping[str, Any]) -> str:
    """In what the sweeps of two shares differ."""
    versions = [one["made"]["nectosome"] for one in (meta, other)]
    if versions[0] != versions[1]:
        return f"by nectosome {versions[0]}, not {versions[1]}"
    for name, words in (("over", "over other values"), ("set", "with other settings"), ("samples", "other samples")):
        if meta["request"][name] != other["request"][name]:
            return words
    if [one["robot"] for one in meta["grids"]] != [one["robot"] for one in other["grids"]]:
        return "of another robot"
    return "on another kind of device, or with another tolerance"


def _plan(meta: Mapping[str, Any]) -> SweepPlan:
    request, grids = meta["request"], []
    for one in meta["grids"]:
        axes = tuple(SweepAxis(**axis | {"values": tuple(axis["values"])}) for axis in one["axes"])
        asked = request["samples"], request["rtol"], request.get("whole", False)
        grid = batches_of(parse_robot(one["robot"]), axes, *asked)
        grids.append(replace(grid, width=one["width"]))  # that of the device where the shares were computed
    return SweepPlan(tuple(grids), meta["structures"], request, meta["made"])
