"""Moments of inertia and centres of mass that no matter inside of a rigid part can have, most often by a wrong unit."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from nectosome.description.meshes import MeshShape
from nectosome.description.orientation import from_rpy
from nectosome.description.parts import Rigid, Rod
from nectosome.description.plates import PlateShape
from nectosome.description.robot import RobotDescription
from nectosome.units import show_quantity

if TYPE_CHECKING:
    import numpy as np
    from jaxtyping import Float

_LEAST = 0.02  # radius of gyration over half the diagonal: an even box has 0.58, a unit of 1/1000 too small below 0.02
_OF_POINTS = 2.0  # times that box: what is fixed to a point need not be all of it, as legs that are loads
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
    most $R$ (Popoviciu), and the centre of mass is at most $R$ from that of the box. The box is that around a part, all
    that is fixed to it, and the joints of what moves against it. Points without any size are held against the robot.
    """
    import numpy as np

    for name, part in description.parts.items():
        if not isinstance(part, Rigid) or _is_fixed(description, name):
            continue
        whole = list(_fixed_to(description, name, np.eye(3), np.zeros(3)))
        corners = np.concatenate([one.place + _corners(one.part) @ one.rotation.T for one in whole])
        middle, box = 0.5 * (corners.min(axis=0) + corners.max(axis=0)), np.ptp(corners, axis=0)
        reach = 0.5 * float(np.linalg.norm(box)) * (_OF_POINTS if part.form == "point" else 1.0)
        if all(one.part is None or one.part.form == "point" for one in whole):
            box, reach = np.zeros(3), _UNSIZED * _extent(description)
        heavy = [(one, one.part) for one in whole if one.part is not None and one.part.mass != 0]
        for one, of in heavy if reach > 0 else ():
            off = one.place + one.rotation @ (_middle(of) + of.centre_of_mass) - middle
            own = np.ptp(_corners(of), axis=0) if of.form != "point" else box if len(heavy) == 1 else np.zeros(3)
            yield from _judged(description.place_of(one.name), of, float(np.linalg.norm(off)), own, reach)


def _judged(
    place: str, part: Rigid, off: float, sides: "Float[np.ndarray, '3']", reach: float
) -> Iterator[tuple[str, str]]:
    """The sentences of one part of these sides, whose centre of mass is `off` from the middle, by what is possible."""
    import numpy as np

    most, check = f"at most {show_quantity(reach, 'length')} is possible", "Check the values and their unit."
    if off > reach * (1 + 1e-9):
        words = f"it is {show_quantity(off, 'length')} away from the middle of the part, where by its size {most}."
        yield f"{place}.centre_of_mass", f"{words} {check}"
    if part.inertia is None or not any(part.inertia):
        return
    mass = part.mass if part.mass is not None else (part.density or 0.0) * float(np.prod(sides))  # the most it has
    radius, least = math.sqrt(sum(part.inertia) / (2 * mass)), _LEAST * 0.5 * float(np.linalg.norm(sides))
    if not least <= radius <= reach * (1 + 1e-9):
        words = (
            f"with {show_quantity(mass, 'mass')} they have a radius of gyration of {show_quantity(radius, 'length')}"
        )
        limit = most if radius > reach else f"at least {show_quantity(least, 'length')} is likely"
        even = _even(mass / 12 * (sides @ sides - sides**2), part.inertia) if least else ""
        yield f"{place}.inertia", f"{words}, where by the size of the part {limit}. {even}{check}"


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
    sizes = [part.length if isinstance(part, Rod) else math.hypot(*_span(part)) for _, part in parts]
    return sum(sizes) + sum(math.hypot(*part.offset) for name, part in parts if name in description.limbs)


def _span(part: Rigid) -> tuple[float, ...]:
    corners = _corners(part)
    return tuple(corners.max(axis=0) - corners.min(axis=0))
