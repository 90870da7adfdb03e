"""Batteries on the command line: how long they last, and how far a robot comes meanwhile."""

import json
from pathlib import Path

import pytest

# a sledge that a motor pulls along a rail against drag
SLEDGE = """
name: sledge
water: {density: 1000 kg/m3, gravity: 0 m/s2}
batteries: {pack: {voltage: 12 V, resistance: 0.5 ohm, energy: 10 Wh, idle_power: 1 W}}
body:
  kind: rigid
  shape: point
  mass: 0.2 kg
  volume: 0 m3
  joint:
    kind: prismatic
    axis: x
    motor: {torque_constant: 0.5 N m/A, resistance: 2 ohm, radius: 0.1 m, battery: pack, duty_cycle: DUTY}
  loads: {drag: {kind: lumped_drag, drag_area: [0.1 m2, 0 m2, 0 m2]}}
""".replace("DUTY", "{kind: constant, value: 0.5}")


@pytest.mark.parametrize("command", [("steady",), ("simulate", "--time", "4s", "--samples", "41")])
def test_a_battery_lasts_its_energy_over_what_its_cells_give(nectosome, command):
    """E R_b / (U_0 (U_0 - U)), with U of the power P that is told by U^2 - U_0 U + R_b P = 0; the way at the speed."""
    Path("sledge.yaml").write_text(SLEDGE)
    name, *options = command
    found = json.loads(nectosome(name, "sledge.yaml", *options, "--json").out)["tables"]
    battery, body = found["batteries"]["pack"], found["body"]
    speed = body["velocity" if name == "steady" else "velocity_mean"]["forward"]["value"]
    power = battery["power"]["value"]
    sagged = 6.0 + (36.0 - 0.5 * power) ** 0.5
    time = 36e3 * 0.5 / (12.0 * (12.0 - sagged))
    assert battery["endurance"]["value"] == pytest.approx(time, rel=1e-5)
    assert battery["range"]["value"] == pytest.approx(time * speed, rel=1e-5)
    shown = nectosome(name, "sledge.yaml", *options).out
    assert f"{round(time / 60) // 60} h {round(time / 60) % 60:02d} min" in shown
    assert max(map(len, shown.splitlines())) <= 80
