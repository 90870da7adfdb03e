"""Several environments of one robot, stepped by one compiled program."""

from collections.abc import Mapping, Sequence
from operator import index
from typing import Any, Unpack

import numpy as np
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from jaxtyping import Bool, Float

from nectosome.model.inputs import RobotLike
from nectosome.units import InputError, shorten

from .episodes import EpisodeOptions, Episodes, Range, Reward, checked
from .robot_env import check_render_mode

Many = Float[np.ndarray, "n k"]


class RobotVectorEnv(VectorEnv[Many, Many, Float[np.ndarray, "n"]]):
    """`num_envs` copies of a `RobotEnv`, stepped by one call of one program; other arguments as there.

    Each moves as one alone, within the tolerance of the integration. A seed s of `reset` gives copy i the seed s + i.
    A copy whose episode ended begins anew at the next step (`AutoresetMode.NEXT_STEP`): its action is not used then,
    its reward is 0.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        robot: RobotLike,
        *,
        num_envs: int,
        commands: Mapping[str, Range],
        observations: Sequence[str],
        reward: Reward,
        step: str | float,
        episode: str | float,
        render_mode: str | None = None,
        **options: Unpack[EpisodeOptions],
    ):
        check_render_mode(render_mode)
        if isinstance(num_envs, bool) or not isinstance(num_envs, int) or num_envs < 1:
            raise InputError(f'"{shorten(num_envs)}" must be a whole number of at least 1.', field="num_envs")
        self.num_envs, self.render_mode = num_envs, render_mode
        self._episodes = Episodes(num_envs, robot, commands, observations, reward, step, episode, **options)
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
        return self._episodes.start(self._generators, options), {}

    def step(
        self, actions: Many
    ) -> tuple[Many, Float[np.ndarray, "n"], Bool[np.ndarray, "n"], Bool[np.ndarray, "n"], dict[str, Any]]:
        """One step of all copies; `info` has `status` and `reason` of those that were terminated.

        Raises InputError as that of `RobotEnv` does.
        """
        if not self._ended.size:
            raise InputError("no episode is under way. Call reset() first.")
        actions = checked(actions, self.action_space, "actions")
        found = self._episodes.step(actions, self._ended, self._generators)
        self._ended = found.terminated | found.truncated
        infos: dict[str, Any] = {}
        for k in np.flatnonzero(found.terminated):
            infos = self._add_info(infos, found.infos[k], int(k))
        return found.observations, found.rewards, found.terminated, found.truncated, infos
