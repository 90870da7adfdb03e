"""From a description to soft rods, whose sections go over evenly from each one that is given to the next."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from nectosome.core.described import number, vector
from nectosome.description import Rod
from nectosome.mechanism import SoftRod, make_rod
from nectosome.mechanism.rods import section_places
from nectosome.mechanism.sections import ellipse, rectangle


def rod_of(limb: Rod) -> SoftRod:
    """Soft rod of a description."""
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
