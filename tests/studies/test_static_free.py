"""The jet of PoseiDRONE, held and free: synthetic chamber, virtual rig, motor, identified drag."""

import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.model import build
from nectosome.robots import describe
from nectosome_studies.poseidrone import static_free
from nectosome_studies.poseidrone.figures_swim import jet_panels
from nectosome_studies.poseidrone.recordings import EXPELLED, OMEGA, chamber, thrust


@pytest.fixture(scope="module")
def found():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(static_free, "SHARES", (0.6,))
        return static_free.compared()


def test_the_robot_file_holds_the_chamber_that_fits_the_thrust():
    """120 mL, 34 % of the full chamber; thrust of the smooth curve to 2 % of its peak, its mean to 0.3 %."""
    made, description = chamber(), describe("poseidrone_jet")
    load = description.body.loads["jet"]
    np.testing.assert_allclose(load.volume, made.volume, atol=1e-9)
    np.testing.assert_allclose([load.nozzle, load.inlet], [made.nozzle, made.inlet], rtol=1e-6)
    time = jnp.arange(3600) / 3600 * 2 * np.pi / OMEGA["train"]
    now = static_free.pulses(build(description), time, (), jnp.zeros(3600))
    expelled = float(jnp.sum(jnp.maximum(now.outflow, 0)) * time[1])
    assert expelled == pytest.approx(EXPELLED, rel=2e-3)
    assert expelled / float(jnp.max(now.volume)) == pytest.approx(0.34, abs=1e-3)
    wanted = thrust(np.asarray(now.angle))
    np.testing.assert_allclose(now.thrust, wanted, atol=0.02 * wanted.max())
    assert float(jnp.mean(now.thrust)) == pytest.approx(wanted.mean(), rel=3e-3)


@pytest.mark.slow
def test_the_load_cell_on_the_pivot_reads_the_thrust(found):
    """To what a spring of (omega/omega_n)^2 = 0.2 % in the first harmonic lets through of a pulse: 3 % of its peak."""
    held, rig = found["held"].values, found["rig"].values
    np.testing.assert_allclose(rig, held, atol=0.03 * held.max())
    assert rig[:-1].mean() == pytest.approx(held[:-1].mean(), rel=5e-3)


@pytest.mark.slow
def test_over_a_settled_turn_momentum_is_kept(found):
    """The jet's mean is the drag's, whatever the bell carries."""
    speed = found["speed"][..., :-1]
    drag = 5.094 * (speed * abs(speed)).mean("angle")
    np.testing.assert_allclose(found["ratio"] * drag, found["held"][:-1].mean(), rtol=5e-4)


@pytest.mark.slow
def test_the_bell_helps_while_it_shrinks_and_takes_it_back(found):
    """Held thrust is too small for the pulse, the more the bell carries; over a turn only the water taken in counts."""
    still, wake = found.sel(wake=0.0), found.sel(wake=1.0)
    small, large = still["pulse"].values
    assert large < 0.8 < 0.9 < small < 1
    assert np.all(np.abs(wake["ratio"] - 1) < 0.01)
    assert np.all(np.abs(wake["drag"] - 5.094) < 3 * wake["drag_se"])
    assert np.all(still["ratio"] > 1.5)
    np.testing.assert_allclose(still["drag"] / 5.094, still["ratio"], rtol=0.02)


@pytest.mark.slow
def test_held_thrust_is_hull_drag_and_ram_drag(found):
    """rho Q v, of water taken in at the speed that the robot has while it fills; its momentum has no mean rate."""
    numbers = {row.removeprefix("poseidrone/static-free/"): x for row, x in static_free.numbers(found).items()}
    still = found.sel(wake=0.0, share=found.attrs["own_share"])
    time = still["angle"].values / OMEGA["train"]
    robot = build(describe("poseidrone_jet"))
    flow = np.asarray(static_free.pulses(robot, jnp.asarray(time), (), jnp.zeros(time.size)).outflow)
    taken = (1025.0 * np.maximum(-flow, 0) * still["speed"].values)[:-1].mean()
    assert numbers["ram-drag"] == pytest.approx(taken, rel=0.02)
    drag = (5.094 * still["speed"].values ** 2)[:-1].mean()
    assert numbers["hull-drag"] == pytest.approx(drag, rel=1e-3)
    assert numbers["hull-drag"] + numbers["ram-drag"] == pytest.approx(float(found["held"][:-1].mean()), rel=1e-12)
    assert abs(numbers["momentum"]) < 1e-4 * numbers["ram-drag"]
    assert numbers["lambda-error"] == pytest.approx(100 * numbers["ram-drag"] / numbers["hull-drag"], rel=0.05)
    assert abs(numbers["wake/lambda-error"]) < 2


@pytest.mark.slow
def test_the_motor_is_slow_and_takes_current_while_it_pulls(found):
    turns = found.isel(instant=slice(-4 * 241, None))
    angle = np.degrees(turns["motor_angle"].values) % 360
    thrust, speed = turns["motor_thrust"].values, turns["motor_speed"].values
    assert 140 < angle[thrust.argmax()] < 180
    assert 150 < angle[speed.argmin()] < 220
    assert np.all(thrust[(angle > 230) & (angle < 350)] < 0)
    np.testing.assert_allclose(turns["motor_current"], 1 - speed / 12.5, atol=1e-12)


@pytest.mark.slow
def test_its_figures_are_drawn(found):
    panels = jet_panels({"static_free": found})
    assert [len(panel.figure.data) >= 4 for panel in panels] == [True, True]
    assert all("synthetic" in panel.caption for panel in panels)
