r"""A soft composite: a core of the same cone angle inside a shell, $\beta$ the ratio of their radii.

Rule "EJ" adds bending stiffnesses in parallel, $E_b \beta^4 + E_s (1 - \beta^4) = E$; rule "EJV" weighs each by its
share of the volume too, $E_b \beta^6 + E_s (1 - \beta^4)(1 - \beta^2) = E$ (Armanini et al., eq. 9, as printed).
"""

import math
from typing import Literal

Rule = Literal["EJ", "EJV"]


def young_of(ratio: float, core: float, shell: float, rule: Rule = "EJ") -> float:
    """Young's modulus [Pa] of a composite whose core has `ratio` times its radius; 0 is all shell, 1 all core.

    Raises ValueError for a ratio outside of [0, 1] and for moduli that are not positive.
    """
    _check(core, shell)
    if not 0 <= ratio <= 1:
        raise ValueError(f"composite: the core's radius is {ratio} of the whole; it must be from 0 to 1.")
    b2 = ratio**2
    if rule == "EJ":
        return core * b2**2 + shell * (1 - b2**2)
    return core * b2**3 + shell * (1 - b2**2) * (1 - b2)


def ratio_of(young: float, core: float, shell: float, rule: Rule = "EJ") -> float:
    """Ratio of radii that gives a composite this Young's modulus [Pa]; the largest, where rule "EJV" has two.

    Raises ValueError where no core of these materials gives it.
    """
    _check(core, shell)
    if rule == "EJ":
        low, high = sorted((core, shell))
        if not low <= young <= high or core == shell:
            raise ValueError(_out_of_reach(young, low, high))
        return ((young - shell) / (core - shell)) ** 0.25
    softest = _softest_ratio(core, shell)
    low = young_of(softest, core, shell, rule)
    if not low <= young <= core:
        raise ValueError(_out_of_reach(young, low, core))
    a, b = softest, 1.0
    while b - a > 4e-16 * b:  # monotone between the softest ratio and 1
        middle = 0.5 * (a + b)
        if middle in (a, b):
            break
        a, b = (middle, b) if young_of(middle, core, shell, rule) < young else (a, middle)
    return b


def _softest_ratio(core: float, shell: float) -> float:
    """Ratio at which "EJV" is softest: the root of its derivative in b = ratio^2, 3 (E_b + E_s) b^2 - 2 E_s b - E_s."""
    total = 3 * (core + shell)
    return math.sqrt(min(1.0, (shell + math.sqrt(shell**2 + total * shell)) / total))


def _check(core: float, shell: float) -> None:
    for name, value in (("core", core), ("shell", shell)):
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"composite: Young's modulus of the {name} is {value} Pa; it must be more than 0.")


def _out_of_reach(young: float, low: float, high: float) -> str:
    return f"composite: {young:.4g} Pa is out of reach: these materials give {low:.4g} to {high:.4g} Pa."
