"""The other end of the wire: a DMC-41x3 that is not there, and Maya's mechanics attached to it."""
