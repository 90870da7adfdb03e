"""`nectosome show`: parts of a robot and its weight in water, or the summary of what was saved."""

from dataclasses import replace
from typing import TYPE_CHECKING

from nectosome import view
from nectosome.cli.control_side_by_side import comparison_summary
from nectosome.cli.options import Loads, RobotOrRun, command, robot_named, tell_far_out
from nectosome.cli.output import Page, write
from nectosome.io import is_results, load_dataset
from nectosome.units import InputError

if TYPE_CHECKING:
    from nectosome.mechanism import Robot
    from nectosome.solve import Floating


@command
def show(what: RobotOrRun, /, *, outputs: Page = Page(), loads: Loads = False) -> None:
    """Show the parts of a robot and how it lies in the water, or the summary of what was saved.

    That is a run, controllers compared, or what `measure` and `track` saved.

    A free robot that floats at the surface is drawn as it floats.
    """
    outputs.check()
    if is_results(what):
        _show_run(what, outputs, loads)
        return
    if loads:
        raise InputError("is for a saved run. Leave it out, or see nectosome simulate --loads.", field="--loads")

    description = robot_named(what)

    from nectosome.mechanism import weigh
    from nectosome.model import build
    from nectosome.model.fitting_loads import before_run
    from nectosome.solve.floating import placed
    from nectosome.solve.summaries.float_tables import float_words
    from nectosome.solve.summaries.robot_facts import assumed_table, part_table, robot_facts
    from nectosome.solve.weights import hydrostatics, hydrostatics_rows

    built = build(description)
    parts = weigh(built, what)
    tell_far_out(description, what)
    found = hydrostatics(built)
    whole = hydrostatics_rows(description, built, found)
    drawn = built
    if (floats := _floating(built)) is not None:
        whole += float_words(floats)
        drawn = placed(built, floats)
    assumed = assumed_table(built, description)
    facts, (moved, meaning) = robot_facts(description, found, parts, whole, assumed), before_run(description)
    write(replace(facts, facts=[*facts.facts, *moved], after=[*facts.after, *moved, *meaning]))
    if outputs.given:
        tables = [[("the robot", ""), *whole], part_table(parts).texts()]
        tables += [table.texts() for table in (assumed, *moved) if table.rows]
        outputs.write(view.standing(description, drawn), lambda data, path: view.show_still(data, path, tables))


def _floating(robot: "Robot") -> "Floating | None":
    """How a robot that nothing else holds lies in the water: at the surface, or neutral in it; None of any other."""
    from nectosome.solve.floating import floating, is_adrift, is_neutral

    if not is_adrift(robot):
        return None
    found = floating(robot)
    return found if bool(found.afloat) or is_neutral(found) else None


def _show_run(path: str, outputs: Page, loads: bool) -> None:
    from nectosome.solve.summaries.run_summary import origin, run_summary
    from nectosome.view.saved import check_comparison, compares_controllers, saved_run
    from nectosome.view.saved_recordings import is_recording, saved_recording

    found = load_dataset(path)
    compares, recorded = compares_controllers(found), is_recording(found)
    if loads and (compares or recorded):
        other = "a comparison of controllers" if compares else "a recording"
        raise InputError(f"is for a saved run, and this is {other}.", field="--loads")
    if compares:
        check_comparison(found, path)
        write(comparison_summary(found))
        outputs.write(found, view.show_side_by_side)
        return
    if recorded:
        saved = saved_recording(found, path)
        write(saved.summary)
        outputs.write(found, saved.page)
        return
    dataset = saved_run(found, path)
    arrays = {str(name): variable.values for name, variable in dataset.variables.items()}
    write(replace(run_summary(arrays, dataset.attrs, loads), after=[origin(dataset.attrs)]))
    outputs.write(dataset, lambda data, path: view.show_run(data, path))
