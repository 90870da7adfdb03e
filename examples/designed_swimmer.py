"""From a robot file to a designed swimmer: describe, simulate, swim steadily, design, and see all of it on one page."""

from pathlib import Path

import numpy as np

import nectosome as ns
from nectosome.units import show_quantity
from nectosome.view.film import write_still
from nectosome.view.page import write_page
from nectosome.view.scenes import Actor, side_by_side
from nectosome.view.scorecard import plain_table
from nectosome.view.series import last_turn, speeds_panel, steady_speed
from nectosome.view.style import CYCLE, Panel

MOTOR = "motor 1.098 N m, 27.13 rad/s"  # the paper's at the battery's 7.4 V: 7.4/6 of 0.89 N m and 22 rad/s at 6 V
LIMIT = 0.5  # N m: what the motor may give at any speed, as in the paper
PRINTED = 0.683  # m/s: row 1 of Table II of the paper
OUT = Path("out")
CAPTION = (
    "Simulated shapes during the last revolution of the motor, to scale and at the same motor angle. The printed "
    "optimum is row 1 of Table II of the paper, its speed computed here. The next is the best design within the "
    "torque-speed line of the paper's motor at the battery's 7.4 V. The last has the paper's limit of torque at any "
    "speed, which that motor cannot give. Forward is left. Drag to turn, scroll to come nearer."
)


def main() -> None:
    """All steps; in a function, since the processes of a search import this file."""
    OUT.mkdir(exist_ok=True)

    # describe: the soft flagellate propeller of Armanini et al., the first of the five designs that its paper prints
    robot = ns.describe("flagellum")

    # simulate: from rest until it keeps its speed; forward is -x
    swims = {"printed optimum": ns.simulate(robot, "5s").to_dataset()}
    run = swims["printed optimum"]
    write_still(run, OUT / "designed_swimmer.png", at=2.0, end=5.0, size=(960, 540), camera="three-quarter")
    ns.save_dataset(run, OUT / "designed_swimmer.nc")
    print(f"simulated from rest: {steady_speed(run):.3f} m/s after 5 s")

    # steady swimming: a root of the equations, in milliseconds; beside the speed that the paper prints
    data = ns.steady(robot).to_dataset()
    speed = -float(data["velocity"].sel(part="body", axis="x")[0])
    torque = float(data["reaction"].sel(prescribed="shaft.angle")[0])
    print(f"steady: {speed:.3f} m/s at {torque:.3f} N m; printed {PRINTED:.3f} m/s")

    # design: length, tip radius, hook angle, motor speed and stiffness within the paper's ranges and what its motor
    # gives at each speed on the battery's 7.4 V; and with the paper's limit of torque at any speed
    found = {
        "for the motor at 7.4 V": ns.design(robot, keep=[MOTOR], starts=6),
        f"for {LIMIT} N m at any speed": ns.design(robot, keep=[f"torque <= {LIMIT} N m"], starts=12),
    }
    rows = []
    for name, design in found.items():
        best, task = design.best, design.task
        print(f"best design {name}: {best.outputs['speed']:.3f} m/s at {best.outputs['drive_rate']:.1f} rad/s")
        values = [
            show_quantity(float(value), variable.dimension)
            for variable, value in zip(task.variables, task.box.values(best.u), strict=True)
        ]
        for variable, value in zip(task.variables, values, strict=True):
            print(f"  {variable.name} = {value}")
        rows.append((name, *values, f"{best.outputs['torque']:.3f} N m", f"{best.outputs['speed']:.3f} m/s"))
        swims[name] = ns.simulate(design.robot, "5s").to_dataset()

    # see: the page opens with all three swimmers moving
    actors = [
        Actor(run, np.linspace(*last_turn(run), 31), f"{name}: {steady_speed(run):.3f} m/s", colour)
        for (name, run), colour in zip(swims.items(), CYCLE, strict=False)
    ]
    heads = ("design", *(variable.name for variable in task.variables), "torque", "speed")
    page = OUT / "designed_swimmer.html"
    write_page(
        page,
        "nectosome: a swimmer, designed",
        [
            Panel("Printed and computed", CAPTION, side_by_side(actors, 1.5)),
            plain_table(heads, rows),
            speeds_panel(swims),
        ],
    )
    print(f"written: {OUT / 'designed_swimmer.png'}, {OUT / 'designed_swimmer.nc'}, {page}")


if __name__ == "__main__":
    main()
