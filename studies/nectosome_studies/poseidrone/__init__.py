"""PoseiDRONE of Giorgio-Serchi et al. 2017, an octopus-inspired robot that swims by a pulsed jet and crawls."""
