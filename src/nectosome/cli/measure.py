"""`nectosome measure`: what recordings hold."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from nectosome import view
from nectosome.cli.options import Campaign, command, value
from nectosome.cli.output import Outputs, described, write
from nectosome.cli.progress import progress_bar
from nectosome.io.summary import Summary
from nectosome.units import InputError
from nectosome.view.means_words import means_table
from nectosome.view.recording_words import recording_summary

if TYPE_CHECKING:
    import xarray as xr


@command
def measure(
    *files: Annotated[Path, Parameter(help="Recordings, such as .csv, .xlsx, .mat, .tdms, .h5, .nc, .c3d, .mcap.")],
    config: Annotated[Path | None, Parameter(help="Sheet (.yaml): quantity, unit and sign of each column.")] = None,
    campaign: Campaign | None = None,
    means: Annotated[
        str | None, Parameter(help="Column whose means by conditions are printed, with errors; of a campaign.")
    ] = None,
    against: Annotated[
        str | None,
        Parameter(help="Column beside it, such as tip: phase, area of their loop and power are printed too."),
    ] = None,
    sim: Annotated[Path | None, Parameter(help="Simulated grid (.nc), by sweep, to stand beside the means.")] = None,
    quantity: Annotated[
        str | None, value("Quantity of the grid, such as force.y; -force.y for a sensor of opposite sign.")
    ] = None,
    memory: Annotated[str, Parameter(help="Memory that the contents of one file may take, also unpacked.")] = "1GB",
    outputs: Outputs = Outputs(),
) -> None:
    """Read recordings and print what they hold: quantities, units, repairs and oddities.

    Name files, or a campaign, which lists them. --save takes a single recording. With --means a campaign gives a table:
    the mean of a column at each of its conditions, over whole cycles and repeats, with standard errors of both.
    """
    outputs.check()

    if bool(files) == (campaign is not None):
        raise InputError("name files, or a campaign with --campaign.", field="measure")
    if campaign is not None and config is not None:
        raise InputError("the campaign names its sheets itself. Leave it out.", field="--config")

    from nectosome.measure import load_campaign, load_sheet, read_all
    from nectosome.measure.formats.file_errors import read_size

    if means is not None and campaign is None:
        raise InputError("takes the conditions of a campaign. Give one with --campaign.", field="--means")
    for option, given in (("--against", against), ("--sim", sim)):
        if given is not None and means is None:
            raise InputError("goes with --means. Give that too, or leave it out.", field=option)
    if quantity is not None and sim is None:
        raise InputError("is one of the grid. Give that with --sim, or leave it out.", field="--quantity")
    limit = read_size(memory, "--memory")
    known = load_sheet(config) if config is not None else None
    recordings: list[xr.Dataset] = []
    with progress_bar("reading") as update:
        if campaign is not None:
            recordings += load_campaign(campaign).recordings(update, limit)
        for k, file in enumerate(files):
            update(file.name, k / len(files))
            recordings += read_all(file, known, memory=limit)
    if means is not None:
        found = _by_conditions(recordings, means, against, sim, quantity)
        settings = {"campaign": campaign, "means": means, "against": against, "sim": sim, "quantity": quantity}
        write(means_table(found))
        outputs.write(described(found, f"{means} by conditions, {Path(str(campaign)).name}", settings), view.show_means)
        return
    if outputs.save and len(recordings) > 1:
        raise InputError(f"only one recording can be saved, not {len(recordings)}.", field="--save")
    write(Summary(parts=[*map(recording_summary, recordings)]))
    if outputs.given:
        outputs.write(recordings[0], lambda _, path: view.show_recordings(recordings, path))


def _by_conditions(
    recordings: "list[xr.Dataset]", means: str, against: str | None, sim: Path | None, quantity: str | None
) -> "xr.Dataset":
    """The table, with what a grid has beside it."""
    from nectosome.identification.sim2real.grids import simulated_at
    from nectosome.io import load_dataset
    from nectosome.measure.condition_means import condition_means

    found = condition_means(recordings, means, against)
    if sim is None:
        return found
    grid = load_dataset(sim)
    try:
        return found.assign(simulated=simulated_at(grid, found, quantity))
    except InputError as error:
        raise InputError(error.message, file=error.file or str(sim), field=error.field) from None
