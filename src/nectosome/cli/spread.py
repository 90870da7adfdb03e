"""`--spread`: the interval of every number that a command prints, and what makes it wide."""

import math
import time as clock
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from nectosome import view
from nectosome.cli.options import SEED, goes_on, on_cluster, robot_named, tell_far_out, whole
from nectosome.cli.output import Outputs, tell, write
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io.summary import Summary
from nectosome.io.tables import Label, Number, Table
from nectosome.units import InputError, count

if TYPE_CHECKING:
    from nectosome.designs.prediction_intervals import Draws

_FEW, _USUAL, _MANY = 8, 40, 10_000
_RANKED = 8  # sources in the text; JSON has all
_SURE = 0.1  # standard error of an end over the width, above which more draws are advised


@Parameter(name="*")
@dataclass(frozen=True)
class SpreadOptions:
    """Intervals of what a command prints."""

    spread: Annotated[
        bool,
        Parameter(
            help="Print the interval of every number, from draws of what is not known exactly: numbers with +- in the "
            "file, and coefficients, moduli and losses by the range of their kind."
        ),
    ] = False
    draws: Annotated[int | None, whole(f"Draws of --spread; {_USUAL} or more by default.", _FEW, _MANY, "--draws")] = (
        None
    )
    seed: Annotated[int | None, whole("Seed of random numbers.", 0, 999_999_999, "--seed")] = None

    @property
    def first(self) -> int:
        """Seed."""
        return SEED if self.seed is None else self.seed

    def check(self, beside: str = "", cluster: str | None = None, loads: bool = False) -> None:
        """Raise InputError for options that go with --spread without it, and for --spread beside something else."""
        if self.spread and loads:
            raise InputError("does not go with --spread. Leave it out.", field="--loads")
        if self.spread and beside:
            raise InputError(f"is not for {beside}. Leave it out.", field="--spread")
        for option, given in (("--draws", self.draws), ("--seed", self.seed), ("--cluster", cluster)):
            if given is not None and not self.spread:
                raise InputError("goes with --spread. Give that too, or leave it out.", field=option)


def print_intervals(
    robot: str,
    settings: list[str] | None,
    verb: Literal["simulate", "steady", "periodic"],
    options: dict[str, Any],
    asked: SpreadOptions,
    cluster: str | None,
    outputs: Outputs,
) -> int:
    """Run a verb in all draws, print and write the intervals of what it gives, and return the exit code."""
    description = robot_named(robot, settings)
    tell_far_out(description, robot)
    from nectosome.designs.kept_parts import forget
    from nectosome.designs.uncertain_runs import spread

    folder = None if outputs.save is None else outputs.save.with_suffix(".parts")
    start = clock.perf_counter()
    run = partial(spread, description, verb, draws=asked.draws, seed=asked.first, folder=folder, **options)
    try:
        with progress_bar(f"{description.name}: intervals") as update:
            found = on_cluster(
                cluster,
                lambda executor: cancellable(lambda progress: run(progress=progress, executor=executor), update),
                folder,
            )
    except InputError as error:
        raise InputError(error.message, field=error.field, file=error.file or robot) from None
    if found is None:
        tell(f"cancelled.{goes_on(folder)}")
        return 130
    page = intervals_summary(found, clock.perf_counter() - start)
    write(page)
    if outputs.given:
        inputs = {"robot": robot, "set": settings or [], "draws": len(found.status) - 1, "seed": asked.first, **options}
        outputs.write(found.to_dataset(inputs), view.show_intervals)
    if folder is not None:
        forget(folder)
    if not found.found.any():
        tell(f"{description.name}: no draw has such a run.")
        return 1
    if found.status[0] == "UNSTABLE":
        tell(f"{description.name}: found, but unstable: small disturbances grow.")
        return 1
    return 0


def intervals_summary(found: "Draws", seconds: float) -> Summary:
    """Tables as the command has them without --spread, a row for each number, and the ranking of the sources."""
    import numpy as np

    from nectosome.designs.prediction_intervals import HIGH, LEFT_OUT, LOW

    ends, good = found.ends, int(found.found.sum())
    tables = list[Table]()
    heads = {"value": "value", "low": f"{100 * LOW:.0f} %", "high": f"{100 * HIGH:.0f} %", "source": "most by"}
    places = [k for k in range(len(found.keys)) if ends[0, k] < ends[1, k]]
    for table in dict.fromkeys(found.keys[k].table for k in places):
        own = [k for k in places if found.keys[k].table == table]
        rows = [
            (
                found.keys[k].name,
                *(Number(float(x), found.keys[k].unit) for x in (found.values[0, k], *ends[:, k])),
                _most(found, k),
            )
            for k in own
        ]
        tables.append(Table(table, {"what": found.keys[own[0]].heading, **heads}, rows, apart=False))
    lost = [f"{n} {status}" for status, n in _counted(found).items()]
    unsure = float(np.nanmedian(found.unsure)) if places and good > 1 else math.nan
    notes = [
        f"value: of the file itself; between 10 % and 90 % lie four fifths of {good} draws (a Latin hypercube of "
        f"{count(len(found.sources), 'source')})",
        f"draws: {', '.join(lost)}; {seconds:.1f} s to compute",
    ]
    if unsure == unsure:
        more = "; more --draws make them surer" if unsure > _SURE else ""
        notes.append(f"the ends are sure to within {100 * unsure:.0f} % of their widths{more}")
    if not places:
        notes.append("no number that is printed depends on them")
    if found.wet.any():
        left_out = f"{100 * LEFT_OUT:.0f} % (one standard deviation, by robots that were measured)"
        notes.append(f"what models of the water leave out is in the intervals of what depends on them: {left_out}")
    notes += found.advice
    cautions, ranking = [*found.cautions, *found.lost, *_few(found), *found.useless], _ranking(found)
    shown = [replace(table, rows=table.rows[:_RANKED]) for table in ranking]
    return Summary(found.title, [*tables, *shown], notes=notes, cautions=cautions, facts=ranking)


def _few(found: "Draws") -> list[str]:
    """A sentence where draws are too few to say what makes numbers wide."""
    good, unknown = int(found.found.sum()), len(found.sources)
    few = (
        f"--draws {unknown + 10} would tell what makes numbers wide: {count(unknown, 'source')} are too many for {good}"
    )
    return [few] if good < unknown + 3 else []


def _counted(found: "Draws") -> dict[str, int]:
    each = found.status[1:]
    return {status: each.count(status) for status in dict.fromkeys(each)}


def _most(found: "Draws", k: int) -> str:
    """The largest source of a number, with its share."""
    shares = found.shares[:, k]
    if all(map(math.isnan, shares)):
        return ""
    top = int(shares.argmax())
    return f"{found.sources[top].name} {100 * shares[top]:.0f} %"


def _ranking(found: "Draws") -> list[Table]:
    """Sources by their mean share of all numbers, with what is known of each."""
    means = found.mean_shares
    if all(map(math.isnan, means)):
        return []
    order = sorted(range(len(means)), key=lambda k: -means[k])
    heads = {"source": "not known exactly", "range": "95 % range", "share": "mean share", "numbers": "numbers"}
    heads |= {"why": "range from", "experiment": "what tells it better"}
    rows = [
        (
            Label(found.sources[k].name, found.sources[k].name),
            found.sources[k].range_text,
            Number(float(means[k]), shown=f"{100 * means[k]:.0f} %"),
            Number(len(found.sources[k].values)),
            found.sources[k].why,
            found.sources[k].experiment,
        )
        for k in order
    ]
    return [Table("sources", heads, rows, hidden=("numbers", "why"))]
