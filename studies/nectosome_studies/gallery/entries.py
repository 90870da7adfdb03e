"""The robots of the gallery, in the order of the page."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from nectosome.description import FixedJoint, Rigid, RobotDescription
from nectosome.robots import describe

_COARSE = tuple(
    setting
    for k in (1, 2, 3, 4)
    for setting in (
        f"limbs.filament{k}.strains={{torsion: 0, bending_y: 1, bending_z: 1}}",
        f"limbs.filament{k}.points=5",
    )
)


@dataclass(frozen=True)
class GalleryEntry:
    """A robot of the gallery: what it is, what drives it, and how long it swims.

    `name` is that of its rows, pictures and runs; `make` describes the robot; `command` is what a reader may type;
    `held` are the scorecard rows of other studies that hold it against published numbers, nothing fitted.
    """

    name: str
    title: str
    what: str
    drive: str
    command: str
    make: Callable[[], RobotDescription]
    periods: int  # of its drives, from rest to where it keeps its motion
    seen: tuple[float, float]  # where its picture is taken from: azimuth and height over the horizon [deg]
    held: tuple[str, ...] = ()


def _shipped(robot: str, *settings: str) -> Callable[[], RobotDescription]:
    return lambda: describe(robot, settings)


def _poseidrone() -> RobotDescription:
    """`poseidrone_jet`, whose body is a point, with a hull to be drawn that weighs and displaces nothing of its own."""
    robot = describe("poseidrone_jet")
    assert isinstance(robot.body, Rigid)
    length, volume = 0.16, (robot.body.mass or 0.0) / robot.water.density
    hull = Rigid(
        kind="rigid",
        shape="spheroid",
        length=length,
        radius=math.sqrt(volume / (4 / 3 * math.pi * 0.5 * length)),
        mass=0.0,
        volume=0.0,
        offset=(-0.5 * length, 0.0, 0.0),
        joint=FixedJoint(kind="fixed"),
    )
    return robot.model_copy(update={"limbs": {"hull": hull}})


ENTRIES = (
    GalleryEntry(
        "flagellum",
        "Flagellum",
        "A canister with one soft flagellum, free in all six directions. The flagellum sits off the axis, so that the "
        "canister rolls against it and goes along a screw.",
        "A motor turns the hook that carries the filament at 14.4 rad/s; the filament bends in the water and pushes.",
        "nectosome simulate flagella1 --time 10s --save flagellum.nc",
        _shipped("flagella1"),
        24,
        (-60.0, 20.0),
        tuple(f"flagellum/table2/row{k}/speed" for k in range(1, 6)),
    ),
    GalleryEntry(
        "flagella4",
        "Four flagella",
        "Four soft flagella around the end of one canister, free in all six directions. Every other one turns the "
        "other way, so that their torques cancel. Here the filaments bend as polynomials of order 1 and twist evenly.",
        "Four motors at 14.4 rad/s.",
        "nectosome simulate flagella4 --time 4s --save flagella4.nc",
        _shipped("flagella4", *_COARSE),
        10,
        (-60.0, 20.0),
    ),
    GalleryEntry(
        "beetle",
        "Beetle",
        "A hull with four rowing paddles, free in the horizontal plane, after Hu et al. 2024. Each paddle has three "
        "flexible joints that fold one way only, so that it is small on its way forward.",
        "A servo after the data sheet of the robot's own swings each paddle, all on one battery. The paper's fastest "
        "stroke asks for more speed than they have: they lag behind by up to 30 deg. Nothing holds the course: a "
        "disturbance grows by 15 % in each stroke.",
        "nectosome simulate beetle --time 5s --save beetle.nc",
        _shipped("beetle"),
        8,
        (-110.0, 50.0),
        tuple(f"paddle/shipped/fp{n}jp/75-1.1/speed" for n in (3, 1)),
    ),
    GalleryEntry(
        "eel",
        "Eel",
        "A soft rod from head to tail, free in the horizontal plane. The thrust is what its tail sheds into the wake.",
        "Muscles bend it by a wave that runs from head to tail.",
        "nectosome simulate eel --time 5s --save eel.nc",
        _shipped("eel"),
        12,
        (-110.0, 50.0),
    ),
    GalleryEntry(
        "catshark",
        "Catshark",
        "A small-spotted catshark as it swam for F. Berio and others, a rod that is free in the horizontal plane. Its "
        "outline is assumed; nothing is fitted.",
        "It is made to bend by the wave that its authors saw, 2.3 times a second; speed and recoil come out.",
        "nectosome simulate catshark --time 5s --save catshark.nc",
        _shipped("catshark"),
        16,
        (-110.0, 50.0),
        tuple(f"catshark/speed/{v}" for v in ("0.5", "0.75", "1", "1.25", "1.5", "1.75", "2", "3", "4", "5", "6")),
    ),
    GalleryEntry(
        "kern_eel",
        "Eel of Kern and Koumoutsakos",
        "The eel of 1 m that Kern and Koumoutsakos 2006 let swim in a computed flow, free in the plane, in a "
        "liquid 140 times as viscous as water. Here Lighthill's force takes the place of the flow; nothing is fitted.",
        "It is made to bend as they found it best for burst swimming, once a second.",
        "nectosome simulate kern_eel --time 10s --save kern_eel.nc",
        _shipped("kern_eel"),
        12,
        (-30.0, 50.0),
        ("eel/burst/speed", "eel/efficient/speed", "eel/burst/gain"),
    ),
    GalleryEntry(
        "fish",
        "Fish with a pneumatic tail",
        "A stiff head and a silicone tail, free in the horizontal plane. The tail has the length, height, gain, "
        "frequency, damping and hysteresis that Xiong et al. 2025 found of theirs; the head is made up. It begins at "
        "0.1 m/s: what a tail sheds gives no thrust at rest.",
        "A chamber on each side of the tail, pressed in turn with up to 0.6 bar. Most of the power goes into the "
        "silicone.",
        "nectosome simulate fish --time 20s --save fish.nc",
        _shipped("fish"),
        40,
        (-110.0, 50.0),
    ),
    GalleryEntry(
        "tuna",
        "Tuna",
        "Three rigid segments and a tail fin on an elastic hinge, free in the horizontal plane. All of it is made up "
        "but the motors. Its tail fin is a foil.",
        "Two servos after the data sheet of one that can be bought, with their lag and their heat, on one battery.",
        "nectosome simulate tuna --time 6s --save tuna.nc",
        _shipped("tuna"),
        40,
        (-110.0, 50.0),
    ),
    GalleryEntry(
        "manta",
        "Manta",
        "A hull with two soft fins and a tail fin, free in all six directions. The fins are swept back: the water "
        "bends them against the stroke, and bent they are pitched, so that their force leans forward on the way down "
        "and on the way up. The upright tail fin holds its course. All of it is made up but the motors and the rubber.",
        "Two servos after the data sheet of one that can be bought flap the fins, once a second, on one battery.",
        "nectosome simulate manta --time 10s --save manta.nc",
        _shipped("manta"),
        20,
        (-150.0, 40.0),
    ),
    GalleryEntry(
        "poseidrone",
        "PoseiDRONE",
        "A body on a line that a pulsed jet pushes, with mass, added mass and drag as Giorgio-Serchi et al. 2017 "
        "identified them. Its chamber is synthetic. It is described by these numbers alone: the hull in the picture is "
        "a spheroid of its volume.",
        "A crank pulls the chamber together through cables, 1.8 times a second.",
        "nectosome simulate poseidrone_jet --time 40s --save poseidrone.nc",
        _poseidrone,
        80,
        (-60.0, 20.0),
    ),
    GalleryEntry(
        "jelly",
        "Jellyfish",
        "A bell with four soft tentacles in tow, free in all six directions. It swims up; its mass sits low and keeps "
        "it upright.",
        "A crank contracts the bell within 40 % of a period: a pulsed jet. It fills again slowly.",
        "nectosome simulate jelly --time 10s --save jelly.nc",
        _shipped("jelly"),
        9,
        (-60.0, 15.0),
    ),
    GalleryEntry(
        "turtle",
        "Turtle",
        "A hull with four soft flippers, free in all six directions. Each flipper sits behind a hinge along its "
        "leading edge: the water pitches it, so that its force leans forward on the way down and on the way up. "
        "Nothing holds its course: left alone it goes straight, a disturbance grows by a quarter in each period.",
        "Servos flap the flippers up and down, the hind pair half a period after the front one.",
        "nectosome simulate turtle --time 10s --save turtle.nc",
        _shipped("turtle"),
        11,
        (-125.0, 30.0),
    ),
    GalleryEntry(
        "krill",
        "Krill",
        "Five pairs of legs under an abdomen, free in all six directions. The outer half of each leg hangs on a "
        "passive hinge, stands straight on the way back and folds on the way forward.",
        "A servo swings each leg; each pair beats 20 % of a period before the one ahead of it, a wave from the rear to "
        "the front.",
        "nectosome simulate krill --time 4s --save krill.nc",
        _shipped("krill"),
        10,
        (-82.0, 6.0),
    ),
    GalleryEntry(
        "octopus",
        "Octopus",
        "Eight soft arms behind a mantle, free in all six directions. It swims mantle first.",
        "Servos swing the roots of all arms together: they open slowly and close fast, within 30 % of a period. Drag "
        "grows with the square of the speed, so that closing pushes more than opening pulls.",
        "nectosome simulate octopus --time 6s --save octopus.nc",
        _shipped("octopus"),
        6,
        (-60.0, 20.0),
    ),
    GalleryEntry(
        "octopus_web",
        "Octopus with a web",
        "The octopus with a web between its arms, from their roots to their tips: a bell that opens slowly and closes "
        "fast. What it drives out as it closes is a jet.",
        "Servos swing the roots of all arms together; the web pulls them towards one another where it is stretched.",
        "nectosome simulate octopus_web --time 20s --save octopus_web.nc",
        _shipped("octopus_web"),
        25,
        (-60.0, 20.0),
    ),
    GalleryEntry(
        "medusa",
        "Jellyfish with a soft bell",
        "Eight soft flaps and the sheet between them are the bell: its volume, and with it the jet, follows from their "
        "shapes. Free in all six directions; it swims up.",
        "Servos swing the roots of the flaps together, by a sine.",
        "nectosome simulate medusa --time 10s --save medusa.nc",
        _shipped("medusa"),
        40,
        (-60.0, -15.0),
    ),
    GalleryEntry(
        "ray",
        "Ray with undulating fins",
        "Twelve stiff rays on each side of a hull, with a silicone sheet between them, free in all six directions. "
        "Waves along both fins push it; where they differ it turns.",
        "A servo swings each ray a little later than the one before it: a wave from front to rear.",
        "nectosome simulate ray --time 8s --save ray.nc",
        _shipped("ray"),
        14,
        (-125.0, 35.0),
    ),
    GalleryEntry(
        "soft_tail",
        "Fish with a soft caudal fin",
        "A stiff hull and a caudal fin of given thickness: thick edges, thin towards the middle of its tip. It bends, "
        "twists and curls. Free in the horizontal plane.",
        "A servo swings the peduncle, twice a second.",
        "nectosome simulate soft_tail --time 15s --save soft_tail.nc",
        _shipped("soft_tail"),
        40,
        (-110.0, 40.0),
    ),
)
