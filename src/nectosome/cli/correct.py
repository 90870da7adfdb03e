"""`nectosome correct`: a simulator made to agree with a few experiments."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

from cyclopts import Parameter

from nectosome.cli.options import read_count
from nectosome.cli.output import check_target, write
from nectosome.cli.progress import progress_bar
from nectosome.cli.sweep import swept
from nectosome.io import load_dataset, provenance, save_dataset
from nectosome.units import InputError, did_you_mean, read_positive

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.identification import Aim
    from nectosome.measure import Campaign

_AIMS = ("error", "highest", "lowest")


def correct(
    robot: Annotated[str | None, Parameter(help="Robot that ships, or file: its grid is simulated first.")] = None,
    /,
    *,
    over: Annotated[
        list[str] | None, Parameter(help="Axis of a robot's grid, such as A=30:75:5deg, as for sweep; may be repeated.")
    ] = None,
    settings: Annotated[
        list[str] | None, Parameter("--set", help="PATH=VALUE of a robot, such as E=3MPa; may be repeated.")
    ] = None,
    sim: Annotated[Path | None, Parameter(help="Grid that is there already (.nc), as sweep --save writes it.")] = None,
    measured: Annotated[Path, Parameter(help="Campaign (.yaml): recordings and the conditions of each.")],
    method: Annotated[
        str | None,
        Parameter(help="cn-gp, cn-svd, gp, cn, ...; left out, cn-gp, or gp where no parameter is simulated."),
    ] = None,
    upcoming: Annotated[
        str, Parameter("--next", help="How many experiments to propose.", allow_leading_hyphen=True)
    ] = "3",
    aim: Annotated[str, Parameter(help="What they are for: error, highest or lowest.")] = "error",
    quantity: Annotated[
        str | None,
        Parameter(
            help="Such as force.y; -force.y where the sensor reads the other way. Left out, the one that both have.",
            allow_leading_hyphen=True,
        ),
    ] = None,
    parameter: Annotated[
        str | None, Parameter(help="NAME=VALUE that the simulator takes, such as Cn=1; left out, that of the sweep.")
    ] = None,
    lowpass: Annotated[
        str | None, Parameter(help="Cutoff for the peaks of recordings, such as 10Hz.", allow_leading_hyphen=True)
    ] = None,
    save: Annotated[Path, Parameter(help="Where the corrected grid goes (.nc).")] = Path("corrected.nc"),
    plot: Annotated[Path, Parameter(help="Where the page with figures goes (.html).")] = Path("corrected.html"),
) -> int:
    """Correct a simulated grid with a few experiments, tell how well, and which experiments to make next.

    The grid is a robot's over some of its quantities (ROBOT --over ...), or one that is there already (--sim). The
    corrected grid and figures are written into the current folder, unless other files are named.
    """
    _check_grid(robot, over, settings, sim)
    count = read_count(upcoming, "--next", least=1, most=50)
    if aim not in _AIMS:
        raise InputError(f'"{aim}" is no aim.{did_you_mean(aim, _AIMS)}', field="--aim")
    cutoff = None if lowpass is None else read_positive(lowpass, "frequency", "--lowpass")
    for target, option, suffix in ((save, "--save", ".nc"), (plot, "--plot", ".html")):
        check_target(target, option, suffix)

    pass
    from nectosome.designs.sweep import forget
    from nectosome.identification import SimToReal, correct_grid
    from nectosome.measure import load_campaign

    if method is not None:
        SimToReal(method)  # a mistake in its name is told before anything is read
    recordings = _read(load_campaign(measured))  # a mistake in them is told before anything long is computed
    folder = save.with_suffix(".parts")
    if sim is not None:
        grid = load_dataset(sim)
    else:
        computed = swept(str(robot), over or (), settings or (), folder=folder)
        if computed is None:
            return 130
        grid = computed[0]
    with progress_bar("correcting") as update:
        found, observed, column = correct_grid(
            grid,
            recordings,
            quantity=quantity,
            parameter=parameter,
            method=method,
            lowpass=cutoff,
            count=count,
            aim=cast("Aim", aim),
            progress=update,
        )
    asked: dict[str, Any] = {
        "robot": robot,
        "over": ", ".join(over or ()),
        "set": ", ".join(settings or ()),
        "sim": sim,
    }
    asked |= {"measured": measured, "method": found.attrs["method"], "next": count}
    asked |= {"aim": aim, "quantity": quantity, "parameter": parameter, "lowpass": lowpass}
    found.attrs |= {
        "title": f"{column} of {robot if sim is None else sim.name}, corrected with {measured.name}",
        "provenance": json.dumps(provenance({key: value and str(value) for key, value in asked.items()})),
    }
    from nectosome.view import show_correction

    save_dataset(found, save)
    show_correction(found, plot, aim)
    from nectosome.cli.identify_pages import correction_page

    write(correction_page(found, observed, aim), f"written: {save}, {plot}")
    if sim is None:
        forget(folder)
    return 0


def _check_grid(
    robot: str | None, over: Sequence[str] | None, settings: Sequence[str] | None, sim: Path | None
) -> None:
    """Raise InputError unless there is a robot with axes, or a grid."""
    if (robot is None) == (sim is None):
        raise InputError("takes a robot with --over, or a grid with --sim: one of the two.", field="correct")
    if robot is not None and not over:
        raise InputError(f"{robot} is simulated over nothing. Name an axis, as in f=0.5:2:0.5Hz.", field="--over")
    if sim is not None and (over or settings):
        raise InputError("--over and --set are of a robot, and a grid is there already.", field="--sim")


def _read(campaign: "Campaign") -> "list[xr.Dataset]":
    recordings = []
    with progress_bar("reading") as update:
        for k, planned in enumerate(campaign.planned):
            update(planned.path.name, k / len(campaign.planned))
            recordings.append(planned.read())
    return recordings
