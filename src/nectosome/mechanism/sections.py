"""Cross-sections of rods and links: areas and second moments from their half axes along local y and z."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


class Sections(eqx.Module):
    """Sections at n positions. y and z are the principal axes; all in SI units."""

    half_width: Float[Array, "n 2"]  # along y, z [m]
    area: Float[Array, "n"]  # [m2]
    second_moment_y: Float[Array, "n"]  # about y, of z^2 [m4]
    second_moment_z: Float[Array, "n"]  # about z, of y^2 [m4]
    torsion_constant: Float[Array, "n"]  # [m4]
    rectangular: bool = eqx.field(static=True, default=False)  # else ellipses

    @property
    def round_axes(self) -> Float[Array, "n"]:
        """In how many axes the shape that it is swept to is round: 2 of an ellipse, 0 of a rectangle."""
        return jnp.full_like(self.area, 0.0 if self.rectangular else 2.0)

    @property
    def polar_moment(self) -> Float[Array, "n"]:
        """Polar second moment J_y + J_z [m4] about x."""
        return self.second_moment_y + self.second_moment_z

    def shear_factor(self, poisson: Float[Array, ""]) -> Float[Array, ""]:
        r"""Shear factor k (Cowper 1966): circle $6(1+\nu)/(7+6\nu)$, rectangle $10(1+\nu)/(12+11\nu)$.

        Ellipses have that of the circle. Cowper's own for an ellipse goes to 0 for a flat one across its faces, where
        it counts the section's anticlastic bending as shear.
        """
        if self.rectangular:
            return 10 * (1 + poisson) / (12 + 11 * poisson)
        return 6 * (1 + poisson) / (7 + 6 * poisson)

    def hollow_shear_factor(self, hole: "Sections", poisson: Float[Array, ""]) -> Float[Array, "n"]:
        r"""Shear factor of a round tube (Cowper 1966), $6(1+\nu)(1+m^2)^2/((7+6\nu)(1+m^2)^2+(20+12\nu)m^2)$ with the
        ratio m of its radii. Others have that of a solid section, whose shear is held.
        """
        if self.rectangular:
            return self.shear_factor(poisson)
        m = (hole.half_width[:, 0] / self.half_width[:, 0]) ** 2
        return 6 * (1 + poisson) * (1 + m) ** 2 / ((7 + 6 * poisson) * (1 + m) ** 2 + (20 + 12 * poisson) * m)

    def around(self, hole: "Sections") -> "Sections":
        """What is left of the sections where another one is cut out of their middle."""
        left = jax.tree.map(jnp.subtract, self, hole)
        return eqx.tree_at(lambda own: own.half_width, left, self.half_width)


def ellipse(half_y: Float[Array, "n"], half_z: Float[Array, "n"]) -> Sections:
    """Ellipse (a circle when the half axes are equal): J_y = pi a b^3/4, torsion pi a^3 b^3/(a^2 + b^2)."""
    return Sections(
        half_width=jnp.stack([half_y, half_z], axis=-1),
        area=jnp.pi * half_y * half_z,
        second_moment_y=jnp.pi / 4 * half_y * half_z**3,
        second_moment_z=jnp.pi / 4 * half_z * half_y**3,
        torsion_constant=jnp.pi * (half_y * half_z) ** 3 / (half_y**2 + half_z**2),
    )


def rectangle(half_y: Float[Array, "n"], half_z: Float[Array, "n"]) -> Sections:
    """Rectangle 2a x 2b; torsion a b^3 (16/3 - 3.36 b/a (1 - b^4/(12 a^4))), a >= b (Roark, table 10.7)."""
    a, b = jnp.maximum(half_y, half_z), jnp.minimum(half_y, half_z)
    return Sections(
        half_width=jnp.stack([half_y, half_z], axis=-1),
        area=4 * half_y * half_z,
        second_moment_y=4 / 3 * half_y * half_z**3,
        second_moment_z=4 / 3 * half_z * half_y**3,
        torsion_constant=a * b**3 * (16 / 3 - 3.36 * b / a * (1 - b**4 / (12 * a**4))),
        rectangular=True,
    )
