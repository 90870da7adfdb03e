"""Shapes of rigid parts, one class each: all that building, loads, pictures and exports need of one."""

from nectosome.core.described import class_for
from nectosome.description import Rigid
from nectosome.io.discovery import load_modules

from .contract import STANDING, RigidShape, Solid

__all__ = ["STANDING", "RigidShape", "Solid", "shape_of"]

load_modules(__name__)


def shape_of(part: Rigid) -> RigidShape:
    """The shape of a rigid part."""
    return class_for(part.own_shape, RigidShape)(part)
