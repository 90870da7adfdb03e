"""Missions: a robot that goes from mode to mode at events, while some of its numbers follow ramps."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core import State, Status, reach_up
from nectosome.core.programs.remember import remembered, runs_long
from nectosome.core.rows import all_on_device, on_device
from nectosome.description import dump_robot, numeric_paths
from nectosome.description.mission import Event, Mission, Mode
from nectosome.io import provenance
from nectosome.loads import Leg, WallContact
from nectosome.mechanism import check_inertia, moves_in_plane
from nectosome.model import build, template_of
from nectosome.units import check_choice, check_share, read_positive

from .integrate import AcceptedSteps, Integration, Method, Settings, begin, interpolate, steps_until
from .ramped_robot import RampedRobot, Ramps
from .readings import place_of
from .simulate import METHODS, TIGHTER
from .soft_contacts import contact_depths, deep_contacts

if TYPE_CHECKING:
    import xarray as xr

_STRETCH = 64  # attempts at steps between searches for events
_MOST = 2_000_000  # of them in a mode
_SAMPLE = 0.02  # s between the samples of results
_FIRST_STEP = 1e-3  # s, at most
_LATE, _STILL = 0.1, 1e-4  # share of a mode in which a body below that speed [m/s] stands still
_ACCURACY = 1e-9  # s, to which an event is located within its step
_GAUSS = 0.5 / np.sqrt(3.0)  # of a step, from its middle
_SHARES, _WEIGHTS = np.array([0.5 - _GAUSS, 0.5 + _GAUSS, 1.0]), np.array([0.5, 0.5, 0.0])  # of a step: its samples


class Measures(NamedTuple):
    """Where a robot's body is, how it moves, what it touches, and what its batteries give."""

    position: Float[Array, "*n 3"]  # of the body's first station, world frame [m]
    velocity: Float[Array, "*n 3"]  # of the same [m/s]
    pitch: Float[Array, "*n"]  # of the body's x axis over the horizon [rad]
    heading: Float[Array, "*n"]  # of the same axis seen from above, from the world's x towards y, -pi to pi [rad]
    tilt: Float[Array, "*n"]  # of the body's z axis from straight above [rad]
    feet: Float[Array, "*n"]  # how deep the foot that is deepest is in the floor [m]; -inf where there is none
    surface: Float[Array, "*n"]  # how high the highest station's edge is over the surface [m]; -inf without one
    low_wall: Float[Array, "*n"]  # how deep a hull is in the wall at the smaller x [m]; -inf where there is none
    high_wall: Float[Array, "*n"]  # and in that at the larger x
    battery_power: Float[Array, "*n b"]  # with the electronics [W]
    depths: Float[Array, "*n contacts"]  # of parts in their contacts (`contact_depths`)


def measures(system: RampedRobot, t: Float[Array, ""], x: State) -> Measures:
    """Quantities of the events of a mission."""
    robot = system.robot(t)
    tree, water, none = robot.tree, robot.water, -jnp.inf * jnp.ones(())
    q, v, _ = tree.complete(t, x.q, x.v)
    shape = tree.shape(q)
    R, p = shape.rotation, shape.position
    place = place_of(R[0], p[0], tree.twists(shape, v)[0])
    strips, top = robot.in_world(shape, jnp.zeros((p.shape[0], 6))), none
    feet, walls = [none], [jnp.stack([none, none])]
    loads = robot.loads
    for i, z in sorted(robot.states_by_load(q, v, x.z).items()):
        attached = loads[i]
        here, load = jax.tree.map(lambda x, at=tree.layout[attached.part].stations: x[at], strips), attached.load
        if isinstance(load, Leg) and (height := load.gaps(here, z, water)) is not None:
            feet.append(-height.gap[0] * load.contact.softness)
        if isinstance(load, WallContact) and water.walls is not None:
            walls.append(load.depths(here.position[0, 0], water))
    if water.surface is not None:
        top = jnp.max(p[:, 2] + reach_up(strips)) - water.surface
    low, high = jnp.max(jnp.stack(walls), axis=0)
    velocity = jnp.stack([place[f"velocity.{axis}"] for axis in "xyz"])
    pitch, heading, tilt = (place[name] for name in ("pitch", "heading", "tilt"))
    # what jumps at an update counts half before and half after, as in all results
    sides = [x] if system.update_rates is None else [x, robot.updated(t, x)]
    powers = [robot.powered.battery_powers(robot.motors(t, q, v, side.z)[0].electrical) for side in sides]
    power = sum(powers[1:], powers[0]) / len(powers)
    depths = contact_depths(robot, t, x)
    return Measures(p[0], velocity, pitch, heading, tilt, jnp.max(jnp.stack(feet)), top, low, high, power, depths)


def measured(system: RampedRobot, t: Float[Array, "n"], x: State) -> Measures:
    """The same at n times."""
    return jax.vmap(lambda t, x: measures(system, t, x))(t, x)


class Passed(NamedTuple):
    """A mode that was ended by an event."""

    mode: str
    event: str
    time: float  # [s]


class Flown(NamedTuple):
    """A mission as it went: what was measured in and after each step, and at each event."""

    mission: Mission
    time: Float[np.ndarray, "n"]  # [s]; an event stands there once for each mode that it parts
    weight: Float[np.ndarray, "n"]  # [s], of each sample in an integral over time
    measures: Measures  # leaves [n]
    quantities: Float[np.ndarray, "n k"]  # those that modes set, SI
    mode: Int[np.ndarray, "n"]  # number of the mode
    passed: tuple[Passed, ...]
    reason: str  # why it ended before its end; empty where it did not

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the quantities that modes set."""
        return _paths(self.mission)

    def event_time(self, mode: str) -> float | None:
        """When a mode ended [s]; None where it did not."""
        return next((p.time for p in self.passed if p.mode == mode), None)


class MissionSamples(NamedTuple):
    """What is measured at two Gauss points of each step, and at its end."""

    time: Float[Array | np.ndarray, "n"]  # [s]
    weight: Float[Array | np.ndarray, "n"]  # of an integral over time [s]
    seen: Measures  # leaves [n]


@runs_long
def _stretch(
    system: RampedRobot, m: Integration, settings: Settings
) -> tuple[Integration, AcceptedSteps, MissionSamples, Int[Array, ""]]:
    """Steps to the stop, if some attempts take it there; the steps, their samples, and how many steps they are."""
    assert settings.stop is not None
    m, steps, count = steps_until(system, m, settings.stop, jnp.asarray(_STRETCH), settings)
    steps = jax.tree.map(lambda x: x[:_STRETCH], steps)
    time = steps.t0[:, None] + (steps.t - steps.t0)[:, None] * _SHARES
    states = jax.vmap(lambda step, times: jax.vmap(lambda at: interpolate(step, at))(times))(steps, time)
    time, states = jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), (time, states))
    weight = ((steps.t - steps.t0)[:, None] * _WEIGHTS).ravel()
    return m, steps, MissionSamples(time, weight, measured(system, time, states)), count


def _begin(system: RampedRobot) -> tuple[State, MissionSamples]:
    x, t = system.initial(), jnp.zeros(1)
    return x, MissionSamples(t, t, measured(system, t, jax.tree.map(lambda a: a[None], x)))


def run_mission(
    mission: Mission,
    *,
    step: float | str = 0.01,
    method: Literal["auto", "implicit", "explicit"] = "auto",
    rtol: float = 1e-6,
    atol: float = 1e-8,
    progress: Callable[[str, float], bool | None] | None = None,
) -> Flown:
    """Take a robot through its modes until the last has ended, with the steps of `simulate`, `step` [s] at most.

    An event is looked for at two points within each step and at its end, and located by shorter steps from the same
    start; the next mode goes on from there. Steps end where ramps begin and end. An event that has happened when its
    mode begins ends it at once. An unfinished ramp continues in the next modes, unless they set its quantity again.
    `progress(mode, share of the modes)` is called now and then; the mission ends where it returns False.

    - method, rtol, atol: as in `simulate`; "auto" takes implicit steps where a robot has rods.
    """
    system, soft = _system(mission)
    step = read_positive(step, "time", "step")
    settings = _settings(soft, step, method, rtol, atol)
    x, now = remembered(_begin, system)
    h, passed, reason = min(_FIRST_STEP, step), [], ""
    pieces: list[_Piece] = []
    for k, mode in enumerate(mission.modes):
        began = float(now.time[0])
        system = eqx.tree_at(lambda s: s.ramps, system, _changed(mission, system.ramps, mode, began))
        pieces.append(_piece(k, system, now))
        event = next((event for event in _ends(mode) if _over(event, now, began)[0] >= 0), None)
        m = begin(on_device(began), x, settings, on_device(h))
        while event is None and not reason:
            if progress is not None and progress(mode.name, k / len(mission.modes)) is False:
                reason = f"cancelled in {mode.name}"
                break
            before, until = m, replace(settings, stop=on_device(_stop(mode, system.ramps, float(m.t), began)))
            m, steps, samples, count = remembered(_stretch, system, m, until)
            samples = _some(samples, 3 * int(count))
            hit = _first(mode, samples, began)
            if hit is not None:
                n = hit // 3
                start = (before.t, before.x)
                if n > 0:
                    start = jax.tree.map(lambda a, n=n: on_device(np.asarray(a)[n - 1]), (steps.t, steps.x))
                x, rest, event = _locate(system, mode, settings, start, _joined([now, _some(samples, hit + 1)]), began)
                samples, h = _joined([_some(samples, 3 * n), rest]), float(steps.t[n] - steps.t0[n])
            elif m.status != Status.SOLVED:
                why = Status(int(m.status)).reason
                reason = f"the motion broke off in {mode.name} at {float(m.t):.4g} s: {why}"
            pieces.append(_piece(k, system, samples))
            now = jax.tree.map(lambda a: a[-1:], _joined([now, samples]))
        if event is not None and event.kind == "longest":
            awaited = " or ".join(e.text for e in mode.until)
            stands = ", and stands still" if _stands(_joined([piece[0] for piece in pieces]), began) else ""
            reason = f"{mode.name} took longer than {mode.longest:g} s without coming to {awaited}{stands}"
        if reason:
            break
        assert event is not None
        passed.append(Passed(mode.name, event.text, float(now.time[0])))
    samples, values, number = _joined(pieces)
    return Flown(mission, samples.time, samples.weight, samples.seen, values, number, tuple(passed), reason)


def _some(samples: MissionSamples, n: int) -> MissionSamples:
    """The first n of some samples."""
    return jax.tree.map(lambda x: np.asarray(x)[:n], samples)


def _joined(parts: list[Any]) -> Any:
    """Parts with leaves [n, ...], one after another."""
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)


def _settings(soft: bool, step: float, method: str, rtol: float, atol: float) -> Settings:
    """Settings of the steps, of a robot with rods or without."""
    check_choice(method, METHODS, "method")
    check_share(rtol, "rtol")
    check_share(atol, "atol")
    if method == "auto":
        method = "implicit" if soft else "explicit"
        rtol, atol = (rtol, atol) if soft else (TIGHTER * rtol, TIGHTER * atol)
    kind: Method = "explicit" if method == "explicit" else "implicit"
    return Settings(kind, *all_on_device(rtol, atol, _MOST), longest=on_device(step))


def _stop(mode: Mode, ramps: Ramps, t: float, began: float) -> float:
    """Time [s] after t at which a step has to end: of an event that is a time, or the end of a ramp."""
    ends = np.asarray(ramps.since + ramps.seconds)
    times = [began + event.limit for event in _ends(mode) if event.kind in _TIMES]
    return min(*times, np.min(ends[ends > t], initial=np.inf))


_Piece = tuple[MissionSamples, np.ndarray, np.ndarray]


def _piece(mode: int, system: RampedRobot, samples: MissionSamples) -> _Piece:
    """Samples of a mode, each with its ramped quantities and the number of the mode."""
    ramps, samples = jax.tree.map(np.asarray, (system.ramps, samples))
    return samples, ramps.at(samples.time[:, None], np), np.full(samples.time.size, mode)


def _paths(mission: Mission) -> tuple[str, ...]:
    """Paths that modes set."""
    return tuple(dict.fromkeys(path for mode in mission.modes for path in mode.changes))


def _system(mission: Mission) -> tuple[RampedRobot, bool]:
    """The robot with the values of its description, which the modes will change, and whether it has rods."""
    paths = _paths(mission)
    template, numbers = template_of(mission.robot, paths)
    varying = tuple(template.paths.index(path) for path in paths)
    values, none = numbers[jnp.array(varying, dtype=int)], jnp.zeros(len(paths))
    robot = build(mission.robot)
    check_inertia(robot)
    ramps = Ramps(values, values, none, none)
    return RampedRobot(template, numbers, varying, ramps, moves_in_plane(robot)), bool(robot.tree.rods)


def _changed(mission: Mission, ramps: Ramps, mode: Mode, t: float) -> Ramps:
    """Ramps with those that a mode begins at time t."""
    (start, end, since, seconds), now = map(np.array, ramps), ramps.at(t, np)
    for i, path in enumerate(_paths(mission)):
        if change := mode.changes.get(path):
            start[i], end[i], since[i], seconds[i] = now[i], change.value, t, change.seconds
    return Ramps(*map(jnp.asarray, (start, end, since, seconds)))


_LONGEST = "longest"
_TIMES = ("time", _LONGEST)


def _ends(mode: Mode) -> tuple[Event, ...]:
    """What ends a mode, its longest time last."""
    return (*mode.until, Event(_LONGEST, _LONGEST, mode.longest))


def _over(event: Event, samples: MissionSamples, began: float) -> Float[np.ndarray, "n"]:
    """How far each sample is beyond an event, which has happened from 0 on, of a mode that began at a time [s]."""
    seen = samples.seen
    if event.kind in _TIMES:
        return np.where(samples.time < began + event.limit, -1.0, 0.0)
    if event.kind in ("touchdown", "liftoff"):
        return np.asarray(seen.feet) * (1 if event.kind == "touchdown" else -1)
    if event.kind in ("surface", "low_wall", "high_wall"):
        return np.asarray(getattr(seen, event.kind))
    name, _, axis = event.kind.partition(".")
    value = np.asarray(getattr(seen, name))
    return ((value[..., "xyz".index(axis)] if axis else value) - event.limit) * (-1 if event.below else 1)


def _first(mode: Mode, samples: MissionSamples, began: float) -> int | None:
    """Index of the first sample at which an event has happened."""
    happened = np.any([_over(event, samples, began) >= 0 for event in _ends(mode)], axis=0)
    return int(np.argmax(happened)) if happened.any() else None


def _stands(samples: MissionSamples, began: float) -> bool:
    """Whether the body stands still in the last tenth of a mode that began at a time [s]."""
    late = samples.time >= samples.time[-1] - _LATE * (samples.time[-1] - began)
    return bool(np.linalg.norm(samples.seen.velocity[late], axis=1).max() < _STILL)


def _locate(
    system: RampedRobot,
    mode: Mode,
    settings: Settings,
    start: tuple[Array, State],
    samples: MissionSamples,
    began: float,
) -> tuple[State, MissionSamples, Event]:
    """State at the first event, the samples from the start of a step to there, and the event.

    It has happened at the last one of the `samples` by the step's cubic, and not at that before.
    """
    from scipy.optimize import brentq  # takes half a second

    def ahead(time: float) -> tuple[State, MissionSamples]:
        until = replace(settings, stop=on_device(time))
        m, pieces = begin(*start, settings, on_device(time - float(start[0]))), list[MissionSamples]()
        while m.t < time and m.status == Status.SOLVED:
            m, _, samples, count = remembered(_stretch, system, m, until)
            pieces.append(_some(samples, 3 * int(count)))
        return m.x, _joined(pieces)

    def when(event: Event) -> float:
        low, high = map(float, samples.time[-2:])
        known = {low: float(_over(event, samples, began)[-2])}

        def over(time: float) -> float:
            if time not in known:
                known[time] = float(_over(event, ahead(time)[1], began)[-1])
            return known[time]

        if event.kind in _TIMES or over(high) <= 0:
            return high
        return float(brentq(over, low, high, xtol=_ACCURACY))  # pyright: ignore[reportArgumentType]

    happened = [event for event in _ends(mode) if _over(event, samples, began)[-1] >= 0]
    time, event = min(((when(event), event) for event in happened), key=lambda pair: pair[0])
    return *ahead(time), event


def mission_data(flown: Flown, settings: dict[str, Any] | None = None) -> "xr.Dataset":
    """A mission as labelled data, every 20 ms and at its events; `settings` go into its provenance.

    `position` [m], `velocity` [m/s] of the body in the world (time, axis); `pitch`, `heading` [rad], `mode` (time);
    `quantity_value` (time, quantity) of what modes set, with `quantity_unit`; `event_time` [s], `event`, `event_mode`
    (event). With batteries, `battery_power` [W] (time, battery) and `battery_energy` [J] (battery), the integral of it
    over all steps. Attributes: robot, mission, status, status_reason, provenance, and `soft_contacts` where some do not
    hold.
    """
    import xarray as xr

    seen, robot = flown.measures, flown.mission.robot
    even = np.searchsorted(flown.time, np.arange(0.0, flown.time[-1] + _SAMPLE, _SAMPLE))
    parted = np.flatnonzero(np.diff(flown.mode))
    rows = np.unique(np.concatenate([even, parted, parted + 1]).clip(0, flown.time.size - 1))
    vectors, angles = {"position": "m", "velocity": "m/s"}, {"pitch": "rad", "heading": "rad"}
    known = numeric_paths(robot)
    names = np.array([mode.name for mode in flown.mission.modes], dtype=str)
    batteries = {}
    if robot.batteries:
        energy = flown.weight @ seen.battery_power
        batteries = {
            "battery_power": (("time", "battery"), np.asarray(seen.battery_power)[rows], {"units": "W"}),
            "battery_energy": ("battery", energy, {"units": "J"}),
        }
    soft = deep_contacts(build(robot), flown.time, np.asarray(seen.depths))
    modes, events, times = zip(*flown.passed, strict=True) if flown.passed else ([], [], [])
    return xr.Dataset(
        {name: (("time", "axis"), getattr(seen, name)[rows], {"units": unit}) for name, unit in vectors.items()}
        | {name: ("time", getattr(seen, name)[rows], {"units": unit}) for name, unit in angles.items()}
        | {
            "mode": ("time", names[flown.mode[rows]]),
            "quantity_value": (("time", "quantity"), flown.quantities[rows]),
            "event_time": ("event", np.array(times, dtype=float), {"units": "s"}),
        }
        | batteries,
        coords={
            "time": ("time", flown.time[rows], {"units": "s"}),
            "axis": ["x", "y", "z"],
            "quantity": np.array(flown.paths, dtype=str),
            "quantity_unit": ("quantity", np.array([known[path].unit for path in flown.paths], dtype=str)),
            "event": ("event", np.array(events, dtype=str)),
            "event_mode": ("event", np.array(modes, dtype=str)),
        }
        | ({"battery": np.array([*robot.batteries], dtype=str)} if batteries else {}),
        attrs={
            "title": f"{robot.name}: mission",
            "robot": dump_robot(robot),
            "mission": flown.mission.text,
            "status": "SOLVED" if not flown.reason else "STOPPED",
            "status_reason": flown.reason or "every mode came to its end",
            "provenance": json.dumps(provenance(settings or {})),
            **({"soft_contacts": " ".join(soft)} if soft else {}),
        },
    )
