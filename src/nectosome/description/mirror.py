"""The mirror image of a limb: reflected in its own x-z plane, so that it still runs along its x axis.

D = diag(1, -1, 1) takes a point of the limb to that of its image, in frames that are images of one another. Positions,
forces and velocities change the sign of y; what turns (axes of hinges, moments, torsion) changes those of x and z.
"""

from collections.abc import Callable, Mapping
from typing import Any

from pydantic import BaseModel

from nectosome.description.base import Described, wrong
from nectosome.description.joints import Joint, PlanarJoint
from nectosome.description.loads import Load
from nectosome.description.parts import Limb, Rod
from nectosome.description.rod_loads import MuscleLoad

Change = Callable[[Any], Any]
"""From a value of a limb to that of its image."""


def along(v: Any) -> Any:
    """Return the image of a position, force or velocity."""
    return (v[0], _minus(v[1]), v[2])


def about(v: Any) -> Any:
    """Return the image of what turns: an axis, a moment, an angular velocity, a rotation as roll, pitch, yaw."""
    return (_minus(v[0]), v[1], _minus(v[2]))


def opposite(value: Any) -> Any:
    """Return a number, a row of numbers or a signal with the other sign."""
    if isinstance(value, tuple):
        return tuple(map(opposite, value))
    if isinstance(value, BaseModel):
        fields = {
            n: getattr(value, n)
            for n in ("value", "values", "rate", "start", "amplitude", "offset")
            if n in type(value).model_fields
        }
        return value.model_copy(update={name: opposite(item) for name, item in fields.items()})
    return _minus(value)


def _matrix(rows: Any) -> Any:
    """6 x 6, rotation before translation."""
    signs = (-1, 1, -1, 1, -1, 1)
    return tuple(
        tuple(a * b * x + 0.0 for b, x in zip(signs, row, strict=True)) for a, row in zip(signs, rows, strict=True)
    )


def _across(v: Any) -> Any:
    """A place across a rod, along y and z."""
    return (_minus(v[0]), v[1])


def _of(changes: "Mapping[str, Change]") -> Change:
    """Return what changes fields of a group; those that have no value stay as they are."""

    def change(group: Any) -> Any:
        known = {name: getattr(group, name) for name in changes}
        return group.model_copy(update={n: changes[n](x) for n, x in known.items() if x is not None})

    return change


_JOINTS: dict[str, Mapping[str, Change]] = {
    "fixed": {},
    "revolute": {"axis": about},
    "prismatic": {"axis": along},
    "planar": {"axis": about, "start": _of({"position": along, "velocity": along})},
    "spherical": {
        "start": _of({"orientation": about, "angular_velocity": about}),
        "motion": _of({"roll": opposite, "yaw": opposite}),
        "drive": _of({"x": opposite, "z": opposite}),
    },
    "free": {
        "start": _of({"position": along, "orientation": about, "velocity": along, "angular_velocity": about}),
        "motion": _of({"y": opposite, "roll": opposite, "yaw": opposite}),
        "drive": _of({"torque_x": opposite, "torque_z": opposite, "force_y": opposite}),
    },
}
_LOADS: dict[str, Mapping[str, Change]] = {
    "drag": {"lift": opposite},
    "plate_drag": {},
    "added_mass": {},
    "lumped_drag": {},
    "spheroid_added_mass": {},
    "cylinder_added_mass": {},
    "given_added_mass": {"matrix": _matrix},
    "jet": {"direction": along, "place": along},
    "force": {"force": along, "moment": about},
    "leg": {"hip": along},
    "distributed_force": {"force": along},
    "near_floor": {},
    "pulsed_thrust": {"direction": along, "place": along},
    "bumper": {},
    "trailing_edge": {},
    "tendon": {"place": _across, "tip_place": _across},
    "chamber": {"place": _across, "tip_place": _across},
}
_TURNED = ("torsion", "bending_z")  # strains whose image has the other sign
_REST: Mapping[str, Change] = {"torsion": opposite, "bending_z": opposite, "shear_y": opposite}


def image(limb: Limb) -> Limb:
    """Return the limb's image but for where it sits. Equal signals of its joints make it move as the image does.

    Forces in the world's frame stay as they are. Raises the error of a field for what has no image.
    """
    update: dict[str, Any] = {
        "joint": _joint(limb.joint),
        "loads": {name: _load(name, load) for name, load in limb.loads.items()},
    }
    if isinstance(limb, Rod):
        update["rest"] = _of(_REST)(limb.rest)
        update["motion"] = _of(dict.fromkeys(_TURNED, opposite))(limb.motion)
    else:
        update["centre_of_mass"] = along(limb.centre_of_mass)
        update["products"] = None if limb.products is None else about(limb.products)  # xy and yz change their sign
    return limb.model_copy(update=update)


def _joint(joint: Joint) -> Described:
    if isinstance(joint, PlanarJoint) and (joint.motion or joint.drive):
        field = "motion" if joint.motion else "drive"
        raise wrong(f"joint.{field}", f"a planar joint with a {field} cannot be mirrored. Write both limbs out.")
    return _of(_JOINTS[joint.kind])(joint)


def _load(name: str, load: Load) -> Described:
    if isinstance(load, MuscleLoad):
        return _of({"moment": opposite})(load) if load.strain in _TURNED else load
    if load.kind not in _LOADS:
        raise wrong(f"loads.{name}", f"{load.kind} cannot be mirrored. Write both limbs out.")
    return load if getattr(load, "frame", "body") == "world" else _of(_LOADS[load.kind])(load)


def _minus(x: float) -> float:
    return 0.0 - x  # no -0.0
