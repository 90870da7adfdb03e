"""Result of a solver: value, named status, statistics, residual."""

from enum import IntEnum
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float, Int


class Status(IntEnum):
    """Why a solver stopped."""

    SOLVED = 0
    EVENT = 1
    STEP_LIMIT = 2
    STEP_TOO_SMALL = 3
    NOT_FINITE = 4
    NO_EQUILIBRIUM = 5
    CANCELLED = 6
    UNSTABLE = 7
    UNSTEADY_DRIVES = 8
    NO_PERIOD = 9
    OTHER_PERIOD = 10
    SETTLED = 11

    @property
    def reason(self) -> str:
        """The status in words."""
        return _REASONS[self]


_REASONS = {
    Status.SOLVED: "solved",
    Status.EVENT: "stopped at the event",
    Status.STEP_LIMIT: "failed: more time steps than allowed",
    Status.STEP_TOO_SMALL: "failed: the time step became too small",
    Status.NOT_FINITE: "failed: the state is NaN or infinite",
    Status.NO_EQUILIBRIUM: "no equilibrium found",
    Status.CANCELLED: "cancelled",
    Status.UNSTABLE: "found, but unstable: small disturbances grow",
    Status.UNSTEADY_DRIVES: "drives or loads change with time: there is no steady motion",
    Status.NO_PERIOD: "no periodic motion found",
    Status.OTHER_PERIOD: "drives or loads do not have this period",
    Status.SETTLED: "periodic motion, found by free motion: Newton's method did not converge",
}


class Solution(eqx.Module):
    """Value, status, statistics and residual of a solve; a pytree that passes through jit, vmap and grad."""

    value: Any
    status: Int[Array, "*batch"]  # a Status
    stats: dict[str, Array]
    residual: Float[Array, "*batch"]  # of the equations, in the solver's scale
