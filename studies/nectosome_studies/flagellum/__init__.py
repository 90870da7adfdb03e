"""Armanini et al., "Model-based design optimization of underwater flagellate propellers"."""
