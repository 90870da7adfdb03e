"""Any robot as an environment of Gymnasium, one or several side by side."""

from collections.abc import Sequence
from operator import index
from typing import Any, Unpack

import gymnasium
import numpy as np
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from jaxtyping import Bool, Float, UInt8

from nectosome.io.extras import package
from nectosome.model.inputs import RobotLike
from nectosome.units import InputError, check_choice, check_whole

from .episodes import EpisodeOptions, Episodes, checked

Seen = Float[np.ndarray, "o"]
Action = Float[np.ndarray, "a"]


class RobotEnv(gymnasium.Env[Seen, Action]):
    """A robot that is commanded anew at each step; the commands are held in between.

    All numbers are float64: quantities in SI units, actions from -1 to 1.

    - robot: name, path, description or built robot; `settings` such as `f=1.5 Hz` change its quantities.
    - commands: quantities of the robot, by path or alias, each with a range, `{"bias": "-8..8 mN m"}` or two numbers in
      SI. An action has a number for each; -1 and 1 are the ends of its range, and beyond them it counts as these. An
      episode begins with the values of the robot's file.
    - observations: readings by name, as `nectosome.solve.reading_of` takes them, such as `heading`; `mean.heading`, its
      mean over the last step, at `instants` even instants; `goal.heading` and `command.bias`. Or a mapping from names
      to the ranges of readings, `{"heading": "-90..90 deg", "goal.heading": None}`, the bounds of the observations:
      an episode ends where one is beyond them. A reading without a range has 1e9 on both sides.
    - reward: an expression of the same names, such as `-abs(heading - goal.heading)`, after each step; or a function of
      a mapping from them to numbers, `lambda q: -abs(q["heading"] - q["goal.heading"])`.
    - step, episode: time for which commands are held, and until an episode is truncated; a whole number of steps.
    - goals: readings, each with the range of its goal. They are drawn evenly at each reset.
    - draw: quantities of the robot that are drawn at each reset, with ranges: how it starts, or what is uncertain.
    - method: of time steps, "explicit", "implicit" for stiff robots, or "auto" (see `nectosome.solve.SampledPlant`).
    - render_mode: "rgb_array", for which `render` gives a `picture` (width and height [px]) from a `camera`: side, top,
      front or three-quarter.

    `info` has the `time` [s] of the episode, the body's `speed` through the water [m/s], and where there are motors or
    batteries their `electrical_power` and `battery_power` [W] in all. At the end it has the `status` and the `reason`.
    A robot whose motion cannot be computed on ends the episode (terminated), as one beyond a range does; it stays where
    it was before. `reset(options={"goal.heading": "30 deg"})` gives goals and quantities to draw.

    Raises InputError, whose field is the argument, for what is unknown, with what is known; for a reward that is NaN.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}  # noqa: RUF012  as the base class has it

    def __init__(
        self,
        robot: RobotLike,
        *,
        render_mode: str | None = None,
        **options: Unpack[EpisodeOptions],
    ):
        self.render_mode = _checked_mode(render_mode)
        self._episodes = Episodes(1, robot, **options)
        self.metadata = {**self.metadata, "render_fps": max(round(1.0 / self._episodes.dt), 1)}
        self.action_space = self._episodes.action_space
        self.observation_space = self._episodes.observation_space
        self._ended = True  # or not begun

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Seen, dict[str, Any]]:
        """Start an episode, with goals and quantities drawn by `seed`; an observation and `info`."""
        super().reset(seed=seed)
        self._ended = False
        observed = self._episodes.start([self.np_random], options)[0]
        return observed, _of_first(self._episodes.numbers())

    def step(self, action: Action) -> tuple[Seen, float, bool, bool, dict[str, Any]]:
        """Hold the commands of an action for a step: observation, reward, terminated, truncated, `info`.

        Raises InputError for an action of another shape or that is not finite, and after the end of an episode.
        """
        if self._ended:
            raise InputError("no episode is under way. Call reset() first.")
        actions = checked(action, self.action_space, "action")[None]
        outcome = self._episodes.step(actions, np.array([False]), [self.np_random])
        terminated, truncated = bool(outcome.terminated[0]), bool(outcome.truncated[0])
        self._ended = terminated or truncated
        info = _of_first(outcome.numbers) | outcome.ended.get(0, {})
        return outcome.observations[0], float(outcome.rewards[0]), terminated, truncated, info

    def render(self) -> UInt8[np.ndarray, "h w 3"] | None:  # type: ignore[override]
        """A picture of the robot as it is, in `render_mode="rgb_array"`."""
        return None if self.render_mode is None else self._episodes.pictures()[0]


def _of_first(numbers: dict[str, Float[np.ndarray, "n"]]) -> dict[str, Any]:
    return {name: float(values[0]) for name, values in numbers.items()}


def _checked_mode(mode: str | None) -> str | None:
    """Raise InputError for a mode that is unknown, or for which OpenCV is missing."""
    if mode is not None:
        check_choice(mode, RobotEnv.metadata["render_modes"], "render_mode")
        package("cv2", "video")
    return mode


Many = Float[np.ndarray, "n k"]


class RobotVectorEnv(VectorEnv[Many, Many, Float[np.ndarray, "n"]]):
    """`num_envs` copies of a `RobotEnv`, stepped by one call of one program; other arguments as there.

    Each moves as one alone, within the tolerance of the integration. A seed s of `reset` gives copy i the seed s + i.
    A copy whose episode ended begins anew at the next step (`AutoresetMode.NEXT_STEP`): its action is not used then,
    its reward is 0.
    """

    metadata: dict[str, Any] = {**RobotEnv.metadata, "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        robot: RobotLike,
        *,
        num_envs: int,
        render_mode: str | None = None,
        **options: Unpack[EpisodeOptions],
    ):
        check_whole(num_envs, "num_envs", 1)
        self.num_envs, self.render_mode = num_envs, _checked_mode(render_mode)
        self._episodes = Episodes(num_envs, robot, **options)
        self.metadata = {**self.metadata, "render_fps": max(round(1.0 / self._episodes.dt), 1)}
        self.single_action_space = self._episodes.action_space
        self.single_observation_space = self._episodes.observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._generators = [np_random()[0] for _ in range(num_envs)]
        self._ended = np.zeros(0, dtype=bool)  # of none before the first reset

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Many, dict[str, Any]]:
        """Start all episodes; `seed` may be a list, one for each copy."""
        n = self.num_envs
        seeds = [None] * n if seed is None else seed
        if isinstance(seeds, int | np.integer):
            seeds = [int(seeds) + i for i in range(n)]
        if len(seeds) != n:
            raise InputError(f"has {len(seeds)} numbers; {n} are expected.", field="seed")
        for k, own in enumerate(seeds):
            if own is not None:
                self._generators[k] = np_random(index(own))[0]  # np_random refuses integers of NumPy
        self._ended = np.zeros(n, dtype=bool)
        return self._episodes.start(self._generators, options), self._infos(self._episodes.numbers())

    def step(
        self, actions: Many
    ) -> tuple[Many, Float[np.ndarray, "n"], Bool[np.ndarray, "n"], Bool[np.ndarray, "n"], dict[str, Any]]:
        """One step of all copies; `info` has `status` and `reason` of those that ended.

        Raises InputError as that of `RobotEnv` does.
        """
        if not self._ended.size:
            raise InputError("no episode is under way. Call reset() first.")
        actions = checked(actions, self.action_space, "actions")
        outcome = self._episodes.step(actions, self._ended, self._generators)
        self._ended = outcome.terminated | outcome.truncated
        infos = self._infos(outcome.numbers)
        for k, why in outcome.ended.items():
            infos = self._add_info(infos, why, k)
        return outcome.observations, outcome.rewards, outcome.terminated, outcome.truncated, infos

    def render(self) -> tuple[UInt8[np.ndarray, "h w 3"], ...] | None:  # type: ignore[override]
        """A picture of each copy, as `RobotEnv` has one."""
        return None if self.render_mode is None else tuple(self._episodes.pictures())

    def _infos(self, numbers: dict[str, Float[np.ndarray, "n"]]) -> dict[str, Any]:
        """Numbers of all copies, and that all have them, as Gymnasium writes it."""
        return {**numbers, **{f"_{name}": np.ones(self.num_envs, dtype=bool) for name in numbers}}
