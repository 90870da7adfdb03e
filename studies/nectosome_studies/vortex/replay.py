"""Forces of the load `foil` over a beat: a robot whose joints are made to move as the foil did."""

from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.core import Status
from nectosome.description import (
    Angle,
    ConstantSignal,
    Coordinate,
    PrismaticJoint,
    RevoluteJoint,
    Rigid,
    RobotDescription,
    WaterDescription,
)
from nectosome.description.foil_planform import FoilLoad
from nectosome.description.signals import RateSignal, SmoothRecordingSignal
from nectosome.model import build
from nectosome.solve import simulate

from .flapping import PHASES, BeatForces, FoilBeat, periodic_curve

ATTACHED = {"stall": np.deg2rad(89.0), "profile_drag": 0.0, "broadside_drag": 0.0}  # as in potential flow
_BEATS = 4  # the last one is compared
_KNOTS = 48  # of a motion over a beat
_PLACES = 17  # of the planform over a band
_SECTIONS = 6  # of a band
_MASS = 1e-9  # [kg]: all force is the flow's


def replay(beat: FoilBeat, **foil: float) -> BeatForces:
    """Forces over the last of four beats from a start without a wake; `foil` are fields of the load.

    Raises RuntimeError where it does not succeed.
    """
    return forces(rig(beat, **foil), beat)


def forces(robot: RobotDescription, beat: FoilBeat) -> BeatForces:
    """The same of a `rig` of the beat, whose numbers may be others."""
    phases = (_BEATS - 1) + np.arange(PHASES) / PHASES
    times = np.append(0.0, phases / beat.frequency)
    run = simulate(build(robot), times[-1], samples=times.tolist(), rtol=1e-6, atol=1e-8, method="implicit")
    if int(run.status) != Status.SOLVED:
        raise RuntimeError(f"a foil did not move: {Status(int(run.status)).reason}")
    data = run.results().data
    force, power = (np.asarray(data[name][1])[1:] for name in ("reaction", "reaction_power"))
    both = 1 + beat.mirrored
    return BeatForces(-both * force[:, 2::2], -both * force[:, 0], both * power[:, 2:].sum(axis=1))


def rig(beat: FoilBeat, **foil: float) -> RobotDescription:
    """The robot: a tow ahead, a surge, and by band a heave, a turn and a foil.

    Each band is a foil of its own with the aspect ratio of the whole, on a slide that stands for the heave: what that
    holds is the band's lift.
    """
    flaps = beat.turn == "flap"
    limbs: dict[str, Any] = {"surge": _slide("y", _motion(beat, beat.surge, Coordinate))}
    for k, ends in enumerate(zip(beat.edges[:-1], beat.edges[1:], strict=True)):
        limbs[f"heave{k}"] = _slide("z", _motion(beat, beat.heave, Coordinate)).model_copy(update={"on": "surge"})
        turn = _motion(beat, -beat.angle if flaps else beat.angle, Angle)
        joint = RevoluteJoint(kind="revolute", axis=(0, 1, 0) if flaps else (1, 0, 0), motion=turn)
        offset = (0.0, 0.0 if flaps else -beat.hinge, 0.0)
        limbs[f"turn{k}"] = _point(joint).model_copy(update={"on": f"heave{k}", "offset": offset})
        limbs[f"foil{k}"] = _band(beat, ends, f"turn{k}", 0.0 if flaps else beat.hinge, foil)
    tow = PrismaticJoint(kind="prismatic", axis=(0, 1, 0), motion=RateSignal(kind="rate", rate=beat.speed))
    return RobotDescription(
        name="foil",
        forward="y",
        water=WaterDescription(density=beat.density, viscosity=beat.viscosity, gravity=0.0),
        body=_point(tow),
        limbs=limbs,
    )


def _band(beat: FoilBeat, ends: tuple[float, float], on: str, hinge: float, foil: dict[str, float]) -> Rigid:
    """A foil from one end of a band to the other, its shape as long as the band and its middle on the hinge's line."""
    x, planform = np.linspace(*ends, _PLACES), beat.planform
    leading, trailing = (np.interp(x, planform.x, edge) for edge in (planform.leading, planform.trailing))
    load = FoilLoad(
        kind="foil",
        span_along="x",
        ahead="y",
        chord=tuple(trailing - leading),
        leading_edge=tuple(hinge - leading),
        sections=_SECTIONS,
        aspect_ratio=beat.aspect_ratio,
        thickness=beat.thickness,
        **foil,  # pyright: ignore[reportArgumentType]
    )
    return Rigid(
        kind="rigid",
        shape="box",
        on=on,
        offset=(ends[0], 0.0, 0.0),
        length=ends[1] - ends[0],
        width=float(max(trailing)),
        height=1e-3,
        mass=0.0,
        volume=0.0,
        loads={"foil": load},
    )


def _point(joint: PrismaticJoint | RevoluteJoint) -> Rigid:
    return Rigid(kind="rigid", shape="point", mass=_MASS, volume=0.0, joint=joint)


def _slide(axis: str, motion: Any) -> Rigid:
    along = {"y": (0, 1, 0), "z": (0, 0, 1)}[axis]
    return _point(PrismaticJoint(kind="prismatic", axis=along, motion=motion))


def _motion(beat: FoilBeat, values: Float[np.ndarray, "k"], quantity: Any) -> Any:
    """A curve of motion over all beats."""
    if not np.any(values):
        return ConstantSignal[quantity](kind="constant", value=0.0)
    turns = np.arange(-2, _BEATS * _KNOTS + 3) / _KNOTS
    values = periodic_curve(values)(turns % 1.0)
    return SmoothRecordingSignal[quantity](kind="recording", times=tuple(turns / beat.frequency), values=tuple(values))
