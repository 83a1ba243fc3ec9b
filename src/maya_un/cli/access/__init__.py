"""`maya lease` and `maya user`: who drives, and who may what."""
