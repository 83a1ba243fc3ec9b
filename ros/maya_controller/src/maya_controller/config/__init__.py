"""Common values of all layers: constants of the machine, words of its events."""
