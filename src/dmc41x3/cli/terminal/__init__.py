"""`dmc terminal`: talk to a controller by hand, and see what its axes do meanwhile."""
