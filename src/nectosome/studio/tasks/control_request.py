"""A closed loop as the page describes it: its fields at first, its preparation, and its results in words."""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from nectosome import controllers
from nectosome.description import (
    JointDescription,
    PrismaticJoint,
    RobotDescription,
    drive_period,
    get_value,
    numeric_paths,
    resolve,
)
from nectosome.solve.readings import Reading
from nectosome.studio.desk import Desk
from nectosome.studio.sliders import scales_of
from nectosome.studio.work import Progress
from nectosome.units import InputError
from nectosome.units import show_quantity as shown

from .left_panel import cells
from .live_rig import FRAME, LONGEST, LiveRig

CONSTANT = "constant"
SHAPES = ("sine", "triangle")  # that go on until the run is stopped
_TUNED = 10.0  # s of the reference, along which gains are detuned
_SPEEDS = ("velocity.x", "velocity.y", "velocity.z")
_MOST, _NOTHING = 0.8, 1e-4  # of a speed or force; m/s, N
_SHARE = 0.5  # of a drive's amplitude, that its offset may be


class PreparedLoop(NamedTuple):
    """A compiled rig, and its reference."""

    rig: LiveRig
    task: controllers.ControlTask
    samples: np.ndarray | None  # of the reference; None where the slider sets it
    gains_text: str


def prepare_loop(description: RobotDescription, options: Mapping[str, Any], progress: Progress) -> PreparedLoop | None:
    """A rig with its gains, compiled; None where it was cancelled. `options` are those of `ControlTask.parse`.

    Raises InputError.
    """
    if not progress("compiling the equations", 0.0):
        return None
    task = controllers.ControlTask.parse(description, **options, resolution=FRAME)
    gains = task.find_gains(_TUNED, progress)
    if gains is None or not progress("compiling the rig", 0.0):
        return None
    pid = task.pid(gains)
    samples, first = None, task.reference.constant
    if first is None:
        samples = task.reference.samples(LONGEST + task.robot.dt, task.robot.dt, task.start)
        first = float(samples[0])
    LiveRig(task.loop, pid, first).step(first)  # all compilation happens here
    rig = LiveRig(task.loop, pid, first)
    return PreparedLoop(rig, task, samples, task.gains_text(gains).replace(",", ", "))


def commands_of(description: RobotDescription) -> tuple[str, ...]:
    """Quantities that can be commanded: offsets of drives first, by their aliases where they have one; then aliases."""
    named = {path: alias for alias in description.number_aliases for path in resolve(description, alias)}
    offsets = [
        named.get(path, path) for path in numeric_paths(description) if path.endswith((".offset", ".force.value"))
    ]
    return tuple(dict.fromkeys([*offsets, *description.number_aliases])) or tuple(numeric_paths(description))


def first_range(desk: Desk, command: str) -> str:
    """Initial range of a command: that of its slider, or of an offset half the amplitude of its drive."""
    description = desk.description
    for scale in scales_of(description, desk.problem.vary):
        if scale.name == command:
            return f"{scale.low:g}..{scale.high:g} {scale.unit}".strip()
    path = resolve(description, command)[0]
    known = numeric_paths(description)
    beside = path.rpartition(".")[0] + ".amplitude"
    if not path.endswith(".offset") or beside not in known:
        return ""
    most = _SHARE * abs(float(get_value(description, beside)))
    number, _, unit = shown(most, known[path].dimension).partition(" ")
    return f"-{number}..{number} {unit}".strip() if most else ""


def first_joint(description: RobotDescription) -> JointDescription:
    """The joint of the body, or of the first limb on the world."""
    return next(iter(description.parts.values())).joint


def is_fixed(description: RobotDescription) -> bool:
    """Whether the first part is fixed, or its motion is prescribed."""
    joint = first_joint(description)
    return joint.kind == "fixed" or getattr(joint, "motion", None) is not None


def first_measured(description: RobotDescription, forward: str) -> str:
    """Initial reading: the heading of a robot that can turn, the speed of one on a line.

    Of a fixed body the force on its mount along `forward`; on a spring its position, on a hinge its angle.
    """
    joint, part = first_joint(description), next(iter(description.parts))
    if is_fixed(description):
        return f"force.{forward.lstrip('-') or 'x'}"
    if joint.kind in ("free", "planar", "spherical"):
        return "heading"
    if isinstance(joint, PrismaticJoint):
        return f"{part}.position" if joint.stiffness else _SPEEDS[int(np.argmax(np.abs(joint.axis)))]
    return f"{part}.angle"


def most_of(run: xr.Dataset, reading: Reading) -> str:
    """Share of the mean speed or force of a run, which the robot can reach; empty for other readings."""
    if reading.kind in _SPEEDS:
        now = run["velocity"].isel(part=0, axis=_SPEEDS.index(reading.kind))
    elif reading.kind == "force" and "load_force" in run:
        now = run["load_force"].isel(axis=reading.index).sum(("load", "part"))
    else:
        return ""
    value = float(f"{_MOST * float(now.mean('time')):.1g}")
    return shown(value, reading.dimension) if abs(value) > _NOTHING else ""


def has_beat(description: RobotDescription) -> bool:
    """Whether its drives have a common period."""
    with suppress(InputError):
        return drive_period(description) > 0
    return False


def results_html(rig: LiveRig, reference: controllers.Reference) -> str:
    """Tracking errors, of a constant reference since its last change."""
    run = rig.record
    target, output = run.reference, run.output
    changes = np.flatnonzero(np.diff(target)) if reference.kind == CONSTANT else np.zeros(0, int)
    k = slice(int(changes[-1]) + 1 if changes.size else 0, None)
    begun = float(run.time[k][0])
    found = controllers.tracking_rows(run.time[k] - begun, output[k], target[k], "", reference.show)
    rows = [(label.shown, number.shown) for label, number in found]
    since = ", since the last change of the reference" if changes.size else ""
    return cells(rows, "studio-control", [f"Simulated{since}."])
