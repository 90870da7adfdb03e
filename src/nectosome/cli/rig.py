"""`nectosome rig`: a rig of any devices from its wiring to a campaign of recordings."""

from cyclopts import App

from nectosome.cli.command_list import command
from nectosome.cli.rig_check import rig_check
from nectosome.cli.rig_run import rig_run
from nectosome.cli.rig_sensors import rig_calibrate, rig_tare

rig = command(App(name="rig", help="Check a rig, set the zeros of its sensors, and take runs by a plan as a campaign."))
rig.command(rig_check, name="check")
rig.command(rig_tare, name="tare")
rig.command(rig_calibrate, name="calibrate")
rig.command(rig_run, name="run")
