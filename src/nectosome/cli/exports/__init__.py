"""Formats of `nectosome export`, found by being written."""

from nectosome.io.discovery import classes_below, load_modules

from .contract import ExportFormat, Order

__all__ = ["FORMATS", "ExportFormat", "Order"]

load_modules(__name__)
FORMATS = {cls.name: cls() for cls in classes_below(ExportFormat)}
