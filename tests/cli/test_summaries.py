"""Python says of a run what the command line prints: the same tables, notes and numbers."""

import re

import nectosome as ns

from .test_page import ARM

HINGED = """
name: hinged
body:
  kind: rigid
  shape: box
  length: 100 mm
  width: 20 mm
  height: 20 mm
  mass: 1 kg
  joint: {kind: revolute, axis: y, stiffness: 1 N m/rad}
"""


def without_effort(text: str) -> str:
    """All words but the time that it took, which each computation has of its own."""
    return re.sub(r"[;,] \S+ s to compute$", "", " ".join(text.split()))


def test_a_run_says_what_the_command_prints(nectosome, tmp_path):
    (tmp_path / "arm.yaml").write_text(ARM)
    printed = nectosome("simulate", "arm.yaml", "--time", "1s", "--loads").out
    assert without_effort(printed) == without_effort(str(ns.simulate("arm.yaml", "1s").summary(each=True)))


def test_a_cycle_says_what_the_command_prints(nectosome, tmp_path):
    (tmp_path / "arm.yaml").write_text(ARM)
    printed = nectosome("periodic", "arm.yaml").out
    assert without_effort(printed) == without_effort(str(ns.periodic("arm.yaml").summary()))


def test_what_is_at_rest_says_what_the_command_prints(nectosome, tmp_path):
    (tmp_path / "hinged.yaml").write_text(HINGED)
    printed = nectosome("static", "hinged.yaml").out
    assert "on its support" in printed and "weight" in printed
    assert without_effort(printed) == without_effort(str(ns.static("hinged.yaml").summary()))
