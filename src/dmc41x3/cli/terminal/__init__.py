"""`dmc terminal`: send commands to a controller interactively, with a view of its axes."""
