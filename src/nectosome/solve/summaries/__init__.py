"""What runs, cycles and equilibria mean, as tables of numbers: printed, laid out by commands, kept as JSON."""
