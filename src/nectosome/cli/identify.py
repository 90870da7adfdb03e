"""`nectosome identify`: parameters of a model, from recordings and from features of gaits."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from nectosome.cli.identify_robot import identify_robot
from nectosome.cli.options import planned_files, read_count
from nectosome.cli.output import check_target, write
from nectosome.cli.progress import progress_bar
from nectosome.io import provenance, save_dataset
from nectosome.units import InputError, did_you_mean, read_positive, read_quantity

_SOLVERS = ("cmaes", "genetic", "differential", "nsga2")

identify = App(name="identify", help="Find parameters of a model from recordings and gaits.")
identify.default(identify_robot)


@identify.command
def swim(
    *,
    campaign: Annotated[Path, Parameter(help="Campaign (.yaml): recordings of speed and thrust.")],
    mass: Annotated[str, Parameter(help="Mass of the robot, such as 0.755kg.", allow_leading_hyphen=True)],
    method: Annotated[
        str, Parameter(help="output-error, instruments, windows, or printed, as papers do it.")
    ] = "output-error",
    test: Annotated[
        list[str] | None,
        Parameter(help="Files with speeds that are not fitted but predicted.", consume_multiple=True),
    ] = None,
    smooth: Annotated[
        str | None,
        Parameter(help="Window of a filter, such as 0.2s, for windows and printed.", allow_leading_hyphen=True),
    ] = None,
    save: Annotated[Path | None, Parameter(help="Where parameters and speeds go (.nc).")] = None,
    plot: Annotated[Path | None, Parameter(help="Where the page with figures goes (.html).")] = None,
) -> None:
    """Find added mass and drag of a swimmer from its speed and thrust: (M + m_as) dv/dt = -Lambda v|v| + thrust."""
    kilograms = read_positive(f"{mass}kg" if _bare(mass) else mass, "mass", "--mass")
    window = None if smooth is None else read_positive(smooth, "time", "--smooth")
    _check_targets(save, plot)

    planned, held_out = planned_files(campaign, test)

    from nectosome.cli.identify_pages import swim_page
    from nectosome.identification.surge.estimators import METHODS, surge
    from nectosome.identification.surge.files import surge_data, surge_recordings

    if method not in METHODS:
        raise InputError(f'"{method}" is no method.{did_you_mean(method, METHODS)}', field="--method")
    with progress_bar("identifying") as update:
        recordings = surge_recordings([one.read() for one in planned.planned])
        update("fitting", 0.3)
        held = [recording for recording in recordings if recording.file in held_out]
        fitted = [recording for recording in recordings if recording.file not in held_out]
        for name in held_out - {recording.file for recording in held}:
            raise InputError(f'"{name}" holds no speed: name the files that do.', field="--test")
        if not fitted:
            raise InputError("all recordings are held out: nothing is left to fit.", field="--test")
        found = surge(fitted, kilograms, method, window)
        data = surge_data(found, fitted, held)
    asked = {"campaign": campaign, "mass": mass, "method": method, "smooth": smooth, "test": ", ".join(test or ())}
    data.attrs |= {
        "title": f"surge of {campaign.name} by {method}",
        "provenance": json.dumps(provenance({key: value and str(value) for key, value in asked.items()})),
    }
    written = [str(target) for target in (save, plot) if target is not None]
    if save is not None:
        save_dataset(data, save)
    if plot is not None:
        from nectosome.view import show_surge

        show_surge(data, plot)
    write(swim_page(data, recordings), *([f"written: {', '.join(written)}"] if written else []))


@identify.command
def fishtail(
    *,
    campaign: Annotated[Path, Parameter(help="Campaign (.yaml): recordings of pressure and displacement.")],
    order: Annotated[str, Parameter(help="Of the transfer function.", allow_leading_hyphen=True)] = "2",
    slew: Annotated[bool, Parameter(help="Pressures are commands: fit the rate that the valve keeps to.")] = False,
    test: Annotated[
        list[str] | None, Parameter(help="Files that are not fitted but predicted.", consume_multiple=True)
    ] = None,
    save: Annotated[Path | None, Parameter(help="Where parameters and displacements go (.nc).")] = None,
    plot: Annotated[Path | None, Parameter(help="Where the page with figures goes (.html).")] = None,
) -> None:
    """Find hysteresis and dynamics of a soft actuator from its pressure and displacement."""
    degree = read_count(order, "--order", least=1, most=6)
    _check_targets(save, plot)

    planned, held_out = planned_files(campaign, test)

    from nectosome.cli.identify_pages import fishtail_page
    from nectosome.identification.hysteresis.files import hysteresis_data, pressure_recordings
    from nectosome.identification.hysteresis.fit import identify_hysteresis

    with progress_bar("identifying") as update:
        recordings = pressure_recordings([one.read() for one in planned.planned])
        update("fitting", 0.3)
        held = [one.trial for one in recordings if one.file in held_out]
        fitted = [one.trial for one in recordings if one.file not in held_out]
        if not fitted:
            raise InputError("all recordings are held out: nothing is left to fit.", field="--test")
        data = hysteresis_data(identify_hysteresis(fitted, degree, slew), fitted, held)
    asked = {"campaign": campaign, "order": order, "slew": slew, "test": ", ".join(test or ())}
    data.attrs |= {
        "title": f"hysteresis of {campaign.name}",
        "provenance": json.dumps(provenance({key: str(value) for key, value in asked.items()})),
    }
    if save is not None:
        save_dataset(data, save)
    if plot is not None:
        from nectosome.view import show_hysteresis

        show_hysteresis(data, plot)
    written = [str(target) for target in (save, plot) if target is not None]
    write(fishtail_page(data, recordings), *([f"written: {', '.join(written)}"] if written else []))


def _check_targets(save: Path | None, plot: Path | None) -> None:
    for target, option, suffix in ((save, "--save", ".nc"), (plot, "--plot", ".html")):
        if target is not None:
            check_target(target, option, suffix)


@identify.command
def crawl(
    *,
    target: Annotated[Path, Parameter(help="Gaits (.yaml): the robot, what is unknown, features to come to.")],
    solver: Annotated[str, Parameter(help="cmaes, genetic, differential, or nsga2, one objective a trial.")] = "cmaes",
    seed: Annotated[str, Parameter(help="Other seeds search elsewhere.", allow_leading_hyphen=True)] = "1",
    evaluations: Annotated[
        str, Parameter(help="At most so many walks of each trial.", allow_leading_hyphen=True)
    ] = "3000",
    goal: Annotated[str, Parameter(help="It ends at this discrepancy (eq. 13).", allow_leading_hyphen=True)] = "1e-6",
    out: Annotated[
        Path | None, Parameter(help="Folder in which walks are kept; the same command goes on there.")
    ] = None,
    save: Annotated[Path | None, Parameter(help="Where parameters and motion go (.nc).")] = None,
    plot: Annotated[Path | None, Parameter(help="Where the page with figures goes (.html).")] = None,
) -> None:
    """Find parameters with which a robot walks as it was seen to, and tell which of them its gait tells."""
    most = read_count(evaluations, "--evaluations", least=1, most=10_000_000)
    number = read_count(seed, "--seed", least=0, most=999_999_999)
    enough = read_quantity(goal, "number", "--goal")
    if enough < 0:
        raise InputError(f'"{goal}" is out of range: it must be at least 0.', field="--goal")
    _check_targets(save, plot)
    if solver not in _SOLVERS:
        raise InputError(f'"{solver}" is no solver.{did_you_mean(solver, _SOLVERS)}', field="--solver")

    from nectosome.identification import identifiability
    from nectosome.identification.gait.files import load_gait_fit
    from nectosome.identification.gait.fit import gait_data, gait_optimiser
    from nectosome.search import minimise

    fit = load_gait_fit(target)
    several = solver == "nsga2"
    if several and len(fit.trials) < 2:
        raise InputError("nsga2 is between several trials, and there is one. Take another solver.", field="--solver")
    with progress_bar("walking") as update:
        found = minimise(
            fit.task(by_trial=several),
            gait_optimiser(solver, most),
            seed=number,
            target=None if several else enough,
            folder=out,
            progress=lambda done, best: update(f"discrepancy {best:.2g}", done / most),
        ).summed()  # of a front, the one with the least sum is told
        if found.best is None:
            raise InputError("no candidate walks: none of them gave features.", file=str(target))
        best = fit.ranges.values(found.best.u)
        update("what the features tell", 1.0)
        told = identifiability(fit.misfit, best)
        walked = fit.walked(best[None])
    from nectosome.cli.identify_pages import crawl_page

    data = gait_data(fit, found, walked, told, max(10 * found.value, enough))
    asked = {"target": target, "solver": solver, "seed": number, "evaluations": most, "goal": enough}
    data.attrs |= {
        "title": f"{fit.description.name}, to gaits of {target.name} by {solver}",
        "words": json.dumps(told.words()),
        "provenance": json.dumps(provenance({key: str(value) for key, value in asked.items()})),
    }
    written = [str(file) for file in (save, plot) if file is not None]
    if save is not None:
        save_dataset(data, save)
    if plot is not None:
        from nectosome.view import show_gait

        show_gait(data, plot)
    write(crawl_page(data), *([f"written: {', '.join(written)}"] if written else []))


def _bare(text: str) -> bool:
    """Whether a mass has no unit: it counts as kg."""
    try:
        return bool(float(text))
    except ValueError:
        return False
