"""Rowing paddles of any number of segments, made from the description of the one with three."""

from nectosome.description import FixedJoint, Rigid, RobotDescription, load_robot
from nectosome.units import InputError

from .shipped import file_of


def paddle(segments: int) -> RobotDescription:
    """Paddle cut into so many equal segments, each on a flexible passive joint; 0: a rigid plate of the same size.

    Segments share length and mass of the whole paddle; all joints have the same flexure. Raises InputError for a count
    outside 0..5.
    """
    if not 0 <= segments <= 5:
        raise InputError(f"paddle: {segments} segments asked for; 1 to 5, or 0 for a rigid plate.")
    three = load_robot(file_of("paddle"))
    parts = [part for name, part in three.limbs.items() if name != "arm"]
    first, count = parts[0], max(segments, 1)
    assert isinstance(first, Rigid)
    assert first.length is not None
    assert first.mass is not None
    length, share = first.length * len(parts) / count, len(parts) / count
    joint = first.joint if segments else FixedJoint(kind="fixed")
    same = {"length": length, "mass": first.mass * share, "centre_of_mass": (0.5 * length, 0.0, 0.0), "joint": joint}
    names = [f"segment{k + 1}" for k in range(count)]
    limbs = {"arm": three.limbs["arm"]}
    for on, name in zip(["arm", *names], names, strict=False):
        limbs[name] = first.model_copy(update={**same, "on": on})
    aliases = {**three.aliases, "Cn": tuple(f"limbs.{name}.loads.drag.normal" for name in names)}
    with_joints = "with three flexible passive joints"
    about = three.about.replace(with_joints, f"cut into {segments} segments" if segments else "in one rigid piece")
    return three.model_copy(update={"name": f"paddle{segments}", "about": about, "limbs": limbs, "aliases": aliases})
