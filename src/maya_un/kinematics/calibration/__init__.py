"""Calibration: the mechanism's constants fitted to measured points, and the poses at which to measure them.

Pure mathematics on arrays: counts and points in, constants and their uncertainty out. scipy is imported only when
something is fitted.
"""

from maya_un.kinematics.calibration.fit import Calibration, LineDifference, calibrate
from maya_un.kinematics.calibration.parameters import FITTED, WORDS, FittedConstants, Observations, named

__all__ = [
    "FITTED",
    "WORDS",
    "Calibration",
    "FittedConstants",
    "LineDifference",
    "Observations",
    "calibrate",
    "named",
]
