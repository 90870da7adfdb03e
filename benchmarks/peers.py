"""A tapered cantilever that falls from level, by three codes; each returns the tip at the same times.

0.3 m, 12.5 mm to 6.25 mm, 7.4 MPa, 1062 kg/m3, Poisson 0.45, no water; all three could move it in three dimensions.
`nectosome`, `soromox` and `pyelastica` return run() -> tip [k, 3] at `TIMES` and the number of steps (0 if unknown),
compiled at its first call; the rods themselves serve `tests/validation/test_peers.py` too.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Any, Literal

import numpy as np

LENGTH, ROOT, TIP, YOUNG, POISSON, DENSITY, G = 0.3, 0.0125, 0.00625, 7.4e6, 0.45, 1062.0, 9.81
TIMES = np.linspace(0.0, 1.0, 101)
KIRCHHOFF = ("torsion", "bending_y", "bending_z")
COSSERAT = (*KIRCHHOFF, "extension", "shear_y", "shear_z")

Run = Callable[[], tuple[np.ndarray, int]]


def our_rod(order: int, points: int, strains: tuple[str, ...] = KIRCHHOFF, viscosity: float = 0.0) -> dict[str, Any]:
    """Description of the rod; viscosity [Pa s] of Kelvin-Voigt damping."""
    return {
        "kind": "rod",
        "section": "circle",
        "length": LENGTH,
        "radius": ROOT,
        "tip_radius": TIP,
        "young": YOUNG,
        "poisson": POISSON,
        "density": DENSITY,
        "damping": viscosity,
        "strains": dict.fromkeys(strains, order),
        "points": points,
    }


def nectosome(
    order: int,
    points: int,
    rtol: float,
    viscosity: float = 0.0,
    strains: tuple[str, ...] = KIRCHHOFF,
    method: Literal["auto", "explicit"] = "auto",
) -> Run:
    """Inextensible, or with all six strains (`COSSERAT`); the implicit method of `simulate` unless told otherwise."""
    import jax

    from nectosome.description import RobotDescription
    from nectosome.model import build
    from nectosome.solve import simulate

    water = {"gravity": G, "density": 1e-9}
    rod = our_rod(order, points, strains, viscosity)
    robot = build(RobotDescription.model_validate({"name": "cantilever", "water": water, "body": rod}))

    @jax.jit
    def tips(states):
        def tip(x):
            q, *_ = robot.tree.complete(jax.numpy.zeros(()), x.q, x.v)
            return robot.tree.shape(q).position[-1]

        return jax.vmap(tip)(states)

    def run() -> tuple[np.ndarray, int]:
        made = simulate(robot, 1.0, samples=TIMES.tolist(), rtol=rtol, atol=1e-2 * rtol, method=method)
        return np.asarray(tips(made.value.state)), int(made.stats["steps"])

    return run


def soromox_rod(
    order: int,
    points: int,
    curvatures: tuple[str, ...] = ("kappa_x", "kappa_y", "kappa_z"),
    basis: str = "legendre",
    viscosity: float = 0.0,
):
    """SoRoMoX's rod, inextensible, clamped level; needs JAX."""
    import jax.numpy as jnp
    from soromox.systems.components import JointSpec, LinearProfile, LinkSpec
    from soromox.systems.gvs import GVS, GVSSegment, StrainBasisSpec

    link = LinkSpec.circular(
        length=LENGTH,
        radius=LinearProfile(ROOT, TIP),
        density=DENSITY,
        reference_strain=[0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        young_modulus=YOUNG,
        poisson_ratio=POISSON,
        material_damping_coefficient=viscosity,
    )
    level = jnp.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    segment = GVSSegment(link, JointSpec.fixed(), StrainBasisSpec(basis, curvatures, order), points)
    return GVS.from_segments([segment], gravity=jnp.array([0.0, 0.0, -G]), base_pose=level)


def soromox(order: int, points: int, rtol: float, viscosity: float = 0.0) -> Run:
    """Geometric variable strain, inextensible; its default integrator (Tsit5) with adaptive steps."""
    import jax.numpy as jnp

    rod = soromox_rod(order, points, viscosity=viscosity)
    return lambda: (np.asarray(_fall()(rod, jnp.asarray(rtol))), 0)


@cache
def _fall():
    """Tip of a SoRoMoX rod at `TIMES`, compiled once for each number of coordinates."""
    import equinox as eqx
    import jax
    import jax.numpy as jnp
    from diffrax import PIDController
    from soromox.systems.system_state import SystemState

    @eqx.filter_jit
    def fall(rod, rtol):
        n = rod.num_velocities
        made = rod.rollout_to(
            SystemState(t=jnp.zeros(()), y=jnp.zeros(2 * n)),
            t1=1.0,
            solver_dt=1e-4,
            save_ts=jnp.asarray(TIMES),
            stepsize_controller=PIDController(rtol=rtol, atol=1e-2 * rtol),
            max_steps=1_000_000,
        )
        place = jax.vmap(lambda y: rod.forward_kinematics(y[:n], jnp.asarray(LENGTH)))
        return place(made.y)[:, :3, 3]

    return fall


def pyelastica_rod(elements: int, damping: float = 0.0, step: float = 0.0) -> tuple[Any, Any]:
    """Simulator and discrete Cosserat rod, damped uniformly [1/s] in steps [s] if asked for.

    The clamp is the middle of its first element, which lies half in the wall.
    """
    import elastica as ea

    class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):
        pass

    width = LENGTH / (elements - 0.5)
    middle = width * np.arange(elements)
    rod = ea.CosseratRod.straight_rod(
        elements,
        np.array([-0.5 * width, 0.0, 0.0]),
        np.array([1.0, 0.0, 0.0]),
        np.array([0.0, 1.0, 0.0]),
        width * elements,
        ROOT + (TIP - ROOT) * middle / LENGTH,
        DENSITY,
        youngs_modulus=YOUNG,
        shear_modulus=YOUNG / (2 * (1 + POISSON)),
    )
    simulator = Simulator()
    simulator.append(rod)
    ends = {"constrained_position_idx": (0,), "constrained_director_idx": (0,)}
    simulator.constrain(rod).using(ea.OneEndFixedBC, **ends)
    simulator.add_forcing_to(rod).using(ea.GravityForces, acc_gravity=np.array([0.0, 0.0, -G]))
    if damping:
        simulator.dampen(rod).using(ea.AnalyticalLinearDamper, uniform_damping_constant=damping, time_step=step)
    simulator.finalize()
    return simulator, rod


def pyelastica(elements: int, step: float) -> Run:
    """Undamped."""
    import elastica as ea

    pieces = math.ceil((TIMES[1] - TIMES[0]) / step)
    h = (TIMES[1] - TIMES[0]) / pieces

    def run() -> tuple[np.ndarray, int]:
        simulator, rod = pyelastica_rod(elements)
        stepper, time = ea.PositionVerlet(), 0.0
        tips = [rod.position_collection[:, -1].copy()]
        for _ in TIMES[1:]:
            for _ in range(pieces):
                time = stepper.step(simulator, time, h)
            tips.append(rod.position_collection[:, -1].copy())
        return np.array(tips), pieces * (TIMES.size - 1)

    return run
