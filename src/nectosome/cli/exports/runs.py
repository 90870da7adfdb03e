"""Saved runs: a table, and a file for the viewer of rerun.io."""

from typing import TYPE_CHECKING

from nectosome.cli.output import report
from nectosome.io import write_atomic
from nectosome.io.extras import package

from .contract import ExportFormat, Order

if TYPE_CHECKING:
    import xarray as xr


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
