"""Which parts are fins: higher than deep, so that their water is that of a plate and not of a slender body."""

from collections.abc import Mapping

from .loads import AddedMassLoad, TrailingEdgeLoad
from .parts import Limb, Rigid

_HIGH = 2.0  # height over depth, and over what carries it, from which on


def with_fins(parts: Mapping[str, Limb]) -> dict[str, Limb]:
    """Parts whose strips of added mass and trailing edges shall be those of a fin, where their file leaves it open.

    Decided once, by the numbers of the file: which equations a robot has does not change within a sweep.
    """
    changed = {}
    for name, part in parts.items():
        open_ = {
            key: load.model_copy(update={"fin": True})
            for key, load in part.loads.items()
            if isinstance(load, AddedMassLoad | TrailingEdgeLoad) and load.fin is None
        }
        if open_ and _stands_high(part, parts[part.on] if part.on in parts and part.on != name else None):
            changed[name] = part.model_copy(update={"loads": {**part.loads, **open_}})
    return changed


def _stands_high(part: Limb, carrier: Limb | None) -> bool:
    """Whether a box or a plate is much higher than deep, and than what carries it."""
    if not (isinstance(part, Rigid) and part.own_shape.section == "flat"):
        return False
    return _height(part) > _HIGH * (part.size("length") or 0.0) and _height(part) > _HIGH * _height(carrier)


def _height(part: Limb | None) -> float:
    """Largest size across a part, 0 without one [m]."""
    size = part.size if isinstance(part, Rigid) else lambda name: getattr(part, name, None)
    sizes = [size("width") or 0.0, size("height") or 0.0, getattr(part, "radius", None) or 0.0]
    return max(sizes[0], sizes[1], 2 * sizes[2])
