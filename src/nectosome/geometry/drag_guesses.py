"""First guesses of drag coefficients by form.

A first guess is no more than that: what a hull's fins, holes and edges do is in none of these numbers, and the
coefficient of a body with round sides falls to a third where its boundary layer turns turbulent. Measured motions
refine it.
"""

from typing import Literal, NamedTuple

import numpy as np

from nectosome.units import InputError

_TRANSITION = 5e5  # Reynolds number


class FirstGuess(NamedTuple):
    """Drag coefficient of a form, D = coefficient * density / 2 * speed^2 * area."""

    coefficient: float
    area: Literal["projected", "wetted"]  # that it goes with
    form: str
    source: str


# at Reynolds numbers of 1e4 to 2e5
_CHAPTER_3 = "Hoerner 1965, Fluid-Dynamic Drag, chapter 3"
FIRST_GUESSES = {
    name: FirstGuess(coefficient, "projected", form, _CHAPTER_3)
    for name, coefficient, form in (
        ("sphere", 0.47, "a ball"),
        ("cube", 1.05, "a cube, one of its sides to the flow"),
        ("disc", 1.17, "a thin disc or square plate across the flow"),
        ("plate", 1.98, "a thin plate across the flow, over twenty times as long as wide"),
        ("cylinder", 1.17, "a cylinder across the flow, over forty times as long as wide"),
        ("short_cylinder", 0.74, "a cylinder across the flow, five times as long as wide"),
        ("blunt", 0.82, "a cylinder along the flow with flat ends, over twice as long as wide"),
        ("round_nose", 0.2, "a cylinder along the flow with a round nose and a flat tail"),
    )
}


def streamlined(fineness: float, reynolds: float) -> FirstGuess:
    r"""First guess for a streamlined body along the flow, of its length over its diameter and the Reynolds number.

    $C_f (1 + 1.5 f^{-3/2} + 7 f^{-3})$ with the fineness f (Hoerner 1965, chapter 6), on the friction of a flat plate:
    laminar $1.328 / \sqrt{Re}$ up to 5e5, turbulent $0.455 / (\log_{10} Re)^{2.58}$ above. Raises InputError for a
    fineness below 2, where the flow leaves the body, and for a Reynolds number that is not above 0.
    """
    if not (fineness >= 2 and reynolds > 0):
        what = f"a fineness of {fineness:g} at a Reynolds number of {reynolds:g}"
        raise InputError(f"{what}: at least 2, and above 0, are needed for a streamlined body.")
    friction = 1.328 / np.sqrt(reynolds) if reynolds < _TRANSITION else 0.455 / np.log10(reynolds) ** 2.58
    coefficient = float(friction * (1 + 1.5 * fineness**-1.5 + 7 * fineness**-3))
    return FirstGuess(coefficient, "wetted", "a streamlined body along the flow", "Hoerner 1965, chapter 6")


class GuessedArea(NamedTuple):
    """A first guess of a drag area along one axis."""

    drag_area: float  # coefficient times area [m2]
    guess: FirstGuess


_THIN = 0.2  # thickness over the smaller side, up to which a body across the flow is as a plate
_LONG = 2.0  # length along the flow over the diameter, from which on a body is long
_BLUNT, _ROUND = 0.08, 0.6  # volume that is missing at flat ends and at a round nose, up to which they are such ends
_SLENDER, _ENDLESS = 3.0, 14.0  # length across the flow over width of cylinders, up to a ball and up to a short one
_PLATE = 20.0  # the same of long plates
_FULL = 0.9  # share of the prism along the flow that a body with flat sides fills


def guessed_drag_areas(
    extents: tuple[float, float, float],
    projected: tuple[float, float, float],
    wetted: float,
    volume: float,
    reynolds_per_length: float,
) -> tuple[GuessedArea, GuessedArea, GuessedArea]:
    """First guesses of the drag areas of a body along x, y and z, each by the form that it is most like.

    Of its extents [m], the areas of its silhouettes and of its surface [m2] and its volume [m3]. The form follows from
    their ratios, and nothing else is known of the body. `reynolds_per_length` [1/m] is speed over kinematic viscosity.
    """
    guesses = []
    for k in range(3):
        one = _form(k, extents, projected[k], volume, reynolds_per_length)
        guesses.append(GuessedArea(one.coefficient * (wetted if one.area == "wetted" else projected[k]), one))
    x, y, z = guesses
    return x, y, z


def _form(
    k: int, extents: tuple[float, float, float], silhouette: float, volume: float, reynolds_per_length: float
) -> FirstGuess:
    depth, (width, length) = extents[k], sorted(extents[:k] + extents[k + 1 :])
    diameter = np.sqrt(4 * silhouette / np.pi)
    flat = FIRST_GUESSES["plate" if length > _PLATE * width else "disc"]
    if depth < _THIN * width:
        return flat
    if depth >= _LONG * diameter:
        missing = (silhouette * depth - volume) / (silhouette * diameter)
        if missing >= _ROUND:
            return streamlined(depth / diameter, reynolds_per_length * depth)
        return FIRST_GUESSES["blunt" if missing < _BLUNT else "round_nose"]
    if volume > _FULL * silhouette * depth:
        return FIRST_GUESSES["cube"]
    if length < _SLENDER * width:
        return _between(flat, FIRST_GUESSES["sphere"], depth / width)
    return _between(flat, FIRST_GUESSES["cylinder" if length > _ENDLESS * width else "short_cylinder"], depth / width)


def _between(flat: FirstGuess, whole: FirstGuess, thickness: float) -> FirstGuess:
    """Evenly between a plate and a body as deep as wide, by the depth over the width: our own choice, not measured."""
    if thickness >= 1:
        return whole
    part = (thickness - _THIN) / (1 - _THIN)
    return FirstGuess(
        float(flat.coefficient + part * (whole.coefficient - flat.coefficient)),
        "projected",
        f"a flat body, {thickness:.2g} as deep as wide",
        f"evenly between {flat.form}, {flat.coefficient}, and {whole.form}, {whole.coefficient}, of {whole.source}",
    )
