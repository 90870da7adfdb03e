"""From the loads of a description to loads: what acts on its parts and along its joints."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome import loads as ld
from nectosome.core.se3 import dot_t
from nectosome.description import joints as dj
from nectosome.description import loads as dl
from nectosome.description import parts as dp
from nectosome.mechanism import Attached, Link, SoftRod

from .build_base import is_zero, node, number, signal, unit, vector
from .build_rods import inside_of


def joint_loads(j: dj.Joint, part: int) -> list[Attached]:
    """Spring, damper and stops of a joint; left out where they are plainly zero."""
    out = []
    if not isinstance(j, dj.RevoluteJoint | dj.PrismaticJoint | dj.SphericalJoint):
        return out
    if isinstance(j, dj.RevoluteJoint) and j.flexure is not None:
        out.append(Attached("spring", part, _flexure_spring(j.flexure, number(j.rest))))
    elif not is_zero(j.stiffness):
        out.append(Attached("spring", part, ld.Spring(number(j.stiffness), number(getattr(j, "rest", 0.0)))))
    if not is_zero(j.damping):
        out.append(Attached("damper", part, ld.Damper(number(j.damping))))
    for name, kind in (("lower", ld.LowerLimit), ("upper", ld.UpperLimit)):
        stop = getattr(j, name, None)
        if stop is not None:
            numbers = {field: number(getattr(stop, field)) for field in type(stop).model_fields}
            out.append(Attached("stop", part, kind(**numbers)))
    return out


def _flexure_spring(f: dj.Flexure, rest: Array) -> ld.Spring:
    """k = pi ratio^2 E I / length [N m/rad] (Hu et al. 2024, eq. 16); k h / 2I at the face of a layer h thick."""
    second_moment = number(f.width) * f.thickness**3 / 12
    stiffness = jnp.pi * f.ratio**2 * f.young * second_moment / f.length
    stress = stiffness * f.thickness / (2 * second_moment)
    return ld.Spring(stiffness, rest, ld.FlexureSpring(stress / f.young, stress))


def _jet(j: dl.JetLoad, body: Link) -> ld.Jet:
    """Pulsed jet; its vectors are in the frame of the part's first station."""
    crank = signal(j.crank) if j.motor is None else ld.Motor(**{n: number(x) for n, x in j.motor})
    return ld.Jet(
        volume=vector(j.volume),
        **{n: number(getattr(j, n)) for n in ("nozzle", "inlet", "bell", "wake", "elastance")},
        direction=dot_t(body.rotation[0], unit(j.direction)),
        place=dot_t(body.rotation[0], vector(j.place)),
        crank=crank,
    )


def load_of(load: dl.Load, limb: dp.Rigid | dp.Rod, body: Link | SoftRod):
    """Load of a description."""
    if isinstance(load, dl.DragLoad):
        return ld.StripDrag(number(load.normal), number(load.tangential), number(load.lift))
    if isinstance(load, dl.PlateDragLoad):
        return ld.PlateDrag(number(load.normal))
    if isinstance(load, dl.AddedMassLoad):
        return ld.StripAddedMass(number(load.normal), number(load.tangential))
    if isinstance(load, dl.LumpedDragLoad):
        return ld.LumpedDrag(vector(load.drag_area), vector(load.rotational))
    if isinstance(load, dl.GivenAddedMassLoad):
        if load.matrix is not None:
            m = jnp.stack([vector(row) for row in load.matrix])
            return ld.GivenAddedMass(m[3:, 3:], m[:3, 3:], m[:3, :3])
        return ld.GivenAddedMass(jnp.diag(vector(load.mass)), jnp.zeros((3, 3)), jnp.diag(vector(load.inertia)))
    if isinstance(load, dl.SpheroidAddedMassLoad):
        return ld.SpheroidAddedMass(0.5 * number(limb.length), number(limb.radius))
    if isinstance(load, dl.CylinderAddedMassLoad):
        return ld.CylinderAddedMass(number(limb.length), number(limb.radius), number(load.coefficient))
    if isinstance(load, dl.TrailingEdgeLoad):
        return ld.TrailingEdge(number(load.normal), number(load.softness))
    if isinstance(load, dl.TendonLoad | dl.ChamberLoad | dl.MuscleLoad):
        assert isinstance(body, SoftRod) and isinstance(limb, dp.Rod)
        return inside_of(load, body, limb)
    if isinstance(load, dl.LegLoad):
        return _leg(load, _on_centre(body, vector(load.hip)))
    if isinstance(load, dl.JetLoad):
        assert isinstance(body, Link)
        return _jet(load, body)
    if isinstance(load, dl.NearFloorLoad):
        vectors = vector(load.mass), vector(load.drag_area), vector(load.rotational)
        return ld.NearFloor(*vectors, number(load.full), number(load.none))
    if isinstance(load, dl.WallContactLoad):
        return ld.WallContact(*(number(getattr(load, n)) for n in ("reach", "stiffness", "damping", "softness")))
    if isinstance(load, dl.PulsedThrustLoad):
        assert isinstance(body, Link)
        return ld.PulsedThrust(
            values=vector(load.values),
            **{n: number(getattr(load, n)) for n in ("rated", "speed", "start")},
            direction=dot_t(body.rotation[0], unit(load.direction)),
            place=dot_t(body.rotation[0], vector(load.place)),
        )
    if isinstance(load, dl.DistributedForceLoad):
        return ld.LineForce(vector(load.force), load.frame == "body")
    station, arm = 0, jnp.zeros(3)
    if isinstance(body, SoftRod):
        station = body.weight.shape[0] - 1 if load.at == "tip" else node(body, load.at)
    else:
        arm = _on_centre(body, body.tip_position if load.at == "tip" else jnp.zeros(3))
    return ld.PointForce(vector(load.moment), vector(load.force), arm, station, load.frame == "body")


def _on_centre(body: Link | SoftRod, place: Float[Array, "3"]) -> Float[Array, "3"]:
    """From the centre of a rigid part to a place in the part's frame, in the centre's frame."""
    assert isinstance(body, Link)
    return dot_t(body.rotation[0], place - body.position[0])


def _leg(leg: dl.LegLoad, hip: Float[Array, "3"]) -> ld.Leg:
    ground = ("stiffness", "static_friction", "dynamic_friction", "softness")
    own = ("crank", "length", "speed", "start", "damping_ratio", "tangential", "normal", "count")
    return ld.Leg(
        hip=hip,
        bearing=vector(leg.bearing),
        contact=ld.GroundContact(**{name: number(getattr(leg, name)) for name in ground}, pulls=leg.pulls),
        **{name: number(getattr(leg, name)) for name in own},
    )
