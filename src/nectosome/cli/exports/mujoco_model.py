"""Models of MuJoCo, and how far off their water is."""

from typing import TYPE_CHECKING

from nectosome.cli.options import build_weighed
from nectosome.cli.output import check_target, tell, write
from nectosome.io.extras import package
from nectosome.io.summary import Summary
from nectosome.io.tables import AXES, Label, Number, Table
from nectosome.units import InputError

from .contract import ExportFormat, Order, write_all

if TYPE_CHECKING:
    from nectosome.description import RobotDescription

_SETTLED = 0.05  # change of a speed from one half of a window to the other, below which it is not told
_SAMPLES, _LONGEST = 100, 20.0  # of a run that is fitted: a second, and at most those of so long [s]


class MujocoExport(ExportFormat):
    """A model of MuJoCo, its water fitted to the robot's own motion, and how far off it is."""

    name, ending = "mjcf", ".xml"
    options = ("--time",)

    def write(self, source: "RobotDescription", order: Order) -> None:
        """Write the model, and the controls of its actuators beside it."""
        package("mujoco", "mujoco")  # before what takes a while

        import numpy as np

        from nectosome.core import Status
        from nectosome.export.fluid_fit import fit_fluid
        from nectosome.export.mjcf import actuated, mjcf_of
        from nectosome.solve import simulate

        robot = build_weighed(source, order.what)
        model = mjcf_of(robot, source)
        controls = order.target.with_name(f"{order.target.stem}_controls.csv")
        if any(actuated(model.bodies)):
            check_target(controls, "FILE", ".csv", order.force)
        run = simulate(robot, order.seconds, samples=round(_SAMPLES * min(max(order.seconds, 1.0), _LONGEST)))
        if run.status != Status.SOLVED:
            raise InputError(f"its own motion has no solution: {Status(int(run.status)).reason}.", file=order.what)
        fit = fit_fluid(model, run)
        for words in model.left_out:
            tell(f"left out: {words}")
        if model.drives_left_out:
            what = "Only a part of the drives is" if fit.names else "No drive is"
            tell(f"{what} in the model. It lacks {'; '.join(model.drives_left_out)}.")
        tables, notes = list[Table](), list[str]()
        if model.carrying and (fit.names or not model.drives_left_out):
            both = ("ours", "here", fit.velocity), ("mujoco", "in MuJoCo", fit.velocity_there)
            rows = [
                (Label(key, where), *(Number(float(x), "m/s") for x in (*velocity, np.linalg.norm(velocity))))
                for key, where, velocity in both
            ]
            tables.append(Table("velocity", {"of": "mean velocity", **AXES, "size": "size"}, rows, computed=True))
            notes.append(f"means: over the second half of {order.seconds:.4g} s")
            for where, change in (("here", fit.change), ("in MuJoCo", fit.change_there)):
                if change > _SETTLED:
                    tell(f"the speed {where} still changes by {100 * change:.2g} % in that time: give a longer --time.")
        for share, of in ((fit.missed, "root mean square"), (fit.missed_along, "along the mean velocity")):
            if np.isfinite(share):
                notes.append(f"force of the water that MuJoCo misses, {of}: {100 * share:.3g} %")
        values = {"missed": Number(fit.missed), "missed_along": Number(fit.missed_along)}
        write(Summary(f"{source.name} as a model of MuJoCo", tables, notes=notes, values=values))
        if not np.isfinite(fit.velocity_there).all():
            tell("MuJoCo loses the motion with steps of 1 ms: make the timestep of the model smaller.")
        files = {order.target.name: model.text.encode()}
        if fit.names:
            files[controls.name] = fit.table.encode()
        write_all(order.target.parent, files, order.force)
