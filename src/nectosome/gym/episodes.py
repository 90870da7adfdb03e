"""Episodes of a robot, several side by side: actions to commands, readings to observations and rewards."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from typing import Any, Literal, NamedTuple, Required, TypedDict

import gymnasium
import numpy as np
from jaxtyping import Bool, Float, UInt8

from nectosome.core import Status
from nectosome.description import get_value
from nectosome.description.variables import Box, read_range, read_variable
from nectosome.io.schema.quantity import Quantity
from nectosome.mechanism import Robot
from nectosome.model import build
from nectosome.model.inputs import RobotLike, description_of
from nectosome.solve import PlantBatch, SampledPlant, common_readings, reading_of
from nectosome.solve.readings import all_readings
from nectosome.units import (
    InputError,
    check_choice,
    check_whole,
    did_you_mean,
    kind_of,
    read_positive,
    read_quantity,
    shorten,
)
from nectosome.units.expression import Expression, FunctionFormula

Range = str | Sequence[float]
Reward = str | Callable[[Mapping[str, float]], float]  # an expression, or a function of a mapping from names to numbers
Observed = Sequence[str] | Mapping[str, Range | None]  # names, or names with the ranges of readings
_MEAN, _GOAL, _COMMAND = "mean.", "goal.", "command."
_FAR = 1e9  # [SI] bound of readings without a range: larger than any of a robot in water
_POWERS = ("electrical_power", "battery_power")  # that `info` has, where there are motors or batteries


class EpisodeOptions(TypedDict, total=False):
    """Arguments of an environment beside its robot: see `RobotEnv`."""

    commands: Required[Mapping[str, Range]]
    observations: Required[Observed]
    reward: Required[Reward]
    step: Required[str | float]
    episode: Required[str | float]
    goals: Mapping[str, Range] | None
    draw: Mapping[str, Range] | None
    settings: Iterable[str]
    instants: int
    method: Literal["auto", "implicit", "explicit"]
    picture: tuple[int, int]
    camera: str


class EpisodeStep(NamedTuple):
    """What a step of n episodes gives."""

    observations: Float[np.ndarray, "n o"]
    rewards: Float[np.ndarray, "n"]
    terminated: Bool[np.ndarray, "n"]
    truncated: Bool[np.ndarray, "n"]
    numbers: dict[str, Float[np.ndarray, "n"]]  # of `info`
    ended: dict[int, dict[str, str]]  # by episode that ended: status and reason


class Episodes:
    """n episodes of one robot, each with its own draws; see `RobotEnv` for the arguments."""

    def __init__(
        self,
        n: int,
        robot: RobotLike,
        commands: Mapping[str, Range],
        observations: Observed,
        reward: Reward,
        step: str | float,
        episode: str | float,
        goals: Mapping[str, Range] | None = None,
        draw: Mapping[str, Range] | None = None,
        settings: Iterable[str] = (),
        instants: int = 16,
        method: Literal["auto", "implicit", "explicit"] = "auto",
        picture: tuple[int, int] = (640, 480),
        camera: str = "three-quarter",
    ):
        self.description = description = description_of(robot, settings)
        dt, time = read_positive(step, "time", "step"), read_positive(episode, "time", "episode")
        self.dt, self.length = dt, round(time / dt)
        if self.length < 1 or abs(time / dt - self.length) > 1e-6:
            raise InputError(f"{time:g} s is no whole number of steps of {dt:g} s.", field="episode")
        check_whole(instants, "instants", 1)
        spans = _mapping(commands, "commands"), _mapping(draw or {}, "draw")
        if not spans[0]:
            raise InputError("needs at least one quantity with its range.", field="commands")
        acted, drawn = (tuple(read_variable(name, span, description) for name, span in of.items()) for of in spans)
        whole = build(description)
        aims = _mapping(goals or {}, "goals")
        of_goals = tuple(
            read_range(name, span, [Quantity(reading_of(whole, name).dimension)]) for name, span in aims.items()
        )
        if isinstance(observations, str) or not observations or not all(isinstance(x, str) for x in observations):
            raise InputError("is to be a list of names, one at least, or names with ranges.", field="observations")
        self.observed, each = tuple(observations), all_readings(whole)
        known = _known(each, [*aims], [*spans[0]])
        text = isinstance(reward, str)
        self.reward = Expression(reward, "reward") if text else FunctionFormula(reward, known, "reward")
        for field, names in (("observations", self.observed), ("reward", self.reward.names)):
            for name in names:
                if name not in known:
                    raise _unknown(name, known, common_readings(whole), field)
        used = dict.fromkeys(chain(self.observed, self.reward.names))
        readings = dict.fromkeys(known[name][1] for name in used if known[name][0] in ("reading", "mean"))
        self._powers = {kind: [name for name in each if name.startswith(f"{kind}.")] for kind in _POWERS}
        names = [*dict.fromkeys(chain(readings, *self._powers.values()))] or ["position.x"]  # a plant has one at least
        of_means = any(known[name][0] == "mean" for name in used)
        plant = SampledPlant(
            description, [*spans[0]], names, dt, instants if of_means else 1, drawn=drawn, method=method
        )
        self._sources = {name: known[name] for name in used}
        self._places = {name: k for k, name in enumerate(names)}
        self.commands, self.goals, self.drawn = Box(acted), Box(of_goals), Box(drawn)
        self._variables = {one.name: one for one in drawn} | {f"{_GOAL}{one.name}": one for one in of_goals}
        self._initial = np.array([float(get_value(description, name)) for name in spans[0]])
        self._bounds = self._ends_of(observations, whole)
        for size in picture:
            check_whole(size, "picture", 16)
        self._tree, self._picture, self._camera = whole.tree, picture, camera
        self._batch = PlantBatch(plant)
        self._n = n
        self._draws, self._aims = np.zeros((n, len(drawn))), np.zeros((n, len(of_goals)))
        self._commanded = np.tile(self._initial, (n, 1))
        self._steps = np.zeros(n, dtype=int)
        self._state: Any = None

    @property
    def action_space(self) -> gymnasium.spaces.Box:
        """One number from -1 to 1 for each command: the ends of its range."""
        return gymnasium.spaces.Box(-1.0, 1.0, (len(self.commands.names),), np.float64)

    @property
    def observation_space(self) -> gymnasium.spaces.Box:
        """The names observed, in SI units, between their ends."""
        return gymnasium.spaces.Box(self._bounds[:, 0], self._bounds[:, 1], dtype=np.float64)

    def start(
        self, generators: Sequence[np.random.Generator], options: Mapping[str, Any] | None
    ) -> Float[np.ndarray, "n o"]:
        """Begin all episodes; their observations.

        `options` are values of goals and of quantities drawn, by name, instead of drawn ones.
        """
        self._draw(np.ones(self._n, dtype=bool), generators, options)
        self._state = self._batch.start(self._draws)
        observed, outside = self._observations(self._quantities())
        if outside.any():
            words = self._beyond(observed[int(np.argmax(outside))])
            raise InputError(f"{words}, as it begins: give a wider range.", field="observations")
        return observed

    def step(
        self,
        actions: Float[np.ndarray, "n a"],
        renew: Bool[np.ndarray, "n"],
        generators: Sequence[np.random.Generator],
    ) -> EpisodeStep:
        """One step of all episodes; those to `renew` begin anew instead, with a reward of 0."""
        if renew.any():
            self._draw(renew, generators, None)
            self._state = self._batch.merged(renew, self._batch.start(self._draws), self._state)
        commands = self.commands.values(0.5 * (np.clip(actions, -1.0, 1.0) + 1.0))
        self._commanded = np.where(renew[:, None], self._initial, commands)
        before = self._state
        self._state, found = self._batch.hold(before, self._commanded, renew)
        statuses = np.asarray(found)
        self._steps += ~renew
        failed = statuses != int(Status.SOLVED)
        quantities = self._quantities()
        beyond, outside = self._observations(quantities)
        observed = beyond
        if outside.any():
            self._state = self._batch.merged(outside, before, self._state)
            quantities = self._quantities()
            observed, _ = self._observations(quantities)
        rewards = np.where(renew, 0.0, np.broadcast_to(self.reward.each(quantities), self._n))
        if not np.isfinite(rewards).all():
            k = int(np.flatnonzero(~np.isfinite(rewards))[0])
            at = ", ".join(f"{name} = {quantities[name][k]:g}" for name in self.reward.names)
            raise InputError(f'"{shorten(self.reward.text)}" is NaN or infinite at {at}.', field="reward")
        terminated = failed | outside
        truncated = ~terminated & (self._steps >= self.length)
        ended = dict[int, dict[str, str]]()
        for k in np.flatnonzero(terminated | truncated).tolist():
            status = Status(int(statuses[k]))
            why = "its time is over" if truncated[k] else self._beyond(beyond[k]) if outside[k] else status.reason
            name = "TIME_OVER" if truncated[k] else "OUT_OF_RANGE" if outside[k] else status.name
            ended[k] = {"status": name, "reason": why}
        return EpisodeStep(observed, rewards, terminated, truncated, self.numbers(), ended)

    def numbers(self) -> dict[str, Float[np.ndarray, "n"]]:
        """Time since the start [s], speed through the water [m/s], powers of motors and of batteries in all [W]."""
        found = {"time": self._steps * self.dt, "speed": np.asarray(self._state.moving.speed)}
        readings = np.asarray(self._state.moving.readings)
        for kind, names in self._powers.items():
            if names:
                found[kind] = readings[:, [self._places[name] for name in names]].sum(axis=1)
        return found

    def pictures(self) -> list[UInt8[np.ndarray, "h w 3"]]:
        """Each robot as it is now: red, green and blue. Raises InputError where none of its parts has a size."""
        from nectosome.view.drawing import CAMERAS, Scene
        from nectosome.view.still import instant

        check_choice(self._camera, CAMERAS, "camera")
        found = []
        for k in range(self._n):
            time = float(self._steps[k] * self.dt)
            seen = instant(self.description, self._tree, time, self._batch.stations(self._state, k))
            (picture,) = Scene(seen, time, self._picture, self._camera).pictures(np.array([time]))
            found.append(np.ascontiguousarray(picture[..., ::-1]))
        return found

    def _draw(
        self,
        which: Bool[np.ndarray, "n"],
        generators: Sequence[np.random.Generator],
        options: Mapping[str, Any] | None,
    ) -> None:
        given = self._given(options)
        for k in np.flatnonzero(which).tolist():
            for box, into, prefix in ((self.drawn, self._draws, ""), (self.goals, self._aims, _GOAL)):
                values = box.values(generators[k].uniform(size=len(box.names)))
                into[k] = [given.get(f"{prefix}{name}", x) for name, x in zip(box.names, values, strict=True)]
        self._commanded = np.where(which[:, None], self._initial, self._commanded)
        self._steps = np.where(which, 0, self._steps)

    def _given(self, options: Mapping[str, Any] | None) -> dict[str, float]:
        """Values given for goals and for quantities drawn."""
        found = dict[str, float]()
        for name, value in (options or {}).items():
            if name not in self._variables:
                known = ", ".join(self._variables) or "none"
                hint = did_you_mean(name, self._variables)
                raise InputError(f"is nothing that is drawn. Drawn are: {known}.{hint}", field=f"options.{name}")
            of = self._variables[name]
            number = read_quantity(value, of.dimension, f"options.{name}")
            if not of.lower <= number <= of.upper:
                raise InputError(f'"{value}" is out of range: it must be in {of.text()}.', field=f"options.{name}")
            found[name] = number
        return found

    def _quantities(self) -> dict[str, Float[np.ndarray, "n"]]:
        """All that is observed or rewarded."""
        readings, means = np.asarray(self._state.moving.readings), np.asarray(self._state.moving.means)
        columns = {"reading": (readings, self._places), "mean": (means, self._places)}
        columns["goal"] = self._aims, {name: k for k, name in enumerate(self.goals.names)}
        columns["command"] = self._commanded, {name: k for k, name in enumerate(self.commands.names)}
        found = {}
        for name, (kind, of) in self._sources.items():
            values, places = columns[kind]
            found[name] = values[:, places[of]]
        return found

    def _observations(
        self, quantities: Mapping[str, Float[np.ndarray, "n"]]
    ) -> tuple[Float[np.ndarray, "n o"], Bool[np.ndarray, "n"]]:
        """Observations, and which episodes have a reading beyond its range."""
        found = np.stack([quantities[name] for name in self.observed], axis=1)
        beyond = (found < self._bounds[:, 0]) | (found > self._bounds[:, 1])
        return found, np.asarray(beyond.any(axis=1))

    def _beyond(self, observed: Float[np.ndarray, "o"]) -> str:
        """What is beyond its range."""
        for name, value, (low, high) in zip(self.observed, observed.tolist(), self._bounds.tolist(), strict=True):
            if not low <= value <= high:
                return f"{name} is {value:.4g}, beyond {low:.4g} to {high:.4g} (SI)"
        return ""

    def _ends_of(self, observations: Observed, robot: Robot) -> Float[np.ndarray, "o 2"]:
        """The least and the largest value of each observation [SI].

        Goals and commands have their own, readings those given.
        """
        ends = list[tuple[float, float]]()
        for name in self.observed:
            kind, of = self._sources[name]
            span = observations[name] if isinstance(observations, Mapping) else None
            if kind in ("reading", "mean"):
                ends.append((-_FAR, _FAR))
                if span is not None:
                    own = read_range(name, span, [Quantity(reading_of(robot, of).dimension)])
                    ends[-1] = own.lower, own.upper
                continue
            if span is not None:
                raise InputError(f"has the range of that {kind}: give None.", field=name)
            box = self.goals if kind == "goal" else self.commands
            low, high = box.bounds[box.names.index(of)]
            if kind == "command":  # an episode begins with what the description says
                begins = self._initial[box.names.index(of)]
                low, high = min(low, begins), max(high, begins)
            ends.append((float(low), float(high)))
        return np.array(ends)


def checked(actions: Any, space: gymnasium.Space[Any], field: str) -> Float[np.ndarray, "..."]:
    """Actions as numbers. Raises InputError where their shape is not that of the space, or one is not finite."""
    found = np.asarray(actions, dtype=float)
    if found.shape != space.shape:
        raise InputError(f"has the shape {found.shape}; {space.shape} is expected.", field=field)
    if not np.isfinite(found).all():
        raise InputError("is NaN or infinite; numbers from -1 to 1 are expected.", field=field)
    return found


def _known(readings: Sequence[str], goals: Sequence[str], commands: Sequence[str]) -> dict[str, tuple[str, str]]:
    """What may be observed and rewarded: kind, and name there; readings count first."""
    found = {f"{_COMMAND}{name}": ("command", name) for name in commands}
    found |= {f"{_GOAL}{name}": ("goal", name) for name in goals}
    found |= {f"{_MEAN}{name}": ("mean", name) for name in readings}
    found |= {name: ("reading", name) for name in readings}
    return found


def _unknown(name: str, known: Mapping[str, tuple[str, str]], readings: Sequence[str], field: str) -> InputError:
    """An error that says what there is."""
    others = [other for other, (kind, _) in known.items() if kind in ("goal", "command")]
    hint = did_you_mean(name, known) or f" Known: {', '.join([*others, *readings[:30]])}; mean. before a reading."
    return InputError(f'"{shorten(name)}" is no reading, goal or command of this robot.{hint}', field=field)


def _mapping(given: Any, field: str) -> dict[str, Range]:
    if not isinstance(given, Mapping):
        hint = 'as in {"bias": "-8..8 mN m"}'
        raise InputError(f"{kind_of(given)} is given where names with ranges are expected, {hint}.", field=field)
    return dict(given)
