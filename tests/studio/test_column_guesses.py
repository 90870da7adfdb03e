"""Columns of a bench are proposed for readings and signals of one unit, by their names."""

import pytest

from nectosome.studio.tasks.column_guesses import guessed

SIGNALS = {"limbs.fin.joint.motion": "rad"}
READINGS = {"force.x": "N", "force.y": "N", "force.z": "N", "reaction.fin.angle": "N m", "fin.angle": "rad"}
READINGS |= {"heading": "rad", "depth": "m"}


@pytest.mark.parametrize(("columns", "compared", "driven"), [
    ({"angle": "rad", "force": "N"}, {"force": "force.x"}, {"angle": "limbs.fin.joint.motion"}),
    ({"servo angle": "rad", "Fy": "N"}, {"Fy": "force.y"}, {"servo angle": "limbs.fin.joint.motion"}),
    ({"load_cell": "N", "present_angle": "rad", "sync": "1"}, {"load_cell": "force.x"},
     {"present_angle": "limbs.fin.joint.motion"}),
    ({"angle": "N"}, {}, {}),  # another unit than its name
    ({"force": ""}, {}, {}),  # counts without a unit are no force
    ({"heading": "rad"}, {"heading": "heading"}, {}),
    ({"depth": ""}, {"depth": "depth"}, {}),
    ({"motion": "rad", "fin.angle": "rad"}, {"fin.angle": "fin.angle"}, {"motion": "limbs.fin.joint.motion"}),
])  # fmt: skip
def test_a_pair_has_one_unit_and_names_that_benches_use(columns, compared, driven):
    assert guessed(columns, SIGNALS, READINGS) == (compared, driven)
