"""`nectosome sweep`: cycle averages of a robot on a grid of its quantities; `gather`: of shares computed apart."""

import functools
import time as clock
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from nectosome import view
from nectosome.cli.options import (
    Cluster,
    Over,
    Part,
    Robot,
    Settings,
    Whole,
    command,
    goes_on,
    on_cluster,
    robot_named,
    tell_far_out,
    whole,
)
from nectosome.cli.output import Outputs, check_target, report, tell, write
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.cli.spread import SpreadOptions
from nectosome.io.file_system import is_folder
from nectosome.io.summary import Summary
from nectosome.io.tables import Label, Number, Table
from nectosome.units import DIMENSIONS, InputError, count, read_pairs, show_quantity

if TYPE_CHECKING:
    import xarray as xr


_FOUND = ("SOLVED", "SETTLED", "UNSTABLE")  # statuses of points that have numbers


@command
def sweep(
    robot: Robot,
    /,
    *,
    over: Over = None,
    settings: Settings = None,
    samples: Annotated[int, whole("Times of a cycle of which averages are taken.", 17, 10_000)] = 257,
    cluster: Cluster = None,
    part: Part = None,
    every_limb: Whole = False,
    spread: SpreadOptions = SpreadOptions(),
    outputs: Outputs = Outputs(),
) -> int:
    """Find the steady or periodic motion at every point of a grid, and its cycle averages.

    With --save finished parts are kept beside the file until all is done: the same command again goes on from them.
    """
    axes = read_pairs(over, "--over", "A=30..75:5deg")
    spread.check("a share" if part else "")
    _check(part, outputs)
    if not axes:
        raise InputError("names no axis. Give one, as in A=30..75:5deg.", field="--over")
    if outputs.plot is not None and len(axes) > 2:
        raise InputError("shows one or two quantities, not more. Save the sweep instead.", field="--plot")

    description = robot_named(robot, settings)
    tell_far_out(description, robot)
    from nectosome import designs
    from nectosome.designs.kept_parts import forget
    from nectosome.designs.uncertain_runs import usual_draws, with_left_open

    folder = None if outputs.save is None else outputs.save.with_suffix(".parts")
    start = clock.perf_counter()
    with progress_bar(f"sweep of {robot}") as update:
        steps = {"samples": samples, "whole": every_limb, "folder": folder}
        if spread.spread:
            steps |= {"draws": spread.draws or usual_draws(with_left_open(description)), "seed": spread.first}
        given = functools.partial(designs.sweep, robot, axes, settings or (), **steps)
        if part is not None:
            given = functools.partial(designs.sweep_share, *given.args, **given.keywords, share=part, file=outputs.save)
        found = on_cluster(
            cluster,
            lambda executor: cancellable(lambda progress: given(progress=progress, executor=executor), update),
            folder,
        )
    if found is None:
        return 1
    if isinstance(found, bool):  # a share: its file is written
        if not found:
            return _cancelled(folder)
        report(outputs.save)
        if folder is not None:
            forget(folder)
        return 0
    found.attrs["seconds"] = round(clock.perf_counter() - start, 3)
    if (found["status"] == "CANCELLED").any():
        return _cancelled(folder)
    write(sweep_summary(found))
    outputs.write(found, lambda data, path: view.show_sweep(data, path))
    if folder is not None:
        forget(folder)
    return code_of(found)


def code_of(found: "xr.Dataset") -> int:
    """Exit code of a sweep: 1, with a sentence, where none of its points has a motion."""
    if found["status"].isin(_FOUND).any():
        return 0
    tell("no point has a motion that was found")
    return 1


def _check(part: str | None, outputs: Outputs) -> None:
    """Raise InputError where the files cannot be written; a share is one of its own."""
    if part is None:
        outputs.check()
        return
    from nectosome.search.search_folder import read_share

    read_share(part, "--part")
    if outputs.save is None:
        raise InputError("needs a file for the share, as in --save share-1.npz.", field="--part")
    if outputs.save.suffix != ".npz":
        raise InputError(f'"{outputs.save}" holds no share: name it .npz, as in share-1.npz.', field="--save")
    if outputs.plot is not None:
        raise InputError("shows a whole sweep, no share of it: join the shares by nectosome gather.", field="--plot")
    check_target(outputs.save, "--save", ".npz", outputs.force)


def _cancelled(folder: Path | None) -> int:
    tell(f"cancelled.{goes_on(folder)}")
    return 130


def sweep_summary(every: "xr.Dataset") -> Summary:
    """Where each average is lowest and highest, and how many points were solved how; intervals of draws."""
    from nectosome.designs.sweep import nonzero_means, of_file, saturated
    from nectosome.solve.equal_limbs import EQUAL_LIMBS, with_equal_limbs

    found = of_file(every)
    dims = tuple(map(str, found["status"].dims))
    heads = {"mean": "cycle average", "lowest": "lowest", "lowest_at": "at", "highest": "highest", "highest_at": "at"}
    rows = list[tuple[Label | Number | str, ...]]()
    for name, values in nonzero_means(found).items():
        ends = [values.isel(end(dims)) for end in (values.argmin, values.argmax)]  # type: ignore[arg-type]
        unit = str(values.attrs["units"]).removesuffix("1")
        cells = [cell for end in ends for cell in (Number(float(end), unit), _place(end, dims))]
        rows.append((Label(name, str(values.name).replace("_", " ")), *cells))
    choices, notes = _choices(found), list[str]()
    beyond = saturated(found)
    if beyond is not None and beyond.any():
        notes = [f"{count(int(beyond.sum()), 'point')} at which a servo asks for more than its full voltage"]
    if EQUAL_LIMBS in found.attrs:
        notes.append(with_equal_limbs("solved", found.attrs))
    words = every["status"].to_series().value_counts()
    solved = ", ".join(f"{n} {status}" for status, n in words.items())
    return Summary(
        str(found.attrs["title"]),
        [Table("means", heads, rows), *choices, *_intervals(every)],
        notes=[
            *_tail_first(found),
            f"{count(every['status'].size, 'point')}: {solved}; {found.attrs['seconds']:.1f} s to compute",
            *notes,
        ],
        attributes={key: found.attrs[key] for key in ("provenance", "seconds")},
        values={str(status): Number(int(n)) for status, n in words.items()},
    )


def _intervals(every: "xr.Dataset") -> list[Table]:
    """The interval of each mean where it is lowest and where it is highest; nothing without draws."""
    from nectosome.designs.sweep import intervals_of, nonzero_means

    heads = {"mean": "cycle average", "at": "at", "value": "value", "low": "10 %", "high": "90 %"}
    rows = list[tuple[Label | Number | str, ...]]()
    for name, each in nonzero_means(every).items() if "draw" in every.dims else ():
        values, low, high = intervals_of(every, each)
        dims = tuple(map(str, values.dims))
        if not (low < high).any():
            continue
        unit = str(each.attrs["units"]).removesuffix("1")
        for end, at in (("lowest", values.argmin), ("highest", values.argmax)):
            here = at(dims)  # type: ignore[arg-type]
            cells = [Number(float(x.isel(here)), unit) for x in (values, low, high)]
            label = Label(f"{name}.{end}", f"{str(each.name).replace('_', ' ')}, {end}")
            rows.append((label, _place(values.isel(here), dims), *cells))
    return [Table("intervals", heads, rows)] if rows else []


def _choices(found: "xr.Dataset") -> list[Table]:
    """A row for each choice of a sweep over choices alone: what its motion is, and what its motors take."""
    import numpy as np

    from nectosome.designs.sweep import mean_of, saturated
    from nectosome.io.schema.structure import shortest

    dims = [str(dim) for dim in found["status"].dims]
    if any(found[dim].dtype.kind != "U" for dim in dims):
        return []
    shown = {"speed": ("speed", mean_of(found, "speed"), "m/s")}
    if "motor" in found.dims:
        shown["current"] = ("largest current", found["current_peak"].max("motor", skipna=False), "A")
        supply = "battery" if "battery_power" in found else "motor"
        power = found["battery_power" if supply == "battery" else "electrical_power"].sum(supply, skipna=False)
        shown["power"] = (f"{'battery' if supply == 'battery' else 'electrical'} power", power, "W")
    beyond = saturated(found)
    heads = {"choice": ", ".join(shortest(dims).values())} | {key: words for key, (words, *_) in shown.items()}
    heads |= ({} if beyond is None else {"saturated": "saturated"}) | {"status": "status"}
    rows = list[tuple[Number | str, ...]]()
    for index in np.ndindex(found["status"].shape):
        here = dict(zip(dims, index, strict=True))
        cells = [Number(float(values[here]), unit) for _, values, unit in shown.values()]
        full = [] if beyond is None else ["yes" if bool(beyond[here]) else "no"]
        name = ", ".join(str(found[dim].values[k]) for dim, k in here.items())
        rows.append((name, *cells, *full, str(found["status"][here].values)))
    return [Table("choices", heads, rows)]


def _tail_first(found: "xr.Dataset") -> list[str]:
    """Return a note where the robot goes clearly backwards at some points."""
    if "forward_speed" not in found:
        return []
    from nectosome.solve.summaries.stroke_tables import backwards

    some = int(backwards(found["forward_speed"], found["speed"], found["speed"].max()).sum())
    return [f"{count(some, 'point')}: the robot swims tail first (its forward speed is negative)"] if some else []


def _place(value: "xr.DataArray", dims: tuple[str, ...]) -> str:
    """Coordinates of a value, each axis by the shortest part of its name that differs from the others."""
    from nectosome.io.schema.structure import shortest

    names, kinds = shortest(dims), {kind.unit: name for name, kind in reversed(DIMENSIONS.items())}
    units = {dim: kinds.get(str(value[dim].attrs.get("units", "")), "number") for dim in dims}
    texts = {dim: str(value[dim].values) for dim in dims if value[dim].dtype.kind == "U"}
    shown = {dim: texts.get(dim) or show_quantity(float(value[dim]), kind) for dim, kind in units.items()}
    return ", ".join(f"{names[dim]}={text}" for dim, text in shown.items())


@command
def gather(
    shares: Annotated[list[Path], Parameter(help="Files of a sweep's shares, or folders of a search's shares.")],
    /,
    *,
    out: Annotated[Path | None, Parameter(help="Folder into which the shares of a search are joined.")] = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Join the shares of a sweep, or of a design's starts, which --part computed one by one.

    Shares of a search are joined into a folder: the command that made them finds all starts there, by --out and without
    --part.
    """
    outputs.check()
    if any(map(is_folder, shares)):
        if out is None or outputs.given:
            raise InputError("folders of a search are joined into another one: --out FOLDER.", field="gather")
        from nectosome.search.search_folder import gather_starts

        number = gather_starts(shares, out)
        report(out, words=f"{out}: {count(number, 'start')}. The design's command with --out {out} shows them.")
        return 0
    if out is not None:
        raise InputError("is for folders of a search. Files of a sweep: --save FILE.", field="--out")
    from nectosome import designs

    found = designs.gather(shares)
    write(sweep_summary(found))
    outputs.write(found, lambda data, path: view.show_sweep(data, path))
    return code_of(found)
