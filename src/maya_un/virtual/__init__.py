"""The other end of the wire: a DMC-41x3 that is not there. Its motors drive a plant, such as `maya_un.machine`."""
