"""Which plates are fins, which have a start-up, and behind which limbs the flow separates: what files leave open."""

from collections.abc import Collection, Mapping

from .drag import PlateDragLoad, StartUp
from .joints import SphericalMotion
from .loads import ROD, AddedMassLoad, CylinderAddedMassLoad, TrailingEdgeLoad
from .parts import Limb, Rigid, Rod, SoftPlate
from .rod_fields import PrescribedStrains

_HIGH = 2.0  # height over depth, and over what carries it, from which on
THICK = 0.5  # thickness over height of a bar whose edges no longer shed vortices as those of a plate: chosen
_HINGES = ("revolute", "spherical")
CHAIN = 3  # hinges in a row along which waves of bending can run


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
    if isinstance(part, SoftPlate):
        return max(part.width)
    size = part.size if isinstance(part, Rigid) else lambda name: getattr(part, name, None)
    sizes = [size("width") or 0.0, size("height") or 0.0, getattr(part, "radius", None) or 0.0]
    return max(sizes[0], sizes[1], 2 * sizes[2])


def with_separation(parts: Mapping[str, Limb], in_stream: bool, pulled: Collection[str]) -> dict[str, Limb]:
    """Parts behind which the flow across separates, where their file leaves it open: limbs that rest in a stream.

    Decided once, by the joints and loads of the file. `pulled` are the parts over whose joints a tendon is pulled.
    """
    changed, rests = dict[str, Limb](), set[str]()
    sheds = {name for name, part in parts.items() if any(isinstance(x, TrailingEdgeLoad) for x in part.loads.values())}
    for name, part in reversed([*parts.items()]):  # what sits on others comes last
        if name in sheds:
            sheds.add(part.on)
    for name, part in parts.items() if in_stream else ():
        held = part.on in rests or part.on not in parts or part.on == name  # the body sits on nothing
        if held and part.joint.kind in ("fixed", *_HINGES) and not driven(part) and name not in pulled:
            rests.add(name)
    for name in rests - sheds:
        open_ = {
            key: load.model_copy(update={"separated": True})
            for key, load in parts[name].loads.items()
            if isinstance(load, AddedMassLoad | CylinderAddedMassLoad) and load.separated is None
        }
        if open_:
            changed[name] = parts[name].model_copy(update={"loads": {**parts[name].loads, **open_}})
    return changed


def driven(part: Limb) -> bool:
    """Whether a motion, a motor, a muscle, a tendon or a chamber moves its joint or its strains."""
    if getattr(part.joint, "motion", None) not in (None, SphericalMotion()) or part.powered:
        return True
    return isinstance(part, Rod) and (
        part.motion != PrescribedStrains() or any(load.on == ROD for load in part.loads.values())
    )


def with_start_ups(parts: Mapping[str, Limb]) -> dict[str, Limb]:
    """Parts whose plates shall have a start-up or not, where their file leaves it open.

    Decided once, by the hinges and numbers of the file: which equations a robot has does not change within a sweep.
    """
    changed = dict[str, Limb]()
    for (name, key), why in start_up_choices(parts).items():
        part = changed.get(name, parts[name])
        load = part.loads[key]
        assert isinstance(load, PlateDragLoad)
        decided = load.with_start_up(None if why else StartUp())
        changed[name] = part.model_copy(update={"loads": {**part.loads, key: decided}})
    return changed


def start_up_choices(parts: Mapping[str, Limb]) -> dict[tuple[str, str], str]:
    """Why plates are steady in few words, empty for those with a start-up, by part and load; of files that leave it
    open and give no amplitude."""
    hinges = hinges_in_a_row(parts)
    return {
        (name, key): _why_steady(part, hinges[name])
        for name, part in parts.items()
        for key, load in part.loads.items()
        if isinstance(load, PlateDragLoad) and load.leaves_start_up_open
    }


def thickness(part: Limb) -> float:
    """Thickness over height of a part's larger side: 1 of a round one."""
    if isinstance(part, SoftPlate):
        _, width, height = part.mean_sizes
    else:
        sizes = (part.width, part.height) if isinstance(part, Rod) else (part.size("width"), part.size("height"))
        width, height = sizes
    thin, high = sorted([width or 1.0, height or 1.0])
    return thin / high


def _why_steady(part: Limb, hinges: int) -> str:
    if isinstance(part, Rod):
        return "a rod"
    if hinges >= CHAIN:
        return f"{CHAIN} hinges or more, or a rod"
    return "a thick bar" if thickness(part) > THICK else ""


def hinges_in_a_row(parts: Mapping[str, Limb]) -> dict[str, int]:
    """Most hinges on a way through each part, from what all else hangs on to an end; a rod is as good as a chain."""
    most = dict[str, int]()
    for name, part in parts.items():  # what others sit on comes first
        own = CHAIN if isinstance(part, Rod) else int(part.joint.kind in _HINGES)
        most[name] = own + most.get(part.on, 0)
    for name, part in reversed([*parts.items()]):
        if part.on in parts:
            most[part.on] = max(most[part.on], most[name])
    return most
