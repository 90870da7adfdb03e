"""What a loop of a controller and a robot is asked for on the page, made ready; and what it is told of it."""

import math
from html import escape
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from nectosome import controllers as control
from nectosome.description import (
    JointDescription,
    PrismaticJoint,
    RobotDescription,
    drive_period,
    get_value,
    numeric_paths,
    resolve,
)
from nectosome.mechanism import Robot
from nectosome.model import SampledPlant, reading_of
from nectosome.model.readings import Reading
from nectosome.studio.sliders import knobs_of
from nectosome.studio.work import Progress
from nectosome.units import InputError, parse_quantity, read_positive, read_quantity
from nectosome.units import show_quantity as shown

from .live_rig import FRAME, LONGEST, LiveRig

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.studio.session import Session

CONSTANT = "constant"
_USUAL, _A_BEAT = 20.0, 4  # samples a second, and in a beat where its mean is measured
_REHEARSED = 10.0  # s of the reference on the model, to find gains
_SPEEDS = ("surge", "sway", "climb")
_MOST, _NOTHING = 0.8, 1e-4  # of a speed or force; m/s, N
_SHARE = 0.5  # of a drive's amplitude, that its offset may be


class Asked(NamedTuple):
    """What stands on the page."""

    description: RobotDescription
    command: str
    measure: str
    mean: bool
    reference: str
    size: str
    frequency: str
    gains: str


class PreparedLoop(NamedTuple):
    """A rig that is ready, and what it is to follow."""

    rig: LiveRig
    wanted: control.Reference
    start: float  # what is measured at first [SI]
    course: np.ndarray | None  # by samples; None where the slider says it
    gains_text: str


def loop_of(asked: Asked, reach: control.CommandRange, model: Robot, progress: Progress) -> PreparedLoop | None:
    """Gains, and the robot under them, with all that is compiled; None where it was cancelled. Raises InputError."""
    constant = asked.reference == CONSTANT
    beat = control.read_beat(asked.description, reach, asked.mean)
    hertz = _A_BEAT * beat.at(reach.resting) if asked.mean and beat is not None else _USUAL
    dt = 1 / hertz
    moments = 1 if beat is None else control.moments_of(beat, reach.largest, dt)
    of = reading_of(model, asked.measure)
    read_quantity(asked.size, of.dimension, "reference")  # the name of a reference stands in another field here
    reference, amplitude = (asked.size, None) if constant else (asked.reference, asked.size)
    wanted = control.Reference.read(reference, amplitude, of.dimension)
    turns = 0.0 if constant else read_positive(asked.frequency, "frequency", "frequency")
    scale = np.array([reach.unit_size / wanted.unit_size])
    gains = None if not asked.gains.strip() else scale * _gains(asked.gains)
    if not progress(0.0, "compiling the equations"):
        return None
    robot = SampledPlant(asked.description, reach.name, asked.measure, dt, max(moments, math.ceil(dt / FRAME)))
    start = robot.start()[0].reading
    measuring = control.SensorModel(beat if asked.mean else None)
    if gains is None:
        about = wanted.size if constant else start
        course = wanted.samples(start, turns, _REHEARSED, dt)
        found = control.relay_gains(
            robot, reach.low, reach.high, about, measuring, progress=lambda share: progress(share, "finding gains")
        )
        pace = found and control.detune(
            robot,
            found.gains,
            reach.low,
            reach.high,
            course,
            measuring,
            progress=lambda share: progress(share, "rehearsing on the model"),
        )
        if found is None or pace is None:
            return None
        gains = control.time_scaled(found.gains, pace)
    if not progress(0.0, "compiling the rig"):
        return None
    pid = control.smooth_pid(gains, reach.low, reach.high, dt)
    course = None if constant else wanted.samples(start, turns, LONGEST + dt, dt)
    first = wanted.size if course is None else float(course[0])
    LiveRig(robot, pid, first, measuring).step(first)  # what has to be compiled is compiled here
    return PreparedLoop(
        LiveRig(robot, pid, first, measuring), wanted, start, course, ", ".join(f"{x:.4g}" for x in gains / scale)
    )


def commands_of(description: RobotDescription) -> tuple[str, ...]:
    """What can be commanded: offsets of drives first, by their short names where they have some, then all that has."""
    named = {path: alias for alias in description.aliases for path in resolve(description, alias)}
    offsets = [
        named.get(path, path) for path in numeric_paths(description) if path.endswith((".offset", ".force.value"))
    ]
    return tuple(dict.fromkeys([*offsets, *description.aliases])) or tuple(numeric_paths(description))


def first_range(session: "Session", command: str) -> str:
    """A range to begin with: of an offset half the amplitude of its drive to both sides, else that of the slider."""
    description = session.description
    for knob in knobs_of(description, session.problem.variables):
        if knob.name == command:
            return f"{knob.low:g}:{knob.high:g} {knob.unit}".strip()
    path = resolve(description, command)[0]
    known = numeric_paths(description)
    beside = path.rpartition(".")[0] + ".amplitude"
    if not path.endswith(".offset") or beside not in known:
        return ""
    most = _SHARE * abs(float(get_value(description, beside)))
    number, _, unit = shown(most, known[path].dimension).partition(" ")
    return f"-{number}:{number} {unit}".strip() if most else ""


def first_joint(description: RobotDescription) -> JointDescription:
    """The joint of the body, or of the first limb on the world."""
    return next(iter(description.parts.values())).joint


def is_held(description: RobotDescription) -> bool:
    """Whether something holds its first part, or moves it as is prescribed."""
    joint = first_joint(description)
    return joint.kind == "fixed" or getattr(joint, "motion", None) is not None


def first_measured(description: RobotDescription, forward: str) -> str:
    """What to measure at first: of a robot that may turn its heading, of one on a line how fast it goes along it.

    Of one that is held the force that it gives along `forward`; of one on a spring its place, on a hinge its angle.
    """
    joint, part = first_joint(description), next(iter(description.parts))
    if is_held(description):
        return f"force.{forward.lstrip('-') or 'x'}"
    if joint.kind in ("free", "planar", "spherical"):
        return "heading"
    if isinstance(joint, PrismaticJoint):
        return f"{part}.position" if joint.stiffness else _SPEEDS[int(np.argmax(np.abs(joint.axis)))]
    return f"{part}.angle"


def most_of(run: "xr.Dataset", reading: Reading) -> str:
    """Most of a speed or a force that a robot has by now, on the mean: what it can have; empty for other readings."""
    if reading.kind in _SPEEDS:
        now = run["velocity"].isel(part=0, axis=_SPEEDS.index(reading.kind))
    elif reading.kind == "force" and "load_force" in run:
        now = run["load_force"].isel(axis=reading.index).sum(("load", "part"))
    else:
        return ""
    value = float(f"{_MOST * float(now.mean('time')):.1g}")
    return shown(value, reading.dimension) if abs(value) > _NOTHING else ""


def beats(description: RobotDescription) -> bool:
    """Whether its drives have a common period."""
    try:
        return drive_period(description) > 0
    except InputError:
        return False


def _gains(text: str) -> np.ndarray:
    try:
        numbers = [parse_quantity(part, "number") for part in text.split(",")]
    except ValueError as error:
        raise InputError(str(error), field="gains") from None
    if len(numbers) != 3 or not any(numbers) or min(numbers) < 0 < max(numbers):
        raise InputError(f'"{text}" is not three numbers of one sign, such as 4, 0.5, 0.', field="gains")
    return np.array(numbers)


def numbers_of(rig: LiveRig, wanted: control.Reference) -> str:
    """How well the reference was followed, since it last changed where the slider said it."""
    run = rig.followed
    reference, output = run.reference, run.output
    changes = np.flatnonzero(np.diff(reference)) if wanted.kind == CONSTANT else np.zeros(0, int)
    k = slice(int(changes[-1]) + 1 if changes.size else 0, None)
    rows = [("rms error", wanted.show(control.rms_error(output[k], reference[k])))]
    answer = control.step_response(run.time[k], output[k], reference[k])
    if answer is not None:
        settled = answer.settling - float(run.time[k][0])
        rows = [
            ("overshoot", f"{100 * answer.overshoot:.3g} %"),
            ("settled within 5 %", f"after {settled:.3g} s" if np.isfinite(settled) else "never"),
            ("steady error", wanted.show(answer.steady_error)),
            *rows,
        ]
    since = ", from the last change of the reference on" if changes.size else ""
    cells = "".join(
        f"<tr><td>{name}</td><td style='text-align:right'>{escape(value)}</td></tr>" for name, value in rows
    )
    table = f"<table style='width:100%'>{cells}</table>"
    return f"<div style='font-size:13px;padding:0 12px' id='studio-control'>{table}Simulated{since}.</div>"
