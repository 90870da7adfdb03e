"""Saved runs as tables and for the viewer of rerun.io; robots as tables of masses, folders, URDF, FMUs."""

from pathlib import Path
from typing import TYPE_CHECKING

from nectosome.cli.options import build_weighed
from nectosome.cli.output import report, tell
from nectosome.io import save_dataset, write_atomic
from nectosome.io.extras import package

from .contract import ExportFormat, Order, write_all

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.description import RobotDescription


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
        from nectosome.view.saved import check_drawable, saved_run

        run = saved_run(source, order.what)
        check_drawable(run, order.what)
        write_rerun(run, order.target)
        report(order.target)


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
