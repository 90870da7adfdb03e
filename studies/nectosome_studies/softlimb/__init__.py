"""A silicone beam and a foam limb that others filmed: identified from one recording each, the others predicted."""
