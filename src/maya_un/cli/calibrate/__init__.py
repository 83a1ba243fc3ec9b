"""`maya calibrate`: measured points in, constants of the machine out, and the way between."""
