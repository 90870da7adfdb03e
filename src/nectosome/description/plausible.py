"""Values that no material, no water and no robot has, most often by a wrong unit; threads outside of rods; no wake."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from nectosome.description.cranks import LegLoad
from nectosome.description.drag import PlateDragLoad
from nectosome.description.drives import MotorDescription, MotorDrive
from nectosome.description.foil_planform import FoilLoad
from nectosome.description.joints import Flexure, RevoluteJoint
from nectosome.description.left_open import THICK, thickness
from nectosome.description.loads import AddedMassLoad, CylinderAddedMassLoad, DragLoad, TrailingEdgeLoad
from nectosome.description.mass_and_size import not_inside
from nectosome.description.mesh_added_mass import MeshAddedMassLoad, told_of_thin
from nectosome.description.meshes import MeshShape
from nectosome.description.mirror import opposite
from nectosome.description.pairs import ContactPair
from nectosome.description.parts import Rigid, Rod, SoftPlate
from nectosome.description.plates import PlateShape
from nectosome.description.robot import RobotDescription
from nectosome.description.rod_loads import ChamberLoad, MuscleLoad, TendonLoad
from nectosome.description.rod_matter import InnerSection
from nectosome.description.water import WaterDescription
from nectosome.io.schema.quantity import Quantity
from nectosome.io.schema.structure import numeric_paths, numeric_values, value_at
from nectosome.units import format_quantity, show_quantity

if TYPE_CHECKING:
    import numpy as np
    from jaxtyping import Float

_MOST_VOLTAGE = 1.4  # of the rated one: makers of hobby servos give torque up to 7.4 or 8.4 V beside that at 6 V
_GAP = 5e-3  # [m] between the stiff parts of a hinge of silicone, as an example
_THIN = 0.1  # thickness over the shorter side from which on plates no longer bend as thin ones (Timoshenko 1959)
_LONG_WAVES = 5.0  # times as long as a body that does not scatter them (DNV-RP-C205)
_PLACES = 41  # along a thread, at which it is looked at


class Known(NamedTuple):
    """The range of a field of some classes [SI], and what lies at its ends."""

    owners: tuple[type, ...]
    field: str
    low: float
    high: float
    what: str


_KNOWN = (
    # sea water 1020 to 1030 kg/m3 (TEOS-10), the Dead Sea 1240 kg/m3
    Known((WaterDescription,), "density", 950.0, 1300.0, "water, fresh to saturated with salt"),
    # boiling water has 0.28 mPa s, glycerine 1.4 Pa s, silicone oils of experiments with helices up to 100 Pa s
    Known((WaterDescription,), "viscosity", 2e-4, 200.0, "liquids, boiling water to silicone oil"),
    # 1.6 m/s2 on the Moon, 24.8 m/s2 on Jupiter (NASA planetary fact sheets); 0 leaves weight and buoyancy out
    Known((WaterDescription,), "gravity", 0.0, 25.0, "planets"),
    # tidal currents reach 11 m/s at Saltstraumen
    Known((WaterDescription,), "current", -12.0, 12.0, "the strongest tidal currents"),
    # polymer foams from 10 kg/m3 (Gibson and Ashby 1997), osmium 22590 kg/m3
    Known((Rigid, Rod, SoftPlate, InnerSection), "density", 10.0, 23e3, "materials, foam to osmium"),
    # hydrogels from 0.1 kPa (Ashby 2011), tungsten 411 GPa; rubbers 0.5 to 100 MPa
    Known((Rod, SoftPlate, InnerSection, Flexure), "young", 100.0, 420e9, "materials, gels to tungsten"),
    # silicones have 10 to 1e5 Pa s
    Known((Rod, SoftPlate, InnerSection), "damping", 0.0, 1e7, "soft materials"),
    # cylinders and plates across a stream have 0.6 to 2 (Hoerner 1965, ch. 3); in oscillating flow up to about 5
    Known((DragLoad, PlateDragLoad), "normal", 0.0, 6.0, "cylinders and plates"),
    # skin friction coefficients are at most some hundredths (Hoerner 1965, ch. 2)
    Known((DragLoad,), "tangential", 0.0, 1.0, "slender bodies"),
    # 1 of a slender body, 2.23 of a cube by its volume (Newman 1977)
    Known((AddedMassLoad,), "normal", 0.0, 5.0, "bodies in unbounded water"),
    Known((CylinderAddedMassLoad,), "coefficient", 0.0, 5.0, "bodies in unbounded water"),
    # rubber on dry concrete reaches about 1.2
    Known((LegLoad, ContactPair), "static_friction", 0.0, 3.0, "dry friction"),
    Known((LegLoad, ContactPair), "dynamic_friction", 0.0, 3.0, "dry friction"),
    # the largest animals have 30 m, flagella of bacteria some micrometres
    Known((Rigid, Rod, SoftPlate), "length", 1e-6, 100.0, "swimmers, bacteria to whales"),
    Known((PlateShape,), "outline", -100.0, 100.0, "swimmers, bacteria to whales"),
    Known((Rigid, Rod), "radius", 1e-8, 20.0, "swimmers, bacteria to whales"),
)


# by dimension, for all fields of it: the least and the largest size [SI] that robots, bacteria and ships have, and what
# lies at these ends; wide, so that what is outside has no meaning for any robot, however small or large
_ORDINARY = {
    "number": (0.0, 1e9, "plain numbers"),  # gains, ratios, coefficients; added masses of a matrix
    "length": (1e-10, 12e3, "lengths, an atom to the deepest sea"),
    "area": (1e-20, 1e6, "areas, a molecule to a harbour"),
    "volume": (1e-22, 1e6, "volumes, a virus to a ship"),
    "mass": (1e-20, 1e9, "masses, a virus to a ship"),
    "density": (1e-10, 1e5, "densities, high vacuum to metals"),  # air at 1e-5 Pa
    "inertia": (1e-36, 1e13, "moments of inertia, a virus to a ship"),
    "pressure": (1e-3, 2e12, "pressures and moduli, films of a cell to diamond"),  # diamond 1.05 TPa
    "elastance": (1e-3, 1e22, "elastances, a balloon to a cell"),
    "viscosity": (1e-6, 1e12, "viscosities, gases to glass"),  # 1e12 Pa s: glass that sets
    "angle": (0.0, 1e6, "angles"),
    "curvature": (0.0, 1e9, "curvatures, down to radii of a molecule"),
    "time": (1e-9, 1e8, "times, nanoseconds to years"),
    "frequency": (1e-8, 1e8, "frequencies, a beat in a year to radio"),
    "angular_speed": (1e-8, 1e6, "speeds of turning"),  # dentists' drills have 5e4 rad/s
    "speed": (1e-12, 1500.0, "speeds below that of sound in water"),
    "acceleration": (1e-9, 1e6, "accelerations"),
    "force": (1e-16, 1e9, "forces, a protein to a ship"),  # molecular motors 5e-12 N, ships' propellers 3e6 N
    "torque": (1e-21, 1e9, "torques, thermal motion to a ship"),  # k T = 4e-21 J; flagellar motors 4e-18 N m
    "power": (1e-21, 1e10, "powers, a protein to a power station"),
    "line_force": (1e-12, 1e9, "forces per length, a cell to a ship"),
    "angular_stiffness": (1e-22, 1e13, "springs, a molecule to a bridge"),
    "angular_damping": (1e-26, 1e13, "dampers, a molecule in water to a bridge"),
    "stiffness": (1e-10, 1e13, "springs, a molecule to a block of steel"),  # 1 m of steel: 2e11 N/m
    "damping": (1e-14, 1e13, "dampers, a molecule in water to a bridge"),
    "quadratic_drag": (1e-18, 1e9, "drags, a cell to a harbour"),
    "voltage": (1e-9, 1e7, "voltages, a nerve's noise to a power line"),
    "current": (1e-12, 1e6, "currents, a cell's channel to a smelter"),
    "resistance": (1e-9, 1e15, "resistances, a bus bar to an insulator"),
    "torque_constant": (1e-12, 1e6, "motors, of a watch to a ship"),
    "charge": (1e-12, 1e10, "charges, a cell to a power station"),
    "energy": (1e-21, 1e15, "energies, thermal motion to a power station"),
    "curvature_rate": (0.0, 1e12, "rates of curvature"),
    "strain_rate": (0.0, 1e7, "rates of strain, up to shocks"),
    "pressure_rate": (1e-9, 1e15, "rates of pressure, a tide to a shock"),
    "force_rate": (1e-20, 1e12, "rates of force, a cell to a blow"),
    "torque_rate": (1e-25, 1e12, "rates of torque, a cell to a blow"),
    "voltage_rate": (1e-12, 1e12, "rates of voltage, a battery to a switch"),
}


def implausible(description: RobotDescription) -> Iterator[tuple[str, str]]:
    """Yield paths with a sentence: what no material, no water and no robot has, threads outside of rods, no wake, odd
    motors, short waves, what was found in meshes, mass outside of parts. Of a row of numbers the first alone is told.
    """
    yield from _without_wake(description)
    yield from _in_short_waves(description)
    for powered in description.powered.values():
        yield from _overdriven(description, *powered)
    for name, part in description.parts.items():
        if isinstance(part, Rod):
            yield from _outside(part, description.place_of(name))
        if isinstance(part, SoftPlate):
            yield from _thick(part, description.place_of(name))
        yield from _planform(description, name)
    yield from _of_any_robot(description)
    yield from _far_out(description, _KNOWN)


def meaningless(description: RobotDescription) -> Iterator[tuple[str, str]]:
    """Yield paths with a sentence for values that no robot at all has, odd meshes, masses outside of parts, and
    flexures without their gap."""
    yield from _of_any_robot(description)
    yield from _far_out(description, ())


def _of_any_robot(description: RobotDescription) -> Iterator[tuple[str, str]]:
    yield from _in_meshes(description)
    yield from not_inside(description)
    yield from _without_gap(description)


def _in_meshes(description: RobotDescription) -> Iterator[tuple[str, str]]:
    """What was found in files of meshes, and repaired; and those too thin for the panels of their added mass."""
    for name, part in description.parts.items():
        if isinstance(part, Rigid) and isinstance(part.shape, MeshShape):
            path, known = description.place_of(name), part.shape.numbers
            yield from ((f"{path}.shape", f"{part.shape.mesh}: {told}") for told in known.told)
            for load, one in part.loads.items():
                if isinstance(one, MeshAddedMassLoad) and (told := told_of_thin(known, one.panels)) is not None:
                    yield f"{path}.loads.{load}", f"{part.shape.mesh}: {told}"


def _without_gap(description: RobotDescription) -> Iterator[tuple[str, str]]:
    """The first flexure that has a length as printed, and how much more strain a gap of the same stiffness has."""
    for name, part in description.parts.items():
        strip = part.joint.flexure if isinstance(part.joint, RevoluteJoint) else None
        if strip is not None and strip.as_printed is not None:
            more = (strip.bent_length / _GAP) ** (2 / 3)  # angle h / 2 g, h as the cube root of g at one stiffness
            shown, gap = (show_quantity(x, "length") for x in (strip.as_printed, _GAP))
            words = (
                f"its strain is that of a strip of {shown}: a gap of {gap} of the same stiffness has {more:.2g} times"
            )
            yield f"{description.place_of(name)}.joint.flexure.as_printed", f"{words} as much. Give the gap instead."
            return


def _far_out(description: RobotDescription, rows: tuple[Known, ...]) -> Iterator[tuple[str, str]]:
    """Values outside of the range of their field, if a row has one, or else of their dimension.

    A signed one has no smallest size: it may be a zero that was rounded.
    """
    told, named = set(), {known.field for known in rows}
    quantities = numeric_paths(description)
    for path, value in numeric_values(description).items():
        owner, _, field = path.rpartition(".")
        while field.isdigit():
            owner, _, field = owner.rpartition(".")
        if (owner, field) in told:
            continue
        quantity, own = quantities[path], None
        if field in named:
            group = value_at(description, owner) if owner else description
            own = next((known for known in rows if field == known.field and isinstance(group, known.owners)), None)
        low, high, what = (own.low, own.high, own.what) if own else _ORDINARY[quantity.dimension]
        size = value if own else abs(value)
        small = size < low and (own is not None or (size > 0 and quantity.minimum == 0))
        if small or size > high:
            told.add((owner, field))
            shown = format_quantity(value, quantity.dimension)
            least, most = (_limit(x, quantity, own is not None) for x in (low, high))
            yield path, f"{shown} is far outside of {what} ({least} to {most}). Check the value and its unit."


def _limit(x: float, quantity: Quantity, exactly: bool) -> str:
    """A limit as text; the wide ones of a dimension as powers of ten of its SI unit."""
    if exactly:
        return format_quantity(x, quantity.dimension)
    return f"{x:g} {quantity.unit}".rstrip().replace("e+", "e")


def _without_wake(description: RobotDescription) -> Iterator[tuple[str, str]]:
    """A body that bends itself from head to tail, with strips of added mass, but no trailing edge and no fin."""
    body = description.body
    if isinstance(body, Rod):
        kinds = {type(load) for load in body.loads.values()}
        bends = MuscleLoad in kinds or any(value is not None for _, value in body.motion)
        bends = bends or bool(body.drive.given)
        finned = any(isinstance(load, FoilLoad) for part in description.parts.values() for load in part.loads.values())
        if bends and AddedMassLoad in kinds and TrailingEdgeLoad not in kinds and not finned:
            words = "it bends itself and has added mass, but no trailing_edge: it will hardly get thrust from the water"
            yield "body.loads", f"{words} that its tail leaves behind."


def _in_short_waves(description: RobotDescription) -> Iterator[tuple[str, str]]:
    """Waves that are short against rigid parts, which are taken as if the water moved alike all over them."""
    sizes = {name: _reach(part) for name, part in description.parts.items() if isinstance(part, Rigid)}
    longest = max(sizes, key=lambda name: sizes[name], default=None)
    for name, flow in description.water.flows.items():
        length = flow.wavelength(*description.water.around_waves)
        if longest is not None and length is not None and sizes[longest] > length / _LONG_WAVES:
            shown = [show_quantity(size, "length") for size in (length, sizes[longest])]
            words = f"these waves are {shown[0]} long, and {longest} has {shown[1]}: more than a fifth of that."
            yield f"water.flows.{name}", f"{words} They act on it as on a short part, without the waves that it makes."


def _reach(part: Rigid) -> float:
    """Largest of its sizes [m]."""
    return max((part.size(name) or 0.0 for name in ("length", "width", "height")), default=0.0)


def _planform(description: RobotDescription, name: str) -> Iterator[tuple[str, str]]:
    """Sections along the span of a fin that is deeper than high; the start-up of plates on a bar."""
    part = description.parts[name]
    for key, load in part.loads.items():
        path = f"{description.place_of(name)}.loads.{key}"
        if isinstance(load, FoilLoad) and not FoilLoad.aspect_ratios.holds(load.ratio(part)):
            words = f"its aspect ratio is {load.ratio(part):.2g}, where lift is that of a slender body"
            yield path, f"{words}. Take added_mass, drag and a trailing_edge, on a box or a rod."
        if isinstance(load, PlateDragLoad) and load.start_up is not None and thickness(part) > THICK:
            words = f"its part is {thickness(part):.2g} times as thick as high, and this is the law of thin plates"
            yield f"{path}.start_up", f"{words}, whose sharp edges shed more. Write none."


def _thick(plate: SoftPlate, path: str) -> Iterator[tuple[str, str]]:
    """A plate that is no thin one."""
    length, width, thick = plate.mean_sizes
    if thick > _THIN * min(length, width):
        words = f"its mean thickness is {format_quantity(thick, 'length')}, more than a tenth of its shorter side"
        yield f"{path}.thickness", f"{words}, and a soft plate bends as a thin one, without shear. Take a rod."


def _overdriven(description: RobotDescription, path: str, drive: MotorDescription) -> Iterator[tuple[str, str]]:
    """A motor without a rotor, one whose gear would lock, and one at a voltage far above that of its data sheet."""
    if drive.inertia == 0:
        words = "0 kg m2: a rotor behind its gear often has more inertia at the joint than the limb has"
        yield (
            f"{path}.inertia",
            f"{words}; without one a motor starts too briskly. Give its own times the square of the ratio.",
        )
    if drive.efficiency < 0.5:
        passed = 1 / (2 - drive.efficiency)
        words = "a gear that loses as much by its teeth locks against its load, where here"
        way_out = "Give the friction that holds it, at the shaft"
        yield f"{path}.efficiency", f"{words} {passed:.0%} of the load reach the motor. {way_out}."
    voltage = description.supply_voltage(drive)
    if voltage is not None and isinstance(drive, MotorDrive) and drive.voltage is not None:
        most = max(-drive.voltage.least(), -opposite(drive.voltage).least())
        if most > voltage:
            asked, given = (format_quantity(x, "voltage") if x < math.inf else "any voltage" for x in (most, voltage))
            yield f"{path}.voltage", f"it goes up to {asked}, and its supply gives {given}, which it gets instead."
    if voltage is not None and drive.rated_voltage is not None and voltage > _MOST_VOLTAGE * drive.rated_voltage:
        shown, rated = (format_quantity(x, "voltage") for x in (voltage, drive.rated_voltage))
        yield f"{path}.rated_voltage", f"it is supplied by {shown}, far above the {rated} of its data sheet."


def _outside(rod: Rod, path: str) -> Iterator[tuple[str, str]]:
    """Tendons and chambers that leave their rod's sections, each with the place where it is farthest out."""
    import numpy as np

    threads = {name: load for name, load in rod.loads.items() if isinstance(load, TendonLoad | ChamberLoad)}
    for name, load in threads.items():
        start, end = load.along
        inner = [section.at for section in rod.between if start < section.at < end]
        x = np.unique([*np.linspace(start, end, _PLACES), *inner])
        share = (x - start) / (end - start)
        root, tip = np.array(load.place), np.array(load.tip_place or load.place)
        place, sizes = root + (tip - root) * share[:, None], _half_sizes(rod, x)
        filled = np.abs(place) / sizes
        out = filled.max(axis=1) if rod.section == "rectangle" else np.hypot(*filled.T)
        k = int(out.argmax())
        if out[k] <= 1 + 1e-9:
            continue
        away, y, z = (show_quantity(float(v), "length") for v in (np.hypot(*place[k]), *sizes[k]))
        has = f"its radius there is {y}" if rod.section == "circle" else f"its half sizes there are {y} and {z}"
        field = "tip_place" if load.tip_place and share[k] > 0.5 else "place"
        yield (
            f"{path}.loads.{name}.{field}",
            f"{away} from the axis at {100 * x[k]:.3g} % of the length it runs outside of the rod: {has}. "
            "Give a tip_place where the rod tapers, or smaller offsets; if discs guide it outside, all is well.",
        )


def _half_sizes(rod: Rod, x: "Float[np.ndarray, 'n']") -> "Float[np.ndarray, 'n 2']":
    """Half sizes of the sections along y and z [m] at fractions of the length."""
    import numpy as np

    def along(name: str) -> np.ndarray:
        places, values = zip(*rod.sections(name), strict=True)
        return np.interp(x, places, values)

    if rod.section == "circle":
        return np.stack([along("radius")] * 2, axis=1)
    return np.stack([along("width"), along("height")], axis=1) / 2
