"""From a robot file to a designed swimmer: describe, simulate, swim steadily, design, and see all of it on one page."""

from pathlib import Path

import nectosome as ns
from nectosome.designs import MotorLine
from nectosome.papers.flagellum import figures, figures_landscape, figures_search, optimum, prototype, study
from nectosome.papers.study import printed
from nectosome.units import show_quantity
from nectosome.view.film import write_still
from nectosome.view.page import write_page
from nectosome.view.style import Panel

MOTOR = "motor 1.098 N m, 27.13 rad/s"  # the paper's at the battery's 7.4 V: 7.4/6 of 0.89 N m and 22 rad/s at 6 V
LIMIT = 0.5  # N m: what the motor may give at any speed, as in the paper
OUT = Path("out")
CAPTION = (
    "Simulated shapes during the last revolution of the motor, to scale and at the same motor angle. The printed "
    "optimum is row 1 of Table II of the paper, its speed computed here. The next is the best design within the "
    f"torque-speed line of the paper's motor at the battery's 7.4 V. {figures_search.ANY_SPEED} Forward is left. Drag "
    "to turn, scroll to come nearer."
)


def torque_at(line: MotorLine, outputs: dict[str, float]) -> float:
    """Torque [N m] that the motor has at the motor speed of a design; 0 beyond its speed without load."""
    return max(0.0, line.stall * (1 - outputs["drive_rate"] / line.no_load))


def main() -> None:
    """All steps; in a function, since the processes of a search import this file."""
    OUT.mkdir(exist_ok=True)

    # describe: the soft flagellate propeller of Armanini et al., the first of the five designs that its paper prints
    robot = ns.describe("flagellum")

    # simulate: from rest until it keeps its speed; forward is -x
    swims = {"row1": ns.simulate(robot, "5s").to_dataset()}
    write_still(swims["row1"], OUT / "designed_swimmer.png", at=2.0, end=5.0, size=(960, 540), camera="three-quarter")
    ns.save_dataset(swims["row1"], OUT / "designed_swimmer.nc")
    print(f"simulated from rest: {study.steady_speed(swims['row1']):.3f} m/s after 5 s")

    # steady swimming: a root of the equations, in milliseconds; beside the speeds that the paper prints
    book = {k: printed("flagellum")[f"flagellum/table2/row{k}/speed"] for k in range(1, 6)}
    table2 = []
    for k, entry in book.items():
        design = study.printed_design(robot, entry["design"])
        data = ns.steady(design).to_dataset()
        speed = -float(data["velocity"].sel(part="body", axis="x")[0])
        torque = float(data["reaction"].sel(prescribed="shaft.angle")[0])
        table2.append((design, speed, torque))
        print(f"Table II, row {k}: {speed:.3f} m/s at {torque:.3f} N m; printed {entry['printed']:.3f} m/s")

    # design: length, tip radius, hook angle, motor speed and stiffness within the paper's ranges and what its motor
    # gives at each speed on the battery's 7.4 V
    built = ns.design(robot, keep=[MOTOR], starts=6)
    best = built.best.outputs
    print(f"best design for the motor at 7.4 V: {best['speed']:.3f} m/s at {best['drive_rate']:.1f} rad/s", end="")
    print(f"; the printed optimum on it: {prototype.on_motor_line(robot, motor=optimum.ON_BATTERY)[1].speed:.3f} m/s")
    for variable, value in zip(built.task.variables, built.task.box.values(built.best.u), strict=True):
        print(f"  {variable.name} = {show_quantity(float(value), variable.dimension)}")

    # and with the paper's limit of torque at any speed
    found = ns.design(robot, keep=[f"torque <= {LIMIT} N m"], starts=12)
    most = found.best.outputs
    print(f"with {LIMIT} N m at any speed: {most['speed']:.3f} m/s, at {most['drive_rate']:.1f} rad/s", end="")
    print(f", where the motor has {torque_at(optimum.MOTOR, most):.2f} N m at 6 V", end="")
    print(f" and {torque_at(optimum.ON_BATTERY, most):.2f} N m at 7.4 V")
    swims |= {"built": ns.simulate(built.robot, "5s").to_dataset(), "most": ns.simulate(found.robot, "5s").to_dataset()}

    # see: the page opens with all three swimmers moving
    labels = {
        "row1": f"printed optimum: {study.steady_speed(swims['row1']):.3f} m/s",
        "built": f"for the motor at 7.4 V: {study.steady_speed(swims['built']):.3f} m/s",
        "most": f"for {LIMIT} N m at any speed: {study.steady_speed(swims['most']):.3f} m/s",
    }
    box = built.task.box
    designs = {
        "printed optimum": box.design(robot),
        "motor at 7.4 V": built.best.u,
        f"{LIMIT} N m at any speed": found.best.u,
    }
    maps = optimum.maps(found.task, designs, 13, LIMIT)
    page = OUT / "designed_swimmer.html"
    write_page(
        page,
        "nectosome: a swimmer, designed",
        [
            Panel("Printed and found", CAPTION, figures.designs_scene(swims, labels)),
            figures_search.best_panel(optimum.best_designs(found.task, [found.search], built.best, table2)),
            figures_landscape.map_panel(maps),
            figures_landscape.torque_panel(maps),
        ],
    )
    print(f"written: {OUT / 'designed_swimmer.png'}, {OUT / 'designed_swimmer.nc'}, {page}")


if __name__ == "__main__":
    main()
