"""What `nectosome export` asks of a format: a class below `ExportFormat` in a module of this package is one."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from nectosome.cli.options import robot_named
from nectosome.cli.output import report
from nectosome.cli.starter_files import write_files
from nectosome.io import is_results, load_dataset
from nectosome.io.file_system import make_folder
from nectosome.units import InputError

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.description import RobotDescription


class Order(NamedTuple):
    """What to export, where to, and the options of some formats."""

    what: str
    settings: list[str]
    target: Path
    force: bool
    seconds: float
    commands: list[str]
    readings: list[str]
    step: float
    rtol: float
    atol: float

    @property
    def folder(self) -> Path:
        """Where files lie that the robot names."""
        return Path(self.what).parent

    def description(self) -> "RobotDescription":
        """The robot of a name or a file, or the one that a saved run is of. Raises InputError."""
        if not is_results(self.what):
            return robot_named(self.what, self.settings)

        from nectosome.description import apply_settings, parse_robot

        text = load_dataset(self.what).attrs.get("robot")
        if text is None:
            raise InputError("knows no robot. Give a robot file, or a saved run.", file=self.what)
        robot = parse_robot(str(text), self.what)
        return apply_settings(robot, self.settings) if self.settings else robot

    def run(self, instead: str) -> "xr.Dataset":
        """The saved run, with no settings. Raises InputError, with what to do with a robot instead."""
        if not is_results(self.what):
            why = "is no saved run. Save one: nectosome simulate ROBOT --save run.nc"
            raise InputError(f"{why}; {instead}.", field=self.what)
        if self.settings:
            raise InputError("is for a robot: a run is what it was. Leave it out.", field="--set")
        return load_dataset(self.what)


class ExportFormat:
    """A format of other programs; the first paragraph of its docstring is what the help says of it."""

    name: ClassVar[str]  # as --to has it
    ending: ClassVar[str]  # of its file; of a folder empty
    added: ClassVar[str] = ""  # to the name of the robot, of what is named after it
    instead: ClassVar[str] = ""  # of a format for saved runs: what there is for a robot
    options: ClassVar[tuple[str, ...]] = ()  # of the command, that no other format has

    def write(self, source: Any, order: Order) -> None:
        """Write a robot's description, or the dataset of a saved run, and tell what the format cannot hold."""
        raise NotImplementedError


def write_all(folder: Path, contents: dict[str, bytes], force: bool) -> None:
    """Write files below a folder, which is made if it is not there."""
    for inner in contents:
        make_folder((folder / inner).parent)
    write_files(folder, contents, (), force)
    report(*(folder / inner for inner in contents))
