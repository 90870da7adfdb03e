"""From a URDF file to a robot file: each link a point that carries mass and inertia, its shapes fixed to it.

The frame of a part is that of the link; the joint above a link is the part's own. A root called world, without mass and
shape, is the world: what hangs on it by a floating joint is free. Nothing is added that the file does not say, but for
the joint of another root, which URDF leaves open: it is fixed.
"""

import math
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from nectosome.description.copies import BODY, MOST_LIMBS, WORLD
from nectosome.description.meshes import MeshShape, measured_mesh
from nectosome.description.orientation import Matrix, Vector, applied, from_rpy, product, to_rpy
from nectosome.description.parts import Rigid, has_a_body, principal_moments
from nectosome.description.robot import RobotDescription
from nectosome.description.robot_file import dump_robot
from nectosome.description.urdf_file import UrdfTree, mesh_file, numbers, read_urdf
from nectosome.units import InputError, MeshUnit, shorten

from .joints import FixedJoint, FreeJoint, JointDescription, PlanarJoint, PrismaticJoint, RevoluteJoint

_SCALES: dict[MeshUnit, float] = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
_UPRIGHT = from_rpy((0.0, -math.pi / 2, 0.0))  # takes a part's x axis to z, along which cylinders stand in URDF


class Imported(NamedTuple):
    """A robot, the text of its file with comments, and words for each thing of the URDF that is not in it.

    `meshes` are the files of its meshes, by the names that the robot has for them.
    """

    description: RobotDescription
    text: str
    left_out: tuple[str, ...]
    meshes: dict[str, Path]


def import_urdf(path: str | Path) -> Imported:
    """Return the robot of a URDF file.

    Links become parts of shape point, with mass, centre of mass and inertia; boxes, cylinders, spheres and meshes of
    their collision (or else visual) geometry become weightless parts fixed to them, which displace water. What was
    measured of a mesh is in the robot. Its file is needed again for added mass by panels, beside the robot file.

    Raises InputError with the file and the link or joint: what `read_urdf` does not take, a moving link without mass
    or inertia, an inertia that no body has, sizes that are not positive.
    """
    return _Importer(str(path), read_urdf(path)).imported()


class _Importer:
    """The parts imported so far, and what to report about them."""

    def __init__(self, source: str, tree: UrdfTree):
        self.source, self.tree = source, tree
        self.left_out = list(tree.left_out)
        root = tree.links[tree.root]
        self.on_world = tree.root == WORLD and not (root.inertial or root.collisions or root.visuals)
        self.names: dict[str, str] = {tree.root: WORLD if self.on_world else BODY}  # of parts, by link
        self.limbs: dict[str, Rigid] = {}
        self.by: list[str] = []  # which part is which link and joint
        self.files = _unique_names([file for file in self.files_of_meshes() if file])
        self.meshes: dict[str, Path] = {}  # those that are in the robot, by their names

    def imported(self) -> Imported:
        root = self.tree.root
        body = None if self.on_world else self.part(root, None)
        self.shapes(root)
        ahead = [*reversed(self.tree.joints[root])]
        only = ahead[0] if self.on_world and len(ahead) == 1 else None
        while ahead:
            joint = ahead.pop()
            name = BODY if joint is only else self.free_name(joint.child)
            self.names[joint.child] = name
            self.by.append(f"{name}: link {shorten(joint.child)}, {joint.type} joint {shorten(joint.name)}")
            part = self.part(joint.child, joint)
            if joint is only:
                body = part
            else:
                self.limbs[name] = part
            self.shapes(joint.child)
            ahead += reversed(self.tree.joints[joint.child])
            if len(self.limbs) > MOST_LIMBS:
                raise self.wrong(f"links and shapes make more than {MOST_LIMBS} parts, too many for a robot file.")
        description = RobotDescription(name=self.tree.name[:100], body=body, limbs=dict(self.limbs))
        comment = "".join(f"# {line}\n" for line in self.comments())
        return Imported(description, comment + dump_robot(description), tuple(self.left_out), self.meshes)

    def part(self, link: str, joint: Any) -> Rigid:
        """Return the part that stands for a link, on the joint that carries it (None for the root)."""
        mass, centre, moments, products = self.inertial(link, moves=joint is not None and joint.type != "fixed")
        fields: dict[str, Any] = {"mass": mass, "inertia": moments, "products": products, "centre_of_mass": centre}
        if joint is not None:
            offset, rotation = self.place(joint.origin, f"joint {joint.name}, origin")
            fields |= {"offset": offset, "rotation": rotation, "joint": self.joint(joint)}
            if BODY not in (self.names[joint.parent], self.names[link]):
                fields["on"] = self.names[joint.parent]
        return Rigid(kind="rigid", shape="point", **fields)

    def inertial(self, link: str, moves: bool) -> tuple[float, Vector, Vector | None, Vector | None]:
        """Return mass, centre of mass, moments and products of inertia in the frame of a link."""
        here, given = f"link {link}, inertial", self.tree.links[link].inertial
        what_to_do = "A link that moves needs mass and inertia: write them, or fix it to what it sits on."
        if given is None:
            if moves:
                raise self.wrong(f"is missing. {what_to_do}", here)
            return 0.0, (0.0, 0.0, 0.0), None, None
        (mass,) = numbers((given.mass,), self.source, f"{here}, mass")
        if mass < 0 or (mass == 0 and moves):
            raise self.wrong(f'"{mass:g}" kg is no mass. {what_to_do}', f"{here}, mass")
        centre, rotation = self.place(given.origin, f"{here}, origin")
        here = f"{here}, inertia"
        i = given.inertia
        six = (0.0,) * 6 if i is None else (i.ixx, i.iyy, i.izz, i.ixy, i.ixz, i.iyz)
        xx, yy, zz, xy, xz, yz = numbers(six, self.source, here)
        if not any(six):
            if moves:
                raise self.wrong(f"is missing or zero. {what_to_do}", here)
            return mass, centre, None, None
        if mass == 0:
            raise self.wrong("is given, but the mass is 0 kg. Write the mass, or take the inertial out.", here)
        moments, products = _turned(from_rpy(rotation), ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
        principal = principal_moments(moments, products)
        if not has_a_body(principal) or min(moments) < 0:
            shown = ", ".join(format(moment, ".4g") for moment in principal)
            why = f"no body has the principal moments {shown} kg m2: none may be below 0, or larger than the sum of the"
            raise self.wrong(f"{why} other two. Correct it; it is about the centre of mass.", here)
        return mass, centre, moments, products

    def joint(self, joint: Any) -> JointDescription:
        """Return the joint of a part; what has no place there is reported."""
        here = f"joint {joint.name}"
        losses = {
            name: numbers((getattr(joint.dynamics, name, None) or 0.0,), self.source, here)[0]
            for name in ("damping", "friction")
        }
        for name, value in losses.items():
            if value < 0:
                raise self.wrong(f'"{value:g}" must be at least 0.', f"{here}, {name}")
        x, y, z = numbers((1.0, 0.0, 0.0) if joint.axis is None else joint.axis, self.source, f"{here}, axis")
        axis = (x, y, z)
        if not any(axis) and joint.type not in ("fixed", "floating"):
            raise self.wrong("has no length. Write the direction, as in 0 0 1.", f"{here}, axis")
        if joint.type in ("revolute", "continuous"):
            return RevoluteJoint(kind="revolute", axis=axis, damping=losses["damping"], friction=losses["friction"])
        if joint.type == "prismatic":
            return PrismaticJoint(kind="prismatic", axis=axis, damping=losses["damping"], friction=losses["friction"])
        for name in [name for name, value in losses.items() if value]:
            self.left_out.append(f'{shorten(here)}: {name}="{losses[name]:g}", which a {joint.type} joint has not')
        if joint.type == "planar":
            return PlanarJoint(kind="planar", axis=axis)
        return FreeJoint(kind="free") if joint.type == "floating" else FixedJoint(kind="fixed")

    def shapes(self, link: str) -> None:
        """Add the shapes of a link as parts without weight."""
        item, before = self.tree.links[link], len(self.limbs)
        described, placed = item.collisions or item.visuals, {}
        for k, body in enumerate(described, 1):
            number = "" if len(described) == 1 else str(k)
            here = f"link {link}, {'collision' if item.collisions else 'visual'}{' ' if number else ''}{number}"
            offset, rpy = self.place(body.origin, f"{here}, origin")
            rotation = from_rpy(rpy)
            if type(body.geometry).__name__ == "Mesh":
                mesh = self.mesh(body.geometry, here)
                if mesh is None:
                    continue
                turned, sizes = mesh
                rotation = product(rotation, turned)
            else:
                sizes = self.sizes(body.geometry, here)
                if sizes["shape"] == "cylinder":
                    rotation = product(rotation, _UPRIGHT)
            placed[number] = sizes, offset, rotation
        for number, (sizes, middle, rotation) in _with_round_ends(placed).items():
            at = _along(middle, rotation, -0.5 * sizes.get("length", 0.0))
            place: dict[str, Any] = {"offset": at, "rotation": to_rpy(rotation)}
            name = self.free_name(f"{self.names[link]}_shape{number}")
            self.limbs[name] = Rigid(kind="rigid", on=self.names[link], mass=0.0, **sizes, **place)
        if len(self.limbs) == before and item.inertial is not None and item.inertial.mass:
            none = "no box, cylinder, sphere or mesh to be used, so it displaces no water"
            self.left_out.append(f"link {shorten(link)}: {none}")

    def files_of_meshes(self) -> Iterator[Path | None]:
        """Yield the file of each mesh, None where it is not there."""
        folder = Path(self.source).parent
        for item in self.tree.links.values():
            shapes = [body.geometry for body in item.collisions or item.visuals]
            yield from (mesh_file(shape.filename, folder) for shape in shapes if type(shape).__name__ == "Mesh")

    def mesh(self, shape: Any, here: str) -> tuple[Matrix, dict[str, Any]] | None:
        """Return how a mesh is turned by the signs of its scale, and its shape, measured.

        Return None, and report what is wrong, for what is no mesh. Signs that mirror it do so in y, and turn it.
        """
        path = mesh_file(shape.filename, Path(self.source).parent)
        scale = numbers(shape.scale or (1.0, 1.0, 1.0), self.source, f"{here}, mesh, scale")
        units: list[MeshUnit] = [
            name for name, size in _SCALES.items() if all(math.isclose(size, abs(x)) for x in scale)
        ]
        if path is None or not units:
            shown = " ".join(format(x, "g") for x in scale)
            why = f'its scale "{shown}" is that of no unit' if path else "its file is not there"
            self.left_out.append(f"{shorten(here)}: mesh {shorten(shape.filename)}: {why}")
            return None
        name, unit, mirrored = self.files[path.resolve()], units[0], math.prod(scale) < 0
        try:
            measured = measured_mesh(path, unit, name)
        except InputError as error:
            self.left_out.append(f"{shorten(here)}: mesh {error}")
            return None
        self.left_out += [f"{shorten(here)}: mesh {name}: {told}" for told in measured.told]
        self.meshes[name] = path
        x, y, z = (math.copysign(1.0, size) for size in scale)
        turned = ((x, 0.0, 0.0), (0.0, -y if mirrored else y, 0.0), (0.0, 0.0, z))
        measured = measured.image() if mirrored else measured
        return turned, {"shape": MeshShape(mesh=name, unit=unit, mirrored=mirrored, measured=measured)}

    def sizes(self, shape: Any, here: str) -> dict[str, Any]:
        """Return the fields of a part that has the shape of a box, a cylinder or a sphere."""
        kind = type(shape).__name__.lower()
        named = ("length", "width", "height") if kind == "box" else ("radius", "length")
        given = shape.size if kind == "box" else [shape.radius, 2 * shape.radius if kind == "sphere" else shape.length]
        sizes = dict(zip(named, numbers(given, self.source, f"{here}, {kind}"), strict=True))
        if min(sizes.values()) <= 0:
            shown = " ".join(format(size, "g") for size in given)
            raise self.wrong(f'"{shown}" must be more than 0 m.', f"{here}, {kind}")
        return {"shape": "spheroid" if kind == "sphere" else kind, **sizes}

    def place(self, origin: Any, here: str) -> tuple[Vector, Vector]:
        """Return offset [m] and roll, pitch, yaw [rad] of an origin; none is no offset."""
        if origin is None:
            return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        x, y, z, roll, pitch, yaw = numbers((*origin.xyz, *origin.rpy), self.source, here)
        return (x, y, z), (roll, pitch, yaw)

    def free_name(self, link: str) -> str:
        """Return a name like that of a link that robot files allow and no part has yet."""
        name = re.sub(r"[^a-z0-9]+", "_", link.lower()).strip("_")[:50] or "link"
        name = name if name[0].isalpha() else f"link_{name}"
        taken = {BODY, WORLD, *self.limbs, *self.names.values()}
        return next(n for n in (name, *(f"{name}_{k}" for k in range(2, 2 * MOST_LIMBS))) if n not in taken)

    def comments(self) -> Iterator[str]:
        """Yield the lines of the comment at the top of the robot file."""
        yield f"From {shorten(Path(self.source).name)}. Each link is a point with its mass and inertia, on its joint;"
        yield "the shapes on it weigh nothing and displace water. Add what else the water does to them, as `loads`."
        if any(name.endswith("_shape2") for name in self.limbs):
            yield "Shapes that overlap displace the same water twice: take the inner one out."
        if not self.on_world:
            yield f"  body: link {shorten(self.tree.root)}. URDF does not say whether it is held, here it is."
            yield "    What lets it go is: joint: {kind: free}"
        yield from (f"  {line}" for line in self.by)
        if self.left_out:
            yield "Not here, since it has no place in a robot file or the URDF does not say it:"
            yield from (f"  {line}" for line in self.left_out)

    def wrong(self, why: str, here: str | None = None) -> InputError:
        return InputError(why, file=self.source, field=None if here is None else shorten(here, 200))


def _unique_names(files: list[Path]) -> dict[Path, str]:
    """Return a name for each file: its own, with that of its folder before it where two files have the same."""
    files = list(dict.fromkeys(file.resolve() for file in files))
    own = Counter(file.name.casefold() for file in files)  # some file systems take a.stl and A.stl for one
    names: dict[Path, str] = {}
    taken = {name for name, times in own.items() if times == 1}
    for file in files:
        name = file.name
        if own[name.casefold()] > 1:
            tries = (f"{file.parent.name}{k}_{name}" for k in ("", *range(2, len(files) + 2)))
            name = next(name for name in tries if name.casefold() not in taken)
        taken.add(name.casefold())
        names[file] = name
    return names


def _turned(R: Matrix, own: Matrix) -> tuple[Vector, Vector | None]:
    """Return moments and products xy, xz, yz of the inertia matrix R I R^T; None where all products are 0."""
    (a, xy, xz), (_, b, yz), (*_, c) = (applied(R, row) for row in product(R, own))  # each row of R I times R^T
    small = 1e-15 * max(abs(a), abs(b), abs(c))
    return (a, b, c), (xy, xz, yz) if max(abs(xy), abs(xz), abs(yz)) > small else None


def _along(middle: Vector, rotation: Matrix, length: float) -> Vector:
    """Place at a distance along the x axis of a turned part."""
    ahead = applied(rotation, (length, 0.0, 0.0))
    return (middle[0] + ahead[0], middle[1] + ahead[1], middle[2] + ahead[2])


def _with_round_ends(placed: dict[str, tuple[dict[str, Any], Vector, Matrix]]) -> dict[str, Any]:
    """Shapes by number, with their middles and rotations; a cylinder with balls around both ends is a capsule."""
    balls = {number: one for number, one in placed.items() if one[0]["shape"] == "spheroid"}
    found = dict(placed)
    for number, (sizes, middle, rotation) in placed.items():
        if sizes["shape"] != "cylinder":
            continue
        radius, near = sizes["radius"], 1e-3 * sizes["radius"]
        ends = [_along(middle, rotation, side * sizes["length"]) for side in (-0.5, 0.5)]
        round_ends = {
            side: k
            for k, (ball, centre, _) in balls.items()
            for side, end in enumerate(ends)
            if abs(ball["radius"] - radius) < near and math.dist(centre, end) < near
        }
        if len(round_ends) == 2:
            capsule = {"shape": "capsule", "radius": radius, "length": sizes["length"] + 2 * radius}
            found[number] = capsule, middle, rotation
            for k in round_ends.values():
                del found[k], balls[k]
    return found
