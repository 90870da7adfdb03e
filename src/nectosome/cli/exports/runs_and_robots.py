"""Saved runs as tables, for rerun.io and Foxglove; robots as tables of masses, folders, URDF, FMUs, MuJoCo."""

from pathlib import Path
from typing import TYPE_CHECKING

from nectosome.cli.options import build_weighed
from nectosome.cli.output import check_target, report, tell, write
from nectosome.io import save_dataset, write_atomic
from nectosome.io.extras import package
from nectosome.io.summary import Summary
from nectosome.io.tables import AXES, Label, Number, Table
from nectosome.units import InputError

from .contract import ExportFormat, Order, write_all

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.description import RobotDescription


_SETTLED = 0.05  # change of a speed from one half of a window to the other, below which it is not told
_SAMPLES, _LONGEST = 100, 20.0  # of a run that is fitted: a second, and at most those of so long [s]


class CsvExport(ExportFormat):
    """A saved run as a table over time."""

    name, ending, instead = "csv", ".csv", "a table of a robot is --to masses"

    def write(self, source: "xr.Dataset", order: Order) -> None:
        """Write the table."""
        from nectosome.export.run_table import run_table

        text = run_table(source).to_csv(index=False, lineterminator="\n")
        write_atomic(order.target, text.encode())
        report(order.target)


class RerunExport(ExportFormat):
    """A saved run for the viewer of rerun.io."""

    name, ending, instead = "rrd", ".rrd", "rrd is for a run only"

    def write(self, source: "xr.Dataset", order: Order) -> None:
        """Write the run, if it can be drawn."""
        package("rerun", "rerun")  # before what takes a while

        from nectosome.export.rerun_file import write_rerun

        write_rerun(_drawable(source, order), order.target)
        report(order.target)


class McapExport(ExportFormat):
    """A saved run for Foxglove, as MCAP: frames and numbers in JSON."""

    name, ending, instead = "mcap", ".mcap", "mcap is for a run only"

    def write(self, source: "xr.Dataset", order: Order) -> None:
        """Write the run, if it can be drawn."""
        package("mcap", "mcap")  # before what takes a while

        from nectosome.export.mcap_file import write_mcap

        write_mcap(_drawable(source, order), order.target)
        report(order.target)


def _drawable(source: "xr.Dataset", order: Order) -> "xr.Dataset":
    """A saved run that can be drawn."""
    from nectosome.view.saved import check_drawable, saved_run

    run = saved_run(source, order.what)
    check_drawable(run, order.what)
    return run


class MassesExport(ExportFormat):
    """Mass properties and added mass of each part and of the whole, as a table."""

    name, ending, added = "masses", ".csv", "_masses"

    def write(self, source: "RobotDescription", order: Order) -> None:
        """Write the table."""
        from nectosome.export.rigid_bodies import mass_properties

        save_dataset(mass_properties(build_weighed(source, order.what)), order.target)
        report(order.target)


class FolderExport(ExportFormat):
    """The robot with its meshes as a folder that moves."""

    name, ending, added = "folder", "", "_folder"

    def write(self, source: "RobotDescription", order: Order) -> None:
        """Write the robot file and meshes."""
        from nectosome.export.robot_folder import robot_files

        found = robot_files(source, f"{Path(order.what).stem}.yaml", order.folder)
        for words in found.missing:
            tell(f"not in the folder, and not needed: {words}")
        write_all(order.target, found.contents, order.force)


class UrdfExport(ExportFormat):
    """Links with mass and inertia, joints and shapes, rods as chains of links."""

    name, ending = "urdf", ".urdf"

    def write(self, source: "RobotDescription", order: Order) -> None:
        """Write the URDF, and its meshes beside it."""
        from nectosome.export.robot_folder import mesh_files
        from nectosome.export.urdf import urdf_of

        urdf = urdf_of(build_weighed(source, order.what), source)
        meshes = mesh_files(source, order.folder)
        for words in (*urdf.left_out, *(f"mesh {words}" for words in meshes.missing)):
            tell(f"left out: {words}")
        write_all(order.target.parent, {order.target.name: urdf.text.encode(), **meshes.contents}, order.force)


class FmuExport(ExportFormat):
    """FMI 2 for co-simulation."""

    name, ending = "fmu", ".fmu"
    options = ("--command", "--measure", "--step", "--rtol", "--atol")

    def write(self, source: "RobotDescription", order: Order) -> None:
        """Write the FMU."""
        package("pythonfmu", "fmu")  # before what takes a while

        from nectosome.export.fmu import write_fmu

        first = next(iter(source.parts))
        usual = [f"{first}.{name}" for name in ("position.x", "position.y", "position.z", "heading")]
        tolerances = {"rtol": order.rtol, "atol": order.atol}
        write_fmu(source, order.commands, order.readings or usual, order.step, order.target, **tolerances)
        report(order.target)


class MujocoExport(ExportFormat):
    """A model of MuJoCo, its water fitted to the robot's own motion, and how far off it is."""

    name, ending = "mjcf", ".xml"
    options = ("--time",)

    def write(self, source: "RobotDescription", order: Order) -> None:
        """Write the model, and the controls of its actuators beside it."""
        package("mujoco", "mujoco")  # before what takes a while

        import numpy as np

        from nectosome.core import Status
        from nectosome.export.fluid_fit import fit_fluid
        from nectosome.export.mjcf import actuated, mjcf_of
        from nectosome.solve import simulate

        robot = build_weighed(source, order.what)
        model = mjcf_of(robot, source)
        controls = order.target.with_name(f"{order.target.stem}_controls.csv")
        if any(actuated(model.bodies)):
            check_target(controls, "FILE", ".csv", order.force)
        run = simulate(robot, order.seconds, samples=round(_SAMPLES * min(max(order.seconds, 1.0), _LONGEST)))
        if run.status != Status.SOLVED:
            raise InputError(f"its own motion has no solution: {Status(int(run.status)).reason}.", file=order.what)
        fit = fit_fluid(model, run)
        for words in model.left_out:
            tell(f"left out: {words}")
        if model.drives_left_out:
            what = "Only a part of the drives is" if fit.names else "No drive is"
            tell(f"{what} in the model. It lacks {'; '.join(model.drives_left_out)}.")
        tables, notes = list[Table](), list[str]()
        if model.carrying and (fit.names or not model.drives_left_out):
            both = ("ours", "here", fit.velocity), ("mujoco", "in MuJoCo", fit.velocity_there)
            rows = [
                (Label(key, where), *(Number(float(x), "m/s") for x in (*velocity, np.linalg.norm(velocity))))
                for key, where, velocity in both
            ]
            tables.append(Table("velocity", {"of": "mean velocity", **AXES, "size": "size"}, rows, computed=True))
            notes.append(f"means: over the second half of {order.seconds:.4g} s")
            for where, change in (("here", fit.change), ("in MuJoCo", fit.change_there)):
                if change > _SETTLED:
                    tell(f"the speed {where} still changes by {100 * change:.2g} % in that time: give a longer --time.")
        for share, of in ((fit.missed, "root mean square"), (fit.missed_along, "along the mean velocity")):
            if np.isfinite(share):
                notes.append(f"force of the water that MuJoCo misses, {of}: {100 * share:.3g} %")
        values = {"missed": Number(fit.missed), "missed_along": Number(fit.missed_along)}
        write(Summary(f"{source.name} as a model of MuJoCo", tables, notes=notes, values=values))
        if not np.isfinite(fit.velocity_there).all():
            tell("MuJoCo loses the motion with steps of 1 ms: make the timestep of the model smaller.")
        files = {order.target.name: model.text.encode()}
        if fit.names:
            files[controls.name] = fit.table.encode()
        write_all(order.target.parent, files, order.force)
