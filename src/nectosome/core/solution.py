"""Result of a solver: value, named status, statistics, residual."""

from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from nectosome.units.errors import ReasonedStatus


class Status(ReasonedStatus):
    """Why a solver stopped."""

    SOLVED = 0, "solved"
    EVENT = 1, "stopped at the event"
    STEP_LIMIT = 2, "failed: more time steps than allowed"
    STEP_TOO_SMALL = 3, "failed: the time step became too small"
    NOT_FINITE = 4, "failed: the state is NaN or infinite"
    NO_EQUILIBRIUM = 5, "no equilibrium found"
    CANCELLED = 6, "cancelled"
    UNSTABLE = 7, "found, but unstable: small disturbances grow"
    UNSTEADY_DRIVES = 8, "drives or loads change with time: there is no steady motion"
    NO_PERIOD = 9, "no periodic motion found"
    OTHER_PERIOD = 10, "drives or loads do not have this period"
    SETTLED = 11, "periodic motion, found by waiting until it repeats itself"
    NO_TURN = 12, "the motor stalls or swings: its hinge does not turn round, and nothing repeats itself"


class Solution(eqx.Module):
    """Value, status, statistics and residual of a solve; a pytree that passes through jit, vmap and grad."""

    value: Any
    status: Any  # a Status; its number [*batch] of what is traced or in a batch
    stats: dict[str, Array]
    residual: Float[Array, "*batch"]  # of the equations, in the solver's scale
