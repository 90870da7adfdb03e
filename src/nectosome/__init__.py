"""nectosome: from a drawing to a tuned underwater soft robot."""
