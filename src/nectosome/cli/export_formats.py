"""What `nectosome export` writes of a robot or a saved run, format by format."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from nectosome import robots
from nectosome.cli.output import check_target, report, tell, write
from nectosome.cli.starter_files import write_files
from nectosome.cli.weights import build_weighed
from nectosome.io import is_results, load_dataset, save_dataset, write_atomic
from nectosome.io.extras import package
from nectosome.io.file_system import make_folder
from nectosome.io.summary import Summary
from nectosome.io.tables import AXES, Label, Number, Table
from nectosome.units import InputError

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.description import RobotDescription

_SETTLED = 0.05  # change of a speed from one half of a window to the other, below which it is not told
_SAMPLES, _LONGEST = 100, 20.0  # of a run that is fitted: a second, and at most those of so long [s]


class Order(NamedTuple):
    """What to export, where to, and the options of some formats."""

    what: str
    settings: list[str]
    target: Path
    force: bool
    seconds: float
    commands: list[str]
    readings: list[str]
    step: float

    @property
    def folder(self) -> Path:
        """Where files lie that the robot names."""
        return Path(self.what).parent

    def description(self) -> "RobotDescription":
        """The robot of a name or a file, or the one that a saved run is of. Raises InputError."""
        if not is_results(self.what):
            return robots.describe(self.what, self.settings)

        from nectosome.description import apply_settings, parse_robot

        text = load_dataset(self.what).attrs.get("robot")
        if text is None:
            raise InputError("knows no robot. Give a robot file, or a saved run.", file=self.what)
        robot = parse_robot(str(text), self.what)
        return apply_settings(robot, self.settings) if self.settings else robot

    def run(self, instead: str) -> "xr.Dataset":
        """The saved run, with no settings. Raises InputError, with what to do with a robot instead."""
        if not is_results(self.what):
            why = "is no saved run. Save one: nectosome simulate ROBOT --save run.nc"
            raise InputError(f"{why}; {instead}.", field=self.what)
        if self.settings:
            raise InputError("is for a robot: a run is what it was. Leave it out.", field="--set")
        return load_dataset(self.what)


def _csv(dataset: "xr.Dataset", order: Order) -> None:
    from nectosome.export.run_table import run_table

    text = run_table(dataset).to_csv(index=False, lineterminator="\n")
    write_atomic(order.target, text.encode())
    report(order.target)


def _rrd(dataset: "xr.Dataset", order: Order) -> None:
    package("rerun", "rerun")  # before what takes a while

    from nectosome.export.rerun_file import write_rerun
    from nectosome.view.saved import check_drawable, saved_run

    run = saved_run(dataset, order.what)
    check_drawable(run, order.what)
    write_rerun(run, order.target)
    report(order.target)


def _masses(description: "RobotDescription", order: Order) -> None:
    from nectosome.export.masses import mass_properties

    save_dataset(mass_properties(build_weighed(description, order.what)), order.target)
    report(order.target)


def _folder(description: "RobotDescription", order: Order) -> None:
    from nectosome.export.folder import robot_files

    found = robot_files(description, f"{Path(order.what).stem}.yaml", order.folder)
    for words in found.missing:
        tell(f"not in the folder, and not needed: {words}")
    _write_all(order.target, found.contents, order.force)


def _urdf(description: "RobotDescription", order: Order) -> None:
    from nectosome.export.folder import mesh_files
    from nectosome.export.urdf import urdf_of

    found = urdf_of(build_weighed(description, order.what), description)
    meshes = mesh_files(description, order.folder)
    for words in (*found.left_out, *(f"mesh {words}" for words in meshes.missing)):
        tell(f"left out: {words}")
    _write_all(order.target.parent, {order.target.name: found.text.encode(), **meshes.contents}, order.force)


def _mjcf(description: "RobotDescription", order: Order) -> None:
    package("mujoco", "mujoco")  # before what takes a while

    import numpy as np

    from nectosome.core import Status
    from nectosome.export.fluid_fit import fit_fluid
    from nectosome.export.mjcf import actuated, mjcf_of
    from nectosome.solve import simulate

    robot = build_weighed(description, order.what)
    model = mjcf_of(robot, description)
    controls = order.target.with_name(f"{order.target.stem}_controls.csv")
    if any(actuated(model.bodies)):
        check_target(controls, "FILE", ".csv", order.force)
    run = simulate(robot, order.seconds, samples=round(_SAMPLES * min(max(order.seconds, 1.0), _LONGEST)))
    if run.status != Status.SOLVED:
        raise InputError(f"its own motion has no solution: {Status(int(run.status)).reason}.", file=order.what)
    found = fit_fluid(model, run)
    for words in model.left_out:
        tell(f"left out: {words}")
    if model.drives_left_out:
        what = "Only a part of the drives is" if found.names else "No drive is"
        tell(f"{what} in the model. It lacks {'; '.join(model.drives_left_out)}.")
    tables, notes = list[Table](), list[str]()
    if model.carrying and (found.names or not model.drives_left_out):
        both = ("ours", "here", found.velocity), ("mujoco", "in MuJoCo", found.velocity_there)
        rows = [
            (Label(key, where), *(Number(float(x), "m/s") for x in (*velocity, np.linalg.norm(velocity))))
            for key, where, velocity in both
        ]
        tables.append(Table("velocity", {"of": "mean velocity", **AXES, "size": "size"}, rows, computed=True))
        notes.append(f"means: over the second half of {order.seconds:.4g} s")
        for where, change in (("here", found.change), ("in MuJoCo", found.change_there)):
            if change > _SETTLED:
                tell(f"the speed {where} still changes by {100 * change:.2g} % in that time: give a longer --time.")
    for share, of in ((found.missed, "root mean square"), (found.missed_along, "along the mean velocity")):
        if np.isfinite(share):
            notes.append(f"force of the water that MuJoCo misses, {of}: {100 * share:.3g} %")
    values = {"missed": Number(found.missed), "missed_along": Number(found.missed_along)}
    write(Summary(f"{description.name} as a model of MuJoCo", tables, notes=notes, values=values))
    if not np.isfinite(found.velocity_there).all():
        tell("MuJoCo loses the motion with steps of 1 ms: make the timestep of the model smaller.")
    files = {order.target.name: model.text.encode()}
    if found.names:
        files[controls.name] = found.table.encode()
    _write_all(order.target.parent, files, order.force)


def _fmu(description: "RobotDescription", order: Order) -> None:
    package("pythonfmu", "fmu")  # before what takes a while

    from nectosome.export.fmu import write_fmu

    first = next(iter(description.parts))
    usual = [f"{first}.{name}" for name in ("position.x", "position.y", "position.z", "heading")]
    write_fmu(description, order.commands, order.readings or usual, order.step, order.target)
    report(order.target)


def _write_all(folder: Path, contents: dict[str, bytes], force: bool) -> None:
    """Write files below a folder, which is made if it is not there."""
    for inner in contents:
        make_folder((folder / inner).parent)
    write_files(folder, contents, (), force)
    report(*(folder / inner for inner in contents))


WRITERS: dict[str, Callable[[Any, Order], None]] = {  # of a saved run for csv and rrd, else of a robot
    "csv": _csv,
    "rrd": _rrd,
    "masses": _masses,
    "folder": _folder,
    "urdf": _urdf,
    "mjcf": _mjcf,
    "fmu": _fmu,
}
