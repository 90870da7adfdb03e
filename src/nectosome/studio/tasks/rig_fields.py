"""The fields of the rig's tab: a signal for each command, or a reference and gains for one of them."""

from typing import Any, ClassVar

import viser

from nectosome.rigs.rig_file import RigFile

from .rig_request import NONE, REFERENCES, SIGNALS, first_reference, first_signal

_STILL = ("step", "constant")  # shapes without a frequency


class ShapeFields:
    """A shape, its size and its frequencies, of which those are seen that it has."""

    def __init__(self, gui: viser.GuiApi, label: str, shapes: tuple[str, ...], first: str):
        self.kind: Any = gui.add_dropdown(label, shapes, initial_value=first)
        self.size = gui.add_text("Size", "", hint="With its unit: the height of a step, the amplitude of a sine.")
        self.frequency = gui.add_text("Frequency", "0.5 Hz", hint="Of a chirp the first one.")
        self.to = gui.add_text("To", "5 Hz", hint="Last frequency of the chirp.")
        self.kind.on_update(lambda _: self._see())
        self._see()

    def _see(self) -> None:
        kind = self.kind.value
        self.size.visible = kind != NONE
        self.frequency.visible = kind not in (NONE, *_STILL)
        self.to.visible = kind == "chirp"


class Signals:
    """A shape for each command of a rig, in folders of the commands' names."""

    def __init__(self, gui: viser.GuiApi, place: viser.GuiFolderHandle):
        self._gui, self._place = gui, place
        self._folders: list[viser.GuiFolderHandle] = []
        self._shapes: dict[str, ShapeFields] = {}

    def renew(self, rig: RigFile) -> None:
        """Those of another rig: a small sine on the first command."""
        for folder in self._folders:
            folder.remove()
        self._folders, self._shapes = [], {}
        for k, command in enumerate(rig.rig.commands):
            with self._place:
                folder = self._gui.add_folder(command)
            with folder:
                shape = ShapeFields(self._gui, "Signal", SIGNALS, NONE if k else "sine")
            shape.size.value, shape.frequency.value = first_signal(rig, command)
            self._folders.append(folder)
            self._shapes[command] = shape

    @property
    def plan(self) -> dict[str, dict[str, str]]:
        """Signals as a plan has them, by command."""
        plan: dict[str, dict[str, str]] = {}
        for command, shape in self._shapes.items():
            kind, size = shape.kind.value, shape.size.value
            if kind == "step":
                plan[command] = {"kind": kind, "height": size}
            elif kind != NONE:
                plan[command] = {"kind": kind, "amplitude": size, "frequency": shape.frequency.value}
                plan[command] |= {"to": shape.to.value} if kind == "chirp" else {}
        return plan


class Tracking:
    """A pair of command and measurement, a reference, and gains."""

    labels: ClassVar = {
        "reference": "Size",
        "amplitude": "Size",
        "frequency": "Frequency",
        "to": "To",
        "gains": "Gains",
    }

    def __init__(self, gui: viser.GuiApi):
        self._rig: RigFile | None = None
        self._command: Any = gui.add_dropdown("Command", ("",))
        self._measurement: Any = gui.add_dropdown("Measurement", ("",))
        self._shape = ShapeFields(gui, "Reference", REFERENCES, "sine")
        self._gains = gui.add_text(
            "Gains", "", hint="K_p, K_i, K_d in the units of the command's range, of Size, and s. Empty: found on the "
            "model, where the rig has one.",
        )  # fmt: skip
        self._measurement.on_update(lambda _: self._chosen())

    def renew(self, rig: RigFile) -> None:
        """Names of another rig."""
        self._rig = rig
        self._command.options = tuple(rig.rig.commands) or ("",)
        self._measurement.options = tuple(rig.rig.measurements) or ("",)
        self._gains.value = ""
        self._chosen()

    @property
    def options(self) -> dict[str, str | None]:
        """Command, measurement, and the reference as `Reference.parse` takes it."""
        kind, size = self._shape.kind.value, self._shape.size.value
        still = kind == "constant"
        return {
            "command": self._command.value,
            "measurement": self._measurement.value,
            "reference": size if still else kind,
            "amplitude": None if still else size,
            "frequency": None if still else self._shape.frequency.value,
            "to": self._shape.to.value if kind == "chirp" else None,
        }

    @property
    def gains(self) -> str:
        """Gains as they are written."""
        return self._gains.value

    def _chosen(self) -> None:
        if self._rig is not None and self._measurement.value in self._rig.rig.measurements:
            self._shape.size.value = first_reference(self._rig, self._measurement.value)
