"""Robots as environments of Gymnasium (extra `gym`): commands are actions, readings observations.

Importing this room registers `nectosome/Robot-v0`:

    import gymnasium
    import nectosome.gym

    env = gymnasium.make(
        "nectosome/Robot-v0",
        robot="eel",
        commands={"bias": "-8..8 mN m"},
        goals={"heading": "-30..30 deg"},
        observations=["mean.heading", "goal.heading"],
        reward="-abs(mean.heading - goal.heading)",
        step="0.5 s",
        episode="10 s",
    )
"""

from nectosome.io.extras import package

gymnasium = package("gymnasium", "gym")  # before the modules below, which are made of its classes

from .robot_env import RobotEnv, RobotVectorEnv  # noqa: E402

__all__ = ["RobotEnv", "RobotVectorEnv"]

gymnasium.register(
    "nectosome/Robot-v0",
    entry_point="nectosome.gym:RobotEnv",
    vector_entry_point="nectosome.gym:RobotVectorEnv",
)
