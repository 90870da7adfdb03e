"""URDF files: the links and joints in them, as the parser of ROS reads them.

The parser is given what a robot file has a place for; all else is taken out before and reported, so that what it does
not know is a mistake.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

from nectosome.io.extras import package
from nectosome.io.file_system import is_file
from nectosome.io.yaml_text import read_text
from nectosome.units import InputError, did_you_mean, shorten

JOINT_TYPES = ("fixed", "revolute", "continuous", "prismatic", "floating", "planar")
_KNOWN_ATTRIBUTES = {"link": ("name",), "joint": ("name", "type")}
_KNOWN_CHILDREN = {
    "link": ("inertial", "collision", "visual"),
    "joint": ("origin", "axis", "parent", "child", "dynamics"),
}
_PRIMITIVES = ("box", "cylinder", "sphere")
_MESHES = (".stl", ".obj", ".ply")


class UrdfTree(NamedTuple):
    """Links and joints of a file, which make one tree; `left_out` are words for what was not read."""

    name: str
    root: str
    links: dict[str, Any]  # of the parser, in the order of the file
    joints: dict[str, tuple[Any, ...]]  # to the children of each link
    left_out: list[str]


def read_urdf(path: str | Path) -> UrdfTree:
    """Return what a URDF file describes.

    Raises InputError: no such file, no XML, no robot, no tree, elements without what they need, what is no number.
    """
    source = str(path)
    root = _root(read_text(path), source)
    left_out = list(_taken_out(root, Path(path).parent))
    links = _named(root, "link", source)
    joints = _named(root, "joint", source)
    if not links:
        raise InputError("this robot has no links.", file=source)
    children: dict[str, tuple[Any, ...]] = dict.fromkeys(links, ())
    above: dict[str, Any] = {}
    for name, joint in joints.items():
        here = f"joint {name}"
        for end in (joint.parent, joint.child):
            if end not in links:
                known = did_you_mean(str(end), links)
                raise InputError(f'there is no link "{shorten(end)}".{known}', file=source, field=here)
        if joint.child in above:
            why = f"moves {joint.child}, which hangs on joint {above[joint.child].name} already. Take one of them out"
            raise InputError(f"{why}, and close the loop with a bushing in the robot file.", file=source, field=here)
        above[joint.child] = joint
        children[joint.parent] += (joint,)
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        why = f"these links hang on nothing: {shorten(', '.join(roots), 200)}. A robot has one such link"
        raise InputError(f"{why}: join the others to it, if need be by a fixed joint.", file=source)
    reached, ahead = set(), list(roots)
    while ahead:
        reached.add(name := ahead.pop())
        ahead += [joint.child for joint in children[name]]
    if ring := [name for name in links if name not in reached]:
        why = f"these links hang on one another in a ring: {shorten(', '.join(ring), 200)}. Take one joint of it out"
        raise InputError(f"{why}, and close the loop with a bushing in the robot file.", file=source)
    return UrdfTree(root.get("name") or Path(path).stem, roots[0], links, children, left_out)


def numbers(values: Sequence[float], source: str, place: str) -> tuple[float, ...]:
    """Return the values as they are. Raises InputError where one is not finite."""
    for value in values:
        if not math.isfinite(value):
            raise InputError(f'"{value}" must be finite.', file=source, field=place)
    return tuple(values)


def _root(text: str, source: str) -> ElementTree.Element:
    """Return the element `robot` of a file without a document type, so that no entity is unfolded or fetched."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError("declares a document type or entities, which are not read. Take them out.", file=source)
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        line, why = error.position[0], str(error).partition(":")[0]
        raise InputError(f"this is not XML: {why}.", file=source, line=line) from None
    if any("xacro" in str(element.tag) for element in root.iter()):
        why = "is a xacro file, which is not a robot yet. Unfold it first"
        raise InputError(f"{why}: xacro {Path(source).name} > robot.urdf", file=source)
    if root.tag != "robot":
        why = f"this is no URDF: it describes a <{shorten(root.tag)}>, where <robot> is expected."
        raise InputError(why, file=source)
    return root


def mesh_file(name: str, folder: Path) -> Path | None:
    """Return the file of a mesh that a URDF in `folder` names, with a known ending; None where it is not there.

    `package://arm/meshes/a.stl` is looked for in the folder `arm` above, then beside the URDF and above it.
    """
    inner = name.removeprefix("file://")
    places = [folder / inner]
    if name.startswith("package://"):
        package_name, _, inner = name.removeprefix("package://").partition("/")
        above = [folder.absolute(), *folder.absolute().parents]
        places = [up / inner for up in above if up.name == package_name]
        places += [folder / inner, folder.absolute().parent / inner]
    known = (place for place in places if place.suffix.lower() in _MESHES and is_file(place))
    return next(known, None) if inner else None


def _taken_out(root: ElementTree.Element, folder: Path) -> Iterator[str]:
    """Take out what a robot file has no place for, and yield words for each."""
    for element in list(root):
        if element.tag not in _KNOWN_CHILDREN:
            yield _words(element)
            root.remove(element)
            continue
        here = f"{element.tag} {shorten(element.get('name'))}"
        for key in [key for key in element.attrib if key not in _KNOWN_ATTRIBUTES[element.tag]]:
            yield f'{here}: {key}="{shorten(element.attrib.pop(key))}"'
        if _is_locked(element):
            element.set("type", "fixed")
            yield f"{here}: how it would move, since its limits lock it at 0: it is fixed here"
        for child in list(element):
            if child.tag not in _KNOWN_CHILDREN[element.tag]:
                yield f"{here}: {_words(child)}"
                element.remove(child)
            elif child.tag == "dynamics":
                for key in [key for key in child.attrib if key not in ("damping", "friction")]:
                    if (value := child.attrib.pop(key)) not in ("0", "0.0"):
                        yield f'{here}: {key}="{shorten(value)}"'
            elif child.tag in ("collision", "visual"):
                for more in [part for part in child if part.tag not in ("origin", "geometry")]:
                    yield f"{here}: {child.tag}: {_words(more)}"
                    child.remove(more)
        yield from (f"{here}: {words}" for words in _unused(element, folder))


def _is_locked(element: ElementTree.Element) -> bool:
    """Whether it is a joint whose limits are both given as 0."""
    limit = element.find("limit")
    ends = () if limit is None else (limit.get("lower"), limit.get("upper"))
    try:
        return element.get("type") in ("revolute", "prismatic") and [float(end or "nan") for end in ends] == [0.0, 0.0]
    except ValueError:
        return False


def _unused(link: ElementTree.Element, folder: Path) -> Iterator[str]:
    """Keep the shapes of a link's collision geometry or, where none is known, of its visual one; yield the rest."""
    bodies = {tag: [body for body in link if body.tag == tag] for tag in ("collision", "visual")}
    chosen = next(
        (tag for tag, bodies_of_tag in bodies.items() if any(_is_known(body, folder) for body in bodies_of_tag)), None
    )
    for tag, bodies_of_tag in bodies.items():
        for body in bodies_of_tag:
            if tag == chosen and _is_known(body, folder):
                continue
            shapes = [_words(shape) for geometry in body.findall("geometry") for shape in geometry]
            yield f"{tag} {', '.join(shapes) or 'without a shape'}"
            link.remove(body)


def _is_known(body: ElementTree.Element, folder: Path) -> bool:
    """Whether it has a primitive, or a mesh whose file is there."""
    geometry = body.find("geometry")
    shapes = [] if geometry is None else list(geometry)
    meshes = (shape.get("filename", "") for shape in shapes if shape.tag == "mesh")
    return any(shape.tag in _PRIMITIVES for shape in shapes) or any(mesh_file(name, folder) for name in meshes)


def _words(element: ElementTree.Element) -> str:
    """Return the name and the attributes of an element, on one line."""
    tag = str(element.tag).rpartition("}")[2]
    return shorten(" ".join([tag, *(f'{key}="{value}"' for key, value in element.attrib.items())]), 200)


def _named(root: ElementTree.Element, tag: str, source: str) -> dict[str, Any]:
    """Return the links or the joints of a file, as the parser reads them, by name."""
    named: dict[str, Any] = {}
    for element in root.findall(tag):
        name = element.get("name")
        here = f"{tag} {shorten(name)}" if name else tag
        if not name:
            raise InputError("has no name.", file=source, field=here)
        if name in named:
            raise InputError(f"there are two {tag}s of this name. Names must differ.", file=source, field=here)
        if tag == "joint" and element.get("type") not in JOINT_TYPES:
            why = f'"{shorten(element.get("type"))}" is no type of joint. Known: {", ".join(JOINT_TYPES)}.'
            raise InputError(why, file=source, field=f"{here}, type")
        named[name] = _parsed(element, source, here)
    return named


def _parsed(element: ElementTree.Element, source: str, here: str) -> Any:
    """Return a link or joint of the parser; its complaints become InputErrors."""
    parser, core = package("urdf_parser_py.urdf", "urdf"), package("urdf_parser_py.xml_reflection.core", "urdf")
    kind = parser.Link if element.tag == "link" else parser.Joint
    try:
        with _strict(core):
            return kind.from_xml(element, core.Path(element.tag))
    except Exception as error:  # it raises plain ones, without a place where a value is missing
        why = getattr(error, "e", error)
        if isinstance(why, TypeError | AttributeError):  # it took None for text
            why = "a value is missing in one of its elements"
        elif isinstance(why, AssertionError) and "vector" in str(why):
            why = "a row of numbers has too few or too many, three are expected"
        text = shorten(str(why), 200).rstrip(".")
        raise InputError(f"cannot be read: {text}.", file=source, field=here) from None


@contextmanager
def _strict(core: Any) -> Iterator[None]:
    """Have the parser raise what it would write to stderr."""

    def complain(message: str) -> None:
        raise ValueError(message)

    before, core.on_error = core.on_error, complain
    try:
        yield
    finally:
        core.on_error = before
