"""The robot that a fit found: values of its unknowns with their intervals, and how their errors go together."""

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from jaxtyping import Float

from nectosome.description import RobotDescription, numeric_paths, resolve, with_values
from nectosome.description.robot import Correlation
from nectosome.description.uncertainty import SIGMAS, law_of
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

    Values have a spread where data make both ends of their intervals, and pairs of these their correlations. A modulus
    and a loss of a soft material have what its law leaves out on top: in another motion they are others (`law_of`).
    """
    found = {v.name: float(x) for v, x in zip(variables, theta, strict=False)}
    told, shares = list[Correlation](), dict[int, float]()
    if known is not None:
        intervals = known.intervals()
        sure = [k for k, v in enumerate(variables) if intervals[k].below and intervals[k].above]
        for k in sure:
            name, half = variables[k].name, 0.5 * (intervals[k].high - intervals[k].low)
            wide = _with_law(found[name], half, law_of(description, resolve(description, name)[0]))
            shares[k] = half / wide if wide else 1.0
            found[name] = Uncertain(found[name], _allowed(description, name, found[name], wide))
        for i, k in combinations(sure, 2):
            between = variables[i].name, variables[k].name
            both = shares[i] * shares[k] * float(known.correlations[i, k])
            told.append(Correlation(between=between, value=round(both, 6)))
    robot = with_values(description, {path: x for name, x in found.items() for path in resolve(description, name)})
    fitted = {path for v in variables for path in resolve(description, v.name)}
    paths = (
        {path for name in pair.between for path in resolve(description, name)} for pair in description.correlations
    )
    kept = [pair for pair, own in zip(description.correlations, paths, strict=True) if not fitted & own]
    return robot.model_copy(update={"correlations": (*kept, *told)})


def _with_law(value: float, half: float, law: float) -> float:
    """Half of a 95 % interval with what a law leaves out, in quadrature."""
    if not law or value <= 0:
        return half
    return value * math.expm1(math.hypot(math.log1p(half / value), SIGMAS * law))


def _allowed(description: RobotDescription, name: str, value: float, spread: float) -> float:
    """A spread that does not lead out of the field's range, as a file must have it."""
    quantity = numeric_paths(description)[resolve(description, name)[0]]
    ends = [quantity.maximum] if quantity.scales(value) else [quantity.minimum, quantity.maximum]
    rooms = (abs(end - value) for end in ends if end is not None)
    return min([spread, *(room for room in rooms if room > 0)])
