"""`nectosome control rig`: a rig, simulated or real, under a controller, rehearsed on its model where there is one."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from nectosome.cli.control import control
from nectosome.cli.control_on_rig import conclude, names_of_runs, run_and_save
from nectosome.cli.options import ReferenceOptions, named_options, value, whole
from nectosome.cli.output import Outputs
from nectosome.cli.progress import progress_bar
from nectosome.io import load_dataset
from nectosome.io.summary import Summary
from nectosome.io.tables import Number, Table
from nectosome.units import dimension_of, show_quantity

if TYPE_CHECKING:
    from nectosome.rigs import RigRun


@control.command(name="rig")
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
    rounds: Annotated[int, whole("Runs of ilc.", 1, 100)] = 5,
    command: Annotated[str | None, value("Command of the rig; may be left out where it has one.")] = None,
    measure: Annotated[
        str | None, value("Measurement that follows the reference; may be left out where the rig has one.")
    ] = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Rehearse on the model, where there is one, then run the rig with its guards, and log it.

    The rig is vented at the end of every run. A run that the guards would stop on the model does not begin.
    """
    outputs.check()

    from nectosome.controllers import PIDGains, Reference, controller_named
    from nectosome.identification.hysteresis.files import saved_model
    from nectosome.rigs import Pair, actuator_bench
    from nectosome.rigs.rig_file import load_rig

    with named_options():
        runs = rounds if controller is not None and controller_named(controller).learns else 1
    saved, file = names_of_runs(outputs, runs), load_rig(config)
    with named_options():
        pair = Pair.of(file.rig, command, measure)
        identified = file.models.get(pair.command) if model is None else saved_model(load_dataset(model), str(model))
        of = dimension_of(file.rig.measurements[pair.measurement])
        target = Reference.parse(reference.reference, of, **reference.shape())
        seconds = reference.seconds()
        samples = target.samples(target.duration(file.dt) if seconds is None else seconds, file.dt)
        given = None if gains is None else PIDGains.parse(gains, file.unit_size(pair.command) / target.unit_size)
        with progress_bar("rehearsing"):
            bench = actuator_bench(
                file.rig, file.limits, file.dt, samples, controller, given, identified, pair, target.kind
            )
            bench.rehearse()
    errors = list[dict[str, tuple[float, float]]]()
    done = run_and_save(bench, saved, runs, lambda run: errors.append(bench.errors(run)))
    summary = _summary(done, errors, rehearsed=bench.model is not None)
    return conclude(summary, done, [run.data for run in done], saved, outputs)


def _summary(found: "list[RigRun]", scored: list[dict[str, tuple[float, float]]], *, rehearsed: bool) -> Summary:
    """Errors and commands of each run."""
    notes = [] if rehearsed else ["not rehearsed: there is no --model"]
    heads = {"run": "run", "status": "ended", "samples": "samples", "command_min": "command from", "command_max": "to"}
    heads |= {"late": "late samples", "latest": "latest"}
    runs, errors = list[tuple[str | Number, ...]](), list[tuple[str | Number, ...]]()
    for k, (run, of_run) in enumerate(zip(found, scored, strict=True), start=1):
        data = run.data
        (of,) = json.loads(data.attrs["loops"])
        command, unit = data[f"{of}.command"].values, str(data[f"{of}.command"].attrs["units"])
        ends = map(float, (command.min(), command.max())) if command.size else (math.nan, math.nan)
        shown = (Number(x, unit, shown=show_quantity(x, dimension_of(unit)) if command.size else "") for x in ends)
        late = Number(int(data.attrs["overruns"])), Number(float(data.attrs["latest"]), "s")
        samples = Number(data.sizes["time"], shown=f"{data.sizes['time']}")
        runs.append((str(k), run.status, samples, *shown, *(late if late[0].value else ())))
        for name, error in of_run.items():
            errors.append((str(k), f"{name} error", *(Number(x / 100, shown=f"{x:.3g} %") for x in error)))
    of_errors = {"run": "run", "of": "of the reference's range", "rms": "rms", "largest": "largest"}
    tables = [Table("runs", heads, runs, listed=True), Table("errors", of_errors, errors, listed=True)]
    last = found[-1]
    attributes = {"status": last.status, "status_reason": last.reason}
    title = f"{last.data.attrs['title']}: {last.status}, {last.data.sizes['time']} samples"
    return Summary(title, tables, above=notes, attributes=attributes)
