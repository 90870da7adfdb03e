# ruff: noqa: E501  (tables: one case a line)
"""Paths, aliases and settings."""

import jax
import pytest

from nectosome.description import apply_settings, get_value, numeric_paths, resolve, with_values
from nectosome.description.robot_file import read_value
from nectosome.io.schema.quantity import Si
from nectosome.io.schema.structure import shortest
from nectosome.units import InputError


def test_every_quantity_has_a_path(flagellum):
    paths = numeric_paths(flagellum)
    assert paths["limbs.filament.young"].dimension == "pressure"
    assert paths["limbs.filament.young"].unit == "Pa"
    assert paths["body.loads.hull.drag_area.0"].dimension == "area"
    assert paths["limbs.shaft.joint.motion.rate"].unit == "rad/s"
    assert "limbs.filament.points" not in paths
    assert "limbs.filament.strains.torsion" not in paths
    assert all(isinstance(get_value(flagellum, path), float) for path in paths)


def test_values_are_put_where_the_path_leads(flagellum):
    changed = with_values(flagellum, {"omega": 20.0, "body.offset.2": 0.3, "body.loads.hull.drag_area.1": 0.5})
    assert get_value(changed, "omega") == 20.0
    assert changed.body.offset == (0.0, 0.0, 0.3)
    assert changed.body.loads["hull"].drag_area == (0.012566370614359173, 0.5, 0.0)
    assert get_value(flagellum, "omega") == 14.4
    assert with_values(changed, {p: get_value(flagellum, p) for p in numeric_paths(flagellum)}) == flagellum


def test_names_are_told_apart_by_their_last_words():
    found = shortest(["limbs.left.motion.rate", "limbs.right.motion.rate", "limbs.left.young", "omega"])
    assert [*found.values()] == ["left.motion.rate", "right.motion.rate", "young", "omega"]
    assert shortest(["loads.foil.chord.0", "f"]) == {"loads.foil.chord.0": "chord.0", "f": "f"}
    assert shortest(["rate", "motion.rate"]) == {"rate": "rate", "motion.rate": "motion.rate"}


def test_a_value_may_be_traced(flagellum):
    def stiffness(young):
        rod = with_values(flagellum, {"E": young}).limbs["filament"]
        return rod.young * rod.radius**2

    assert jax.grad(stiffness)(7.4e6) == pytest.approx(0.0125**2)


def test_an_alias_may_set_several_paths_together(flagellum):
    both = ("limbs.shaft.radius", "limbs.hook.radius")
    robot = flagellum.model_copy(update={"aliases": {"r": both}})
    assert resolve(robot, "r") == list(both)
    assert read_value("r", "10mm", robot) == dict.fromkeys(both, 0.01)
    changed = apply_settings(robot, ["r = 10 mm"])
    assert [get_value(changed, path) for path in both] == [0.01, 0.01]


def test_settings_are_read_like_the_file(flagellum):
    assert read_value("omega", "14.4rad/s", flagellum) == {"limbs.shaft.joint.motion.rate": 14.4}
    changed = apply_settings(
        flagellum,
        [
            "omega=20rad/s",
            "limbs.filament.strains.torsion=5",
            "body.offset.2=3 mm",
            "water.surface=-1 m",
            "limbs.shaft.joint.axis.1=0.5",
            "limbs.hook.joint={kind: revolute, axis: z, stiffness: 2 N m}",
            "name=other",
        ],
    )
    assert get_value(changed, "omega") == 20.0
    assert changed.limbs["filament"].strains["torsion"] == 5
    assert changed.body.offset == (0.0, 0.0, 0.003)
    assert changed.water.surface == -1.0
    assert changed.limbs["shaft"].joint.axis == (1.0, 0.5, 0.0)
    assert changed.limbs["hook"].joint.stiffness == 2.0
    assert changed.name == "other"


def test_numbers_in_si_go_in_as_they_are_and_their_unit_is_checked(flagellum):
    speed = 0.1 + 0.2  # not what a text with 15 digits says
    found = apply_settings(flagellum, {"omega": Si(speed, "rad/s"), "body.offset": [Si(0.0), Si(speed), Si(0.0)]})
    assert get_value(found, "omega") == speed and found.body.offset == (0.0, speed, 0.0)
    assert get_value(apply_settings(flagellum, {"omega": "20 rad/s"}), "omega") == 20.0
    with pytest.raises(InputError, match='"3 m" is a length') as caught:
        apply_settings(flagellum, {"omega": Si(3.0, "m")})
    assert caught.value.field == "omega"
    with pytest.raises(InputError, match='"3" has no unit'):
        apply_settings(flagellum, {"omega": Si(3.0, "")})


def test_no_settings_change_nothing(flagellum):
    assert apply_settings(flagellum, []) == flagellum


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("omega", '"omega" is no setting. Write a name, = and a value, as in "omega=14.4rad/s".'),
        ("omega=", '"omega=" is no setting. Write a name, = and a value, as in "omega=14.4rad/s".'),
        ("omgea=3 rad/s", 'there is nothing called "omgea" in flagellum. Did you mean "omega"?'),
        ("omega=3", 'omega: "3" has no unit. Angular speed expected, as in "14.4 rad/s" or "137 rpm".'),
        ("E=nan Pa", 'E: "nan Pa" must be finite. Pressure expected, as in "7.4 MPa" or "7.4e6 Pa".'),
        ("E=-1 Pa", 'E: "-1 Pa" is out of range: it must be more than 0 Pa.'),
        ("limbs.filament.poisson=0.6", 'limbs.filament.poisson: "0.6" is out of range: it must be from 0 to 0.5.'),
        ("limbs.filament.strains.torsion=50", 'limbs.filament.strains.torsion: "50" does not fit here. A whole number from 0 to 20 expected.'),
        ("limbs.filament.strains.torsion=2.5", 'limbs.filament.strains.torsion: "2.5" does not fit here. A whole number from 0 to 20 expected.'),
        ("limbs.filament.strains.tortion=5", 'limbs.filament.strains.tortion: "tortion" is not known here. Did you mean "torsion"?'),
        ("limbs.fliament.young=5 Pa", 'there is nothing called "limbs.fliament.young" in flagellum. Did you mean "limbs.filament.young"?'),
        ("limbs.shaft.joint.motion=[1", "limbs.shaft.joint.motion: this is not YAML: expected ',' or ']', but got '<stream end>'."),
        ("body.offset.3=1 m", 'there is nothing called "body.offset.3" in flagellum. Did you mean "body.offset.2"?'),
    ],
)  # fmt: skip
def test_a_wrong_setting_is_told(flagellum, setting, message):
    with pytest.raises(InputError) as caught:
        apply_settings(flagellum, [setting])
    assert str(caught.value) == message


def test_an_unknown_path_is_told(flagellum):
    message = 'there is no quantity called "limbs.filament.yung" in flagellum. Did you mean "limbs.filament.young"?'
    for ask in (resolve, get_value, lambda robot, name: with_values(robot, {name: 1.0})):
        with pytest.raises(InputError) as caught:
            ask(flagellum, "limbs.filament.yung")
        assert str(caught.value) == message
