"""Which plates have a start-up, behind which limbs the flow separates where files leave it open; that it stays so."""

import jax
import pytest

from nectosome.description import apply_settings, dump_robot, parse_robot, with_values
from nectosome.description.drag import PlateDragLoad, StartUp
from nectosome.loads import StartingPlateDrag
from nectosome.model import build
from nectosome.units import InputError

BOX = "kind: rigid, shape: box, length: 40 mm, width: 2 mm, height: 30 mm, mass: 5 g"
HINGE = "joint: {kind: revolute, axis: z}"
ROD = (
    "kind: rod, section: ellipse, length: 90 mm, width: 2 mm, height: 20 mm, young: 1 MPa, density: 1000 kg/m3, "
    "strains: {bending_z: 1}"
)


def plate(more: str = "", field: str = "") -> str:
    """A box with the drag of a plate."""
    return f"{BOX}, {more + ', ' if more else ''}loads: {{drag: {{kind: plate_drag, normal: 1.2{field}}}}}"


def chain(hinges: int, field: str = "") -> str:
    """A plate that is let go, and so many more behind it, each on a hinge."""
    links = [
        f"  link{k}: {{on: {f'link{k - 1}' if k > 1 else 'body'}, {plate(HINGE, field)}}}" for k in range(1, hinges + 1)
    ]
    return "\n".join(["name: chain", f"body: {{{plate('joint: {kind: planar, axis: z}', field)}}}", "limbs:", *links])


def starts(text: str) -> dict[str, bool]:
    """Whether the drag of each plate has a start-up, by part."""
    parts = parse_robot(text).parts
    return {
        name: load.start_up is not None
        for name, part in parts.items()
        for load in part.loads.values()
        if isinstance(load, PlateDragLoad)
    }


@pytest.mark.parametrize(("hinges", "has_it"), [(1, True), (2, True), (3, False), (5, False)])
def test_a_paddle_has_it_and_a_chain_along_which_waves_run_does_not(hinges: int, has_it: bool):
    """From three hinges on, all of its links, the first one and the last one too."""
    assert starts(chain(hinges)) == dict.fromkeys(["body", *(f"link{k}" for k in range(1, hinges + 1))], has_it)


def test_a_side_branch_of_few_hinges_has_it_beside_a_chain():
    text = chain(4) + f"\n  fin: {{on: link1, at: root, {plate(HINGE)}}}"
    assert starts(text) == dict.fromkeys(["body", *(f"link{k}" for k in range(1, 5))], False) | {"fin": True}


def test_slides_and_fixed_joints_are_no_hinges_and_ball_joints_are():
    slide, ball = "joint: {kind: prismatic, axis: y}", "joint: {kind: spherical}"
    text = chain(2) + f"\n  end: {{on: link2, {plate('JOINT')}}}"
    assert all(starts(text.replace("JOINT", slide)).values())
    assert all(starts(text.replace("JOINT, ", "")).values())
    assert not any(starts(text.replace("JOINT", ball)).values())


def test_rods_and_what_is_along_them_do_not_have_it():
    rod = f"{{{ROD}, loads: {{drag: {{kind: plate_drag, normal: 1.2}}}}}}"
    text = f"name: fish\nbody: {{{plate()}}}\nlimbs:\n  tail: {rod}\n  fin: {{on: tail, {plate(HINGE)}}}"
    assert starts(text) == {"body": False, "tail": False, "fin": False}
    assert starts(f"name: eel\nbody: {rod}") == {"body": False}


@pytest.mark.parametrize(
    ("width", "has_it"), [("2 mm", True), ("15 mm", True), ("16 mm", False), ("59 mm", False), ("61 mm", True)]
)
def test_thick_bars_do_not_have_it(width: str, has_it: bool):
    """Up to half as thick as high, whichever side is higher: 15/30 and 30/61 have it, 16/30 and 30/59 do not."""
    assert starts(f"name: bar\nbody: {{{plate()}}}".replace("width: 2 mm", f"width: {width}")) == {"body": has_it}


def test_the_file_decides_where_it_says_so():
    assert not any(starts(chain(1, ", start_up: none")).values())
    assert not any(starts(chain(1, ", amplitude: 30 mm")).values())
    assert all(starts(chain(5, ", start_up: {}")).values())
    assert parse_robot(chain(1)) == parse_robot(chain(1, ", start_up: {}"))


def test_it_has_the_equations_of_the_one_that_is_written_or_of_none():
    """The states and numbers of `start_up: {}`, and no states as with `none`."""

    def states(text: str) -> list[tuple[int, ...]]:
        return [leaf.shape for leaf in jax.tree.leaves(build(parse_robot(text)).initial().z)]

    assert states(chain(1)) == states(chain(1, ", start_up: {}")) != []
    assert states(chain(3)) == states(chain(3, ", start_up: none")) == []
    drag = next(one.load for one in build(parse_robot(chain(1))).loads if isinstance(one.load, StartingPlateDrag))
    assert [*map(float, drag.extra), *map(float, drag.distance)] == [*StartUp().extra, *StartUp().distance]


@pytest.mark.parametrize("repeat", ["{mirror: y}", "{count: 3, around: x}"])
def test_copies_decide_alike(repeat: str):
    text = f"name: rower\nbody: {{kind: rigid, shape: point, mass: 1 kg}}\nlimbs:\n  arm: {{repeat: {repeat}, JOINT}}"
    more = f"\n  blade: {{on: arm, {plate(HINGE)}}}\n  tip: {{on: blade, {plate('END')}}}"
    ends = "offset: [0 m, 0 m, 0 m]", HINGE
    few, many = ((text + more).replace("JOINT", plate(HINGE)).replace("END", end) for end in ends)
    count = 2 if "mirror" in repeat else 3
    assert list(starts(few).values()) == 3 * count * [True]
    assert list(starts(many).values()) == 3 * count * [False]


def test_neither_a_sweep_nor_a_setting_nor_a_copy_on_disk_decides_anew():
    """A bar that is thin in its file keeps its start-up as it gets thick, and the other way round."""
    for width, other in (("2 mm", "20 mm"), ("20 mm", "2 mm")):
        robot = parse_robot(f"name: bar\nbody: {{{plate()}}}".replace("width: 2 mm", f"width: {width}"))
        has_it = robot.parts["body"].loads["drag"].start_up is not None
        assert has_it == (width == "2 mm")
        swept = with_values(robot, {"body.width": float(other.split()[0]) * 1e-3})
        for one in (swept, apply_settings(robot, [f"body.width={other}"]), parse_robot(dump_robot(swept))):
            assert (one.parts["body"].loads["drag"].start_up is not None) == has_it
        assert parse_robot(dump_robot(robot)) == robot


def test_a_word_that_is_none_of_it_is_told():
    with pytest.raises(InputError) as caught:
        parse_robot(chain(1, ", start_up: never"))
    assert caught.value.field == "body.loads.drag.start_up"
    assert caught.value.message == '"never" is no start-up: write none, {}, or its numbers.'


ARM = "kind: rigid, shape: cylinder, length: 0.2 m, radius: 5 mm, mass: 20 g"
LOADS = "loads: {w: {kind: added_mass, normal: 1}}"


def separated(joint: str, water: str = "current: [0.2 m/s, 0 m/s, 0 m/s]", more: str = "") -> list[bool | None]:
    """Of an arm on a joint and of one that is fixed to it."""
    text = f"""
name: arm
water: {{{water}}}
body: {{{ARM}, joint: {{{joint}}}, {LOADS}}}
limbs:
  outer: {{{ARM}, loads: {{w: {{kind: added_mass, normal: 1}}{more}}}}}
"""
    return [part.loads["w"].separated for part in parse_robot(text).parts.values()]


def test_the_flow_separates_behind_limbs_that_rest_in_a_stream():
    """Held by fixed joints and hinges that nothing drives; not of what swims, is driven, or sheds at a tail."""
    hinge = "kind: revolute, axis: y"
    motion = f"{hinge}, motion: {{kind: sine, amplitude: 20 deg, frequency: 1 Hz}}"
    assert separated("kind: fixed") == separated(hinge) == separated("kind: spherical") == [True, True]
    for joint in ("kind: free", "kind: prismatic, axis: y", motion):
        assert separated(joint) == [None, None]
    assert separated(hinge, water="") == [None, None]
    assert separated(hinge, more=", tail: {kind: trailing_edge}") == [None, None]


def test_the_file_says_whether_the_flow_separates():
    text = f"name: a\nwater: {{current: [0.2 m/s, 0 m/s, 0 m/s]}}\nbody: {{{ARM}, joint: {{kind: fixed}}, {LOADS}}}"
    for word, value in (("false", False), ("true", True)):
        robot = parse_robot(text.replace("normal: 1", f"normal: 1, separated: {word}"))
        assert robot.body.loads["w"].separated is value
    assert parse_robot(dump_robot(parse_robot(text))).body.loads["w"].separated is True
