"""Files of loops: what they take, and the sentence, line and field of each mistake."""

import re
from pathlib import Path

import numpy as np
import pytest

from nectosome.description import parse_robot
from nectosome.rigs.loops_file import load_loops
from nectosome.rigs.rig_file import load_rig
from nectosome.units import InputError

from .controlled import CROSS, RIG

ROBOT = parse_robot(CROSS.replace("aliases: {", "aliases: {shove: body.joint.force.value, "))
LOOPS = """
rate: 20 Hz
loops:
  along:
    command: push=-2..2 N
    measure: body.position
    reference: 5 cm
  aside:
    command: swing=-2..2 N
    measure: side.position
    reference: 3 cm
"""


def load(folder, text):
    (folder / "loops.yaml").write_text(text.lstrip())
    return load_loops(folder / "loops.yaml")


def test_fields_are_those_of_a_loop(tmp_path):
    (tmp_path / "path.csv").write_text("t [s],x [cm]\n0,0\n1,2\n3,4\n")
    text = LOOPS.replace("3 cm", "path.csv\n    gains: 20, 30, 10\n    noise: 1 mm\n    delay: 20 ms")
    file = load(tmp_path, text)
    tasks = file.tasks(ROBOT)
    assert [task.command.name for task in tasks.values()] == ["push", "swing"]
    aside = tasks["aside"]
    assert aside.given is not None and aside.given.row.tolist() == [20, 30, 10]
    assert (aside.sensor.noise, aside.sensor.delay, aside.robot.dt) == (1e-3, 0.02, 0.05)
    assert tasks["along"].given is None
    assert file.seconds(tasks) == 10.0  # of the constant; the recording has 3 s
    np.testing.assert_allclose(aside.samples(3.0)[[0, 20, 60]], [0.0, 0.02, 0.04])


def test_a_reference_may_be_any_signal_with_its_fields(tmp_path):
    text = LOOPS.replace("3 cm", "{kind: stroke, amplitude: 3 cm, frequency: 0.2 Hz, forward_share: 0.3}")
    file = load(tmp_path, text)
    tasks = file.tasks(ROBOT)
    assert file.seconds(tasks) == 10.0
    samples = tasks["aside"].samples(5.0)
    assert samples[15] == samples.max() == pytest.approx(0.03)  # a quarter of a stroke, at 0.15 of 5 s


def test_a_recording_among_the_fields_is_beside_the_file(tmp_path):
    (tmp_path / "path.csv").write_text("t [s],x [cm]\n0,0\n1,2\n3,4\n")
    tasks = load(tmp_path, LOOPS.replace("3 cm", "{kind: recording, file: path.csv, factor: -1}")).tasks(ROBOT)
    np.testing.assert_allclose(tasks["aside"].samples(3.0)[[0, 20, 60]], [0.0, -0.02, -0.04])


def test_one_rate_by_default_and_that_of_a_rig(tmp_path):
    file = load(tmp_path, LOOPS.replace("rate: 20 Hz\n", "time: 3 s\n"))
    assert {task.robot.dt for task in file.tasks(ROBOT).values()} == {0.05}
    tasks = file.tasks(ROBOT, dt=0.01)
    assert {task.robot.dt for task in tasks.values()} == {0.01} and file.seconds(tasks) == 3.0


@pytest.mark.parametrize(
    ("old", "new", "line", "field", "message"),
    [
        ("swing=-2..2 N", "shove=-2..2 N", 8, "loops.aside.command",
         "shove sets body.joint.force.value, as the command of along does. A quantity has one controller."),
        ("side.position", "body.position", 9, "loops.aside.measure",
         "body.position tracks the reference of along already. A reading has one reference."),
        ("swing=-2..2 N", "swng=-2..2 N", 8, "loops.aside.command", 'there is no quantity called "swng"'),
        ("swing=-2..2 N", "swing=2..-2 N", 8, "loops.aside.command", "2..-2 N is empty"),
        ("side.position", "sied.position", 9, "loops.aside.measure", '"sied.position" is nothing that can be measured'),
        ("3 cm", "3 deg", 10, "loops.aside.reference", '"3 deg" is an angle'),
        ("3 cm", "sine", 7, "loops.aside.amplitude", "is missing. Length expected"),
        ("3 cm", "{kind: stroke, amplitude: 3 cm}", 10, "loops.aside.reference", "frequency: is missing."),
        ("3 cm", "3 cm\n    gains: 1, -2, 0", 11, "loops.aside.gains", '"1, -2, 0": gains must share one sign'),
        ("3 cm", "3 cm\n    mean: true", 11, "loops.aside.mean", "there is no beat to average over"),
        ("3 cm", "3 cm\n    noise: -1 mm", 11, "loops.aside.noise", "is out of range"),
        ("3 cm", "3 cm\n    rate: 10 Hz", 11, "loops.aside.rate", 'there is no field "rate" here'),
        ("    reference: 3 cm\n", "", 7, "loops.aside.reference", "is missing"),
        ("20 Hz", "20 N", 1, "rate", "Frequency expected"),
        ("rate: 20 Hz", "time: 1 ms", 1, "rate", "20 Hz for 1 ms is 0.02 samples"),
        ("3 cm", "chirp\n    amplitude: 1 cm\n    frequency: 1 Hz\n    to: 2 Hz", 1, "time", "a chirp needs it."),
    ],
)  # fmt: skip
def test_a_mistake_is_told_with_its_line_and_field(tmp_path, old, new, line, field, message):
    assert old in LOOPS
    with pytest.raises(InputError) as told:
        file = load(tmp_path, LOOPS.replace(old, new))
        file.seconds(file.tasks(ROBOT))
    error = told.value
    assert (error.file, error.line, error.field) == (str(tmp_path / "loops.yaml"), line, field), error.message
    assert message in error.message


def test_no_loops_and_another_kind_of_file(tmp_path):
    for text in ("loops: {}\n", "rate: 20 Hz\n", "loops: {Along!: {}}\n", "dt: 5 ms\ndevices: {}\n"):
        with pytest.raises(InputError) as told:
            load(tmp_path, text)
        assert told.value.file == str(tmp_path / "loops.yaml")


SWIMMER = """
name: swimmer
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  volume: 0 m3
  joint: {kind: prismatic, axis: x, stiffness: 5 N/m, damping: 4 N s/m, force: {kind: constant, value: 0 N}}
limbs:
  fin:
    on: body
    kind: rigid
    shape: point
    mass: 0.1 kg
    centre_of_mass: [0 m, 0.2 m, 0 m]
    volume: 0 m3
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 30 deg, frequency: 2 Hz, offset: 0 deg}}
aliases: {push: body.joint.force.value, bias: limbs.fin.joint.motion.offset}
"""


def test_rates_that_differ_by_default_are_told(tmp_path):
    """Four samples a beat with `mean`, 20 Hz else."""
    text = (
        LOOPS.replace("rate: 20 Hz\n", "")
        .replace("side.position", "fin.angle")
        .replace("swing=-2..2 N", "bias=-9..9 deg")
    )
    file = load(tmp_path, text.replace("3 cm", "3 deg\n    mean: true"))
    with pytest.raises(InputError) as told:
        file.tasks(parse_robot(SWIMMER))
    assert told.value.field == "rate"
    assert told.value.message.endswith("one rate, and by default they would have 20 Hz of along, 8 Hz of aside.")


NAMED = (
    LOOPS.replace("rate: 20 Hz\n", "").replace("5 cm", "5 cm\n    rig_command: tank.a\n    rig_measure: tank.x")
    + "    rig_command: tank.b\n    rig_measure: tank.y\n"
)


@pytest.mark.parametrize(
    ("old", "new", "line", "field", "message"),
    [
        ("    rig_command: tank.a\n", "", 2, "loops.along.rig_command", "the rig has several commands: tank.a, tank.b"),
        ("tank.x", "tank.z", 7, "loops.along.rig_measure", '"tank.z" is no measurement of this rig'),
        ("tank.b", "tank.a", 12, "loops.aside.rig_command", "tank.a is the command of along: each loop needs its own."),
        ("tank.y", "tank.x", 13, "loops.aside.rig_measure", "tank.x is the measurement of along: each loop needs"),
        ("loops:", "rate: 10 Hz\nloops:", 1, "rate", "10 Hz, and dt of the rig is 50 ms, which is its sample time."),
    ],
)  # fmt: skip
def test_what_does_not_fit_a_rig_is_told(tmp_path, old, new, line, field, message):
    (tmp_path / "cross.yaml").write_text(CROSS)
    (tmp_path / "rig.yaml").write_text(RIG)
    rig, file = load_rig(tmp_path / "rig.yaml"), load(tmp_path, NAMED)
    assert len(file.pairs(rig.rig)) == len(file.tasks(ROBOT, dt=rig.dt)) == 2
    with pytest.raises(InputError) as told:
        file = load(tmp_path, NAMED.replace(old, new, 1))
        file.pairs(rig.rig)
        file.tasks(ROBOT, dt=rig.dt)
    assert (told.value.line, told.value.field) == (line, field), told.value.message
    assert message in told.value.message


def test_a_rate_that_is_that_of_the_rig_may_stand(tmp_path):
    tasks = load(tmp_path, LOOPS).tasks(ROBOT, dt=0.05)
    assert {task.robot.dt for task in tasks.values()} == {0.05}


def test_the_file_of_the_page_is_that_to_start_from(tmp_path):
    root = Path(__file__).parents[2]
    page = (root / "docs/how-to/control.md").read_text(encoding="utf-8")
    (block,) = re.findall(r'```yaml title="loops.yaml"\n(.*?)```', page, re.DOTALL)
    template = load_loops(root / "src/nectosome/cli/templates/loops.yaml").given
    assert load(tmp_path, block).given == template.model_copy(update={"about": ""})
