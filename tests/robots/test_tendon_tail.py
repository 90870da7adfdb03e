"""A fish whose tail of three links is bent by two cords on the drum of one servo."""

from pathlib import Path

import numpy as np

from nectosome.core import Status
from nectosome.description import load_robot
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
