"""Values that no material and no water has, most often by a wrong unit, and a load that is most often forgotten."""

from collections.abc import Iterator
from typing import NamedTuple

from nectosome.description.joints import Flexure
from nectosome.description.loads import (
    AddedMassLoad,
    CylinderAddedMassLoad,
    DragLoad,
    LegLoad,
    PlateDragLoad,
    TrailingEdgeLoad,
)
from nectosome.description.pairs import ContactPair
from nectosome.description.parts import Rigid, Rod
from nectosome.description.robot import RobotDescription, WaterDescription
from nectosome.description.rod_loads import MuscleLoad
from nectosome.io.schema.structure import numeric_paths, value_at
from nectosome.units import format_quantity


class Known(NamedTuple):
    """The range of a field of some classes [SI], and what lies at its ends."""

    owners: tuple[type, ...]
    field: str
    low: float
    high: float
    what: str


_KNOWN = (
    # sea water 1020 to 1030 kg/m3 (TEOS-10), the Dead Sea 1240 kg/m3
    Known((WaterDescription,), "density", 950.0, 1300.0, "water, fresh to saturated with salt"),
    # 1.6 m/s2 on the Moon, 24.8 m/s2 on Jupiter (NASA planetary fact sheets); 0 leaves weight and buoyancy out
    Known((WaterDescription,), "gravity", 0.0, 25.0, "planets"),
    # tidal currents reach 11 m/s at Saltstraumen
    Known((WaterDescription,), "current", -12.0, 12.0, "the strongest tidal currents"),
    # polymer foams from 10 kg/m3 (Gibson and Ashby 1997), osmium 22590 kg/m3
    Known((Rigid, Rod), "density", 10.0, 23e3, "materials, foam to osmium"),
    # hydrogels from 0.1 kPa (Ashby 2011), tungsten 411 GPa; rubbers 0.5 to 100 MPa
    Known((Rod, Flexure), "young", 100.0, 420e9, "materials, gels to tungsten"),
    # silicones have 10 to 1e5 Pa s
    Known((Rod,), "damping", 0.0, 1e7, "soft materials"),
    # cylinders and plates across a stream have 0.6 to 2 (Hoerner 1965, ch. 3); in oscillating flow up to about 5
    Known((DragLoad, PlateDragLoad), "normal", 0.0, 6.0, "cylinders and plates"),
    # skin friction coefficients are at most some hundredths (Hoerner 1965, ch. 2)
    Known((DragLoad,), "tangential", 0.0, 1.0, "slender bodies"),
    # 1 of a slender body, 2.23 of a cube by its volume (Newman 1977)
    Known((AddedMassLoad,), "normal", 0.0, 5.0, "bodies in unbounded water"),
    Known((CylinderAddedMassLoad,), "coefficient", 0.0, 5.0, "bodies in unbounded water"),
    # rubber on dry concrete reaches about 1.2
    Known((LegLoad, ContactPair), "static_friction", 0.0, 3.0, "dry friction"),
    Known((LegLoad, ContactPair), "dynamic_friction", 0.0, 3.0, "dry friction"),
    # the largest animals have 30 m, flagella of bacteria some micrometres
    Known((Rigid, Rod), "length", 1e-6, 100.0, "swimmers, bacteria to whales"),
    Known((Rigid, Rod), "radius", 1e-8, 20.0, "swimmers, bacteria to whales"),
)


def implausible(description: RobotDescription) -> Iterator[tuple[str, str]]:
    """Yield paths with a sentence: values that materials and water do not have, a swimmer that sheds no wake."""
    yield from _without_wake(description)
    for path, quantity in numeric_paths(description).items():
        value = value_at(description, path)
        owner, _, field = path.rpartition(".")
        if field.isdigit():
            owner, _, field = owner.rpartition(".")
        group = value_at(description, owner) if owner else description
        for known in _KNOWN:
            if field == known.field and isinstance(group, known.owners) and not known.low <= value <= known.high:
                shown, low, high = (format_quantity(x, quantity.dimension) for x in (value, known.low, known.high))
                yield path, f"{shown} is far outside of {known.what} ({low} to {high}). Check the value and its unit."


def _without_wake(description: RobotDescription) -> Iterator[tuple[str, str]]:
    """A body that bends itself from head to tail, with strips of added mass that no trailing edge leaves behind."""
    body = description.body
    if isinstance(body, Rod):
        kinds = {type(load) for load in body.loads.values()}
        bends = MuscleLoad in kinds or any(value is not None for _, value in body.motion)
        if bends and AddedMassLoad in kinds and TrailingEdgeLoad not in kinds:
            words = "it bends itself and has added mass, but no trailing_edge: it will hardly get thrust from the water"
            yield "body.loads", f"{words} that its tail leaves behind."
