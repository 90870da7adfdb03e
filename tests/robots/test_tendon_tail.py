"""A fish whose tail of three links is bent by two cords on the drum of one servo."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from nectosome.core import Load, Status
from nectosome.description import load_robot
from nectosome.model import build
from nectosome.solve import simulate, tracking_warnings
from nectosome.view.series import tension_panels

FILE = Path(__file__).parents[2] / "examples" / "tendon_tail.yaml"


def test_it_swims_forward_from_the_first_beat_with_both_cords_taut():
    """Its motor gives R (T_l - T_r) and what its rotor needs, from the battery; the power account is closed."""
    robot = load_robot(FILE)
    run = simulate(robot, 2.0, samples=181)
    assert int(run.status) == Status.SOLVED
    data = run.to_dataset()
    beats = data["position"].values[::60, 0, 0]  # 1.5 Hz
    assert np.all(np.diff(beats) > 0.005)
    assert float(data["tension"].min()) > 0
    peaks = {name: abs(data[name]).max("time").values for name in ("tracking_error", "speed_error", "voltage_demand")}
    assert not tracking_warnings(robot, peaks | {"motor": data["motor"].values})
    assert float(data["power_balance"].max()) < 1e-11
    cords = 0.012 * (data["tension"].sel(tendon="left") - data["tension"].sel(tendon="right"))
    rotor = 8e-4 * data["a"].sel(coordinate="drum.angle")
    torque = data["motor_torque"].squeeze()
    assert float(abs(torque - cords - rotor).max()) < 0.01 * float(abs(torque).max())  # the drum itself has 2e-6 kg m2
    np.testing.assert_allclose(data["battery_power"] - 0.5, np.maximum(data["electrical_power"], 0.0), atol=1e-9)
    (panel,) = tension_panels(data)
    assert [line.name for line in panel.figure.data] == ["left", "right"]


class Idle(Load):
    def force(self, t, strips, z, water):
        return jnp.zeros((strips.weight.shape[0], 6)), z


def test_a_load_without_force_leaves_its_motion_as_it_is(some_state):
    """Cords, motor and battery stay."""
    robot = build(load_robot(FILE))
    others = robot.with_load("third", Idle())
    one, other = (
        jax.jit(lambda robot, x: robot.rates(jnp.asarray(0.1), x))(each, some_state(each)[0])
        for each in (robot, others)
    )
    assert float(abs(one.v).max()) > 1.0
    np.testing.assert_allclose(other.q, one.q, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(other.v, one.v, rtol=1e-12, atol=1e-12 * float(abs(one.v).max()))
