"""The rowing paddle and robot of Hu et al. 2024."""
