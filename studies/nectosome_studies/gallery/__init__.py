"""A gallery of swimming robots: each swims from rest, and a page shows what it does and what power it takes."""
