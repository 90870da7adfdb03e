"""From a description to a robot: masses, inertias and stiffnesses follow from the primary quantities, traced.

Every number of the description may be a JAX tracer; only names, kinds and counts are looked at while tracing.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import groupby
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome import loads as ld
from nectosome.core import Constant, Drive, PairLoad, Signal, Stack, State, Stations, Water, current_of, signal_of
from nectosome.core.described import class_for, is_zero, number, numbers, vector
from nectosome.core.programs.remember import remembered
from nectosome.core.rows import on_device
from nectosome.core.se3 import rotation_from_rpy
from nectosome.core.tracers import Untraced, traced
from nectosome.description import (
    STRAIN_NAMES,
    JointDescription,
    RobotDescription,
    SignalDescription,
    get_value,
    numeric_values,
    resolve,
    with_values,
    without_ramps,
)
from nectosome.description import parts as dp
from nectosome.description.drives import BatteryDescription
from nectosome.description.own_rows import BUOYANCY, MEMBRANE, VISCOUS, WEIGHT
from nectosome.io.discovery import load_modules
from nectosome.io.schema.quantity import Uncertain
from nectosome.io.schema.structure import changed
from nectosome.loads.places import Carrier, SheetCarrier
from nectosome.mechanism import (
    Attached,
    Attachment,
    Battery,
    Joint,
    Link,
    Paired,
    PoweredDrives,
    Robot,
    SoftRod,
    TreePart,
    make_robot,
    make_rod,
    node_at,
    shapes,
)
from nectosome.mechanism.extent import unbent
from nectosome.mechanism.rod_matter import matter_at
from nectosome.mechanism.rods import (
    driven_shapes,
    prescribed_strains,
    start_of_strains,
    strain_rows,
)
from nectosome.mechanism.soft_bodies import SoftBody
from nectosome.mechanism.tree import Tree

from .build_loads import joint_loads, load_of, tendon_of
from .build_soft_plates import soft_plate
from .build_webs import check_gaps, web_part
from .inputs import RobotLike, description_of

_LONG = 32  # numbers
load_modules("nectosome.drives")


def build(robot: RobotLike) -> Robot:
    """Robot of a description, or of what names one; differentiable with respect to every number in a description.

    Compiled once for each structure: numbers that are zero are part of it, all others are traced. The robot carries
    its description, unless numbers in it are traced. Raises InputError for what is no robot, and for a web without a
    gap between its limbs.
    """
    description = description_of(robot)
    values = numeric_values(description)
    if traced(values):
        return _assemble(description)
    built = remembered(instantiate, *_template(description, values, ()))
    check_gaps(description, built)
    arrays = {path: float(value) for path, value in values.items() if type(value) not in (float, Uncertain)}
    return built.described(changed(description, arrays) if arrays else description)


def robot_of(robot: RobotLike, settings: Iterable[str] = ()) -> Robot:
    """Built robot of a name, path, description or built robot, which is handed back as it is without `settings`.

    Raises InputError as `description_of` does.
    """
    if isinstance(robot, Robot) and not settings:
        return robot
    return build(description_of(robot, settings))


def robot_without_ramps(robot: Robot) -> Robot:
    """The robot without the ramps of its drives, as in the motion that it comes to; without a description as it is."""
    if traced(robot):
        has_ramp = lambda x: isinstance(x, Signal) and getattr(x, "ramp", None) is not None  # noqa: E731
        bare = jax.tree.map(lambda x: replace(x, ramp=None) if has_ramp(x) else x, robot, is_leaf=has_ramp)
        like = robot.example.value
        return replace(bare, made_from=robot.made_from, example=Untraced(like and robot_without_ramps(like)))
    before = robot.description
    after = None if before is None else without_ramps(before)
    return robot if after is None or after is before else build(after)


class Template(eqx.Module):
    """A description without its numbers: what of a robot is structure, the same for all robots of one kind."""

    plan: "_Plan" = eqx.field(static=True)

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the numbers that are to be filled in."""
        return self.plan.paths


class _Plan:
    """A description to be filled with other numbers at `paths`; equal where all the rest is."""

    def __init__(self, description: RobotDescription, paths: tuple[str, ...]):
        self.description, self.paths, self.rows = description, paths, _rows(paths)
        models = {f"{powered.path}.model": None for powered in description.powered.values()}
        bare = changed(description, dict.fromkeys(paths, 1.0) | models)  # a motor is what its sheet says
        whole = bare.model_dump_json(exclude={"name", "about", "aliases", "correlations"})
        self.key = whole + "".join(str(web.turn) for web in description.webs.values() if web.turn is not None)

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Plan) and self.key == other.key

    def __repr__(self) -> str:
        return self.key


def template_of(description: RobotDescription, also: tuple[str, ...] = ()) -> tuple[Template, Float[Array, "n"]]:
    """Template of a description, and its numbers: those that are not zero, and those at the paths `also`."""
    return _template(description, numeric_values(description), also)


def _template(
    description: RobotDescription, values: dict[str, Any], also: tuple[str, ...]
) -> tuple[Template, Float[Array, "n"]]:
    whole = {path for row, ends in _rows(tuple(values)).items() for path in tuple(values)[ends]}
    paths = tuple(path for path, value in values.items() if value != 0 or path in also or path in whole)
    return Template(_Plan(description, paths)), on_device([float(values[path]) for path in paths])


def instantiate(template: Template, numbers: Float[Array, "n"] | Sequence[Float[Array, ""]]) -> Robot:
    """Robot of a template with these numbers, traced.

    Numbers one by one let a loop in which some of them change work out once what the others say.
    """
    plan = template.plan
    values: dict[str, Any] = {path: numbers[k] for k, path in enumerate(plan.paths)}
    for row, ends in plan.rows.items():
        of_points = plan.paths[ends.start].removeprefix(f"{row}.").count(".")
        values = {path: value for path, value in values.items() if not path.startswith(f"{row}.")}
        found = jnp.stack(list(numbers[ends])) if isinstance(numbers, Sequence) else numbers[ends]
        values[row] = found.reshape(-1, 2) if of_points else found
    return _assemble(changed(plan.description, values))


def _rows(paths: tuple[str, ...]) -> dict[str, slice]:
    """Where the numbers of long rows stand, such as samples and points: they are filled in at once, not one by one."""
    grouped = groupby(enumerate(paths), lambda at: at[1].rpartition(".")[0])
    rows = [(row, [k for k, path in group if path.rpartition(".")[2].isdigit()]) for row, group in grouped]
    points = [(row.rpartition(".")[0], own) for row, own in rows if row.rpartition(".")[2].isdigit() and len(own) == 2]
    rows += [(row, [k for _, own in group for k in own]) for row, group in groupby(points, lambda point: point[0])]
    return {row: slice(places[0], places[-1] + 1) for row, places in rows if len(places) >= _LONG}


def _assemble(d: RobotDescription) -> Robot:
    weighs = not (isinstance(d.water.gravity, float) and d.water.gravity == 0.0)
    current = current_of(d.water)
    surface = None if d.water.surface is None else number(d.water.surface)
    floor = None if d.water.floor is None else number(d.water.floor)
    walls = None if d.water.walls is None else (number(d.water.walls[0]), number(d.water.walls[1]))
    viscosity = number(d.water.viscosity)
    water = Water(number(d.water.density), number(d.water.gravity), surface, current, floor, walls, viscosity)

    order = list(d.parts)
    parts: list[TreePart] = []
    attached: list[Attached] = []
    powered: list[Attachment] = []
    carriers: dict[str, Carrier | SheetCarrier] = {}
    meshes = sum(isinstance(limb, dp.Rigid) and limb.form == "mesh" for limb in d.parts.values())
    for i, (name, limb) in enumerate(d.parts.items()):
        parent = -1 if name == "body" or limb.on == "world" else order.index(limb.on)
        strain_indices: tuple[int, ...] = ()
        strain_signals: tuple[Signal, ...] = ()
        strain_start: Array | None = None
        buoyancy = ld.Buoyancy()
        if isinstance(limb, dp.Rod):
            body, stations = _rod(limb)
            strain_indices, strain_signals = prescribed_strains(limb, body)
            strain_start = start_of_strains(limb, body)
            carriers[name] = Carrier(limb, body, stations)
        elif isinstance(limb, dp.SoftPlate):
            body, carriers[name] = soft_plate(limb)
            stations = carriers[name].stations
        else:
            shape = shapes.shape_of(limb)
            body, stations = shape.built(water)
            carriers[name] = Carrier(limb, body, stations)
            wet = None if water.surface is None else shape.wet_triangles(meshes)
            buoyancy = ld.Buoyancy() if wet is None else ld.MeshBuoyancy(*wet)
        parts.append(
            TreePart(
                name=name,
                parent=parent,
                node=-1 if parent < 0 else node_at(parts[parent].body, limb.at),
                rotation=rotation_from_rpy(vector(limb.rotation)),
                position=vector(limb.offset),
                joint=_joint(limb.joint),
                body=body,
                stations=stations,
                prescribed=None if getattr(limb.joint, "servo", None) else _signal(getattr(limb.joint, "motion", None)),
                drive=_signal(getattr(limb.joint, limb.joint.drive_field, None)),
                prescribed_strains=strain_indices,
                strain_signals=strain_signals,
                strain_start=strain_start,
            )
        )
        for key, load in limb.loads.items():
            turned_by = getattr(load, "turned_by", None)
            crank = -1 if turned_by is None else order.index(turned_by)
            attached.append(Attached(key, i, load_of(load, carriers[name]), crank))
        if isinstance(limb, dp.Rod) and (constant := limb.constant_loss) is not None:
            assert isinstance(body, SoftRod)
            held = body.start() if strain_start is None else strain_start[0]
            if strain_indices:
                first = jnp.concatenate([jnp.ravel(signal(jnp.zeros(()))[0]) for signal in strain_signals])
                held = held.at[np.array(strain_indices)].set(first)
            attached.append(Attached(VISCOUS, i, ld.Relaxation.of(body, constant, held)))
        attached += joint_loads(limb.joint, i)
        powered += _powered(limb, i, body, d)
        if weighs and not (isinstance(limb, dp.Rigid) and is_zero(limb.mass)):
            attached.append(Attached(WEIGHT, i, ld.Weight()))
        if (weighs or current is not None) and not (isinstance(limb, dp.Rigid) and is_zero(limb.volume)):
            attached.append(Attached(BUOYANCY, i, buoyancy))
    for name, web in d.webs.items():
        tree = Tree.of(parts[: len(order)])
        joined = {limb: one for limb in web.between if isinstance(one := carriers.get(limb), Carrier)}
        part, sheet, tension = web_part(name, web, joined, tree, unbent(tree, State(*tree.start(), ())))
        loads = {key: load_of(load, sheet) for key, load in web.loads.items()} | {MEMBRANE: tension}
        loads |= {WEIGHT: ld.Weight()} if weighs else {}
        loads |= {BUOYANCY: ld.Buoyancy()} if weighs or current is not None else {}
        attached += [Attached(key, len(parts), load) for key, load in loads.items()]
        parts.append(part)
    pairs = []
    for name, pair in d.pairs.items():
        acting = class_for(pair, PairLoad).from_description(pair, *(carriers[part] for part in pair.between))
        first, second = map(order.index, pair.between)
        pairs.append(Paired(name, (first, second), acting))
    batteries = {name: _battery(one) for name, one in d.batteries.items()}
    tendons = [tendon_of(name, tendon, order) for name, tendon in d.tendons.items()]
    drives = PoweredDrives.of(powered, batteries)
    robot, length, tail = make_robot(parts, attached, water, pairs, drives, tendons, d.forward), *_reference(d)
    return replace(robot, length=length, tail=tail, body_length=robot.body_length if length is None else length)


def _reference(d: RobotDescription) -> tuple[Any, int | None]:
    """Given length of the body [m], and the part that is its tail; None where they are not given."""
    length, tail = d.reference.length, d.reference.tail
    places = [d.place_of(part) for part in d.parts]
    return None if length is None else number(length), None if tail is None else places.index(tail)


def _battery(d: BatteryDescription) -> Battery:
    energy = number(np.nan if d.stored is None else d.stored)
    own = numbers(d, "voltage", "resistance", "idle_power")
    return Battery(**own, regenerative=number(float(d.regenerative)), energy=energy)


def _powered(limb: dp.Limb, part: int, body: SoftBody | Link, d: RobotDescription) -> Iterator[Attachment]:
    """The servo or motor of a joint, and those of a rod's strains, with their supplies."""
    moved = {-1: limb.joint}
    if isinstance(limb, dp.Rod) and isinstance(body, SoftRod):
        moved |= {strain_rows(body, name)[0]: strain for name, strain in limb.drive.given.items()}
    for strain, one in moved.items():
        described, motion = one.powered, getattr(one, "motion", None)
        if described is not None:
            reference = () if motion is None else (signal_of(motion),)
            drive = class_for(described, Drive).from_description(described, *reference)
            battery = -1 if described.battery is None else [*d.batteries].index(described.battery)
            supply = None if described.supply is None else number(described.supply)
            yield Attachment(part, strain, battery, drive, supply)


def _joint(d: JointDescription) -> Joint:
    """Joint of a description; a servo starts at rest where its motion starts."""
    joint = class_for(d, Joint).from_description(d)
    servo, motion = getattr(d, "servo", None), getattr(d, "motion", None)
    if servo is None or motion is None:
        return joint
    begins = signal_of(motion)(jnp.zeros(()))[0]
    return eqx.tree_at(lambda j: j.position, joint, begins[None])


def bind(
    robot: RobotLike,
    paths: tuple[str, ...],
    log: tuple[str, ...] = (),
    tie: dict[str, str] | None = None,
) -> tuple[Float[Array, "n"], Callable[[Float[Array, "n"]], Robot]]:
    """Vector theta0 of the quantities of a robot at `paths` (or aliases), and build(theta) -> Robot.

    Those named in `log` enter theta as their natural logarithm; `tie` maps further paths to one of `paths`, whose
    value they then share. Both verbs and derivatives, batches and `jit` of them take build(theta), as in
    `jax.jacfwd(lambda theta: ns.steady(build(theta)).speed)(theta0)`. Raises InputError for what is no robot, for
    unknown names, and for a logarithm of what is not positive.
    """
    description = description_of(robot)
    groups = [list(resolve(description, path)) for path in paths]
    for other, leader in (tie or {}).items():
        groups[paths.index(leader)] += resolve(description, other)
    start = np.array([get_value(description, group[0]) for group in groups], dtype=float)
    logarithmic = np.array([path in log for path in paths])
    theta0 = np.where(logarithmic, np.log(np.where(logarithmic, start, 1.0)), start)
    owner = {path: k for k, group in enumerate(groups) for path in group}
    template, numbers = template_of(description, tuple(owner))  # bound quantities may be 0
    places = np.array([template.paths.index(path) for path in owner], dtype=int)
    example = cache(lambda: remembered(instantiate, template, numbers).described(description))

    def from_vector(theta: Float[Array, "n"]) -> Robot:
        values = jnp.where(logarithmic, jnp.exp(jnp.where(logarithmic, theta, 0.0)), theta)
        of_paths = values[np.array([*owner.values()], dtype=int)]
        robot = remembered(instantiate, template, numbers.at[places].set(of_paths))
        own = of_paths if traced(theta) else np.asarray(of_paths).tolist()
        robot = robot.described(with_values(description, dict(zip(owner, own, strict=True))))
        return replace(robot, example=Untraced(example())) if traced(theta) else robot

    return jnp.asarray(theta0), from_vector


def _signal(signals: Any) -> Signal | None:
    """Motion or drive of a joint; of one with several coordinates those that are not given stay at 0."""
    if signals is None or isinstance(signals, SignalDescription):
        return None if signals is None else signal_of(signals)
    each = [getattr(signals, name) for name in type(signals).model_fields]
    return Stack(tuple(Constant(jnp.zeros(())) if s is None else signal_of(s) for s in each))


def _rod(limb: dp.Rod) -> tuple[SoftRod, Stations]:
    """Soft rod and its stations, whose sections go over evenly from each one that is given to the next."""
    rest = {name: vector(getattr(limb.rest, name)) for name in STRAIN_NAMES if getattr(limb.rest, name)}
    return make_rod(
        length=number(limb.length),
        matter=partial(matter_at, limb),
        orders={**limb.strains},
        driven=driven_shapes(limb),
        rest=rest,
        points=limb.points,
        marks=limb.marks,
        bends=limb.kinks,
        steps=limb.steps,
    )
