"""`maya calibrate`: fit the machine's constants to measured points."""
