"""Missions: a robot that goes from mode to mode at events, while some of its numbers follow ramps."""

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core import State, System, reach_up
from nectosome.core.programs.remember import remembered, runs_long
from nectosome.description import dump_robot, numeric_paths
from nectosome.description.mission import Event, Mission, Mode
from nectosome.io import provenance
from nectosome.loads import Leg, WallContact
from nectosome.mechanism import Robot, check_inertia, from_rest, in_plane, moves_in_plane
from nectosome.model import Template, build, instantiate, template_of

from .integrate import fixed_step
from .readings import place_of

if TYPE_CHECKING:
    import xarray as xr

_STRETCH = 100  # steps between searches for events
_SAMPLE = 0.02  # s between the samples of results
_ACCURACY = 1e-9  # s, to which an event is located within its step


class Ramps(NamedTuple):
    """Numbers that go over evenly, each from a start to an end in its time, and then stay."""

    start: Float[Array, "k"]
    end: Float[Array, "k"]
    since: Float[Array, "k"]  # when they began [s]
    seconds: Float[Array, "k"]  # how long they take [s]

    def at(self, t: Any, xp: Any = jnp) -> Float[Array, "k"] | Float[np.ndarray, "*n k"]:
        """Their values at time t, or at times [n, 1] with NumPy for `xp`."""
        lasting = self.seconds > 0
        share = xp.where(lasting, xp.clip((t - self.since) / xp.where(lasting, self.seconds, 1.0), 0.0, 1.0), 1.0)
        return self.start + share * (self.end - self.start)


class RampedRobot(System):
    """A robot whose numbers at some paths follow ramps; forces are those of the present numbers.

    The rates of the numbers are ignored: a mass or an inertia that changes takes its momentum along.
    """

    template: Template
    numbers: Float[Array, "n"]
    varying: tuple[int, ...] = eqx.field(static=True)  # which of them follow the ramps
    ramps: Ramps
    flat: bool = eqx.field(static=True)  # it moves in a plane

    def robot(self, t: Float[Array, ""]) -> Robot:
        """The robot as it is at time t."""
        now = dict(zip(self.varying, self.ramps.at(t), strict=True))
        return instantiate(self.template, [now.get(i, x) for i, x in enumerate(self.numbers)])

    @property
    def update_rates(self) -> Float[Array, "k"] | None:
        """Those of the robot, which no mode sets."""
        return self.robot(jnp.zeros(())).update_rates

    def updated(self, t: Float[Array, ""], x: State) -> State:
        """Update the loops of the robot as it is at time t."""
        return self.robot(t).updated(t, x)

    def initial(self) -> State:
        """State to start from, with the numbers as they are then, from rest."""
        robot, t = self.robot(jnp.zeros(())), jnp.zeros(())
        return from_rest(robot, t, robot.initial()).state

    def rates(self, t: Float[Array, ""], x: State, u: None = None) -> State:
        """Time derivative of the state."""
        robot = self.robot(t)
        return (in_plane(robot) if self.flat else robot).rates(t, x)


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
    return Measures(p[0], velocity, pitch, heading, tilt, jnp.max(jnp.stack(feet)), top, low, high, power)


def measured(system: RampedRobot, t: Float[Array, "n"], x: State) -> Measures:
    """The same at n times."""
    return jax.vmap(lambda t, x: measures(system, t, x))(t, x)


class Passed(NamedTuple):
    """A mode that was ended by an event."""

    mode: str
    event: str
    time: float  # [s]


class Flown(NamedTuple):
    """A mission as it went: what was measured after each step, and at each event."""

    mission: Mission
    time: Float[np.ndarray, "n"]  # [s]; an event stands there once for each mode that it parts
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


@runs_long
def _stretch(system: RampedRobot, t: Array, x: State, step: Array) -> tuple[State, Measures]:
    """States and measures after each of some steps."""
    _, states = fixed_step(system, t, x, step, _STRETCH, keep=lambda x: x)
    return states, measured(system, t + step * (1 + jnp.arange(_STRETCH)), states)


def _begin(system: RampedRobot) -> tuple[State, Measures]:
    x = system.initial()
    return x, measured(system, jnp.zeros(1), jax.tree.map(lambda a: a[None], x))


def run_mission(
    mission: Mission, *, step: float = 1e-3, progress: Callable[[str, float], bool | None] | None = None
) -> Flown:
    """Take a robot through its modes, with steps of one length [s], until the last has ended.

    An event is located within its step by shorter steps from the same start, so that it does not depend on the steps
    more than the motion does; the next mode goes on from there. An event that has happened when its mode begins ends it
    at once. An unfinished ramp continues in the next modes, unless they set its quantity again.
    `progress(mode, share of the modes)` is called now and then; the mission ends where it returns False.
    """
    system = _system(mission)
    x, now = remembered(_begin, system)
    t, passed, reason = 0.0, [], ""
    pieces: list[tuple[np.ndarray, Measures, np.ndarray, np.ndarray]] = []
    for k, mode in enumerate(mission.modes):
        system = eqx.tree_at(lambda s: s.ramps, system, _changed(mission, system.ramps, mode, t))
        pieces.append(_piece(k, system, np.array([t]), now))
        began, event = t, _immediate(mode, now)
        while event is None and not reason:
            if progress is not None and progress(mode.name, k / len(mission.modes)) is False:
                reason = f"cancelled in {mode.name}"
                break
            states, seen = remembered(_stretch, system, jnp.asarray(t), x, jnp.asarray(step))
            times = t + step * (1 + np.arange(_STRETCH))
            hit = _first(mode, seen, times - began)
            broken = np.flatnonzero(~np.isfinite(np.asarray(seen.position[:, 2])))
            if broken.size and (hit is None or broken[0] <= hit):
                reason = f"the motion broke off in {mode.name} at {times[broken[0]]:.4g} s: try shorter steps"
                hit = int(broken[0])
            count = _STRETCH if hit is None else hit
            pieces.append(_piece(k, system, times[:count], jax.tree.map(lambda a, n=count: a[:n], seen)))
            if count:
                t, x = float(times[count - 1]), jax.tree.map(lambda a, n=count: a[n - 1], states)
            if hit is not None and not reason:
                t, x, now, event = _locate(system, mode, t, x, step, began)
                pieces.append(_piece(k, system, np.array([t]), now))
        if event is not None and event.kind == "longest":
            awaited = " or ".join(e.text for e in mode.until)
            reason = f"{mode.name} took longer than {mode.longest:g} s without coming to {awaited}"
        if reason:
            break
        assert event is not None
        passed.append(Passed(mode.name, event.text, t))
    time, joined, values, number = jax.tree.map(lambda *x: np.concatenate(x), *pieces)
    return Flown(mission, time, joined, values, number, tuple(passed), reason)


def _piece(
    mode: int, system: RampedRobot, times: Float[np.ndarray, "n"], seen: Measures
) -> tuple[np.ndarray, Measures, np.ndarray, np.ndarray]:
    """Times, measures, ramped quantities and the number of the mode."""
    ramps, seen = jax.tree.map(np.asarray, (system.ramps, seen))
    return times, seen, ramps.at(times[:, None], np), np.full(times.size, mode)


def _paths(mission: Mission) -> tuple[str, ...]:
    """Paths that modes set."""
    return tuple(dict.fromkeys(path for mode in mission.modes for path in mode.changes))


def _system(mission: Mission) -> RampedRobot:
    """The robot with the values of its description, which the modes will change."""
    paths = _paths(mission)
    template, numbers = template_of(mission.robot, paths)
    varying = tuple(template.paths.index(path) for path in paths)
    values, none = numbers[jnp.array(varying, dtype=int)], jnp.zeros(len(paths))
    robot = build(mission.robot)
    check_inertia(robot)
    ramps = Ramps(values, values, none, none)
    return RampedRobot(template, numbers, varying, ramps, moves_in_plane(robot))


def _changed(mission: Mission, ramps: Ramps, mode: Mode, t: float) -> Ramps:
    """Ramps with those that a mode begins at time t."""
    (start, end, since, seconds), now = map(np.array, ramps), ramps.at(t, np)
    for i, path in enumerate(_paths(mission)):
        if change := mode.changes.get(path):
            start[i], end[i], since[i], seconds[i] = now[i], change.value, t, change.seconds
    return Ramps(*map(jnp.asarray, (start, end, since, seconds)))


_LONGEST = "longest"


def _ends(mode: Mode) -> tuple[Event, ...]:
    """What ends a mode, its longest time last."""
    return (*mode.until, Event(_LONGEST, _LONGEST, mode.longest))


def _over(event: Event, seen: Measures, since: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """How far each sample is beyond an event, which has happened from 0 on; `since` is the time in the mode [s]."""
    if event.kind in ("time", _LONGEST):
        return since - event.limit
    if event.kind in ("touchdown", "liftoff"):
        return np.asarray(seen.feet) * (1 if event.kind == "touchdown" else -1)
    if event.kind in ("surface", "low_wall", "high_wall"):
        return np.asarray(getattr(seen, event.kind))
    name, _, axis = event.kind.partition(".")
    value = np.asarray(getattr(seen, name))
    return ((value[..., "xyz".index(axis)] if axis else value) - event.limit) * (-1 if event.below else 1)


def _immediate(mode: Mode, now: Measures) -> Event | None:
    """Event of a mode that has happened as it begins."""
    return next((event for event in _ends(mode) if _over(event, now, np.zeros(1))[0] >= 0), None)


def _first(mode: Mode, seen: Measures, since: Float[np.ndarray, "n"]) -> int | None:
    """Index of the first sample at which an event has happened."""
    happened = np.any([_over(event, seen, since) >= 0 for event in _ends(mode)], axis=0)
    return int(np.argmax(happened)) if happened.any() else None


def _locate(
    system: RampedRobot, mode: Mode, t: float, x: State, step: float, began: float
) -> tuple[float, State, Measures, Event]:
    """Time within the step after t at which the first event happens, state and measures there, and the event."""
    from scipy.optimize import brentq  # takes half a second

    def ahead(h: float) -> tuple[State, Measures]:
        states, seen = remembered(_stretch, system, jnp.asarray(t), x, jnp.asarray(h))  # of which the first counts
        return jax.tree.map(lambda a: a[0], states), jax.tree.map(lambda a: a[:1], seen)

    def over(event: Event, h: float) -> float:
        return float(_over(event, ahead(h)[1], np.array([t + h - began]))[0])

    found = []
    for event in _ends(mode):
        if over(event, step) >= 0:
            h = 0.0
            if over(event, 0.0) < 0:
                h = float(brentq(lambda h, e=event: over(e, h), 0.0, step, xtol=_ACCURACY))  # pyright: ignore[reportArgumentType]
            found.append((h, event))
    h, event = min(found, key=lambda pair: pair[0])
    state, now = ahead(h)
    return t + h, state, now, event


def mission_data(flown: Flown, settings: dict[str, Any] | None = None) -> "xr.Dataset":
    """A mission as labelled data, every 20 ms and at its events; `settings` go into its provenance.

    `position` [m], `velocity` [m/s] of the body in the world (time, axis); `pitch`, `heading` [rad], `mode` (time);
    `quantity_value` (time, quantity) of what modes set, with `quantity_unit`; `event_time` [s], `event`, `event_mode`
    (event). With batteries, `battery_power` [W] (time, battery) and `battery_energy` [J] (battery), the integral of it
    over all steps. Attributes: robot, mission, status, status_reason, provenance.
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
        energy = np.trapezoid(seen.battery_power, flown.time, axis=0)
        batteries = {
            "battery_power": (("time", "battery"), np.asarray(seen.battery_power)[rows], {"units": "W"}),
            "battery_energy": ("battery", energy, {"units": "J"}),
        }
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
        },
    )
