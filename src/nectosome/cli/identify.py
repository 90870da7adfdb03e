"""`nectosome identify`: unknown quantities of a robot or a model, from recordings and from features of gaits."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from nectosome import view
from nectosome.cli import options
from nectosome.cli.identify_pages import (
    gait_summary,
    hysteresis_summary,
    robot_summary,
    surge_summary,
    thruster_summary,
)
from nectosome.cli.options import Cluster, build_weighed, command, goes_on, on_cluster, robot_named
from nectosome.cli.output import Outputs, check_target, described, tell, write
from nectosome.cli.progress import progress_bar
from nectosome.units import InputError, read_pairs, read_positive, read_quantity

identify = command(
    App(name="identify", help="Find unknown quantities of a robot or a model from recordings and gaits.")
)


def _few_starts(_: object) -> str:
    """How many starts there are unless given."""
    return "1, and 4 where it does not fit"


@identify.default
def identify_robot(
    robot: options.Robot,
    /,
    *,
    campaign: options.Campaign,
    vary: options.Vary = None,
    compare: Annotated[
        list[str] | None,
        Parameter(help="COLUMN=READING, such as push=-force.x or tip=tail.tip.position.y; may be repeated."),
    ] = None,
    drive: Annotated[
        list[str] | None,
        Parameter(help="COLUMN=PATH: a column in place of a signal, at rest also of a number; may be repeated."),
    ] = None,
    error: Annotated[
        list[str] | None,
        Parameter(help="COLUMN=VALUE: its standard error; that of the residuals unless given; may be repeated."),
    ] = None,
    skip: Annotated[str | None, options.value("Time at the start that is not compared.")] = None,
    start: Annotated[
        list[str] | None,
        Parameter(
            help='PATH=RANGE, a number or "reading": how a joint or strain starts; before.PATH=..., what the robot had '
            "before it was let go; before=equilibrium; may be repeated."
        ),
    ] = None,
    shift: Annotated[
        str | None, options.value("How much later readings are than inputs: a range of what is unknown, or a time.")
    ] = None,
    loss: Annotated[
        str,
        Parameter(help="squares, or huber: readings that are far off, such as outliers of a tracker, weigh little."),
    ] = "squares",
    starts: Annotated[int | None, options.starts(1000), Parameter(show_default=_few_starts)] = None,
    cluster: Cluster = None,
    settings: options.Settings = None,
    test: options.Test = None,
    tuned: options.WriteRobot = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Find unknown quantities of a robot: its motion, or its shape at rest, is fitted to recordings.

    With --save the fits from starts, and each step of the one in progress, are kept beside the file until all is done:
    the same command again goes on from there.
    """
    seconds = 0.0 if skip is None else read_positive(skip, "time", "--skip")
    ranges = read_pairs(vary, "--vary", "E=1..9MPa log")
    compared = read_pairs(compare, "--compare", "push=-force.x")
    drives = read_pairs(drive, "--drive", "pressure=body.loads.blow.pressure")
    errors = read_pairs(error, "--error", "tip=0.5mm")
    begun = read_pairs(start, "--start", "body.joint.position=-20..20deg")
    outputs.check()
    check_target(tuned, "--write", ".yaml", outputs.force)

    from nectosome import identification
    from nectosome.identification.robot.fit_progress import FORECAST, forget

    build_weighed(robot_named(robot, settings), robot)
    folder = None if outputs.save is None else outputs.save.with_suffix(".parts")

    def progress(what: str, share: float) -> None:
        if what.startswith(FORECAST):
            tell(f"{what}.", kept=False)
        update(what, share)

    with progress_bar(f"fitting {robot}") as update:
        try:
            found = on_cluster(
                cluster,
                lambda executor: identification.identify(
                    robot,
                    campaign,
                    settings or (),
                    vary=ranges,
                    compare=compared,
                    drive=drives,
                    errors=errors,
                    skip=seconds,
                    start=begun,
                    shift=shift or 0.0,
                    test=test or (),
                    loss=loss,
                    starts=starts,
                    folder=folder,
                    executor=executor,
                    progress=progress,
                ),
                folder,
            )
        except KeyboardInterrupt:
            tell(f"cancelled.{goes_on(folder)}")
            return 130
    if found is None:
        return 1
    inputs = {"robot": robot, "campaign": campaign, "vary": vary, "compare": compare, "drive": drive, "error": error}
    inputs |= {
        "skip": skip,
        "start": start,
        "shift": shift,
        "loss": loss,
        "starts": starts,
        "set": settings,
        "test": test,
    }
    data = described(found.to_dataset(), f"{found.description.name}, fitted to {campaign.name}", inputs)
    write(robot_summary(data))
    if tuned is not None:
        from nectosome.description import save_robot

        save_robot(found.robot, tuned)
    outputs.write(data, lambda data, path: view.show_robot_fit(data, path), tuned)
    if folder is not None:
        forget(folder)
    return 0


@identify.command
def surge(
    *,
    campaign: options.Campaign,
    mass: Annotated[str, options.value("Mass of the robot, such as 0.755kg.")],
    method: Annotated[
        str, Parameter(help="output_error, instrumental_variables, integral_windows, or finite_differences.")
    ] = "output_error",
    test: options.Test = None,
    smooth: Annotated[
        str | None, options.value("Window of a filter, such as 0.2s, for integral_windows and finite_differences.")
    ] = None,
    outputs: Outputs = Outputs(),
) -> None:
    """Find added mass and drag of a swimmer from its speed and thrust: (M + m_as) dv/dt = -Lambda v|v| + thrust."""
    kilograms = read_positive(f"{mass}kg" if _bare(mass) else mass, "mass", "--mass")
    window = None if smooth is None else read_positive(smooth, "time", "--smooth")
    outputs.check()

    from nectosome import identification

    with progress_bar("fitting added mass and drag"):
        found = identification.identify_surge(campaign, kilograms, method=method, smooth=window, test=test or ())
        data = found.to_dataset()
    inputs = {"campaign": campaign, "mass": mass, "method": method, "smooth": smooth, "test": ", ".join(test or ())}
    described(data, f"surge of {campaign.name} by {method}", inputs)
    write(surge_summary(data, [*found.recordings, *found.test]))
    outputs.write(data, lambda data, path: view.show_surge(data, path))


@identify.command
def hysteresis(
    *,
    campaign: options.Campaign,
    order: Annotated[int, options.whole("Order of the transfer function.", 1, 6)] = 2,
    zeros: Annotated[int, options.whole("Zeros of the transfer function, fewer than its order.", 0, 5)] = 0,
    slew: Annotated[bool, Parameter(help="Pressures are commands: fit the slew limit of the valve.")] = False,
    dead_band: Annotated[bool, Parameter(help="Likewise: fit its dead band on reversals.")] = False,
    resolution: Annotated[bool, Parameter(help="Likewise: fit the steps in which it moves.")] = False,
    dead_time: Annotated[bool, Parameter(help="Fit how late the displacement answers the pressure.")] = False,
    test: options.Test = None,
    outputs: Outputs = Outputs(),
) -> None:
    """Find hysteresis and dynamics of a soft actuator from its pressure and displacement."""
    outputs.check()

    from nectosome import identification

    with progress_bar("fitting hysteresis and dynamics"):
        asked = {"slew": slew, "dead_band": dead_band, "resolution": resolution, "dead_time": dead_time}
        found = identification.identify_hysteresis(campaign, order=order, zeros=zeros, **asked, test=test or ())
        data = found.to_dataset()
    inputs = {"campaign": campaign, "order": order, "zeros": zeros, **asked, "test": ", ".join(test or ())}
    described(data, f"hysteresis of {campaign.name}", inputs)
    write(hysteresis_summary(data, [*found.recordings, *found.test]))
    outputs.write(data, lambda data, path: view.show_hysteresis(data, path))


@identify.command
def gait(
    *,
    target: Annotated[Path, Parameter(help="Gaits (.yaml): the robot, what varies, and features of each trial.")],
    optimiser: Annotated[
        str, Parameter(help="cmaes, genetic, differential, or nsga2, one objective a trial.")
    ] = "cmaes",
    seed: options.Seed = options.SEED,
    evaluations: Annotated[int, options.whole("Largest number of evaluations of each trial.", 1, 10_000_000)] = 3000,
    goal: Annotated[str, options.value("Discrepancy at which the search ends (eq. 13).")] = "1e-6",
    out: Annotated[
        Path | None, Parameter(help="Folder of all evaluations; the same command again continues there.")
    ] = None,
    cluster: Cluster = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Find parameters with which a robot on legs has the features of measured gaits, and which are identifiable."""
    enough = read_quantity(goal, "number", "--goal")
    if enough < 0:
        raise InputError(f'"{goal}" is out of range: it must be at least 0.', field="--goal")
    outputs.check()

    from nectosome import identification

    with progress_bar("fitting gaits") as update:
        how = {"optimiser": optimiser, "seed": seed, "evaluations": evaluations, "goal": enough, "folder": out}
        found = on_cluster(
            cluster,
            lambda executor: identification.identify_gait(target, **how, executor=executor, progress=update),
            out,
        )
    if found is None:
        return 1
    inputs = {"target": target, "optimiser": optimiser, "seed": seed, "evaluations": evaluations, "goal": enough}
    title = f"{found.fit.description.name}, fitted to gaits of {target.name} by {optimiser}"
    data = described(found.to_dataset(), title, inputs)
    data.attrs["words"] = json.dumps(found.identifiability.words())
    write(gait_summary(data))
    outputs.write(data, lambda data, path: view.show_gait(data, path))
    return 0


@identify.command
def thruster(
    tables: Annotated[
        list[Path], Parameter(help="Tables of its maker, such as of 12 V and of 16 V: command, speed, A, V and thrust.")
    ],
    /,
    *,
    diameter: Annotated[str, options.value("Diameter of the propeller, such as 76mm.")],
    config: Annotated[Path | None, Parameter(help="Sheet (.yaml) that names the columns of the tables.")] = None,
    outputs: Outputs = Outputs(),
) -> None:
    """Find coefficients, motor and dead band of a thruster from tables of thrust on a stand."""
    read_positive(diameter, "length", "--diameter")
    outputs.check()

    from nectosome import identification

    found = identification.identify_thruster(tables, diameter, config=config)
    inputs = {"tables": ", ".join(map(str, tables)), "diameter": diameter, "config": config}
    data = described(found.to_dataset(), f"thruster of {', '.join(table.name for table in found.tables)}", inputs)
    write(thruster_summary(data))
    outputs.write(data, lambda data, path: view.show_thruster(data, path))


def _bare(text: str) -> bool:
    """Whether a mass has no unit: it counts as kg."""
    try:
        return bool(float(text))
    except ValueError:
        return False
