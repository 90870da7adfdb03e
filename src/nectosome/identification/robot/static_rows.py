"""Shapes at rest that there are not, or that do not last, in words: rows of readings, and where a motion starts."""

import numpy as np
from jaxtyping import Float

from nectosome.core import Status
from nectosome.description import with_values
from nectosome.solve import static
from nectosome.units import InputError

from .misfit import RobotMisfit

_NAMED = 3  # rows in a sentence


def lost_row(problem: RobotMisfit, theta: Float[np.ndarray, "p"]) -> InputError | None:
    """The first row or start without an equilibrium, and why there is none; None where all have one."""
    for i, trial in enumerate(problem.trials):
        if trial.released:
            before = static(with_values(trial.description, problem.values_of(i, theta) | trial.held))
            if int(before.status) == int(Status.NO_EQUILIBRIUM):
                return InputError(f"before its start, with {problem.box.text(theta)}: {before.why}", file=trial.file)
        if trial.rows is None:
            continue
        lost = np.flatnonzero(problem.at_rest(i, theta).status[: trial.time.size] != int(Status.SOLVED))
        if lost.size:
            k = int(lost[0])
            values = dict(zip(trial.rows.paths, trial.rows.values[k].tolist(), strict=True))
            described = with_values(trial.description, problem.values_of(i, theta) | values)
            here = f"row {k + 1}, with {problem.box.text(theta)}: {static(described).why}"
            return InputError(here, file=trial.file)
    return None


def unstable_rows(problem: RobotMisfit, theta: Float[np.ndarray, "p"]) -> list[str]:
    """A sentence for each recording with rows whose equilibrium does not last."""
    out = []
    for i, trial in enumerate(problem.trials):
        if trial.rows is None:
            continue
        each = problem.at_rest(i, theta).stability
        found = np.flatnonzero([not one.stable for one in each]) + 1
        if found.size:
            more = f" and {found.size - _NAMED} more" if found.size > _NAMED else ""
            named = f"row{'s' if found.size > 1 else ''} {', '.join(map(str, found[:_NAMED]))}{more}"
            out.append(
                f"{named} of {trial.name}: the equilibrium that was compared is unstable ({each[found[0] - 1]}), "
                "the robot would leave it. "
                "Begin nearer to the shape that was measured, as with the start of a joint"
            )
    return out
