# ruff: noqa: E501  (tables: one case a line)
"""Mistakes in drives and batteries, each with its field, its value and a way out; what is odd is told."""

import pytest

from nectosome.description import parse_robot
from nectosome.description.plausible import implausible
from nectosome.units import InputError

K = "torque_constant: 0.5 N m/A, resistance: 2 ohm, inertia: 1e-3 kg m2"
SHEET = "rated_voltage: 6 V, stall_torque: 1 N m, no_load_speed: 50 rpm"
VOLTS = "voltage: {kind: constant, value: 6 V}"
MOTION = "motion: {kind: sine, amplitude: 30 deg, frequency: 1 Hz}"
SERVO = "model: XW540-T140-R, inertia: 1e-3 kg m2"
FULL = "supply: 12 V, full_voltage_at: 10 deg"


def motor(fields, kind="revolute", **more):
    return robot(f"{{kind: {kind}, axis: x, motor: {{{fields}}}}}", **more)


def servo(fields, also=MOTION, **more):
    return robot(f"{{kind: revolute, axis: x, {also}, servo: {{{SERVO}, {fields}}}}}", **more)


def robot(joint, battery=""):
    packs = f"batteries: {{pack: {{{battery}}}}}\n" if battery else ""
    body = (
        f"body:\n  kind: rigid\n  shape: point\n  mass: 1 kg\n  inertia: [1 g m2, 1 g m2, 1 g m2]\n  joint: {joint}\n"
    )
    return f"name: bench\n{packs}{body}"


def fin(drive, more="", name="bending_z"):
    rod = (
        "kind: rod, section: circle, radius: 1 cm, length: 20 cm, young: 1 MPa, density: 1 g/cm3, joint: {kind: fixed}"
    )
    return f"name: bench\nbody: {{{rod}, {more}drive: {{{name}: {{{drive}}}}}}}\n"


DUTY = "duty_cycle: {kind: sine, amplitude: 0.8, offset: 0.3, frequency: 1 Hz}"
PACK = "voltage: 12 V, resistance: 1 ohm"
SPUN = f"ratio: 2, motor: {{{K}, {VOLTS}}}"
FOLLOWS = f"ratio: 2, {MOTION}, servo: {{{SERVO}, {FULL}}}"
WAVE = "motion: {bending_z: {kind: wave, amplitude: 2 1/m, frequency: 1 Hz}}, "
STRAIN = "body.drive.bending_z"
MISTAKES = [
    (motor(K), "motor.voltage: is missing. Give the voltage over time, or the duty cycle of a supply or battery."),
    (motor(VOLTS), "motor.rated_voltage: is missing. A motor needs rated_voltage, stall_torque, no_load_speed, or a model of the catalogue, or torque_constant, resistance."),
    (motor(f"{SHEET}, resistance: 2 ohm, {VOLTS}"), "motor.resistance: there is a data sheet as well. Give the data sheet or the constants."),
    (motor(f"torque_constant: 1 N m/A, {VOLTS}"), "motor.resistance: is missing. A motor needs torque_constant, resistance."),
    (motor(f"{SHEET}, stall_current: 2.1 A, no_load_current: 3 A, {VOLTS}"), "motor.no_load_current: 3 A is not less than the stall current of 2.1 A. Check the units of both."),
    (motor(f"{SHEET}, stall_current: 200 mA, {VOLTS}"), "motor.stall_torque: is more than 0.2292 N m, which this current gives"),
    (motor(f"{SHEET.replace('50 rpm', '0 rpm')}, {VOLTS}"), 'motor.no_load_speed: "0 rpm" is out of range: it must be more than 0 rad/s.'),
    (motor(f"{SHEET.replace('1 N m', '1 N')}, {VOLTS}"), 'motor.stall_torque: "1 N" is a force. Torque expected'),
    (motor(f"{SHEET}, friction: 0.1 N m, {VOLTS}"), "motor.friction: goes with the constants; with a data sheet, give the no_load_current."),
    (motor(f"{K}, gear_ratio: 0, {VOLTS}"), 'motor.gear_ratio: "0" is out of range: it must be more than 0.'),
    (motor(f"{K}, efficiency: 1.2, {VOLTS}"), 'motor.efficiency: "1.2" is out of range: it must be more than 0 and at most 1.'),
    (motor(f"{K}, efficiency: 120 %, {VOLTS}"), 'motor.efficiency: "120 %" has no readable unit (%). Number expected, as in "0.5".'),
    (motor(f"{K.replace('2 ohm', '-2 ohm')}, {VOLTS}"), 'motor.resistance: "-2 ohm" is out of range: it must be more than 0 ohm.'),
    (motor(f"{K}, current_limit: 0 A, {VOLTS}"), 'motor.current_limit: "0 A" is out of range: it must be more than 0 A.'),
    (motor(f"{K}, ratio: 3, {VOLTS}"), 'motor.ratio: there is no field "ratio" here. Did you mean "gear_ratio"?'),
    (motor(f"model: XW540, {VOLTS}"), 'motor.model: there is no motor "XW540" in the catalogue. Known: XW540-T140-R'),
    (motor(f"{K}, radius: 5 mm, {VOLTS}"), "motor.radius: is for slides. Leave it out."),
    (motor(f"{K}, {VOLTS}", kind="prismatic"), "motor.radius: is missing. Give the radius of the drum or pinion."),
    (motor(f"{K}, voltage: {{kind: constant, value: 6 A}}"), 'motor.voltage.value: "6 A" is a current. Voltage expected'),
    (motor(f"{K}, {DUTY}"), "motor.duty_cycle: goes beyond -1 or 1, the full voltage of the supply backward and forward."),
    (motor(f"{K}, {DUTY.replace('0.8', '0.5')}"), "motor.supply: is missing. The duty cycle is a share of its voltage: give a supply or a battery."),
    (motor(f"{K}, {DUTY.replace('0.8', '0.5')}, {VOLTS}, supply: 6 V"), "motor.duty_cycle: there is a voltage as well. Leave one of the two out."),
    (servo(FULL, also="stiffness: 1 N m/rad"), "joint.motion: is missing. Say which motion the servo is to follow."),
    (servo(FULL, also=f"{MOTION}, torque: {{kind: constant, value: 1 N m}}"), "joint.torque: a joint with a motion cannot have a torque as well."),
    (servo(FULL, also=f"{MOTION}, motor: {{{K}, {VOLTS}}}"), "joint.servo: there is a motor as well. Leave one of the two out."),
    (servo(FULL, also=f"{MOTION}, limits: {{torque: 1 N m, speed: 5 rad/s}}"), "joint.limits: follow from the servo. Leave one of the two out."),
    (servo("supply: 12 V"), "servo.full_voltage_at: is missing. Say at which error the motor gets all of the voltage, or give a velocity_loop."),
    (servo(f"{FULL}, velocity_loop: {{full_voltage_at: 5 rad/s}}"), "servo.full_voltage_at: there is a velocity loop as well. Leave one of the two out."),
    (servo(FULL.replace("10 deg", "10 mm")), 'servo.full_voltage_at: "10 mm" is a length. Angle expected'),
    (servo(f"{FULL}, update_rate: 0 Hz"), 'servo.update_rate: "0 Hz" is out of range: it must be more than 0 Hz.'),
    (servo(f"{FULL}, update_rate: -50 Hz"), 'servo.update_rate: "-50 Hz" is out of range: it must be more than 0 Hz.'),
    (servo(f"{FULL}, update_rate: 20 ms"), 'servo.update_rate: "20 ms" is a time. Frequency expected'),
    (motor(f"{K}, {VOLTS}, update_rate: 50 Hz"), 'motor.update_rate: there is no field "update_rate" here.'),
    (servo("full_voltage_at: 10 deg"), "servo.supply: is missing. Give the voltage of a supply, or the name of a battery."),
    (servo("full_voltage_at: 10 deg, battery: pakc", battery=PACK), 'servo.battery: there is no battery "pakc". Did you mean "pack"?'),
    (servo("full_voltage_at: 10 deg, battery: pack"), 'servo.battery: there is no battery "pack". Describe it under batteries.'),
    (servo(f"{FULL}, battery: pack", battery=PACK), "servo.supply: there is a battery as well. Leave one of the two out."),
    (motor(f"{K}, {VOLTS}", battery=PACK), "batteries.pack: no drive names this battery. Leave it out, or name it in a drive."),
    (motor(f"{K}, {VOLTS}, battery: pack", battery=f"{PACK}, idle_power: 50 W"), "batteries.pack.idle_power: is more than 36 W, the most that a battery of this resistance gives."),
    (motor(f"{K}, {VOLTS}, battery: pack", battery=f"{PACK}, capacity: 52 Wh"), 'batteries.pack.capacity: "52 Wh" is an energy. Charge expected'),
    (motor(f"{K}, {VOLTS}, battery: pack", battery=f"{PACK}, regenerative: often"), 'batteries.pack.regenerative: "often" does not fit here. True or false expected.'),
    (fin("ratio: 2"), f"{STRAIN}.motor: is missing. Give a motor, or a motion and the servo that follows it."),
    (fin(f"ratio: 2, {MOTION}"), f"{STRAIN}.servo: is missing. Give one, or leave the drive out and give the rod itself the motion."),
    (fin(FOLLOWS.replace(f"{MOTION}, ", "")), f"{STRAIN}.motion: is missing. Say which motion the servo is to follow."),
    (fin(f"{FOLLOWS}, motor: {{{K}, {VOLTS}}}"), f"{STRAIN}.servo: there is a motor as well. Leave one of the two out."),
    (fin(f"{SPUN}, {MOTION}"), f"{STRAIN}.motion: a strain with a motor is moved by its voltage. Leave one of the two out."),
    (fin(FOLLOWS.replace("kind: sine, amplitude: 30 deg, frequency: 1 Hz", "kind: rate, rate: 1 rad/s")), f"{STRAIN}.motion: a shaft that turns on and on bends the rod without end."),
    (fin(SPUN.replace("ratio: 2, ", "")), f"{STRAIN}.ratio: is missing."),
    (fin(SPUN.replace("ratio: 2", "ratio: 0")), f"{STRAIN}.ratio: with 0 the shaft does not move the rod. Give the radius of its drum over the distance of the cord."),
    (fin(SPUN.replace("ratio: 2", "ratio: 2 1/m")), f'{STRAIN}.ratio: "2 1/m" is not a number. Number expected'),
    (fin(f"{SPUN}, envelope: [0, 0]"), f"{STRAIN}.envelope: is 0 everywhere, so that nothing bends. Give at least one number above 0."),
    (fin(f"{SPUN}, envelope: [1, -1]"), f'{STRAIN}.envelope.1: "-1" is out of range: it must be at least 0.'),
    (fin(SPUN.replace(VOLTS, f"{VOLTS}, radius: 5 mm")), f"{STRAIN}.motor.radius: is for slides. Leave it out."),
    (fin(SPUN.replace(VOLTS, f"{VOLTS}, battery: pack")), f'{STRAIN}.motor.battery: there is no battery "pack". Describe it under batteries.'),
    (fin(SPUN, more=WAVE), "body.motion.bending_z: a motor drives bending_z (drive.bending_z). Leave one of the two out."),
    (fin(SPUN, more="strains: {bending_z: 1}, "), "body.strains.bending_z: it has the shape of an envelope, since a motor drives bending_z (drive.bending_z). Leave one of the two out."),
    (fin(SPUN, name="bending"), 'body.drive.bending: there is no field "bending" here. Did you mean "bending_z"?'),
    (fin(SPUN, name="extension"), 'body.drive.extension: there is no field "extension" here.'),
    (fin(SPUN, more="loads: {pull: {kind: muscle, strain: bending_z, moment: {kind: wave, amplitude: 1 N m, frequency: 1 Hz}}}, "), "body.loads.pull.strain: bending_z is not free: the rod's strains do not name it."),
]  # fmt: skip


@pytest.mark.parametrize(("text", "said"), MISTAKES, ids=[said.partition(":")[0] for _, said in MISTAKES])
def test_a_mistake_is_told_with_its_field_and_a_way_out(text, said):
    with pytest.raises(InputError) as told:
        parse_robot(text)
    assert said in str(told.value)


def test_a_voltage_above_that_of_the_supply_is_told():
    """The motor gets no more than its supply has."""
    described = parse_robot(
        motor(f"{K}, supply: 3 V, voltage: {{kind: sine, amplitude: 5 V, offset: -1 V, frequency: 1 Hz}}")
    )
    ((path, said),) = implausible(described)
    assert (path, said) == (
        "body.joint.motor.voltage",
        "it goes up to 6 V, and its supply gives 3 V, which it gets instead.",
    )
