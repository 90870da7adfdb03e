"""Missions: a robot that goes from mode to mode, as time passes and things happen."""

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core import State
from nectosome.core.remember import remembered
from nectosome.description import dump_robot, numeric_paths
from nectosome.description.mission import Event, Mission, Mode
from nectosome.io import provenance
from nectosome.mechanism import moves_in_plane
from nectosome.model import build, template_of

from .fixed_step import fixed_step
from .ramps import Measures, RampedRobot, Ramps, measured

if TYPE_CHECKING:
    import xarray as xr

_STRETCH = 100  # steps between looks at what happened
_SAMPLE = 0.02  # s between the moments that results keep
_SURE = 1e-9  # s, to which an event is located within its step


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
    more than the motion does; the next mode goes on from there. An event that stands already when its mode begins ends
    it at once. A ramp that is not through goes on in the next modes, unless they set its quantity anew.
    `progress(mode, share of the modes)` is called now and then; the mission ends where it returns False.
    """
    system = _system(mission)
    x, now = remembered(_begin, system)
    t, passed, reason = 0.0, [], ""
    kept = _Kept()
    for k, mode in enumerate(mission.modes):
        system = eqx.tree_at(lambda s: s.ramps, system, _changed(mission, system.ramps, mode, t))
        kept.add(k, system, np.array([t]), now)
        began, event = t, _standing(mode, now)
        while event is None and not reason:
            if progress is not None and progress(mode.name, k / len(mission.modes)) is False:
                reason = f"cancelled in {mode.name}"
                break
            states, seen = remembered(_stretch, system, jnp.asarray(t), x, jnp.asarray(step))
            times = t + step * (1 + np.arange(_STRETCH))
            hit, broken = (
                _first(mode, seen, times - began),
                np.flatnonzero(~np.isfinite(np.asarray(seen.position[:, 2]))),
            )
            if broken.size and (hit is None or broken[0] <= hit):
                reason = f"the motion broke off in {mode.name} at {times[broken[0]]:.4g} s: try shorter steps"
                hit = int(broken[0])
            count = _STRETCH if hit is None else hit
            kept.add(k, system, times[:count], jax.tree.map(lambda a, n=count: a[:n], seen))
            if count:
                t, x = float(times[count - 1]), jax.tree.map(lambda a, n=count: a[n - 1], states)
            if hit is not None and not reason:
                t, x, now, event = _locate(system, mode, t, x, step, began)
                kept.add(k, system, np.array([t]), now)
        if event is not None and event.kind == "longest":
            wanted = " or ".join(e.text for e in mode.until)
            reason = f"{mode.name} took longer than {mode.longest:g} s without coming to {wanted}"
        if reason:
            break
        assert event is not None
        passed.append(Passed(mode.name, event.text, t))
    return kept.flown(mission, tuple(passed), reason)


class _Kept:
    """What is kept of a mission, piece by piece."""

    def __init__(self) -> None:
        self.pieces: list[tuple[np.ndarray, Measures, np.ndarray, np.ndarray]] = []

    def add(self, mode: int, system: RampedRobot, times: Float[np.ndarray, "n"], seen: Measures) -> None:
        ramps = jax.tree.map(np.asarray, system.ramps)
        seen = jax.tree.map(np.asarray, seen)
        self.pieces.append((times, seen, _at(ramps, times[:, None]), np.full(times.size, mode)))

    def flown(self, mission: Mission, passed: tuple[Passed, ...], reason: str) -> Flown:
        time, seen, values, mode = jax.tree.map(lambda *x: np.concatenate(x), *self.pieces)
        return Flown(mission, time, seen, values, mode, passed, reason)


def _paths(mission: Mission) -> tuple[str, ...]:
    """Paths that modes set."""
    return tuple(dict.fromkeys(path for mode in mission.modes for path in mode.changes))


def _system(mission: Mission) -> RampedRobot:
    """The robot with the values of its description, which the modes will change."""
    paths = _paths(mission)
    blueprint, numbers = template_of(mission.robot, paths)
    varying = tuple(blueprint.paths.index(path) for path in paths)
    values, none = numbers[jnp.array(varying, dtype=int)], jnp.zeros(len(paths))
    flat = moves_in_plane(build(mission.robot))
    return RampedRobot(blueprint, numbers, varying, Ramps(values, values, none, none), flat)


def _at(ramps: Ramps, t: float | Float[np.ndarray, "n 1"]) -> Float[np.ndarray, "*n k"]:
    """Values of ramps, without JAX."""
    share = np.where(ramps.seconds > 0, (t - ramps.since) / np.where(ramps.seconds > 0, ramps.seconds, 1.0), 1.0)
    return np.asarray(ramps.start + np.clip(share, 0.0, 1.0) * (ramps.end - ramps.start))


def _changed(mission: Mission, ramps: Ramps, mode: Mode, t: float) -> Ramps:
    """Ramps with those that a mode begins at time t."""
    columns = {name: np.array(values) for name, values in jax.tree.map(np.asarray, ramps)._asdict().items()}
    now = _at(ramps, t)
    for i, path in enumerate(_paths(mission)):
        if path in mode.changes:
            change = mode.changes[path]
            new = {"start": now[i], "end": change.value, "since": t, "seconds": change.seconds}
            for name, value in new.items():
                columns[name][i] = value
    return Ramps(**{name: jnp.asarray(values) for name, values in columns.items()})


_LONGEST = "longest"


def _ends(mode: Mode) -> tuple[Event, ...]:
    """What ends a mode, its longest time last."""
    return (*mode.until, Event(_LONGEST, _LONGEST, mode.longest))


def _over(event: Event, seen: Measures, since: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """How far beyond an event each moment is: from 0 on it has happened; `since` is the time in the mode [s]."""
    if event.kind in ("time", _LONGEST):
        return since - event.limit
    if event.kind in ("touchdown", "liftoff"):
        return np.asarray(seen.feet) * (1 if event.kind == "touchdown" else -1)
    if event.kind in ("surface", "low_wall", "high_wall"):
        return np.asarray(getattr(seen, event.kind))
    name, _, axis = event.kind.partition(".")
    value = np.asarray(getattr(seen, name))
    return ((value[..., "xyz".index(axis)] if axis else value) - event.limit) * (-1 if event.below else 1)


def _standing(mode: Mode, now: Measures) -> Event | None:
    """Event of a mode that stands already as it begins."""
    return next((event for event in _ends(mode) if _over(event, now, np.zeros(1))[0] >= 0), None)


def _first(mode: Mode, seen: Measures, since: Float[np.ndarray, "n"]) -> int | None:
    """The first of some moments at which an event has happened."""
    happened = np.any([_over(event, seen, since) >= 0 for event in _ends(mode)], axis=0)
    return int(np.argmax(happened)) if happened.any() else None


def _locate(
    system: RampedRobot, mode: Mode, t: float, x: State, step: float, began: float
) -> tuple[float, State, Measures, Event]:
    """Moment within the step after t at which the first event happens, state and measures there, and the event."""

    def ahead(h: float) -> tuple[State, Measures]:
        states, seen = remembered(_stretch, system, jnp.asarray(t), x, jnp.asarray(h))  # of which the first counts
        return jax.tree.map(lambda a: a[0], states), jax.tree.map(lambda a: a[:1], seen)

    def over(event: Event, h: float) -> float:
        return float(_over(event, ahead(h)[1], np.array([t + h - began]))[0])

    found = []
    for event in _ends(mode):
        if over(event, step) >= 0:
            h = 0.0 if over(event, 0.0) >= 0 else _zero(lambda h, e=event: over(e, h), step)
            found.append((h, event))
    h, event = min(found, key=lambda pair: pair[0])
    state, now = ahead(h)
    return t + h, state, now, event


def _zero(f: Callable[[float], float], step: float) -> float:
    """Where f crosses 0 within a step."""
    from scipy.optimize import brentq  # takes half a second

    return float(brentq(f, 0.0, step, xtol=_SURE))  # pyright: ignore[reportArgumentType]


def mission_data(flown: Flown, settings: dict[str, Any] | None = None) -> "xr.Dataset":
    """A mission as labelled data, every 20 ms and at its events; `settings` go into its provenance.

    `position` [m], `velocity` [m/s] of the body in the world (time, axis); `pitch`, `heading` [rad], `mode` (time);
    `quantity_value` (time, quantity) of what modes set, with `quantity_unit`; `event_time` [s], `event`, `event_mode`
    (event). Attributes: robot, mission, status, status_reason, provenance.
    """
    import xarray as xr

    seen, robot = flown.measures, flown.mission.robot
    wanted = np.searchsorted(flown.time, np.arange(0.0, flown.time[-1] + _SAMPLE, _SAMPLE))
    parted = np.flatnonzero(np.diff(flown.mode))
    rows = np.unique(np.concatenate([wanted, parted, parted + 1]).clip(0, flown.time.size - 1))
    vectors, angles = {"position": "m", "velocity": "m/s"}, {"pitch": "rad", "heading": "rad"}
    known = numeric_paths(robot)
    names = np.array([mode.name for mode in flown.mission.modes], dtype=str)
    modes, told, times = zip(*flown.passed, strict=True) if flown.passed else ([], [], [])
    return xr.Dataset(
        {name: (("time", "axis"), getattr(seen, name)[rows], {"units": unit}) for name, unit in vectors.items()}
        | {name: ("time", getattr(seen, name)[rows], {"units": unit}) for name, unit in angles.items()}
        | {
            "mode": ("time", names[flown.mode[rows]]),
            "quantity_value": (("time", "quantity"), flown.quantities[rows]),
            "event_time": ("event", np.array(times, dtype=float), {"units": "s"}),
        },
        coords={
            "time": ("time", flown.time[rows], {"units": "s"}),
            "axis": ["x", "y", "z"],
            "quantity": np.array(flown.paths, dtype=str),
            "quantity_unit": ("quantity", np.array([known[path].unit for path in flown.paths], dtype=str)),
            "event": ("event", np.array(told, dtype=str)),
            "event_mode": ("event", np.array(modes, dtype=str)),
        },
        attrs={
            "title": f"{robot.name}: mission",
            "robot": dump_robot(robot),
            "mission": flown.mission.text,
            "status": "SOLVED" if not flown.reason else "STOPPED",
            "status_reason": flown.reason or "every mode came to its end",
            "provenance": json.dumps(provenance(settings or {})),
        },
    )
