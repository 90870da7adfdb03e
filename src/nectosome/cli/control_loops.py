"""`nectosome control loops ROBOT FILE`: several controllers of a robot at once, rehearsed on its model, on a rig."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome import robots
from nectosome.cli.control import control
from nectosome.cli.control_on_rig import loops_on_rig, rig_file
from nectosome.cli.options import Robot, Settings
from nectosome.cli.output import Outputs
from nectosome.cli.progress import progress_bar
from nectosome.cli.weights import tell_far_out


@control.command(name="loops")
def control_loops(
    robot: Robot,
    file: Annotated[Path, Parameter(help="File of loops (.yaml): command, measure and reference of each.")],
    /,
    *,
    rig: Annotated[
        Path, Parameter(help="Rig on which to run them: a rig file (.yaml), or simulated, the robot itself.")
    ] = Path("simulated"),
    settings: Settings = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Run several controllers of a robot at once on a rig, after a rehearsal on the model.

    Controllers are found on the model, loop by loop, with the other commands at their initial values. Then
    all loops are rehearsed together, under the guards of the rig.
    """
    outputs.check()

    from nectosome.rigs.loops_file import load_loops

    tell_far_out(robots.describe(robot, settings or ()), robot)
    loops, on = load_loops(file), rig_file(rig)
    pairs = None if on is None else loops.pairs(on.rig)
    with progress_bar(Path(robot).stem):
        tasks = loops.tasks(robot, settings or (), None if on is None else on.dt)
        seconds = loops.seconds(tasks)
    given = loops.given.model_dump(mode="json", exclude_none=True, exclude={"about"})
    given |= {"robot": robot, "set": settings or [], "rig": str(rig)}
    return loops_on_rig(tasks, seconds, on, pairs, given, outputs, loops.errors_of)
