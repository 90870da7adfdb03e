"""Foils that flap, in a wind tunnel and in a vortex lattice, moved again with the load `foil`; nothing is fitted."""
