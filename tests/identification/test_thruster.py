"""Thrusters from tables of thrust on a stand: known numbers come back, a maker's table is read as it is, bad ones."""

from pathlib import Path

import numpy as np
import pytest

import nectosome as ns
from nectosome.description import parse_robot
from nectosome.identification import identify_thruster
from nectosome.solve import reading
from nectosome.units import InputError

# rows of Blue Robotics' public performance data of the T200 (2019) at 16 and 12 V, as they are printed
HEAD = " PWM (µs), RPM, Current (A), Voltage (V), Power (W), Force (Kg f), Efficiency (g/W)\n"
MAKER = {
    "16": """\
1100,3465,24.30,16,388.8,-4.07,10.5
1180,3003,14.04,16,224.6,-2.99,13.3
1260,2440,6.89,16,110.2,-1.94,17.6
1340,1807,2.4,16,38.4,-1.02,26.6
1420,1016,0.4,16,6.4,-0.32,50.3
1468,317,0.05,16,0.8,-0.04,45.4
1472,0,0,16,0.0,0.00,0.0
1528,0,0,16,0.0,0.00,0.0
1532,308,0.05,16,0.8,0.04,51.0
1580,1007,0.4,16,6.4,0.40,62.4
1660,1802,2.6,16,41.6,1.28,30.7
1740,2446,7,16,112.0,2.43,21.7
1820,3042,13.99,16,223.8,3.82,17.1
1900,3533,23.83,16,381.3,5.25,13.8
""",
    "12": """\
1100,2976,17.03,12,204.4,-2.90,14.2
1180,2576,10.5,12,126.0,-2.14,17.0
1260,2082,5.17,12,62.0,-1.37,22.1
1340,1529,1.8,12,21.6,-0.72,33.4
1420,820,0.29,12,3.5,-0.20,58.7
1464,0,0,12,0.0,0.00,0.0
1536,0,0,12,0.0,0.00,0.0
1580,812,0.3,12,3.6,0.25,70.6
1660,1515,1.8,12,21.6,0.89,41.4
1740,2070,5.2,12,62.4,1.71,27.4
1820,2585,10.45,12,125.4,2.71,21.6
1900,2995,16.91,12,202.9,3.71,18.3
""",
}
D = 0.076  # of its propeller [m]
TRUTH = {"thrust": 0.4, "backward_thrust": 0.3, "torque": 0.05, "backward_torque": 0.06}
K, R = 0.02, 0.25
STAND = """
name: stand
about: A propeller on a stand.
water: {{density: 1000 kg/m3, gravity: 0 m/s2}}
body:
  kind: rigid
  shape: cylinder
  length: 20 mm
  radius: 38 mm
  mass: 50 g
  joint:
    kind: revolute
    axis: x
    velocity: {speed} rad/s
    motor: {{torque_constant: {K} N m/A, resistance: {R} ohm, inertia: 1e-5 kg m2, supply: {supply} V,
      dead_band: {dead}, duty_cycle: {{kind: constant, value: {duty}}}}}
  loads:
    push: {{kind: thruster, diameter: 76 mm, thrust: {thrust}, thrust_slope: 0.4, torque: {torque}, torque_slope: 0.03,
      backward_thrust: {backward_thrust}, backward_torque: {backward_torque}}}
"""


def made(ahead_only: bool = False) -> dict[float, str]:
    """Tables of the model itself at two voltages, and its dead band of 0.1; commands are duty cycles, speeds rad/s."""
    duty = np.arange(0.0 if ahead_only else -1.0, 1.01, 0.125)
    out = {}
    for supply in (12.0, 16.0):
        rows = "duty,speed (rad/s),current (A),voltage (V),thrust (N)\n"
        for d in duty:
            back = "backward_" if d < 0 else ""
            load = TRUTH[f"{back}torque"] * 1000 * D**5 / (4 * np.pi**2)
            u = supply * abs(d) * (abs(d) > 0.1)
            w = max(np.roots([R * load / K, K, -u]))  # K w + R Q / K = u
            push = np.sign(d) * TRUTH[f"{back}thrust"] * 1000 * D**4 * (w / (2 * np.pi)) ** 2
            rows += f"{d},{np.sign(d) * w:.12g},{abs(d) * load * w**2 / K:.12g},{supply},{push:.12g}\n"
        out[supply] = rows
    return out


def written(folder: Path, tables: dict) -> list[Path]:
    for name, text in tables.items():
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")
    return [folder / f"{name}.csv" for name in tables]


@pytest.mark.parametrize("ahead_only", [False, True])
def test_known_numbers_come_back(tmp_path, ahead_only: bool):
    found = identify_thruster(written(tmp_path, made(ahead_only)), D)
    truth = {name: x for name, x in TRUTH.items() if not (ahead_only and name.startswith("backward"))}
    assert {name: found.values[name] for name in truth} == pytest.approx(truth, rel=1e-5)
    assert (found.values["torque_constant"], found.values["resistance"]) == pytest.approx((K, R), rel=1e-5)
    assert (found.intervals["dead_band"].low, found.intervals["dead_band"].high) == (0.0, 0.125)
    assert not ahead_only or "backward_thrust" not in found.values


def test_a_makers_table_is_read_as_it_is_and_its_rows_come_back(tmp_path):
    paths = written(tmp_path, {name: HEAD + rows for name, rows in MAKER.items()})
    found = identify_thruster(paths, "76 mm")
    first = 5.25 * 9.80665 / (1000 * (3533 / 60) ** 2 * D**4)  # K_T of its last row
    assert found.values["thrust"] == pytest.approx(first, rel=0.02)
    assert found.values["dead_band"] == pytest.approx(0.085, abs=0.015)
    errors = found.to_dataset()
    # percent of the largest; most of the speed's is that of the rows where it just begins to turn
    assert all(float(errors[name].max()) < most for name, most in (("e_speed", 7), ("e_current", 3), ("e_thrust", 3)))
    # what the shaft takes is more than what the thrust needs in a duct without losses, and less than what is paid
    shaft = found.values["torque"] * 1000 * D**5 * (3533 / 60) ** 2 * 2 * np.pi * 3533 / 60
    ideal = (5.25 * 9.80665) ** 1.5 / np.sqrt(4 * 1000 * np.pi * D**2 / 4)
    assert ideal < shaft < 381.3


@pytest.mark.parametrize("duty", [0.8, -0.6, 0.05])
def test_a_robot_with_these_numbers_gives_the_table(tmp_path, duty: float):
    """Speed, current and thrust on a stand are those that the fit predicts; within the dead band all are 0."""
    found = identify_thruster(written(tmp_path, made()), D)
    table = found.tables[1]._replace(duty=np.array([duty]), supply=np.array([16.0]))
    expected = {name: float(x[0]) for name, x in found.predicted(table).items()}
    names = (*TRUTH, "torque_constant", "resistance")
    v = {name: found.values[name] for name in names}
    text = STAND.format(
        K=v.pop("torque_constant"), R=v.pop("resistance"), duty=duty, dead=0.1, supply=16, **v, speed=expected["speed"]
    )
    run = ns.simulate(parse_robot(text), 0.02, samples=2)
    arrays = run.to_dataset().isel(time=-1)
    values = {
        "speed": float(arrays["motor_rate"].item()),
        "current": float(reading(run, "electrical_power.body.angle")[-1]) / 16.0,  # of the supply
        "thrust": float(reading(run, "force.x")[-1]),
    }
    assert values == pytest.approx(expected, rel=1e-6, abs=1e-9)
    assert (values["thrust"] == 0) == (duty == 0.05)


def test_a_table_counts_once_and_an_unlikely_diameter_is_told(tmp_path):
    paths = written(tmp_path, made())
    with pytest.raises(InputError, match="is named twice"):
        identify_thruster([*paths, paths[0]], D)
    assert any("Check the diameter and the units" in words for words in identify_thruster(paths, 10 * D).warnings)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (made()[12.0].replace("speed (rad/s)", "turns"), "speed: is in no column; there are duty, turns"),
        (made()[12.0].replace("current (A)", "current (V)"), "current: is in V; A is needed"),
        (made()[12.0].replace("duty", "PWM (ms)"), "command: reaches"),
        ("\n".join(made(ahead_only=True)[12.0].splitlines()[:5]), "3 rows turn ahead, and 4 at least are needed"),
        (HEAD.replace("Force", "Force up") + MAKER["16"].replace("-", ""), "command and thrust have one sign"),
        (HEAD.replace("Power", "Supply voltage") + MAKER["16"], "supply: is in several columns"),
    ],
)
def test_what_is_no_table_of_a_thruster_is_told(tmp_path, rows: str, words: str):
    with pytest.raises(InputError) as told:
        identify_thruster(written(tmp_path, {"table": rows}), D)
    assert words in str(told.value)
    assert "table.csv" in str(told.value)
