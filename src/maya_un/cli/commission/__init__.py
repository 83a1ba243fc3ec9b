"""The command `maya commission`."""
