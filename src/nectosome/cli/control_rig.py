"""`nectosome control rig`: a rig, simulated or real, under a controller, rehearsed on its model where there is one."""

import json
import math
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from nectosome.cli.layout import Number, Table
from nectosome.cli.options import ReferenceOptions, named_options, read_count, value
from nectosome.cli.output import Outputs, check_target, report, tell, write
from nectosome.cli.page import Summary
from nectosome.cli.progress import progress_bar
from nectosome.io import load_dataset, save_dataset
from nectosome.io.file_system import exists
from nectosome.io.results import SUFFIXES
from nectosome.units import InputError, did_you_mean, dimension_of, show_quantity

if TYPE_CHECKING:
    from nectosome.rigs import BenchRun

CODES = {"finished": 0, "aborted": 1, "failed": 1, "interrupted": 130}


def control_rig(
    *,
    config: Annotated[Path, Parameter(help="Rig file (.yaml): device, sample time, limits.")],
    reference: ReferenceOptions,
    controller: Annotated[
        str | None,
        Parameter(
            help="pid, scheduled (by frequency), ff-pid, mpc, or ilc, which learns; ff-pid with a model, else pid."
        ),
    ] = None,
    gains: Annotated[
        str | None,
        value(
            "K_p,K_i,K_d in the units of the rig file's limits and of --reference, and s, or such rows by frequency; "
            "by default found on the model."
        ),
    ] = None,
    model: Annotated[
        Path | None,
        Parameter(help="Model of the rig (.nc), as `identify hysteresis --save` writes it; a simulated rig has one."),
    ] = None,
    rounds: Annotated[str, value("Runs of ilc.")] = "5",
    command: Annotated[str | None, value("Command of the rig; may be left out where it has one.")] = None,
    measure: Annotated[
        str | None, value("Measurement that follows the reference; may be left out where the rig has one.")
    ] = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Rehearse on the model, where there is one, then run the rig with its guards, and log it.

    The rig is vented at the end of every run. A run that the guards would stop on the model does not begin.
    """
    runs = read_count(rounds, "--rounds", least=1, most=100) if controller == "ilc" else 1
    outputs.check()
    saved = names_of_runs(outputs, runs)

    from nectosome.controllers import CONTROLLERS, PIDGains, Reference
    from nectosome.identification.hysteresis.files import saved_model
    from nectosome.rigs import Bench, Pair
    from nectosome.rigs.files import load_rig

    if controller is not None and controller not in CONTROLLERS:
        message = f'"{controller}" is not known: {", ".join(CONTROLLERS)}.{did_you_mean(controller, CONTROLLERS)}'
        raise InputError(message, field="--controller")
    file = load_rig(config)
    with named_options():
        pair = Pair.of(file.rig, command, measure)
        identified = file.models.get(pair.command) if model is None else saved_model(load_dataset(model), str(model))
        of = dimension_of(file.rig.measurements[pair.measurement])
        target = Reference.parse(reference.reference, of, **reference.shape())
        seconds = reference.seconds()
        samples = target.samples(target.duration(file.dt) if seconds is None else seconds, file.dt)
        given = None if gains is None else PIDGains.parse(gains, file.unit_size(pair.command) / target.unit_size)
        with progress_bar("rehearsing"):
            bench = Bench.of(file.rig, file.limits, file.dt, samples, controller, given, identified, pair)
            bench.check(samples)
    with tempfile.TemporaryDirectory() as folder:
        logs = [log_of(path) for path in saved] or [Path(folder) / f"run_{k + 1}.nc" for k in range(runs)]
        found: list[BenchRun] = []
        with progress_bar("running") as update:
            outcomes = bench.runs(samples, target.kind, logs, lambda k, share: update(f"run {k + 1}", share))
            for k, outcome in enumerate(outcomes):
                found.append(outcome)
                if saved and outcome.run.path == logs[k] != saved[k]:
                    save_dataset(outcome.run.data, saved[k])
                    logs[k].unlink()
                if outcome.run.status != "finished":
                    break
    write(_summary(found, rehearsed=bench.model is not None))
    last = found[-1].run
    if last.status != "finished":
        tell(f"{last.status}: {last.reason}")
    if outputs.plot is not None:
        from nectosome.view import show_experiment

        show_experiment([one.run.data for one in found], outputs.plot)
    report(*filter(exists, saved[: len(found)]), outputs.plot)
    return CODES[last.status]


def names_of_runs(outputs: Outputs, runs: int) -> list[Path]:
    """Files of all runs, numbered where there are several; none where nothing is saved. Raises InputError."""
    save = outputs.save
    if save is None:
        return []
    saved = [save if runs == 1 else save.with_stem(f"{save.stem}_{k + 1}") for k in range(runs)]
    for path in saved:
        check_target(path, "--save", SUFFIXES, outputs.force)
    return saved


def log_of(path: Path) -> Path:
    """Where the log of a run is written: netCDF, of which a table is made, or a file replaced, at its end."""
    return path if path.suffix == ".nc" and not exists(path) else path.with_name(f"{path.stem}_log.nc")


def _summary(found: "list[BenchRun]", *, rehearsed: bool) -> Summary:
    """Errors and commands of each run."""
    notes = [] if rehearsed else ["not rehearsed: there is no --model"]
    heads = {"run": "run", "status": "ended", "samples": "samples", "command_min": "command from", "command_max": "to"}
    heads |= {"late": "late samples", "latest": "latest"}
    runs, errors = list[tuple[str | Number, ...]](), list[tuple[str | Number, ...]]()
    for k, outcome in enumerate(found, start=1):
        data = outcome.run.data
        (of,) = json.loads(data.attrs["loops"])
        command, unit = data[f"{of}.command"].values, str(data[f"{of}.command"].attrs["units"])
        ends = map(float, (command.min(), command.max())) if command.size else (math.nan, math.nan)
        shown = (Number(x, unit, shown=show_quantity(x, dimension_of(unit)) if command.size else "") for x in ends)
        late = Number(int(data.attrs["overruns"])), Number(float(data.attrs["latest"]), "s")
        samples = Number(data.sizes["time"], shown=f"{data.sizes['time']}")
        runs.append((str(k), outcome.run.status, samples, *shown, *(late if late[0].value else ())))
        for name, error in {"measured": outcome.measured, "true": outcome.true}.items():
            if error:
                errors.append((str(k), f"{name} error", *(Number(x / 100, shown=f"{x:.3g} %") for x in error)))
    of_errors = {"run": "run", "of": "of the reference's range", "rms": "rms", "largest": "largest"}
    tables = [Table("runs", heads, runs, listed=True), Table("errors", of_errors, errors, listed=True)]
    last = found[-1].run
    attributes = {"status": last.status, "status_reason": last.reason}
    title = f"{last.data.attrs['title']}: {last.status}, {last.data.sizes['time']} samples"
    return Summary(title, tables, above=notes, attributes=attributes)
