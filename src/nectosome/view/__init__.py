"""What people look at: the report of all studies, and the page of a run."""

from .report import show_run, write_figures, write_report

__all__ = ["show_run", "write_figures", "write_report"]
