"""The robot that a fit found: values of its unknowns with their intervals, and how their errors go together."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from jaxtyping import Float

from nectosome.description import RobotDescription, resolve, with_values
from nectosome.description.robot import Correlation
from nectosome.description.variables import Variable
from nectosome.io.schema.quantity import Uncertain

from ..fits.identifiability import Identifiability

_TOGETHER = 0.1  # correlation from which on a file has it


def found_robot(
    description: RobotDescription,
    variables: Sequence[Variable],
    theta: Float[np.ndarray, "p"],
    known: Identifiability | None,
) -> RobotDescription:
    """Return the robot with the values that were found; `known` says how well, None where nothing does.

    Values have a spread where data make both ends of their intervals, and pairs of these their correlations.
    """
    intervals = () if known is None else known.intervals()
    sure = [k for k, one in enumerate(intervals[: len(variables)]) if one.below and one.above]
    found = {v.name: float(x) for v, x in zip(variables, theta, strict=False)}
    found |= {variables[k].name: Uncertain(theta[k], 0.5 * (intervals[k].high - intervals[k].low)) for k in sure}
    robot = with_values(description, {path: x for name, x in found.items() for path in resolve(description, name)})
    if known is None:
        return robot
    pairs = [(i, k) for i, k in combinations(sure, 2) if abs(known.correlations[i, k]) > _TOGETHER]
    told = (((variables[i].name, variables[k].name), round(float(known.correlations[i, k]), 6)) for i, k in pairs)
    every = tuple(Correlation(between=between, value=value) for between, value in told)
    return robot.model_copy(update={"correlations": every})
