"""Weight and buoyancy: what is neutral stays, what is heavy hangs, what is light floats at Archimedes' draught."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array
from scipy.integrate import quad
from scipy.optimize import brentq

from nectosome.core import State, Stations, Strips, Water, wetted
from nectosome.description import RobotDescription
from nectosome.mechanism import Robot, diagnose
from nectosome.model import build
from nectosome.solve import simulate

G = 9.80665
SLENDER: dict[str, Any] = {
    "drag": {"kind": "drag", "normal": 1.1, "tangential": 0.02},
    "added_mass": {"kind": "added_mass", "normal": 1.0},
}


def robot(body: dict, limbs: dict | None = None, **water) -> Robot:
    return build(RobotDescription.model_validate({"name": "test", "water": water, "body": body, "limbs": limbs or {}}))


def strip(height: float | Array, up: Array) -> Strips:
    """A strip 0.1 m long, 0.02 m by 0.04 m, at a height; `up` is the vertical in its own axes."""
    rotation = jnp.eye(3).at[2].set(up)[None]
    position = jnp.stack([0.0, 0.0, height])[None]
    still, half_width = jnp.zeros((1, 3)), jnp.array([[0.01, 0.02]])
    x, weight = jnp.array([0.05]), jnp.array([0.1])
    own = Stations.along(x, weight, half_width, jnp.ones(1), jnp.eye(6)[None])
    return Strips(**vars(own), rotation=rotation, position=position, angular_velocity=still, velocity=still)


@jax.jit
@jax.value_and_grad
def shares(height, up):
    return wetted(jnp.zeros(()), strip(height, up), Water(jnp.asarray(1000.0), jnp.asarray(G), jnp.asarray(0.0)))[0]


@pytest.mark.parametrize(
    ("height", "up", "share"),
    [
        (0.0, (0, 0, 1.0), 0.5),
        (-0.02, (0, 0, 1.0), 1.0),
        (0.02, (0, 0, 1.0), 0.0),
        (-0.01, (0, 0, 1.0), 1 - (np.arccos(0.5) - 0.5 * np.sqrt(0.75)) / np.pi),  # segment of a disc
        (-0.005, (0, 1.0, 0), 1 - (np.arccos(0.5) - 0.5 * np.sqrt(0.75)) / np.pi),
        (0.0, (1.0, 0, 0), 0.5),
        (0.06, (1.0, 0, 0), 0.0),
        (-0.06, (1.0, 0, 0), 1.0),
    ],
)
def test_wetted_share_of_a_strip_at_the_surface(height: float, up, share: float):
    found, slope = shares(height, jnp.asarray(up))
    assert float(found) == pytest.approx(share)
    assert np.isfinite(float(slope))


@pytest.mark.parametrize("height", [-0.025, -0.004, 0.0, 0.012])
def test_wetted_share_of_a_tilted_strip_is_the_mean_of_its_sections(height: float):
    """Segments of ellipses, integrated along the strip; dry, cut and wet sections among them."""
    tilt = 0.3
    half_height = 0.02 * np.sqrt(1 - tilt**2)

    def section(x: float) -> float:
        depth = np.clip(-(height + tilt * x) / half_height, -1.0, 1.0)
        return 1 - (np.arccos(depth) - depth * np.sqrt(1 - depth**2)) / np.pi

    mean = quad(section, -0.05, 0.05, limit=200)[0] / 0.1
    found, _ = shares(height, jnp.array([tilt, 0.0, np.sqrt(1 - tilt**2)]))
    assert float(found) == pytest.approx(mean, abs=1e-7)


@pytest.fixture(scope="module")
def spar() -> tuple[Robot, Any]:
    """An upright cylinder that can only heave, and the force that holds it."""
    body = {
        "kind": "rigid",
        "shape": "cylinder",
        "length": 0.3,
        "radius": 0.02,
        "density": 640.0,
        "rotation": (0.0, -np.pi / 2, 0.0),
        "joint": {"kind": "prismatic", "axis": (1.0, 0.0, 0.0)},
    }
    floating = robot(body, surface=0.0)
    still = jnp.zeros(1)
    return floating, eqx.filter_jit(
        lambda z: floating.residual(jnp.zeros(()), State(z[None], still, ((), ())), still)[0]
    )


def test_an_upright_cylinder_floats_at_archimedes_draught(spar):
    """Draught = L rho_s / rho_w, whatever the strips."""
    draught = -brentq(lambda z: float(spar[1](jnp.asarray(z))), -0.29, -0.01)
    assert draught == pytest.approx(0.3 * 0.64, rel=1e-6)


def test_a_floating_cylinder_is_pushed_back_by_its_waterplane(spar):
    """dF/dz = rho g pi r^2."""
    low, high = (float(spar[1](jnp.asarray(z))) for z in (-0.25, -0.1))
    assert (high - low) / 0.15 == pytest.approx(1000 * G * np.pi * 0.02**2, rel=1e-6)


def test_a_level_cylinder_half_in_water_carries_half_its_displacement():
    body = {"kind": "rigid", "shape": "cylinder", "length": 0.3, "radius": 0.02, "density": 500.0}
    held = robot(
        body | {"joint": {"kind": "prismatic", "axis": "z", "motion": {"kind": "constant", "value": 0.0}}}, surface=0.0
    )
    assert reaction(held) == pytest.approx([0.0], abs=1e-12)


@eqx.filter_jit
def _diagnose(robot: Robot):
    return diagnose(robot, jnp.zeros(()), robot.initial())


def reaction(robot: Robot) -> np.ndarray:
    return np.asarray(_diagnose(robot).reaction)


def test_a_neutral_body_at_rest_stays_at_rest():
    """Tilted, with drag and added mass, of the density of the water: nothing moves, to rounding."""
    start = {"position": (0.1, 0.2, 0.3), "orientation": (0.3, -0.5, 0.7)}
    body = {"kind": "rigid", "shape": "cylinder", "length": 0.1, "radius": 0.02, "density": 1025.0}
    neutral = robot(body | {"joint": {"kind": "free", "start": start}, "loads": SLENDER}, density=1025.0)
    run = simulate(neutral, 1.0, samples=5, method="explicit")
    moved = np.asarray(run.value.state.q) - np.asarray(neutral.initial().q)
    assert np.max(np.abs(moved)) < 1e-12


def test_no_force_is_left_on_a_neutral_soft_rod():
    rod = {
        "kind": "rod",
        "section": "circle",
        "length": 0.2,
        "radius": 0.005,
        "tip_radius": 0.003,
        "young": 1e6,
        "density": 1025.0,
        "strains": {"bending_y": 1, "bending_z": 1},
        "points": 5,
        "rotation": (0.3, -0.5, 0.7),
        "loads": SLENDER,
    }
    neutral = robot(rod, density=1025.0)
    x = neutral.initial()
    left = eqx.filter_jit(neutral.residual)(jnp.zeros(()), x, jnp.zeros_like(x.v))
    assert np.max(np.abs(left)) < 1e-15


def test_ballast_shows_its_full_weight_in_water():
    """A neutral body held on a slide, with a lead ball: the slide carries its weight less that of its water."""
    held = {"kind": "prismatic", "axis": "z", "motion": {"kind": "constant", "value": 0.0}}
    body = {"kind": "rigid", "shape": "cylinder", "length": 0.1, "radius": 0.02, "density": 1000.0, "joint": held}
    ball = {"kind": "rigid", "shape": "point", "mass": 0.1134, "volume": 1e-5}
    assert reaction(robot(body, {"ballast": ball})) == pytest.approx([(0.1134 - 0.01) * G], rel=1e-12)
