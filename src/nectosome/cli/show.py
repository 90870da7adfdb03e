"""`nectosome show`: what a robot is made of, or what a run came to."""

from typing import Annotated

from cyclopts import Parameter

from nectosome.cli.options import Loads
from nectosome.cli.output import Page, write
from nectosome.cli.page import number
from nectosome.cli.summary import origin, summary
from nectosome.cli.tree import robot_tree
from nectosome.cli.trim import afloat, told
from nectosome.cli.weights import weigh
from nectosome.io import is_results, load_dataset
from nectosome.units import InputError


def show(
    what: Annotated[str, Parameter(help="Name of a robot that ships, a robot file, or a saved run (.nc).")],
    /,
    *,
    outputs: Page = Page(),
    loads: Loads = False,
) -> None:
    """Show the parts of a robot and how it lies in the water, or the summary of a saved run."""
    if is_results(what):
        _show_run(what, outputs, loads)
        return
    if loads:
        raise InputError("is of a saved run. Leave it out, or see nectosome simulate --loads.", field="--loads")
    outputs.check()

    from nectosome import model, robots

    description = robots.describe(what)
    built = model.build(description)
    parts = weigh(built, what)
    found = afloat(built)
    whole = told(description, built, found)
    if outputs.plot:
        from nectosome.view import show_still, standing

        each = [(part.name, number(part.mass), number(part.displaced), ", ".join(part.freedoms)) for part in parts]
        tables = [[("the robot", ""), *whole], [("part", "mass (kg)", "displaces (kg)", "free to move"), *each]]
        outputs.write_page(lambda path: show_still(standing(description, built), path, tables))
    write(robot_tree(description, parts, whole))


def _show_run(path: str, outputs: Page, loads: bool) -> None:
    outputs.check()

    from nectosome.view.saved import check_run

    dataset = load_dataset(path)
    check_run(dataset, path)
    if outputs.plot:
        from nectosome.view import show_run

        outputs.write_page(lambda page: show_run(dataset, page))
    arrays = {str(name): variable.values for name, variable in dataset.variables.items()}
    write(summary(arrays, dataset.attrs, loads), origin(dataset.attrs))
