"""Tracking of videos, tested on rendered ones of which all is known."""
