"""What follows from a closed surface, and how long it takes: added mass by panels, areas, hydrostatics.

Errors are those of bodies with a closed form: Lamb's spheroids, and a cube (0.6383 of its volume of water, Sihvola et
al. 2004). A thousand panels are to take less than 10 s.
"""

import sys

import numpy as np
import trimesh

from nectosome.geometry.mesh_numbers import projected_areas
from nectosome.geometry.panel_added_mass import panel_added_mass
from nectosome.geometry.triangles import Triangles
from nectosome.loads import lamb_coefficients
from nectosome.solve import floating

from .timing import once

_PANELS, _LONGEST = (250, 500, 1000, 2000, 4000), 10.0  # [s] of a thousand


def main() -> None:
    """Print times and errors; fail where a thousand panels take too long."""
    ball = trimesh.creation.icosphere(subdivisions=6)  # 82,000 triangles
    slender = Triangles(np.asarray(ball.vertices) * [7.0, 1.0, 1.0], np.asarray(ball.faces))
    box = trimesh.creation.box((1, 1, 1))
    cube = Triangles(np.asarray(box.vertices), np.asarray(box.faces))
    k1, k2, _ = (float(k) for k in lamb_coefficients(np.float64(7.0)))
    once(lambda: panel_added_mass(cube, panels=100))  # imports the package
    too_long = False
    for name, surface, exact in (("spheroid, 7 to 1", slender, (k1, k2)), ("cube", cube, (0.6383, 0.6383))):
        print(f"\nadded mass of a {name}, {len(surface.faces)} triangles")
        print("  panels    time   error along  across   told: along  across")
        for panels in _PANELS:
            seconds, found = once(lambda surface=surface, panels=panels: panel_added_mass(surface, panels=panels))
            masses, errors = (
                np.diag(matrix)[3:5] / surface.solid.size / exact for matrix in (found.matrix, found.error)
            )
            shares = [*(masses - 1), *errors]
            print(f"  {panels:6d} {seconds:5.1f} s {100 * shares[0]:10.2f} % {100 * shares[1]:6.2f} %", end="")
            print(f" {100 * shares[2]:10.2f} % {100 * shares[3]:6.2f} %", flush=True)
            too_long |= panels == 1000 and seconds > _LONGEST
    mass = 500 * slender.solid.size
    once(lambda: floating(slender, mass, np.array([0.0, 0.0, -0.1])))
    print(f"\n{len(slender.faces)} triangles: areas {once(lambda: projected_areas(slender))[0]:.2f} s,", end=" ")
    print(f"how it floats {once(lambda: floating(slender, mass, np.array([0.3, 0.1, -0.1])))[0]:.2f} s")
    if too_long:
        sys.exit(f"a thousand panels took over {_LONGEST:g} s.")


if __name__ == "__main__":
    main()
