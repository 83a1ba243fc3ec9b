"""The virtual controller with its connections, and the faults that can be caused there."""
