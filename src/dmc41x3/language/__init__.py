"""The commands, programs, numbers and records of a DMC-41x3: functions of text and bytes, without input or output.

Names are imported from the modules, so that a program which only needs one of them loads in milliseconds.
"""
