"""Four soft flagella push one canister that is free to move and turn."""

from pathlib import Path

import numpy as np

import nectosome as ns

# describe: made from the flagellum; what was assumed is in its `about`
robot = ns.flagella(4)

# change: all four filaments at once, by their common alias
robot = ns.apply_settings(robot, ["E=7.4MPa"])

# run: 1 s from rest
run = ns.simulate(robot, 1.0).to_dataset()

# print: forward is -x
speed = -run["velocity"].sel(part="body", axis="x").values
axis = run["rotation"].isel(station=0).values[-1, :, 0]
torques = run["reaction"].values[-1]
print(f"speed after 1 s     {speed[-1]:.3f} m/s (simulated; nothing printed to compare with)")
print(f"heading turned by   {np.degrees(np.arccos(min(1.0, axis[0]))):.2f} deg")
print(f"motor torques       {', '.join(f'{t:+.3f}' for t in torques)} N m")

# save: numbers for later, and a page to look at
Path("out").mkdir(exist_ok=True)
ns.save_dataset(run, "out/four_flagella.nc")
ns.show_run(run, "out/four_flagella.html")
