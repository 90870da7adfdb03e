"""What `show` and `check` tell of plates by their outlines."""

import json
from pathlib import Path

import pytest

FIN = """
name: fin
body:
  kind: rigid
  shape: {outline: [[0 mm, 0 mm], [60 mm, 0 mm], [60 mm, 40 mm]], thickness: 3 mm}
  density: 1100 kg/m3
"""


def test_a_plate_tells_area_span_mean_chord_and_aspect_ratio(nectosome):
    """A right triangle of 60 mm and 40 mm: 12 cm2, 20 mm on the mean, 60/20."""
    Path("fin.yaml").write_text(FIN)
    told = " ".join(nectosome("show", "fin.yaml").out.replace("│", "").split())
    assert "3 points in the xy plane, 60 mm x 40 mm x 3 mm, area 12 cm2; with the span along x: span 60 mm" in told
    assert "mean chord 20 mm, aspect ratio 3" in told
    found = json.loads(nectosome("show", "fin.yaml", "--json").out)["tables"]["plates"]["body"]
    numbers = [found[key]["value"] for key in ("area", "span", "chord", "ratio")]
    assert numbers == pytest.approx([1.2e-3, 0.06, 0.02, 3.0], rel=1e-12)


def test_a_plate_a_thousand_times_too_large_is_warned_of_once(nectosome):
    """A drawing in millimetres, taken for one in metres."""
    Path("fin.yaml").write_text(FIN.replace("60 mm", "340 m").replace("40 mm", "180 m"))
    answer = nectosome("check", "fin.yaml")
    warned = [line for line in (answer.out + answer.err).splitlines() if "outline" in line]
    assert len(warned) == 1 and "340 m is far outside of swimmers, bacteria to whales" in warned[0]
