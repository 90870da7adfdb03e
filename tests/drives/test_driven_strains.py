"""Strains that motors drive, in every verb: cycles, sweeps, designs, fits, loops, pages, saved results, warnings."""

import numpy as np
import pytest

from nectosome.controllers import control
from nectosome.core import Status
from nectosome.description import apply_settings, dump_robot, numeric_paths, parse_robot, with_values
from nectosome.description.plausible import implausible
from nectosome.designs import design
from nectosome.designs.sweep import sweep
from nectosome.identification import identify
from nectosome.search import Pattern
from nectosome.solve import periodic, reading, simulate, static, tracking_warnings
from nectosome.units import InputError
from nectosome.view import show_run

FIN = """
name: fin on a bench
water: {gravity: 0 m/s2}
batteries: {pack: {voltage: 5 V, resistance: 0.3 ohm}}
limbs:
  fin:
    kind: rod
    section: rectangle
    width: 5 mm
    height: 40 mm
    length: 0.2 m
    young: 1 MPa
    density: 1100 kg/m3
    damping: 300 Pa s
    points: 4
    drive: {bending_z: {ratio: 1.5, envelope: [0.3, 1], DRIVE}}
    loads: {drag: {kind: drag, normal: 1.9}, water: {kind: added_mass, normal: 1}}
"""
BESIDE = "model: XC330-M288-T, battery: pack, full_voltage_at: 6 deg, inertia: 2e-4 kg m2"
SERVO = f"motion: {{kind: sine, amplitude: 25 deg, frequency: 1 Hz}}, servo: {{{BESIDE}}}"
MOTOR = "motor: {torque_constant: 0.5 N m/A, resistance: 2 ohm, inertia: 1e-3 kg m2, battery: pack, VOLTAGE}"
SHAFT, DRIVE = "fin.bending_z.angle", "limbs.fin.drive.bending_z"


def fin(drive=SERVO, **voltage):
    return parse_robot(FIN.replace("DRIVE", drive.replace("VOLTAGE", voltage.get("by", ""))))


def test_a_file_is_written_and_read_again_and_its_numbers_have_paths():
    described = fin()
    assert parse_robot(dump_robot(described)) == described
    paths = {f"{DRIVE}.ratio", f"{DRIVE}.envelope.1", f"{DRIVE}.motion.amplitude", f"{DRIVE}.servo.gear_ratio"}
    assert paths <= {*numeric_paths(described)}
    other = apply_settings(described, [f"{DRIVE}.servo.model=HS-5646WP", f"{DRIVE}.ratio=3"])
    assert other.powered[SHAFT].drive.rated_voltage == 6.0
    assert other.limbs["fin"].drive.bending_z.ratio == 3.0
    bare = with_values(described, {f"{DRIVE}.servo.inertia": 0.0})
    assert [path for path, _ in implausible(bare)] == [f"{DRIVE}.servo.inertia"]


def test_a_sweep_has_the_cycle_of_each_ratio():
    """With twice the ratio the rod is four times as stiff at the shaft."""
    found = sweep(fin(), {f"{DRIVE}.ratio": [1.5, 3.0]}, samples=65, rtol=1e-6)
    one = periodic(with_values(fin(), {f"{DRIVE}.ratio": 3.0}), samples=65, rtol=1e-6).means()
    here = found.sel({f"{DRIVE}.ratio": 3.0})
    for name in ("current_peak", "tracking_error_peak", "battery_power", "electrical_power"):
        np.testing.assert_allclose(here[name], np.asarray(getattr(one, name)), rtol=1e-3, err_msg=name)
    assert found["motor"].values.tolist() == [SHAFT]
    assert 1.5 < float(found["current_peak"][1, 0] / found["current_peak"][0, 0]) < 8.0
    # over a cycle what the motor takes is heat of its own, of the rod's viscosity, and of the water
    spent = here["motor_heat"].sum() - here["load_power"].sel(load=["drag", "viscous"]).sum()
    assert float(here["electrical_power"].sum()) == pytest.approx(float(spent), rel=2e-3)


@pytest.mark.slow
def test_a_design_takes_the_gear_that_needs_least(tmp_path):
    gear = f"{DRIVE}.servo.gear_ratio"
    ranges = {gear: "0.25..2"}
    ends = sweep(fin(), {gear: [0.25, 2.0]}, samples=65)["battery_power"].values.ravel()
    found = design(
        fin(), vary=ranges, minimise="battery_power", keep=["voltage_demand <= 1", "current <= 1 A"],
        optimiser=Pattern(evaluations=12), starts=1, folder=tmp_path,
    )  # fmt: skip
    assert found.best.outputs["battery_power"] < 0.9 * ends.min()
    assert found.best.outputs["voltage_demand"] < 1
    assert 0.3 < found.robot.powered[SHAFT].drive.gear_ratio < 1.0


@pytest.mark.slow
def test_angle_and_current_tell_the_constants_of_its_motor():
    time = np.linspace(0.0, 1.0, 51)
    swing = "voltage: {kind: sine, amplitude: 2 V, frequency: 0.8 Hz}"
    run = simulate(fin(MOTOR, by=swing), 1.0, samples=51, rtol=1e-8, atol=1e-10)
    recorded = {
        "time": time,
        **{name: reading(run, f"{of}{SHAFT}") for name, of in (("turn", ""), ("amps", "current."))},
    }
    before = with_values(fin(MOTOR, by=swing), {f"{DRIVE}.motor.torque_constant": 0.4, f"{DRIVE}.ratio": 1.8})
    found = identify(
        before,
        [recorded],
        vary={f"{DRIVE}.motor.torque_constant": "0.2..1 N m/A", f"{DRIVE}.ratio": "1..3"},
        compare={"turn": SHAFT, "amps": f"current.{SHAFT}"},
        errors={"turn": 1e-3, "amps": 1e-2},
        starts=1,
    )
    np.testing.assert_allclose(found.theta, [0.5, 1.5], rtol=1e-4)
    assert found.identifiability.identifiable.all()


def test_a_loop_reads_the_shaft_and_sets_the_duty_cycle():
    """A PID at 50 Hz brings the shaft to 20 deg; its integral gives what the rod's stiffness takes."""
    duty = fin(MOTOR, by="duty_cycle: {kind: constant, value: 0}")
    result = control(
        duty, command=f"{DRIVE}.motor.duty_cycle.value=-1..1", measure=SHAFT, reference="20 deg",
        gains="0.05,0.05,0", rate="50Hz", time="4s",
    )  # fmt: skip
    assert result.status == Status.SOLVED
    assert result.record.output[-1] == pytest.approx(np.radians(20), rel=2e-3)


def test_a_command_may_be_the_setpoint_of_its_servo():
    setpoint = SERVO.replace("{kind: sine, amplitude: 25 deg, frequency: 1 Hz}", "{kind: constant, value: 0 deg}")
    result = control(
        fin(setpoint), command=f"{DRIVE}.motion.value=-40..40 deg", measure=SHAFT, reference="10 deg",
        gains="0,4,0", rate="20Hz", time="3s",
    )  # fmt: skip
    assert result.record.output[-1] == pytest.approx(np.radians(10), rel=5e-3)


def test_a_saved_run_has_its_readings_and_a_page_with_its_torque_line(tmp_path):
    run = simulate(fin(), 0.5, samples=26)
    saved = run.to_dataset()
    for name in (SHAFT, f"{SHAFT}.rate", f"current.{SHAFT}", f"motor_torque.{SHAFT}"):
        np.testing.assert_allclose(reading(saved, name), reading(run, name), rtol=1e-9, atol=1e-12, err_msg=name)
    assert saved["coordinate_unit"].values.tolist() == ["rad"]
    show_run(run, tmp_path / "run.html")
    assert f"{SHAFT}, torque line" in (tmp_path / "run.html").read_text()


def test_a_servo_that_cannot_hold_a_stiff_rod_is_told():
    held = static(
        fin(SERVO.replace("frequency: 1 Hz", "frequency: 1 Hz, phase: 90 deg")), settings=["limbs.fin.young=5GPa"]
    )
    data = held.to_dataset()
    peaks = {name: np.abs(data[name].values[0]) for name in ("tracking_error", "speed_error", "voltage_demand")}
    (told,) = tracking_warnings(held.value.system.description, {"motor": data["motor"].values, **peaks})
    assert told.startswith(f"the servo of {SHAFT} cannot follow its motion: its tracking error is up to")


def test_a_motor_at_a_constant_voltage_has_no_period():
    with pytest.raises(InputError, match=f"{DRIVE}.motor: a motor finds its own speed"):
        periodic(fin(MOTOR, by="voltage: {kind: constant, value: 1 V}"))
