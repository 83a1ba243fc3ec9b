"""The virtual controller on its wires, and what can be made to go wrong there."""
