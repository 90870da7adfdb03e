"""Limbs that come several times, and all that sits on them, each on its own."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from nectosome.description.cranks import CrankLoad
from nectosome.description.orientation import Vector, applied, from_rpy, product, reflection, to_rpy, turn
from nectosome.description.parts import Limb, Rod, has_place
from nectosome.description.repeat import Repeat
from nectosome.io.schema.described import Described, inside, wrong
from nectosome.io.schema.quantity import Uncertain
from nectosome.io.schema.structure import changed, value_at
from nectosome.units import did_you_mean

BODY, WORLD = "body", "world"
MOST_LIMBS = 500
_STEP, _NONE = 1e-6, 1e-9  # rad: of a derivative, and a spread that is rounding


class Copy(NamedTuple):
    """One of the times that a limb comes."""

    name: str
    numbers: tuple[int, ...]  # of the copies that it sits on, and its own; none where it comes once
    mirrored: bool  # whether its frame is the image of that of the first copy
    phase: float  # by which its drives run ahead of those of the first copy [rad]


Copies = Mapping[str, tuple[Copy, ...]]
"""Copies of each limb, by the name that it was written under."""


def spread(body: Limb | None, limbs: Mapping[str, Limb]) -> tuple[dict[str, Limb], Copies]:
    """Return each limb on its own, and which are copies of which. Raises the error of a field.

    A limb sits on "body", on "world", on a limb before it, or on one copy of such a limb; what sits on a limb that
    comes several times is on each copy. Without a body, limbs sit on the world where they do not say on what.
    """
    alone: dict[str, Limb] = {}
    copies: dict[str, tuple[Copy, ...]] = {WORLD: (Copy(WORLD, (), False, 0.0),)}
    if body is not None:
        copies = {BODY: (Copy(BODY, (), False, 0.0),), **copies}
    for name, limb in limbs.items():
        if name in (BODY, WORLD):
            raise wrong(f"limbs.{name}", f"a limb cannot be called {name}. Choose another name.")
        if body is None and "on" not in limb.model_fields_set:
            limb = limb.model_copy(update={"on": WORLD})
        if limb.on not in copies and limb.on not in alone:
            later = " It comes later in the file: move it up." if limb.on in limbs and limb.on != name else ""
            known = dict.fromkeys((*copies, *alone))
            why = f'there is no part "{limb.on}" before this one.{later or did_you_mean(limb.on, known)}'
            raise wrong(f"limbs.{name}.on", why)
        parents = copies.get(limb.on, (Copy(limb.on, (), False, 0.0),))
        parent = body if limb.on == BODY else alone.get(parents[0].name)
        if not (isinstance(limb.at, str) if parent is None else has_place(parent, limb.at)):
            raise wrong(f"limbs.{name}.at", f"{limb.on} has no mark at {limb.at}. Write tip or root, or add the mark.")
        made = [pair for on in parents for pair in _on_one(name, limb, on)]
        for copy, _ in made:
            if copy.name in alone or (copy.name != name and copy.name in limbs):
                why = f"one of its copies is called {copy.name}, as another limb is. Choose another name."
                raise wrong(f"limbs.{name}", why)
        alone |= {copy.name: one for copy, one in made}
        copies[name] = tuple(copy for copy, _ in made)
        if len(alone) > MOST_LIMBS:
            raise wrong(f"limbs.{name}", f"with its copies the robot has more than {MOST_LIMBS} limbs.")
    _check_phases(limbs)
    return {name: _with_own_cranks(name, limb, alone, copies) for name, limb in alone.items()}, copies


def on_all_copies(body: Limb | None, limbs: Mapping[str, Limb], path: str) -> tuple[str, ...]:
    """Return the paths that a path of a limb as written stands for: one on each copy, or itself.

    Raises ValueError, with a sentence, where the copies do not share a quantity: one is turned or reflected, or runs
    ahead.
    """
    alone, copies = spread(body, limbs)
    group, _, rest = path.partition(".")
    name, _, rest = rest.partition(".")
    if group != "limbs" or name not in limbs or name in alone:
        return (path,)
    names = [copy.name for copy in copies[name]]
    try:
        value = value_at(alone[names[0]], rest)  # the first is as written
        if isinstance(value, str):  # the model of a servo: of all alike
            return tuple(f"limbs.{copy}.{rest}" for copy in names)
        other, _ = spread(body, {**limbs, name: changed(limbs[name], {rest: value + 1.0})})
    except (KeyError, TypeError):
        return (path,)  # no quantity
    if not all(math.isclose(value_at(other[copy], rest), value + 1.0, rel_tol=1e-9) for copy in names):
        raise ValueError(f"the copies of {name} differ in {rest}. Name one of them, as in limbs.{names[0]}.{rest}.")
    return tuple(f"limbs.{copy}.{rest}" for copy in names)


def _on_one(name: str, limb: Limb, on: Copy) -> Iterator[tuple[Copy, Limb]]:
    """Yield the copies of a limb on one copy of the part that it sits on."""
    repeat = limb.repeat
    bare = limb.model_copy(update={"repeat": None, "on": on.name})
    for k in range(1 if repeat is None else repeat.count or 2):
        one, mirrored, phase = bare, on.mirrored, on.phase
        numbers = on.numbers if repeat is None else (*on.numbers, k + 1)
        with inside(f"limbs.{name}"):
            if repeat is not None and k > 0:
                one, phase = _placed(one, repeat, k), phase + k * repeat.phase
                mirrored ^= repeat.mirror is not None
            if on.mirrored:
                one = _mirrored(one, "y")
        copy = Copy(name + "_".join(map(str, numbers)), numbers, mirrored, phase)
        yield copy, one.model_copy(update={name: _ahead(getattr(one, name), phase) for name in _driving(one)})


def _with_own_cranks(name: str, limb: Limb, alone: Mapping[str, Limb], copies: Copies) -> Limb:
    """Return a limb whose cranks are turned by the copies that go with it, of parts that come several times.

    Where such a part runs ahead itself, the load does not run ahead a second time.
    """
    loads = dict(limb.loads)
    for key, load in limb.loads.items():
        each = copies.get(load.turned_by or "", ()) if isinstance(load, CrankLoad) else ()
        if len(each) < 2:
            continue
        mine = next(copy for each in copies.values() for copy in each if copy.name == name)
        shared = min(len(mine.numbers), len(each[0].numbers))
        with_it = [copy for copy in each if copy.numbers[:shared] == mine.numbers[:shared]]
        if len(with_it) == 1:
            turning = with_it[0]
            joint = alone[turning.name].joint
            phase = turning.phase if _ahead(joint, 1.0) != joint else 0.0
            loads[key] = _ahead(load, -phase).model_copy(update={"turned_by": turning.name})
    return limb if loads == limb.loads else limb.model_copy(update={"loads": loads})


def _placed(limb: Limb, repeat: Repeat, k: int) -> Limb:
    """Return a limb k copies on from the first."""
    if repeat.mirror is not None:
        return _mirrored(limb, repeat.mirror)
    if repeat.along is not None:
        x, y, z = (at + k * step for at, step in zip(limb.offset, repeat.along, strict=True))
        return limb.model_copy(update={"offset": (x, y, z)})
    assert repeat.around is not None
    assert repeat.count is not None
    turned = turn(repeat.around, 2 * math.pi * k / repeat.count)
    rotation = _with_spread(lambda rpy: to_rpy(product(turned, from_rpy(rpy))), limb.rotation)
    return limb.model_copy(update={"offset": applied(turned, limb.offset), "rotation": rotation})


def _mirrored(limb: Limb, axis: str) -> Limb:
    """Return the image of a limb in the plane normal to an axis of what it sits on: x -> S x, R -> S R D.

    S reflects in that plane, D in the limb's own x-z plane, so that S R D is a rotation and the limb runs along x.
    """
    reflected = reflection(axis)

    def image(rpy: Sequence[float]) -> Vector:
        return to_rpy(product(reflected, product(from_rpy(rpy), reflection("y"))))

    place = {"offset": applied(reflected, limb.offset), "rotation": _with_spread(image, limb.rotation)}
    return limb.image().model_copy(update=place)


def _with_spread(turned: Callable[[Sequence[float]], Vector], rpy: Sequence[float]) -> Vector:
    """Return turned(rpy); where angles have a spread, with that of the result, to first order."""
    plain = [float(angle) for angle in rpy]
    found = turned(plain)
    spreads = [0.0] * 3
    for k, angle in enumerate(rpy):
        if isinstance(angle, Uncertain):
            ends = (turned([*plain[:k], plain[k] + side * _STEP, *plain[k + 1 :]]) for side in (1, -1))
            change = [math.remainder(a - b, 2 * math.pi) / (2 * _STEP) for a, b in zip(*ends, strict=True)]
            spreads = [math.hypot(one, x * angle.plus_minus) for one, x in zip(spreads, change, strict=True)]
    each = any(isinstance(angle, Uncertain) and angle.each for angle in rpy)
    x, y, z = (Uncertain(a, s, each) if s > _NONE else a for a, s in zip(found, spreads, strict=True))
    return (x, y, z)


def _driving(limb: Limb) -> tuple[str, ...]:
    """Return the names of what may have drives."""
    return ("joint", "loads", "motion", "drive") if isinstance(limb, Rod) else ("joint", "loads")


def _ahead(value: Any, phase: float) -> Any:
    """Return a joint, or loads, whose drives run ahead by an angle [rad]."""
    if isinstance(value, dict):
        return {key: _ahead(item, phase) for key, item in value.items()}
    if isinstance(value, tuple):
        return tuple(_ahead(item, phase) for item in value)
    if not isinstance(value, Described) or phase == 0:
        return value
    update = {key: _ahead(item, phase) for key, item in value if isinstance(item, Described | tuple)}
    if value.cycle_angle is not None:
        update[value.cycle_angle] = getattr(value, value.cycle_angle) + phase
    return value.model_copy(update=update)


def _check_phases(limbs: Mapping[str, Limb]) -> None:
    """Raise where copies are to run ahead, and nothing on the limb has a phase."""
    driven: set[str] = set()
    for name, limb in reversed([*limbs.items()]):
        if name in driven or any(_ahead(part, 1.0) != part for part in (getattr(limb, own) for own in _driving(limb))):
            driven |= {name, limb.on}
        elif limb.repeat is not None and limb.repeat.phase != 0:
            why = "no drive on this limb has a phase: they are still, or recorded. Leave it out."
            raise wrong(f"limbs.{name}.repeat.phase", why)
