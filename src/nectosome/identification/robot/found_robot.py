"""The robot that a fit found: values of its unknowns with their intervals, and how their errors go together."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from jaxtyping import Float

from nectosome.description import RobotDescription, numeric_paths, resolve, with_values
from nectosome.description.robot import Correlation
from nectosome.description.variables import Variable
from nectosome.io.schema.quantity import Uncertain

from ..fits.identifiability import Identifiability


def found_robot(
    description: RobotDescription,
    variables: Sequence[Variable],
    theta: Float[np.ndarray, "p"],
    known: Identifiability | None,
) -> RobotDescription:
    """Return the robot with the values that were found; `known` says how well, None where nothing does.

    Values have a spread where data make both ends of their intervals, and pairs of these their correlations.
    """
    found = {v.name: float(x) for v, x in zip(variables, theta, strict=False)}
    told = list[Correlation]()
    if known is not None:
        intervals = known.intervals()
        sure = [k for k, v in enumerate(variables) if intervals[k].below and intervals[k].above]
        for k in sure:
            name, half = variables[k].name, 0.5 * (intervals[k].high - intervals[k].low)
            found[name] = Uncertain(found[name], _allowed(description, name, found[name], half))
        for i, k in combinations(sure, 2):
            between = variables[i].name, variables[k].name
            told.append(Correlation(between=between, value=round(float(known.correlations[i, k]), 6)))
    robot = with_values(description, {path: x for name, x in found.items() for path in resolve(description, name)})
    fitted = {path for v in variables for path in resolve(description, v.name)}
    paths = (
        {path for name in pair.between for path in resolve(description, name)} for pair in description.correlations
    )
    kept = [pair for pair, own in zip(description.correlations, paths, strict=True) if not fitted & own]
    return robot.model_copy(update={"correlations": (*kept, *told)})


def _paths(description: RobotDescription, pair: Correlation) -> set[str]:
    return {path for name in pair.between for path in resolve(description, name)}


def _allowed(description: RobotDescription, name: str, value: float, spread: float) -> float:
    """A spread that does not lead out of the field's range, as a file must have it."""
    quantity = numeric_paths(description)[resolve(description, name)[0]]
    ends = [quantity.maximum] if quantity.scales(value) else [quantity.minimum, quantity.maximum]
    rooms = (abs(end - value) for end in ends if end is not None)
    return min([spread, *(room for room in rooms if room > 0)])
