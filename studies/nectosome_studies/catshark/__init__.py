"""Catsharks that others measured, swum again from what they did with their bodies; nothing is fitted."""
