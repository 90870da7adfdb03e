"""Several flagella on one free canister, made from the flagellum's own description."""

import math

from nectosome.description import Angle, AngularSpeed, FreeJoint, RateSignal, RobotDescription, Rod, load_robot
from nectosome.description.loads import GivenAddedMassLoad, LumpedDragLoad
from nectosome.units import InputError

from .shipped import file_of

_ABOUT = (
    "{count} flagella of the old design (300 mm, 45 deg, composite of 7.9 MPa) around the end of one canister that is "
    "free in all six directions; every other one turns and lifts the other way, and all start bent outward. "
    "Assumptions, printed nowhere: the canister (200 mm x 180 mm, neutrally buoyant), its drag and added mass, the "
    "ring of 70 mm, and no contact between flagella."
)
_RING = 0.070  # m
_LENGTH, _RADIUS = 0.200, 0.090  # m


def flagella(count: int) -> RobotDescription:
    """Robot with `count` flagella, evenly spaced on a ring, each with limbs shaft1, hook1, filament1, ...

    Raises InputError for a count outside 1..12.
    """
    if count not in range(1, 13):
        raise InputError(f"flagella: {count} flagella asked for; 1 to 12 fit on the ring.")
    one = load_robot(file_of("flagellum"))
    shaft, hook, filament = (one.limbs[name] for name in ("shaft", "hook", "filament"))
    assert isinstance(filament, Rod)
    displaced = 1000.0 * math.pi * _RADIUS**2 * _LENGTH
    across = 1.1 * 2 * _RADIUS * _LENGTH
    body = one.parts["body"].model_copy(
        update={
            "length": _LENGTH,
            "radius": _RADIUS,
            "mass": displaced,
            "joint": FreeJoint(kind="free"),
            "loads": {
                "hull_drag": LumpedDragLoad(
                    kind="lumped_drag",
                    drag_area=(1.0 * math.pi * _RADIUS**2, across, across),
                    rotational=(1e-3, 1e-2, 1e-2),
                ),
                "added_mass": GivenAddedMassLoad(
                    kind="given_added_mass",
                    mass=(0.3 * displaced, 0.7 * displaced, 0.7 * displaced),
                    inertia=(0.0, 0.01, 0.01),
                ),
            },
        }
    )
    limbs = {}
    for k in range(count):
        angle, sense = 2 * math.pi * k / count, 1 if k % 2 == 0 else -1
        motion = RateSignal[Angle, AngularSpeed](kind="rate", rate=sense * 14.4, start=angle + 0.5 * math.pi)
        offset = (0.0, round(_RING * math.cos(angle), 12), round(_RING * math.sin(angle), 12))
        loads = {
            "drag": hook.loads["drag"].model_copy(update={"lift": -0.1 * sense}),
            "added_mass": hook.loads["added_mass"],
        }
        limbs[f"shaft{k + 1}"] = shaft.model_copy(
            update={"offset": offset, "joint": shaft.joint.model_copy(update={"motion": motion})}
        )
        limbs[f"hook{k + 1}"] = hook.model_copy(
            update={"on": f"shaft{k + 1}", "bend": math.radians(45.0), "loads": loads}
        )
        limbs[f"filament{k + 1}"] = filament.model_copy(
            update={"on": f"hook{k + 1}", "length": 0.3, "tip_radius": 2e-3, "young": 7.9e6, "loads": loads}
        )
    aliases = {"E": tuple(f"limbs.filament{k + 1}.young" for k in range(count))}
    return RobotDescription(
        name=f"flagella{count}",
        about=_ABOUT.format(count=count),
        water=one.water,
        forward="-x",
        body=body,
        limbs=limbs,
        aliases=aliases,
    )
