"""`nectosome render`: a video of a robot, or a picture; it needs no browser, no display and no graphics card."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from nectosome import view
from nectosome.cli.options import RobotOrRun, Settings, build_weighed, command, robot_named, value, whole
from nectosome.cli.output import Force, Json, check_target, report, tell, unsolved, write
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io import is_results, load_dataset
from nectosome.io.extras import package
from nectosome.io.summary import Summary
from nectosome.io.tables import Number
from nectosome.units import InputError, read_positive, read_quantity

if TYPE_CHECKING:
    import xarray as xr

_SIZE, _FPS, _SPEED, _TIME = "1280x720", 30, "1", "5s"
_LEAST, _MOST = 128, 4096  # px
_FASTEST = 100.0  # times real time, and as many times slower
_MOST_FRAMES, _MOST_SAMPLES = 20_000, 100_000
_APART = 1 / 30  # s, largest distance of the times that are kept
_FOUND = ("SOLVED", "EVENT", "UNSTABLE", "SETTLED")  # statuses of motions that are complete


@command
def render(
    robot: RobotOrRun,
    /,
    *,
    save: Annotated[Path, Parameter(help="Write a video (.mp4) or a picture (.png, .svg) to this file.")],
    force: Force = False,
    as_json: Json = False,
    settings: Settings = None,
    time: Annotated[str | None, value(f"Length, with its unit; {_TIME} of a robot, all of a run by default.")] = None,
    at: Annotated[str | None, value("Time of a picture, such as 1.5s; the end by default.")] = None,
    size: Annotated[str, value("Width and height in pixels.")] = _SIZE,
    fps: Annotated[int | None, whole(f"Frames per second of a video; {_FPS} by default.", 1, 120)] = None,
    speed: Annotated[str | None, value("Speed of a video over real time; 0.25 is four times slower.")] = None,
    camera: Annotated[
        Literal["three-quarter", "side", "top", "front"],
        Parameter(help="Where the camera is; it moves with the robot."),
    ] = "three-quarter",
) -> int:
    """Write a video or a picture of a robot that is simulated from rest, or of a saved run."""
    check_target(save, "--save", (".mp4", ".png", ".svg"), force)
    still = save.suffix != ".mp4"
    if still:
        for option, given in (("--fps", fps), ("--speed", speed)):
            if given is not None:
                raise InputError("is for a video. Leave it out.", field=option)
    elif at is not None:
        raise InputError("is for a picture (.png, .svg). Leave it out.", field="--at")
    pixels, rate = _read_size(size), _FPS if fps is None else fps
    speedup = read_quantity(_SPEED if speed is None else speed, "number", "--speed")
    if not 1 / _FASTEST <= speedup <= _FASTEST:
        raise InputError(f'"{speed}" is out of range: {1 / _FASTEST:g} to {_FASTEST:g} are allowed.', field="--speed")
    seconds = None if time is None else read_positive(time, "time", "--time")
    instant = None if at is None else read_quantity(at, "time", "--at")
    for name in ("cv2",) if still else ("cv2", "av"):
        package(name, "video")

    with progress_bar(Path(robot).stem) as update:
        if is_results(robot):
            if settings:
                raise InputError("is for a robot; a saved run stays as it is. Leave it out.", field="--set")
            from nectosome.view.saved import check_drawable, saved_run

            run = saved_run(load_dataset(robot), robot)
            check_drawable(run, robot)
            if seconds is None and run.attrs["status"] not in _FOUND:
                why = f"{run.attrs['status_reason']}, at {run['time'].values[-1]:.4g} s"
                tell(f"{robot}: {why}. Say by --time how much of it to show.")
                return 1
        else:
            seconds = read_positive(_TIME, "time", "--time") if seconds is None else seconds
            apart = _APART if still else min(speedup / rate, _APART)
            if seconds / apart >= _MOST_SAMPLES:
                raise InputError(f"{seconds:g} s take more than {_MOST_SAMPLES} samples.", field="--time")
            if not still:
                _check_frames(seconds, rate, speedup)
            run = _simulated(robot, settings or [], seconds, max(math.ceil(seconds / apart), 60) + 1, update)
            if isinstance(run, int):
                return run
        first, last = (float(run["time"].values[k]) for k in (0, -1))
        end = last if seconds is None else first + seconds
        if end > last * (1 + 1e-9):
            raise InputError(f"{robot} ends at {last:.4g} s.", field="--time")
        if not still and end <= first:
            raise InputError(f"{robot} holds one sample only: write a picture (.png).", field="--save")

        if still:
            instant = end if instant is None else instant
            if not first <= instant <= end:
                raise InputError(f"{instant:g} s is not from {first:.4g} to {end:.4g} s.", field="--at")
            view.write_still(run, save, at=instant, end=end, size=pixels, camera=camera)
            report(save)
            return 0
        _check_frames(end - first, rate, speedup)
        options: dict[str, Any] = {"size": pixels, "camera": camera, "rate": rate, "speed": speedup}
        count = view.write_film(run, save, end=end, progress=lambda share: update("drawing", share), **options)
    values = {"frames": Number(count), "time": Number(count / rate, "s")}
    write(Summary(notes=[f"{count} frames, {count / rate:.4g} s"], values=values))
    report(save)
    return 0


def _simulated(
    robot: str, settings: list[str], seconds: float, samples: int, update: Callable[[str, float], None]
) -> "xr.Dataset | int":
    """A run from rest, or the exit code where it was not solved or cancelled."""
    description = robot_named(robot, settings)

    from nectosome.core import Status
    from nectosome.solve import prepare_results, simulate

    def compute(progress: Callable[[str, float], bool]) -> Any:
        built = build_weighed(description, robot)
        prepare_results(built, samples)
        run = simulate(built, seconds, samples=samples, progress=lambda share: progress("simulating", share))
        if Status(int(run.status)) not in (Status.SOLVED, Status.EVENT):
            return run, None
        return run, run.to_dataset({"robot": robot, "set": settings, "time": seconds})

    run, found = cancellable(compute, update)
    if found is not None:
        return found
    status, reached = Status(int(run.status)), float(run.value.time[-1])
    come = f"{status.reason}, at {reached:.4g} s of {seconds:.4g} s; nothing is written."
    if status == Status.CANCELLED:
        tell(f"{description.name}: {come}")
        return 130
    return unsolved(description.name, status, f"{come} With a shorter --time there is something to show.")


def _read_size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,6})x(\d{1,6})", text)
    if found is None:
        raise InputError(f'"{text}" is no width and height, such as {_SIZE}.', field="--size")
    width, height = (int(number) for number in found.groups())
    if not all(_LEAST <= number <= _MOST and number % 2 == 0 for number in (width, height)):
        what = f"even numbers from {_LEAST} to {_MOST} are allowed"
        raise InputError(f'"{text}" cannot be: {what}.', field="--size")
    return width, height


def _check_frames(seconds: float, rate: int, speedup: float) -> None:
    """Raise InputError where a video of so much time would have too many frames."""
    if seconds * rate / speedup > _MOST_FRAMES:
        way_out = "a shorter --time, a lower --fps or a higher --speed"
        raise InputError(f"{seconds:g} s make more than {_MOST_FRAMES} frames: take {way_out}.", field="--time")
