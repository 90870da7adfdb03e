"""Numbers of limbs of a file, as settings, as axes of sweeps and as choices of designs."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from nectosome.description import load_robot
from nectosome.designs import design
from nectosome.designs.axes import axis_of, each_structure, structures_of
from nectosome.robots import describe
from nectosome.search import Pattern
from nectosome.units import InputError

COUNT = "limbs.weight.repeat.count"
# a body that sinks by its own 50 g and 10 g for each weight, against drag
WEIGHTS = """
name: weights
water: {density: 1000 kg/m3, gravity: 9.81 m/s2}
body:
  kind: rigid
  shape: point
  mass: 50 g
  volume: 0 m3
  inertia: [1e-3 kg m2, 1e-3 kg m2, 1e-3 kg m2]
  joint: {kind: prismatic, axis: z}
  loads: {drag: {kind: lumped_drag, drag_area: [1e-3 m2, 1e-3 m2, 2e-3 m2]}}
limbs:
  weight:
    on: body
    repeat: {count: 3, along: [10 mm, 0 m, 0 m]}
    kind: rigid
    shape: point
    mass: 10 g
    volume: 0 m3
    inertia: [0 kg m2, 0 kg m2, 0 kg m2]
    joint: {kind: fixed}
aliases: {A: body.loads.drag.drag_area.2}
"""


@pytest.fixture
def file(tmp_path) -> str:
    path = tmp_path / "weights.yaml"
    path.write_text(WEIGHTS)
    return str(path)


def test_a_file_has_as_many_copies_as_a_setting_says(file):
    assert [*describe(file).limbs] == ["weight1", "weight2", "weight3"]
    assert [*describe(file, [f"{COUNT}=5", "A=3e-3m2"]).limbs] == [f"weight{k}" for k in range(1, 6)]
    assert load_robot(file, {COUNT: 3}) == load_robot(file)
    for setting, said in (
        (f"{COUNT}=1", "weights.yaml, line 15, limbs.weight.repeat.count: "),
        (f"{COUNT}=two", 'limbs.weight.repeat.count: "two" is not a number of parts'),
        ("limbs.fin.repeat.count=3", "limbs.fin.repeat.count: the file has no limb with such a count"),
    ):
        with pytest.raises(InputError) as caught:
            describe(file, [setting])
        assert said in str(caught.value)


def test_counts_are_another_structure_each(file):
    structures = structures_of(file, {COUNT: "2..6:2", "A": "1..2 m2"}, [])
    assert structures == {COUNT: (2, 4, 6)}
    assert [len(one.limbs) for one in each_structure(file, structures, []).values()] == [2, 4, 6]
    assert axis_of(COUNT, "2..4", None).values == (2, 3, 4)
    with pytest.raises(InputError, match="is a count: whole numbers"):
        axis_of(COUNT, "2,2.5", None)
    with pytest.raises(InputError, match="give the robot by its name"):
        structures_of(describe(file), {COUNT: "2,4"}, [])


def test_a_design_takes_the_best_number_of_limbs(file, tmp_path):
    """V = sqrt(2 m g / (rho A)): the most weights on the least area that is in steps; a file of it has all."""
    found = design(
        file,
        vary={COUNT: "2,5", "A": "1e-3..3e-3 m2 : 1e-3 m2"},
        forward="-z",
        optimiser=Pattern(evaluations=9),
        starts=1,
        folder=tmp_path / "run",
        executor=ThreadPoolExecutor(1),
    )
    assert (found.choice, [one.choice for one in found.choices]) == ("5", ["2", "5"])
    assert found.best.outputs["speed"] == pytest.approx(np.sqrt(2 * 0.1 * 9.81 / (1000 * 1e-3)), rel=1e-6)
    tried = {round(float(e.u[0]), 9) for one in found.choices for s in one.search.starts for e in s.evaluations}
    assert tried <= {0.0, 0.5, 1.0}
    best = load_robot(tmp_path / "run" / "best.yaml")
    assert len(best.limbs) == 5 and best == found.robot
    assert best.body.loads["drag"].drag_area[2] == 1e-3
    assert load_robot(tmp_path / "run" / "choice_2" / "best.yaml") == found.choices[0].robot
