"""Which piece of the water matters how much: the robot that ships with one of them left out or replaced."""

from collections.abc import Callable
from dataclasses import dataclass

from nectosome.description import RobotDescription, apply_settings
from nectosome.description.drag import PlateDragLoad, StartUp
from nectosome.description.foil_planform import FoilLoad
from nectosome.description.loads import AddedMassLoad, TrailingEdgeLoad

_SIDEWAYS = {10: 15, 20: 31, 30: 53, 40: 75}  # [mm], of the middle links to either side, as they swim by angles [deg]
_BEFORE, _LAST = "link5", "link6"
_FIN = f"limbs.{_LAST}.loads.fin"


@dataclass(frozen=True)
class OtherWater:
    """Another water: in words, and how the robot gets it; with an amplitude [deg] where it depends on that."""

    what: str
    make: Callable[[RobotDescription], RobotDescription]
    by_amplitude: Callable[[int], tuple[str, ...]] = lambda _: ()

    def at(self, robot: RobotDescription, amplitude: int) -> RobotDescription:
        """The robot in this water, turned by an amplitude."""
        return apply_settings(self.make(robot), self.by_amplitude(amplitude))


def _without(load: str, *settings: str) -> Callable[[RobotDescription], RobotDescription]:
    """Leaves a load out wherever it is; then `settings`."""

    def make(description: RobotDescription) -> RobotDescription:
        for name, part in description.parts.items():
            others = {key: one for key, one in part.loads.items() if key != load}
            description = description.with_part(name, loads=others)
        return apply_settings(description, settings)

    return make


def _with(*settings: str) -> Callable[[RobotDescription], RobotDescription]:
    return lambda description: apply_settings(description, settings)


def _on_links(load: str, setting: str) -> tuple[str, ...]:
    """A setting of a load of all links but the last."""
    return tuple(f"{part}.loads.{load}.{setting}" for part in ("body", *(f"limbs.link{k}" for k in range(2, 6))))


def _like_the_others(description: RobotDescription) -> RobotDescription:
    """The last link has the loads of the one before it: nothing is shed."""
    return description.with_part(_LAST, loads=description.parts[_BEFORE].loads)


def _instant(description: RobotDescription) -> RobotDescription:
    """The last link has the loads of the one before it, and sheds its water at once (Lighthill 1971)."""
    wake = TrailingEdgeLoad(kind="trailing_edge")
    return description.with_part(_LAST, loads={**description.parts[_BEFORE].loads, "wake": wake})


def _mirrored(description: RobotDescription) -> RobotDescription:
    """The foil has its image beyond the surface, and with it twice the aspect ratio."""
    last = description.parts[_LAST]
    fin = last.loads["fin"]
    assert isinstance(fin, FoilLoad)
    twice = fin.model_copy(update={"aspect_ratio": 2 * fin.ratio(last)})
    return description.with_part(_LAST, loads={**last.loads, "fin": twice})


def _long_wave(description: RobotDescription) -> RobotDescription:
    """Strips of added mass without a wavelength."""
    for name, part in description.parts.items():
        loads = {
            key: load.model_copy(update={"wavelength": None}) if isinstance(load, AddedMassLoad) else load
            for key, load in part.loads.items()
        }
        description = description.with_part(name, loads=loads)
    return description


def _starting(description: RobotDescription) -> RobotDescription:
    """Drag across of plates that start and reverse; the robot swims out of the vortices of its 0.61 m."""
    for name, part in description.parts.items():
        loads = {
            key: load.model_copy(update={"start_up": StartUp(length=0.61)}) if isinstance(load, PlateDragLoad) else load
            for key, load in part.loads.items()
        }
        description = description.with_part(name, loads=loads)
    return description


CHANGES = {
    "instant": OtherWater("the last link sheds at once: `trailing_edge`", _instant),
    "nothing-shed": OtherWater("nothing is shed: the last link is like the others", _like_the_others),
    "no-stall": OtherWater("the foil keeps its flow: stall at 90 deg", _with(f"{_FIN}.stall=90 deg")),
    "mirror": OtherWater("the surface is a wall: a foil of twice the aspect ratio", _mirrored),
    "endless-foil": OtherWater("lift, lag and added mass of a foil of endless span", _with(f"{_FIN}.aspect_ratio=1e6")),
    "no-friction": OtherWater("no friction along the body and the foil", _without("skin", f"{_FIN}.profile_drag=0")),
    "cross-1.98": OtherWater("drag across of an endless plate: 1.98", _with(*_on_links("cross", "normal=1.98"))),
    "oscillating": OtherWater(
        "drag across of plates that oscillate in still water, by Keulegan-Carpenter number: 8.0, 6.3, 5.2, 4.7",
        lambda robot: robot,
        lambda amplitude: _on_links("cross", f"amplitude={_SIDEWAYS[amplitude]} mm"),
    ),
    "start-up": OtherWater("drag across of plates that start and reverse, and swim out of their vortices", _starting),
    "no-cross": OtherWater("no drag across the links", _without("cross")),
    "fin-cross": OtherWater(
        "the foil has the drag across of the links, too, as of the vortices along its side edges",
        lambda robot: robot.with_part(
            _LAST, loads={**robot.parts[_LAST].loads, "cross": robot.parts[_BEFORE].loads["cross"]}
        ),
    ),
    "nose-20": OtherWater("blunt end of 20 cm2 instead of 12 cm2", _with("body.loads.nose.drag_area.0=20 cm2")),
    "no-nose": OtherWater("no drag of the blunt end", _without("nose")),
    "ends": OtherWater(
        "added mass of the links as of a plate that ends, 0.61 m long", _with(*_on_links("water", "length=610 mm"))
    ),
    "fin-edge": OtherWater(
        "the last link sheds by `trailing_edge` with the lag of its depth",
        lambda robot: apply_settings(_instant(robot), [f"limbs.{_LAST}.loads.wake.chord=98 mm"]),
    ),
    "long-wave": OtherWater("added mass of the links as of a wave that is long against their height", _long_wave),
}
