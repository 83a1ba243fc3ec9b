"""An opinion of its own about motion: formulas from the manual and its errata, brute force instead of proofs.

Nothing here knows the robot's own mathematics. What the planner accepts, and what the twin's mechanics recorded, is
measured against what is written down about the machine, by looking at many points. All lengths are in metres.
"""
