"""`nectosome correct`: a simulator made to agree with a few experiments."""

from concurrent.futures import CancelledError
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from nectosome import view
from nectosome.cli.options import Campaign, Cluster, Over, Settings, command, goes_on, on_cluster, value, whole
from nectosome.cli.output import Outputs, described, tell, write
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io.summary import Summary
from nectosome.units import InputError, read_pairs, read_positive

if TYPE_CHECKING:
    from nectosome.identification import CorrectedGrid


@command
def correct(
    robot: Annotated[
        str | None, Parameter(help="Name of a robot that ships, or a robot file; its grid is simulated first.")
    ] = None,
    /,
    *,
    campaign: Campaign,
    over: Over = None,
    settings: Settings = None,
    sim: Annotated[
        Path | None, Parameter(help="Saved grid (.nc) instead of a robot, as sweep --save writes it.")
    ] = None,
    method: Annotated[
        str | None,
        Parameter(help="cn-gp, cn-svd, gp, cn, ...; by default cn-gp, or gp without a parameter."),
    ] = None,
    upcoming: Annotated[int, whole("Number of experiments to propose.", 1, 50, "--next")] = 3,
    aim: Annotated[Literal["error", "highest", "lowest"], Parameter(help="Purpose of these experiments.")] = "error",
    quantity: Annotated[
        str | None,
        value(
            "Quantity to correct, such as force.y; -force.y for a sensor of opposite sign; by default the common one."
        ),
    ] = None,
    parameter: Annotated[
        str | None, Parameter(help="NAME=VALUE of the simulator, such as Cn=1; by default that of the sweep.")
    ] = None,
    lowpass: Annotated[str | None, value("Cutoff for the peaks of recordings, such as 10Hz.")] = None,
    cluster: Cluster = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Correct a simulated grid with a few experiments, with its errors, and propose the next experiments.

    The grid is a robot's over some of its quantities (ROBOT --over ...), or a saved one (--sim). With --save finished
    parts of a sweep are kept beside the file until all is done: the same command again goes on from them.
    """
    if (robot is None) == (sim is None):
        raise InputError("takes a robot with --over, or a grid with --sim: one of the two.", field="correct")
    if cluster is not None and sim is not None:
        raise InputError(
            "computes the grid of a robot, and --sim is one that is there. Leave it out.", field="--cluster"
        )
    axes = read_pairs(over, "--over", "f=0.5..2:0.5Hz")
    cutoff = None if lowpass is None else read_positive(lowpass, "frequency", "--lowpass")
    outputs.check()

    from nectosome import identification
    from nectosome.designs.kept_parts import forget

    folder = None if outputs.save is None or robot is None else outputs.save.with_suffix(".parts")
    chosen: dict[str, Any] = {"quantity": quantity, "parameter": parameter, "lowpass": cutoff, "aim": aim}
    chosen |= {"method": method, "over": axes, "count": upcoming, "folder": folder}
    with progress_bar("correcting") as update:
        given = robot or sim or "", campaign, settings or ()
        try:
            found = on_cluster(
                cluster,
                lambda executor: cancellable(
                    lambda progress: identification.correct(*given, **chosen, executor=executor, progress=progress),
                    update,
                ),
                folder,
            )
        except CancelledError:
            tell(f"cancelled.{goes_on(folder)}")
            return 130
    if found is None:
        return 1
    inputs = {"robot": robot, "over": ", ".join(over or ()), "set": ", ".join(settings or ()), "sim": sim}
    inputs |= {"campaign": campaign, "method": found.data.attrs["method"], "next": upcoming}
    inputs |= {"aim": aim, "quantity": quantity, "parameter": parameter, "lowpass": lowpass}
    title = f"{found.column} of {robot if sim is None else sim.name}, corrected with {campaign.name}"
    data = described(found.to_dataset(), title, inputs)
    write(_summary(found, aim))
    outputs.write(data, lambda grid, path: view.show_correction(grid, path, aim))
    if folder is not None:
        forget(folder)
    return 0


def _summary(found: "CorrectedGrid", aim: str) -> Summary:
    from nectosome.view.corrected_words import lines, read_lines, tables

    above, notes = read_lines(found.observed), lines(found.data, found.observed)
    title = str(found.data.attrs["title"])
    return Summary(title, tables(found.data, aim), above=above, notes=notes, attributes=found.data.attrs)
