"""A saved run as a table: each column has one unit, and reads back as a recording."""

import numpy as np
import pytest

from nectosome import measure
from nectosome.description import parse_robot
from nectosome.export.run_table import run_table
from nectosome.solve import simulate

ARM = """
name: arm
water: {gravity: 9.81 m/s2}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  volume: 0 m3
  joint: {kind: prismatic, axis: x, velocity: 0.1 m/s}
limbs:
  rod:
    kind: rod
    section: circle
    radius: 5 mm
    length: 100 mm
    young: 1 MPa
    density: 1100 kg/m3
    points: 3
    strains: {bending_y: 0, extension: 0}
    joint: {kind: revolute, axis: y, motion: {kind: sine, amplitude: 10 deg, frequency: 1 Hz}}
"""


def test_every_number_of_a_run_reads_back_with_its_unit(tmp_path):
    data = simulate(parse_robot(ARM), 0.05, samples=6).to_dataset()
    file = tmp_path / "run.csv"
    run_table(data).to_csv(file, index=False)
    head = file.read_text().splitlines()[0]
    for column in (
        "time (s)",
        "q body.position (m)",
        "q rod.bending_y.0 (rad)",
        "q rod.extension.0",
        "v body.position (m/s)",
    ):
        assert f"{column}," in head
    for column in ("v rod.extension.0 (1/s)", "reaction rod.angle (N m)", "drive_velocity rod.angle (rad/s)"):
        assert f",{column}," in head
    assert " or " not in head
    found = measure.read(file)
    for k, name in enumerate(data["coordinate"].values):
        np.testing.assert_array_equal(found[f"q {name}"], data["q"].values[:, k])
        np.testing.assert_array_equal(found[f"v {name}"], data["v"].values[:, k])
    assert found["q body.position"].attrs["units"] == "m"
    assert found["q rod.bending_y.0"].attrs["units"] == "rad"
    np.testing.assert_array_equal(found["time"], data["time"])
    assert float(found["load_power weight rod"][-1]) == pytest.approx(
        float(data["load_power"].sel(load="weight", part="rod")[-1]), rel=0
    )
