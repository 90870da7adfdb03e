r"""Composites: Young's modulus in bending of a soft rod with a stiffer core, and the core that gives a wanted one.

The core has the shape of the rod's section and $\beta$ times its size, all along. Rule "EJ" adds bending stiffnesses in
parallel, which is exact for sections that stay plane; rule "EJV" weighs each by its share of the volume too (Armanini
et al. 2022, eq. 9, as printed):

$$ E = E_b \beta^4 + E_s (1 - \beta^4), \qquad E = E_b \beta^6 + E_s (1 - \beta^4)(1 - \beta^2) $$
"""

import math
from typing import Literal, get_args

import numpy as np
from scipy.optimize import brentq

from nectosome.units import InputError, show_quantity

Rule = Literal["EJ", "EJV"]
RULES: tuple[Rule, ...] = get_args(Rule)


def young_of(ratio: float, core: float, shell: float, rule: Rule = "EJ") -> float:
    """Young's modulus [Pa] of a composite whose core has `ratio` times its radius; 0 is all shell, 1 all core.

    Raises InputError for a ratio outside of [0, 1] and for moduli that are not positive.
    """
    _check(core, shell)
    if not 0 <= ratio <= 1:
        raise InputError(f"{ratio:g} of the whole radius is out of range: it must be from 0 to 1.", field="ratio")
    b2 = ratio**2
    if rule == "EJ":
        return core * b2**2 + shell * (1 - b2**2)
    return core * b2**3 + shell * (1 - b2**2) * (1 - b2)


def ratio_of(young: float, core: float, shell: float, rule: Rule = "EJ") -> float:
    """Ratio of radii that gives a composite this Young's modulus [Pa]; the largest, where rule "EJV" has two.

    Raises InputError where no core of these materials gives it.
    """
    _check(core, shell)
    softest = 0.0 if rule == "EJ" else _softest_ratio(core, shell)
    low, high = sorted((young_of(softest, core, shell, rule), core))
    if not low <= young <= high or low == high:
        least, most, wanted = (show_quantity(x, "pressure") for x in (low, high, young))
        raise InputError(f"{wanted} is out of reach: these materials give {least} to {most}.", field="young")
    if rule == "EJ":
        return ((young - shell) / (core - shell)) ** 0.25
    # monotone from the softest ratio on
    found = brentq(lambda ratio: young_of(ratio, core, shell, rule) - young, softest, 1.0, xtol=1e-16)
    return float(np.asarray(found))


def _softest_ratio(core: float, shell: float) -> float:
    """Ratio at which "EJV" is softest: the root of its derivative in b = ratio^2, 3 (E_b + E_s) b^2 - 2 E_s b - E_s."""
    total = 3 * (core + shell)
    return math.sqrt(min(1.0, (shell + math.sqrt(shell**2 + total * shell)) / total))


def _check(core: float, shell: float) -> None:
    for name, value in (("core", core), ("shell", shell)):
        if not (math.isfinite(value) and value > 0):
            raise InputError(f"{value:g} Pa is out of range: it must be more than 0.", field=name)
