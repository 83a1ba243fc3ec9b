"""Constants of the machine by the manual's names. To change one, change the configuration file (`maya config init`)."""

from maya_controller.config import configured

_values = configured.constants()

MAYA_ADDRESS = _values["MAYA_ADDRESS"]
COMS_SERVER_ADDRESS = _values["COMS_SERVER_ADDRESS"]

PULSES_PER_M = _values["PULSES_PER_M"]  # encoder counts per metre of lines b, c
PULSES_PER_DEG = _values["PULSES_PER_DEG"]  # encoder counts per degree of axis a

MAYA_HEIGHT = _values["MAYA_HEIGHT"]  # m, of the anchors above the table
MAYA_LENGTH = _values["MAYA_LENGTH"]  # m, from axis a to anchor c
DELTA = _values["DELTA"]  # m, from axis a to anchor b
SIGMA = _values["SIGMA"]  # m, from where the lines meet down to the gripper point

A_0 = _values["A_0"]  # rad
A_MAX = _values["A_MAX"]
B_0 = _values["B_0"]  # m
B_MAX = _values["B_MAX"]
C_0 = _values["C_0"]
C_MAX = _values["C_MAX"]

ACCEL_A = _values["ACCEL_A"]  # counts/s2
ACCEL_B = _values["ACCEL_B"]
ACCEL_C = _values["ACCEL_C"]
DCEL_A = _values["DCEL_A"]
DCEL_B = _values["DCEL_B"]
DCEL_C = _values["DCEL_C"]
SP_A = _values["SP_A"]  # counts/s
SP_B = _values["SP_B"]
SP_C = _values["SP_C"]
