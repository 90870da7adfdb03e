"""From a robot file to a designed swimmer: describe, simulate, swim steadily, design, and see all of it on one page."""

from pathlib import Path

import nectosome as ns
from nectosome.papers.flagellum import figures, figures_landscape, figures_search, optimum, study
from nectosome.papers.study import printed
from nectosome.units import show_quantity
from nectosome.view.film import write_still
from nectosome.view.page import write_page
from nectosome.view.style import Panel

LIMIT = 0.5  # N m: what the motor may give, as in the paper
OUT = Path("out")
CAPTION = (
    "Simulated shapes during the last revolution of the motor, to scale and at the same motor angle. The printed "
    "optimum is row 1 of Table II of the paper, its speed computed here. Forward is left. Drag to turn, scroll to come "
    "nearer."
)


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

    # design: length, tip radius, hook angle, motor speed and stiffness within the paper's ranges
    found = ns.design(robot, keep=[f"torque <= {LIMIT} N m"], starts=12)
    print(f"best design found: {found.best.outputs['speed']:.3f} m/s at {found.best.outputs['torque']:.3f} N m")
    for variable, value in zip(found.task.variables, found.task.box.values(found.best.u), strict=True):
        print(f"  {variable.name} = {show_quantity(float(value), variable.dimension)}")
    swims["optimum"] = ns.simulate(found.robot, "5s").to_dataset()

    # see: the page opens with both swimmers moving
    labels = {
        "row1": f"printed optimum: {study.steady_speed(swims['row1']):.3f} m/s",
        "optimum": f"our optimum: {study.steady_speed(swims['optimum']):.3f} m/s",
    }
    designs = {"printed optimum": found.task.box.design(robot), "our optimum": found.best.u}
    maps = optimum.maps(found.task, designs, 13, LIMIT)
    page = OUT / "designed_swimmer.html"
    write_page(
        page,
        "nectosome: a swimmer, designed",
        [
            Panel("Printed and found", CAPTION, figures.designs_scene(swims, labels)),
            figures_search.best_panel(optimum.best_designs(found.task, [found.search], table2)),
            figures_landscape.map_panel(maps),
            figures_landscape.torque_panel(maps),
        ],
    )
    print(f"written: {OUT / 'designed_swimmer.png'}, {OUT / 'designed_swimmer.nc'}, {page}")


if __name__ == "__main__":
    main()
