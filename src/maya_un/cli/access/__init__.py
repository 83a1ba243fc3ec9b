"""`maya lease` and `maya user`: the control lease, users and roles."""
