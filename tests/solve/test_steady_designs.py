"""What the steady solve owes on designs that nobody has chosen: 200 at random within the bounds of the shipped problem.

The same that `python -m benchmarks steady` prints.
"""

import jax.numpy as jnp
import numpy as np
import pytest
from benchmarks.designs import derivative_error, draw, settle, swimmers

from nectosome.core import Status

pytestmark = pytest.mark.slow
DESIGNS = draw(200)


@pytest.fixture(scope="module")
def roots():
    s = swimmers()
    return [s.outputs(jnp.asarray(u), s.rest, jnp.asarray(False)) for u in DESIGNS]


def test_every_design_is_solved_from_rest(roots):
    unsolved = [k for k, (_, found) in enumerate(roots) if int(found.status) != Status.SOLVED]
    assert not unsolved, DESIGNS[unsolved]
    assert max(float(found.residual) for _, found in roots) < 1e-10


def test_the_dynamics_from_rest_come_to_the_same(roots):
    for u, (values, _) in list(zip(DESIGNS, roots, strict=True))[::20]:
        speed, _ = settle(swimmers().robot(u))
        assert float(values[0]) == pytest.approx(speed, rel=1e-3, abs=1e-5), u


def test_derivatives_are_those_of_central_differences(roots):
    errors = np.array([derivative_error(u, found.state) for u, (_, found) in zip(DESIGNS, roots, strict=True)])
    assert np.max(errors) < 1e-6, DESIGNS[np.argmax(np.max(errors, axis=1))]
