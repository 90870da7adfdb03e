"""What makes a rig follow a reference: references, controllers, loops and their margins."""

from .controller import Controller, Regulator

__all__ = ["Controller", "Regulator"]
