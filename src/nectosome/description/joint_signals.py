"""Motions and drives of joints with several coordinates: a signal for each; what is left out stays at zero."""

from nectosome.description.base import Described
from nectosome.description.signals import AngleSignal, ForceSignal, LengthSignal, TorqueSignal


class PlanarMotion(Described):
    """Where a planar joint is made to go: `x`, `y` in the plane [m] and `angle` about its axis [rad]."""

    x: LengthSignal | None = None
    y: LengthSignal | None = None
    angle: AngleSignal | None = None


class PlanarDrive(Described):
    """Forces along the moving part's own `x` and `y` [N] and the torque about its axis, `angle` [N m]."""

    x: ForceSignal | None = None
    y: ForceSignal | None = None
    angle: TorqueSignal | None = None


class SphericalMotion(Described):
    """How a spherical joint is made to turn: `roll`, `pitch`, `yaw` [rad]."""

    roll: AngleSignal | None = None
    pitch: AngleSignal | None = None
    yaw: AngleSignal | None = None


class SphericalDrive(Described):
    """Torques about the moving part's own `x`, `y`, `z` [N m]."""

    x: TorqueSignal | None = None
    y: TorqueSignal | None = None
    z: TorqueSignal | None = None


class FreeMotion(Described):
    """Where a free part is made to go: `x`, `y`, `z` [m] and `roll`, `pitch`, `yaw` [rad]: a moving base."""

    x: LengthSignal | None = None
    y: LengthSignal | None = None
    z: LengthSignal | None = None
    roll: AngleSignal | None = None
    pitch: AngleSignal | None = None
    yaw: AngleSignal | None = None


class FreeDrive(Described):
    """Torques about and forces along the moving part's own axes [N m, N]: thrusters."""

    torque_x: TorqueSignal | None = None
    torque_y: TorqueSignal | None = None
    torque_z: TorqueSignal | None = None
    force_x: ForceSignal | None = None
    force_y: ForceSignal | None = None
    force_z: ForceSignal | None = None
