"""What files that people write may hold: models of their fields, mistakes in them, and schemas for editors."""
