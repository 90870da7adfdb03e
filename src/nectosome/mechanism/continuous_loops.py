"""A robot whose servos have continuous loops, whatever their update rates."""

from dataclasses import replace

from .robot import Robot


def continuous_loops(robot: Robot) -> Robot:
    """The robot with loops that act at all times, as for equilibria and symmetries; its states are of one structure."""
    if robot.update_rates is None:
        return robot
    return replace(robot, powered=robot.powered.continuous()).described(robot.description)
