"""Calibration by a running robot: points measured at its poses, and the fit of the constants to them."""
