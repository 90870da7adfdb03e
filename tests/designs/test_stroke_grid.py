"""The whole grid of strokes of the rowing paddle: means of found cycles against long simulations."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.designs.sweep import sweep
from nectosome.mechanism import in_plane
from nectosome.model import instantiate, template_of
from nectosome.robots import describe
from nectosome.solve import cycle_means
from nectosome.solve.integrate import Settings, begin, integrate

A, F = np.radians(np.arange(30, 76, 5)), np.round(np.arange(0.3, 1.31, 0.1), 10)
WAIT, LOOK = 8, 2  # cycles from rest, and those after them that a mean is taken of
SETTINGS = Settings("explicit", *map(jnp.asarray, (1e-6, 1e-8, 1_000_000)))


@pytest.fixture(scope="module")
def swept():
    return sweep("paddle", {"N": [1, 2, 3], "A": A, "f": F})


def long_thrust(joints):
    """Mean force on the paddle along y over some cycles long after the start, 1024 moments a cycle [N]."""
    description = describe(f"paddle{joints}")
    paths = ("limbs.arm.joint.motion.amplitude", "limbs.arm.joint.motion.frequency")
    blueprint, numbers = template_of(description, paths)
    where = np.array([blueprint.paths.index(path) for path in paths])

    @jax.jit
    def one(stroke):
        robot = instantiate(blueprint, numbers.at[where].set(stroke))
        period = 1 / stroke[1]
        times = WAIT * period + jnp.linspace(0, LOOK * period, LOOK * 1024 + 1)
        _, states = integrate(
            in_plane(robot), begin(0 * period, robot.initial(), SETTINGS, 1e-4 + 0 * period), times, SETTINGS
        )
        # the drive repeats itself: WAIT cycles earlier it moved as it does now
        return cycle_means(robot, times - times[0], states).force[1]

    return jnp.stack([jnp.stack([one(jnp.array([a, f])) for f in F]) for a in A])


@pytest.mark.slow
@pytest.mark.parametrize("joints", [1, 2, 3])
def test_every_stroke_gives_the_thrust_of_a_long_simulation(swept, joints):
    """Within 0.5 % or 1e-4 N."""
    ours = swept["force"].sel(N=joints, axis="y").to_numpy()
    theirs = np.asarray(long_thrust(joints))
    off = np.abs(ours - theirs)
    worst = np.unravel_index(np.argmax(off / np.maximum(5e-3 * np.abs(theirs), 1e-4)), off.shape)
    print(joints, "worst", off[worst], theirs[worst], np.degrees(A[worst[0]]), F[worst[1]], "largest", off.max())
    assert np.all(off <= np.maximum(5e-3 * np.abs(theirs), 1e-4))
    assert set(swept["status"].to_numpy().ravel()) <= {"SOLVED", "SETTLED"}
