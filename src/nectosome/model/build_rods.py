"""From a description to soft rods: their sections, the shapes they are made to take, and what acts inside them."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome import loads as ld
from nectosome.core import Constant, Cycle, Recording, RodLoad, Signal, Sine, Wave
from nectosome.description import parts as dp
from nectosome.description import rod_loads as di
from nectosome.description import waves as dw
from nectosome.drives import PrandtlIshlinskii, respond
from nectosome.mechanism import Link, SoftRod, make_rod
from nectosome.mechanism.rods import basis, legendre, section_places
from nectosome.mechanism.sections import ellipse, rectangle

from .build_base import is_zero, number, signal, vector

_POINTS = 60  # of the Gauss rule for waves
_SAMPLES = 64  # of a cycle after hysteresis, joined by a spline


def rod_of(limb: dp.Rod) -> SoftRod:
    """Soft rod whose sections go over evenly from each one that is given to the next."""
    s = jnp.asarray(section_places({**limb.strains}, limb.points, limb.marks))
    known = np.array([0.0, *(inner.at for inner in limb.between), 1.0])

    def size(name: str) -> Array:
        root, tip = getattr(limb, name), getattr(limb, f"tip_{name}")
        values = [root, *(getattr(inner, name) for inner in limb.between), root if tip is None else tip]
        return jnp.interp(s, known, vector(values))

    if limb.section == "circle":
        sections = ellipse(size("radius"), size("radius"))
    else:
        shape = ellipse if limb.section == "ellipse" else rectangle
        sections = shape(0.5 * size("width"), 0.5 * size("height"))
    rest = {name: vector(getattr(limb.rest, name)) for name in type(limb.rest).model_fields if getattr(limb.rest, name)}
    return make_rod(
        length=number(limb.length),
        sections=sections,
        young=number(limb.young),
        poisson=number(limb.poisson),
        density=number(limb.density),
        viscosity=number(limb.damping),
        orders={**limb.strains},
        rest=rest,
        points=limb.points,
        marks=limb.marks,
    )


def shape_of(limb: dp.Rigid | dp.Rod, body: Link | SoftRod) -> dict[str, Any]:
    """What a part says of the strains that it is made to take."""
    if not isinstance(limb, dp.Rod) or not isinstance(body, SoftRod):
        return {}
    waves = {name: wave for name in type(limb.motion).model_fields if (wave := getattr(limb.motion, name)) is not None}
    rows = [_rows(body, name) for name in waves]
    # the coordinates of a curvature are (2 k + 1) L int P_k kappa ds
    signals = [
        _wave(wave, body.length, body.length * (2 * np.arange(len(own)) + 1))
        for wave, own in zip(waves.values(), rows, strict=True)
    ]
    return {"prescribed_strains": sum(rows, ()), "strain_signals": tuple(signals)}


def inside_of(load: di.TendonLoad | di.ChamberLoad | di.MuscleLoad, rod: SoftRod, limb: dp.Rod) -> RodLoad:
    """Load inside a rod."""
    if isinstance(load, di.MuscleLoad):
        rows = _rows(rod, load.strain)
        # generalised force int P_k / L m dx
        return ld.Muscle(rows, rod.nq, _wave(load.moment, rod.length, jnp.ones(len(rows))))
    start, end = load.along
    n = rod.nq + 8
    s, w = np.polynomial.legendre.leggauss(n)
    share = 0.5 * (s + 1)
    x = start + (end - start) * share
    scale = jnp.concatenate([jnp.ones(3) / rod.length, jnp.ones(3)])
    rest = jnp.zeros((n, 6)).at[:, 3].set(1.0)
    for row, name in enumerate(dp.STRAIN_NAMES):
        if given := getattr(limb.rest, name):
            rest = rest.at[:, row].add(jnp.asarray(legendre(len(given) - 1, x)) @ vector(given))
    along = rod.length * (end - start)
    root, tip = vector(load.place), vector(load.tip_place or load.place)
    place = jnp.zeros((n, 3)).at[:, 1:].set(root + (tip - root) * share[:, None])
    slope = jnp.zeros((n, 3)).at[:, 1:].set((tip - root) / along)
    thread = ld.Thread(
        basis=jnp.asarray(basis({**limb.strains}, x)) * scale[:, None],
        rest=rest,
        weight=along * jnp.asarray(0.5 * w),
        place=place,
        slope=slope,
    )
    if isinstance(load, di.TendonLoad):
        return ld.Tendon(thread, signal(load.tension))
    first, last = number(load.area), number(load.area if load.tip_area is None else load.tip_area)
    pressure = signal(load.pressure)
    if load.hysteresis is not None:
        plays = PrandtlIshlinskii(
            number(load.hysteresis.direct), vector(load.hysteresis.thresholds), vector(load.hysteresis.weights)
        )
        pressure = _after(plays, pressure)
    return ld.FluidChamber(thread, first + (last - first) * share, pressure)


def _after(plays: PrandtlIshlinskii, pressure: Signal) -> Signal:
    """What hysteresis makes of a pressure: at a recording's samples, and of a cycle that was gone through before."""
    if isinstance(pressure, Constant):
        return Constant(respond(plays, pressure.value[None], 1.0)[0])
    if isinstance(pressure, Recording):
        return Recording(pressure.times, respond(plays, pressure.values, 1.0))
    assert isinstance(pressure, Sine | Cycle)
    one_a_second = eqx.tree_at(lambda s: s.frequency, pressure, jnp.ones(()))
    once = jax.vmap(lambda t: one_a_second(t)[0])(jnp.arange(_SAMPLES) / _SAMPLES)
    values = respond(plays, jnp.concatenate([once, once]), 1.0)[_SAMPLES:]
    return Cycle(values, pressure.frequency, jnp.zeros(()))


def _rows(rod: SoftRod, strain: str) -> tuple[int, ...]:
    """Which coordinates of a rod are those of a strain."""
    return tuple(k for k, name in enumerate(rod.names) if name.startswith(f"{strain}."))


def _wave(w: dw.MomentWave | dw.CurvatureWave, length: Array, scale: Float[Array, "n"]) -> Wave:
    """Wave by its numbers int P_k e(s) (1, cos, sin)(2 pi s L/wavelength) ds, each times `scale`."""
    s, weight = np.polynomial.legendre.leggauss(_POINTS)
    share, weight = 0.5 * (s + 1), 0.5 * weight
    knots = np.linspace(0, 1, max(len(w.envelope), 2))
    e = jnp.interp(share, knots, jnp.broadcast_to(vector(w.envelope), knots.shape))
    turn = jnp.asarray(share) * (0.0 if w.wavelength is None else 2 * jnp.pi * length / w.wavelength)
    project = scale[:, None] * jnp.asarray((legendre(scale.size - 1, share) * weight[:, None]).T)
    return Wave(
        **{name: number(getattr(w, name)) for name in ("amplitude", "frequency", "phase", "offset")},
        envelope=jnp.dot(project, e),
        cosine=jnp.dot(project, e * jnp.cos(turn)),
        sine=jnp.dot(project, e * jnp.sin(turn)),
        ramp=None if is_zero(w.ramp) else number(w.ramp),
    )
