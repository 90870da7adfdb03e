"""Devices that rig files name: each module has the class of one, with what describes it; all of them are found."""

from nectosome.io.discovery import load_modules

load_modules(__name__)
