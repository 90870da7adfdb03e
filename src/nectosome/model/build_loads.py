"""From a description to loads: what acts on parts, between them and along joints, and tendons.

The class of a load says which description it is `described_by`, and is found by that among the modules of `loads`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from nectosome import loads as ld
from nectosome.core import Constant, Cycle, Load, Recording, RodLoad, Signal
from nectosome.core.described import class_for, is_zero, number, numbers, vector
from nectosome.core.dry_friction import ANGLE_SLIP, LENGTH_SLIP
from nectosome.core.one_sided import depth_of_force
from nectosome.description import JointDescription, LoadDescription
from nectosome.description import joints as dj
from nectosome.description.own_rows import DAMPER, JOINT_FRICTION, SPRING, STOP
from nectosome.description.rod_loads import ChamberLoad, PlayHysteresis
from nectosome.description.tendons import TendonDescription, TendonGuides
from nectosome.drives import PrandtlIshlinskii, respond
from nectosome.io.discovery import load_modules
from nectosome.loads.places import Carrier, SheetCarrier
from nectosome.mechanism import Attached, Cord, Crank, JointTendon

_SAMPLES = 64  # of a cycle after hysteresis, joined by a spline

load_modules("nectosome.loads")


def load_of(described: LoadDescription, part: Carrier | SheetCarrier) -> Load | RodLoad:
    """Load of a description on a part, or on a sheet."""
    load = class_for(described, Load, RodLoad).from_description(described, part)
    if isinstance(load, ld.FluidChamber) and isinstance(described, ChamberLoad) and described.hysteresis is not None:
        return eqx.tree_at(lambda c: c.pressure, load, _after(described.hysteresis, load.pressure))
    return load


def joint_loads(j: JointDescription, part: int) -> Iterator[Attached]:
    """Spring, damper, dry friction and stops of a joint; left out where they are plainly zero."""
    flexure, stiffness = getattr(j, "flexure", None), getattr(j, "stiffness", 0.0)
    if flexure is not None:
        yield Attached(SPRING, part, _flexure_spring(flexure, number(getattr(j, "rest", 0.0))))
    elif not is_zero(stiffness):
        yield Attached(SPRING, part, ld.Spring(number(stiffness), number(getattr(j, "rest", 0.0))))
    damping = getattr(j, "damping", 0.0)
    if not is_zero(damping):
        yield Attached(DAMPER, part, ld.Damper(number(damping)))
    friction = getattr(j, "friction", 0.0)
    if not is_zero(friction):
        slip = LENGTH_SLIP if isinstance(j, dj.PrismaticJoint) else ANGLE_SLIP
        yield Attached(JOINT_FRICTION, part, ld.JointFriction(number(friction), number(slip)))
    for name, kind in (("lower", ld.LowerLimit), ("upper", ld.UpperLimit)):
        stop = getattr(j, name, None)
        if stop is not None:
            yield Attached(STOP, part, kind(**numbers(stop, *type(stop).model_fields)))


def tendon_of(name: str, d: TendonDescription, order: Sequence[str]) -> JointTendon:
    """Tendon over joints of parts, which stand in an `order`."""
    stiffness, softness, start = number(d.stiffness), number(d.softness), -number(d.slack)
    if not is_zero(d.pretension):
        start = start + depth_of_force(number(d.pretension), stiffness, softness)
    friction = None if is_zero(d.friction) else number(d.friction)
    cord = Cord(start, stiffness, number(d.damping), softness, friction)
    bows = tuple(_bow(one) if isinstance(one, TendonGuides) else None for one in d.over.values())
    pull, crank, arms = d.pulled_by, None, [0.0 if isinstance(one, TendonGuides) else one for one in d.over.values()]
    if pull is not None and pull.crank is not None:
        crank = Crank(*map(number, (pull.crank, pull.guide, pull.angle)))
        arms.append(0.0)
    elif pull is not None:
        wound = pull.ratio if pull.radius is None else pull.radius
        assert wound is not None
        arms.append(-wound)
    return JointTendon(name, tuple(order.index(part) for part in d.parts), vector(arms), bows, crank, cord)


def _bow(holes: TendonGuides) -> Array:
    """S, C, D [m2] of the square of the way between two holes, S + C cos q - D sin q."""
    (d, h), (e, i) = vector(holes.before), vector(holes.after)
    return jnp.stack([d**2 + h**2 + e**2 + i**2, 2 * (d * e - h * i), 2 * (d * i + e * h)])


def _flexure_spring(f: dj.Flexure, rest: Array) -> ld.Spring:
    """Spring of a strip, with strain and stress at its faces: angle times thickness / (2 length), times E."""
    strain = number(f.bent_thickness / (2 * f.bent_length))
    return ld.Spring(number(f.spring), rest, ld.FlexureSpring(strain, strain * f.young))


def _after(hysteresis: PlayHysteresis, pressure: Any) -> Signal:
    """What hysteresis makes of a pressure: at a recording's samples, and of a cycle that has been repeated before."""
    plays = PrandtlIshlinskii(number(hysteresis.direct), vector(hysteresis.thresholds), vector(hysteresis.weights))
    if isinstance(pressure, Constant):
        return Constant(respond(plays, pressure.value[None], 1.0)[0])
    if isinstance(pressure, Recording):
        return Recording(pressure.times, respond(plays, pressure.values, 1.0))
    one_a_second = replace(pressure, frequency=jnp.ones(()), ramp=None)
    once = jax.vmap(lambda t: one_a_second(t)[0])(jnp.arange(_SAMPLES) / _SAMPLES)
    values = respond(plays, jnp.concatenate([once, once]), 1.0)[_SAMPLES:]
    return Cycle(values, pressure.frequency, jnp.zeros(()), ramp=pressure.ramp)
