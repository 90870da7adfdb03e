"""The flagellum swims from rest to its steady speed, with the numbers of another printed design."""

from pathlib import Path

import nectosome as ns

# describe: a robot that ships, by name; a robot file would be named by its path
robot = ns.describe("flagellum")

# change: the fifth design of Table II; every quantity has a path or an alias, and is given with its unit
robot = ns.apply_settings(robot, ["L=700mm", "tip_radius=4.55mm", "alpha=39.15deg", "omega=14.5rad/s", "E=9.6MPa"])

# run: 2.5 s from rest
run = ns.simulate(robot, 2.5).to_dataset()

# print: forward is -x
speed = -float(run["velocity"].sel(part="body", axis="x")[-1])
torque = float(run["reaction"].sel(prescribed="shaft.angle")[-1])
print(f"steady speed   {speed:.4f} m/s (printed: 0.668 m/s)")
print(f"motor torque   {torque:.3f} N m")
print(f"power balance  off by {float(run['power_balance'].max()):.0e} at worst")

# save: numbers for later, and a page to look at
Path("out").mkdir(exist_ok=True)
ns.save_dataset(run, "out/swim.nc")
ns.show_run(run, "out/swim.html")
