"""Tests that share one robot, launched once: each leaves it homed, at rest and with an empty queue."""
