"""A simulator corrected by a few experiments, with honest errors, and which experiment to make next."""
