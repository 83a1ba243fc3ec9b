"""Maya-UN: control software of the robot Maya, on a Galil DMC-41x3 or its virtual twin."""

__version__ = "0.1.0"

__all__ = ["__version__"]
