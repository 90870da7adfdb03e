"""Parts that pass through each other at the start are told, those that touch or belong together are not."""

import pytest

from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.model.overlaps import overlaps

# bars around a hub that stand off its axis and lean towards it, or away from it
HUB = """
name: ring
body: {kind: rigid, shape: cylinder, length: 40 mm, radius: 30 mm, density: 1000 kg/m3, joint: {kind: free}}
limbs:
  bar: """
STIFF = "{kind: rigid, shape: cylinder, joint: {kind: revolute, axis: y, stiffness: 1 N m/rad}, "
SOFT = "{kind: rod, section: circle, young: 1 MPa, strains: {bending_y: 0}, points: 4, "


def told(pitch, radius="3 mm", part=STIFF, more=""):
    numbers = f"radius: {radius}, length: 100 mm, density: 1000 kg/m3, at: root, offset: [0 mm, 0 mm, 20 mm], "
    place = f"rotation: [0 deg, {pitch} deg, 0 deg], repeat: {{count: 4, around: x}}}}"
    d = parse_robot(HUB + part + numbers + place + more)
    return [f"{path} {sentence.partition(' at')[0]}" for path, sentence in overlaps(d, build(d))]


def test_bars_that_cross_on_the_axis_are_told():
    """Backward, and inward by 30 deg: 20 mm off the axis they meet it after 40 mm, all in one point."""
    found = told(150)
    assert found == told(150, radius="1 mm")
    assert found[0] == "limbs.bar1 it passes through bar2"
    assert len(found) == 6


def test_soft_limbs_are_told_as_well():
    assert len(told(150, part=SOFT)) == 6


def test_what_a_pair_joins_may_share_a_place():
    pair = "\npairs: {pin: {kind: bushing, between: [bar1, bar3], stiffness: 10 N/m}}"
    found = told(150, more=pair)
    assert len(found) == 5
    assert "limbs.bar1 it passes through bar3" not in found


@pytest.mark.parametrize("pitch", [180, 210, 170])
def test_bars_beside_each_other_are_not(pitch):
    """Straight, outward; and inward so little that they end before the axis, 2.6 mm off it, thinner than that."""
    assert told(pitch, radius="1 mm") == []
