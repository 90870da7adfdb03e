"""First guesses of drag coefficients by form.

A first guess is no more than that, so it comes with a range: between laminar and turbulent friction, and between
fairings and plates for what sticks out of a hull. The coefficient of a body with round sides falls to a third where its
boundary layer turns turbulent. Measured motions refine it.
"""

from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.lib.stride_tricks import sliding_window_view

from nectosome.units import InputError

from .slices import slices_of
from .triangles import Triangles

_TURBULENT, _LAMINAR = 1e5, 3e6  # Reynolds numbers up to which flow is laminar, and may be: fins and holes disturb it
_FAIRED, _STUBBY, _PLATES = 0.1, 0.74, 1.17  # coefficients of what sticks out: faired struts, short cylinders, plates
_WINDOW = 13  # slices
_STICKS_OUT = 0.02, 0.5  # shares of the silhouette that are taken to stick out of the largest section


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


def streamlined(fineness: float, reynolds: float, turbulent: bool | None = None) -> FirstGuess:
    r"""First guess for a streamlined body along the flow, of its length over its diameter and the Reynolds number.

    $C_f (1 + 1.5 f^{-3/2} + 7 f^{-3})$ with the fineness f (Hoerner 1965, chapter 6), on the friction of a flat plate:
    laminar $1.328 / \sqrt{Re}$ up to 1e5, turbulent $0.455 / (\log_{10} Re)^{2.58}$ above, where `turbulent` does not
    say which. Smooth bodies in calm water stay laminar up to 5e5 and more. Raises InputError for a fineness below 2,
    where the flow leaves the body, and for a Reynolds number that is not above 0.
    """
    if not (fineness >= 2 and reynolds > 0):
        what = f"a fineness of {fineness:g} at a Reynolds number of {reynolds:g}"
        raise InputError(f"{what}: at least 2, and above 0, are needed for a streamlined body.")
    turbulent = reynolds >= _TURBULENT if turbulent is None else turbulent
    friction = 0.455 / np.log10(reynolds) ** 2.58 if turbulent else 1.328 / np.sqrt(reynolds)
    coefficient = float(friction * (1 + 1.5 * fineness**-1.5 + 7 * fineness**-3))
    return FirstGuess(coefficient, "wetted", "a streamlined body along the flow", "Hoerner 1965, chapter 6")


class GuessedArea(NamedTuple):
    """A first guess of a drag area along one axis."""

    drag_area: float  # coefficient times area [m2]
    guess: FirstGuess
    least: float  # [m2]
    largest: float  # [m2]
    sticks_out: float = 0.0  # area of the silhouette outside of the largest section, which is counted beside [m2]


_THIN = 0.2  # thickness over the smaller side, up to which a body across the flow is as a plate
_LONG = 2.0  # length along the flow over the diameter, from which on a body is long
_BLUNT, _ROUND = 0.08, 0.6  # volume that is missing at flat ends and at a round nose, up to which they are such ends
_SLENDER, _ENDLESS = 3.0, 14.0  # length across the flow over width of cylinders, up to a ball and up to a short one
_PLATE = 20.0  # the same of long plates
_FLAT_BODY = "a flat body"
_ROUND_SIDES = [FIRST_GUESSES[name] for name in ("sphere", "cylinder", "short_cylinder")]
_FULL = 0.9  # share of the prism along the flow that a body with flat sides fills


def guessed_drag_areas(
    extents: tuple[float, float, float],
    projected: tuple[float, float, float],
    wetted: float,
    volume: float,
    reynolds_per_length: float,
    sections: tuple[float, float, float] | None = None,
) -> tuple[GuessedArea, GuessedArea, GuessedArea]:
    """First guesses of the drag areas of a body along x, y and z, each by the form that it is most like.

    Of its extents [m], the areas of its silhouettes and of its surface [m2], its volume [m3] and its largest sections
    across each axis [m2], as large as the silhouettes where none are given. The form follows from their ratios, and
    nothing else is known of the body. Along the flow of a long one, what a silhouette has beyond the largest section
    sticks out: masts, fins. `reynolds_per_length` [1/m] is speed over kinematic viscosity.
    """
    guesses = []
    for k in range(3):
        least, most = _STICKS_OUT
        out = 0.0 if sections is None else projected[k] - sections[k]
        out = out if least * projected[k] < out < most * projected[k] else 0.0
        if extents[k] < _LONG * _diameter(projected[k] - out):
            out = 0.0  # such forms have all of the silhouette
        one = _form(k, extents, projected[k] - out, volume, reynolds_per_length)
        area = wetted if one.area == "wetted" else projected[k] - out
        low = high = one.coefficient
        if one.area == "wetted":
            reynolds, fineness = reynolds_per_length * extents[k], extents[k] / _diameter(projected[k] - out)
            low = min(low, streamlined(fineness, reynolds, reynolds > _LAMINAR).coefficient)
        elif one == FIRST_GUESSES["round_nose"]:
            high = FIRST_GUESSES["blunt"].coefficient
        elif one in _ROUND_SIDES or one.form.startswith(_FLAT_BODY):
            low /= 3
        drags = (c * area + d * out for c, d in ((one.coefficient, _STUBBY), (low, _FAIRED), (high, _PLATES)))
        drag_area, least, largest = drags
        guesses.append(GuessedArea(drag_area, one, least, largest, out))
    x, y, z = guesses
    return x, y, z


def largest_sections(surface: Triangles) -> tuple[float, float, float]:
    """Areas of the largest sections across x, y and z [m2] without masts and fins there.

    Of each 13 slices in a row, of 60, the median: what is shorter than 10 % of the extent is not in it. Where sections
    taper as a parabola does, the median of 25 is off by four times as much, and both give the section in the middle.
    A spheroid's is within 0.5 %, that of a double cone 14 % too small.
    """
    found = []
    for k in range(3):
        areas = _sliced(surface, k)[0]
        narrow, wide = (
            float(np.median(sliding_window_view(areas, width), axis=1).max()) for width in (_WINDOW, 2 * _WINDOW - 1)
        )
        found.append(min((4 * narrow - wide) / 3, float(areas.max())))
    x, y, z = found
    return x, y, z


def guessed_turning(surface: Triangles, coefficients: tuple[float, float, float]) -> tuple[float, float, float]:
    r"""First guess of c in the torque -c |w| w about x, y and z [kg m2], in water of 1000 kg/m3, by strips.

    About b, across the longest axis a, with the coefficient of c across the flow and the width w along b:
    $c_b = \rho/2\, C_c \int w\, |a|^3 da\, (1 - 4 r^2/L^2)$ with L the length and r the radius of a disc of the
    largest section: a ball has none. About a itself what reaches out of a disc of each section is a plate,
    $\rho/2\, 1.17 \int (h^4 - r^4)/2\, da$ with h half of the width along b, and along c. Our own choice.
    """
    sides = np.ptp(surface.bounds, axis=0)
    a = int(np.argmax(sides))
    b, c = (a + 1) % 3, (a + 2) % 3
    area, half, along, thick = _sliced(surface, a)
    radius = np.sqrt(area / np.pi)
    slender = max(1 - 4 * float(radius.max() / sides[a]) ** 2, 0.0)
    turning = np.zeros(3)
    for k, other, h in ((b, c, half[:, 0]), (c, b, half[:, 1])):
        turning[k] = 500 * coefficients[other] * slender * np.sum(2 * h * np.abs(along) ** 3) * thick
    beyond = np.maximum(half**4 - radius[:, None] ** 4, 0.0)
    turning[a] = (
        500 * _PLATES * np.sum(np.where(half > (1 + _STICKS_OUT[0]) * radius[:, None], beyond, 0.0)) / 2 * thick
    )
    x, y, z = map(float, turning)
    return x, y, z


def _sliced(
    surface: Triangles, axis: int
) -> tuple[Float[np.ndarray, "k"], Float[np.ndarray, "k 2"], Float[np.ndarray, "k"], float]:
    """Areas of slices across an axis, half widths along the next two axes, places from the centre, thickness."""
    turned = Triangles(np.roll(surface.vertices, -axis, axis=1), surface.faces)
    cut, solid = slices_of(turned), turned.solid
    low, high = turned.bounds[:, 0]
    n = cut.share.size
    middles = low + (high - low) * (np.arange(n) + 0.5) / n
    return cut.share * solid.size * n / (high - low), cut.half, middles - solid.centre[0], float(high - low) / n


def _diameter(area: float) -> float:
    return float(np.sqrt(4 * area / np.pi))


def _form(
    k: int, extents: tuple[float, float, float], silhouette: float, volume: float, reynolds_per_length: float
) -> FirstGuess:
    depth, (width, length) = extents[k], sorted(extents[:k] + extents[k + 1 :])
    diameter = _diameter(silhouette)
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
        f"{_FLAT_BODY}, {thickness:.2g} as deep as wide",
        f"evenly between {flat.form}, {flat.coefficient}, and {whole.form}, {whole.coefficient}, of {whole.source}",
    )
