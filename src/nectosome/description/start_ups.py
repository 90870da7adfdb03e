"""Which plates have a start-up: those of paddles, blades, bars and fins, but not those along undulating bodies."""

from collections.abc import Mapping

from .parts import Limb, Rod
from .plate_drag import PlateDragLoad, StartUp

THICK = 0.5  # thickness over height of a bar whose edges no longer shed vortices as those of a plate: chosen
_HINGES = ("revolute", "spherical")
CHAIN = 3  # hinges in a row along which waves of bending can run


def with_start_ups(parts: Mapping[str, Limb]) -> dict[str, Limb]:
    """Parts whose plates shall have a start-up or not, where their file leaves it open.

    Decided once, by the hinges and numbers of the file: which equations a robot has does not change within a sweep.
    """
    changed = dict[str, Limb]()
    for (name, key), why in start_up_choices(parts).items():
        part = changed.get(name, parts[name])
        load = part.loads[key]
        fields = {**dict(load), "start_up": None if why else StartUp()}
        decided = PlateDragLoad.model_construct(load.model_fields_set, **fields)  # it stays known as left open
        changed[name] = part.model_copy(update={"loads": {**part.loads, key: decided}})
    return changed


def start_up_choices(parts: Mapping[str, Limb]) -> dict[tuple[str, str], str]:
    """Why plates are steady in few words, empty for those with a start-up, by part and load; of files that leave it
    open and give no amplitude."""
    hinges = _hinges_in_a_row(parts)
    return {
        (name, key): _why_steady(part, hinges[name])
        for name, part in parts.items()
        for key, load in part.loads.items()
        if isinstance(load, PlateDragLoad) and load.amplitude is None and "start_up" not in load.model_fields_set
    }


def thickness(part: Limb) -> float:
    """Thickness over height of a part's larger side: 1 of a round one."""
    width, height = (part.width, part.height) if isinstance(part, Rod) else (part.size("width"), part.size("height"))
    thin, high = sorted([width or 1.0, height or 1.0])
    return thin / high


def _why_steady(part: Limb, hinges: int) -> str:
    if isinstance(part, Rod):
        return "a rod"
    if hinges >= CHAIN:
        return f"{CHAIN} hinges or more, or a rod"
    return "a thick bar" if thickness(part) > THICK else ""


def _hinges_in_a_row(parts: Mapping[str, Limb]) -> dict[str, int]:
    """Most hinges on a way through each part, from what all else hangs on to an end; a rod is as good as a chain."""
    most = dict[str, int]()
    for name, part in parts.items():  # what others sit on comes first
        own = CHAIN if isinstance(part, Rod) else int(part.joint.kind in _HINGES)
        most[name] = own + most.get(part.on, 0)
    for name, part in reversed([*parts.items()]):
        if part.on in parts:
            most[part.on] = max(most[part.on], most[name])
    return most
