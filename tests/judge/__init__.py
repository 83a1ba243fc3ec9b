"""An opinion of its own about motion: formulas from the manual and its errata, brute force instead of proofs.

Nothing here knows the robot's own mathematics. Accepted paths, and the record of the twin's mechanics, are measured
against the facts about the machine, at many points. All lengths are in metres.
"""
