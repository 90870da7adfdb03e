"""PoseiDRONE (Giorgio-Serchi et al. 2017)."""
