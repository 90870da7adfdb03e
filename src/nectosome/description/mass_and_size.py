"""Moments of inertia and centres of mass that no matter inside of a rigid part can have, most often by a wrong unit."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from nectosome.description.cranks import LegLoad
from nectosome.description.meshes import MeshShape
from nectosome.description.orientation import from_rpy
from nectosome.description.parts import Rigid
from nectosome.description.plates import PlateShape
from nectosome.description.robot import RobotDescription
from nectosome.units import show_quantity

if TYPE_CHECKING:
    import numpy as np
    from jaxtyping import Float

_LEAST = 0.02  # radius of gyration over half the diagonal: an even box has 0.58, a unit of 1/1000 too small below 0.02
_WITH_LEGS = 2.0  # times that box: legs of a point are loads, which have no size here
_ROUNDED = 0.02  # of all second moments, by which one may be more: moments are given with two or three digits
_UNSIZED = 10.0  # extents of a robot, for points to which nothing is fixed that has a size
_UNITS = {"g m2": 1e-3, "kg cm2": 1e-4, "kg mm2": 1e-6, "g cm2": 1e-7, "g mm2": 1e-9}  # of CAD programs [kg m2]


class _Placed(NamedTuple):
    """A part in the frame of the one that it is fixed to; or, without a part, the joint of one that moves there."""

    name: str
    part: Rigid | None
    rotation: "Float[np.ndarray, '3 3']"
    place: "Float[np.ndarray, '3']"  # [m]


def not_inside(description: RobotDescription) -> Iterator[tuple[str, str]]:
    r"""Yield paths with a sentence for moments and centres of mass that do not fit the mass and the size of a part.

    Of matter in a box of diagonal $2R$ the radius of gyration about the centre of mass, $\sqrt{\sum_i I_i / 2m}$, is at
    most $R$ (Popoviciu), and the centre of mass is at most $R$ from that of the box. Along each axis, of the part or a
    principal one, $\sum_k I_k / 2m - I_i / m$, the mean square distance from the centre of mass, is at most the product
    of its distances from both ends of the box (Bhatia and Davis 2000): moments of exchanged axes have more. The box is
    that around a part, all that is fixed to it, and the joints of what moves against it. Points without any size are
    held against the robot, those with legs against twice their box.
    """
    import numpy as np

    for name, part in description.parts.items():
        if not isinstance(part, Rigid) or _is_fixed(description, name):
            continue
        whole = list(_fixed_to(description, name, np.eye(3), np.zeros(3)))
        corners = np.concatenate([one.place + _corners(one.part) @ one.rotation.T for one in whole])
        middle, box = 0.5 * (corners.min(axis=0) + corners.max(axis=0)), np.ptp(corners, axis=0)
        legs = any(isinstance(load, LegLoad) for load in part.loads.values())
        reach = 0.5 * float(np.linalg.norm(box)) * (_WITH_LEGS if legs else 1.0)
        sized = any(one.part is not None and one.part.form != "point" for one in whole)
        if not sized:
            box, reach = np.zeros(3), _UNSIZED * _extent(description)
        boxed = sized and not legs and not any(one.part is not None and one.part.bend for one in whole)
        heavy = [(one, one.part) for one in whole if one.part is not None and one.part.mass != 0]
        for one, of in heavy if reach > 0 else ():
            at = one.place + one.rotation @ (_middle(of) + of.centre_of_mass)
            own = np.ptp(_corners(of), axis=0) if of.form != "point" else box if len(heavy) == 1 else np.zeros(3)
            around = (corners - at) @ one.rotation if boxed else None
            off = float(np.linalg.norm(at - middle))
            yield from _judged(description.place_of(one.name), of, off, own, reach, around)


def _judged(
    place: str,
    part: Rigid,
    off: float,
    sides: "Float[np.ndarray, '3']",
    reach: float,
    around: "Float[np.ndarray, 'n 3'] | None",
) -> Iterator[tuple[str, str]]:
    """The sentences of one part of these sides, whose centre of mass is `off` from the middle, by what is possible.

    `around` are the corners of its box from the centre of mass, along the axes of the part; None of one without a box.
    """
    import numpy as np

    most, check = f"at most {show_quantity(reach, 'length')} is possible", "Check the values and their unit."
    if off > reach * (1 + 1e-9):
        words = f"it is {show_quantity(off, 'length')} away from the middle of the part, where by its size {most}."
        yield f"{place}.centre_of_mass", f"{words} {check}"
    if part.inertia is None or not any(part.inertia):
        return
    mass = part.mass if part.mass is not None else (part.density or 0.0) * float(np.prod(sides))  # the most it has
    radius, least = math.sqrt(sum(part.inertia) / (2 * mass)), _LEAST * 0.5 * float(np.linalg.norm(sides))
    even = _even(mass / 12 * (sides @ sides - sides**2), part.inertia) if least else ""
    if not least <= radius <= reach * (1 + 1e-9):
        words = (
            f"with {show_quantity(mass, 'mass')} they have a radius of gyration of {show_quantity(radius, 'length')}"
        )
        limit = most if radius > reach else f"at least {show_quantity(least, 'length')} is likely"
        yield f"{place}.inertia", f"{words}, where by the size of the part {limit}. {even}{check}"
    elif around is not None and (words := _beyond(part, mass, around)):
        yield f"{place}.inertia", f"with {show_quantity(mass, 'mass')} {words} {even}{check}"


def _beyond(part: Rigid, mass: float, around: "Float[np.ndarray, 'n 3']") -> str:
    """What moments say of the matter along the axis, of the part or a principal one, along which it is farthest out."""
    import numpy as np

    assert part.inertia is not None
    (a, b, c), (xy, xz, yz) = part.inertia, part.products or (0.0, 0.0, 0.0)
    inertia = np.array([[a, xy, xz], [xy, b, yz], [xz, yz, c]])
    axes = np.concatenate([np.eye(3), np.linalg.eigh(inertia)[1]], axis=1)
    square = (0.5 * np.trace(inertia) - np.sum(axes * (inertia @ axes), axis=0)) / mass  # mean of distances squared
    low, high = -(around @ axes).min(axis=0), (around @ axes).max(axis=0)
    inside = (low > 0) & (high > 0)  # else the centre of mass is outside
    most = np.where(inside, low * high, (0.5 * (low + high)) ** 2)
    k = int(np.argmax(square - most))
    if square[k] - most[k] <= _ROUNDED * 0.5 * np.trace(inertia) / mass:
        return ""
    shown = "xyz"[k] if k < 3 else f"({', '.join(f'{x:.2f}' for x in axes[:, k])})"
    is_at, may = (show_quantity(math.sqrt(x), "length") for x in (square[k], most[k]))
    return (
        f"their matter is {is_at} away from the centre of mass along {shown} (root mean square), where by the size of "
        f"the part at most {may} is possible. They are about the centre of mass, along the axes of the part."
    )


def _even(moments: "Float[np.ndarray, '3']", given: tuple[float, ...]) -> str:
    """The moments of an even box, and the unit in which those given would be like them."""
    shown = ", ".join(f"{moment:.2g}" for moment in moments)
    ratio = {unit: float(moments.sum()) / (sum(given) * size) for unit, size in _UNITS.items()}
    near = min(ratio, key=lambda unit: abs(math.log(ratio[unit])))
    as_unit = f"; those given would be like them in {near}" if 0.3 < ratio[near] < 3 else ""
    return f"An even box of its size has {shown} kg m2{as_unit}. "


def _is_fixed(description: RobotDescription, name: str) -> bool:
    """Whether a part is one with a rigid part that it sits on."""
    part = description.parts[name]
    below = description.parts.get(part.on) if name in description.limbs else None
    return part.joint.kind == "fixed" and isinstance(part, Rigid) and isinstance(below, Rigid)


def _fixed_to(
    description: RobotDescription, name: str, rotation: "np.ndarray", place: "np.ndarray"
) -> Iterator[_Placed]:
    """Yield a rigid part and all that is fixed to it, and the places of other parts on these."""
    import numpy as np

    part = description.parts[name]
    if not isinstance(part, Rigid):
        return
    yield _Placed(name, part, rotation, place)
    for child, limb in description.limbs.items():
        if limb.on != name:
            continue
        there = place + rotation @ (limb.offset + (_tip(part) if limb.at == "tip" else np.zeros(3)))
        if _is_fixed(description, child):
            yield from _fixed_to(description, child, rotation @ np.array(from_rpy(limb.rotation)), there)
        else:
            yield _Placed(child, None, rotation, there)


def _corners(part: Rigid | None) -> "Float[np.ndarray, 'n 3']":
    """Corners of the box around a part, as if it were straight, in its frame [m]; of a point or a joint itself."""
    import numpy as np

    if part is None:
        return np.zeros((1, 3))
    shape, radius = part.own_shape, part.radius or 0.0
    if isinstance(shape, MeshShape):
        ends = zip(shape.numbers.low, shape.numbers.high, strict=True)
    elif isinstance(shape, PlateShape):
        x, y = np.transpose([np.min(shape.outline, axis=0), np.max(shape.outline, axis=0)])
        thick = np.array([-0.5, 0.5]) * shape.thickness
        ends = (x, y, thick) if shape.plane == "xy" else (x, thick, y)
    else:
        half = [0.5 * part.width if part.width else radius, 0.5 * part.height if part.height else radius]
        ends = ((0.0, part.length or 0.0), *((-x, x) for x in half))
    return np.stack(np.meshgrid(*ends), axis=-1).reshape(-1, 3)


def _middle(part: Rigid) -> "Float[np.ndarray, '3']":
    """The centre of the shape, from which that of mass is counted [m]; about so for shapes with a thicker end."""
    import numpy as np

    return np.array(part.shape.numbers.centre) if isinstance(part.shape, MeshShape) else _corners(part).mean(axis=0)


def _tip(part: Rigid) -> "Float[np.ndarray, '3']":
    """The end along x, if it is straight [m]; a mesh has its own frame there."""
    import numpy as np

    end = 0.0 if isinstance(part.shape, MeshShape) else float(_corners(part)[:, 0].max())
    return np.array([end, 0.0, 0.0])


def _extent(description: RobotDescription) -> float:
    """The most that a robot can reach from any of its places [m]."""
    parts = description.parts.items()
    sizes = [math.hypot(*_span(part)) if isinstance(part, Rigid) else part.length for _, part in parts]
    return sum(sizes) + sum(math.hypot(*part.offset) for name, part in parts if name in description.limbs)


def _span(part: Rigid) -> tuple[float, ...]:
    corners = _corners(part)
    return tuple(corners.max(axis=0) - corners.min(axis=0))
