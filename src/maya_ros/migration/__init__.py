"""Finds what to change in scripts that were written for the original stack (ROS Kinetic, Python 2, 2019).

original      what the original had, what replaces it, and the rule for each difference; the only list
finding       a place in a file to which a rule applies
python        Python 2 and 3, by `syntax`; `commands` shell lines, DMC programs, definitions and CMake; `markup` XML
files         finds the files, reads them within bounds, and hands each to its reader

The new names come from their declarations: `maya_ros.graph`, `maya_un.events`, `maya_un.config`, `dmc41x3`. Nothing
is executed or changed.
"""
