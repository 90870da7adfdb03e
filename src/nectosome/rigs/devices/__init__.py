"""Devices that rig files name: each module has the class of one, with what describes it; all of them are found."""
