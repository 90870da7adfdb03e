"""Random robots: trees of rigid bodies and rods with joints, loads, pairs and tendons of every kind there is.

Kinds are those that a robot file knows, and their fields are drawn by type and dimension: a new load, joint or pair is
drawn without a word here. What a description refuses is drawn anew.
"""

import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import numpy as np
import trimesh
from pydantic import BaseModel, ValidationError

from nectosome.description import RobotDescription, dump_robot, parse_robot
from nectosome.description.joints import JointDescription
from nectosome.description.loads import SOFT_PLATE, WEB, LoadDescription
from nectosome.description.mesh_added_mass import ComputedAddedMass
from nectosome.description.meshes import MeshShape, measured_mesh
from nectosome.description.pairs import PairDescription
from nectosome.description.parts import Rigid, Rod
from nectosome.description.shapes import shape_forms
from nectosome.description.tendons import TendonDescription
from nectosome.io.schema.structure import Slot, _fields

LEAST, MOST = 8, 30  # degrees of freedom
_TRIES = 200
# typical sizes [SI] of a robot of some decimetres; of another dimension 1
_SIZES = {
    "length": 0.03, "area": 1e-3, "volume": 1e-3, "mass": 0.5, "inertia": 1e-3, "density": 1000.0, "pressure": 5e4,
    "elastance": 1e6, "viscosity": 100.0, "angle": 0.6, "curvature": 3.0, "curvature_rate": 2.0, "frequency": 2.0,
    "angular_speed": 3.0, "speed": 0.3, "force": 1.0, "torque": 0.05, "line_force": 2.0, "angular_stiffness": 0.3,
    "angular_damping": 0.02, "stiffness": 300.0, "damping": 5.0, "quadratic_drag": 0.02, "voltage": 6.0,
    "torque_constant": 0.5, "strain_rate": 0.1,
}  # fmt: skip
# fields that are left out, as they name other parts or files, or copies
_LEFT_OUT = {
    "turned_by",
    "battery",
    "servo",
    "limits",
    "repeat",
    "model",
    "marks",
    "between",
    "over",
    "pulled_by",
    "at",
}
# of a kind, where fields have to fit together in a way that hardly any draw has
_GIVEN: dict[str, dict[str, Any]] = {
    "leg": {"crank": 0.01, "bearing": (0.0, -0.03), "length": 0.06, "speed": 3.0},
    "near_floor": {"full": 0.1, "none": 0.6},
    "stokes_drag": {"wavelength": 2.0},
    "given_added_mass": {"mass": (0.3, 0.5, 0.4)},
    "jet": {"volume": (1e-3, 9e-4, 7e-4, 8e-4), "crank": {"kind": "rate", "rate": 6.0}},
    "thruster": {"thrust": 0.5, "torque": 0.08, "thrust_slope": 0.4, "torque_slope": 0.05, "backward_thrust": 0.3},
    "chamber": {"hysteresis": None},
}
_IN_RODS = {"tendon", "chamber"}


@cache
def skew_mesh() -> MeshShape:
    """A mesh of a decimetre whose axes are not the principal ones."""
    mesh = trimesh.creation.icosphere(2, radius=1).apply_scale([0.05, 0.02, 0.015])
    mesh.vertices[:, 1] += 0.2 * mesh.vertices[:, 0] + 0.01
    with tempfile.TemporaryDirectory() as folder:
        mesh.export(Path(folder) / "skew.ply")
        return MeshShape(mesh="skew.ply", unit="m", measured=measured_mesh(Path(folder) / "skew.ply", "m", "skew.ply"))


def _added_mass(mesh: MeshShape) -> ComputedAddedMass:
    """Of the size of that of the mesh, with all couplings."""
    size = np.array([0.02, 0.05, 0.05, 1, 1, 1])
    skew = np.tri(6) + np.eye(6)
    matrix = mesh.numbers.volume * np.outer(size, size) * (skew @ skew.T)
    known = {"sha256": mesh.numbers.sha256, "unit": "m", "panels": 100, "error": (0.0,) * 6}
    return ComputedAddedMass.model_validate({**known, "matrix": tuple(map(tuple, matrix.tolist()))})


class _RefusedError(Exception):
    """Nothing can be drawn here."""


def kinds_of(base: type[Any]) -> dict[str, type[Any]]:
    """Classes of descriptions by kind."""
    found, waiting = {}, [base]
    while waiting:
        cls = waiting.pop()
        waiting += cls.__subclasses__()
        kind = get_args(cls.model_fields["kind"].annotation)
        if kind:
            found[kind[0]] = cls
    return dict(sorted(found.items()))


LOADS, JOINTS, PAIRS = map(kinds_of, (LoadDescription, JointDescription, PairDescription))
LOADS = {kind: cls for kind, cls in LOADS.items() if not {*cls.on} <= {WEB, SOFT_PLATE}}  # these robots have no sheets


class Draw:
    """A seed's draws."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def chance(self, share: float) -> bool:
        return bool(self.rng.uniform() < share)

    def one(self, things: Sequence[Any]) -> Any:
        return things[int(self.rng.integers(len(things)))]

    def number(self, here: Slot) -> float:
        quantity = here.quantity
        size = 1.0 if quantity is None else _SIZES.get(quantity.dimension, 1.0)
        value = size * float(np.exp(self.rng.uniform(-0.7, 0.7)))
        low = None if quantity is None else quantity.minimum
        high = 1.0 if quantity is None else quantity.maximum
        if high is not None:
            value = (low or 0.0) + (high - (low or 0.0)) * float(self.rng.uniform(0.1, 0.9))
        elif low is None and self.chance(0.5):
            value = -value
        return round(value, 12)

    def value(self, here: Slot) -> Any:
        """A value of a type. Raises _RefusedError."""
        hint, origin = here.hint, get_origin(here.hint)
        if here.quantity is not None or hint is float:
            return self.number(here)
        if origin is Literal:
            return self.one(get_args(hint))
        if hint is bool:
            return self.chance(0.5)
        if hint is int:
            return int(self.rng.integers(2, 5))
        if origin is tuple:
            args = get_args(hint)
            count = 4 if args[-1] is Ellipsis else len(args)
            return tuple(self.value(here.child(k, None) or here) for k in range(count))
        if isinstance(hint, type) and issubclass(hint, BaseModel):
            return self.fields(hint)
        kinds = {kind: cls for kind, cls in here.kinds().items() if kind != "recording"}
        if kinds:
            return self.fields(self.one([*kinds.values()]))
        raise _RefusedError(hint)

    def fields(self, model: type[BaseModel], **given: Any) -> dict[str, Any]:
        """Fields that the model takes: those it needs, some others, and those given. Raises _RefusedError."""
        kind = get_args(model.model_fields["kind"].annotation)[0] if "kind" in model.model_fields else None
        given = _GIVEN.get(kind or "", {}) | given
        for _ in range(_TRIES):
            drawn: dict[str, Any] = {}
            for name, here in _fields(model).items():
                needed = model.model_fields[name].is_required()
                if name in given:
                    drawn[name] = given[name]
                elif needed or (name not in _LEFT_OUT and self.chance(0.3)):
                    try:
                        drawn[name] = self.value(here)
                    except _RefusedError:
                        if needed:
                            raise
            try:
                model.model_validate(drawn)
            except ValidationError:
                continue
            return drawn
        raise _RefusedError(model)

    def joint(self, kind: str) -> dict[str, Any]:
        """A joint; one on which nothing is prescribed, for most."""
        left_out = {} if self.chance(0.25) else {"motion": None}
        return self.fields(JOINTS[kind], **left_out)

    def part(self, loads: Sequence[str]) -> dict[str, Any]:
        """A part on which the first of the loads can act, with it and with some of the others."""
        for _ in range(_TRIES):
            try:
                return self._part(loads)
            except (_RefusedError, ValidationError):
                continue
        raise _RefusedError(loads)

    def _part(self, loads: Sequence[str]) -> dict[str, Any]:
        shape = self.one([name for name in ("rod", *shape_forms()) if LOADS[loads[0]].acts_on(name)])
        size = {name: float(self.rng.uniform(*span)) for name, span in _SPANS.items()}
        if shape == "rod":
            section = self.one(("circle", "ellipse", "rectangle"))
            names = ("radius",) if section == "circle" else ("width", "height")
            strains = self.rng.permutation(["torsion", "bending_y", "bending_z", "extension", "shear_y"])
            free = {str(name): int(self.rng.integers(2)) for name in strains[: int(self.rng.integers(1, 4))]}
            part = {"kind": "rod", "section": section, "young": 2e5, "density": 1100.0, "damping": 300.0}
            part |= {"strains": free, "points": 4, "length": 3 * size["length"]}
            part |= {name: 0.3 * size[name] for name in names}
        else:
            names = [name for name in shape_forms()[shape].sizes if name != "length"]
            part = {"kind": "rigid", "shape": shape, "strips": 3, **{name: size[name] for name in names}}
            if shape == "plate":
                outline = [(x * size["length"], y * size["width"]) for x, y in _OUTLINE]
                part |= {"shape": {"outline": outline, "thickness": 0.01, "plane": self.one(("xy", "xz"))}}
                part |= {"density": 1050.0}
            elif shape == "point":
                part |= {"mass": 0.4, "inertia": (2e-4, 3e-4, 4e-4), "volume": 3e-4}
            elif shape == "mesh":
                part |= {"shape": skew_mesh(), "density": 1050.0}
            else:
                part |= {"length": size["length"], "density": 1050.0}
        fitting = [kind for kind in loads if LOADS[kind].acts_on(shape)]
        part["loads"] = {}
        for kind in dict.fromkeys([loads[0], *(kind for kind in fitting if self.chance(0.08))]):
            own = {"place": (0.002, -0.001), "tip_place": (0.001, 0.002)} if kind in _IN_RODS else {}
            if kind == "foil" and shape == "plate":  # of its outline
                own = {"chord": None, "leading_edge": None, "span": None}
                own |= {"span_along": "x", "ahead": part["shape"]["plane"][1]}
            elif kind == "foil":
                own = {"chord": (0.03, 0.05)}
            if kind == "mesh_added_mass":
                own = {"panels": 100, "computed": _added_mass(part["shape"])}
            if kind == "muscle":
                own = {"strain": next((name for name in part["strains"] if name in _BENT), "none")}
            part["loads"][kind] = self.fields(LOADS[kind], **own)
        (Rod if shape == "rod" else Rigid).model_validate(part)
        return part

    def robot(self, number: int) -> RobotDescription:
        """A robot whose first parts have the loads and joints that come next in the rows of all kinds."""
        every, kinds, kinds_of_joint = [*LOADS], [*LOADS], [kind for kind in JOINTS if kind != "fixed"]
        while True:
            self.rng.shuffle(kinds)
            parts: dict[str, dict[str, Any]] = {}
            for k in range(int(self.rng.integers(3, 5))):
                must = every[(3 * number + k) % len(every)]
                part = self.part([must, *(kind for kind in kinds if kind != must)])
                joint = "free" if k == 0 else kinds_of_joint[(number + k) % len(kinds_of_joint)]
                part["joint"] = self.joint(joint) if k else {"kind": "free"}
                if k:
                    part["on"] = self.one([*parts])
                    part["at"] = self.one(("tip", "root"))
                    part["rotation"] = tuple(self.rng.uniform(-0.8, 0.8, 3).tolist())
                    part["offset"] = tuple(self.rng.uniform(-0.05, 0.05, 3).tolist())
                parts["body" if k == 0 else f"part{k}"] = part
            whole: dict[str, Any] = {"name": f"random {number}", "body": parts.pop("body"), "limbs": parts}
            whole["water"] = self._water()
            names = ["body", *parts]
            pairs = {kind: self._pair(kind, names) for kind in PAIRS if self.chance(0.7)}
            hinges = [name for name, part in parts.items() if part["joint"]["kind"] == "revolute"]
            free = [name for name in hinges if parts[name]["joint"].get("motion") is None]
            if free:
                over = {name: float(self.rng.uniform(0.005, 0.02)) for name in free}
                whole["tendons"] = {"cord": self.fields(TendonDescription, over=over)}
            for more in (pairs, {}):
                try:
                    description = RobotDescription.model_validate({**whole, "pairs": more})
                except ValidationError:
                    continue
                if LEAST <= freedoms(description) <= MOST:
                    return parse_robot(dump_robot(description))

    def _water(self) -> dict[str, Any]:
        water: dict[str, Any] = {"gravity": 9.81 if self.chance(0.7) else 0.0, "floor": -0.4}
        if self.chance(0.5):
            water["current"] = tuple(self.rng.uniform(-0.2, 0.2, 3).tolist())
        if self.chance(0.3):
            water["surface"] = 0.3
        if self.chance(0.3):
            water["walls"] = (-0.3, 0.5)
        return water

    def _pair(self, kind: str, names: list[str]) -> dict[str, Any]:
        two = tuple(str(name) for name in self.rng.permutation(names)[:2])
        return self.fields(PAIRS[kind], between=two)


_SPANS = {"length": (0.06, 0.2), "radius": (0.02, 0.05), "width": (0.03, 0.08), "height": (0.03, 0.08)}
_OUTLINE = ((-0.1, -0.5), (1.0, -0.8), (0.7, -0.1), (0.9, 0.6), (0.1, 0.4))  # of a plate, in shares of its sizes
_BENT = ("torsion", "bending_y", "bending_z")
_FREEDOMS = {"fixed": 0, "revolute": 1, "prismatic": 1, "planar": 3, "spherical": 3, "free": 6}


def freedoms(description: RobotDescription) -> int:
    """Number of coordinates that are free, of joints and of strains."""
    found = 0
    for part in description.parts.values():
        moves = getattr(part.joint, "motion", None) is None
        found += _FREEDOMS[part.joint.kind] if moves else 0
        if isinstance(part, Rod):
            found += sum(order + 1 for name, order in part.strains.items() if getattr(part.motion, name, None) is None)
    return found


def elsewhere(description: RobotDescription) -> RobotDescription:
    """The robot and its current set elsewhere: moved along y, and without walls along x and turned about z too.

    What acts in the world's axes turns with it.
    """
    turn, shift = (0.0, 0.0) if description.water.walls else (0.9, 2.0)
    c, s = np.cos(turn), np.sin(turn)

    def turned(x: Sequence[float]) -> tuple[float, ...]:
        return (c * x[0] - s * x[1], s * x[0] + c * x[1], x[2])

    def of(part: Any) -> Any:
        loads = {}
        for name, load in part.loads.items():
            vectors = ("force", "moment") if getattr(load, "frame", None) == "world" else ()
            there = {key: turned(getattr(load, key)) for key in vectors if hasattr(load, key)}
            loads[name] = load.model_copy(update=there)
        return part.model_copy(update={"loads": loads})

    assert description.body is not None
    water = description.water
    if water.current is not None:
        water = water.model_copy(update={"current": turned(water.current)})
    body = of(description.body).model_copy(update={"rotation": (0.0, 0.0, turn), "offset": (shift, -1.3, 0.0)})
    limbs = {name: of(limb) for name, limb in description.limbs.items()}
    return description.model_copy(update={"water": water, "body": body, "limbs": limbs})


def random_robot(number: int) -> RobotDescription:
    """The random robot of a number: the same one at any time, with the loads and joints whose turn it is."""
    return Draw(number).robot(number)
