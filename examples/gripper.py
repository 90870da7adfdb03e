"""Two soft fingers close round a bar and hold it while it is slowly pulled out: how hard they hold."""

from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np

import nectosome as ns

# describe: a robot file of your own; the fingers are curled by nature
gripper = ns.describe(str(Path(__file__).with_name("gripper.yaml")))

rows = ["friction,bar (mm),pull (N)"]
for friction in (0.1, 0.3, 0.5):
    # change: the friction of both fingers, by its alias
    described = ns.apply_settings(gripper, [f"friction={friction}"])
    robot = ns.build(described)

    # run: the fingers start straight, snap round the bar, and are pulled open again
    x = robot.initial()
    q = np.zeros(x.q.shape)
    for finger in ("left", "right"):
        limb = described.limbs[finger]
        q[robot.coordinate_names.index(f"{finger}.bending_z.0")] = -limb.rest.bending_z[0] * limb.length
    run = ns.simulate(robot, 8.0, samples=161, initial=eqx.tree_at(lambda x: x.q, x, jnp.asarray(q)))
    data = run.to_dataset()

    # print: the largest pull once the fingers are closed
    pull = data["reaction"].sel(prescribed="bar.position").values
    way = 10.0 * data["time"].values  # mm
    closed = data["time"].values > 0.5
    k = int(np.argmax(np.where(closed, pull, 0.0)))
    print(f"friction {friction}: holds {pull[k]:.3f} N, with the bar {way[k]:.0f} mm further out")
    rows += [f"{friction},{a:.2f},{b:.5f}" for a, b in zip(way, pull, strict=True)]

# save: the pull along the way, and a page to look at
Path("out").mkdir(exist_ok=True)
Path("out/gripper.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
ns.show_run(data, "out/gripper.html")
