"""Water that a file leaves in no load: between flat rods side by side, and inside of a ring of limbs that closes."""

import math
from collections.abc import Iterator

from nectosome.description.cranks import JetLoad
from nectosome.description.loads import BellJetLoad
from nectosome.description.parts import Limb, Rod
from nectosome.description.robot import RobotDescription

_FEW = 3  # rods side by side
_FLAT = 2.0  # width over height of a flap
_NEAR = 1.0  # gap between neighbours over their width, up to which a skin may be meant


def water_left_out(description: RobotDescription) -> Iterator[tuple[str, str]]:
    """Yield paths with a sentence: flat rods side by side without a web, and webs in rings without a jet."""
    yield from _flaps(description)
    jets = any(isinstance(load, JetLoad) for part in description.parts.values() for load in part.loads.values())
    for name, web in description.webs.items():
        if web.closed and not jets and not any(isinstance(load, BellJetLoad) for load in web.loads.values()):
            words = "the water that this ring drives out as it closes is in no load: its speed lacks that jet"
            yield f"webs.{name}", f"{words}. Give the web the load bell_jet."


def _flaps(description: RobotDescription) -> Iterator[tuple[str, str]]:
    joined = {limb for web in description.webs.values() for limb in web.between}
    groups = dict[str, list[str]]()
    for name, part in description.limbs.items():
        if isinstance(part, Rod) and name not in joined and _wide(part) >= _FLAT * _thin(part):
            groups.setdefault(f"{part.on} {_alike(part)}", []).append(name)
    for names in groups.values():
        first = description.limbs[names[0]]
        assert isinstance(first, Rod)
        places = [description.limbs[name].offset for name in names]
        gap = max(min(math.dist(a, b) for b in places if b is not a) for a in places) if len(places) >= _FEW else 0.0
        if len(places) >= _FEW and 0 < gap <= (1 + _NEAR) * _wide(first):
            words = f"{len(names)} flat rods stand side by side, and the water between them is in no load"
            yield description.place_of(names[0]), f"{words}. If a skin joins them, describe it under webs."


def _alike(part: Limb) -> str:
    return part.model_dump_json(include={"length", "width", "height", "tip_width", "tip_height", "young", "points"})


def _wide(part: Rod) -> float:
    return max(part.width or 0.0, part.height or 0.0)


def _thin(part: Rod) -> float:
    return min(part.width or math.inf, part.height or math.inf)
