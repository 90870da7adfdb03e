"""The filament of `examples/holding.yaml`: that its tendon makes it hold a bar, and how that scales."""

from pathlib import Path

import numpy as np
import pytest

from nectosome.core import Status
from nectosome.description import apply_settings, get_value, load_robot
from nectosome.model import build
from nectosome.solve import simulate

FILE = Path(__file__).parents[2] / "examples" / "holding.yaml"
COARSE = ["limbs.filament.strains={bending_z: 3}", "limbs.filament.points=24", "L=350mm"]
CLOSED = 2.0


@pytest.fixture(scope="module")
def described():
    return apply_settings(load_robot(str(FILE)), COARSE)


def pull(described, *settings: str) -> np.ndarray:
    """Pull on the bar [N] once the filament has closed."""
    run = simulate(build(apply_settings(described, settings)), 3.0, samples=61)
    assert int(run.status) == Status.SOLVED
    data = run.to_dataset()
    assert float(data["power_balance"].max()) < 1e-9
    drawn = -data["reaction"].sel(prescribed="bar.position")
    return drawn[data["time"] >= CLOSED].values


@pytest.fixture(scope="module")
def held(described):
    return pull(described)


@pytest.mark.slow
def test_a_pulled_tendon_holds_the_bar_and_a_slack_one_lets_it_go(described, held):
    """It passes a straight filament without touching it."""
    assert held.min() > 0.5
    np.testing.assert_allclose(pull(described, "tension=1e-6 N"), 0, atol=1e-3 * held.min())


@pytest.mark.slow
def test_what_is_held_grows_with_stiffness_and_tension_alike(described, held):
    """Slow as it is, forces are in proportion to E, if tension, contact and viscosity are too."""
    twice = {
        "E": "6 MPa",
        "tension": "50 N",
        "pairs.grip.stiffness": "40 kN/m",
        "pairs.grip.damping": "40 N s/m",
        "limbs.filament.damping": "6000 Pa s",
    }
    for path, value in twice.items():
        once = get_value(described, path)
        assert get_value(apply_settings(described, [f"{path}={value}"]), path) == pytest.approx(2 * once)
    found = pull(described, *(f"{path}={value}" for path, value in twice.items()))
    assert found.mean() == pytest.approx(2 * held.mean(), rel=0.01)
    assert found.max() == pytest.approx(2 * held.max(), rel=0.01)
