"""Measurements: bench files of any kind as recordings with units, and signals made of them."""
