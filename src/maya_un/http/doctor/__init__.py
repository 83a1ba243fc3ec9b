"""Checks of a robot, its service and its computer: findings with a meaning and a remedy."""
