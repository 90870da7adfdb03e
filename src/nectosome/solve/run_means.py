r"""What a simulation comes to, by the steps of the solver, whatever its samples: means, largest magnitudes, beats.

Within a step the state is a cubic. Means are integrals by two Gauss points of each step, or part of one between the
ends of beats; largest magnitudes are those at these points, at four of each step before them, and at 201 even times.
Numbers of the flow are those of the points of whole beats; without beats those of the other ones, over the whole run.
"""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from nectosome.core import State, UniformCurrent
from nectosome.core.programs.remember import remembered
from nectosome.description import robot_of_run
from nectosome.description.period import ramps_end
from nectosome.mechanism import Diagnosis, Robot
from nectosome.mechanism.diagnose import driving
from nectosome.units.zero import ROUNDING as ZERO

from .cycle_means import OF_A_CYCLE, by_stream, means_of
from .flow_numbers import flow_numbers, has_flow_numbers, of_whole_run
from .integrate import AcceptedSteps
from .mean_window import ROUNDING, beat_of_run, mean_weights, mean_window
from .motor_results import MOTOR_VARIABLES, of_motors
from .results import TENDON_VARIABLES, VARIABLES, Data, diagnose_all
from .stream import stands, water_velocity
from .transport import battery_endurance, direction

_LEAST_BEATS = 3  # of a run after its ramps
_SAMPLES = 129  # of a beat
_SETTLING = 3  # last beats whose means are compared
_GAUSS = 0.5 / np.sqrt(3.0)  # of a step, from its middle
_QUARTERS = np.arange(1, 5) / 4  # of a step before the means, where largest magnitudes are looked for
_POWERS = ("load_force", "load_power", "reaction_power", "energy", "part_energy", "battery_power")
MEANS = ("velocity", "water_velocity", "reaction", *_POWERS, "electrical_power", "motor_heat", "tension")
PEAKS = ("reaction", "drive_velocity", "reaction_power", "tension", "motor_torque", "motor_rate", "current")
_RESOLVED = 1e-4  # of the largest powers of a run: mean powers below it are judged by that
_EVEN = 201  # times of the whole run, beside those of the steps
_A_BEAT = 32  # parts of a beat, or of the means without one, each with two Gauss points: a sine's mean to 1e-6
_SHORTEST = 1e-6  # of the longest part of a step, that numbers of the flow are made of
_LOOPS = ("tracking_error", "speed_error", "voltage_demand")  # whose largest are those of the mean window
_SUMS = {"load_power": (("load",), "W"), "power_into_robot": ((), "W")}  # whose largest are those of sums over parts
_KINDS = {"water_velocity": (("axis",), "m/s")} | VARIABLES | MOTOR_VARIABLES | TENDON_VARIABLES
DIMENSIONS: dict[str, tuple[str, ...]] = {
    **{f"{name}_mean": _KINDS[name][0] for name in MEANS},
    **{f"{name}_peak": (_SUMS.get(name) or _KINDS[name])[0] for name in (*PEAKS, *_LOOPS, *_SUMS)},
    "ahead_mean": ("axis",),
    "power_closure": (),
    "battery_endurance": ("battery",),
    "beat_velocity": ("beat", "axis"),
    "beat_water_velocity": ("beat", "axis"),
    "beat_power": ("beat",),
}
"""Of what `run_means` adds to the results of a simulation, by name."""


def states_at(steps: AcceptedSteps, times: Float[np.ndarray, "n"]) -> State:
    """States at increasing times, by the cubic of the step that each is in; at its end, of two the first."""
    return _interpolated(steps, *_within(steps, times))


def _within(steps: AcceptedSteps, times: Float[np.ndarray, "n"]) -> tuple[np.ndarray, Float[np.ndarray, "n"]]:
    """Step in which each time is, and the times."""
    ends = steps.t + 1e-12 * np.maximum(1.0, np.abs(steps.t))  # what differs by rounding is one time
    return np.minimum(np.searchsorted(ends, times), steps.t.size - 1), times


def _interpolated(steps: AcceptedSteps, k: np.ndarray, times: Float[np.ndarray, "n"]) -> State:
    """States at times within steps k."""
    h = steps.t[k] - steps.t0[k]
    s = np.clip((times - steps.t0[k]) / h, 0.0, 1.0)
    a, b, c, d = (1 + 2 * s) * (1 - s) ** 2, h * s * (1 - s) ** 2, s**2 * (3 - 2 * s), h * s**2 * (s - 1)

    def leaf(x0: Any, rate0: Any, x: Any, rate: Any) -> np.ndarray:
        each = zip((a, b, c, d), (x0, rate0, x, rate), strict=True)
        return sum((w.reshape(-1, *[1] * (y.ndim - 1)) * y[k] for w, y in each), np.zeros(()))

    return jax.tree.map(leaf, steps.x0, steps.rate0, steps.x, steps.rate)


class _Nodes(NamedTuple):
    """Gauss points of the steps between cuts."""

    step: np.ndarray
    time: Float[np.ndarray, "n"]
    weight: Float[np.ndarray, "n"]  # [s]
    ends: Float[np.ndarray, "m"]  # of the times for which they stand [s]

    @classmethod
    def of(cls, steps: AcceptedSteps, cuts: Float[np.ndarray, "k"]) -> "_Nodes":
        ends = np.union1d(np.clip(np.append(steps.t0[:1], steps.t), cuts.min(), cuts.max()), cuts)
        middle, width = 0.5 * (ends[1:] + ends[:-1]), np.diff(ends)
        k = np.minimum(np.searchsorted(steps.t, middle), steps.t.size - 1)
        time = middle[:, None] + _GAUSS * width[:, None] * np.array([-1.0, 1.0])
        weight = np.repeat(0.5 * width, 2)
        return cls(np.repeat(k, 2), time.ravel(), weight, ends[0] + np.append(0.0, np.cumsum(weight)))


def _blocks(
    robot: Robot, steps: AcceptedSteps, k: np.ndarray, times: Float[np.ndarray, "n"], size: int
) -> Iterator[tuple[slice, Diagnosis]]:
    """Diagnoses at times within steps k, `size` at once: one program for all, that of the samples."""
    for first in range(0, times.size, size):
        here = np.minimum(np.arange(first, first + size), times.size - 1)
        d = remembered(diagnose_all, robot, times[here], _interpolated(steps, k[here], times[here]))
        many = min(size, times.size - first)
        yield slice(first, first + many), jax.tree.map(lambda x, n=many: np.asarray(x)[:n], d)


def _of_water(
    robot: Robot, time: Float[np.ndarray, "n"], place: Float[np.ndarray, "n 3"], size: int
) -> Float[np.ndarray, "n 3"]:
    """Velocity of the water at points, `size` at once."""
    if isinstance(robot.water.current, UniformCurrent):
        return np.broadcast_to(robot.water.current.velocity, place.shape)
    blocks = [np.minimum(np.arange(i, i + size), time.size - 1) for i in range(0, time.size, size)]
    return np.concatenate([remembered(water_velocity, robot, time[k], place[k]) for k in blocks])[: time.size]


def _values(robot: Robot, d: Diagnosis) -> dict[str, np.ndarray]:
    """What means and largest magnitudes are taken of, by names of results."""
    found = d._asdict() | (of_motors(d) if robot.powered.groups else {})
    found |= {"tension": d.tendons.tension} if robot.load_groups.tendons else {}
    return {name: np.asarray(found[name]) for name in {*MEANS, *PEAKS, *_LOOPS, "battery_voltage"} if name in found}


def run_means(robot: Robot, steps: AcceptedSteps, time: Float[np.ndarray, "n"], attributes: Mapping[str, Any]) -> Data:
    """Means over the `mean_window` (names with `_mean`) and largest magnitudes of a run (`_peak`), with n samples.

    `power_closure` is the sum of mean powers less the change of energy over the time of the means, relative to the sum
    of their mean magnitudes; `power_into_robot_peak` is of the sum of the powers of all loads and joints, in the world.
    `beat_velocity` and `beat_power` (of drives) are means over the last beats, the last one first; in a stream also
    `beat_water_velocity`. With at least three beats after ramps, the numbers of a cycle
    (`CycleMeans`) that are single ones: each the mean of those of the beats of the window, at 129 times of a beat, with
    the powers as they are integrated. Nothing of a run that gave up at its first sample.
    """
    if time.size < 2:
        return {}
    end, window = float(time[-1]), mean_window(time, attributes)
    beat = beat_of_run(attributes)
    whole = 0 if beat is None else min(int((end - float(time[0])) / beat + ROUNDING), _SETTLING)
    cuts = np.unique([end, window.start, *(max(end - (beat or 0.0) * k, float(time[0])) for k in range(whole + 1))])
    # what is driven has a motion of its own within a step
    cuts = np.union1d(cuts, np.arange(end, cuts[0], -(beat or end - window.start) / _A_BEAT))
    nodes, size = _Nodes.of(steps, cuts), time.size
    repeats = bool(window.beats)
    early = np.flatnonzero((steps.t0 < cuts[0]) | ((steps.t0 < end) & (not repeats)))
    t0, t = np.asarray(steps.t0)[early, None], np.asarray(steps.t)[early, None]
    outside = np.union1d(np.minimum(t0 + (t - t0) * _QUARTERS, end), np.linspace(float(time[0]), end, _EVEN))
    parts, turned, peaks = list[dict[str, np.ndarray]](), list[np.ndarray](), list[dict[str, np.ndarray]]()
    places, flows, pieces = list[np.ndarray](), list[Any](), list[np.ndarray]()
    shares = mean_weights(outside, float(time[0]), end)
    for here, block in _blocks(robot, steps, *_within(steps, outside), size):
        peaks.append(_largest(robot, block))
        if has_flow_numbers(robot) and not repeats:
            pieces.append(np.asarray(flow_numbers(robot, outside[here], block.flows, shares[here], None)))
    for _, block in _blocks(robot, steps, nodes.step, nodes.time, size):
        parts.append(_values(robot, block))
        places.append(np.asarray(block.position)[:, 0])
        turned.append(np.asarray(block.rotation)[:, 0])
        peaks.append(_largest(robot, block))
        flows.append(block.flows)
    values = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    rotation = np.concatenate(turned)
    if robot.water.current is not None and not stands(robot):
        values["water_velocity"] = _of_water(robot, nodes.time, np.concatenate(places), size)

    def mean(x: np.ndarray, start: float, end: float) -> np.ndarray:
        weight = nodes.weight * ((nodes.time > start) & (nodes.time < end))
        return np.tensordot(weight / weight.sum(), x, axes=1)

    kept = [name for name in MEANS if name in values]
    data: Data = {f"{x}_mean": (_KINDS[x][0], mean(values[x], window.start, end), _KINDS[x][1]) for x in kept}
    for name in peaks[0]:
        dims, unit = _SUMS.get(name) or _KINDS[name]
        data[f"{name}_peak"] = dims, np.max([peak[name] for peak in peaks], axis=0), unit
    weights = nodes.weight * (nodes.time > window.start)
    for name in _LOOPS if robot.powered.groups else ():
        data[f"{name}_peak"] = ("motor",), np.abs(values[name][weights > 0]).max(axis=0), _KINDS[name][1]
    ahead, points = direction(robot.ahead, rotation, weights / weights.sum())
    data["ahead_mean"] = ("axis",), ahead if points else np.full(3, np.nan), "1"
    if has_flow_numbers(robot):
        here = weights > _SHORTEST * weights.max()  # not between cuts that differ by rounding
        every = jax.tree.map(lambda *x: np.concatenate(x)[here], *flows) if repeats else ()
        shares, period = weights[here] / weights[here].sum(), end - window.start
        found = (
            flow_numbers(robot, nodes.time[here], every, shares, period) if repeats else of_whole_run(np.stack(pieces))
        )
        data["flow_number"] = ("number", "load", "part"), np.asarray(found), "1"
    largest = float(np.sum(data["load_power_peak"][1]) + np.sum(data["reaction_power_peak"][1]))
    closes = _closure(robot, steps, window.start, end, values, mean, size, largest)
    data["power_closure"] = (), np.asarray(closes), "1"
    if robot.powered.battery_names:
        energy, open_voltage = map(np.asarray, robot.powered.stored)
        drawn = values["battery_voltage"], values["battery_power"]
        lasting = battery_endurance(energy, open_voltage, *drawn, weights / weights.sum())
        data["battery_endurance"] = ("battery",), lasting, "s"
    if beat is not None and whole:
        drives = values["reaction_power"].sum(axis=1) + values["load_power"][:, driving(robot)].sum(axis=1)
        drives = drives - np.asarray(by_stream(robot, nodes.time, rotation))
        spans = [(end - beat * (k + 1), end - beat * k) for k in range(whole)]
        of_body = {"velocity": values["velocity"][:, 0]} | {x: values[x] for x in ("water_velocity",) if x in values}
        for name, each in of_body.items():
            data[f"beat_{name}"] = ("beat", "axis"), np.array([mean(each, *x) for x in spans]), "m/s"
        data["beat_power"] = ("beat",), np.array([mean(drives, *x) for x in spans]), "W"
        begins = ramps_end(robot_of_run(str(attributes["robot"])))
        if window.beats and end - max(begins, float(time[0])) >= (_LEAST_BEATS - ROUNDING) * beat:
            data |= _of_beats(robot, steps, window.start, beat, window.beats, values, nodes, size)
    absent = set() if robot.powered.groups else {"motor", "battery"}  # dimensions without names, which no reader takes
    return {name: row for name, row in data.items() if not absent & {*row[0]}}


def _largest(robot: Robot, d: Diagnosis) -> dict[str, np.ndarray]:
    """Largest magnitudes over the first axis; of powers those of each load on all parts, and of all together."""
    values = _values(robot, d)
    of_loads = values["load_power"].sum(axis=2)
    each = {name: values[name] for name in PEAKS if name in values}
    each |= {"load_power": of_loads, "power_into_robot": of_loads.sum(axis=1) + values["reaction_power"].sum(axis=1)}
    return {name: np.abs(x).max(axis=0) for name, x in each.items()}


def _closure(
    robot: Robot,
    steps: AcceptedSteps,
    start: float,
    end: float,
    values: Mapping[str, np.ndarray],
    mean: Any,
    size: int,
    largest: float,
) -> float:
    """Sum of mean powers less the mean rate of energy, over the sum of mean magnitudes of powers; 0 without powers.

    Of a robot that has come to rest the magnitudes are rounding: then over 1e-4 of the largest ones of the run, in a
    stream at least over what is rounding beside the largest force times its speed.
    """
    (_, d), *_ = _blocks(robot, steps, *_within(steps, np.array([start, end])), max(size, 2))
    gained = float(np.diff(d.energy.sum(axis=1))[0]) / (end - start)
    each = np.concatenate([values["load_power"].sum(axis=2), values["reaction_power"]], axis=1)
    stream = np.abs(values.get("water_velocity", np.zeros(1))).max()
    rounding = ZERO * float(np.abs(values["load_force"]).max(initial=0.0) * stream)
    most = max(float(np.sum(mean(np.abs(each), start, end))), _RESOLVED * largest, rounding)
    return abs(float(np.sum(mean(each, start, end))) - gained) / most if most > 0 else 0.0


def _of_beats(
    robot: Robot,
    steps: AcceptedSteps,
    start: float,
    beat: float,
    beats: int,
    values: Mapping[str, np.ndarray],
    nodes: _Nodes,
    size: int,
) -> Data:
    """Single numbers of a cycle, of so many beats from a start on."""
    grid = np.linspace(0.0, beat, _SAMPLES)
    times = (start + beat * np.arange(beats)[:, None] + grid).ravel()
    parts = [d for _, d in _blocks(robot, steps, *_within(steps, times), size)]
    d = jax.tree.map(lambda *x: np.concatenate(x), *parts)
    # a power at one of the times is its mean up to the next one, so that all of them have the integrals of the steps
    cells = times.reshape(beats, _SAMPLES)

    def integrated(x: np.ndarray, k: int) -> np.ndarray:
        flat = nodes.weight[:, None] * x.reshape(len(x), -1)
        whole = np.concatenate([np.zeros((1, flat.shape[1])), np.cumsum(flat, axis=0)])
        at = np.clip(np.searchsorted(nodes.ends, cells[k]) - 1, 0, nodes.weight.size - 1)
        share = np.clip((cells[k] - nodes.ends[at]) / nodes.weight[at], 0.0, 1.0)[:, None]
        means = np.diff((1 - share) * whole[at] + share * whole[at + 1], axis=0) / np.diff(grid)[:, None]
        return np.concatenate([means, means[:1]]).reshape(_SAMPLES, *x.shape[1:])

    found = list[Any]()
    for k in range(beats):
        one = jax.tree.map(lambda x, k=k: x[k * _SAMPLES : (k + 1) * _SAMPLES], d)
        one = one._replace(**{name: integrated(values[name], k) for name in _POWERS if name in values})
        if robot.powered.groups:
            electrical = {name: integrated(values[key], k) for name, key in _ELECTRICAL.items()}
            one = one._replace(powered=one.powered._replace(**electrical))
        found.append(remembered(means_of, robot, grid, one))
    single = {name: unit for name, (dims, unit) in OF_A_CYCLE.items() if not dims}
    return {name: ((), np.asarray(np.mean([getattr(x, name) for x in found])), unit) for name, unit in single.items()}


_ELECTRICAL = {"electrical": "electrical_power", "heat": "motor_heat"}
