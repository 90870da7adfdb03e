"""Values that no robot has: told before anything is computed, and nothing infinite passes for a result."""

import pytest
from tests.small_robots import SLIDE


@pytest.mark.parametrize(
    ("path", "value", "status", "said"),
    [
        ("body.joint.stiffness", "1e200 N/m", "NOT_FINITE", "slide: failed: the state is NaN or infinite"),
        ("body.joint.velocity", "1e200 m/s", "SOLVED", "powers or momenta are NaN or infinite: values are too large"),
    ],
)
def test_a_number_without_meaning_is_told_and_ends_with_code_1(nectosome, tmp_path, path, value, status, said):
    file = tmp_path / "slide.yaml"
    file.write_text(SLIDE.replace("stiffness: 5", "position: 0.1 m, velocity: 0 m/s, stiffness: 5"))
    answer = nectosome("simulate", str(file), "--time", "0.1s", "--samples", "5", "--set", f"{path}={value}")
    assert answer.code == 1
    assert status in answer.out
    assert f"{file}, {path}: " in answer.err
    assert "is far outside of" in answer.err
    assert said in " ".join(f"{answer.out} {answer.err}".split())
    assert "Traceback" not in answer.err
    assert "velocity at the end           0 " not in answer.out  # a large number beside an infinite one is no zero


BOX = """
name: b
body:
  {kind: rigid, shape: box, length: 0.2 m, width: 60 mm, height: 60 mm, mass: 0.72 kg,
   inertia: [432 kg m2, 2616 kg m2, 2616 kg m2], joint: {kind: free}}
"""
URDF = """<robot name="a"><link name="base"><inertial><mass value="0.72"/>
<inertia ixx="2616" iyy="2616" izz="2616" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><box size="0.2 0.06 0.06"/></geometry></visual></link></robot>"""


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("check b.yaml", 0),
        ("show b.yaml", 0),
        ("new b.urdf c.yaml", 0),
        ("sweep b.yaml --over nothing=1..2", 2),
        ("control b.yaml --command nothing --measure position.z --reference 1m --time 1s", 2),
        ("export b.yaml --to urdf d.urdf", 0),
    ],
)
def test_every_command_tells_of_an_inertia_in_a_wrong_unit(nectosome, tmp_path, command, code):
    """The verbs that simulate build their robot as `export` does; `sweep` and `control` warn before they read on."""
    (tmp_path / "b.yaml").write_text(BOX)
    (tmp_path / "b.urdf").write_text(URDF)
    answer = nectosome(*command.split())
    assert answer.code == code, answer.err
    assert "body.inertia: with 720 g they have a radius of gyration of" in answer.err
    assert "those given would be like them in kg mm2" in answer.err
