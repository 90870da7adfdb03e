"""A gallery of swimming robots: each swims from rest, and what it does and takes is told on a page."""
