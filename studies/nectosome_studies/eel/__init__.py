"""The eel that others computed from the Navier-Stokes equations, swum by forces that ask for none of their flow."""
